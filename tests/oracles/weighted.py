"""Sums over nodes as they are written."""

import numpy as np

from creeping._typing import Any, FloatArray


def combined(weights: FloatArray, values: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Sums over nodes, in their order in whatever company: weights (n, nodes), values (nodes, ...) -> (n, ...)."""
    more = (1,) * (values.ndim - 1)
    out: np.ndarray[Any, Any] = weights[:, 0].reshape(-1, *more) * values[0]
    for weight, value in zip(weights.T[1:], values[1:], strict=True):
        out += weight.reshape(-1, *more) * value
    return out
