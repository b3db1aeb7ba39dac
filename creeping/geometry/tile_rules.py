"""Which mesh a body is tiled by and how many points its tiles have: the cheapest that resolve a rate and the body.

For integrands as fast as e^{i a u} on a tile of -1 < u < 1 Gauss's rule of p points leaves

    2^(2p) (p!)^4 a^(2p)/((2p + 1) (2p)!^3).

Few large tiles with many points cost less than many small ones with few, as far as the map onto the body is smooth on
them, which the integral of n tells: it is 0 over a closed surface.

Sources: [DR84, sec. 2.7]; Derivations, B11.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping.geometry.curvature import principal_curvature_bound
from creeping.geometry.surface import Surface
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
        fine = self._fine(body, rate)
        if self.cells > CELLS:
            return fine
        meshes = [cells for cells in COARSE if cells >= self._coarsest]
        cheaper = [rule for cells in meshes for rule in self._coarse(body, rate, cells, fine)]
        closing = (rule for rule in sorted(cheaper, key=_cost) if self._closes(body, *rule[:2]))
        return next(closing, fine)

    def _fine(self, body: Surface, rate: float) -> tuple[int, int, int]:
        """That of the coarsest mesh whose tiles, with few points, are small against the curvature."""
        cells = self.cells
        size = self.size(body, cells)
        points = points_for(0.5 * rate * size.edge)
        while points > MOST and cells < MOST_CELLS:
            cells = finer(cells)
            size = self.size(body, cells)
            points = points_for(0.5 * rate * size.edge)
        return cells, points, size.tiles

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
        key = cells, points
        made = self.rules.pop(key) if key in self.rules else self._make(body, self.mesh(body, cells), points)
        self.rules[key] = made
        while len(self.rules) > KEPT:
            self.rules.pop(next(iter(self.rules)))
        return made

    def mesh(self, body: Surface, cells: int) -> tuple[FloatArray, IntArray]:
        """Vertices and quadrilaterals of a mesh."""
        if self._mesh is None or self._mesh[0] != cells:
            fewest = min(cells, CELLS)
            self._mesh = cells, quadrilaterals(body.level, body.gradient, body.bounds, cells=cells, fewest=fewest)
        return self._mesh[1]

    def size(self, body: Surface, cells: int) -> "_Size":
        """Size of the tiles of a mesh."""
        if cells not in self._sizes:
            self._sizes[cells] = _Size.of(*self.mesh(body, cells))
        return self._sizes[cells]


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
