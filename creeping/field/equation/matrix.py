"""The matrix of a body's integral equation, asked on two surfaces at once.

    hard        (1 - M) u = 2 u_inc                 M = 2 int dG/dn_y dS
    impedance   (1 - M) u = 2 u_inc                 M = 2 int (dG/dn_y + ik eta G) dS
    soft        (1 + M*) q = 2 du_inc/dn            M* the transpose of the hard one in the weights
    conductor   (1 - M) J = 2 n x H_inc             M = 2 int [grad_x G (n_x.J) - J (n_x.grad_x G)] dS

less i times the same at x' = x - h n, kh = pi/2, where there is no 1, and where soft bodies have their own dG/dn_x.
u(x) - M u and M u (x') are what the field that u gives inside the body is, at its surface and under it, so both are 0:
one of them alone has the resonances of the interior, the two together have none.

In the unknowns u sqrt(w) the transpose in the weights is that of the matrix. What a tile sends to points near it is
integrated with the polynomials through its nodes, of J by Cartesian components less their part along the normal.

Also here: what a current along an edge that the equation does not see may add to the far field: a part of its error.

Across an edge of exterior angle N pi, with nu = 1/N and rho the distance from it, on the faces + and -,

    hard, impedance   u = A + A' rho^(2 nu) + A'' rho^2 +- [B rho^nu + B' rho^(3 nu) + C rho^-nu]
    soft              rho du/dn = +-[A rho^(2 nu) + A' rho^(4 nu)] + B rho^nu + B' rho^(3 nu) + C rho^-nu
    conductor         J across the edge as u; J along it, times k, as du/dn

C is forbidden: its energy is infinite. It is a wave C' H_nu(k rho) from the edge that cancels inside the body, so that
extinction does not know it, with |C| = |C'| (Gamma(nu)/pi) (2/k)^nu, nu times that if soft; straight or curved, the
edge radiates

    f(r) = (1/pi) int C' e^{-ik r.x} dl   times a function of the angle about it, cos(nu phi), 1/sqrt(2) in the mean

C is read off the nodes of the tiles along the edge, where there are three or more away from it. Of flat triangles it
is known beforehand as well: of B rho^nu they lack about C = lacks B w^(2 nu), w their width (`Tiles.lacks`).

Sources: [WY94], [SS86]; [M72]; Derivations, F32 and F36.
"""

from collections.abc import Callable
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree
from scipy.special import gamma

from creeping._typing import Any, ComplexArray, FloatArray, IntArray
from creeping.field.boundary import SOFT, Boundary
from creeping.field.currents.radiation import field_of_scalar, phase_sums
from creeping.field.equation.tiles import Near, On, Tiles, gauss
from creeping.geometry.directions import fibonacci_directions
from creeping.geometry.patches import differentiation, interpolation, lobatto
from creeping.kernels.threads import in_threads

DEPTH, SHALLOWER, LEAST = np.pi / 2, 0.6, 0.15
"""Depth of the second surface over 1/k, the factor by which it is less where the body is thin, and least share."""
CLEAR = 0.7
"""Least distance of its points from all nodes, over the depth."""
TANGENT = 2
"""Nodes more along a side of a curved tile than it has, at which J is made tangent to the body."""
EACH, VECTOR = 7.3e-9, 2.0
"""Seconds of a pair, and what a pair of a conductor takes of that."""
KEPT = 3e8
"""Bytes of rows at corners that are kept at most."""
BLOCK = 512
"""Rows that are made at a time of what is not kept."""

DIRECTIONS = 64
"""Directions by which the mean of what edges radiate is taken."""
SAME = 1e-7
"""Difference of places on an edge, 0 to 1, that are one."""
STRAIGHT = 0.02
"""Angle between two faces, radians, below which there is no edge to speak of."""


TIE = 1e-9
"""Difference of parts of a normal below which they are one."""


