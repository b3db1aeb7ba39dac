"""Compiled Runge-Kutta tracer; its twin in plain numpy is in tests/oracles.

Rays go in blocks of BLOCK, stored component by component, so that the loops over a block vectorise; a body enters as
the address of its block evaluator (see `creeping.geometry.surface.Compiled`), so the kernel compiles once for all
bodies. Components of a ray: x (3), p (3); where they are carried, the columns (M11, M21), (M12, M22) of its Jacobi
matrix M(t) = [[I_1, I_2], [I_1', I_2']] with I'' + G I = 0, M(0) = 1, det M = 1; and last the attenuation integral A,

    A' = c max(kappa_n, 0)^(2/3),  kappa_n = p.Hp/|grad F|.

Sources: [HNW93, sec. II.10]; Derivations, R3 and R13.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import BLOCK, aligned, options
from creeping.kernels.curvature import adjugate_form, second_form
from creeping.kernels.weighted_sum import combination

_sum_2, _sum_4, _sum_6, _sum_8, _sum_10 = (combination(n) for n in (2, 4, 6, 8, 10))


@njit(**options)
def add_stages(terms, weights, index, k, y, z):
    """Set z = y + sum over ``terms`` of weights[r] k[index[r]]; terms are even, each variant takes time to compile."""
    if terms == 2:
        _sum_2(weights, index, k, y, z)
    elif terms == 4:
        _sum_4(weights, index, k, y, z)
    elif terms == 6:
        _sum_6(weights, index, k, y, z)
    elif terms == 8:
        _sum_8(weights, index, k, y, z)
    else:
        _sum_10(weights, index, k, y, z)


@njit(**options)
def right_hand_side(level, level_par, speed, speed_par, weighted, y, k, geometry, weight):
    """Fill k with the derivative of y (components, BLOCK).

    ``geometry`` (10, BLOCK) keeps F, grad F and the Hessian of the block, ``weight`` those of the speed. Loops run over
    flat arrays with constant row offsets: only then does the compiler see that rows do not overlap, and vectorise.
    """
    level(y[:3], geometry[0], geometry[1:4], geometry[4:], level_par)
    yf, kf, g = y.reshape(-1), k.reshape(-1), geometry.reshape(-1)
    lanes = y.shape[0]
    for i in range(BLOCK):
        px, py, pz = yf[3 * BLOCK + i], yf[4 * BLOCK + i], yf[5 * BLOCK + i]
        gx, gy, gz = g[BLOCK + i], g[2 * BLOCK + i], g[3 * BLOCK + i]
        xx, yy, zz = g[4 * BLOCK + i], g[5 * BLOCK + i], g[6 * BLOCK + i]
        bent = second_form(px, py, pz, xx, yy, zz, g[7 * BLOCK + i], g[8 * BLOCK + i], g[9 * BLOCK + i])
        turn = -bent / (gx * gx + gy * gy + gz * gz)
        kf[i], kf[BLOCK + i], kf[2 * BLOCK + i] = px, py, pz
        kf[3 * BLOCK + i], kf[4 * BLOCK + i], kf[5 * BLOCK + i] = turn * gx, turn * gy, turn * gz
    if lanes > 6:
        _gaussian_curvature(g, kf)
    if lanes > 10:
        _attenuation_rate(g, kf)
    if weighted:
        _add_weight(speed, speed_par, y, k, geometry, weight)
    if lanes > 6:
        for i in range(BLOCK):
            curvature = kf[7 * BLOCK + i]
            kf[6 * BLOCK + i] = yf[7 * BLOCK + i]
            kf[7 * BLOCK + i] = -curvature * yf[6 * BLOCK + i]
            kf[8 * BLOCK + i] = yf[9 * BLOCK + i]
            kf[9 * BLOCK + i] = -curvature * yf[8 * BLOCK + i]


@njit(**options)
def _gaussian_curvature(g, kf):
    """Put K = (grad F.adj(H) grad F)/|grad F|^4 into row 7 of k, which is free until the Jacobi lanes are filled."""
    for i in range(BLOCK):
        gx, gy, gz = g[BLOCK + i], g[2 * BLOCK + i], g[3 * BLOCK + i]
        xx, yy, zz = g[4 * BLOCK + i], g[5 * BLOCK + i], g[6 * BLOCK + i]
        yz, xz, xy = g[7 * BLOCK + i], g[8 * BLOCK + i], g[9 * BLOCK + i]
        square = gx * gx + gy * gy + gz * gz
        kf[7 * BLOCK + i] = adjugate_form(gx, gy, gz, xx, yy, zz, yz, xz, xy) / (square * square)


@njit(**options)
def _attenuation_rate(g, kf):
    """Put max(kappa_n, 0)^(2/3) into row 10 of k; p' = -kappa_n n is in rows 3 to 5."""
    for i in range(BLOCK):
        gx, gy, gz = g[BLOCK + i], g[2 * BLOCK + i], g[3 * BLOCK + i]
        inward = -(kf[3 * BLOCK + i] * gx + kf[4 * BLOCK + i] * gy + kf[5 * BLOCK + i] * gz)
        kf[10 * BLOCK + i] = inward / math.sqrt(gx * gx + gy * gy + gz * gz)
    two_thirds(kf[10 * BLOCK : 11 * BLOCK], 1.0)


