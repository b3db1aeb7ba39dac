"""Which mesh a body is tiled by and how many points its tiles have: the cheapest that resolve a rate and the body.

For integrands as fast as e^{i a u} on a tile of -1 < u < 1 Gauss's rule of p points leaves

    2^(2p) (p!)^4 a^(2p)/((2p + 1) (2p)!^3).

Few large tiles with many points cost less than many small ones with few, as far as the map onto the body is smooth on
them, which the integral of n tells: it is 0 over a closed surface.

Also here: which triangles a body of smooth pieces is tiled by and how many points they have: the cheapest that resolve
a rate.

As `creeping.geometry.tile_rules` of smooth bodies: many points on few triangles cost least where the rate asks for
them, few points where triangles must be small for the body's sake. The integral of n, 0 over a closed surface, tells
how small: it is made less until it is CLOSED, or, where the pieces do not meet any better, until it does not get less.

Also here: triangles of a body of smooth pieces, smaller where the body bends and towards its tips.

An edge between whose ends the normal turns by more than BEND, or that ends in a tip, is split in the middle, which is
put onto its piece, and the triangles on both sides of it with it, so that no gap opens between them:

    one edge split: 2 triangles,   two: 3,   three: 4

Along a rim triangles may be ASPECT times as long as across it: windows of sums over nodes are round.

Sources: [DR84, sec. 2.7]; Derivations, B11.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.geometry.curvature import principal_curvature_bound
from creeping.geometry.piecewise import Tiles, pieces_of, tiles_of
from creeping.geometry.surface import Surface, normal, project, size
from creeping.geometry.triangulation import quadrilaterals

CELLS, MOST_CELLS = 24, 120
"""Cells of the mesh that is taken first, and of the finest."""
FEWEST, MOST = 3, 10
"""Points of Gauss's rule along a side of a tile."""
COARSE = {6: 5, 8: 5, 12: 4, 16: 3}
"""Cells of coarser meshes, which are taken where they cost less, and fewest points on their tiles, which are curved."""
SHORT = 0.7
"""Longest tiles of these, over the least radius of curvature: the map onto the body is smooth on them."""
NEAR = 1.4
"""Rate times spacing of their nodes, at most: sums over nodes next to a point and of its own err more beyond."""
SMALL = 5e-3
"""Error of a tile for the fastest integrand, as a share of its area; over the body most of it cancels."""
CLOSED = 1e-6
"""Integral of n, as a share of the area, beyond which a mesh is too coarse for the body."""
KEPT = 4
"""Rules kept with a body."""

POINTS = (3, 4, 5, 6)
"""Points of Gauss's rule along a side of a triangle."""
LONGEST = 0.2
"""Longest sides, in body sizes."""
SMALLER = 3.7
"""Triangles of bodies over the square of their longest sides."""
LADDER, RUNGS = 1.1, 4
"""Ratio of the sides that are taken: neighbouring rates have one rule; and by how many they are shorter where the
integral of n is too large."""
CLOSED_PIECES, OPEN = 1e-4, 1e-3
"""Integral of n, as a share of the area, that is small enough, and beyond which pieces do not make a closed body."""
LESS = 0.5
"""Ratio by which it must become less with shorter sides to become less at all."""
NEARLY = 0.9
"""Share of triangles that were counted that there are at least with other sides."""
MOST_NODES = 3_000_000
"""Most nodes."""

BEND = 0.6
"""Largest angle between the normals at the ends of an edge, radians."""
ASPECT = 2.0
"""What an edge may be longer than one across the bend, by the most bent of its triangles."""
ROUNDS = 4
"""Times that an edge is split at most: at a tip the normal turns on any length."""
SAME = 1e-9
"""Distance of corners that are one, in body sizes."""
SPLITS = {
    1: ((0, 3, 2), (3, 1, 2)),
    3: ((3, 1, 4), (0, 3, 2), (3, 4, 2)),
    7: ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
}
"""Triangles for corners 0, 1, 2 and middles 3, 4, 5 of the edges 01, 12, 20, where 01, 01 and 12, or all are split."""


