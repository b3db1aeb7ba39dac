"""From values at the nodes of a grid to coefficients of quintic B-splines there: S = B^-1 along each axis.

B has the bands (1, 26, 66, 26, 1)/120, and S falls off by .43 from one node to the next: beyond `REACH` of them less is
left than 2e-6. Along long axes S is taken in blocks of rows that reach no farther.

Sources: Derivations, B6.
"""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
REACH, BLOCK = 16, 32
"""Nodes within which S is not neglected, and rows at a time."""


class Cardinal:
    """S on grids of one shape; symmetric, as B is."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self.shape = shape
        self.blocks = [_blocks(n) for n in shape]

    def __call__(self, values: FloatArray) -> FloatArray:
        """S along the three axes of values of the shape; nothing is transposed.

        Examples
        --------
        >>> Cardinal((7, 8, 9))(np.ones((7, 8, 9))).shape
        (7, 8, 9)
        """
        first, second, third = self.blocks
        found, other = np.empty(self.shape), np.empty(self.shape)
        flat, into = values.reshape(len(values), -1), found.reshape(len(values), -1)
        for rows, columns, part in first:
            np.matmul(part, flat[columns], out=into[rows])
        for rows, columns, part in second:
            other[:, rows] = np.matmul(part, found[:, columns])
        flat, into = other.reshape(-1, self.shape[2]), found.reshape(-1, self.shape[2])
        for rows, columns, part in third:
            into[:, rows] = flat[:, columns] @ part.T
        return found


def _blocks(n: int) -> list[tuple[slice, slice, FloatArray]]:
    """Rows and columns of blocks of S for n nodes, and these."""
    bands = np.array([1, 26, 66, 26, 1]) / 120
    whole = np.linalg.inv(sum(np.diag(np.full(n - abs(k), bands[k + 2]), k) for k in range(-2, 3)))
    if n <= 2 * BLOCK:
        return [(slice(0, n), slice(0, n), whole)]
    # what is neglected is so on both sides of the diagonal
    near = np.abs(np.subtract.outer(np.arange(n), np.arange(n))) <= REACH
    found = []
    for start in range(0, n, BLOCK):
        rows = slice(start, min(start + BLOCK, n))
        columns = slice(max(0, start - REACH), min(n, rows.stop + REACH))
        found.append((rows, columns, np.ascontiguousarray(np.where(near, whole, 0.0)[rows, columns])))
    return found
