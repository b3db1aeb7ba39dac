"""Compiled twins of `attenuation`: curvatures, and the attenuation integral over one leap or along a traced ray.

Sources: Derivations, R13.
"""

import math

import numpy as np
from numba import njit

from creeping.geodesics.kernels.flow_derivative import two_thirds
from creeping.kernels.block import BLOCK, aligned, entry_options, options
from creeping.kernels.exponential import second_form


@njit(**entry_options)
def curvatures(level, level_par, speed, speed_par, weighted, states, out):
    """c^(3/2) kappa_n of states (n, 6 or more), x and a vector of any length along the ray, into out (n,)."""
    n = states.shape[0]
    y, geometry = aligned(6, BLOCK), aligned(10, BLOCK)
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        for i in range(BLOCK):
            for k in range(6):
                y[k, i] = states[start + min(i, count - 1), k]
        _curvature(level, level_par, speed, speed_par, weighted, y, geometry)
        for i in range(count):
            out[start + i] = y[3, i]


@njit(**entry_options)
def curvatures_between(level, level_par, speed, speed_par, weighted, jets, first, weights, out):
    """c^(3/2) kappa_n at points of polynomials (`attenuation.Sliding`), into out[:, 1:-1] (intervals, points, n).

    jets (n, knots, 9) are x, x' and x'' at the knots, the knots of an interval four from its ``first`` on; weights
    (intervals, points, 2, 4, 3) those of x and x' at its points.
    """
    n, knots = jets.shape[0], jets.shape[1]
    y, geometry, own = aligned(6, BLOCK), aligned(10, BLOCK), aligned(knots, 9 * BLOCK)
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        for knot in range(knots):
            for lane in range(9):
                for i in range(BLOCK):
                    own[knot, lane * BLOCK + i] = jets[start + min(i, count - 1), knot, lane]
        for m in range(first.shape[0]):
            for q in range(weights.shape[1]):
                y[:] = 0.0
                for j in range(4):
                    _add(weights[m, q, 0, j], weights[m, q, 1, j], own[first[m] + j], y.reshape(-1))
                _curvature(level, level_par, speed, speed_par, weighted, y, geometry)
                for i in range(count):
                    out[m, q + 1, start + i] = y[3, i]


@njit(**options)
def _add(position, velocity, jet, y):
    """Add x and x' of a block from (x, x', x'') at a knot by their weights (3,), rows flat."""
    p0, p1, p2, v0, v1, v2 = position[0], position[1], position[2], velocity[0], velocity[1], velocity[2]
    for i in range(3 * BLOCK):
        a, b, c = jet[i], jet[3 * BLOCK + i], jet[6 * BLOCK + i]
        y[i] += p0 * a + p1 * b + p2 * c
        y[3 * BLOCK + i] += v0 * a + v1 * b + v2 * c


@njit(**options)
def _curvature(level, level_par, speed, speed_par, weighted, states, geometry):
    """c^(3/2) kappa_n of a block of states (6, BLOCK), into their fourth row; geometry (10, BLOCK) is work space."""
    level(states[:3], geometry[0], geometry[1:4], geometry[4:], level_par)
    y, g = states.reshape(-1), geometry.reshape(-1)
    for i in range(BLOCK):
        px, py, pz = y[3 * BLOCK + i], y[4 * BLOCK + i], y[5 * BLOCK + i]
        gx, gy, gz = g[BLOCK + i], g[2 * BLOCK + i], g[3 * BLOCK + i]
        xx, yy, zz, yz = g[4 * BLOCK + i], g[5 * BLOCK + i], g[6 * BLOCK + i], g[7 * BLOCK + i]
        bent = second_form(px, py, pz, xx, yy, zz, yz, g[8 * BLOCK + i], g[9 * BLOCK + i])
        steep = math.sqrt(gx * gx + gy * gy + gz * gz)
        y[3 * BLOCK + i] = bent / ((px * px + py * py + pz * pz) * steep)
    if weighted:
        speed(states[:3], geometry[0], geometry[1:4], geometry[4:], speed_par)
        for i in range(BLOCK):
            y[3 * BLOCK + i] *= g[i] * math.sqrt(g[i])


