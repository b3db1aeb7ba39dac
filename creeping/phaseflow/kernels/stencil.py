"""What all compositions of maps share: stencil sums for a block of rays in explicit vector code.

Sources: [B78]; Derivations, B7.
"""

from numba import njit

from creeping.kernels.block import BLOCK, options
from creeping.kernels.contraction import contraction

_sum_3_4, _sum_5_4 = contraction(3, 4), contraction(5, 4)
_sum_3_8, _sum_5_8 = contraction(3, 8), contraction(5, 8)
_flat_3_4, _flat_5_4 = contraction(3, 4, flat=True), contraction(5, 4, flat=True)
_flat_3_8, _flat_5_8 = contraction(3, 8, flat=True), contraction(5, 8, flat=True)


@njit(**options)
def interpolate(table, degree, first, wu, wv, wa, count, out):
    """Stencil sums of the first ``count`` rays of a block: out (BLOCK, lanes), flat.

    ``first`` holds the number of each stencil's first coefficient; for the weights see `creeping.kernels.splines`. A
    table with one plane has no axis u.
    """
    lanes = table.shape[4]
    row = table.shape[3]
    plane = row * table.shape[2]
    su, sv = lanes * plane, lanes * row
    if table.shape[1] == 1:
        if lanes == 4 and degree == 3:
            for i in range(count):
                _flat_3_4(table, 4 * first[i], su, sv, wu, wv, wa, i, BLOCK, out, 4 * i)
        elif lanes == 4:
            for i in range(count):
                _flat_5_4(table, 4 * first[i], su, sv, wu, wv, wa, i, BLOCK, out, 4 * i)
        elif degree == 3:
            for i in range(count):
                _flat_3_8(table, 8 * first[i], su, sv, wu, wv, wa, i, BLOCK, out, 8 * i)
        else:
            for i in range(count):
                _flat_5_8(table, 8 * first[i], su, sv, wu, wv, wa, i, BLOCK, out, 8 * i)
    elif lanes == 4 and degree == 3:
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
    if table.shape[1] == 1 and degree == 3:
        for j in range(some):
            i = mine[j]
            _flat_3_8(table, 8 * first[i], su, sv, wu, wv, wa, i, BLOCK, out, 8 * j)
    elif table.shape[1] == 1:
        for j in range(some):
            i = mine[j]
            _flat_5_8(table, 8 * first[i], su, sv, wu, wv, wa, i, BLOCK, out, 8 * j)
    elif degree == 3:
        for j in range(some):
            i = mine[j]
            _sum_3_8(table, 8 * first[i], su, sv, wu, wv, wa, i, BLOCK, out, 8 * j)
    else:
        for j in range(some):
            i = mine[j]
            _sum_5_8(table, 8 * first[i], su, sv, wu, wv, wa, i, BLOCK, out, 8 * j)
