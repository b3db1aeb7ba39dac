"""Compiled Runge-Kutta tracer.

Rays go in blocks of BLOCK with one step for the block, chosen for its worst ray. With e the largest error of a ray in
units of the tolerance a step is accepted where e < 1, and the next one is

    h <- h (1/4e)^(1/16),  after a refused one  h <- h max(1/5, 0.9 e^(-1/8))

Half the usual exponent: which ray is the worst changes all the time, and a step that follows each of them is refused
again and again, and costs a third more at equal error than equal steps do; this one costs a tenth more at most.
An output ends a step, or two equal ones or more, where that costs little: a step is then from 0.6 to 1.1 of
what it may be, has three stages less, and errs less. Other outputs are read from the step's polynomial of order 7 and
put onto T1Q. Where A is carried all outputs end steps: A' has a kink where kappa_n passes 0, and errors of the
polynomial there are a hundred times those of the steps.

Rays that are traced each to a time of its own go side by side in a block, y' = h_i f(y), each with its own step h_i:
what stops one of them does not stop others.

Sources: [HNW93, sec. II.4 to II.6 and II.10]; Derivations, R3.
"""

import math

import numpy as np
from numba import njit

from creeping.geodesics.kernels.flow_derivative import derivative, project_block
from creeping.geodesics.tableaus import STAGE_WEIGHTS, STAGES
from creeping.kernels.block import BLOCK, aligned, options
from creeping.kernels.vectors import LANES, larger, load, magnitude, pointer, root, spread, stage_sum, stage_sums, store

sum_stages = stage_sums(STAGE_WEIGHTS)
_solution, _third, _fifth = (stage_sum(STAGE_WEIGHTS, row) for row in (12, 21, 22))


@njit(**options)
def solution(k, y, z, scale, rtol, h, errors):
    """State at the end of a step of the order-8 pair from y to z, and the error of each ray in units of the tolerance.

    By the pair of estimates of [HNW93, sec. II.10]; what they and the solution take of the stages is read once. The
    stages k, y, z and the errors (BLOCK,) are given by their addresses. Lanes of x and p are never larger than their
    ``scale``; the attenuation is passed over.
    """
    lanes, size = scale.shape[0], scale.shape[0] * BLOCK
    for i in range(0, BLOCK, LANES):
        third, fifth = spread(1e-300), spread(0.0)
        for lane in range(lanes):
            place = lane * BLOCK + i
            start = load(y, place)
            end = start + spread(h) * _solution(k, size, place)
            inverse = spread(1.0 / scale[lane])
            if lane >= 6:
                inverse = spread(1.0) / larger(spread(scale[lane]), larger(magnitude(start), magnitude(end)))
            d3, d5 = _third(k, size, place) * inverse, _fifth(k, size, place) * inverse
            store(z, place, end)
            third += d3 * d3
            fifth += d5 * d5
        factor = spread(abs(h) / (rtol * math.sqrt(lanes)))
        store(errors, i, factor * fifth / root(fifth + spread(0.01) * third))


@njit(**options)
def _worst(errors):
    """Largest of the errors (BLOCK,); NaN if one of them is."""
    worst, total = load(errors, 0), load(errors, 0)
    for i in range(LANES, BLOCK, LANES):
        worst = larger(worst, load(errors, i))
        total += load(errors, i)
    parts, found, check = np.empty(2 * LANES), 0.0, 0.0
    store(parts, 0, worst)
    store(parts, LANES, total)
    for i in range(LANES):
        found, check = max(found, parts[i]), check + parts[LANES + i]
    return found if check < math.inf else math.nan


@njit(**options)
def _finite(y, size):
    """Whether all numbers from an address on are finite."""
    total = spread(0.0)
    for i in range(0, size, LANES):
        total += magnitude(load(y, i))
    parts, whole = np.empty(LANES), 0.0
    store(parts, 0, total)
    for i in range(LANES):
        whole += parts[i]
    return whole < 1e300


