"""Compiled twins of `attenuation`: curvatures, and the attenuation integral over one leap or along a traced ray.

Sources: Derivations, R13.
"""

import math

import numpy as np
from numba import njit

from creeping.geodesics.hermite import NEAREST
from creeping.geodesics.kernels.flow_derivative import derivative, two_thirds
from creeping.kernels.block import BLOCK, aligned, entry_options, options
from creeping.kernels.exponential import second_form
from creeping.kernels.vectors import pointer

SAMPLES = 23
"""Rows of work space of `extend`: twelve Gauss points, both ends, the least of them, eight Chebyshev times."""


@njit(**entry_options)
def curvatures(level, level_par, speed, speed_par, weighted, states, out):
    """c^(3/2) kappa_n of states (n, 6 or more) into out (n,)."""
    n = states.shape[0]
    x, geometry = aligned(3, BLOCK), aligned(10, BLOCK)
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        for i in range(BLOCK):
            for k in range(3):
                x[k, i] = states[start + min(i, count - 1), k]
        level(x, geometry[0], geometry[1:4], geometry[4:], level_par)
        for i in range(count):
            px, py, pz = states[start + i, 3], states[start + i, 4], states[start + i, 5]
            xx, yy, zz, yz = geometry[4, i], geometry[5, i], geometry[6, i], geometry[7, i]
            bent = second_form(px, py, pz, xx, yy, zz, yz, geometry[8, i], geometry[9, i])
            out[start + i] = bent / math.sqrt(geometry[1, i] ** 2 + geometry[2, i] ** 2 + geometry[3, i] ** 2)
        if weighted:
            speed(x, geometry[0], geometry[1:4], geometry[4:], speed_par)
            for i in range(count):
                c = geometry[0, i]
                out[start + i] *= c * math.sqrt(c)