@njit(**options)
def extend(values, rules, time, now, a, sampled, count):
    """Carry A and the time of detachment, rows of a (2, BLOCK), over one leap; see `attenuation.extend`.

    values (BLOCK, 8), flat, are c^(3/2) kappa_n at the Chebyshev times; ``rules`` are the sampling and the searching
    matrix, Gauss points and weights, and the Chebyshev points. sampled (23, BLOCK) is work
    space: twelve Gauss points, both ends, the least of them, eight Chebyshev times.
    """
    sampling, searching, points, weights, nodes = rules
    gauss = points.shape[0]
    least, rows = sampled[gauss + 2], sampled[gauss + 3 : gauss + 11]
    # whole vectors of rays, and no more: a leap may need it of a few
    width = min(BLOCK, (count + 7) // 8 * 8)
    # by rows: reading every eighth number would be what takes the time
    for i in range(width):
        for k in range(8):
            rows[k, i] = values[8 * i + k]
    for i in range(width):
        least[i] = 1e300
    for g in range(gauss + 2):
        row = sampled[g]
        c = sampling[g]
        c0, c1, c2, c3, c4, c5, c6, c7 = c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]
        v = rows.reshape(-1)
        for i in range(width):
            total = c0 * v[i] + c1 * v[BLOCK + i] + c2 * v[2 * BLOCK + i] + c3 * v[3 * BLOCK + i]
            total += c4 * v[4 * BLOCK + i] + c5 * v[5 * BLOCK + i] + c6 * v[6 * BLOCK + i] + c7 * v[7 * BLOCK + i]
            row[i] = total
        for i in range(width):
            least[i] = min(least[i], row[i])
    for g in range(gauss):
        two_thirds(sampled[g, :width], weights[g] * time)
    for g in range(1, gauss):
        for i in range(width):
            sampled[0, i] += sampled[g, i]
    for i in range(count):
        if a[1, i] == math.inf:
            if least[i] > 0.0:
                a[0, i] += sampled[0, i]
            else:
                _detach(values[8 * i : 8 * i + 8], searching, points, weights, nodes, time, now, a, i)


@njit(**options)
def _detach(values, searching, points, weights, nodes, time, now, a, i):
    """The leap in which kappa_n reaches 0, or dips near an end."""
    steps = searching.shape[0] - 1
    root, c = math.inf, _divided(values, nodes)
    for k in range(steps + 1):
        total = 0.0
        for j in range(8):
            total += searching[k, j] * values[j]
        if total <= 0.0:
            root = _zero(c, nodes, (k - 1) / steps, k / steps) if k > 0 else 0.0
            break
    part = min(root, 1.0)
    total = 0.0
    for g in range(points.shape[0]):
        s = points[g]
        value = _polynomial(c, nodes, part * (1.0 - s * s * s))
        if value > 0.0:
            total += weights[g] * s * s * value ** (2 / 3)
    a[0, i] += 3.0 * part * time * total
    if root <= 1.0:
        a[1, i] = now + root * time


@njit(**options)
def _zero(c, nodes, low, high):
    """Zero of the polynomial between low, where it is positive, and high, where it is not, by the Illinois method."""
    a, b, side = _polynomial(c, nodes, low), _polynomial(c, nodes, high), 0
    for _ in range(60):
        if not (high - low > 1e-15 and a > 0.0 and b < 0.0):
            break
        middle = (low * b - high * a) / (b - a)
        value = _polynomial(c, nodes, middle)
        if value > 0.0:
            low, a = middle, value
            b *= 0.5 if side == 1 else 1.0
            side = 1
        else:
            high, b = middle, value
            a *= 0.5 if side == -1 else 1.0
            side = -1
    return high


