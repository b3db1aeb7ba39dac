"""Where rotations lie on a table without azimuth, of a body of revolution x = psi(s); see `rotation`.

With S a turn about the axis a, psi(S s) = S psi(s) gives S R for R = [s, q, s x q], and the displacement R^-1 R' is one
for all turns: it is a function of

    R^T a = (s.a, q.a, (s x q).a) = (cos theta, -sin theta cos angle, sin theta sin angle),

theta the angle of s from the axis, angle that of q from the direction in which theta grows. At a pole, angle is any:
there the function does not depend on it. Beyond a pole theta goes on, so that its splines see a smooth function.

Sources: Derivations, R18.
"""

import math

from numba import njit

from creeping.kernels.block import BLOCK, options
from creeping.kernels.turns import turns


@njit(**options)
def locate(r, shift, work, chart, u, v, angle):
    """Chart 0, u = 0, v = theta/pi in [0, 1] and angle in turns of a block; the axis is shift[3:6]."""
    ax, ay, az = shift[3], shift[4], shift[5]
    along, one, other, across = work[0], work[1], work[2], work[3]
    for i in range(BLOCK):
        w, x, y, z = r[i], r[BLOCK + i], r[2 * BLOCK + i], r[3 * BLOCK + i]
        along[i] = ax * (1.0 - 2.0 * (y * y + z * z)) + 2.0 * ay * (x * y + w * z) + 2.0 * az * (x * z - w * y)
        one[i] = -(2.0 * ax * (x * y - w * z) + ay * (1.0 - 2.0 * (x * x + z * z)) + 2.0 * az * (y * z + w * x))
        other[i] = 2.0 * ax * (x * z + w * y) + 2.0 * ay * (y * z - w * x) + az * (1.0 - 2.0 * (x * x + y * y))
    for i in range(BLOCK):
        across[i] = math.sqrt(one[i] * one[i] + other[i] * other[i])
        chart[i] = 0
        u[i] = 0.0
    for i in range(BLOCK):
        v[i] = 2.0 * turns(across[i], along[i])
    for i in range(BLOCK):
        angle[i] = turns(other[i], one[i])
