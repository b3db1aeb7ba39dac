"""Tiles of a body: parts of its squares, with p x p nodes each, and integrals next to them.

Nodes are those of Gauss's product rule in u and v, x_u x x_v = n dS/(du dv); on triangles of a few nodes, squares whose
side u = 0 is one point, where dS goes like u, the rule in u is Jacobi's for the weight u.

Sources: [DR84, sec. 2.7]; Derivations, F36.
"""

from dataclasses import dataclass
from functools import cache, cached_property
from itertools import chain

import numpy as np
from scipy.special import roots_jacobi

from creeping._typing import Any, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.geometry.patches import barycentric, interpolation, lobatto, on_squares
from creeping.kernels.threads import in_threads

POINTS = 5
"""p, nodes along a side of a tile."""
FINE = 12
"""Nodes along a side of a tile by which fields off it are summed."""
NEAR, NEAR_FEW = 1.4, 1.7
"""Distance of points from the middle of a tile, over its size, beyond which its nodes are summed: of four nodes a side
or more, and of fewer. Between 1.4 and 1.7 entries of the T-matrix of a sphere, ka = 10, change by 2e-8."""
APART, RULE = 1.0, 5
"""Distance of the middles of parts of a tile from a point, over their size, at least, and the points of their rule: of
coarse tiles one fewer."""
BESIDE, STEPS = 12, 8
"""Nodes next to a point whose tiles may be its own, and Newton steps to its place there."""
ASIDE = 1e-5
"""Least u of places: where the side u = 0 is one point there is no normal on it."""
TOGETHER = 2000
"""Points that are brought onto tiles at once."""
CLOSE = 3.0
"""Distance from fine nodes, in what they are apart, from which the solid angle is that of the nodes."""
FLAT, AT_EDGE = 1e-6, 1e-6
"""Difference of normals on a tile in a plane; distance of places on an edge, over that of the nodes next to it."""
ANGLES, RADII = 12, 6
"""Places along a side and radii of each of the four triangles about a node of its own."""


@cache
def gauss(points: int, *, conical: bool = False) -> tuple[FloatArray, FloatArray]:
    """Gauss's rule on 0 < u < 1, places and weights; the ``conical`` one is exact for u times polynomials.

    Examples
    --------
    >>> u, w = gauss(1, conical=True)
    >>> u.round(12), w.round(12)                    # the centroid of a triangle: int u du = 1/2
    (array([0.66666667]), array([0.75]))
    """
    if conical:
        u, w = roots_jacobi(points, 0.0, 1.0)
        return 0.5 * (1 + u), 0.5 * w / (1 + u)
    u, w = np.polynomial.legendre.leggauss(points)
    return 0.5 * (1 + u), 0.5 * w


On = tuple[IntArray, FloatArray, FloatArray]
"""Tiles on which points are (m,), and u and v there."""
Located = tuple[IntArray, FloatArray, FloatArray, FloatArray]
"""The same of the nearest places, and the distances from them, L."""
Near = tuple[IntArray, IntArray]
"""Where the points near each tile stand (t + 1,), and their numbers (pairs,)."""


