"""The equation of a body solved for the regular waves about a centre, and the outgoing waves of the solutions.

Right sides are waves at the nodes and at the points beneath them, sums that are even or odd in the symmetries of the
nodes (`creeping.field.equation.mirrors`): one block of the matrix for each parity. Blocks are factorised in single
precision. Waves of high degrees are tiny far inside the body's sphere; each is solved as a share of its rms.

What is left of a wave inside the body is its error. Plane waves from everywhere have 4 pi sum |.|^2 of it in the mean.

Sources: [W71]; [MTL02, sec. 5.8]; Derivations, F36.
"""

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from creeping._typing import Any, ComplexArray, FloatArray
from creeping.field.equation.columns import solved_columns
from creeping.field.equation.matrix import Matrix, Places
from creeping.field.equation.mirrors import Mirrors, blocks_of
from creeping.field.tmatrix.spherical_waves import combined, count, gradients, parities, regular, vector_parts
from creeping.storage.parts import Arrays, Keeping, not_kept

COLUMNS = 512
"""Right sides that are solved together: between them an interrupt is heard."""
TINY = 1e-18
"""Share of a wave's rms below which it is 0: products of such numbers are slow, and nothing."""


class WavesAt(NamedTuple):
    """Regular waves at p places: right sides of the equation there, and what outgoing waves are integrals with.

    Both are (c p, waves).
    """

    right: ComplexArray
    sent: ComplexArray


