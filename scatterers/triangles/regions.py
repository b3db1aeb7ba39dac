"""Smooth regions of a triangle mesh, and the creases between them.

Triangles in one plane (neighbours turned by less than half a degree) make facets. An edge of the mesh is a crease if
its triangles are turned by more than `SHARP` degrees and thrice the median, or by more than 12 degrees and 6 medians
where neither facet is turned about as much against another neighbour: there a round surface is no explanation for it.
Creases stand in chains: sharp edges that stand alone are those of slivers, and of folds of a coarse mesh. Regions are
what is connected without crossing a crease.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from scatterers.body import Crease
from scatterers.triangles.topology import components, edges_of, flat_normals

SHARP, ALWAYS = 40.0, 60.0
"""Degrees; beyond the last an edge is sharp whatever the others are."""
FEWEST = 6
"""Edges of a chain, unless all are turned by more than `ALWAYS`, as those of a tetrahedron."""


@dataclass(frozen=True, eq=False)
class Regions:
    """Regions of a closed mesh.

    Attributes
    ----------
    number : (m,)
        Region of each triangle.
    ends, sides : (e, 2)
        Vertices and triangles of each edge.
    turn : (e,)
        Angle across it, degrees, < 0 if concave.
    crease : (e,) bool
        Which edges bound regions.
    level : (e,) bool
        Which of those have one normal on both sides, as where a fillet begins.
    """

    number: IntArray
    ends: IntArray
    sides: IntArray
    turn: FloatArray
    crease: BoolArray
    level: BoolArray

    @property
    def count(self) -> int:
        """How many."""
        return int(self.number.max()) + 1

    @cached_property
    def joined(self) -> IntArray:
        """Pairs of triangles (k, 2) that are neighbours across an edge that is no crease."""
        return np.asarray(self.sides[~self.crease])

    def creases(self, vertices: FloatArray, piece: IntArray) -> tuple[Crease, ...]:
        """Edges, joints, and seams between pieces (m,) of triangles of one region, as curves."""
        sides = piece[self.sides]
        seam = ~self.crease & (sides[:, 0] != sides[:, 1])
        found: tuple[Crease, ...] = ()
        for kind, which in (("edge", self.crease & ~self.level), ("joint", self.level), ("seam", seam)):
            turns = np.radians(np.abs(self.turn[which])) * (kind == "edge")
            for pair, chain, edges in curves(self.ends[which], sides[which], len(vertices)):
                found += (Crease(kind, pair, vertices[chain], float(np.max(turns[edges]))),)
        return found


def regions_of(
    vertices: FloatArray,
    triangles: IntArray,
    *,
    sharp: BoolArray | None = None,
    level: BoolArray | None = None,
) -> Regions:
    """Regions of a closed, oriented mesh: (n, 3), L, and (m, 3).

    Parameters
    ----------
    sharp : (e,) bool, optional
        Which edges, in the order of `scatterers.triangles.topology.edges_of`, are creases, where it is known.
    level : (e,) bool, optional
        Which other edges bound regions without a jump of the normal.

    Examples
    --------
    >>> import trimesh
    >>> rod = trimesh.creation.cylinder(radius=1.0, height=3.0, sections=48)
    >>> found = regions_of(rod.vertices, rod.faces)
    >>> found.count, [crease.closed for crease in found.creases(rod.vertices, found.number)]
    (3, [True, True])
    """
    ends, sides, turn = turns_of(vertices, triangles)
    crease = _chained(ends, turn, _piecewise(sides, turn, len(triangles)) if sharp is None else sharp, len(vertices))
    level = np.zeros_like(crease) if level is None else level & ~crease
    bounds = crease | level
    return Regions(_connected(len(triangles), sides[~bounds]), ends, sides, turn, bounds, level)


def turns_of(vertices: FloatArray, triangles: IntArray) -> tuple[IntArray, IntArray, FloatArray]:
    """Ends (e, 2), triangles (e, 2) and the turn (e,), degrees, of the edges of a closed mesh."""
    edges = edges_of(triangles)
    # both corners of each edge, that of the triangle that runs forward along it first
    order = np.lexsort((~edges.forward, edges.number)).reshape(-1, 2)
    normal = flat_normals(vertices[triangles])[0]
    sides = order // 3
    left, right = normal[sides[:, 0]], normal[sides[:, 1]]
    across = np.cross(left, right)
    along = vertices[edges.ends[:, 1]] - vertices[edges.ends[:, 0]]
    turn = np.degrees(np.arctan2(np.linalg.norm(across, axis=1), np.sum(left * right, axis=1)))
    # the left triangle runs forward along the edge: at a convex edge left x right points along it
    turn = np.where(np.sum(across * along, axis=1) >= 0, turn, -turn)
    return edges.ends, sides, turn


def _piecewise(sides: IntArray, turn: FloatArray, count: int) -> BoolArray:
    """Edges at which no smooth surface goes through the triangles."""
    size = np.abs(turn)
    sharp = ((size > SHARP) & (size > 3 * np.median(size))) | (size > ALWAYS)
    facet = _connected(count, sides[size < 0.5])
    # pairs of neighbouring facets, with the turn between them where it may be that of a round surface
    pair = np.sort(facet[sides], axis=1)
    other = (pair[:, 0] != pair[:, 1]) & ~sharp
    found, inverse = np.unique(pair[other], axis=0, return_inverse=True)
    between = np.zeros(len(found))
    np.maximum.at(between, inverse.ravel(), size[other])
    # the largest and the second largest turn of each facet, against different neighbours
    facets = int(facet.max()) + 1
    first, second, partner = np.zeros(facets), np.zeros(facets), np.full(facets, -1)
    order = np.argsort(-between)
    for side in (0, 1):
        for k in order:
            mine, theirs, turn = found[k, side], found[k, 1 - side], between[k]
            if turn > first[mine]:
                first[mine], second[mine], partner[mine] = turn, first[mine], theirs
            elif turn > second[mine] and theirs != partner[mine]:
                second[mine] = turn
    mine = np.flatnonzero((size > max(12.0, 6.0 * float(np.median(size)))) & ~sharp)
    ends = facet[sides[mine]]
    besides = np.where(partner[ends] == ends[:, ::-1], second[ends], first[ends])
    # a facet that turns about as much against another neighbour is one of a round surface
    alone = np.all(besides < 0.4 * size[mine, None], axis=1)
    sharp[mine[alone]] = True
    return np.asarray(sharp)


def _chained(ends: IntArray, turn: FloatArray, crease: BoolArray, count: int) -> BoolArray:
    """Creases without those of chains of fewer edges than `FEWEST`."""
    at = np.flatnonzero(crease)
    if not len(at):
        return crease
    label = _connected(count, ends[at])[ends[at, 0]]
    count_of = np.bincount(label)
    always = np.bincount(label, np.abs(turn[at]) > ALWAYS) == count_of
    enough = ((count_of >= FEWEST) | (always & (count_of >= 3)))[label]
    kept = np.zeros_like(crease)
    kept[at[enough]] = True
    return kept


def _connected(count: int, pairs: IntArray) -> IntArray:
    return components(count, pairs[:, 0], pairs[:, 1])[1]


def curves(ends: IntArray, pair: IntArray, count: int) -> list[tuple[tuple[int, int], list[int], list[int]]]:
    """Edges (k, 2) between ``count`` vertices, joined to curves: pieces on both sides, vertices, and edges by numbers.

    There is one for each pair (k, 2) of pieces and stretch between points at which other than two edges meet.
    """
    meeting = np.bincount(ends.ravel(), minlength=count)
    pairs, which = np.unique(np.sort(pair, axis=1), axis=0, return_inverse=True)
    found = []
    for k, (first, second) in enumerate(pairs.tolist()):
        mine = np.flatnonzero(which.ravel() == k)
        found += [((first, second), chain, mine[edges].tolist()) for chain, edges in _chains(ends[mine], meeting)]
    return found


def _chains(ends: IntArray, meeting: IntArray) -> list[tuple[list[int], list[int]]]:
    """Vertices and edges of the curves that edges (k, 2) make, ended where more than two creases meet."""
    at: dict[int, list[tuple[int, int]]] = {}
    for number, (a, b) in enumerate(ends.tolist()):
        at.setdefault(a, []).append((b, number))
        at.setdefault(b, []).append((a, number))

    def ending(vertex: int) -> bool:
        return len(at[vertex]) != 2 or int(meeting[vertex]) != 2

    used: set[int] = set()
    found = []
    # open curves first: what is left afterwards are rings
    for start in [v for v in at if ending(v)] + list(at):
        for onward, number in at[start]:
            if number in used:
                continue
            chain, edges, here, edge = [start], [], onward, number
            while True:
                used.add(edge)
                edges.append(edge)
                chain.append(here)
                after = [step for step in at[here] if step[1] not in used]
                if here == start or ending(here) or not after:
                    break
                here, edge = after[0]
            found.append((chain, edges))
    return found
