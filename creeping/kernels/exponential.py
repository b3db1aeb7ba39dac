"""The exponential by a polynomial, which compilers vectorise where they only call a library's function.

    e^x = 2^n e^r,   n = floor(x/ln 2 + 1/2),   r = x - n ln 2 in two parts of ln 2,   |r| <= (ln 2)/2

with Taylor's polynomial of e^r, which ends below rounding; 2^n is put together from its bits.

Sources: [AS64, sec. 4.2].
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import options, strict_options
from creeping.kernels.turns import cosine_sine

LOWEST, HIGHEST = -700.0, 700.0
"""Arguments beyond are taken for these: e^x is no number there, or nothing."""
_PER_LN_2 = 1 / math.log(2.0)
_LN_2_HIGH = 0.693147180369123816490
"""With 32 zeros at its end: n times it is exact."""
_LN_2_LOW = 1.90821492927058770002e-10
_BITS = 1.5 * 2.0**52
"""A number n added to it stands in its last bits."""
C2, C3, C4, C5, C6, C7, C8, C9, C10, C11, C12, C13 = (1 / math.factorial(n) for n in range(2, 14))
_PER_TURN = 0.5 / math.pi


# to the letter: sums that may be reordered would put the two parts of ln 2 together
@njit(**strict_options, forceinline=True)
def exponential(x):
    """e^x, to 4e-16 of itself."""
    x = min(max(x, LOWEST), HIGHEST)
    n = math.floor(x * _PER_LN_2 + 0.5)
    r = (x - n * _LN_2_HIGH) - n * _LN_2_LOW
    p = C8 + r * (C9 + r * (C10 + r * (C11 + r * (C12 + r * C13))))
    p = 1.0 + r * (1.0 + r * (C2 + r * (C3 + r * (C4 + r * (C5 + r * (C6 + r * (C7 + r * p)))))))
    power = (np.float64(n + _BITS).view(np.int64) << 52) + (np.int64(1023) << 52)
    return p * np.int64(power).view(np.float64)


@njit(**options)
def wave(real, imaginary):
    """Real and imaginary part of e^(a + ib)."""
    size = exponential(real)
    cosine, sine = cosine_sine(imaginary * _PER_TURN)
    return size * cosine, size * sine
