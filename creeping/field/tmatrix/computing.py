"""The T-matrix of a body: its integral equation solved for every regular wave at once.

    scalar      p_lm = ik int [u d/dn - du/dn] (j_l conj Y_lm) dS,   u or du/dn of incoming psi_l'm'
    conductor   p = -k^2 int conj(V).J dS,   V = N_lm or M_lm regular,   J of incoming E = V', H = curl E/(ik)

since G = ik sum h_l Y_lm(x) j_l conj Y_lm(y), and the same with N and M for E; all about one centre. The right sides of
the equation are regular waves at the nodes and at the points beneath them. Its matrix is factorised where memory holds
it; else GMRES serves for blocks of waves.

A body of radius R scatters waves of degrees up to kR, and of those beyond less by a factor that falls faster than
exponentially, over a width of (kR)^(1/3): that of Airy's function, which j_l is next to l = kR.

Sources: [W71]; [MTL02, sec. 5.8]; Derivations, F36.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from creeping._typing import ArrayLike, ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.arguments import checked, checked_plain
from creeping.field.boundary import CONDUCTOR, Boundary, BoundaryLike, boundary_name, scalar_boundaries
from creeping.field.equation.body_tiles import body_tiles
from creeping.field.equation.columns import solved_columns
from creeping.field.equation.currents import inside_points
from creeping.field.equation.matrix import EACH, VECTOR, Matrix, Places
from creeping.field.equation.solving import PER_NODE, PRODUCTS, SUM, SUM_VECTOR
from creeping.field.equation.tiles import Tiles
from creeping.field.tmatrix.result import TMatrix
from creeping.field.tmatrix.spherical_waves import combined, count, gradients, regular, vector_count, vector_parts
from creeping.geometry.arguments import real_array, whole_number
from creeping.geometry.checks import unit_of
from creeping.geometry.surface import Surface
from creeping.kernels.threads import thread_count
from creeping.storage.memory import budget, within_budget

SECONDS = 300.0
"""What it may take, unless the caller says."""
DIGITS = 2.0
"""Decimal digits of f that degrees keep, about, as a share of the largest (`studies`-less: measured in tests)."""
LEAST = 3
"""Degrees at least."""
RATE = 2e10
"""Single-precision operations that LAPACK does in a second on a core, about."""
DENSE = 0.7
"""Share of the memory that the factors and the waves at the nodes may take."""
COLUMNS = 512
"""Right sides that are solved together: between them an interrupt is heard."""
TINY = 1e-18
"""Share of a wave's rms at the nodes below which it is 0: products of such numbers are slow and nothing."""


def t_matrix(
    body: Surface,
    *,
    wavenumber: float,
    boundary: BoundaryLike,
    center: ArrayLike | None = None,
    order: int | None = None,
    seconds: float = SECONDS,
    progress: Callable[[str], None] | None = None,
) -> TMatrix:
    """What a body scatters of every incident wave at once, by its integral equation.

    Parameters
    ----------
    body : Surface
        Smooth, or of pieces with edges, joints and tips.
    wavenumber : float, 1/L
    boundary : "soft", "hard", "pec" or ImpedanceBoundary
    center : (3,), L, optional
        Of the spherical waves; the middle of the body's bounds unless given.
    order : int, optional
        Highest degree of the waves; by default far fields err by less than 1e-4 of the largest for want of higher ones.
    seconds : float
        What it may take, about, with all cores; more is refused before it starts.
    progress : callable, optional
        Is told in words what is done, with the number of nodes, the time and the memory that it takes.

    Returns
    -------
    TMatrix

    Raises
    ------
    InvalidInputError
        On bad arguments, for a weighted body, and if it would take more time or memory than it may.
    SurfaceError
        If the body has no mesh.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> T = cr.t_matrix(sc.Sphere(), wavenumber=2.0, boundary="soft")
    >>> T.order, T.matrix.shape, bool(T.unitarity < 1e-3)
    (6, (49, 49), True)
    >>> far = T.far_field((0, 0, 1), [(0, 0, -1), (1, 0, 0)])
    >>> far.method.tolist(), bool(far.error.max() < 0.01 * abs(far.total).max())
    (['t-matrix', 't-matrix'], True)
    """
    checked_plain(body)
    kinds = scalar_boundaries(boundary)
    k = checked(wavenumber, 2)
    tell = progress or (lambda words: None)
    kind = CONDUCTOR if len(kinds) == 2 else kinds[0]
    tiles = body_tiles(body, k, kind)
    middle = _center(body, center)
    radius = float(np.max(np.linalg.norm(tiles.points - middle, axis=1)))
    degree = order_for(k * radius) if order is None else whole_number(order, "order")
    plan = plan_for(len(tiles.points), kind, degree)
    what = f"the T-matrix of order {degree} at wavenumber {k:g} by {len(tiles.points)} nodes"
    if plan.seconds > seconds:
        raise InvalidInputError(
            f"{what} takes about {plan.seconds:.2g} s, more than the {seconds:g} s that it may take; give seconds=, "
            "or a lower wavenumber; creeping.solve and rays serve for few incidences"
        )
    within_budget(plan.memory, what, "lower the wavenumber, or let creeping.solve serve for few incidences")
    tell(f"{what}: about {plan.seconds:.2g} s and {plan.memory / 1e9:.2g} GB")
    waves = _Waves(Matrix(tiles, k, kind), middle, degree)
    values = waves.factorised(tell) if plan.direct else waves.iterated(tell)
    tell("outgoing waves")
    extinction = waves.extinction(body, tiles, values)
    return TMatrix(
        matrix=waves.outgoing(values),
        wavenumber=k,
        center=middle,
        boundary=boundary_name(boundary),
        vector=kind.kind == "conductor",
        body=" ".join(repr(body).split()),
        extinction=extinction,
        absorbing=kind.kind == "impedance",
        unit=unit_of(body),
    )


