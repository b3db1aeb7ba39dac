"""Tensor-product B-splines on charts x circle, in one uniform basis.

Along an axis with nodes 0..n-1 the spline is sum_j c_j N_p(t - j) with the uniform B-spline N_p of degree p: not-a-knot
ends where the axis is a chart variable (n + p - 1 coefficients), period n where it is periodic (n, continued by p).
A not-a-knot spline has fewer knots than the uniform basis, so it is contained in it and nothing is lost.

Also here: the grid of a map, and the splines on it for one time.

Sources: [B78]; Derivations, B7.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.geometry.surface import Surface

MARGIN = 2
"""Nodes of a chart beyond each edge of its unit square: every point finds a chart two grid points from the edge."""


@cache
def interpolation_operator(n: int, degree: int, periodic: bool) -> FloatArray:
    """Matrix from n node values to the uniform coefficients, (n + p - 1, n) or (n + p, n) if periodic.

    Periodic coefficients are continued by p, so that an evaluation never wraps.
    """
    from scipy.interpolate import make_interp_spline

    if periodic:
        nodes = np.arange(n + 1.0)
        values = np.vstack([np.eye(n), np.eye(n)[:1]])
        spline = make_interp_spline(nodes, values, k=degree, bc_type="periodic")
        samples = np.arange(n) + 0.5 * (degree % 2 == 0)
        collocation = np.zeros((n, n))
    else:
        spline = make_interp_spline(np.arange(float(n)), np.eye(n), k=degree)
        # the nodes, and midpoints of the first and last cells: equally spaced samples would drift through the
        # midpoints of inner cells, where splines of odd degree cannot tell an oscillation from zero
        ends = np.arange((degree - 1) // 2) + 0.5
        samples = np.sort(np.concatenate([np.arange(float(n)), ends, n - 1 - ends]))
        collocation = np.zeros((n + degree - 1, n + degree - 1))
    cell = np.minimum(np.floor(samples).astype(int), n - 1 if periodic else n - 2)
    weights = uniform_weights(samples - cell, degree)
    for j in range(degree + 1):
        column = (cell + j) % collocation.shape[1] if periodic else cell + j
        np.add.at(collocation, (np.arange(len(samples)), column), weights[:, j])
    coefficients = np.linalg.solve(collocation, spline(samples))
    if periodic:
        coefficients = coefficients[np.arange(n + degree) % n]
    return np.ascontiguousarray(coefficients)


def uniform_weights(t: FloatArray, degree: int) -> FloatArray:
    """Weights of the p + 1 B-splines that do not vanish at fraction t of a cell: (...) -> (..., p + 1).

    Cox-de Boor on uniform knots: w_j <- ((t + d - j) w_(j-1) + (j + 1 - t) w_j)/d for d = 1..p.

    Examples
    --------
    >>> (6 * uniform_weights(np.array(0.0), 3)).round(12)
    array([1., 4., 1., 0.])
    """
    t = np.asarray(t, dtype=float)
    w = np.zeros((*t.shape, degree + 1))
    w[..., 0] = 1.0
    for d in range(1, degree + 1):
        for j in range(d, 0, -1):
            w[..., j] = ((t + d - j) * w[..., j - 1] + (j + 1 - t) * w[..., j]) / d
        w[..., 0] = (1 - t) * w[..., 0] / d
    return w


@cache
def thinning_operator(n: int, stride: int, degree: int, periodic: bool) -> FloatArray:
    """Matrix from n values to those of the spline through every stride-th of them, at all n: (n, n/stride or so).

    Without periodicity n - 1 is a multiple of the stride, else n.
    """
    kept = len(range(0, n, stride))
    operator = interpolation_operator(kept, degree, periodic)
    place = np.arange(n) / stride
    cell = np.minimum(np.floor(place).astype(int), kept - 1 if periodic else kept - 2)
    w = uniform_weights(place - cell, degree)
    return np.asarray(sum(w[:, j, None] * operator[cell + j] for j in range(degree + 1)))


def prefilter(values: FloatArray, degree: int, periodic: tuple[bool, bool]) -> FloatArray:
    """Node values (charts, nu, nv, na, lanes) to coefficients; the last grid axis is periodic.

    With nu = 1 they do not depend on u.
    """
    for axis, wraps in ((1, periodic[0]), (2, periodic[1]), (3, True)):
        if axis == 1 and values.shape[1] == 1:
            continue
        operator = interpolation_operator(values.shape[axis], degree, wraps)
        values = np.moveaxis(np.tensordot(operator, values, axes=(1, axis)), 0, axis)
    return np.ascontiguousarray(values)


@dataclass(frozen=True)
class Grid:
    """Nodes of a map along u, v and the angle; MARGIN of them lie outside the unit square on each side.

    One node along u stands for all of them: the map is that of a body of revolution, and u its azimuth.
    """

    nodes: tuple[int, int, int]
    degree: int
    periodic: tuple[bool, bool]

    @property
    def origin(self) -> FloatArray:
        """Grid coordinates of u = v = 0."""
        return np.array([0.0 if wraps else float(MARGIN) for wraps in self.periodic])

    @property
    def is_flat(self) -> bool:
        """Whether the map does not depend on u."""
        return self.nodes[0] == 1

    @property
    def cells(self) -> FloatArray:
        """Cells per unit of u, v and per turn of the angle."""
        sides = [n if wraps else n - 1 - 2 * MARGIN for n, wraps in zip(self.nodes[:2], self.periodic, strict=True)]
        return np.array([*sides, self.nodes[2]], dtype=float)

    @property
    def sides(self) -> tuple[int, ...]:
        """Coefficients along each axis: periodic ones are continued by the degree."""
        p, wraps = self.degree, (*self.periodic, True)
        sides = [n + p if around else n + p - 1 for n, around in zip(self.nodes, wraps, strict=True)]
        return (1 if self.is_flat else sides[0], *sides[1:])

    def axes(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Node values of u, v and the angle (radians)."""
        u, v = ((np.arange(self.nodes[k]) - self.origin[k]) / self.cells[k] for k in (0, 1))
        return u, v, 2 * np.pi * np.arange(self.nodes[2]) / self.nodes[2]


