"""Compiled tracer of rays each to a time of its own; arithmetic as in `creeping.geodesics.kernels.integrator`.

Rays of a block go side by side, y' = h_i f(y), each with its own step h_i: what stops one of them does not stop others.

Sources: [HNW93, sec. II.10].
"""

import math

import numpy as np
from numba import njit

from creeping.geodesics.kernels.flow_derivative import derivative, project_block
from creeping.geodesics.kernels.integrator import solution, sum_stages
from creeping.geodesics.tableaus import DORMAND_PRINCE_8
from creeping.kernels.block import BLOCK, aligned, options
from creeping.kernels.vectors import LANES, load, pointer, store

_STAGES = DORMAND_PRINCE_8.stages


@njit(**options)
def _scaled(k, size, steps, scaled):
    """Derivative of each ray times its step, to ``scaled``; all by their addresses."""
    for row in range(0, size, BLOCK):
        for i in range(0, BLOCK, LANES):
            store(scaled, row + i, load(k, row + i) * load(steps, i))


@njit(**options)
def integrate_own(
    level, level_par, speed, speed_par, weighted, states, times, scale, rtol, step, limit, out
):  # fmt: skip
    """Trace states (n, lanes), each to its time (n,), into out (n, lanes): NaN of a ray that does not come there.

    Arguments are as for `creeping.geodesics.kernels.integrator.integrate`; rtol > 0, and ``limit`` is of each ray.
    """
    n, lanes = states.shape
    size = lanes * BLOCK
    rows = aligned((_STAGES + 6) * lanes + 22, BLOCK)
    here, there, ahead = rows[:lanes], rows[lanes : 2 * lanes], rows[2 * lanes : 3 * lanes]
    slope, last, geometry = rows[3 * lanes : 4 * lanes], rows[4 * lanes : 5 * lanes], rows[5 * lanes :]
    weight, trial, errors = geometry[10:20], geometry[20], geometry[21]
    points, values, gradients, hessians = there[:3], geometry[0], geometry[1:4], geometry[4:10]
    speeds, slopes, bends = weight[0], weight[1:4], weight[4:10]
    y = pointer(rows.reshape(-1), 0)
    z, new, f0, f1 = pointer(y, size), pointer(y, 2 * size), pointer(y, 3 * size), pointer(y, 4 * size)
    g = pointer(y, 5 * size)
    w, steps, k = pointer(g, 10 * BLOCK), pointer(g, 20 * BLOCK), pointer(g, 22 * BLOCK)
    left, h = np.empty(BLOCK), np.empty(BLOCK)
    used = np.empty(BLOCK, np.int64)
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        for i in range(BLOCK):
            for lane in range(lanes):
                here[lane, i] = states[start + min(i, count - 1), lane]
            left[i] = times[start + i] if i < count else 0.0
            h[i], used[i] = step, 0
        there[:] = here
        known = False
        while True:
            going = False
            for i in range(BLOCK):
                trial[i] = min(h[i], left[i]) if left[i] > 0.0 else 0.0
                going |= trial[i] > 0.0
            if not going:
                break
            if known:
                _scaled(f0, size, steps, k)
            # one place for all stages: each takes time to compile
            for s in range(1 if known else 0, _STAGES + 1):
                if s == _STAGES:
                    solution(k, y, z, scale, rtol, 1.0, pointer(steps, BLOCK))
                elif s > 0:
                    sum_stages(s, 1.0, k, size, y, z)
                level(points, values, gradients, hessians, level_par)
                if weighted:
                    speed(points, speeds, slopes, bends, speed_par)
                derivative(weighted, lanes, z, g, w, f1)
                _scaled(f1, size, steps, pointer(k, s * size))
                if s == 0:
                    slope[:] = last
            project_block(z, lanes, g, new)
            known = True
            for i in range(BLOCK):
                if not trial[i] > 0.0:
                    continue
                used[i] += 1
                total = 0.0
                for lane in range(lanes):
                    total += abs(ahead[lane, i])
                # what is not finite is refused as too large an error is
                if errors[i] < 1.0 and total < 1e300:
                    grow = min(5.0, 0.9 * max(errors[i], 1e-8) ** (-0.125))
                    left[i] = 0.0 if trial[i] >= left[i] else left[i] - trial[i]
                    h[i] = max(h[i], trial[i] * grow) if trial[i] < h[i] else trial[i] * grow
                    for lane in range(lanes):
                        here[lane, i], slope[lane, i] = ahead[lane, i], last[lane, i]
                else:
                    h[i] = trial[i] * (max(0.2, 0.9 * errors[i] ** (-0.125)) if 1.0 <= errors[i] < 1e300 else 0.2)
                if left[i] > 0.0 and (used[i] >= limit or h[i] < 1e-12 * step):
                    left[i] = 0.0
                    for lane in range(lanes):
                        here[lane, i] = math.nan
        for i in range(count):
            for lane in range(lanes):
                out[start + i, lane] = here[lane, i]
