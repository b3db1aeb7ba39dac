"""Compiled kernels: the explicit Runge-Kutta tracer and the composition of phase maps.

Rays go in blocks of BLOCK, stored component by component, so that the loops over a block vectorise; a body enters as
the address of its block evaluator (see `creeping.surface.Compiled`), so each kernel compiles once for all bodies.
State of a ray: x (3), p (3) and, when the ride-along is wanted, the columns (M11, M21), (M12, M22) of its
Jacobi matrix M(t) = [[I_1, I_2], [I_1', I_2']] with I'' + G I = 0, M(0) = 1, det M = 1.
The numpy twins are `tracing.trace_numpy` and `phase_map.PhaseMap.leap_numpy`.
"""

import math

import numpy as np
from numba import njit

from creeping.phaseflow._contraction import contraction

BLOCK = 64

_options = {"cache": True, "nogil": True, "error_model": "numpy", "fastmath": {"contract", "reassoc", "nsz", "arcp"}}


@njit(**_options)
def _right_hand_side(level, level_par, speed, speed_par, weighted, y, k, geometry, weight):
    """Fill k with the derivative of y (lanes, BLOCK).

    ``geometry`` (10, BLOCK) keeps F, grad F and the Hessian of the block, ``weight`` those of the speed. Loops run over
    flat arrays with constant row offsets: only then does the compiler see that rows do not overlap, and vectorise.
    """
    level(y[:3], geometry[0], geometry[1:4], geometry[4:], level_par)
    yf, kf, g = y.reshape(-1), k.reshape(-1), geometry.reshape(-1)
    for i in range(BLOCK):
        px, py, pz = yf[3 * BLOCK + i], yf[4 * BLOCK + i], yf[5 * BLOCK + i]
        gx, gy, gz = g[BLOCK + i], g[2 * BLOCK + i], g[3 * BLOCK + i]
        bent = px * px * g[4 * BLOCK + i] + py * py * g[5 * BLOCK + i] + pz * pz * g[6 * BLOCK + i]
        bent += 2 * (py * pz * g[7 * BLOCK + i] + px * pz * g[8 * BLOCK + i] + px * py * g[9 * BLOCK + i])
        turn = -bent / (gx * gx + gy * gy + gz * gz)
        kf[i], kf[BLOCK + i], kf[2 * BLOCK + i] = px, py, pz
        kf[3 * BLOCK + i], kf[4 * BLOCK + i], kf[5 * BLOCK + i] = turn * gx, turn * gy, turn * gz
    if y.shape[0] > 6:
        _gaussian_curvature(g, kf)
    if weighted:
        _add_weight(speed, speed_par, y, k, geometry, weight)
    if y.shape[0] > 6:
        for i in range(BLOCK):
            curvature = kf[7 * BLOCK + i]
            kf[6 * BLOCK + i] = yf[7 * BLOCK + i]
            kf[7 * BLOCK + i] = -curvature * yf[6 * BLOCK + i]
            kf[8 * BLOCK + i] = yf[9 * BLOCK + i]
            kf[9 * BLOCK + i] = -curvature * yf[8 * BLOCK + i]


@njit(**_options)
def _gaussian_curvature(g, kf):
    """Put K = (grad F.adj(H) grad F)/|grad F|^4 into row 7 of k, which is free until the Jacobi lanes are filled."""
    for i in range(BLOCK):
        gx, gy, gz = g[BLOCK + i], g[2 * BLOCK + i], g[3 * BLOCK + i]
        xx, yy, zz = g[4 * BLOCK + i], g[5 * BLOCK + i], g[6 * BLOCK + i]
        yz, xz, xy = g[7 * BLOCK + i], g[8 * BLOCK + i], g[9 * BLOCK + i]
        total = gx * gx * (yy * zz - yz * yz) + gy * gy * (xx * zz - xz * xz) + gz * gz * (xx * yy - xy * xy)
        total += 2 * gy * gz * (xy * xz - xx * yz)
        total += 2 * gx * gz * (xy * yz - yy * xz)
        total += 2 * gx * gy * (xz * yz - zz * xy)
        square = gx * gx + gy * gy + gz * gz
        kf[7 * BLOCK + i] = total / (square * square)


@njit(**_options)
def _add_weight(speed, speed_par, y, k, geometry, weight):
    """Turn the plain derivative into that of the weighted flow."""
    speed(y[:3], weight[0], weight[1:4], weight[4:], speed_par)
    grad, hess, c, dc, ddc = geometry[1:4], geometry[4:], weight[0], weight[1:4], weight[4:]
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
        if y.shape[0] > 6:
            h, s = hess[:, i], ddc[:, i]
            trace_h, trace_s = h[0] + h[1] + h[2], s[0] + s[1] + s[2]
            nhn = nx * nx * h[0] + ny * ny * h[1] + nz * nz * h[2]
            nhn += 2 * (ny * nz * h[3] + nx * nz * h[4] + nx * ny * h[5])
            nsn = nx * nx * s[0] + ny * ny * s[1] + nz * nz * s[2]
            nsn += 2 * (ny * nz * s[3] + nx * nz * s[4] + nx * ny * s[5])
            laplacian = trace_s - nsn - (trace_h - nhn) * inverse * along_n
            tangential = cx * cx + cy * cy + cz * cz - along_n * along_n
            k[7, i] = c[i] * c[i] * k[7, i] + c[i] * laplacian - tangential