def order_for(size: float, digits: float = DIGITS) -> int:
    """Highest degree of waves for a body of kR = ``size``.

    Examples
    --------
    >>> [order_for(size) for size in (1e-3, 5.0, 30.0)]
    [3, 10, 38]
    """
    return max(LEAST, int(np.ceil(size + 1.8 * digits ** (2 / 3) * np.cbrt(size))))


class Plan(NamedTuple):
    """Seconds and bytes that a T-matrix takes, about, and whether by factors of the whole matrix."""

    seconds: float
    memory: float
    direct: bool


def plan_for(nodes: int, kind: Boundary, order: int) -> Plan:
    """What a T-matrix from so many nodes takes."""
    c = 2 if kind.kind == "conductor" else 1
    n, waves = float(c * nodes), float(vector_count(order) if c == 2 else count(order))
    near = 2 * nodes * PER_NODE * c
    # waves at the nodes in and out, single precision, and what is solved
    tables = 40 * n * waves + 2e4 * n
    memory = 8 * n**2 + tables
    if memory <= DENSE * budget():
        pairs = 2 * float(nodes) ** 2 * EACH * (VECTOR if c == 2 else 1.0)
        operations = 8 / 3 * n**3 + 8 * n**2 * waves + 8 * n * waves**2
        return Plan((pairs + near + operations / RATE) / thread_count(), memory, True)
    each = SUM_VECTOR if c == 2 else SUM
    return Plan(near / thread_count() + PRODUCTS * waves * each * nodes, tables, False)


def _center(body: Surface, center: ArrayLike | None) -> FloatArray:
    if center is None:
        return np.asarray(np.mean(np.asarray(body.bounds, dtype=float), axis=0))
    given = real_array(center, "center")
    if given.shape != (3,):
        raise InvalidInputError(f"center has shape {given.shape}; give three numbers")
    return given


