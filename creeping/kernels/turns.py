"""Angles in turns by polynomials, which compilers vectorise where they only call a library's functions.

With t reduced to -1/2..1/2, s = sin(pi t) and c = cos(pi t) by their Taylor polynomials, which end below rounding,
cos 2 pi t = 1 - 2 s^2 and sin 2 pi t = 2 s c. The angle of a vector by arctan z = z + z^3 P(z^2), |z| <= tan(pi/8);
both are good to rounding.

Sources: [AS64, sec. 4.3].
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import options

_TAN_PI_8 = math.tan(math.pi / 8)
_S = np.array([(-1.0) ** j * math.pi ** (2 * j + 1) / math.factorial(2 * j + 1) for j in range(10)])
_C = np.array([(-1.0) ** j * math.pi ** (2 * j) / math.factorial(2 * j) for j in range(11)])
S0, S1, S2, S3, S4, S5, S6, S7, S8, S9 = (float(v) for v in _S)
C0, C1, C2, C3, C4, C5, C6, C7, C8, C9, C10 = (float(v) for v in _C)


@njit(**options)
def turns(across, along):
    """Angle atan2(across, along) in turns, in [0, 1); libm's atan2 does not vectorise."""
    a, b = abs(across), abs(along)
    low, high = min(a, b), max(a, b)
    # atan(low/high) = pi/4 + atan((low - high)/(low + high)) keeps the argument below tan(pi/8)
    steep = low > _TAN_PI_8 * high
    top = low - high if steep else low
    bottom = low + high if steep else high
    z = top / (bottom if bottom > 0.0 else 1.0)
    s = z * z
    r = -0.04347919839046537 + s * 0.021133752033748364
    r = 0.0568830340363325 + s * r
    r = -0.066402251735395 + s * r
    r = 0.07689952488233016 + s * r
    r = -0.09090773003240828 + s * r
    r = 0.11111106177375227 + s * r
    r = -0.14285714180900647 + s * r
    r = 0.19999999998854168 + s * r
    r = -0.33333333333328435 + s * r
    angle = (z + z * s * r) * (0.5 / math.pi)
    angle = angle + 0.125 if steep else angle
    angle = 0.25 - angle if a > b else angle
    angle = 0.5 - angle if along < 0.0 else angle
    angle = 1.0 - angle if across < 0.0 else angle
    return angle - 1.0 if angle >= 1.0 else angle


@njit(**options)
def cosine_sine(turns):
    """Cosine and sine of an angle in turns."""
    t = turns - math.floor(turns + 0.5)
    z = t * t
    s = S0 + z * (S1 + z * (S2 + z * (S3 + z * (S4 + z * (S5 + z * (S6 + z * (S7 + z * (S8 + z * S9))))))))
    c = C5 + z * (C6 + z * (C7 + z * (C8 + z * (C9 + z * C10))))
    c = C0 + z * (C1 + z * (C2 + z * (C3 + z * (C4 + z * c))))
    s *= t
    return 1.0 - 2.0 * s * s, 2.0 * s * c