@njit(**_options)
def _project_block(y, geometry):
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


@njit(**_options)
def _error_norm(k, e3, e5, y, z, scale, rtol, h):
    """Largest error over the block in units of the tolerance, by the pair of estimates of [HNW93, sec. II.10]."""
    lanes, stages = y.shape[0], e5.shape[0]
    worst = 0.0
    for i in range(BLOCK):
        sum3, sum5 = 0.0, 0.0
        for lane in range(lanes):
            tolerance = rtol * max(scale[lane], max(abs(y[lane, i]), abs(z[lane, i])))
            d3, d5 = 0.0, 0.0
            for s in range(stages):
                d3 += e3[s] * k[s, lane, i]
                d5 += e5[s] * k[s, lane, i]
            sum3 += (d3 / tolerance) ** 2
            sum5 += (d5 / tolerance) ** 2
        if sum5 > 0.0:
            norm = abs(h) * sum5 / math.sqrt((sum5 + 0.01 * sum3) * lanes)
            # a NaN must not hide behind the comparison
            if not norm <= worst:
                worst = norm
    return worst


@njit(**_options)
def _combine(h, weights, k, y, z):
    """Set z = y + h sum_r weights_r k_r, on flat arrays, two stages at a time."""
    z[:] = y
    stages = k.shape[0]
    for r in range(0, stages - 1, 2):
        first, second = h * weights[r], h * weights[r + 1]
        if first != 0.0 or second != 0.0:
            one, other = k[r], k[r + 1]
            for m in range(z.shape[0]):
                z[m] += first * one[m] + second * other[m]
    if stages % 2 == 1:
        last, one = h * weights[stages - 1], k[stages - 1]
        for m in range(z.shape[0]):
            z[m] += last * one[m]


@njit(**_options)
def _finite(y):
    total = 0.0
    for lane in range(y.shape[0]):
        for i in range(BLOCK):
            total += abs(y[lane, i])
    return total < 1e300


@njit(**_options)
def integrate(
    level, level_par, speed, speed_par, weighted, states, times, a, b, e3, e5, scale, rtol, step, max_steps, out
):
    """Trace states (n, lanes) to the ascending times (m,) into out (n, m, lanes); returns the rays that failed.

    rtol > 0 adapts the step of each block to its worst ray; rtol = 0 uses the equal steps nearest below ``step``.
    A block that needs more than ``max_steps`` steps between outputs, or leaves the finite numbers, is filled with NaN.
    """
    n, lanes = states.shape
    stages = b.shape[0]
    k = np.empty((stages + 1, lanes, BLOCK))
    y, z = np.empty((lanes, BLOCK)), np.empty((lanes, BLOCK))
    geometry, weight = np.empty((10, BLOCK)), np.empty((10, BLOCK))
    failed = 0
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        for i in range(BLOCK):
            for lane in range(lanes):
                y[lane, i] = states[start + min(i, count - 1), lane]
        _right_hand_side(level, level_par, speed, speed_par, weighted, y, k[0], geometry, weight)
        now, h, good = 0.0, step, True
        for m in range(times.shape[0]):
            used = 0
            left = times[m] - now
            equal = max(1, math.ceil(left / step - 1e-9)) if rtol == 0.0 and left > 0.0 else 1
            while good and left > 0.0:
                trial = left / (equal - used) if rtol == 0.0 else min(h, left)
                # stages
                for s in range(1, stages + 1):
                    _combine(trial, b if s == stages else a[s], k[:s].reshape(s, -1), y.reshape(-1), z.reshape(-1))
                    _right_hand_side(level, level_par, speed, speed_par, weighted, z, k[s], geometry, weight)
                used += 1
                error = 0.0 if rtol == 0.0 else _error_norm(k, e3, e5, y, z, scale, rtol, trial)
                if used > max_steps or trial < 1e-12 * step:
                    good = False
                elif not error < 1.0 and rtol > 0.0:
                    h = trial * (max(0.2, 0.9 * error ** (-0.125)) if error < 1e300 else 0.2)
                elif not _finite(z):
                    good = False
                else:
                    _project_block(z, geometry)
                    left = 0.0 if trial >= left else left - trial
                    for lane in range(lanes):
                        for i in range(BLOCK):
                            y[lane, i] = z[lane, i]
                            k[0, lane, i] = k[stages, lane, i]
                    if rtol > 0.0:
                        grow = min(5.0, 0.9 * max(error, 1e-8) ** (-0.125))
                        # a step cut short by an output says nothing about the next one
                        h = max(h, trial * grow) if trial < h else trial * grow
            now = times[m]
            for i in range(count):
                for lane in range(lanes):
                    out[start + i, m, lane] = y[lane, i] if good else math.nan
        if not good:
            failed += count
    return failed