class _Waves:
    """Spherical waves about a centre at the nodes of an equation."""

    def __init__(self, matrix: Matrix, center: FloatArray, order: int) -> None:
        self._of, self._center, self._order = matrix, center, order
        k, c = matrix.k, matrix.columns
        self._nodes = _Tables(matrix.nodes, matrix.nodes.points - center, k, order, vector=c == 2)
        right = self._right(matrix.nodes, self._nodes)
        under = self._right(matrix.inner, _Tables(matrix.inner, matrix.inner.points - center, k, order, vector=c == 2))
        self._size = np.sqrt(np.mean(np.abs(right) ** 2, axis=0))
        self._size[self._size == 0] = 1.0
        self._given = right / self._size, under / self._size
        for part in self._given:
            part[np.abs(part) < TINY] = 0.0

    def _right(self, places: Places, tables: "_Tables") -> ComplexArray:
        """Twice the incident wave at places, as the equation has it: (c p, waves)."""
        if self._of.vector:
            return 2 * tables.across
        return 2 * (tables.slope if self._of.soft else tables.values)

    def factorised(self, tell: Callable[[str], None]) -> ComplexArray:
        """Values at the nodes (c n, waves), over sizes of the waves, by LAPACK."""
        from scipy.linalg import lu_factor, lu_solve

        matrix, c = self._of, self._of.columns
        right, under = self._given
        rows = (c * matrix.at[:, None] + np.arange(c)).ravel()
        B = np.empty(right.shape, dtype=np.complex64, order="F")
        B[:] = right
        B[rows] -= 1j * under
        root = np.repeat(matrix.root, c).astype(np.float32)[:, None]
        B *= root
        # rows of C are columns of Fortran
        whole = matrix.__dict__.pop("whole", None)
        whole = matrix.whole if whole is None else whole
        matrix.__dict__.pop("whole", None)
        tell("factors of the matrix")
        factors = lu_factor(whole.T, overwrite_a=True, check_finite=False)
        del whole
        for first in range(0, B.shape[1], COLUMNS):
            tell(f"wave {first} of {B.shape[1]}")
            at = slice(first, first + COLUMNS)
            B[:, at] = lu_solve(factors, B[:, at], trans=1, overwrite_b=True, check_finite=False)
        B /= root
        return B

    def iterated(self, tell: Callable[[str], None]) -> ComplexArray:
        """The same by GMRES."""
        matrix, c = self._of, self._of.columns
        right, under = (part.reshape(-1, c, part.shape[1]) for part in self._given)
        found = solved_columns(matrix, right, under, tell)
        return found.values.reshape(right.shape[0] * c, -1)

    def outgoing(self, values: ComplexArray) -> ComplexArray:
        """The T-matrix of values (c n, waves)."""
        matrix, k = self._of, self._of.k
        w = np.repeat(matrix.root**2, matrix.columns)[:, None]
        if matrix.vector:
            out = -(k**2) * w * self._nodes.along.conj()
        elif matrix.soft:
            out = -1j * k * w * self._nodes.values.conj()
        else:
            out = 1j * k * w * self._nodes.slope.conj()
            if matrix.boundary.kind == "impedance":
                eta = np.broadcast_to(matrix.boundary.at(matrix.tiles.points).admittance, len(w))[:, None]
                out -= k**2 * w * eta * self._nodes.values.conj()
        size = np.sqrt(np.mean(np.abs(out) ** 2, axis=0))
        size[size == 0] = 1.0
        out /= size
        out[np.abs(out) < TINY] = 0.0
        found = out.astype(np.complex64).T @ values.astype(np.complex64)
        return size[:, None] * found.astype(complex) * self._size

    def extinction(self, body: Surface, tiles: Tiles, values: ComplexArray) -> float:
        """What is left inside of plane waves from everywhere, rms."""
        matrix, k = self._of, self._of.k
        x = inside_points(body, tiles, 2 * np.pi / k)
        if not len(x):
            return float("nan")
        if matrix.vector:
            return float("nan")
        kind, factor = ("single", -0.5) if matrix.soft else ("double", 0.5)
        places = Places.at(x, np.broadcast_to([0.0, 0.0, 1.0], x.shape))
        left = factor * matrix.received(places, values, kind) * self._size + regular(x - self._center, k, self._order)
        return float(np.sqrt(4 * np.pi * np.sum(np.abs(left) ** 2) / len(x)))


class _Tables:
    """Regular waves at places, about a centre at the origin of ``points`` (p, 3)."""

    def __init__(self, places: Places, points: FloatArray, k: float, order: int, *, vector: bool) -> None:
        table = regular(points, k, order + 1)
        if not vector:
            self.values = table[:, : count(order)]
            self.slope = k * combined(table, gradients(order), places.normals)
            return
        parts = vector_parts(order)
        both = np.stack([combined(table, parts, t) for t in (places.a, places.b)], axis=1)
        waves = both.shape[2]
        self.along = both.reshape(-1, waves)
        # H of N is -i M, that of M is -i N; a.(n x H) = -b.H, b.(n x H) = a.H
        H = -1j * both.reshape(len(points), 2, -1, 2)[..., ::-1].reshape(both.shape)
        self.across = np.stack([-H[:, 1], H[:, 0]], axis=1).reshape(-1, waves)