@dataclass(frozen=True, eq=False)
class Leap:
    """The splines of one time.

    Attributes
    ----------
    time : float
    state : (charts, nu, nv, na, lanes), float64 or float32
        Coefficients of the displacement less its mean; nu = 1 if the map does not depend on u.
    centre : (lanes,)
        The mean: float32 coefficients resolve what is left of it.
    jacobi : (charts, nu, nv, na, 4 or 8), of the same type
        Coefficients of M less ``matrix``; no charts if the map does not carry M. Packed they are of (q1, q2, q3, M11,
        M21, M12, M22, A): the displacement is that of ``state`` again, of a rotation the vector part of its quaternion
        with q0 > 0, and A the attenuation integral over the leap.
    matrix : (4,) or (8,)
        Mean of what ``jacobi`` is of; (1, 0, t, 1) if there is none.
    curvature : (charts, nu, nv, na, 8), of the same type
        Coefficients of c^(3/2) kappa_n at Chebyshev times (`attenuation`); no charts if the map does not carry it.
    flagged : (charts, nu, nv, na) of uint8
        By the number of a stencil's first coefficient, whether A is not good enough there, and the curvature is to be
        taken; no charts unless packed.
    """

    time: float
    state: Any
    centre: FloatArray
    jacobi: Any
    matrix: FloatArray
    curvature: Any
    flagged: Any

    def __post_init__(self) -> None:
        # read-only like the arrays of a stored map: kernels are compiled for one kind of array
        for table in (self.state, self.jacobi, self.curvature, self.flagged):
            table.flags.writeable = False

    @property
    def is_packed(self) -> bool:
        """Whether ``jacobi`` has the displacement and the attenuation too."""
        return bool(self.jacobi.shape[-1] == 8)

    @property
    def has_jacobi(self) -> bool:
        """Whether it carries the Jacobi matrix."""
        return len(self.jacobi) > 0

    @property
    def has_curvature(self) -> bool:
        """Whether it carries the curvatures too."""
        return len(self.curvature) > 0

    @property
    def nbytes(self) -> int:
        """Memory of the tables."""
        return int(self.state.nbytes + self.jacobi.nbytes + self.curvature.nbytes + self.flagged.nbytes)


def least_cells(body: Surface) -> int:
    """Cells of a chart's unit square at which the grid's margin ends within the chart."""
    margin = getattr(body.atlas, "margin", None)
    return 1 if margin is None else int(np.ceil(2 * MARGIN / margin - 1e-9))