@njit(**options)
def _copy(source, target, size):
    for i in range(0, size, LANES):
        store(target, i, load(source, i))


@njit(**options)
def _between(k, size, y, h, part, dense, z):
    """State y(part) of the step's polynomial, 0 < part < 1, to z; ``dense`` are `tableaus.dense_weights`."""
    weights = np.empty(STAGES)
    for j in range(STAGES):
        weight = 0.0
        for power in range(dense.shape[0]):
            weight = weight * part + dense[power, j]
        weights[j] = weight * part * h
    for i in range(0, size, LANES):
        total = load(y, i) + spread(weights[0]) * load(k, i)
        # the first stages have no weight
        for j in range(5, STAGES):
            total += spread(weights[j]) * load(k, j * size + i)
        store(z, i, total)


@njit(**options)
def _write(rows, out, start, m):
    """States of a block, rows (lanes, BLOCK), into out (n, m, lanes)."""
    for i in range(min(BLOCK, out.shape[0] - start)):
        for lane in range(out.shape[2]):
            out[start + i, m, lane] = rows[lane, i]


@njit(**options)
def _blank(out, start, first):
    out[start : start + BLOCK, first:] = math.nan


@njit(**options)
def integrate(
    level, level_par, speed, speed_par, weighted, states, times, method, dense, scale, rtol, step, limit, budget,
    reached, kept, out
):  # fmt: skip
    """Trace states (n, lanes) to the ascending times (m,) into out (n, m, lanes); returns whether all is done.

    ``method`` is a `tableaus.Method`. rtol > 0 adapts the step of each block to its worst ray, from ``step`` on;
    rtol = 0 uses the equal steps nearest below ``step`` between outputs.
    A block that needs more than ``limit`` steps between outputs, or leaves the finite numbers, is filled with NaN.

    After ``budget`` steps it returns, to be called again with the same arguments: ``reached`` (8,), zeros at first,
    keeps the ray and the output it has come to, the steps taken and wanted to the end of this stretch, what is left to
    it, the step that adapts, whether the derivative is known, and the steps of all blocks; ``kept`` (2, lanes BLOCK)
    the block's state and derivative.
    """
    n, lanes = states.shape
    first, stages = method
    size, last = lanes * BLOCK, times.shape[0] - 1
    dense_too = rtol > 0.0 and lanes <= 10
    # one array, of which addresses and views are handed on; see `flow_derivative`
    rows = aligned((STAGES + 3) * lanes + 21, BLOCK)
    here, there, geometry, weight = rows[:lanes], rows[lanes : 2 * lanes], rows[2 * lanes :], rows[2 * lanes + 10 :]
    points, values, gradients, hessians = there[:3], geometry[0], geometry[1:4], geometry[4:10]
    speeds, slopes, bends = weight[0], weight[1:4], weight[4:10]
    y = pointer(rows.reshape(-1), 0)
    z, g = pointer(y, size), pointer(y, 2 * size)
    w, errors = pointer(g, 10 * BLOCK), pointer(g, 20 * BLOCK)
    new = pointer(g, 21 * BLOCK)
    k = pointer(new, size)
    spent, again = 0, reached[3] > 0.0
    for start in range(int(reached[0]), n, BLOCK):
        m, used, equal, goal, left, h, known = 0, 0, 1, 0.0, 0.0, step, False
        if again:
            m, used, equal, left = int(reached[1]), int(reached[2]), int(reached[3]), reached[4]
            goal, h, known, again = times[m], reached[5], reached[6] > 0.0, False
            _copy(pointer(kept[0], 0), y, size)
            _copy(pointer(kept[1], 0), k, size)
        else:
            for i in range(BLOCK):
                for lane in range(lanes):
                    here[lane, i] = states[min(start + i, n - 1), lane]
        while True:
            if left == 0.0:
                while m <= last and times[m] <= goal:
                    _write(here, out, start, m)
                    m += 1
                if m > last:
                    break
                left, goal, used = times[m] - goal, times[m], 0
                equal = max(1, math.ceil(left / step - 1e-9)) if rtol == 0.0 else 1
            if spent >= budget:
                reached[0], reached[1], reached[2], reached[3] = start, m, used, equal
                reached[4], reached[5], reached[6] = left, h, 1.0 if known else 0.0
                reached[7] += spent
                _copy(y, pointer(kept[0], 0), size)
                _copy(k, pointer(kept[1], 0), size)
                return False
            spent += 1
            used += 1
            trial, ahead = left / (equal - used + 1), left
            if goal < times[last]:
                ahead += times[last] - goal
            if rtol > 0.0:
                # shares of the step that adapts: outputs end no shorter steps, and longer ones only to end there
                trial = left / math.ceil(left / (1.1 * h))
                if dense_too and trial < 0.6 * h:
                    trial = min(h, ahead)
            error, inside = 0.0, trial > left
            if not known:
                _copy(y, z, size)
            # one place for all stages: each takes time to compile
            for s in range(1 if known else 0, STAGES):
                if s == stages and rtol > 0.0:
                    solution(k, y, z, scale, rtol, trial, errors)
                    error = _worst(errors)
                    if not error < 1.0:
                        break
                elif s > 0:
                    sum_stages(first + s, trial, k, size, y, z)
                level(points, values, gradients, hessians, level_par)
                if weighted:
                    speed(points, speeds, slopes, bends, speed_par)
                derivative(weighted, lanes, z, g, w, pointer(k, s * size))
                if s == stages:
                    project_block(z, lanes, g, new)
                    if not inside:
                        break
            known = True
            if used > limit or (trial < 1e-12 * step and trial < left):
                _blank(out, start, m)
                break
            if not error < 1.0:
                h = trial * (max(0.2, 0.9 * error ** (-0.125)) if error < 1e300 else 0.2)
                continue
            if not _finite(new, size):
                _blank(out, start, m)
                break
            if inside:
                now = goal - left
                goal = times[last] if trial >= ahead else min(now + trial, times[last])
                while times[m] < goal:
                    _between(k, size, y, trial, (times[m] - now) / trial, dense, z)
                    level(points, values, gradients, hessians, level_par)
                    project_block(z, lanes, g, z)
                    _write(there, out, start, m)
                    m += 1
                left, goal, used = times[m] - goal, times[m], 0
            else:
                left -= trial
            _copy(new, y, size)
            _copy(pointer(k, stages * size), k, size)
            if rtol > 0.0:
                # the error goes like the eighth power of the step; far shorter ones do not tell it
                longer = math.sqrt(h * trial) * min(5.0, (0.25 / max(error, 1e-8)) ** 0.0625)
                h = max(h, longer) if trial < 0.5 * h else longer
    reached[7] += spent
    return True


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

    Arguments are as for `integrate`; rtol > 0, and ``limit`` is of each ray.
    """
    n, lanes = states.shape
    size = lanes * BLOCK
    # the order-8 pair has 12 stages
    rows = aligned(18 * lanes + 22, BLOCK)
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
                here[lane, i] = there[lane, i] = states[start + min(i, count - 1), lane]
            left[i] = times[start + i] if i < count else 0.0
            h[i], used[i] = step, 0
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
            for s in range(1 if known else 0, 13):
                if s == 12:
                    solution(k, y, z, scale, rtol, 1.0, pointer(steps, BLOCK))
                elif s > 0:
                    sum_stages(s, 1.0, k, size, y, z)
                level(points, values, gradients, hessians, level_par)
                if weighted:
                    speed(points, speeds, slopes, bends, speed_par)
                derivative(weighted, lanes, z, g, w, f1)
                _scaled(f1, size, steps, pointer(k, s * size))
                if s == 0:
                    # element by element: to assign one array to another takes seconds to compile
                    for lane in range(lanes):
                        for i in range(BLOCK):
                            slope[lane, i] = last[lane, i]
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
