"""From values at the nodes of a grid to coefficients of quintic B-splines there: S = B^-1 along each axis.

B has the bands (1, 26, 66, 26, 1)/120, and is factored once for each axis.

Sources: Derivations, B6.
"""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


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

    def __call__(self, values: FloatArray, wanted: NDArray[np.bool_], out: FloatArray) -> FloatArray:
        """Out, filled with S D S of values where wanted, else with zero, as values are to be there."""
        from scatterers.kernels.cardinal import twice

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
