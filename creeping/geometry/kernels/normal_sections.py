"""Compiled curvatures of the body along a tangent and across it.

    kappa_n = p.Hp/|g|,   kappa_t = b.Hb/|g|,   b = g x p/|g|,   g = grad F

Sources: [G05]; Derivations, R1.
"""

import math

from numba import njit

from creeping.kernels.block import BLOCK, aligned
from creeping.kernels.block import strict_options as options
from creeping.kernels.curvature import second_form


@njit(**options)
def normal_sections(level, level_par, x, p, along, across):
    """Fill kappa_n and kappa_t (n,) at points x (n, 3) of the body with unit tangents p (n, 3)."""
    points, g = aligned(3, BLOCK), aligned(10, BLOCK)
    for start in range(0, x.shape[0], BLOCK):
        count = min(BLOCK, x.shape[0] - start)
        for i in range(BLOCK):
            # the last block is filled up with its last point
            for axis in range(3):
                points[axis, i] = x[start + min(i, count - 1), axis]
        level(points, g[0], g[1:4], g[4:], level_par)
        for i in range(count):
            px, py, pz = p[start + i, 0], p[start + i, 1], p[start + i, 2]
            gx, gy, gz = g[1, i], g[2, i], g[3, i]
            inverse = 1.0 / math.sqrt(gx * gx + gy * gy + gz * gz)
            xx, yy, zz, yz, xz, xy = g[4, i], g[5, i], g[6, i], g[7, i], g[8, i], g[9, i]
            bx, by, bz = (gy * pz - gz * py) * inverse, (gz * px - gx * pz) * inverse, (gx * py - gy * px) * inverse
            along[start + i] = second_form(px, py, pz, xx, yy, zz, yz, xz, xy) * inverse
            across[start + i] = second_form(bx, by, bz, xx, yy, zz, yz, xz, xy) * inverse
