"""Quintic tensor-product B-spline on a uniform Cartesian grid: F, grad F and the Hessian of F.

With g = (x - origin)/spacing, cell k = floor(g) and fraction t = g - k, axis by axis,

    F(x) = sum_abc w_a(t_1) w_b(t_2) w_c(t_3) C[k_1 + a, k_2 + b, k_3 + c],   a, b, c = 0..5,

n nodes carrying n + 4 coefficients. Ends are not-a-knot, so quintics are reproduced and F converges as h^6. Beyond
the grid the outermost cell's polynomial goes on for one cell; from there on t is held. A NaN stays one.
`scatterers.kernels.tensor` evaluates it.

Also here: from values at the nodes of a grid to coefficients of quintic B-splines there: S = B^-1 along each axis.

B has the bands (1, 26, 66, 26, 1)/120, and is factored once for each axis.

Sources: [B78]; Derivations, B7 and B6.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from creeping._typing import BoolArray, FloatArray
from scatterers.body import Levelled
from scatterers.kernels.compiled import Compiled, evaluated
from scatterers.kernels.tensor import CENTRE, HEADER, OVERREAD


@cache
def interpolation_operator(n: int) -> FloatArray:
    """Matrix (n + 4, n) from node values to the uniform coefficients of the not-a-knot quintic.

    The fifth derivative is continuous at the two outermost inner nodes of either end: sixth differences of the
    coefficients vanish there.
    """
    conditions = np.zeros((n + 4, n + 4))
    for node in range(n):
        conditions[node, node : node + 5] = np.array([1, 26, 66, 26, 1]) / 120
    for row, knot in enumerate((1, 2, n - 3, n - 2), n):
        conditions[row, knot - 1 : knot + 6] = np.array([1, -6, 15, -20, 15, -6, 1]) / 64
    return np.asarray(np.linalg.solve(conditions, np.eye(n + 4, n)))


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
            shifted = [w * np.take(values, range(k, k + nodes), axis) for k, w in enumerate((1, 26, 66, 26, 1))]
            values = np.sum(shifted, axis=0) / 120
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
        """Plain Python of the compiled functions; see `scatterers.charts.radial.SpaceLevel`."""
        from scatterers.kernels.sphere_maps import forward
        from scatterers.kernels.tensor import evaluate

        return {"level": evaluate, "forward": forward}

    @cached_property
    def compiled(self) -> Compiled:
        """Compiled evaluator."""
        return Compiled(self.sources["level"], "level", self.flat(np.zeros(HEADER - CENTRE)))


class Cardinal:
    """S D S on grids of one shape, D a number of each node; symmetric, as B is.

    Examples
    --------
    >>> one = np.ones((7, 8, 9))
    >>> Cardinal(one)(one, one > 0, np.empty((7, 8, 9))).shape
    (7, 8, 9)
    """

    def __init__(self, damping: FloatArray) -> None:
        self.factors = [_factors(n) for n in damping.shape]
        # as the kernel takes it
        self.damping = np.ascontiguousarray(np.swapaxes(damping, 1, 2))
        self.work = np.empty_like(self.damping)

    def __call__(self, values: FloatArray, wanted: BoolArray, out: FloatArray) -> FloatArray:
        """Out, filled with S D S of values where wanted, else with zero, as values are to be there."""
        from scatterers.kernels.tensor import twice

        twice(values, self.damping, wanted, *self.factors, self.work, out)
        return out


def _factors(n: int) -> FloatArray:
    """Bands of L, one and two below the diagonal, and 1/d of B = L diag(d) L^T for n nodes: (3, n)."""
    edge, near, middle = np.array([1, 26, 66]) / 120
    found = np.zeros((3, n))
    for i in range(n):
        # what the two rows before take of this one
        far = edge * found[2, i - 2] if i > 1 else 0.0
        left = near - (edge * found[0, i - 1] if i > 1 else 0.0) if i else 0.0
        found[:2, i] = left * found[2, i - 1], far
        found[2, i] = 1 / (middle - left * found[0, i] - edge * far)
    return found