class Rings(NamedTuple):
    """Nodes of tiles on both faces of edges, at m places along them.

    Attributes
    ----------
    nodes : (m, 2, p)
        Their numbers on both faces, nearest to the edge first.
    points, tangents : (m, 3), L and 1
        Of the edge.
    lengths : (m,), L
        Weights of an integral along it.
    """

    nodes: IntArray
    points: FloatArray
    tangents: FloatArray
    lengths: FloatArray


def rings_of(tiles: Tiles) -> Rings:
    """Nodes along the edges of tiles."""
    key, side, start, end = tiles.edges.T
    rows = np.flatnonzero(key >= 0)
    order = rows[np.lexsort((np.minimum(start, end)[rows], key[rows]))]
    one, two = order[:-1], order[1:]
    low, high = np.minimum(start, end), np.maximum(start, end)
    pair = (key[one] == key[two]) & (abs(low[one] - low[two]) < SAME) & (abs(high[one] - high[two]) < SAME)
    faces = np.stack([one[pair], two[pair]], axis=1)
    p, m = tiles.p, len(faces)
    number = np.arange(p * p).reshape(p, p)
    # by side: along the edge, then away from it
    ways = np.stack([number.T, number[::-1].T, number, number[:, ::-1]])[side[faces].astype(int)]
    backward = (start > end)[faces]
    ways = np.where(backward[..., None, None], ways[:, :, ::-1], ways)
    nodes = np.moveaxis(faces[..., None, None] * p * p + ways, 2, 1).reshape(m * p, 2, p)
    shapes, which = tiles.shapes[faces[:, 0]], side[faces[:, 0]].astype(int)
    lines = np.stack([shapes[:, 0], shapes[:, -1], shapes[:, :, 0], shapes[:, :, -1]], axis=1)[np.arange(m), which]
    lines = np.where(backward[:, 0, None, None], lines[:, ::-1], lines)
    t, w = gauss(p)
    grid = lobatto(lines.shape[1] - 1)
    rows_at = interpolation(grid, t)
    slopes = rows_at @ differentiation(grid)
    x, slope = (np.einsum("aq,mqx->max", part, lines).reshape(-1, 3) for part in (rows_at, slopes))
    length = np.linalg.norm(slope, axis=1)
    return Rings(nodes, x, slope / length[:, None], length * np.tile(w, m))


