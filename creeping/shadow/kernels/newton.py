"""Compiled Newton steps of least norm of many points, each onto the shadow line of its wave.

    F = 0,  G = grad F.q - w F = 0;   dx = -[F (Hq x W) + G (W x grad F)]/|W|^2,   W = grad F x Hq,   q = d + w x

T = W/|W| is the line's tangent and kappa_n = q.Hq/(|grad F| |q|^2) the curvature along the wave. A point stays where
its next step would be rounding, whatever the others of its block do.

Sources: Derivations, R6, R8 and R19.
"""

import math

from numba import njit

from creeping.kernels.block import BLOCK, aligned
from creeping.kernels.block import strict_options as options


@njit(**options)
def move(level, level_par, waves, x, reach, steps, work, tangents, curvature, left):
    """Move x (n, 3) onto the lines of waves (n, 4), or (1, 4) of one for all, by ``steps`` steps of at most ``reach``.

    Fills, where the points are in the end, T (n, 3), kappa_n (n,) and the sizes (n,) of the steps that would follow,
    none of them finite where there is no step. Returns the largest size, inf if one is not finite. work (23, BLOCK)
    is work space.
    """
    points, values, q, out = work[:3], work[3:13], work[13:17], work[17:23]
    worst = 0.0
    for start in range(0, x.shape[0], BLOCK):
        count = min(BLOCK, x.shape[0] - start)
        for i in range(BLOCK):
            # the last block is filled up with its last point
            at = start + min(i, count - 1)
            of = min(at, waves.shape[0] - 1)
            points[0, i], points[1, i], points[2, i] = x[at, 0], x[at, 1], x[at, 2]
            q[0, i], q[1, i], q[2, i], q[3, i] = waves[of, 0], waves[of, 1], waves[of, 2], waves[of, 3]
        for step in range(steps + 1):
            level(points, values[0], values[1:4], values[4:], level_par)
            if not _step(points.reshape(-1), values.reshape(-1), q.reshape(-1), out.reshape(-1), reach, step < steps):
                break
        for i in range(count):
            for axis in range(3):
                x[start + i, axis] = points[axis, i]
                tangents[start + i, axis] = out[axis, i]
            curvature[start + i], left[start + i] = out[3, i], out[4, i]
            worst = max(worst, out[4, i]) if out[4, i] < math.inf else math.inf
    return worst


@njit(**options)
def _step(x, g, wave, out, reach, on):
    """One step of a block, rows flat, taken if ``on``; whether any point has moved.

    out holds T, kappa_n, the step's size and the part taken of it.
    """
    taken = 1.0 if on else 0.0
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
        least = 2.0**-52 * (abs(x[i]) + abs(x[BLOCK + i]) + abs(x[2 * BLOCK + i]))
        part = 1.0 if size < reach else reach / size
        # a size that is no number is no small one
        part = 0.0 if size <= least else part * taken
        x[i] += part * sx
        x[BLOCK + i] += part * sy
        x[2 * BLOCK + i] += part * sz
        root = math.sqrt(inverse)
        out[i], out[BLOCK + i], out[2 * BLOCK + i] = wx * root, wy * root, wz * root
        bent = (qx * hx + qy * hy + qz * hz) / (qx * qx + qy * qy + qz * qz)
        out[3 * BLOCK + i], out[4 * BLOCK + i] = bent / math.sqrt(gx * gx + gy * gy + gz * gz), size
        out[5 * BLOCK + i] = part
    moved = False
    for i in range(5 * BLOCK, 6 * BLOCK):
        moved |= out[i] != 0.0
    return moved


@njit("float64[:, ::1]()", **options)
def work_space():
    """Work space of `move`."""
    return aligned(23, BLOCK)
