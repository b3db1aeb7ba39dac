"""Compiled twins of `attenuation`: curvatures of a block, and the attenuation integral over one leap."""

import math

import numpy as np
from numba import njit

from creeping.phaseflow._integrator import BLOCK, aligned, options, two_thirds

SAMPLES = 23
"""Rows of work space of `extend`: twelve Gauss points, both ends, the least of them, eight Chebyshev times."""


@njit(**options)
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
            bent = px * px * geometry[4, i] + py * py * geometry[5, i] + pz * pz * geometry[6, i]
            bent += 2 * (py * pz * geometry[7, i] + px * pz * geometry[8, i] + px * py * geometry[9, i])
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
    # by rows: reading every eighth number would be what takes the time
    for i in range(BLOCK):
        for k in range(8):
            rows[k, i] = values[8 * i + k]
    for i in range(BLOCK):
        least[i] = 1e300
    for g in range(gauss + 2):
        row = sampled[g]
        c = sampling[g]
        c0, c1, c2, c3, c4, c5, c6, c7 = c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]
        v = rows.reshape(-1)
        for i in range(BLOCK):
            total = c0 * v[i] + c1 * v[BLOCK + i] + c2 * v[2 * BLOCK + i] + c3 * v[3 * BLOCK + i]
            total += c4 * v[4 * BLOCK + i] + c5 * v[5 * BLOCK + i] + c6 * v[6 * BLOCK + i] + c7 * v[7 * BLOCK + i]
            row[i] = total
        for i in range(BLOCK):
            least[i] = min(least[i], row[i])
    for g in range(gauss):
        two_thirds(sampled[g], weights[g] * time)
    for g in range(1, gauss):
        for i in range(BLOCK):
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
    root = math.inf
    for k in range(steps + 1):
        total = 0.0
        for j in range(8):
            total += searching[k, j] * values[j]
        if total <= 0.0:
            low, high = max(k - 1, 0) / steps, k / steps
            for _ in range(50 if k > 0 else 0):
                middle = 0.5 * (low + high)
                if _polynomial(values, nodes, middle) > 0.0:
                    low = middle
                else:
                    high = middle
            root = high
            break
    part = min(root, 1.0)
    total = 0.0
    for g in range(points.shape[0]):
        s = points[g]
        value = _polynomial(values, nodes, part * (1.0 - s * s * s))
        if value > 0.0:
            total += weights[g] * s * s * value ** (2 / 3)
    a[0, i] += 3.0 * part * time * total
    if root <= 1.0:
        a[1, i] = now + root * time


@njit(**options)
def _polynomial(values, nodes, t):
    """Polynomial through values at the nodes, by Neville's scheme."""
    work = np.empty(8)
    for j in range(8):
        work[j] = values[j]
    for width in range(1, 8):
        for j in range(8 - width):
            span = nodes[j] - nodes[j + width]
            work[j] = ((t - nodes[j + width]) * work[j] + (nodes[j] - t) * work[j + 1]) / span
    return work[0]


@njit(**options)
def extend_all(values, rules, time, now, total, end):
    """What `extend` does, for values (n, 8), integrals and times of detachment (n,)."""
    n = values.shape[0]
    a, sampled, block = aligned(2, BLOCK), aligned(SAMPLES, BLOCK), np.ones((BLOCK, 8))
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        for i in range(count):
            for k in range(8):
                block[i, k] = values[start + i, k]
            a[0, i], a[1, i] = total[start + i], end[start + i]
        extend(block.reshape(-1), rules, time, now, a, sampled, count)
        for i in range(count):
            total[start + i], end[start + i] = a[0, i], a[1, i]