class Rules:
    """Rules of a body, sizes of its meshes, and the last mesh.

    ``make`` turns body, mesh and points into nodes (`creeping.geometry.quadrature.BodyNodes`); ``cells`` is that of the
    coarsest mesh, but for those of COARSE, that is not known to be too coarse, 0 if there is none.
    """

    def __init__(self, body: Surface, make: Callable[[Surface, tuple[FloatArray, IntArray], int], Any]) -> None:
        self._make = make
        self.rules: dict[tuple[int, int], Any] = {}
        self._sizes: dict[int, _Size] = {}
        self._mesh: tuple[int, tuple[FloatArray, IntArray]] | None = None
        # of each coarse mesh the most points that do not close, and the fewest that do
        self._closing = {cells: (0, MOST + 1) for cells in COARSE}
        # tiles about as large as the least radius of curvature
        vertices, tiles = self.mesh(body, CELLS)
        wanted = CELLS * float(np.median(_sides(vertices, tiles))) * principal_curvature_bound(body, vertices)
        self.cells = 0 if wanted > 2 * MOST_CELLS else max(CELLS, min(MOST_CELLS, round(0.3 * wanted)))
        self._coarsest = wanted / SHORT

    def rule(self, body: Surface, rate: float) -> tuple[int, int, int]:
        """Cells of the mesh, points along a side of its tiles, and the number of these, for a rate, 1/L."""
        # that of the coarsest mesh whose tiles, with few points, are small against the curvature
        cells = self.cells
        size = self.size(body, cells)
        points = points_for(0.5 * rate * size.edge)
        while points > MOST and cells < MOST_CELLS:
            cells = finer(cells)
            size = self.size(body, cells)
            points = points_for(0.5 * rate * size.edge)
        fine = cells, points, size.tiles
        if self.cells > CELLS:
            return fine
        meshes = [cells for cells in COARSE if cells >= self._coarsest]
        cheaper = [rule for cells in meshes for rule in self._coarse(body, rate, cells, fine)]
        closing = (rule for rule in sorted(cheaper, key=_cost) if self._closes(body, *rule[:2]))
        return next(closing, fine)

    def _coarse(self, body: Surface, rate: float, cells: int, fine: tuple[int, int, int]) -> list[tuple[int, int, int]]:
        """Rules of a coarse mesh which resolve the rate and cost less than the fine one, if the mesh is as the body."""
        size = self.size(body, cells)
        if size.handles != self.size(body, CELLS).handles:
            return []
        resolved = max(COARSE[cells], points_for(0.5 * rate * size.edge))
        rules = [(cells, points, size.tiles) for points in range(resolved, MOST + 1)]
        return [rule for rule in rules if _cost(rule) < _cost(fine) and rate * size.apart(rule[1]) <= NEAR]

    def _closes(self, body: Surface, cells: int, points: int) -> bool:
        """Whether a rule of a coarse mesh integrates n to 0; a mesh with more points does if one with fewer does."""
        fails, passes = self._closing[cells]
        if fails < points < passes:
            if self.nodes(body, cells, points).error <= CLOSED:
                passes = points
            else:
                fails = points
                self.rules.pop((cells, points))
            self._closing[cells] = fails, passes
        return points >= passes

    def nodes(self, body: Surface, cells: int, points: int) -> Any:
        """Nodes of a rule, kept; the last one used stands last."""
        return _kept(self.rules, (cells, points), lambda: self._make(body, self.mesh(body, cells), points))

    def mesh(self, body: Surface, cells: int) -> tuple[FloatArray, IntArray]:
        """Vertices and quadrilaterals of a mesh."""
        if self._mesh is None or self._mesh[0] != cells:
            fewest = min(cells, CELLS)
            self._mesh = cells, quadrilaterals(body, cells=cells, fewest=fewest)
        return self._mesh[1]

    def size(self, body: Surface, cells: int) -> "_Size":
        """Size of the tiles of a mesh."""
        if cells not in self._sizes:
            self._sizes[cells] = _Size.of(*self.mesh(body, cells))
        return self._sizes[cells]


def _kept(rules: dict[tuple[int, int], Any], key: tuple[int, int], make: Callable[[], Any]) -> Any:
    """Nodes of a rule, of which `KEPT` are kept; the last one used stands last."""
    rules[key] = rules.pop(key) if key in rules else make()
    while len(rules) > KEPT:
        rules.pop(next(iter(rules)))
    return rules[key]


@dataclass(frozen=True)
class _Size:
    """Of the tiles of a mesh the long side, L, nine of ten are shorter, the largest area, L^2, and their number.

    ``handles`` is the Euler characteristic.
    """

    edge: float
    area: float
    tiles: int
    handles: int

    @classmethod
    def of(cls, vertices: FloatArray, tiles: IntArray) -> "_Size":
        """Of a mesh."""
        longest = np.max(_sides(vertices, tiles), axis=1)
        first, second = np.moveaxis(vertices[tiles[:, 2:]] - vertices[tiles[:, :2]], 1, 0)
        area = 0.5 * float(np.max(np.linalg.norm(np.cross(first, second), axis=1)))
        return cls(float(np.quantile(longest, 0.9)), area, len(tiles), len(vertices) - len(tiles))

    def apart(self, points: int) -> float:
        """Spacing, L, of the nodes of Gauss's rule, about: that of its heaviest."""
        return math.sqrt(self.area) * _heaviest(points) / 2


