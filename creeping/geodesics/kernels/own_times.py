"""Compiled tracer of rays each to a time of its own; arithmetic as in `creeping.geodesics.kernels.integrator`.

Rays of a block go side by side, y' = h_i f(y), each with its own step h_i: what stops one of them does not stop others.

Sources: [HNW93, sec. II.10].
"""

import math

import numpy as np
from numba import njit

from creeping.geodesics.kernels.integrator import add_stages, project_block, right_hand_side
from creeping.kernels.block import BLOCK, aligned, options


@njit(**options)
def _scaled(k, trial):
    """Multiply the derivative k (lanes, BLOCK) of each ray by its step."""
    for lane in range(k.shape[0]):
        for i in range(BLOCK):
            k[lane, i] *= trial[i]


@njit(**options)
def _errors(estimates, y, z, scale, rtol, errors):
    """Error of each ray in units of the tolerance, of estimates that hold the step already."""
    lanes = y.shape[0]
    for i in range(BLOCK):
        third = fifth = 0.0
        for lane in range(lanes):
            inverse = 1.0 / (rtol * max(scale[lane], abs(y[lane, i]), abs(z[lane, i])))
            d3, d5 = estimates[0, lane, i] * inverse, estimates[1, lane, i] * inverse
            third += d3 * d3
            fifth += d5 * d5
        errors[i] = 0.0 if fifth == 0.0 else fifth / math.sqrt((fifth + 0.01 * third) * lanes)


@njit(**options)
def integrate_own(
    level, level_par, speed, speed_par, weighted, states, times, terms, index, weights, scale, rtol, step, limit, out
):  # fmt: skip
    """Trace states (n, lanes), each to its time (n,), into out (n, lanes): NaN of a ray that does not come there.

    Arguments are as for `creeping.geodesics.kernels.integrator.integrate`; rtol > 0, and ``limit`` is of each ray.
    """
    n, lanes = states.shape
    stages = terms.shape[0] - 3
    size = lanes * BLOCK
    k = aligned(stages + 1, size).reshape(stages + 1, lanes, BLOCK)
    y, z, slope, last = aligned(lanes, BLOCK), aligned(lanes, BLOCK), aligned(lanes, BLOCK), aligned(lanes, BLOCK)
    estimates, zero = aligned(2, size).reshape(2, lanes, BLOCK), np.zeros((lanes, BLOCK))
    geometry, weight = aligned(10, BLOCK), aligned(10, BLOCK)
    left, h, trial, errors = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK)
    used = np.empty(BLOCK, np.int64)
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        for i in range(BLOCK):
            for lane in range(lanes):
                y[lane, i] = states[start + min(i, count - 1), lane]
            left[i] = times[start + i] if i < count else 0.0
            h[i], used[i] = step, 0
        right_hand_side(level, level_par, speed, speed_par, weighted, y, slope, geometry, weight)
        while True:
            going = False
            for i in range(BLOCK):
                trial[i] = min(h[i], left[i]) if left[i] > 0.0 else 0.0
                going |= trial[i] > 0.0
            if not going:
                break
            for lane in range(lanes):
                for i in range(BLOCK):
                    k[0, lane, i] = slope[lane, i] * trial[i]
            for s in range(1, stages + 1):
                add_stages(terms[s], weights[s], index[s], k, y, z)
                right_hand_side(level, level_par, speed, speed_par, weighted, z, k[s], geometry, weight)
                if s == stages:
                    last[:] = k[s]
                _scaled(k[s], trial)
            for e in range(2):
                row = stages + 1 + e
                add_stages(terms[row], weights[row], index[row], k, zero, estimates[e])
            _errors(estimates, y, z, scale, rtol, errors)
            for i in range(BLOCK):
                if trial[i] > 0.0 and errors[i] < 1.0:
                    total = 0.0
                    for lane in range(lanes):
                        total += abs(z[lane, i])
                    # what is not finite is refused as too large an error is
                    errors[i] = errors[i] if total < 1e300 else math.nan
            project_block(z, geometry)
            for i in range(BLOCK):
                if not trial[i] > 0.0:
                    continue
                used[i] += 1
                if errors[i] < 1.0:
                    grow = min(5.0, 0.9 * max(errors[i], 1e-8) ** (-0.125))
                    left[i] = 0.0 if trial[i] >= left[i] else left[i] - trial[i]
                    h[i] = max(h[i], trial[i] * grow) if trial[i] < h[i] else trial[i] * grow
                    for lane in range(lanes):
                        y[lane, i], slope[lane, i] = z[lane, i], last[lane, i]
                else:
                    h[i] = trial[i] * (max(0.2, 0.9 * errors[i] ** (-0.125)) if errors[i] < 1e300 else 0.2)
                if left[i] > 0.0 and (used[i] >= limit or h[i] < 1e-12 * step):
                    left[i] = 0.0
                    for lane in range(lanes):
                        y[lane, i] = math.nan
        for i in range(count):
            for lane in range(lanes):
                out[start + i, lane] = y[lane, i]