@njit(**options)
def two_thirds(values, factor):
    """Replace each value v (n,), n <= BLOCK, by factor max(v, 0)^(2/3), to rounding.

    v^(-1/3) by Newton steps y <- y (4 - v y^3)/3 from the exponent and mantissa divided by -3 as one integer; no call
    of pow, which does not vectorise.
    """
    bits = values.view(np.int64)
    guess = np.empty(BLOCK, np.int64)
    root = guess.view(np.float64)
    for i in range(values.shape[0]):
        # 0x553e... is (4/3) of the bits of 1.0, tuned for the smallest first error
        guess[i] = 6142571428571428864 - np.int64(bits[i] * 0.3333333333333333)
    for i in range(values.shape[0]):
        v = values[i] if values[i] > 1e-30 else 1.0
        y = root[i] if values[i] > 1e-30 else 1.0
        y *= (4.0 - v * y * y * y) * (1 / 3)
        y *= (4.0 - v * y * y * y) * (1 / 3)
        y *= (4.0 - v * y * y * y) * (1 / 3)
        y *= (4.0 - v * y * y * y) * (1 / 3)
        values[i] = factor * v * y if values[i] > 1e-30 else 0.0


@njit(**options)
def _add_weight(speed, speed_par, y, k, geometry, weight):
    """Turn the plain derivative into that of the weighted flow."""
    speed(y[:3], weight[0], weight[1:4], weight[4:], speed_par)
    grad, hess, c, dc, ddc = geometry[1:4], geometry[4:], weight[0], weight[1:4], weight[4:]
    lanes = y.shape[0]
    for i in range(BLOCK):
        px, py, pz = y[3, i], y[4, i], y[5, i]
        gx, gy, gz = grad[0, i], grad[1, i], grad[2, i]
        inverse = 1.0 / math.sqrt(gx * gx + gy * gy + gz * gz)
        nx, ny, nz = gx * inverse, gy * inverse, gz * inverse
        cx, cy, cz = dc[0, i], dc[1, i], dc[2, i]
        along_n = cx * nx + cy * ny + cz * nz
        along_p = cx * px + cy * py + cz * pz
        k[0, i], k[1, i], k[2, i] = c[i] * px, c[i] * py, c[i] * pz
        k[3, i] = c[i] * k[3, i] - cx + along_n * nx + along_p * px
        k[4, i] = c[i] * k[4, i] - cy + along_n * ny + along_p * py
        k[5, i] = c[i] * k[5, i] - cz + along_n * nz + along_p * pz
        if lanes > 6:
            h, s = hess[:, i], ddc[:, i]
            trace_h, trace_s = h[0] + h[1] + h[2], s[0] + s[1] + s[2]
            nhn = second_form(nx, ny, nz, h[0], h[1], h[2], h[3], h[4], h[5])
            nsn = second_form(nx, ny, nz, s[0], s[1], s[2], s[3], s[4], s[5])
            laplacian = trace_s - nsn - (trace_h - nhn) * inverse * along_n
            tangential = cx * cx + cy * cy + cz * cz - along_n * along_n
            k[7, i] = c[i] * c[i] * k[7, i] + c[i] * laplacian - tangential
        if lanes > 10:
            k[10, i] *= c[i]


