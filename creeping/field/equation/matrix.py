"""The matrix of a body's integral equation, asked on two surfaces at once.

    hard        (1 - M) u = 2 u_inc                 M = 2 int dG/dn_y dS
    impedance   (1 - M) u = 2 u_inc                 M = 2 int (dG/dn_y + ik eta G) dS
    soft        (1 + M*) q = 2 du_inc/dn            M* the transpose of the hard one in the weights
    conductor   (1 - M) J = 2 n x H_inc             M = 2 int [grad_x G (n_x.J) - J (n_x.grad_x G)] dS

less i times the same at x' = x - h n, kh = pi/2, where there is no 1, and where soft bodies have their own dG/dn_x.
u(x) - M u and M u (x') are what the field that u gives inside the body is, at its surface and under it, so both are 0:
one of them lets waves stand inside at resonances, the two together see what goes in and throw nothing back.

In the unknowns u sqrt(w) the transpose in the weights is that of the matrix. What a tile sends to points near it is
integrated with the polynomials through its nodes, of J by Cartesian components less their part along the normal.

Sources: [WY94], [SS86]; Derivations, F32 and F36.
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np

from creeping._typing import Any, ComplexArray, FloatArray, IntArray
from creeping.field.boundary import SOFT, Boundary
from creeping.field.equation.edge_term import EdgeTerm
from creeping.field.equation.tiles import Tiles
from creeping.kernels.threads import in_threads

DEPTH, SHALLOWER, LEAST = np.pi / 2, 0.6, 0.15
"""Depth of the second surface over 1/k, the factor by which it is less where the body is thin, and least share."""
CLEAR = 0.7
"""Least distance of its points from all nodes, over the depth."""
PAIRS = 4096
"""Pairs of a place and a tile near to it that are made tangent at once."""
TANGENT = 2
"""Nodes more along a side of a curved tile than it has, at which J is made tangent to the body."""
EACH, VECTOR = 2.5e-9, 4.0
"""Seconds of a pair, and what a pair of a conductor takes of that."""
BLOCK = 512
"""Rows that are made at a time of what is not kept."""


class Places(NamedTuple):
    """Points with normals, and tangents a and b = n x a of a conductor (m, 3); ``own`` is where on tiles they are."""

    points: FloatArray
    normals: FloatArray
    a: FloatArray
    b: FloatArray
    own: tuple[IntArray, FloatArray, FloatArray] | None = None

    @classmethod
    def at(
        cls, points: FloatArray, normals: FloatArray, own: tuple[IntArray, FloatArray, FloatArray] | None = None
    ) -> "Places":
        """Places at points with normals (m, 3)."""
        spare = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
        a = spare - np.sum(spare * normals, axis=1, keepdims=True) * normals
        a /= np.linalg.norm(a, axis=1, keepdims=True)
        return cls(points, normals, a, np.cross(normals, a), own)

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
        Points inside the body at which currents are judged, once they are known.
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

    @cached_property
    def soft_one(self) -> "Matrix":
        """That of soft bodies on the same tiles."""
        return self if self.soft else Matrix(self.tiles, self.k, SOFT)

    @cached_property
    def edge_term(self) -> EdgeTerm:
        """What edges may radiate that currents do not know."""
        return EdgeTerm(self.tiles, self.k)

    @cached_property
    def whole(self) -> np.ndarray:
        """All entries, single precision."""
        own = self.rows(self.nodes, self.root)
        own = _transposed(own) if self.soft else np.negative(own, out=own)
        own[np.diag_indices(len(own))] += 1.0
        factor = np.complex64(-1j if self.soft else 1j)
        for first in range(0, len(self.at), BLOCK):
            at = self.at[first : first + BLOCK]
            rows = (self.columns * at[:, None] + np.arange(self.columns)).ravel()
            under = self.inner.part(slice(first, first + BLOCK))
            own[rows] += factor * self.rows(under, self.root[at], "slope" if self.soft else "double")
        return own

    def product(self, values: ComplexArray) -> ComplexArray:
        """The matrix times columns (n, m)."""
        return np.asarray(self.whole @ values.astype(np.complex64), dtype=complex)

    def received(self, places: Places, values: ComplexArray, kind: str = "double") -> ComplexArray:
        """What places (m,) receive of values (n, c) at the nodes: (m, c); of a conductor (n, 2, c) and (m, 2, c).

        ``kind`` is "double" for M u or M J, "slope" for 2 int u dG/dn_x dS, "single" for 2 int u G dS.
        """
        n, columns, m = len(self.root), self.columns, len(places.points)
        scaled = values.reshape(n, -1) * self.root[:, None]
        scaled = np.asarray(scaled.reshape(n * columns, -1), dtype=np.complex64)
        out = np.empty((m * columns, scaled.shape[1]), dtype=complex)
        for first in range(0, m, BLOCK):
            part = places.part(slice(first, first + BLOCK))
            out[columns * first : columns * (first + BLOCK)] = self.rows(part, np.ones(len(part.points)), kind) @ scaled
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
            from creeping.field.kernels.node_pairs import scalar_pairs, vector_pairs

            if self.vector:
                vector_pairs(x, normals, a, b, scale, y, c_, e_, to, k, part.start, part.stop, both)
            else:
                scalar_pairs(x, normals, scale, y, sides, to, layer, k, tilt, part.start, part.stop, both)

        in_threads(work, m, least=8, multiple=1, seconds=EACH * n * (VECTOR if self.vector else 1.0))
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
        """Of tiles near places: numbers of these (pairs,), those of the nodes (pairs, p p), and the integrals.

        These are (pairs, p p), of a conductor (pairs, 2, p p, 2), of what is times 4 pi.
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

    def _near_vectors(self, places: Places, near: tuple[IntArray, IntArray]) -> ComplexArray:
        """The integrals of a conductor over tiles near places, of polynomials without their part along the normal.

        Between nodes Cartesian components of J have one, and n_x.J of it is no smaller next to x than elsewhere. The
        polynomials are those through the finer nodes, where it is taken away.
        """
        tiles, finer, (starts, targets) = self.tiles, self._finer, near
        found = finer.rows(places.points, near, self.k, 2, places.own)
        normals = finer.normals.reshape(tiles.count, -1, 3)
        q = np.stack([self.nodes.a, self.nodes.b], axis=1).reshape(tiles.count, -1, 2, 3)
        tile, out = np.repeat(np.arange(tiles.count), np.diff(starts)), []
        for first in range(0, len(targets), PAIRS):
            at = slice(first, first + PAIRS)
            out.append(self._tangent(found[at], places.part(targets[at]), normals[tile[at]], q[tile[at]]))
        return np.concatenate(out) if out else np.empty((0, 2, tiles.p**2, 2), dtype=complex)

    def _tangent(self, found: ComplexArray, of: Places, n: FloatArray, q: FloatArray) -> ComplexArray:
        """Entries (m, 2, p p, 2) of integrals (m, 3, f), normals n (m, f, 3) at the finer nodes, and a and b at nodes.

        With J_f = sum_j l_j(y_f) [q_j - n_f (n_f.q_j)] they are those of q_j less those of its part along n_f.
        """
        if self.tiles.planar:
            return _across(found, of, q)
        m, finer = len(found), self._at_finer.shape[0]
        # few large products: many small ones wait for each other where a machine is busy
        coarse = (found.reshape(-1, finer) @ self._at_finer).reshape(m, 3, -1)
        lean, across = np.einsum("pc,pcf->pf", of.normals, found), np.einsum("px,pfx->pf", of.normals, n)
        leaning = np.einsum("pc,pcj->pj", of.normals, coarse)[:, :, None]
        through, out = np.einsum("px,pjcx->pjc", of.normals, q), []
        for p in (of.a, of.b):
            rest = np.einsum("pc,pcf->pf", p, found) * across - lean * np.einsum("px,pfx->pf", p, n)
            along = (rest[:, None] * np.swapaxes(n, 1, 2)).reshape(-1, finer) @ self._at_finer
            whole = np.einsum("pc,pcj->pj", p, coarse)[:, :, None] * through
            whole -= np.einsum("px,pjcx->pjc", p, q) * leaning
            out.append(whole - np.einsum("pxj,pjcx->pjc", along.reshape(m, 3, -1), q))
        return np.stack(out, axis=1)

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


def _transposed(square: np.ndarray) -> np.ndarray:
    """A square matrix (n, n) transposed in its place, by blocks that a cache holds."""
    starts = range(0, len(square), BLOCK)
    for i in starts:
        for j in range(i, len(square), BLOCK):
            upper, lower = square[i : i + BLOCK, j : j + BLOCK], square[j : j + BLOCK, i : i + BLOCK]
            upper[:], lower[:] = lower.T.copy(), upper.T.copy()
    return square


def second_surface(tiles: Tiles, wavenumber: float) -> tuple[IntArray, FloatArray]:
    """Nodes that have a point x' beneath them, and these points (s, 3), L, clear of all nodes."""
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
