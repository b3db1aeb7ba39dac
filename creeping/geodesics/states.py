"""What is carried along a ray, by the names of its components.

    x (3), p (3) | M11, M21, M12, M22 | A | t1

M is the Jacobi matrix of the metric ds/c, A the attenuation integral, t1 the time of detachment (inf before); see
`creeping.geodesics.equations` and `creeping.geodesics.attenuation`. A state has the first 6, 10 or all 12 of them.
"""

import numpy as np

from creeping._typing import FloatArray
from creeping.errors import InvalidInputError
from creeping.geometry.arguments import real_array

X, P = slice(0, 3), slice(3, 6)
M11, M21, M12, M22 = range(6, 10)
ATTENUATION, DETACHMENT = 10, 11
BARE, WITH_JACOBI, WHOLE = 6, 10, 12
"""Components of a state: (x, p), with the Jacobi matrix, and with attenuation and detachment."""


def pack(points: FloatArray, directions: FloatArray, *, jacobi: bool = False, lanes: int = BARE) -> FloatArray:
    """States (n, lanes) from (..., 3) points and directions, at the start of their rays.

    6 components are (x, p); then come the identity as Jacobi matrix (``jacobi`` asks for 10), the attenuation integral
    0 and the time of detachment inf.
    """
    states = np.concatenate([points.reshape(-1, 3), directions.reshape(-1, 3)], axis=1)
    more = [1.0, 0.0, 0.0, 1.0, 0.0, np.inf][: (WITH_JACOBI if jacobi else lanes) - BARE]
    return np.concatenate([states, np.tile(more, (len(states), 1))], axis=1) if more else states


def checked_states(states: FloatArray) -> FloatArray:
    """States of a caller as a contiguous array (n, 6, 10 or 12).

    Raises
    ------
    InvalidInputError
        If their shape is another.
    """
    found = np.ascontiguousarray(real_array(states, "states"))
    if found.ndim != 2 or found.shape[1] not in (BARE, WITH_JACOBI, ATTENUATION + 1, WHOLE):
        raise InvalidInputError(f"states have shape {found.shape}; give rows of {BARE}, {WITH_JACOBI} or {WHOLE}")
    return found


def unpack(states: FloatArray, shape: tuple[int, ...], scalar: bool) -> tuple[FloatArray, FloatArray]:
    """Points and directions of states (n, m, 6), in the shape of the starting points; (..., 3) for a scalar time."""
    states = states.reshape(*shape[:-1], states.shape[1], BARE)
    if scalar:
        states = states[..., 0, :]
    return states[..., X].copy(), states[..., P].copy()
