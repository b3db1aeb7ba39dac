"""Compiled twin of `bundle.bundle_points`: points and directions of a caller are checked and put onto T1Q."""

import math

from numba import njit

from creeping.kernels.block import BLOCK, aligned, entry_options

STEPS = 8
"""Most Newton steps onto the body, as of `geometry.surface.project`."""


@njit(**entry_options)
def enter(level, level_par, points, directions, off, close, least, out):
    """States (n, 6) of points and directions (n, 3); returns how many of them cannot be taken.

    That are points not finite or farther than ``off``, L, from the body, and directions not finite, zero, or with a
    tangential part below ``least`` of them. Newton steps end at distances of ``close``, L, of each point on its own.
    """
    n, refused = points.shape[0], 0
    x, geometry = aligned(3, BLOCK), aligned(10, BLOCK)
    value, gx, gy, gz = geometry[0], geometry[1], geometry[2], geometry[3]
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        for i in range(BLOCK):
            for k in range(3):
                x[k, i] = points[start + min(i, count - 1), k]
        for step in range(STEPS + 1):
            level(x, value, geometry[1:4], geometry[4:], level_par)
            moving = 0
            for i in range(count):
                square = gx[i] * gx[i] + gy[i] * gy[i] + gz[i] * gz[i]
                distance = abs(value[i]) / math.sqrt(square)
                if step == 0 and not distance <= off:
                    refused += 1
                if step < STEPS and not distance <= close:
                    moving += 1
                    part = value[i] / square
                    x[0, i] -= part * gx[i]
                    x[1, i] -= part * gy[i]
                    x[2, i] -= part * gz[i]
            for i in range(count, BLOCK):
                for k in range(3):
                    x[k, i] = x[k, count - 1]
            if moving == 0:
                break
        for i in range(count):
            px, py, pz = directions[start + i, 0], directions[start + i, 1], directions[start + i, 2]
            # of a length whose square may be beyond the floating-point numbers
            longest = max(abs(px), abs(py), abs(pz))
            px, py, pz = px / longest, py / longest, pz / longest
            length = math.sqrt(px * px + py * py + pz * pz)
            along = (px * gx[i] + py * gy[i] + pz * gz[i]) / (gx[i] * gx[i] + gy[i] * gy[i] + gz[i] * gz[i])
            px, py, pz = px - along * gx[i], py - along * gy[i], pz - along * gz[i]
            tangent = math.sqrt(px * px + py * py + pz * pz)
            if not (tangent >= least * length and longest < math.inf):
                refused += 1
            for k in range(3):
                out[start + i, k] = x[k, i]
            out[start + i, 3], out[start + i, 4], out[start + i, 5] = px / tangent, py / tangent, pz / tangent
    return refused
