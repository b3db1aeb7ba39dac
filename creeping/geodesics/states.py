"""What is carried along a ray, by the names of its components.

    x (3), p (3) | M11, M21, M12, M22 | A | t1 | t2, crease

M is the Jacobi matrix of the metric ds/c, A the attenuation integral, t1 the time of detachment (inf before); see
`creeping.geodesics.equations` and `creeping.geodesics.attenuation`. A state has the first 6, 10 or 12 of them; on a
body with creases all 14, the last two the time at which the ray ended at a crease and the number of that (inf and -1
before); see `creeping.geodesics.pieces`.
"""

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.geometry.arguments import real_array
from creeping.geometry.piecewise import is_piecewise

X, P = slice(0, 3), slice(3, 6)
M11, M21, M12, M22 = range(6, 10)
ATTENUATION, DETACHMENT = 10, 11
END, CREASE = 12, 13
BARE, WITH_JACOBI, WHOLE, WITH_END = 6, 10, 12, 14
"""Components of a state: (x, p), with the Jacobi matrix, with attenuation and detachment, and with its end."""


def pack(points: FloatArray, directions: FloatArray, *, jacobi: bool = False, lanes: int = BARE) -> FloatArray:
    """States (n, lanes) from (..., 3) points and directions, at the start of their rays.

    6 components are (x, p); then come the identity as Jacobi matrix (``jacobi`` asks for 10), the attenuation integral
    0, the time of detachment inf, the time of an end inf and its crease -1.
    """
    states = np.concatenate([points.reshape(-1, 3), directions.reshape(-1, 3)], axis=1)
    more = [1.0, 0.0, 0.0, 1.0, 0.0, np.inf, np.inf, -1.0][: (WITH_JACOBI if jacobi else lanes) - BARE]
    return np.concatenate([states, np.tile(more, (len(states), 1))], axis=1) if more else states


def checked_states(states: FloatArray) -> FloatArray:
    """States of a caller as a contiguous array (n, 6, 10, 12 or 14).

    Raises
    ------
    InvalidInputError
        If their shape is another.
    """
    found = np.ascontiguousarray(real_array(states, "states"))
    if found.ndim != 2 or found.shape[1] not in (BARE, WITH_JACOBI, ATTENUATION + 1, WHOLE, WITH_END):
        raise InvalidInputError(
            f"states have shape {found.shape}; give rows of {BARE}, {WITH_JACOBI}, {WHOLE} or {WITH_END}"
        )
    return found


def unpack(states: FloatArray, shape: tuple[int, ...], scalar: bool) -> tuple[FloatArray, FloatArray]:
    """Points and directions of states (n, m, 6), in the shape of the starting points; (..., 3) for a scalar time."""
    states = states.reshape(*shape[:-1], states.shape[1], BARE)
    if scalar:
        states = states[..., 0, :]
    return states[..., X].copy(), states[..., P].copy()


def whole_lanes(body: Any) -> int:
    """Components of a state that tell all of a ray of a body."""
    return WITH_END if is_piecewise(body) else WHOLE


def known_steps(states: FloatArray, times: FloatArray) -> IntArray | None:
    """Steps of rays (n,) before each ends at a crease, of states (n, m, lanes); None where rays do not end so."""
    return np.searchsorted(times, states[:, -1, END], side="right") if states.shape[-1] > WHOLE else None