class EdgeTerm:
    """What edges may radiate that currents of a wavenumber, 1/L, at the nodes of tiles do not know."""

    def __init__(self, tiles: Tiles, wavenumber: float) -> None:
        rings = rings_of(tiles)
        self._k, x, n = wavenumber, tiles.points[rings.nodes], tiles.normals[rings.nodes][:, :, 0]
        turned = np.arctan2(np.linalg.norm(np.cross(n[:, 0], n[:, 1]), axis=1), np.sum(n[:, 0] * n[:, 1], axis=1))
        convex = np.sum((x[:, 1, 0] - x[:, 0, 0]) * n[:, 0], axis=1) < 0
        there = turned > STRAIGHT
        self.rings = Rings(*(part[there] for part in rings))
        self._normals = n[there]
        self._distance = np.linalg.norm(x[there] - self.rings.points[:, None, None], axis=3)
        self._nu = np.pi / (np.pi + np.where(convex, turned, -turned)[there])
        self._lacks, self._reach = tiles.lacks, 1 - tiles.places[0][0]

    def of(self, values: ComplexArray, kind: str) -> ComplexArray:
        """C' dl at the places along edges (2, m, c), of values at the nodes (n,), or (n, 3, c) of a conductor.

        As it is read off, and as it is known beforehand.
        """
        here = values[self.rings.nodes]
        if kind == "soft":
            return self._forbidden(here[..., None], soft=True)
        if kind != "conductor":
            return self._forbidden(here[..., None], soft=False)
        t = self.rings.tangents
        across = np.cross(self._normals, t[:, None])
        hard = self._forbidden(np.einsum("mfx,mfpxc->mfpc", across, here), soft=False)
        soft = self._forbidden(self._k * np.einsum("mx,mfpxc->mfpc", t, here), soft=True)
        # of waves that do not know of each other
        return np.asarray(np.hypot(np.abs(hard), np.abs(soft)) * np.exp(1j * np.angle(hard + soft)))

    def far(self, values: ComplexArray, kind: str, directions: FloatArray) -> FloatArray:
        """Size of the far field, L, in unit directions (r, 3), and of its mean over all: (r, c)."""
        if not len(self.rings.points):
            return np.zeros((len(directions), values.shape[-1] if kind == "conductor" else 1))
        every = np.concatenate([directions, fibonacci_directions(DIRECTIONS)])
        both = [
            phase_sums(self.rings.points, np.ascontiguousarray(strength.T), every, self._k)
            for strength in self.of(values, kind)
        ]
        f = np.linalg.norm(both, axis=0) / np.pi
        mean = np.mean(f[len(directions) :] ** 2, axis=0)
        return np.asarray(np.sqrt(0.5 * (f[: len(directions)] ** 2 + mean)))

    def near(self, values: ComplexArray, kind: str, points: FloatArray) -> FloatArray:
        """Size of the field at points (m, 3), L, no closer to an edge than the nodes that it is read off: (m, c)."""
        if not len(self.rings.points):
            return np.zeros((len(points), values.shape[-1] if kind == "conductor" else 1))
        away, nearest = KDTree(self.rings.points).query(points)
        least = self._distance.max(axis=(1, 2))[nearest]
        above = self.rings.points[nearest] + least[:, None] * self._normals[nearest, 0]
        clear = np.where((away < least)[:, None], above, points)
        both = [
            field_of_scalar((self.rings.points, self.rings.tangents), None, strength.T, clear, self._k)
            for strength in self.of(values, kind)
        ]
        # that is of a source e^{ikR}/(4 pi R)
        return np.asarray(4 * np.linalg.norm(both, axis=0))

    def _forbidden(self, values: ComplexArray, *, soft: bool) -> ComplexArray:
        """C' dl (2, m, c) of values on both faces (m, 2, p, c)."""
        p, nu, wide = values.shape[2], self._nu[:, None, None], self._distance.max(axis=(1, 2))
        rho = self._distance / wide[:, None, None]
        less = 1.0 if soft else 0.0
        powers = ([2 * nu, 4 * nu] if soft else [0 * nu, 2 * nu, 2 + 0 * nu])[:p]
        # those of one sign on both faces, and those that change it
        face = np.array([1.0, -1.0])[:, None]
        even = [rho ** (q - less) * (face if soft else 1.0) for q in powers]
        odd = [rho ** (q * nu - less) * (1.0 if soft else face) for q in (1, 3, -1)[:p]]
        columns = np.stack([*even, *odd], axis=-1)
        m = len(rho)
        fit = np.linalg.pinv(columns.reshape(m, -1, columns.shape[-1]))
        found = np.einsum("mqs,msc->mqc", fit[:, [len(even), -1]], values.reshape(m, fit.shape[2], -1))
        # rho is over its largest: B rho^nu and C rho^-nu are B and C times powers of that
        lacks = self._lacks[1 if soft else 0] / self._reach ** (2 * self._nu)
        B, C = found[:, 0] * lacks[:, None], found[:, 1] * (p > 2)
        nu, size = self._nu, wide ** (self._nu + less)
        of_wave = np.pi / gamma(nu) * (self._k / 2) ** nu / (nu if soft else 1.0)
        return np.asarray(np.stack([C, B]) * (size * of_wave * self.rings.lengths)[:, None])


