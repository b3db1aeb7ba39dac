"""Compiled twin of `creeping.rays.quantities` at one point of each ray: what the wave needs to know there.

The ray is given at equal steps, GUARD of them before its launch point and beyond its end. On each step a polynomial of
degree 9 through ten steps, five on either side, stands for x, p, J, J' and the curvatures; its derivatives are
those along the ray, and powers of curvature are taken after interpolation.

Sources: Derivations, R1 and R5.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import copy
from creeping.kernels.block import strict_options as options
from creeping.kernels.exponential import cube_root, second_form, turns
from creeping.rays.quantities import GAUSS, GUARD, SHARPEST, STRAIGHT

WIDTH = 2 * GUARD


def polynomial_matrix(half: int) -> np.ndarray:
    """Coefficients of powers of u of the Lagrange polynomials of the places 1 - half ... half: (powers, places)."""
    places = np.arange(1.0 - half, half + 1.0)
    columns = []
    for place in places:
        # products of whole numbers: exact, where an inverse of their powers loses seven digits
        others = places[places != place]
        columns.append(np.polynomial.polynomial.polyfromroots(others) / np.prod(place - others))
    return np.ascontiguousarray(np.stack(columns, axis=1))


@njit(**options)
def polynomial_weights(matrix, u, step, w):
    """Weights w (3, places) of value and two derivatives at u steps after the place 0 of `polynomial_matrix`."""
    for j in range(matrix.shape[0]):
        value = slope = bend = 0.0
        for m in range(matrix.shape[0] - 1, -1, -1):
            bend = bend * u + 2.0 * slope
            slope = slope * u + value
            value = value * u + matrix[m, j]
        w[0, j], w[1, j], w[2, j] = value, slope / step, bend / (step * step)


@njit(**options)
def _applied(w, row, values, k):
    """Product of a row of weights with the values around step k."""
    total = 0.0
    for j in range(WIDTH):
        total += w[row, j] * values[k + j - GUARD + 1]
    return total


@njit(**options)
def _integrands(kappa, rate, bend, transverse, weight, count, total):
    """Add the five integrands at count places, times a weight, to total (5, count or more)."""
    for k in range(count):
        positive = max(kappa[k], 0.0)
        root = cube_root(positive)
        square = root * root
        curved = positive if positive > 0.0 else 1.0
        inverse = 1.0 / curved
        inverse3 = inverse * inverse * inverse
        variation = -bend[k] * inverse3 + 4 / 3 * rate[k] * rate[k] * inverse3 * inverse
        variation = min(max(variation, -SHARPEST), SHARPEST) if positive > 0.0 else 0.0
        total[0, k] += weight * root
        total[1, k] += weight * square
        total[2, k] += weight * square * square
        total[3, k] += weight * root * transverse[k]
        total[4, k] += weight * square * square * variation


@njit(**options)
def _between(w, row, values, first, count, out):
    """Products of a row of weights with the values around each of count steps from the first: (count or more,)."""
    for k in range(count):
        out[k] = 0.0
    for j in range(WIDTH):
        weight, shift = w[row, j], first + j - GUARD + 1
        for k in range(count):
            out[k] += weight * values[k + shift]


@njit(**options)
def cross(level, level_par, matrix, states, step, owner, observers, times):
    """Refine the times (n,) at which rays cross n.r = 0, within two steps; arguments as for `quantities_at`."""
    x, g, w, p = np.empty((3, 1)), np.empty((10, 1)), np.empty((3, WIDTH)), np.empty(3)
    for row in range(owner.shape[0]):
        ray, r, begin = states[owner[row]], observers[row], times[row]
        for _ in range(4):
            last = min(max(int(times[row] / step), 0), states.shape[1] - 2 * GUARD - 1)
            polynomial_weights(matrix, times[row] / step - last, step, w)
            for axis in range(3):
                x[axis, 0] = p[axis] = 0.0
                for j in range(WIDTH):
                    x[axis, 0] += w[0, j] * ray[last + j + 1, axis]
                    p[axis] += w[0, j] * ray[last + j + 1, 3 + axis]
            level(x, g[0], g[1:4], g[4:], level_par)
            rate = p[0] * (g[4, 0] * r[0] + g[9, 0] * r[1] + g[8, 0] * r[2])
            rate += p[1] * (g[9, 0] * r[0] + g[5, 0] * r[1] + g[7, 0] * r[2])
            rate += p[2] * (g[8, 0] * r[0] + g[7, 0] * r[1] + g[6, 0] * r[2])
            height = g[1, 0] * r[0] + g[2, 0] * r[1] + g[3, 0] * r[2]
            move = -height / rate if rate != 0.0 else 0.0
            times[row] += min(max(move, -step), step)
            times[row] = max(min(max(times[row], begin - 2 * step), begin + 2 * step), 0.0)


@njit(**options)
def curvatures_along(level, level_par, states, x, g, kappa, across, torsion, normals):
    """Fill kappa_n, kappa_t and T = b.Hp/|grad F| (K,), and normals (3, K), at states (K, 6 or more) of a ray.

    x (3, K) and g (10, K) are work space.
    """
    for k in range(states.shape[0]):
        for axis in range(3):
            x[axis, k] = states[k, axis]
    level(x, g[0], g[1:4], g[4:], level_par)
    for k in range(states.shape[0]):
        px, py, pz = states[k, 3], states[k, 4], states[k, 5]
        gx, gy, gz = g[1, k], g[2, k], g[3, k]
        inverse = 1.0 / math.sqrt(gx * gx + gy * gy + gz * gz)
        nx, ny, nz = gx * inverse, gy * inverse, gz * inverse
        bx, by, bz = ny * pz - nz * py, nz * px - nx * pz, nx * py - ny * px
        xx, yy, zz, yz, xz, xy = g[4, k], g[5, k], g[6, k], g[7, k], g[8, k], g[9, k]
        kappa[k] = second_form(px, py, pz, xx, yy, zz, yz, xz, xy) * inverse
        across[k] = second_form(bx, by, bz, xx, yy, zz, yz, xz, xy) * inverse
        hx, hy, hz = xx * px + xy * py + xz * pz, xy * px + yy * py + yz * pz, xz * px + yz * py + zz * pz
        torsion[k] = (hx * bx + hy * by + hz * bz) * inverse
        normals[0, k], normals[1, k], normals[2, k] = nx, ny, nz


@njit(**options)
def _along(level, level_par, rule, scale, ray, step, known, kappa, across, normals, totals, angles, good, work, joints):
    """Fill what is known along one ray, states (K, 8), at its steps from the launch point to number ``known``.

    kappa, across (K,) and normals (3, K) at all states; totals (K, 5), angles (K,) and good (K,) are integrals, the
    angle phi and whether kappa_n has stayed positive, at the steps counted from the launch point. With ``joints`` it
    may be 0, as along the generators of a cylinder, and is looked at there alone: polynomials swing where it jumps.
    """
    K = ray.shape[0]
    weights, gauss_weights = rule
    g, at, parts = work
    principal = at[0]
    x = np.empty((3, K))
    curvatures_along(level, level_par, ray, x, g, kappa, across, at[0], normals)
    good[0] = kappa[GUARD] > 0.0
    angles[0] = math.atan2(-scale * ray[GUARD, 7], ray[GUARD, 6])
    for d in range(5):
        for k in range(known):
            parts[d, k] = 0.0
    for k in range(known):
        good[k + 1] = True
    for q in range(GAUSS):
        for d in range(3):
            _between(weights[q], d, kappa, GUARD, known, at[d])
        _between(weights[q], 0, across, GUARD, known, at[3])
        _integrands(at[0], at[1], at[2], at[3], gauss_weights[q] * step, known, parts)
        for k in range(known):
            good[k + 1] &= joints or at[0, k] > 0.0
    for d in range(5):
        totals[0, d] = 0.0
    for k in range(known):
        i = k + GUARD
        # where the creeping ray has ended, the integrals stay
        share = 1.0 if good[k] else 0.0
        for d in range(5):
            totals[k + 1, d] = totals[k, d] + share * parts[d, k]
        good[k + 1] &= good[k] and (not joints or kappa[i + 1] > -STRAIGHT / scale)
    # at has been used: its first row is free
    for k in range(known):
        principal[k] = 2 * math.pi * turns(-scale * ray[k + GUARD + 1, 7], ray[k + GUARD + 1, 6])
    for k in range(known):
        angles[k + 1] = _nearest(angles[k], principal[k])


@njit(**options)
def _nearest(before, angle):
    """Angle that differs from a given one by whole turns, next to the one before."""
    return angle + 2 * math.pi * math.floor((before - angle) / (2 * math.pi) + 0.5)


@njit(**options)
def quantities_at(
    level, level_par, matrix, nodes, gauss_weights, scale, states, step, owner, times, whole, joints, observers, lanes,
    starts, alive, risen
):  # fmt: skip
    """Fill lanes (n, 18), starts (n, 9) but for d.x0 and the width, and alive (n,) at points of rays.

    Without ``whole`` the angle phi, the integrals and alive are left out.

    Parameters
    ----------
    matrix, nodes, gauss_weights
        `polynomial_matrix`, and Gauss points and weights of the unit interval.
    scale : float, L
        Of the angle phi.
    states : (rays, K, 8)
        x, p, J, J' at equal steps; the launch point is at number GUARD.
    owner, times : (n,)
        Ray of each point, ascending, and its time.
    joints : bool
        Whether kappa_n may jump, and be 0 for a while.
    observers : (n or 0, 3)
        With observers, risen (n,) tells whether n.r > 0 somewhere before, two steps or more.
    """
    K = states.shape[1]
    g, w = np.empty((10, K)), np.empty((3, WIDTH))
    kappa, across, normals = np.empty(K), np.empty(K), np.empty((3, K))
    totals, angles, good = np.empty((K, 5)), np.empty(K), np.empty(K, np.bool_)
    weights = np.empty((GAUSS, 3, WIDTH))
    at, parts, one = np.empty((4, K)), np.empty((5, K)), np.empty((4, 1))
    for q in range(GAUSS):
        polynomial_weights(matrix, nodes[q], step, weights[q])
    row, n = 0, owner.shape[0]
    while row < n:
        ray = states[owner[row]]
        end, latest = row, 0.0
        while end < n and owner[end] == owner[row]:
            latest = max(latest, times[end])
            end += 1
        known = min(max(int(latest / step), 0), K - 2 * GUARD - 1) if whole else 0
        _along(
            level, level_par, (weights, gauss_weights), scale, ray, step, known, kappa, across, normals, totals,
            angles, good, (g, at, parts), joints,
        )  # fmt: skip
        polynomial_weights(matrix, 0.0, step, w)
        for d in range(3):
            starts[row, 2 + d] = _applied(w, d, kappa, GUARD)
        starts[row, 5] = across[GUARD]
        for axis in range(3):
            starts[row, 6 + axis] = normals[axis, GUARD]
        for point in range(row, end):
            copy(starts[row, 2:], starts[point, 2:])
            last = min(max(int(times[point] / step), 0), K - 2 * GUARD - 1)
            part = times[point] / step - last
            i = last + GUARD
            polynomial_weights(matrix, part, step, w)
            for lane in range(8):
                lanes[point, lane] = 0.0
                for j in range(WIDTH):
                    lanes[point, lane] += w[0, j] * ray[i + j - GUARD + 1, lane]
            for d in range(3):
                lanes[point, 9 + d] = _applied(w, d, kappa, i)
            lanes[point, 12] = _applied(w, 0, across, i)
            if not whole:
                continue
            lanes[point, 8] = _nearest(angles[last], math.atan2(-scale * lanes[point, 7], lanes[point, 6]))
            positive = good[last]
            for d in range(5):
                parts[d, 0] = totals[last, d]
            for q in range(GAUSS if part > 0.0 and positive else 0):
                polynomial_weights(matrix, part * nodes[q], step, w)
                for d in range(3):
                    one[d, 0] = _applied(w, d, kappa, i)
                one[3, 0] = _applied(w, 0, across, i)
                positive &= joints or one[0, 0] > 0.0
                _integrands(one[0], one[1], one[2], one[3], gauss_weights[q] * part * step, 1, parts)
            for d in range(5):
                lanes[point, 13 + d] = parts[d, 0]
            alive[point] = positive and lanes[point, 9] > (STRAIGHT / scale if joints else 0.0)
            if observers.shape[0]:
                risen[point] = False
                for k in range(GUARD, i - 1):
                    height = 0.0
                    for axis in range(3):
                        height += normals[axis, k] * observers[point, axis]
                    risen[point] |= height > 0.0
        row = end
