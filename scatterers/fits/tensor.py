"""Quintic tensor-product B-spline on a uniform Cartesian grid: F, grad F and the Hessian of F.

With g = (x - origin)/spacing, cell k = floor(g) and fraction t = g - k, axis by axis,

    F(x) = sum_abc w_a(t_1) w_b(t_2) w_c(t_3) C[k_1 + a, k_2 + b, k_3 + c],   a, b, c = 0..5,

n nodes carrying n + 4 coefficients. Ends are not-a-knot, so quintics are reproduced and F converges as h^6. Beyond
the grid the outermost cell's polynomial goes on for one cell; from there on t is held. A NaN stays one.
`scatterers.kernels.tensor` evaluates it.

Sources: [B78]; Derivations, B7 and B6.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from creeping._typing import FloatArray
from scatterers.body import Levelled
from scatterers.kernels.compiled import Compiled, evaluated
from scatterers.kernels.tensor import AT, OVERREAD

NODAL = np.array([1, 26, 66, 26, 1]) / 120
"""A B-spline at the nodes."""


def side_of_cells(box: FloatArray, more: float, most: float) -> float:
    """Side, L, of cells in a box (3,), L, with ``more`` along each axis: at most ``most`` cells."""
    low, high = 0.0, float(box.max())
    for _ in range(60):
        middle = 0.5 * (low + high)
        fewer = np.prod(box / middle + more) < most
        low, high = (low, middle) if fewer else (middle, high)
    return high


@cache
def interpolation_operator(n: int) -> FloatArray:
    """Matrix (n + 4, n) from node values to the uniform coefficients of the not-a-knot quintic.

    The fifth derivative is continuous at the two outermost inner nodes of either end: sixth differences of the
    coefficients vanish there.
    """
    conditions = np.zeros((n + 4, n + 4))
    for node in range(n):
        conditions[node, node : node + 5] = NODAL
    for row, knot in enumerate((1, 2, n - 3, n - 2), n):
        conditions[row, knot - 1 : knot + 6] = np.array([1, -6, 15, -20, 15, -6, 1]) / 64
    return np.asarray(np.linalg.solve(conditions, np.eye(n + 4, n)))


@cache
def cardinal_factor(n: int) -> FloatArray:
    """Bands (3, n) of Cholesky's factor, by columns from its diagonal on, of B, the samples of n B-splines there."""
    from scipy.linalg import cholesky_banded

    return np.ascontiguousarray(cholesky_banded(np.outer(NODAL[2:], np.ones(n)), lower=True))


def cardinal(values: FloatArray) -> FloatArray:
    """S = B^-1 along each axis, of values at the nodes (n0, n1, n2), without coefficients beyond these."""
    from scatterers.kernels.tensor import solve

    for _ in range(3):
        # each axis comes first once
        values = np.array(values, order="C")
        solve(cardinal_factor(len(values)), values.reshape(len(values), -1))
        values = values.transpose(1, 2, 0)
    return values


def coefficients(samples: FloatArray) -> FloatArray:
    """Node values (n0, n1, n2) to coefficients (n0 + 4, n1 + 4, n2 + 4)."""
    for axis in range(3):
        operator = interpolation_operator(samples.shape[axis])
        samples = np.moveaxis(np.tensordot(operator, samples, axes=(1, axis)), 0, axis)
    return np.ascontiguousarray(samples)


@dataclass(frozen=True, eq=False)
class TensorSpline(Levelled):
    """The spline through samples of F on a grid.

    Attributes
    ----------
    coefficients : (n0 + 4, n1 + 4, n2 + 4)
    origin, spacing : (3,), L
    """

    coefficients: FloatArray
    origin: FloatArray
    spacing: FloatArray

    @property
    def box(self) -> FloatArray:
        """Grid's box (2, 3), L."""
        cells = np.array(self.coefficients.shape) - 5
        return np.stack([self.origin, self.origin + cells * self.spacing])

    def at_nodes(self) -> FloatArray:
        """F at the nodes: (n0, n1, n2)."""
        values = self.coefficients
        for axis in range(3):
            nodes = values.shape[axis] - 4
            values = np.sum([w * np.take(values, range(k, k + nodes), axis) for k, w in enumerate(NODAL)], axis=0)
        return values

    def value_and_gradient(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """F (...) and its gradient (..., 3) at points (..., 3), L."""
        return evaluated(self.compiled, points)[:2]

    def flat(self, of_map: FloatArray) -> FloatArray:
        """Parameters of the compiled functions: the header, which ends with those of a map, and the coefficients."""
        header = [np.array(self.coefficients.shape, dtype=float), self.origin, 1 / self.spacing, of_map]
        return np.concatenate([*header, self.coefficients.ravel(), np.zeros(OVERREAD)])

    @property
    def sources(self) -> dict[str, Callable[..., None]]:
        """Plain Python of the compiled functions; see `scatterers.charts.star.SpaceLevel`."""
        from scatterers.kernels.charts import forward
        from scatterers.kernels.tensor import evaluate

        return {"level": evaluate, "forward": forward}

    @cached_property
    def compiled(self) -> Compiled:
        """Compiled evaluator."""
        return Compiled(self.sources["level"], "level", self.flat(np.zeros(AT.end - AT.centre)))
