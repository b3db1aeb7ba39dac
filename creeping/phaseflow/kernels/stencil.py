"""What all compositions of maps share: angles, and stencil sums for a block of rays in explicit vector code.

Sources: [B78]; Derivations, B7.
"""

import math

from numba import njit

from creeping.kernels.block import BLOCK, options
from creeping.kernels.contraction import contraction

_sum_3_4, _sum_5_4 = contraction(3, 4), contraction(5, 4)
_sum_3_8, _sum_5_8 = contraction(3, 8), contraction(5, 8)
_TAN_PI_8 = math.tan(math.pi / 8)


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
def interpolate(table, degree, first, wu, wv, wa, count, out):
    """Stencil sums of the first ``count`` rays of a block: out (BLOCK, lanes), flat.

    ``first`` holds the number of each stencil's first coefficient; for the weights see `creeping.kernels.splines`.
    """
    lanes = table.shape[4]
    row = table.shape[3]
    plane = row * table.shape[2]
    su, sv = lanes * plane, lanes * row
    if lanes == 4 and degree == 3:
        for i in range(count):
            _sum_3_4(table, 4 * first[i], su, sv, wu, wv, wa, i, BLOCK, out, 4 * i)
    elif lanes == 4:
        for i in range(count):
            _sum_5_4(table, 4 * first[i], su, sv, wu, wv, wa, i, BLOCK, out, 4 * i)
    elif degree == 3:
        for i in range(count):
            _sum_3_8(table, 8 * first[i], su, sv, wu, wv, wa, i, BLOCK, out, 8 * i)
    else:
        for i in range(count):
            _sum_5_8(table, 8 * first[i], su, sv, wu, wv, wa, i, BLOCK, out, 8 * i)


@njit(**options)
def interpolate_some(table, degree, first, wu, wv, wa, mine, some, out):
    """Eight-lane sums of the rays mine[:some] of a block, one after the other in ``out``; see `interpolate`."""
    row = table.shape[3]
    su, sv = 8 * row * table.shape[2], 8 * row
    if degree == 3:
        for j in range(some):
            i = mine[j]
            _sum_3_8(table, 8 * first[i], su, sv, wu, wv, wa, i, BLOCK, out, 8 * j)
    else:
        for j in range(some):
            i = mine[j]
            _sum_5_8(table, 8 * first[i], su, sv, wu, wv, wa, i, BLOCK, out, 8 * j)