@lru_cache
def _heaviest(points: int) -> float:
    """Largest weight of Gauss's rule on -1 < u < 1."""
    return float(np.max(np.polynomial.legendre.leggauss(points)[1]))


def _cost(rule: tuple[int, int, int]) -> int:
    """Nodes of a rule: cells, points along a side of its tiles, and the number of these."""
    return rule[2] * rule[1] ** 2


def _sides(vertices: FloatArray, tiles: IntArray) -> FloatArray:
    """Lengths of the sides of quadrilaterals (m, 4), L."""
    corners = vertices[tiles]
    return np.asarray(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1))


def finer(cells: int) -> int:
    """Cells of the next finer mesh."""
    return min(MOST_CELLS, cells + cells // 2)


def points_for(half: float) -> int:
    """Fewest points of Gauss's rule for e^{i half u} on -1 < u < 1."""
    for p in range(FEWEST, MOST + 1):
        log = 2 * p * math.log(2 * max(half, 1e-9)) + 4 * math.lgamma(p + 1) - 3 * math.lgamma(2 * p + 1)
        if log - math.log(2 * p + 1) < math.log(SMALL):
            return p
    return MOST + 1


class PieceRules:
    """Rules of a body of pieces, those kept, and which of them close.

    ``make`` turns body, sides, L, and points into nodes (`creeping.geometry.quadrature.BodyNodes`).
    """

    def __init__(self, body: Any, make: Callable[[Any, float, int], Any]) -> None:
        self._make = make
        self._rules: dict[tuple[int, int], Any] = {}
        self._area = float(np.sum(tiles_of(body, LONGEST).areas)) / size(body) ** 2
        # of each number of points the longest sides that may close, those that do, and what longer ones left
        self._rung = dict.fromkeys(POINTS, _rung(LONGEST))
        self._counts: dict[tuple[int, int], int] = {}
        self._tiles: dict[int, int] = {}
        self._left = dict.fromkeys(POINTS, np.inf)

    def rule(self, body: Any, rate: float) -> tuple[int, int, int]:
        """Rung of the sides, points along a side, and the number of nodes, for a rate, 1/L.

        More than MOST_NODES if that takes as many, or nothing closes.
        """
        while self._rung:
            few = list(self._rung)
            rungs = np.array([min(self._rung[p], _rung(2 * _HALVES[p] / (rate * size(body)))) for p in few])
            least = self._least_tiles(rungs) * np.square(few)
            counts = [self._counts.get((int(r), p), int(n)) for r, p, n in zip(rungs, few, least, strict=True)]
            best = int(np.argmin(counts))
            rung, points, count = int(rungs[best]), few[best], counts[best]
            if count > MOST_NODES or (rung, points) in self._counts:
                return rung, points, count
            nodes = self.nodes(body, rung, points)
            self._tiles[rung] = len(nodes.points) // points**2
            error, same = nodes.error, nodes.error > LESS * self._left[points]
            if error <= CLOSED_PIECES or (error <= OPEN and same):
                # more than their sides tell, where the body bends
                self._counts[rung, points] = len(nodes.points)
            elif same:
                del self._rung[points]
            else:
                self._rung[points], self._left[points] = rung - RUNGS, error
        return 0, 0, MOST_NODES + 1

    def _least_tiles(self, rungs: IntArray) -> FloatArray:
        """Triangles that there are at least: for the area, and where others were counted, by their number.

        A body of many small pieces has more than its area asks for. Of shorter sides there are as many, of longer ones
        fewer by the square, or nearly.
        """
        least = self._area / _sides_of_piece(rungs) ** 2 * SMALLER
        for rung, count in self._tiles.items():
            least = np.maximum(
                least, NEARLY * count * np.minimum(1.0, (_sides_of_piece(rung) / _sides_of_piece(rungs)) ** 2)
            )
        return np.asarray(least)

    def nodes(self, body: Any, rung: int, points: int) -> Any:
        """Nodes of a rule, kept; the last one used stands last."""
        side = float(_sides_of_piece(rung)) * size(body)
        return _kept(self._rules, (rung, points), lambda: self._make(body, side, points))


def _rung(share: float) -> int:
    """That of the longest sides up to a share of the body's size, no longer than LONGEST."""
    return int(np.floor(np.log(min(share, LONGEST)) / np.log(LADDER)))


def _sides_of_piece(rung: Any) -> FloatArray:
    """Sides, in body sizes."""
    return np.asarray(LADDER ** np.asarray(rung, dtype=float))


_HALVES = {p: float(max(half for half in np.arange(0.05, 20.0, 0.05) if points_for(half) <= p)) for p in POINTS}
"""Half the phase along a side up to which so many points do."""


def graded(body: Any, tiles: Tiles) -> Tiles:
    """Triangles whose edges turn by no more than BEND and end in no tip, or have been split ROUNDS times.

    Examples
    --------
    >>> import scatterers as sc
    >>> body = sc.Capsule(1.0, 4.0)
    >>> coarse = Tiles(*body.tiles(1.5))
    >>> fine = graded(body, coarse)
    >>> sharper = 2 * 4 * np.pi - coarse.areas.sum() > 3 * (2 * 4 * np.pi - fine.areas.sum())
    >>> len(coarse.pieces) < len(fine.pieces), bool(sharper)
    (True, True)
    """
    for _ in range(ROUNDS):
        edges, first = _edges(body, tiles)
        following = Tiles(np.roll(tiles.corners, -1, axis=1), np.roll(tiles.normals, -1, axis=1), tiles.pieces)
        angles = np.arccos(np.clip(np.sum(tiles.normals * following.normals, axis=2), -1.0, 1.0))
        lengths = np.linalg.norm(following.corners - tiles.corners, axis=2)
        curvature = np.max(angles / lengths, axis=1, keepdims=True)
        worst = np.zeros(len(first))
        np.maximum.at(worst, edges.ravel(), np.maximum(angles, lengths * curvature / ASPECT).ravel())
        turned = worst > BEND
        turned[edges[_at_tips(body, tiles)]] = True
        if not np.any(turned):
            break
        tiles = _split(body, tiles, edges, first, turned)
    return tiles


def _edges(body: Any, tiles: Tiles) -> tuple[IntArray, IntArray]:
    """Numbers of the edges 01, 12, 20 of each triangle (m, 3), and where among these 3m each edge is first."""
    grid = np.round(tiles.corners.reshape(-1, 3) / (SAME * size(body))).astype(np.int64)
    corners = np.unique(grid, axis=0, return_inverse=True)[1].reshape(-1, 3)
    pairs = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
    _, first, edges = np.unique(pairs, axis=0, return_index=True, return_inverse=True)
    return edges.reshape(-1, 3), first


def _at_tips(body: Any, tiles: Tiles) -> BoolArray:
    """Whether the edges 01, 12, 20 of each triangle end in a tip (m, 3)."""
    at = np.zeros(tiles.corners.shape[:2], dtype=bool)
    for crease in body.creases:
        if crease.kind == "tip":
            tip = np.ravel(np.asarray(crease.points, dtype=float))[:3]
            at |= np.linalg.norm(tiles.corners - tip, axis=2) < SAME * size(body)
    return at | np.roll(at, -1, axis=1)


def _split(body: Any, tiles: Tiles, edges: IntArray, first: IntArray, turned: BoolArray) -> Tiles:
    """Triangles with the ``turned`` of their edges split."""
    ends = tiles.corners, np.roll(tiles.corners, -1, axis=1)
    middles = (0.5 * (ends[0] + ends[1])).reshape(-1, 3)[first]
    owners = tiles.pieces[first // 3]
    pieces = pieces_of(body)
    for number in np.unique(owners[turned]):
        mine = turned & (owners == number)
        middles[mine] = project(pieces[number], middles[mine])
    marks = turned[edges]
    parts = [Tiles(*(values[~np.any(marks, axis=1)] for values in tiles))]
    for which in range(1, 8):
        wanted = np.array([which & 1, which & 2, which & 4], dtype=bool)
        these = np.flatnonzero(np.all(marks == wanted, axis=1))
        if not len(these):
            continue
        # turned so that the edges that are split come first
        shift = next(s for s in range(3) if sum(int(wanted[(i + s) % 3]) << i for i in range(3)) in SPLITS)
        order = (np.arange(3) + shift) % 3
        split = SPLITS[sum(int(wanted[order[i]]) << i for i in range(3))]
        points = np.concatenate([tiles.corners[these][:, order], middles[edges[these][:, order]]], axis=1)
        mine = tiles.pieces[these]
        added = _normals(pieces, points[:, 3:].reshape(-1, 3), np.repeat(mine, 3)).reshape(-1, 3, 3)
        sides = np.concatenate([tiles.normals[these][:, order], added], axis=1)
        parts += [Tiles(points[:, corners], sides[:, corners], mine) for corners in map(list, split)]
    return Tiles(*(np.concatenate(values) for values in zip(*parts, strict=True)))


def _normals(pieces: Any, points: FloatArray, owners: IntArray) -> FloatArray:
    """Normals at points (n, 3) of the pieces with these numbers."""
    out = np.empty_like(points)
    for number in np.unique(owners):
        mine = owners == number
        out[mine] = normal(pieces[number], points[mine])
    return out