@njit(**options)
def _divided(values, nodes):
    """Divided differences of values at the nodes: the coefficients of Newton's form."""
    c = np.empty(8)
    for j in range(8):
        c[j] = values[j]
    for width in range(1, 8):
        for j in range(7, width - 1, -1):
            c[j] = (c[j] - c[j - 1]) / (nodes[j] - nodes[j - width])
    return c


@njit(**options)
def _polynomial(c, nodes, t):
    """Newton's form with the divided differences c at t."""
    total = c[7]
    for j in range(6, -1, -1):
        total = total * (t - nodes[j]) + c[j]
    return total


@njit(**entry_options)
def extend_along(bent, times, rules, place, out):
    """Carry A and the time of detachment through all fine intervals, into the last two lanes of out (n, m, 12).

    bent (intervals, NODES, n) are c^(3/2) kappa_n at both ends of each interval and at the Gauss points between them;
    ``place`` (m,) are the numbers of the outputs among the fine times. out[:, 0] holds the values at the start.
    ``rules`` are those of `attenuation.fine_rules`, and DIP.
    """
    points, weights, nodes, searching, refined, refined_weights, dip = rules
    gauss, intervals = points.shape[0], bent.shape[0]
    a, work, along = aligned(2, BLOCK), aligned(4, BLOCK), np.empty(gauss + 2)
    power, grown, least, most = work[0], work[1], work[2], work[3]
    for start in range(0, out.shape[0], BLOCK):
        count = min(BLOCK, out.shape[0] - start)
        for i in range(BLOCK):
            ray = start + min(i, count - 1)
            a[0, i], a[1, i] = out[ray, 0, 10], out[ray, 0, 11]
        output = 0
        for m in range(intervals + 1):
            while output < place.shape[0] and place[output] == m:
                for i in range(count):
                    out[start + i, output, 10], out[start + i, output, 11] = a[0, i], a[1, i]
                output += 1
            if m == intervals or not _any_infinite(a[1]):
                continue
            time = times[m + 1] - times[m]
            for q in range(gauss + 2):
                for i in range(BLOCK):
                    value = bent[m, q, start + min(i, count - 1)]
                    power[i] = value
                    least[i] = min(least[i], value) if q > 0 else value
                    most[i] = max(most[i], value) if q > 0 else value
                    grown[i] = grown[i] if q > 0 else 0.0
                if 0 < q <= gauss:
                    two_thirds(power, weights[q - 1] * time)
                    for i in range(BLOCK):
                        grown[i] += power[i]
            for i in range(count):
                if a[1, i] == math.inf:
                    if least[i] > dip * most[i]:
                        a[0, i] += grown[i]
                        continue
                    for q in range(gauss + 2):
                        along[q] = bent[m, q, start + i]
                    if _reaches_zero(along, searching):
                        _detach(along, searching, points, weights, nodes, time, times[m], a, i)
                    else:
                        a[0, i] += time * _refined(along, refined, refined_weights)


@njit(**options)
def _reaches_zero(values, searching):
    """Whether one of the products with the rows of the searching matrix is not positive."""
    for k in range(searching.shape[0]):
        total = 0.0
        for j in range(8):
            total += searching[k, j] * values[j]
        if total <= 0.0:
            return True
    return False


@njit(**options)
def _refined(values, matrix, weights):
    """Integral of max(g, 0)^(2/3) over the unit interval, g = matrix values at the points of the weights."""
    total = 0.0
    for k in range(matrix.shape[0]):
        g = 0.0
        for j in range(8):
            g += matrix[k, j] * values[j]
        if g > 0.0:
            total += weights[k] * g ** (2 / 3)
    return total


@njit(**options)
def _any_infinite(values):
    """Whether one of the values is infinite."""
    for i in range(values.shape[0]):
        if values[i] == math.inf:
            return True
    return False