@njit(**options)
def project_block(y, geometry):
    """One Newton step of x onto F = 0 and p onto the tangent plane, with F and grad F at x."""
    yf, g = y.reshape(-1), geometry.reshape(-1)
    for i in range(BLOCK):
        gx, gy, gz = g[BLOCK + i], g[2 * BLOCK + i], g[3 * BLOCK + i]
        inverse = 1.0 / (gx * gx + gy * gy + gz * gz)
        step = g[i] * inverse
        yf[i] -= step * gx
        yf[BLOCK + i] -= step * gy
        yf[2 * BLOCK + i] -= step * gz
        px, py, pz = yf[3 * BLOCK + i], yf[4 * BLOCK + i], yf[5 * BLOCK + i]
        lean = (px * gx + py * gy + pz * gz) * inverse
        px, py, pz = px - lean * gx, py - lean * gy, pz - lean * gz
        norm = 1.0 / math.sqrt(px * px + py * py + pz * pz)
        yf[3 * BLOCK + i], yf[4 * BLOCK + i], yf[5 * BLOCK + i] = px * norm, py * norm, pz * norm


@njit(**options)
def _error_norm(estimates, sums, y, z, scale, rtol, h):
    """Largest error over the block in units of the tolerance, by the pair of estimates of [HNW93, sec. II.10]."""
    lanes = y.shape[0]
    sums[:] = 0.0
    s, yf, zf, e = sums.reshape(-1), y.reshape(-1), z.reshape(-1), estimates.reshape(-1)
    fifth = lanes * BLOCK
    for lane in range(lanes):
        least, row = scale[lane], lane * BLOCK
        for i in range(BLOCK):
            inverse = 1.0 / (rtol * max(least, max(abs(yf[row + i]), abs(zf[row + i]))))
            d3, d5 = e[row + i] * inverse, e[fifth + row + i] * inverse
            s[i] += d3 * d3
            s[BLOCK + i] += d5 * d5
    worst = 0.0
    for i in range(BLOCK):
        if not s[BLOCK + i] == 0.0:
            norm = abs(h) * s[BLOCK + i] / math.sqrt((s[BLOCK + i] + 0.01 * s[i]) * lanes)
            # a NaN must not hide behind the comparison
            if not norm <= worst:
                worst = norm
    return worst


@njit(**options)
def _copy(source, target):
    one, other = source.reshape(-1), target.reshape(-1)
    for m in range(one.shape[0]):
        other[m] = one[m]


@njit(**options)
def _finite(y):
    total, values = 0.0, y.reshape(-1)
    for m in range(values.shape[0]):
        total += abs(values[m])
    return total < 1e300