@njit(**options)
def extend(values, rules, time, now, a, sampled, count):
    """Carry A and the time of detachment, rows of a (2, BLOCK), over one leap; see `attenuation.extend`.

    values (BLOCK, 8), flat, are c^(3/2) kappa_n at the Chebyshev times; ``rules`` are the sampling and the searching
    matrix, Gauss points and weights, and the Chebyshev points. sampled (SAMPLES, BLOCK) is work space.
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
def extend_along(
    level, level_par, speed, speed_par, weighted, states, times, knots, first, position, velocity, rules, place, out
):
    """Carry A and the time of detachment through all fine intervals, into the last two lanes of out (n, m, 12).

    states (n, times, 6 or 10) are those at the fine times, ten lanes are copied to out; ``place`` (m,) are the numbers
    of the outputs among them. out[:, 0] holds the two lanes' values at the start. Twin of `attenuation.extend_along`;
    ``rules`` are those of `attenuation.fine_rules`, and DIP.
    """
    points, weights, nodes, searching, refined, refined_weights, dip = rules
    gauss, intervals = points.shape[0], first.shape[0]
    traced = 10 if states.shape[2] >= 10 else 0
    states_rows, slopes_rows, geometry, weight = (
        aligned(6, BLOCK),
        aligned(6, BLOCK),
        aligned(10, BLOCK),
        aligned(10, BLOCK),
    )
    y, k, g, w = states_rows.reshape(-1), slopes_rows.reshape(-1), geometry.reshape(-1), weight.reshape(-1)
    x, values, gradients, hessians = states_rows[:3], geometry[0], geometry[1:4], geometry[4:]
    speeds, slopes, bends = weight[0], weight[1:4], weight[4:]
    # of the jets only those in use are kept
    jets, bent = aligned(NEAREST * 9, BLOCK).reshape(NEAREST, 9, BLOCK), aligned(intervals + 1, BLOCK)
    a, sampled, work = aligned(2, BLOCK), aligned(gauss + 2, BLOCK), aligned(4, BLOCK)
    power, grown, least, most = work[0], work[1], work[2], work[3]
    for start in range(0, states.shape[0], BLOCK):
        count = min(BLOCK, states.shape[0] - start)
        for i in range(BLOCK):
            ray = start + min(i, count - 1)
            a[0, i], a[1, i] = out[ray, 0, 10], out[ray, 0, 11]
        known, seen, output = 0, 0, 0
        for m in range(intervals + 1):
            while output < place.shape[0] and place[output] == m:
                for i in range(count):
                    for lane in range(traced):
                        out[start + i, output, lane] = states[start + i, m, lane]
                    out[start + i, output, 10], out[start + i, output, 11] = a[0, i], a[1, i]
                output += 1
            if m == intervals or not _any_infinite(a[1]):
                continue
            while known <= knots[first[m] + NEAREST - 1]:
                for i in range(BLOCK):
                    for lane in range(6):
                        y[lane * BLOCK + i] = states[start + min(i, count - 1), known, lane]
                level(x, values, gradients, hessians, level_par)
                if weighted:
                    speed(x, speeds, slopes, bends, speed_par)
                derivative(weighted, 6, pointer(y, 0), pointer(g, 0), pointer(w, 0), pointer(k, 0))
                _curvature(y, g, w, weighted, bent[known])
                # what is no knot is overwritten by the next
                _jet(y, k, w, weighted, jets[seen % NEAREST])
                if known == knots[seen]:
                    seen += 1
                known += 1
            for i in range(BLOCK):
                sampled[0, i], sampled[gauss + 1, i] = bent[m, i], bent[m + 1, i]
                grown[i], least[i], most[i] = 0.0, min(bent[m, i], bent[m + 1, i]), max(bent[m, i], bent[m + 1, i])
            time = times[m + 1] - times[m]
            for q in range(gauss):
                _between(position[m, q], velocity[m, q], jets, first[m], y)
                level(x, values, gradients, hessians, level_par)
                if weighted:
                    speed(x, speeds, slopes, bends, speed_par)
                _curvature(y, g, w, weighted, sampled[q + 1])
                for i in range(BLOCK):
                    power[i] = sampled[q + 1, i]
                    least[i], most[i] = min(least[i], power[i]), max(most[i], power[i])
                two_thirds(power, weights[q] * time)
                for i in range(BLOCK):
                    grown[i] += power[i]
            for i in range(count):
                if a[1, i] == math.inf:
                    if least[i] > dip * most[i]:
                        a[0, i] += grown[i]
                        continue
                    along = sampled[:, i].copy()
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


@njit(**options)
def _curvature(yf, g, w, weighted, out):
    """c^(3/2) kappa_n along the directions of a block of states, of any length, into out (BLOCK,)."""
    for i in range(BLOCK):
        px, py, pz = yf[3 * BLOCK + i], yf[4 * BLOCK + i], yf[5 * BLOCK + i]
        gx, gy, gz = g[BLOCK + i], g[2 * BLOCK + i], g[3 * BLOCK + i]
        xx, yy, zz = g[4 * BLOCK + i], g[5 * BLOCK + i], g[6 * BLOCK + i]
        bent = second_form(px, py, pz, xx, yy, zz, g[7 * BLOCK + i], g[8 * BLOCK + i], g[9 * BLOCK + i])
        out[i] = bent / ((px * px + py * py + pz * pz) * math.sqrt(gx * gx + gy * gy + gz * gz))
    if weighted:
        for i in range(BLOCK):
            out[i] *= w[i] * math.sqrt(w[i])


@njit(**options)
def _jet(yf, kf, w, weighted, jet):
    """(x, x', x'') of the block into jet (9, BLOCK), from its derivative; see `attenuation.jets`."""
    jf = jet.reshape(-1)
    for i in range(3 * BLOCK):
        jf[i], jf[3 * BLOCK + i], jf[6 * BLOCK + i] = yf[i], kf[i], kf[3 * BLOCK + i]
    if weighted:
        for i in range(BLOCK):
            faster = w[BLOCK + i] * kf[i] + w[2 * BLOCK + i] * kf[BLOCK + i] + w[3 * BLOCK + i] * kf[2 * BLOCK + i]
            for lane in range(3):
                place = lane * BLOCK + i
                jf[6 * BLOCK + place] = w[i] * kf[3 * BLOCK + place] + faster * yf[3 * BLOCK + place]


@njit(**options)
def _between(position, velocity, jets, first, yf):
    """(x, x') into yf at the point to which the weights (3 NEAREST,) belong."""
    for pair in range(0, NEAREST, 2):
        one, two = jets[(first + pair) % NEAREST].reshape(-1), jets[(first + pair + 1) % NEAREST].reshape(-1)
        p, v = position[3 * pair :], velocity[3 * pair :]
        p0, p1, p2, p3, p4, p5 = p[0], p[1], p[2], p[3], p[4], p[5]
        v0, v1, v2, v3, v4, v5 = v[0], v[1], v[2], v[3], v[4], v[5]
        if pair == 0:
            yf[:] = 0.0
        for i in range(3 * BLOCK):
            a0, a1, a2 = one[i], one[3 * BLOCK + i], one[6 * BLOCK + i]
            b0, b1, b2 = two[i], two[3 * BLOCK + i], two[6 * BLOCK + i]
            yf[i] += p0 * a0 + p1 * a1 + p2 * a2 + p3 * b0 + p4 * b1 + p5 * b2
            yf[3 * BLOCK + i] += v0 * a0 + v1 * a1 + v2 * a2 + v3 * b0 + v4 * b1 + v5 * b2
