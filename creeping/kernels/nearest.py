"""Compiled search for the points of the body nearest to given points off it.

x + h n(x) = y and F(x) = 0, n the unit normal, by Newton steps: with t the tangential part of y - x and S the shape
operator,

    dx = (1 + h S)^(-1) t - (F/|grad F|) n,   (1 + h S)^(-1) t = ((1 + 2 M h) t - h S t)/(1 + 2 M h + K h^2),

2 M = kappa_1 + kappa_2, the closed form being that of 2 x 2 matrices.

Sources: [G05]; Derivations, B11.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import BLOCK, aligned, copy, strict_options
from creeping.kernels.exponential import adjugate_form, second_form


@njit(**strict_options)
def nearest(level, level_par, y, steps, close, x, n, shape, height):
    """Fill the nearest points x (3, m) of points y (3, m), normals n (3, m), H/|grad F| (6, m) and h (m,).

    At most ``steps`` steps, until no point of a block moves by more than ``close``. Returns the largest last step.
    """
    points, g, moved = aligned(3, BLOCK), aligned(10, BLOCK), np.empty(BLOCK)
    worst = 0.0
    for start in range(0, y.shape[1], BLOCK):
        count = min(BLOCK, y.shape[1] - start)
        for axis in range(3):
            copy(y[axis, start : start + count], points[axis, :count])
            points[axis, count:] = y[axis, start + count - 1]
        largest = math.inf
        for step in range(steps + 1):
            level(points, g[0], g[1:4], g[4:], level_par)
            if step == steps or largest <= close:
                break
            largest = 0.0
            for i in range(BLOCK):
                at = start + min(i, count - 1)
                gx, gy, gz = g[1, i], g[2, i], g[3, i]
                inverse = 1.0 / math.sqrt(gx * gx + gy * gy + gz * gz)
                nx, ny, nz = gx * inverse, gy * inverse, gz * inverse
                xx, yy, zz = g[4, i] * inverse, g[5, i] * inverse, g[6, i] * inverse
                yz, xz, xy = g[7, i] * inverse, g[8, i] * inverse, g[9, i] * inverse
                wx, wy, wz = y[0, at] - points[0, i], y[1, at] - points[1, i], y[2, at] - points[2, i]
                h = wx * nx + wy * ny + wz * nz
                tx, ty, tz = wx - h * nx, wy - h * ny, wz - h * nz
                sx, sy, sz = xx * tx + xy * ty + xz * tz, xy * tx + yy * ty + yz * tz, xz * tx + yz * ty + zz * tz
                along = sx * nx + sy * ny + sz * nz
                bent = 1.0 + h * (xx + yy + zz - second_form(nx, ny, nz, xx, yy, zz, yz, xz, xy))
                scale = 1.0 / (bent + h * h * adjugate_form(nx, ny, nz, xx, yy, zz, yz, xz, xy))
                off = g[0, i] * inverse
                dx = (bent * tx - h * (sx - along * nx)) * scale - off * nx
                dy = (bent * ty - h * (sy - along * ny)) * scale - off * ny
                dz = (bent * tz - h * (sz - along * nz)) * scale - off * nz
                points[0, i], points[1, i], points[2, i] = points[0, i] + dx, points[1, i] + dy, points[2, i] + dz
                moved[i] = math.sqrt(dx * dx + dy * dy + dz * dz)
            for i in range(BLOCK):
                # a NaN must not hide behind the comparison
                if not moved[i] <= largest:
                    largest = moved[i]
        if not largest <= worst:
            worst = largest
        for i in range(count):
            gx, gy, gz = g[1, i], g[2, i], g[3, i]
            inverse = 1.0 / math.sqrt(gx * gx + gy * gy + gz * gz)
            at = start + i
            x[0, at], x[1, at], x[2, at] = points[0, i], points[1, i], points[2, i]
            n[0, at], n[1, at], n[2, at] = gx * inverse, gy * inverse, gz * inverse
            for entry in range(6):
                shape[entry, at] = g[4 + entry, i] * inverse
            height[at] = (
                (y[0, at] - x[0, at]) * n[0, at] + (y[1, at] - x[1, at]) * n[1, at] + (y[2, at] - x[2, at]) * n[2, at]
            )
    return worst
