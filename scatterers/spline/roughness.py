"""Fourth differences along the axes of a grid, as the bands of D^T D, and where their sum is wanted.

D takes c to c_k - 4 c_(k+1) + 6 c_(k+2) - 4 c_(k+3) + c_(k+4); near the ends of an axis D^T D has rows of its own.

Sources: Derivations, B6.
"""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def fourth_bands(shape: tuple[int, ...]) -> FloatArray:
    """Bands (9, sum of the shape) of D^T D, D the fourth differences along an axis, from below to above the diagonal.

    Examples
    --------
    >>> fourth_bands((9,))[:, 4]
    array([  1.,  -8.,  28., -56.,  70., -56.,  28.,  -8.,   1.])
    """
    parts = []
    for n in shape:
        difference = np.diff(np.eye(n), n=4, axis=0)
        gram = np.pad(difference.T @ difference, ((0, 0), (4, 4)))
        parts.append(np.stack([gram[np.arange(n), np.arange(n) + s] for s in range(9)]))
    return np.ascontiguousarray(np.concatenate(parts, axis=1))


def ranges(unknown: NDArray[np.bool_]) -> NDArray[np.int64]:
    """First number and the one behind the last (rows, 2) of what is unknown in rows along the last axis; 0, 0: none."""
    rows = unknown.reshape(-1, unknown.shape[-1])
    found = np.stack([rows.argmax(axis=1), rows.shape[1] - rows[:, ::-1].argmax(axis=1)], axis=1)
    found[~np.any(rows, axis=1)] = 0
    return found.astype(np.int64)
