"""Compiled Newton steps of least norm of many points, each onto the shadow line of its own wave.

    F = 0,  G = grad F.q - w F = 0;   dx = -[F (Hq x W) + G (W x grad F)]/|W|^2,   W = grad F x Hq,   q = d + w x

A point stays where its next step would be rounding, whatever the others of its block do.

Sources: Derivations, R7 and R19.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import BLOCK, aligned
from creeping.kernels.block import strict_options as options

ROUNDING = float(np.finfo(float).eps)
ROWS = 22
"""Of work space: points, what is known of F there, waves, tangents, sizes of steps and the part taken of them."""


@njit(**options)
def move(level, level_par, waves, x, reach, steps, work, tangents, left):
    """Move x (n, 3) onto the lines of waves (n, 4), (d, w), by so many steps, each at most ``reach``.

    Fills the unit tangents (n, 3) W/|W| and the sizes (n,) of the next steps, where the points are in the end; neither
    is finite where there is no step. work (ROWS, BLOCK) is work space.
    """
    points, values, q, out = work[:3], work[3:13], work[13:17], work[17:22]
    for start in range(0, x.shape[0], BLOCK):
        count = min(BLOCK, x.shape[0] - start)
        for i in range(BLOCK):
            # the last block is filled up with its last point
            at = start + min(i, count - 1)
            for axis in range(3):
                points[axis, i] = x[at, axis]
            for part in range(4):
                q[part, i] = waves[at, part]
        for step in range(steps + 1):
            level(points, values[0], values[1:4], values[4:], level_par)
            if not _step(points.reshape(-1), values.reshape(-1), q.reshape(-1), out.reshape(-1), reach, step < steps):
                break
        for i in range(count):
            for axis in range(3):
                x[start + i, axis] = points[axis, i]
                tangents[start + i, axis] = out[axis, i]
            left[start + i] = out[3, i]


@njit(**options)
def _step(x, g, wave, out, reach, on):
    """One step of a block, rows flat, taken if ``on``; whether any point has moved. out holds T and the step's size."""
    for i in range(BLOCK):
        F, gx, gy, gz = g[i], g[BLOCK + i], g[2 * BLOCK + i], g[3 * BLOCK + i]
        xx, yy, zz = g[4 * BLOCK + i], g[5 * BLOCK + i], g[6 * BLOCK + i]
        yz, xz, xy = g[7 * BLOCK + i], g[8 * BLOCK + i], g[9 * BLOCK + i]
        w = wave[3 * BLOCK + i]
        qx, qy, qz = wave[i] + w * x[i], wave[BLOCK + i] + w * x[BLOCK + i], wave[2 * BLOCK + i] + w * x[2 * BLOCK + i]
        hx, hy, hz = xx * qx + xy * qy + xz * qz, xy * qx + yy * qy + yz * qz, xz * qx + yz * qy + zz * qz
        G = gx * qx + gy * qy + gz * qz - w * F
        wx, wy, wz = gy * hz - gz * hy, gz * hx - gx * hz, gx * hy - gy * hx
        inverse = 1.0 / (wx * wx + wy * wy + wz * wz)
        sx = -(F * (hy * wz - hz * wy) + G * (wy * gz - wz * gy)) * inverse
        sy = -(F * (hz * wx - hx * wz) + G * (wz * gx - wx * gz)) * inverse
        sz = -(F * (hx * wy - hy * wx) + G * (wx * gy - wy * gx)) * inverse
        size = math.sqrt(sx * sx + sy * sy + sz * sz)
        part = min(1.0, reach / size) if size > 0.0 else 1.0
        least = ROUNDING * max(abs(x[i]), abs(x[BLOCK + i]), abs(x[2 * BLOCK + i]))
        # a size that is no number is no small one
        part = part if on and not size <= least else 0.0
        x[i] += part * sx
        x[BLOCK + i] += part * sy
        x[2 * BLOCK + i] += part * sz
        root = math.sqrt(inverse)
        out[i], out[BLOCK + i], out[2 * BLOCK + i], out[3 * BLOCK + i] = wx * root, wy * root, wz * root, size
        out[4 * BLOCK + i] = part
    moved = False
    for i in range(4 * BLOCK, 5 * BLOCK):
        moved |= out[i] != 0.0
    return moved


@njit("float64[:, ::1]()", **options)
def work_space():
    """Work space of `move`."""
    return aligned(ROWS, BLOCK)