class Places(NamedTuple):
    """Points with normals, and tangents a and b = n x a of a conductor (m, 3); ``own`` is where on tiles they are."""

    points: FloatArray
    normals: FloatArray
    a: FloatArray
    b: FloatArray
    own: On | None = None

    @classmethod
    def at(cls, points: FloatArray, normals: FloatArray, own: On | None = None) -> "Places":
        """Places at points with normals (m, 3)."""
        # where two parts are one but for rounding the first serves, so that mirrored normals have mirrored tangents
        spare = np.eye(3)[np.argmin(np.abs(normals) + TIE * np.arange(3), axis=1)]
        a = spare - np.sum(spare * normals, axis=1, keepdims=True) * normals
        a /= np.linalg.norm(a, axis=1, keepdims=True)
        return cls(points, normals, a, np.cross(normals, a), own)

    @classmethod
    def of(cls, tiles: Tiles, own: On) -> "Places":
        """Places of tiles (m,) at u and v."""
        return cls.at(*tiles.on(*own), own)

    def part(self, at: Any) -> "Places":
        """Some of them."""
        own = self.own and tuple(lane[at] for lane in self.own)
        return Places(self.points[at], self.normals[at], self.a[at], self.b[at], own)


class Matrix:
    """The matrix of the equation between nodes of tiles, for one wavenumber, 1/L, and boundary.

    Attributes
    ----------
    nodes, inner : Places
        The nodes, and points beneath those with numbers ``at`` (s,).
    root : (n,)
        sqrt(w).
    inside : (m, 3), L, or None
        Points inside the body at which currents are tested, once they are known.
    many : bool
        Whether many incidences are to be tested.
    products : list of callable
        Blocks of it times columns, once they are made, of a matrix that is small enough to be kept.
    """

    def __init__(self, tiles: Tiles, wavenumber: float, boundary: Boundary) -> None:
        self.tiles, self.k, self.boundary = tiles, wavenumber, boundary
        self.vector, self.soft = boundary.kind == "conductor", boundary.kind == "soft"
        self.nodes = Places.at(tiles.points, tiles.normals, tiles.own_places)
        self.at, points = second_surface(tiles, wavenumber)
        under = self.nodes.part(self.at)
        self.inner = Places(points, under.normals, under.a, under.b)
        self.root = np.sqrt(tiles.weights)
        self.columns = 2 if self.vector else 1
        self.inside: FloatArray | None = None
        self.many = False
        self.products: list[Callable[[Any], Any]] = []
        self._kept: dict[tuple[str, int], np.ndarray] = {}

    @cached_property
    def soft_one(self) -> "Matrix":
        """That of soft bodies on the same tiles."""
        return self if self.soft else Matrix(self.tiles, self.k, SOFT)

    @cached_property
    def corners(self) -> Places:
        """Four places of each tile, between the nodes next to its corners, where polynomials oscillate most (4 t,)."""
        tiles = self.tiles
        ends = [
            [0.5 * at[0], 0.5 + 0.5 * at[0]] if tiles.p == 1 else [at[:2].mean(), at[-2:].mean()] for at in tiles.places
        ]
        u, v = (np.tile(one.ravel(), tiles.count) for one in np.meshgrid(*ends))
        return Places.of(tiles, (np.repeat(np.arange(tiles.count), 4), u, v))

    @cached_property
    def edge_term(self) -> EdgeTerm:
        """What edges may radiate that currents do not know."""
        return EdgeTerm(self.tiles, self.k)

    def beneath(self, part: IntArray) -> tuple[IntArray, IntArray]:
        """Which of some nodes (m,) have points beneath them, and which of these they are."""
        under = np.full(len(self.root), -1)
        under[self.at] = np.arange(len(self.at))
        return np.flatnonzero(under[part] >= 0), under[part][under[part] >= 0]

    def received(self, places: Places, values: ComplexArray, kind: str = "double") -> ComplexArray:
        """What places (m,) receive of values (n, c) at the nodes: (m, c); of a conductor (n, 2, c) and (m, 2, c).

        ``kind`` is "double" for M u or M J, "slope" for 2 int u dG/dn_x dS, "single" for 2 int u G dS. Where many
        incidences ask for the same ones at the corners they are kept.
        """
        n, columns, m = len(self.root), self.columns, len(places.points)
        scaled = values.reshape(n, -1) * self.root[:, None]
        scaled = np.asarray(scaled.reshape(n * columns, -1), dtype=np.complex64)
        out = np.empty((m * columns, scaled.shape[1]), dtype=complex)
        keep = self.many and places is self.corners and 8.0 * m * n * columns**2 <= KEPT
        for first in range(0, m, BLOCK):
            rows = self._kept.get((kind, first)) if keep else None
            if rows is None:
                part = places.part(slice(first, first + BLOCK))
                rows = self.rows(part, np.ones(len(part.points)), kind)
            if keep:
                self._kept[kind, first] = rows
            out[columns * first : columns * (first + BLOCK)] = rows @ scaled
        return out.reshape(m, *values.shape[1:])

    def rows(self, places: Places, scale: FloatArray, kind: str = "double") -> np.ndarray:
        """What places (m,) receive of u sqrt(w) at the nodes, times a scale (m,); as `received`: (m, n) or (2m, 2n)."""
        k, m, n, c = self.k, len(places.points), len(self.root), self.columns
        out, to = np.empty((m * c, n * c), dtype=np.complex64), self.root / (2 * np.pi)
        x, normals, a, b = (np.ascontiguousarray(part.T) for part in places[:4])
        y, sides, c_, e_ = (np.ascontiguousarray(part.T) for part in self.nodes[:4])
        single = self.single(kind)
        layer = np.ascontiguousarray(np.stack([single.real, single.imag]))
        tilt = {"single": 0, "double": 1, "slope": 2}[kind]
        both = out.view(np.float32).reshape(m, 2, n, 2, 2) if self.vector else out.view(np.float32).reshape(m, n, 2)

        def work(part: slice) -> None:
            from creeping.field.kernels.near_pairs import scalar_pairs, vector_pairs

            if self.vector:
                vector_pairs(x, normals, a, b, scale, y, c_, e_, to, k, part.start, part.stop, both)
            else:
                scalar_pairs(x, normals, scale, y, sides, to, layer, k, tilt, part.start, part.stop, both)

        in_threads(work, m, least=8, multiple=1)
        targets, columns, near = self.near(places, kind)
        share = scale[targets, None] * (1 / (2 * np.pi * self.root))[columns]
        if self.vector:
            rows, ends = targets[:, None, None, None], columns[:, None, :, None]
            pair = np.arange(2)
            out.reshape(m, 2, n, 2)[rows, pair[:, None, None], ends, pair] = near * share[:, None, :, None]
        else:
            out[targets[:, None], columns] = near * share
        return out

    def single(self, kind: str) -> ComplexArray:
        """What multiplies G at the nodes (n,), or nothing (0,)."""
        n = len(self.root)
        if kind == "single":
            return np.ones(n, dtype=complex)
        if kind == "double" and self.boundary.kind == "impedance":
            return np.asarray(1j * self.k * np.broadcast_to(self.boundary.at(self.tiles.points).admittance, (n,)))
        return np.zeros(0, dtype=complex)

    def near(self, places: Places, kind: str) -> tuple[IntArray, IntArray, ComplexArray]:
        """Integrals over tiles near places, with numbers of the places (pairs,) and of the nodes (pairs, p p).

        Integrals are (pairs, p p), of a conductor (pairs, 2, p p, 2), and are times 4 pi.
        """
        tiles, pp, single = self.tiles, self.tiles.p**2, self.single(kind)
        near = tiles.near(places.points)
        starts, targets = near
        columns = np.repeat(np.arange(tiles.count), np.diff(starts))[:, None] * pp + np.arange(pp)
        if self.vector:
            return targets, columns, self._near_vectors(places, near)
        mode = 2 if kind == "slope" else (1 if len(single) else 0)
        found = tiles.rows(places.points, near, self.k, mode, places.own)
        if mode < 2:
            double = found[:, 0] if kind == "double" else 0.0
            return targets, columns, np.asarray(double + single[columns] * found[:, 1] if mode else double)
        return targets, columns, np.einsum("pc,pcj->pj", places.normals[targets], found)

    def _near_vectors(self, places: Places, near: Near) -> ComplexArray:
        """The integrals of a conductor over tiles near places, of polynomials without their part along the normal.

        Between nodes Cartesian components of J have one, and n_x.J of it is no smaller next to x than elsewhere. The
        polynomials are those through the finer nodes, where it is taken away.
        """
        tiles, finer, (starts, targets) = self.tiles, self._finer, near
        found = finer.rows(places.points, near, self.k, 2, places.own)
        normals = finer.normals.reshape(tiles.count, -1, 3)
        q = np.stack([self.nodes.a, self.nodes.b], axis=1).reshape(tiles.count, -1, 2, 3)
        tile, of = np.repeat(np.arange(tiles.count), np.diff(starts)), places.part(targets)
        if tiles.planar:
            return _across(found, of, q[tile])
        from creeping.field.kernels.tile_rows import tangent_rows

        out = np.empty((len(targets), 2, tiles.p**2, 2), dtype=complex)
        given = found, tile, of.normals, of.a, of.b, np.ascontiguousarray(normals), self._at_finer, q

        def work(part: slice) -> None:
            tangent_rows(*given, part.start, part.stop, out)

        in_threads(work, len(targets), least=64, multiple=1)
        return out

    @cached_property
    def _finer(self) -> Tiles:
        """The same tiles with nodes enough that J is tangent between its own: as many where they are flat."""
        tiles = self.tiles
        return tiles if tiles.planar else tiles.with_nodes(tiles.p + TANGENT)

    @cached_property
    def _at_finer(self) -> FloatArray:
        """What the polynomials of nodes (p p,) are at the finer ones of a tile (f, p p)."""
        return np.asarray(np.kron(*self.tiles.onto(self._finer.p)))