@njit(**_options)
def spline_weights(t, degree, w):
    """Weights of the degree + 1 uniform B-splines that do not vanish at fraction t of a cell."""
    w[0] = 1.0
    for d in range(1, degree + 1):
        w[d] = t * w[d - 1] / d
        for j in range(d - 1, 0, -1):
            w[j] = ((t + d - j) * w[j - 1] + (j + 1 - t) * w[j]) / d
        w[0] = (1.0 - t) * w[0] / d


@njit(**_options)
def _cell(t, cells, degree, w):
    """Cell number of grid coordinate t, held inside the grid, and the weights there."""
    i = min(max(math.floor(t), 0), cells - 1)
    spline_weights(t - i, degree, w)
    return i


_state_3, _state_5 = contraction(3, 8), contraction(5, 8)
_jacobi_3, _jacobi_5 = contraction(3, 4), contraction(5, 4)


@njit(**_options)
def _stencil(table, jacobi, ride_along, degree, chart, iu, iv, ia, wu, wv, wa, out):
    """Interpolate the state lanes into out[:8] and, on the ride-along, the Jacobi lanes into out[8:12]."""
    row = table.shape[3]
    plane = row * table.shape[2]
    first = (chart * table.shape[1] + iu) * plane + iv * row + ia
    if degree == 3:
        _state_3(table, 8 * first, 8 * plane, 8 * row, wu, wv, wa, out)
    else:
        _state_5(table, 8 * first, 8 * plane, 8 * row, wu, wv, wa, out)
    if ride_along:
        if degree == 3:
            _jacobi_3(jacobi, 4 * first, 4 * plane, 4 * row, wu, wv, wa, out[8:])
        else:
            _jacobi_5(jacobi, 4 * first, 4 * plane, 4 * row, wu, wv, wa, out[8:])


@njit(**_options)
def leap(locate, locate_par, level, level_par, table, jacobi, degree, origin, cells, horizon, leaps, tolerance, states):
    """Compose the map ``leaps`` times on states (n, 6 or 10), in place.

    table (charts, nu, nv, na, 8) holds x' - x - T0 p and p' - p, jacobi (charts, nu, nv, na, 4) M - [[1, T0], [0, 1]];
    grid coordinates are origin + cells * (u, v, angle/2 pi). Afterwards x is brought back to |F| <= tolerance |grad F|.
    """
    n, lanes = states.shape
    y = np.empty((6, BLOCK))
    geometry = np.empty((10, BLOCK))
    chart, uv, frame = np.empty(BLOCK, np.int64), np.empty((2, BLOCK)), np.empty((6, BLOCK))
    wu, wv, wa, d = np.empty(8), np.empty(8), np.empty(8), np.empty(12)
    last_u = table.shape[1] - degree
    last_v = table.shape[2] - degree
    turns = cells[2] / (2 * math.pi)
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        for i in range(BLOCK):
            for lane in range(6):
                y[lane, i] = states[start + min(i, count - 1), lane]
        for _ in range(leaps):
            locate(y[:3], chart, uv, frame, locate_par)
            for i in range(count):
                px, py, pz = y[3, i], y[4, i], y[5, i]
                across = px * frame[3, i] + py * frame[4, i] + pz * frame[5, i]
                along = px * frame[0, i] + py * frame[1, i] + pz * frame[2, i]
                angle = math.atan2(across, along) * turns
                if angle < 0.0:
                    angle += cells[2]
                ia = _cell(angle, int(cells[2]), degree, wa)
                iu = _cell(origin[0] + cells[0] * uv[0, i], last_u, degree, wu)
                iv = _cell(origin[1] + cells[1] * uv[1, i], last_v, degree, wv)
                _stencil(table, jacobi, lanes > 6, degree, chart[i], iu, iv, ia, wu, wv, wa, d)
                y[0, i] += horizon * px + d[0]
                y[1, i] += horizon * py + d[1]
                y[2, i] += horizon * pz + d[2]
                y[3, i] += d[3]
                y[4, i] += d[4]
                y[5, i] += d[5]
                if lanes > 6:
                    state = states[start + i]
                    m11, m21, m12, m22 = 1.0 + d[8], d[9], horizon + d[10], 1.0 + d[11]
                    i1, j1, i2, j2 = state[6], state[7], state[8], state[9]
                    state[6], state[7] = m11 * i1 + m12 * j1, m21 * i1 + m22 * j1
                    state[8], state[9] = m11 * i2 + m12 * j2, m21 * i2 + m22 * j2
            for i in range(count, BLOCK):
                for lane in range(6):
                    y[lane, i] = y[lane, count - 1]
            for _newton in range(4):
                level(y[:3], geometry[0], geometry[1:4], geometry[4:], level_par)
                off = 0.0
                for i in range(BLOCK):
                    slope = math.sqrt(geometry[1, i] ** 2 + geometry[2, i] ** 2 + geometry[3, i] ** 2)
                    off = max(off, abs(geometry[0, i]) / slope)
                _project_block(y, geometry)
                if off <= tolerance:
                    break
        for i in range(count):
            for lane in range(6):
                states[start + i, lane] = y[lane, i]
