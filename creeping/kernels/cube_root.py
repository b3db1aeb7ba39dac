"""The cube root by Newton's method without a division, which compilers vectorise: a library's power they only call.

    r <- r (4 - x r^3)/3 tends to x^(-1/3),   x^(1/3) = x r^2

from a guess whose bits are about those of x over -3.

Sources: [AS64, sec. 3.9] for Newton's method.
"""

import numpy as np
from numba import njit

from creeping.kernels.block import strict_options

LEAST, LARGEST = 1e-90, 1e90
"""Between which x is taken to lie: the root of less is one of 0, to 1e-30."""
_WHOLE = 2.0**52
"""A whole number added to it stands in its last bits."""
_HIGH = 4.0 / 3.0 * 1023 * 2.0**20 - 0.1035 * 2.0**20
"""Upper half of the guess's bits at x whose own are 0; its last term makes errors of both signs alike."""
ROUNDS = 5


# to the letter: sums that may be reordered would undo the guess
@njit(**strict_options, forceinline=True)
def cube_root(x):
    """x^(1/3) to 8e-16 of itself for LEAST <= x <= LARGEST, 0 below."""
    inside = min(max(x, LEAST), LARGEST)
    bits = (np.float64(inside).view(np.int64) >> 32) + np.float64(_WHOLE).view(np.int64)
    high = np.int64(bits).view(np.float64) - _WHOLE
    guess = np.float64(np.floor(_HIGH - high * (1 / 3)) + _WHOLE).view(np.int64) << 32
    r = np.int64(guess).view(np.float64)
    for _ in range(ROUNDS):
        r = r * (4.0 - inside * r * r * r) * (1 / 3)
    root = inside * r * r
    return root if x >= LEAST else 0.0