@dataclass(frozen=True, eq=False)
class Tiles:
    """Tiles of a body.

    Attributes
    ----------
    shapes : (t, q + 1, q + 1, 3), L
        Points of each by u and v, at Lobatto's places of degree q; q = 1 of flat ones.
    points, normals : (t p p, 3), L and 1
        Nodes, tile by tile.
    weights : (t p p,), L^2
    p : int
    edges : (t, 4)
        Of tiles along an edge its number, the side u = 0, u = 1, v = 0 or v = 1 that lies on it, by 0 to 3, and where
        on the edge, 0 to 1, that side begins and ends; -1 throughout of others. On both faces tiles meet there.
    conical : bool
        Whether all are triangles with the conical rule in u.
    lacks : (float, float)
        What tiles of width w along an edge lack there, C = lacks B w^(2 nu) in terms of `edge_term`, of a hard and of
        a soft body, where that is known beforehand.
    off : float, L
        Mean distance from the body that they stand for.
    alone : bool
        Whether they, and not the body's F, tell what is inside: the body has more pieces than F knows apart.
    """

    shapes: FloatArray
    points: FloatArray
    normals: FloatArray
    weights: FloatArray
    p: int
    edges: FloatArray
    conical: bool = False
    lacks: tuple[float, float] = (0.0, 0.0)
    off: float = 0.0
    alone: bool = False

    @classmethod
    def of(
        cls,
        shapes: FloatArray,
        p: int,
        edges: FloatArray,
        *,
        conical: bool = False,
        lacks: tuple[float, float] = (0.0, 0.0),
    ) -> "Tiles":
        """Tiles of these shapes with p x p nodes."""
        return cls(shapes, *_nodes(shapes, p, conical), p, edges, conical, lacks)

    @property
    def count(self) -> int:
        """Number of tiles."""
        return len(self.shapes)

    @cached_property
    def planar(self) -> bool:
        """Whether each lies in a plane."""
        n = self.normals.reshape(self.count, -1, 3)
        return bool(np.max(np.ptp(n, axis=1), initial=0.0) < FLAT)

    @property
    def places(self) -> tuple[FloatArray, FloatArray]:
        """u and v of the nodes (p,)."""
        return gauss(self.p, conical=self.conical)[0], gauss(self.p)[0]

    @cached_property
    def middles(self) -> FloatArray:
        """Middles of the tiles (t, 3), L."""
        half = np.full((self.count, 1), 0.5)
        return np.ascontiguousarray(on_squares(self.shapes, half, half)[0][:, 0, 0])

    @cached_property
    def sizes(self) -> FloatArray:
        """Longer sides of the tiles (t,), L."""
        u, v = (np.linalg.norm(np.diff(self.shapes, axis=axis), axis=-1).sum(axis=axis) for axis in (1, 2))
        return np.asarray(np.maximum(u.max(axis=1), v.max(axis=1)))

    @property
    def _grid(self) -> FloatArray:
        """Places of the shapes."""
        return lobatto(self.shapes.shape[1] - 1)

    @cached_property
    def _tables(self) -> FloatArray:
        """x, x_u, x_v at the places of the shapes (t, n, n, 9)."""
        from creeping.geometry.patches import differentiation

        slope = differentiation(self._grid)
        u, v = np.einsum("ai,tijx->tajx", slope, self.shapes), np.einsum("bj,tijx->tibx", slope, self.shapes)
        return np.ascontiguousarray(np.concatenate([self.shapes, u, v], axis=-1))

    @property
    def _near_within(self) -> FloatArray:
        """How far from its middle a point is near to each tile (t,), L."""
        return np.asarray((NEAR if self.p >= POINTS - 1 else NEAR_FEW) * self.sizes)

    @cached_property
    def near_pairs(self) -> float:
        """Pairs of a node and a tile near to it, about, from 2 000 tiles: many where tiles are narrow."""
        from scipy.spatial import cKDTree

        some = slice(None, None, max(1, self.count // 2000))
        middles, within = self.middles[some], self._near_within[some]
        counts = cKDTree(self.points).query_ball_point(middles, within, return_length=True)
        return float(np.mean(counts)) * self.count

    def near(self, points: FloatArray) -> Near:
        """Where the points (m, 3) near each tile stand (t + 1,), and their numbers (pairs,)."""
        from scipy.spatial import cKDTree

        lists = cKDTree(points).query_ball_point(self.middles, self._near_within, return_sorted=True)
        starts = np.concatenate([[0], np.cumsum([len(one) for one in lists])]).astype(np.int64)
        return starts, np.fromiter(chain.from_iterable(lists), np.int64, starts[-1])

    def rows(self, points: FloatArray, near: Near, wavenumber: float, mode: int, own: On | None = None) -> ComplexArray:
        """Integrals of modes of `creeping.field.kernels.tile_rows` over tiles near points: (pairs, mode + 1, p p).

        ``own`` is the tile that each point is on, and u and v there, as of `located` and `own_places`.
        """
        from creeping.field.kernels.tile_rows import tile_rows

        starts, targets = near
        grid, (at_u, at_v) = self._grid, self.places
        rules = (*gauss(RULE - 1 if self.p == POINTS - 1 else RULE), *gauss(ANGLES), *gauss(RADII))
        nowhere = np.zeros(len(points))
        places = own or (np.full(len(points), -1), nowhere, nowhere)
        out = np.empty((len(targets), 6, self.p**2))
        given = (np.ascontiguousarray(points), starts, targets, self._tables, grid, barycentric(grid))
        nodes = at_u, barycentric(at_u), at_v, barycentric(at_v)
        rest = (*nodes, *rules, wavenumber, mode, APART, *places)

        def work(part: slice) -> None:
            tile_rows(*given, *rest, part.start, part.stop, out)

        in_threads(work, self.count, least=4, multiple=1)
        return np.asarray(out[:, : mode + 1] + 1j * out[:, 3 : mode + 4])

    def with_nodes(self, p: int) -> "Tiles":
        """The same tiles with p x p nodes."""
        return Tiles.of(self.shapes, p, self.edges, conical=self.conical, lacks=self.lacks)

    @cached_property
    def reach(self) -> FloatArray:
        """Lengths over which the polynomial of p x p nodes of each tile changes sign (t,), L."""
        return np.asarray(np.sqrt(self.sizes * self.widths) / (2 * self.p + 1))

    @property
    def finer(self) -> int:
        """Fine nodes along a side of a tile: FINE of POINTS, tiles of fewer nodes are smaller."""
        return max(self.p + 2, FINE * self.p // POINTS)

    @cached_property
    def fine(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The fine nodes of every tile: x and n (t finer^2, 3), and weights, L^2."""
        return _nodes(self.shapes, self.finer, self.conical)

    @cached_property
    def fine_tree(self) -> Any:
        """k-d tree of the fine nodes: distances from these are those from the body, to half their spacing."""
        from scipy.spatial import cKDTree

        return cKDTree(self.fine[0])

    def interpolated(self, values: ComplexArray) -> ComplexArray:
        """Values (n, ...) at the nodes, by the polynomials of tiles at the fine nodes (t finer^2, ...)."""
        by_u, by_v = self.onto(self.finer)
        each = values.reshape(self.count, self.p, self.p, -1)
        found = np.einsum("ai,bj,tijc->tabc", by_u, by_v, each, optimize=True)
        return np.asarray(found.reshape(-1, *values.shape[1:]))

    def onto(self, points: int) -> tuple[FloatArray, FloatArray]:
        """What the polynomials of nodes are at ``points`` of them along u and along v (points, p)."""
        u, v = self.places
        return interpolation(u, gauss(points, conical=self.conical)[0]), interpolation(v, gauss(points)[0])

    def interpolated_at(self, values: ComplexArray, tile: IntArray, u: FloatArray, v: FloatArray) -> ComplexArray:
        """Values (n, ...) at the nodes, by the polynomials of tiles (m,) at u and v: (m, ...)."""
        at_u, at_v = self.places
        each = values.reshape(self.count, self.p, self.p, -1)[tile]
        found = np.einsum("mi,mj,mijc->mc", interpolation(at_u, u), interpolation(at_v, v), each, optimize=True)
        return np.asarray(found.reshape(-1, *values.shape[1:]))

    @property
    def own_places(self) -> On:
        """Tile of each node, and u and v there: (n,) each."""
        at_u, at_v = (part.ravel() for part in np.meshgrid(*self.places, indexing="ij"))
        return np.repeat(np.arange(self.count), self.p**2), np.tile(at_u, self.count), np.tile(at_v, self.count)

    def located(self, points: FloatArray) -> Located:
        """The tile nearest to points (m, 3), u and v there, and the distance, L: (m,) each."""
        from scipy.spatial import cKDTree

        m, middles = len(points), self.middles
        beside = cKDTree(self.points).query(points, min(BESIDE, len(self.points)))[1] // self.p**2
        best = np.zeros(m, dtype=np.int64), np.zeros(m), np.zeros(m), np.full(m, np.inf)
        self._bring(points, np.repeat(np.arange(m), beside.shape[1]), beside.ravel(), best)
        # nodes of a narrow tile may hide a wide one next to it
        radii = np.linalg.norm(self.shapes - middles[:, None, None], axis=3).max(axis=(1, 2))
        for first in range(0, m, TOGETHER):
            some, off = points[first : first + TOGETHER], best[3][first : first + TOGETHER]
            reach = np.where((off > 0) & (off < self.sizes[best[0][first : first + TOGETHER]]), off, 0.0)
            nearer = np.linalg.norm(some[:, None] - middles, axis=2) - radii < reach[:, None]
            row, tile = np.nonzero(nearer & (reach > 0)[:, None])
            self._bring(points, first + row, tile, best)
        return best

    def inside(self, points: FloatArray) -> BoolArray:
        """Whether points (m, 3), L, are inside (m,): by the solid angle of the nodes, next to them by normals."""
        found = np.zeros(len(points), dtype=bool)
        away, nearest = self.fine_tree.query(points)
        close = away < CLOSE * np.sqrt(self.fine[2][nearest])
        points = np.array(points)
        if np.any(close):
            tile, u, v, off = self.located(points[close])
            x, n = self.on(tile, u, v)
            out = points[close] - x
            found[close] = np.sum(out * n, axis=1) < 0
            # before an acute edge there are places beneath the plane of one face: farther out it is clear
            edge = self.from_edge(tile, u, v) < AT_EDGE
            there = np.flatnonzero(close)[edge]
            reach = CLOSE * np.sqrt(self.fine[2][nearest[there]]) / np.maximum(off[edge], 1e-300)
            points[there] = x[edge] + np.maximum(reach, 1.0)[:, None] * out[edge]
            close[there] = False
        apart = np.flatnonzero(~close)
        strength = (self.normals * self.weights[:, None]).T
        for first in range(0, len(apart), TOGETHER // 10):
            some = apart[first : first + TOGETHER // 10]
            y = self.points.T[:, None] - points[some].T[:, :, None]
            angle = np.einsum("xn,xmn->mn", strength, y) / np.sum(y**2, axis=0) ** 1.5
            found[some] = angle.sum(axis=1) > 2 * np.pi
        return found

    def _bring(self, points: FloatArray, row: IntArray, tile: IntArray, best: Located) -> None:
        """Put into ``best``, as of `located`, what is nearer of points with numbers (n,) on tiles (n,)."""
        if not len(row):
            return
        row, tile = np.unique(np.stack([row, tile]), axis=1)
        x, shapes = points[row], self.shapes[tile]
        u, v = np.full((2, len(row)), 0.5)
        for _ in range(STEPS):
            there, along, across = (part[:, 0, 0] for part in on_squares(shapes, u[:, None], v[:, None]))
            T = np.stack([along, across], axis=2)
            A = np.swapaxes(T, 1, 2) @ T
            # where a square is one point x_v is 0
            A[:, [0, 1], [0, 1]] += 1e-12 * np.trace(A, axis1=1, axis2=2)[:, None]
            step = np.linalg.solve(A, np.einsum("mxc,mx->mc", T, x - there)[..., None])[..., 0]
            u, v = np.clip(u + step[:, 0], ASIDE, 1.0), np.clip(v + step[:, 1], 0.0, 1.0)
        off = np.linalg.norm(x - on_squares(shapes, u[:, None], v[:, None])[0][:, 0, 0], axis=1)
        order = np.lexsort([off, row])
        first = order[np.flatnonzero(np.diff(row[order], prepend=-1))]
        closer = first[off[first] < best[3][row[first]]]
        for lane, values in zip(best, (tile, u, v, off), strict=True):
            lane[row[closer]] = values[closer]

    @cached_property
    def widths(self) -> FloatArray:
        """Shorter sides of the tiles (t,), L, about."""
        return np.asarray(self.weights.reshape(self.count, -1).sum(axis=1) / self.sizes)

    def from_edge(self, tile: IntArray, u: FloatArray, v: FloatArray) -> FloatArray:
        """Distance of places of tiles (m,) from their edge over that of the nodes next to it; infinite on others."""
        side = self.edges[tile, 1]
        along = np.where(side < 2, u, v)
        away = np.where(side % 2 == 0, along, 1 - along)
        return np.where(side < 0, np.inf, away / gauss(self.p)[0][0])

    def on(self, tile: IntArray, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Points of tiles (m,) at u and v, and unit normals there: (m, 3) each."""
        x, along, across = (part[:, 0, 0] for part in on_squares(self.shapes[tile], u[:, None], v[:, None]))
        n = np.cross(along, across)
        return x, n / np.linalg.norm(n, axis=1, keepdims=True)


def _nodes(shapes: FloatArray, points: int, conical: bool) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Gauss's nodes of tiles (t, n, n, 3), ``points`` along a side: x and n (t points^2, 3), and weights, L^2."""
    (u, by_u), (v, by_v) = gauss(points, conical=conical), gauss(points)
    x, along, across = on_squares(shapes, *(np.broadcast_to(at, (len(shapes), points)) for at in (u, v)))
    area = np.cross(along, across)
    scale = np.linalg.norm(area, axis=-1)
    normals = (area / scale[..., None]).reshape(-1, 3)
    return np.ascontiguousarray(x.reshape(-1, 3)), normals, (scale * np.outer(by_u, by_v)).ravel()