class SolvedWaves:
    """The waves of an equation about a centre, in its parities.

    Attributes
    ----------
    T : (waves, waves)
        The T-matrix.
    extinction : callable
        Of points inside.
    """

    def __init__(
        self,
        matrix: Matrix,
        center: FloatArray,
        order: int,
        mirrors: Mirrors,
        tell: Callable[[str], None],
        *,
        direct: bool,
        keep: Keeping = not_kept,
    ) -> None:
        self._of, self._center, self._order, self._mirrors, self._keep = matrix, center, order, mirrors, keep
        self._sums, which = parities(order, self._mirrors.flips, vector=matrix.vector)
        c, part, images = matrix.columns, self._mirrors.part, self._mirrors.images
        self._above, under = matrix.beneath(part)
        own, beneath = self._waves_at(matrix.nodes.part(part)), self._waves_at(matrix.inner.part(under))
        # of nodes that are their own images the share that they have of their weight
        self._root = matrix.root[part] / np.sqrt(self._mirrors.times)
        own.sent[:] *= np.repeat(self._root**2, c)[:, None]
        (right, sent), (self._size, size) = zip(*(_scaled(lane) for lane in own), strict=True)
        given = right, _cleared(beneath.right / self._size)
        T = np.zeros((len(size), len(size)), dtype=complex)
        self._parts = [np.flatnonzero(which == number) for number in range(len(images))]
        self._found, sums = list[np.ndarray](), self._sums.tocsc()
        for at, found in zip(
            self._parts, self._factorised(given, tell) if direct else self._iterated(given, tell), strict=True
        ):
            block = len(images) * size[at][:, None] * (sent[:, at].T @ found) * self._size[at]
            # spherical waves of few orders have a share in waves of one parity
            few = np.unique(sums[:, at].nonzero()[0])
            share = sums[:, at].tocsr()[few]
            T[np.ix_(few, few)] += share @ (share @ block.T).T
            self._found.append(found)
        self.T: ComplexArray = T

    def _waves_at(self, places: Places) -> WavesAt:
        matrix, k, x = self._of, self._of.k, places.points - self._center
        table = regular(x, k, self._order + 1)
        if matrix.vector:
            parts = [part @ self._sums for part in vector_parts(self._order)]
            both = np.stack([combined(table, parts, t) for t in (places.a, places.b)], axis=1)
            # H of N is -i M, that of M is -i N; a.(n x H) = -b.H, b.(n x H) = a.H
            H = -1j * both.reshape(len(x), 2, -1, 2)[..., ::-1].reshape(both.shape)
            right = np.stack([-2 * H[:, 1], 2 * H[:, 0]], axis=1)
            waves = both.shape[2]
            return WavesAt(right.reshape(-1, waves), -(k**2) * both.conj().reshape(-1, waves))
        values = (self._sums.T @ table[:, : count(self._order)].T).T
        slope = k * combined(table, [part @ self._sums for part in gradients(self._order)], places.normals)
        if matrix.soft:
            return WavesAt(2 * slope, -1j * k * values.conj())
        sent = slope.conj()
        if matrix.boundary.kind == "impedance":
            eta = np.broadcast_to(matrix.boundary.at(places.points).admittance, len(x))
            sent += 1j * k * eta[:, None] * values.conj()
        return WavesAt(2 * values, 1j * k * sent)

    def _factorised(self, given: tuple[np.ndarray, np.ndarray], tell: Callable[[str], None]) -> Iterator[np.ndarray]:
        """Values at the nodes of the part (c m, waves) for the waves of each parity, by LAPACK."""
        from scipy.linalg import lu_factor, lu_solve

        c, parts = self._of.columns, self._parts
        root = np.repeat(self._root, c).astype(np.float32)[:, None]
        B = given[0] * root
        above = (c * self._above[:, None] + np.arange(c)).ravel()
        B[above] -= 1j * given[1] * root[above]
        blocks: list[np.ndarray] = []
        factors: dict[int, Any] = {}

        def solved(number: int, first: int, right: np.ndarray) -> Arrays:
            if not blocks:
                tell("integrals between the nodes")
                blocks.extend(blocks_of(self._of, self._mirrors))
            if number not in factors:
                factors.clear()
                tell(f"factors of block {number + 1} of {len(parts)}")
                # rows of C are columns of Fortran
                factors[number] = lu_factor(blocks[number].T, overwrite_a=True, check_finite=False)
            tell(f"block {number + 1} of {len(parts)}, wave {first + 1} of {len(parts[number])}")
            return {"values": lu_solve(factors[number], right, trans=1, check_finite=False)}

        for number, at in enumerate(parts):
            found = np.asfortranarray(B[:, at])
            for first in range(0, len(at), COLUMNS):
                some = slice(first, first + COLUMNS)
                made = partial(solved, number, first, found[:, some])
                found[:, some] = self._keep(f"block-{number}-{first}", made)["values"]
            yield found / root

    def _iterated(self, given: tuple[np.ndarray, np.ndarray], tell: Callable[[str], None]) -> Iterator[np.ndarray]:
        """Values at all nodes (c n, waves) by GMRES."""
        matrix, c = self._of, self._of.columns
        right, under = (part.reshape(-1, c, part.shape[1]) for part in given)
        found = solved_columns(matrix, right, under, tell, self._keep)
        yield found.values.reshape(c * len(right), -1).astype(np.complex64)

    def extinction(self, points: FloatArray) -> float:
        """What is left of plane waves at points inside (m, 3), L, rms over all incidences; NaN without points."""
        if not len(points):
            return float("nan")
        matrix, k = self._of, self._of.k
        table = regular(points - self._center, k, self._order + 1)
        x, z = (np.broadcast_to(row, points.shape) for row in np.eye(3)[[0, 2]])
        columns = np.concatenate(self._parts)
        if not matrix.vector:
            kind, factor = ("single", -0.5) if matrix.soft else ("double", 0.5)
            left = factor * self._received(Places.at(points, z), kind) * self._size[columns]
            left += (self._sums.T @ table[:, : count(self._order)].T).T[:, columns]
            return float(np.sqrt(4 * np.pi * np.sum(np.abs(left) ** 2) / len(points)))
        # (n x H) x n has no part along n: another n for that one
        H = np.empty((len(points), 3, len(columns)), dtype=complex)
        for normals, axes in ((z, [0, 1]), (x, [2])):
            places = Places.at(points, normals)
            found = 0.5 * self._received(places, "double").reshape(len(points), 2, -1)
            turned = places.a[:, :, None] * found[:, :1] + places.b[:, :, None] * found[:, 1:]
            H[:, axes] = np.cross(turned, normals[:, :, None], axis=1)[:, axes]
        H *= self._size[columns]
        E = np.stack([(part.T @ table.T).T for part in (p @ self._sums for p in vector_parts(self._order))], axis=1)
        H += -1j * E.reshape(len(points), 3, -1, 2)[..., ::-1].reshape(E.shape)[..., columns]
        return float(np.sqrt(2 * np.pi * np.sum(np.abs(H) ** 2) / len(points)))

    def _received(self, places: Places, kind: str) -> ComplexArray:
        """What places (m,) receive of the solutions, as of `Matrix.received`, parity by parity: (c m, waves)."""
        matrix, mirrors, c = self._of, self._mirrors, self._of.columns
        rows = matrix.rows(places, np.ones(len(places.points)), kind) * np.repeat(matrix.root, c).astype(np.float32)
        rows = rows[:, (c * mirrors.images[:, :, None] + np.arange(c)).reshape(len(mirrors.images), -1)]
        # nodes that are their own images count once
        signs = (mirrors.signs / mirrors.times[:, None]).reshape(len(mirrors.images), -1)
        of_parity = np.einsum("xg,gi,mgi->xmi", mirrors.characters, signs, rows, optimize=True)
        return np.concatenate([mine @ found for mine, found in zip(of_parity, self._found, strict=True)], axis=1)


def _scaled(lane: ComplexArray) -> tuple[np.ndarray, FloatArray]:
    """Columns over their rms, single precision, and that."""
    size = np.sqrt(np.mean(np.abs(lane) ** 2, axis=0))
    size[size == 0] = 1.0
    return _cleared(lane / size), size


def _cleared(lane: ComplexArray) -> np.ndarray:
    lane[np.abs(lane) < TINY] = 0.0
    return np.asarray(lane.astype(np.complex64))