@njit(**options)
def integrate(
    level, level_par, speed, speed_par, weighted, states, times, terms, index, weights, scale, rtol, step, limit,
    budget, reached, kept, out
):  # fmt: skip
    """Trace states (n, lanes) to the ascending times (m,) into out (n, m, lanes); returns whether all is done.

    Rows of the tableau are packed as ``terms`` (rows,), ``index`` and ``weights`` (rows, stages): one row a stage, the
    last of them the solution, then the two error estimates.
    rtol > 0 adapts the step of each block to its worst ray; rtol = 0 uses the equal steps nearest below ``step``.
    A block that needs more than ``limit`` steps between outputs, or leaves the finite numbers, is filled with NaN.

    After ``budget`` steps it returns, to be called again with the same arguments: ``reached`` (7,), zeros at first,
    keeps the ray and the output it has come to, the steps taken and wanted to that output, what is left to it, the step
    that adapts, and the steps of all blocks; ``kept`` (2, lanes, BLOCK) the block's state and derivative.
    """
    n, lanes = states.shape
    stages = terms.shape[0] - 3
    size = lanes * BLOCK
    k = aligned(stages + 1, size).reshape(stages + 1, lanes, BLOCK)
    y, z = aligned(lanes, BLOCK), aligned(lanes, BLOCK)
    estimates, zero = aligned(2, size).reshape(2, lanes, BLOCK), np.zeros((lanes, BLOCK))
    geometry, weight, sums = aligned(10, BLOCK), aligned(10, BLOCK), aligned(2, BLOCK)
    scaled = np.empty_like(weights)
    spent, again = 0, reached[3] > 0.0
    for start in range(int(reached[0]), n, BLOCK):
        count = min(BLOCK, n - start)
        now, h, good, first = 0.0, step, True, 0
        if again:
            _copy(kept[0], y)
            _copy(kept[1], k[0])
            h, first = reached[5], int(reached[1])
            now = times[first - 1] if first > 0 else 0.0
        else:
            for i in range(BLOCK):
                for lane in range(lanes):
                    y[lane, i] = states[start + min(i, count - 1), lane]
            right_hand_side(level, level_par, speed, speed_par, weighted, y, k[0], geometry, weight)
        for m in range(first, times.shape[0]):
            used = 0
            left = times[m] - now
            equal = max(1, math.ceil(left / step - 1e-9)) if rtol == 0.0 and left > 0.0 else 1
            if again:
                used, equal, left, again = int(reached[2]), int(reached[3]), reached[4], False
            while good and left > 0.0:
                if spent >= budget:
                    reached[0], reached[1], reached[2], reached[3], reached[4], reached[5] = (
                        start,
                        m,
                        used,
                        equal,
                        left,
                        h,
                    )
                    reached[6] += spent
                    _copy(y, kept[0])
                    _copy(k[0], kept[1])
                    return False
                spent += 1
                trial = left / (equal - used) if rtol == 0.0 else min(h, left)
                for row in range(stages + 1):
                    for r in range(terms[row]):
                        scaled[row, r] = trial * weights[row, r]
                for s in range(1, stages + 1):
                    add_stages(terms[s], scaled[s], index[s], k, y, z)
                    right_hand_side(level, level_par, speed, speed_par, weighted, z, k[s], geometry, weight)
                used += 1
                error = 0.0
                if rtol > 0.0:
                    for e in range(2):
                        row = stages + 1 + e
                        add_stages(terms[row], weights[row], index[row], k, zero, estimates[e])
                    error = _error_norm(estimates, sums, y, z, scale, rtol, trial)
                if used > limit or (trial < 1e-12 * step and trial < left):
                    good = False
                elif not error < 1.0 and rtol > 0.0:
                    h = trial * (max(0.2, 0.9 * error ** (-0.125)) if error < 1e300 else 0.2)
                elif not _finite(z):
                    good = False
                else:
                    project_block(z, geometry)
                    left = 0.0 if trial >= left else left - trial
                    _copy(z, y)
                    _copy(k[stages], k[0])
                    if rtol > 0.0:
                        grow = min(5.0, 0.9 * max(error, 1e-8) ** (-0.125))
                        # a step cut short by an output says nothing about the next one
                        h = max(h, trial * grow) if trial < h else trial * grow
            now = times[m]
            for i in range(count):
                for lane in range(lanes):
                    out[start + i, m, lane] = y[lane, i] if good else math.nan
    reached[6] += spent
    return True
