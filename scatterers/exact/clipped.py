"""A closed triangulation cut where the piece changes, and the creases along the cuts.

On a side between pieces a and b the cut is the point nearest to the middle with F_a = F_b = 0, by Newton's steps of
least length where the normals differ,

    x <- x - J^T (J J^T)^-1 (F_a, F_b),   J = (grad F_a, grad F_b),

and by halving on the body where they do not. A triangle on three pieces is cut from the point that is on all of them.

Also here: closed triangulation of F = 0 by tetrahedra: each cube of a grid is cut into six along its diagonal.

Where F changes its sign along an edge of a tetrahedron the place is found by halving, so that F needs to be continuous
only. A tetrahedron with one node of its own sign gives a triangle, one with two gives two.

Sources: [C76, sec. 2-2].
"""

from collections.abc import Callable, Sequence
from itertools import permutations
from typing import Literal, NamedTuple

import numpy as np

from creeping._typing import FloatArray, IntArray
from scatterers.body import Crease, Levelled, Piece, normals_of
from scatterers.charts.samples import Field, sampled, towards
from scatterers.triangles.regions import curves
from scatterers.triangles.topology import cut, edges_of


class Clipped(NamedTuple):
    """A closed mesh whose triangles lie on one piece each.

    Attributes
    ----------
    vertices, triangles : (n, 3), L, and (m, 3)
        Counter-clockwise from outside.
    pieces : (m,)
    """

    vertices: FloatArray
    triangles: IntArray
    pieces: IntArray

    @property
    def corners(self) -> FloatArray:
        """Corners (m, 3, 3), L."""
        return self.vertices[self.triangles]


def clip(
    body: Levelled, pieces: list[Piece], numbers: Callable[..., IntArray], points: FloatArray, triangles: IntArray
) -> Clipped:
    """Triangles (m, 3) with corners among points (n, 3), L, on the body, cut where the number of the piece changes."""
    kind = numbers(points)
    a, b, c = triangles.T
    three = (kind[a] != kind[b]) & (kind[b] != kind[c]) & (kind[c] != kind[a])
    middle = _on_all(pieces, points[triangles[three]].mean(axis=1), kind[triangles[three]])
    new = len(points) + np.arange(len(middle))
    fans = [np.stack([start[three], end[three], new], axis=1) for start, end in ((a, b), (b, c), (c, a))]
    points, triangles = np.concatenate([points, middle]), np.concatenate([triangles[~three], *fans])
    # what is on several has no number
    kind = np.concatenate([kind, np.full(len(middle), -1)])
    start, end = edges_of(triangles).ends.T
    at = np.flatnonzero((kind[start] != kind[end]) & (kind[start] >= 0) & (kind[end] >= 0))
    a, b, ka, kb = points[start[at]], points[end[at]], kind[start[at]], kind[end[at]]
    middles = 0.5 * (a + b)
    na, nb = (normals_of(pieces, middles, k) for k in (ka, kb))
    # at a smaller angle both levels together do not tell the place
    steep = np.linalg.norm(np.cross(na, nb), axis=-1) > 1e-3
    between = middles.copy()
    between[steep] = _on_all(pieces, middles[steep], np.stack([ka, kb], axis=-1)[steep])
    # where the surfaces do not meet within a cell, and where they touch; the sides of an acute edge cut it short
    far = np.linalg.norm(between - middles, axis=-1) > np.max(np.linalg.norm(b - a, axis=-1), initial=0.0)
    halved = (~steep | far) & (ka != kb)
    low, high, first = a[halved], b[halved], ka[halved]
    for _ in range(np.finfo(float).nmant):
        half = towards(body.compiled, 0.5 * (low + high), 3)
        same = (numbers(half) == first)[:, None]
        low, high = np.where(same, half, low), np.where(same, high, half)
    between[halved] = 0.5 * (low + high)
    vertices, triangles = cut(points, triangles, at, between)
    kind = np.concatenate([kind, np.full(len(at), -1)])
    return Clipped(vertices, triangles, kind[triangles].max(axis=1))


def _on_all(pieces: Sequence[Levelled], points: FloatArray, which: IntArray) -> FloatArray:
    """Points (n, 3) moved to where the levels of their pieces (n, k) are all 0."""
    # relative singular values below which pieces touch: rounding of F would be divided by them
    touching = 1e-12
    points = points.copy()
    for numbers in np.unique(which, axis=0):
        mine = np.all(which == numbers, axis=1)
        x = points[mine]
        for _ in range(20):
            value = np.stack([pieces[k].level(x) for k in numbers], axis=-1)
            slope = np.stack([pieces[k].gradient(x) for k in numbers], axis=-2)
            x = x - (np.linalg.pinv(np.nan_to_num(slope), rcond=touching) @ np.nan_to_num(value)[..., None])[..., 0]
        points[mine] = x
    return points


def normals(pieces: Sequence[Levelled], corners: FloatArray, which: IntArray) -> FloatArray:
    """Unit normals (m, 3, 3) of pieces (m,) at the corners (m, 3, 3), L, of their triangles."""
    return normals_of(pieces, corners.reshape(-1, 3), np.repeat(which, 3)).reshape(corners.shape)


