"""Spreading of rays launched from a line with one direction: J, J' and the caustics passed.

    J = c I,  I(t) = I(0) M11(t) + I'(0) M12(t),  I(0) = 1/c,  I'(0) = (J'(0) - (p.grad c))/c,

M the Jacobi matrix that the flow carries along; J(0), J'(0) of `creeping.geodesics.equations.launch_spreading`.

Sources: Derivations, R3 to R5.
"""

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.geodesics.equations import launch_spreading, speed_of, speed_values
from creeping.geometry.surface import Surface


def spread(
    body: Surface, starts: FloatArray, directions: FloatArray, states: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """J, J' (rays, steps) and the rays whose launch point has no speed.

    ``starts`` (rays, 6) are points and tangents of the line, ``directions`` (rays, 3) those of the launch, ``states``
    (rays, steps, 10 or more) what the flow carried from there.
    """
    first = launch_spreading(body, starts[:, :3], directions, starts[:, 3:])
    i, j = first[:, 0], first[:, 1]
    x, p = states[..., :3], states[..., 3:6]
    c = speed_values(body, x)
    rate = np.zeros_like(c)
    stalled = np.zeros(len(starts), dtype=bool)
    if speed_of(body) is not None:
        rate = np.sum(speed_of(body).gradient(x) * p, axis=-1)
        stalled = c[:, 0] < 1e-12 * float(np.max(c, initial=0.0))
        c0 = np.where(stalled, np.nan, c[:, 0])
        i = i / c0
        j = (j - rate[:, 0]) / c0
    reduced = i[:, None] * states[..., 6] + j[:, None] * states[..., 8]
    reduced_rate = i[:, None] * states[..., 7] + j[:, None] * states[..., 9]
    # J' = c I' + (dc/dt) I with dc/dt = c grad c.p
    return c * reduced, c * reduced_rate + c * rate * reduced, stalled


def zeros_passed(spreading: FloatArray) -> IntArray:
    """Sign changes of J up to each step; a step that lands on a zero counts once it is passed."""
    sign = np.sign(spreading)
    count = np.zeros(sign.shape, dtype=np.int64)
    last = sign[:, 0].copy() if sign.shape[1] else np.zeros(0)
    for k in range(1, sign.shape[1]):
        flipped = sign[:, k] * last < 0
        count[:, k] = count[:, k - 1] + flipped
        last = np.where(sign[:, k] != 0, sign[:, k], last)
    return count
