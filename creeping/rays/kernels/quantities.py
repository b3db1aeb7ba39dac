"""Compiled twin of `creeping.rays.quantities` at one point of each ray: what the wave needs to know there.

The ray is given at equal steps, GUARD of them before its launch point and beyond its end. On each step a polynomial of
degree 7 through eight steps, four on either side, stands for x, p, J, J' and the curvatures; its derivatives are
those along the ray, and powers of curvature are taken after interpolation.

Sources: Derivations, R1 and R5.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import strict_options as options
from creeping.rays.quantities import GAUSS, GUARD, SHARPEST

WIDTH = 2 * GUARD


def polynomial_matrix() -> np.ndarray:
    """Coefficients of powers of u of the polynomials through the places -3 ... 4: (powers, places)."""
    places = np.arange(WIDTH) - (GUARD - 1.0)
    return np.ascontiguousarray(np.linalg.inv(np.vander(places, WIDTH, increasing=True)))


@njit(**options)
def _weights(matrix, u, step, w):
    """Weights w (3, WIDTH) of value and two derivatives at u steps after the middle of the places."""
    for j in range(WIDTH):
        value = slope = bend = 0.0
        for m in range(WIDTH - 1, -1, -1):
            bend = bend * u + 2.0 * slope
            slope = slope * u + value
            value = value * u + matrix[m, j]
        w[0, j], w[1, j], w[2, j] = value, slope / step, bend / (step * step)


@njit(**options)
def _applied(w, row, values, k):
    """Product of a row of weights with eight values around step k."""
    total = 0.0
    for j in range(WIDTH):
        total += w[row, j] * values[k + j - GUARD + 1]
    return total


@njit(**options)
def _add(kappa, rate, bend, transverse, weight, total):
    """Add the five integrands, times a weight."""
    positive = max(kappa, 0.0)
    root = positive ** (1 / 3)
    square = root * root
    variation = 0.0
    if positive > 0.0:
        variation = -bend / positive**3 + 4 / 3 * rate * rate / positive**4
        variation = min(max(variation, -SHARPEST), SHARPEST)
    total[0] += weight * root
    total[1] += weight * square
    total[2] += weight * square * square
    total[3] += weight * root * transverse
    total[4] += weight * square * square * variation


@njit(**options)
def cross(level, level_par, matrix, states, step, observers, times):
    """Refine the times (n,) at which rays cross n.r = 0, within two steps; arguments as for `lanes_at`."""
    x, g, w, p = np.empty((3, 1)), np.empty((10, 1)), np.empty((3, WIDTH)), np.empty(3)
    for row in range(states.shape[0]):
        r, begin = observers[row], times[row]
        for _ in range(4):
            last = min(max(int(times[row] / step), 0), states.shape[1] - 2 * GUARD - 1)
            _weights(matrix, times[row] / step - last, step, w)
            for axis in range(3):
                x[axis, 0] = p[axis] = 0.0
                for j in range(WIDTH):
                    x[axis, 0] += w[0, j] * states[row, last + j + 1, axis]
                    p[axis] += w[0, j] * states[row, last + j + 1, 3 + axis]
            level(x, g[0], g[1:4], g[4:], level_par)
            rate = p[0] * (g[4, 0] * r[0] + g[9, 0] * r[1] + g[8, 0] * r[2])
            rate += p[1] * (g[9, 0] * r[0] + g[5, 0] * r[1] + g[7, 0] * r[2])
            rate += p[2] * (g[8, 0] * r[0] + g[7, 0] * r[1] + g[6, 0] * r[2])
            height = g[1, 0] * r[0] + g[2, 0] * r[1] + g[3, 0] * r[2]
            move = -height / rate if rate != 0.0 else 0.0
            times[row] += min(max(move, -step), step)
            times[row] = max(min(max(times[row], begin - 2 * step), begin + 2 * step), 0.0)


@njit(**options)
def lanes_at(level, level_par, matrix, nodes, gauss_weights, scale, states, step, times, whole, lanes, starts, alive):
    """Fill lanes (n, 18), starts (n, 9) but for d.x0 and the width, and alive (n,) at a time of each ray (n,).

    Without ``whole`` the angle φ, the integrals and alive are left out.

    Parameters
    ----------
    matrix, nodes, gauss_weights
        `polynomial_matrix`, and Gauss points and weights of the unit interval.
    scale : float, L
        Of the angle φ.
    states : (n, K, 8)
        x, p, J, J' at equal steps; the launch point is at number GUARD.
    """
    K = states.shape[1]
    x, g, w = np.empty((3, K)), np.empty((10, K)), np.empty((3, WIDTH))
    kappa, across, total = np.empty(K), np.empty(K), np.empty(5)
    for row in range(states.shape[0]):
        for k in range(K):
            for axis in range(3):
                x[axis, k] = states[row, k, axis]
        level(x, g[0], g[1:4], g[4:], level_par)
        for k in range(K):
            px, py, pz = states[row, k, 3], states[row, k, 4], states[row, k, 5]
            gx, gy, gz = g[1, k], g[2, k], g[3, k]
            inverse = 1.0 / math.sqrt(gx * gx + gy * gy + gz * gz)
            nx, ny, nz = gx * inverse, gy * inverse, gz * inverse
            bx, by, bz = ny * pz - nz * py, nz * px - nx * pz, nx * py - ny * px
            xx, yy, zz, yz, xz, xy = g[4, k], g[5, k], g[6, k], g[7, k], g[8, k], g[9, k]
            bent = px * px * xx + py * py * yy + pz * pz * zz
            kappa[k] = (bent + 2 * (py * pz * yz + px * pz * xz + px * py * xy)) * inverse
            bent = bx * bx * xx + by * by * yy + bz * bz * zz
            across[k] = (bent + 2 * (by * bz * yz + bx * bz * xz + bx * by * xy)) * inverse
            if k == GUARD:
                starts[row, 6], starts[row, 7], starts[row, 8] = nx, ny, nz
        _weights(matrix, 0.0, step, w)
        for d in range(3):
            starts[row, 2 + d] = _applied(w, d, kappa, GUARD)
        starts[row, 5] = across[GUARD]
        last = int(times[row] / step)
        last = min(max(last, 0), K - 2 * GUARD - 1)
        total[:] = 0.0
        good = kappa[GUARD] > 0.0
        for k in range(last + 1 if whole else 0):
            part = 1.0 if k < last else times[row] / step - last
            for q in range(GAUSS):
                _weights(matrix, part * nodes[q], step, w)
                i = k + GUARD
                curved = _applied(w, 0, kappa, i)
                good &= curved > 0.0
                _add(
                    curved,
                    _applied(w, 1, kappa, i),
                    _applied(w, 2, kappa, i),
                    _applied(w, 0, across, i),
                    gauss_weights[q] * part * step,
                    total,
                )
        i = last + GUARD
        _weights(matrix, times[row] / step - last, step, w)
        turned = 0.0
        before = 0.0
        for k in range(last + 2 if whole else 0):
            if k <= last:
                J, rate = states[row, k + GUARD, 6], states[row, k + GUARD, 7]
            else:
                J, rate = 0.0, 0.0
                for j in range(WIDTH):
                    J += w[0, j] * states[row, i + j - GUARD + 1, 6]
                    rate += w[0, j] * states[row, i + j - GUARD + 1, 7]
            angle = math.atan2(-scale * rate, J)
            change = angle - before
            turned += change - 2 * math.pi * math.floor((change + math.pi) / (2 * math.pi)) if k > 0 else angle
            before = angle
        for lane in range(8):
            lanes[row, lane] = 0.0
            for j in range(WIDTH):
                lanes[row, lane] += w[0, j] * states[row, i + j - GUARD + 1, lane]
        lanes[row, 8] = turned
        for d in range(3):
            lanes[row, 9 + d] = _applied(w, d, kappa, i)
        lanes[row, 12] = _applied(w, 0, across, i)
        for d in range(5):
            lanes[row, 13 + d] = total[d]
        alive[row] = good and lanes[row, 9] > 0.0