def _across(found: ComplexArray, of: Places, q: FloatArray) -> ComplexArray:
    """Entries (m, 2, p p, 2) of integrals (m, 3, p p) over flat tiles, where a and b at nodes q (m, p p, 2, 3) stay."""
    leaning = np.einsum("pc,pcj->pj", of.normals, found)[:, :, None]
    through, out = np.einsum("px,pjcx->pjc", of.normals, q), []
    for p in (of.a, of.b):
        along = np.einsum("pc,pcj->pj", p, found)[:, :, None]
        out.append(along * through - np.einsum("px,pjcx->pjc", p, q) * leaning)
    return np.stack(out, axis=1)


def second_surface(tiles: Tiles, wavenumber: float) -> tuple[IntArray, FloatArray]:
    """Nodes (s,) with a point x' = x - h n inside the body, clear of all nodes, and x' (s, 3), L."""
    from scipy.spatial import cKDTree

    tree, x, n = cKDTree(tiles.points), tiles.points, tiles.normals
    depth = np.full(len(x), DEPTH / wavenumber)
    least, left = LEAST * depth, np.arange(len(x))
    while len(left):
        inner = x[left] - depth[left, None] * n[left]
        away, nearest = tree.query(inner)
        # on the inner side of what is nearest, unless the way down has gone through the body
        inside = np.sum((x[nearest] - inner) * n[nearest], axis=1) > 0
        left = left[(away < CLEAR * depth[left]) | ~inside]
        depth[left] *= SHALLOWER
        left = left[depth[left] >= least[left]]
    at = np.flatnonzero(depth >= least)
    return at, x[at] - depth[at, None] * n[at]