def creases(pieces: Sequence[Levelled], clipped: Clipped, spacing: float) -> list[Crease]:
    """Edges, joints and seams along the cuts of a triangulation with this spacing, L.

    What is shorter than the spacing is not resolved: several pieces that meet in a point seem to have curves there.
    """
    edges = edges_of(clipped.triangles)
    sides = clipped.pieces[edges.sides // 3]
    between = sides[:, 0] != sides[:, 1]
    found = []
    for (a, b), chain, _ in curves(edges.ends[between], sides[between], len(clipped.vertices)):
        # points closer than half the spacing are left out
        points = _thinned(clipped.vertices[chain], 0.5 * spacing)
        if np.sum(np.linalg.norm(np.diff(points, axis=0), axis=1)) < spacing:
            continue
        na, nb = (normals_of(pieces, points, np.full(len(points), k)) for k in (a, b))
        turn = np.arctan2(np.linalg.norm(np.cross(na, nb), axis=-1), np.sum(na * nb, axis=-1))
        angle = float(np.nanmax(turn))
        kind: Literal["edge", "joint", "seam"] = "edge" if angle > 1e-5 else "joint"
        # where pieces that touch end on a third one, their end is not known as well as the rest
        within = points[1:-1] if len(points) > 2 else points
        if kind == "joint" and not _bent(pieces[a], pieces[b], within):
            kind = "seam"
        found.append(Crease(kind, (a, b), points, angle if kind == "edge" else 0.0))
    return found


def _bent(one: Levelled, other: Levelled, points: FloatArray) -> bool:
    """Whether the curvatures of two pieces differ somewhere along a curve."""
    of_each = []
    for piece in (one, other):
        gradient = piece.gradient(points)
        slope = np.linalg.norm(gradient, axis=-1)[:, None, None]
        n = gradient[:, :, None] / slope
        flat = np.eye(3) - n * n.swapaxes(1, 2)
        of_each.append(flat @ piece.hessian(points) @ flat / slope)
    largest = max(float(np.max(np.abs(shape))) for shape in of_each)
    return bool(np.max(np.abs(of_each[0] - of_each[1])) > 1e-6 * largest)


def _thinned(points: FloatArray, apart: float) -> FloatArray:
    """Points (n, 3) of a curve with its ends, others left out that are nearer than that to the one before, L."""
    kept = [0]
    for k in range(1, len(points) - 1):
        if np.linalg.norm(points[k] - points[kept[-1]]) > apart:
            kept.append(k)
    return points[[*kept, len(points) - 1]]


def march(level: Field, box: FloatArray, spacing: float) -> tuple[FloatArray, IntArray]:
    """Points (n, 3), L, on F = 0 inside a box (2, 3) and triangles (m, 3), counter-clockwise from outside.

    Raises
    ------
    ValueError
        If the grid is too large, or F has no sign change on it.
    """
    # corners of the six tetrahedra of a cube, as steps from its first node
    steps = np.array(
        [
            np.cumsum([np.zeros(3, dtype=np.int64), *(np.eye(3, dtype=np.int64)[list(p)])], axis=0)
            for p in permutations(range(3))
        ]
    )
    samples = sampled(level, box, spacing)
    inside = samples.values < 0
    corners = [inside[i : i - 1 or None, j : j - 1 or None, k : k - 1 or None] for i, j, k in np.ndindex(2, 2, 2)]
    total = np.sum(corners, axis=0)
    cubes = np.argwhere((total > 0) & (total < 8))
    if not len(cubes):
        raise ValueError("F has no sign change in its box: no body, or tiles larger than it")
    nodes = (cubes[:, None, None] + steps).reshape(-1, 4, 3)
    number = np.asarray(np.ravel_multi_index(tuple(np.moveaxis(nodes, -1, 0)), inside.shape), dtype=np.int64)
    below = inside.ravel()[number]
    count = below.sum(axis=1)
    # nodes inside first
    a, b, c, d = np.take_along_axis(number, np.argsort(~below, axis=1, kind="stable"), axis=1).T
    # each corner of a triangle by the nodes inside and outside between which it lies: (m, 3, 2)
    ends: IntArray = np.concatenate(
        [
            np.stack(
                [np.stack([one[count == wanted], other[count == wanted]], axis=-1) for one, other in pairs], axis=1
            )
            for wanted, pairs in (
                (1, [(a, b), (a, c), (a, d)]),
                (2, [(a, c), (a, d), (b, d)]),
                (2, [(a, c), (b, d), (b, c)]),
                (3, [(a, d), (b, d), (c, d)]),
            )
        ]
    )
    pairs, triangles = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    inner, outer = (
        samples.origin + spacing * np.stack(np.unravel_index(end, inside.shape), axis=-1) for end in pairs.T
    )
    # by halving: F is continuous only
    low, high = np.zeros(len(pairs)), np.ones(len(pairs))
    for _ in range(np.finfo(float).nmant):
        middle = 0.5 * (low + high)
        within = level(inner + middle[:, None] * (outer - inner)) < 0
        low, high = np.where(within, middle, low), np.where(within, high, middle)
    points = inner + (0.5 * (low + high))[:, None] * (outer - inner)
    # normals point to the nodes outside; by the middles of the grid's edges, as a triangle may be a sliver
    triangles = triangles.reshape(-1, 3)
    x = (0.5 * (inner + outer))[triangles]
    normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    back = np.sum(normal * (outer - inner)[triangles].sum(axis=1), axis=-1) < 0
    return points, np.where(back[:, None], triangles[:, ::-1], triangles)
