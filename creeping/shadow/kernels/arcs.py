"""Compiled states of a shadow line: arcs between its breaks, whether the wave reaches them, and launch positions.

The state is constant between breaks, so one point decides an arc: kappa_n(q) <= 0 is concave; the outermost points of
the line seen along q are lit; for the rest F is sampled along the backward ray x - t q/|q|, which enters the body where
F is negative at a sample or at a minimum between samples. Two more rays of the arc must agree.

Sources: Derivations, R10.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import strict_options as options
from creeping.shadow.kernels.newton import HALF, interpolate, newton
from creeping.shadow.status import ATTACHED, CONCAVE, OCCLUDED

SAMPLES = 192
"""Samples of F from the point to where its backward ray leaves the box."""


@njit(**options)
def order_breaks(places, where, count, number):
    """Sort the breaks of a line by component and place, in place; a place may have come round."""
    for m in range(count):
        n = number[where[m]]
        if places[m] >= n:
            places[m] -= n
    for m in range(1, count):
        p, c = places[m], where[m]
        k = m - 1
        while k >= 0 and (where[k] > c or (where[k] == c and places[k] > p)):
            places[k + 1], where[k + 1] = places[k], where[k]
            k -= 1
        places[k + 1], where[k + 1] = p, c


@njit(**options)
def arcs_of(places, where, count, starts, components, arcs, owner):
    """List the arcs (start, end) in places, the end beyond the number of nodes where one comes round."""
    total, m = 0, 0
    for c in range(components):
        first = m
        while m < count and where[m] == c:
            m += 1
        number = starts[c + 1] - starts[c]
        if m == first:
            arcs[total, 0], arcs[total, 1], owner[total] = 0.0, float(number), c
            total += 1
        for k in range(first, m):
            arcs[total, 0] = places[k]
            arcs[total, 1] = places[k + 1] if k + 1 < m else places[first] + number
            owner[total] = c
            total += 1
    return total


@njit(**options)
def classify(level, level_par, box, wave, x, starts, extreme, arcs, owner, total, reach, work, state):
    """State of each arc; returns whether all rays agree.

    ``wave`` is (d, w), ``box`` (2, 3) holds the body, ``extreme`` are the outermost nodes, -1 for none.
    """
    agree = True
    probes, slopes, kappa, w = np.empty((3, 3)), np.empty((3, 3)), np.empty(3), np.empty(2 * HALF)
    d = np.empty(3)
    for k in range(total):
        c = owner[k]
        first, number = starts[c], starts[c + 1] - starts[c]
        long = arcs[k, 1] - arcs[k, 0]
        for m, share in enumerate((0.5, 0.2, 0.8)):
            interpolate(x, first, number, arcs[k, 0] + share * long, w, probes, m)
        newton(level, level_par, wave, probes, reach, work, slopes, kappa)
        if not kappa[0] > 0.0:
            state[k] = CONCAVE
            continue
        lit = False
        for node in extreme:
            place = float(node - first)
            inside = 0.0 <= place < number
            # an arc of next to no length at an outermost node may lie on either side of it
            lit |= inside and ((place - arcs[k, 0]) % number) < long
        if lit:
            state[k] = ATTACHED
            continue
        hidden = 0
        for m in range(3):
            behind = heading_at(wave, probes, m, d)
            hidden |= blocked(level, level_par, box, d, probes, m, behind) << m
        state[k] = OCCLUDED if hidden & 1 else ATTACHED
        agree &= hidden == 0 or hidden == 7
    return agree


@njit(**options)
def heading_at(wave, points, m, d):
    """Fill d (3,) with the unit vector along which the wave (d, w) travels at points[:, m].

    Returns how far behind it the samples of `blocked` may go, the last one at the source; inf of a plane wave.
    """
    square = 0.0
    for axis in range(3):
        d[axis] = wave[axis] + wave[3] * points[axis, m]
        square += d[axis] * d[axis]
    if wave[3] == 0.0:
        return math.inf
    norm = math.sqrt(square)
    for axis in range(3):
        d[axis] /= norm
    return norm / wave[3] * SAMPLES / (SAMPLES + 1)


@njit(**options)
def blocked(level, level_par, box, d, points, m, reach):
    """Whether the backward ray from points[:, m] enters the body within ``reach``."""
    exit_, diagonal = math.inf, 0.0
    for axis in range(3):
        diagonal += (box[1, axis] - box[0, axis]) ** 2
        if d[axis] != 0.0:
            exit_ = min(exit_, (points[axis, m] - box[0 if d[axis] > 0.0 else 1, axis]) / d[axis])
    # a point on the face of the box, or just beyond it by rounding, has nothing behind
    step = min(max(exit_, 0.5e-3 * math.sqrt(diagonal)), reach) / SAMPLES
    n = SAMPLES + 1
    x, values = np.empty((3, n)), np.empty((10, n))
    for i in range(n):
        for axis in range(3):
            x[axis, i] = points[axis, m] - (i + 1) * step * d[axis]
    level(x, values[0], values[1:4], values[4:], level_par)
    for i in range(n):
        if values[0, i] < 0.0:
            return True
    one, found = np.empty((3, 1)), np.empty((10, 1))
    for i in range(1, n - 1):
        if values[0, i] < values[0, i - 1] and values[0, i] <= values[0, i + 1]:
            t = start = (i + 1) * step
            for _ in range(6):
                for axis in range(3):
                    one[axis, 0] = points[axis, m] - t * d[axis]
                level(one, found[0], found[1:4], found[4:], level_par)
                slope = -(found[1, 0] * d[0] + found[2, 0] * d[1] + found[3, 0] * d[2])
                bend = d[0] * d[0] * found[4, 0] + d[1] * d[1] * found[5, 0] + d[2] * d[2] * found[6, 0]
                bend += 2.0 * (d[1] * d[2] * found[7, 0] + d[0] * d[2] * found[8, 0] + d[0] * d[1] * found[9, 0])
                move = -slope / bend if bend > 0.0 else -math.copysign(0.25 * step, slope)
                t = min(max(t + move, start - step), start + step)
            for axis in range(3):
                one[axis, 0] = points[axis, m] - t * d[axis]
            level(one, found[0], found[1:4], found[4:], level_par)
            if found[0, 0] < 0.0:
                return True
    return False


@njit(**options)
def blocked_rays(level, level_par, box, directions, points, reach, out):
    """`blocked` for the columns of points (3, n), with a direction (n, 3) and a reach (n,) each, into out (n,)."""
    for m in range(points.shape[1]):
        out[m] = blocked(level, level_par, box, directions[m], points, m, reach[m])


@njit(**options)
def merge(arcs, owner, state, total, starts):
    """Join neighbouring arcs of one state, in place; returns their number. A break may change nothing."""
    kept, k = 0, 0
    while k < total:
        c, begin = owner[k], kept
        number = starts[c + 1] - starts[c]
        while k < total and owner[k] == c:
            if kept > begin and state[kept - 1] == state[k]:
                arcs[kept - 1, 1] = arcs[k, 1]
            else:
                arcs[kept, 0], arcs[kept, 1], owner[kept], state[kept] = arcs[k, 0], arcs[k, 1], c, state[k]
                kept += 1
            k += 1
        if kept - begin > 1 and state[kept - 1] == state[begin]:
            arcs[begin, 0] = arcs[kept - 1, 0] - number
            kept -= 1
    return kept


@njit(**options)
def share_rays(arcs, owner, state, total, spacing, wanted, counts):
    """Rays of each arc: in proportion to the lengths of the attached ones, at least one each."""
    length, some = 0.0, 0
    for k in range(total):
        counts[k] = 0
        if state[k] == ATTACHED:
            length += (arcs[k, 1] - arcs[k, 0]) * spacing[owner[k]]
            some += 1
    if some == 0:
        return 0
    given = 0
    for k in range(total):
        if state[k] == ATTACHED:
            exact = (arcs[k, 1] - arcs[k, 0]) * spacing[owner[k]] / length * wanted
            counts[k] = max(1, int(exact))
            given += counts[k]
    while given != wanted:
        best, most = -1, -1e300
        for k in range(total):
            if state[k] == ATTACHED and (given < wanted or counts[k] > 1):
                exact = (arcs[k, 1] - arcs[k, 0]) * spacing[owner[k]] / length * wanted
                lack = exact - counts[k] if given < wanted else counts[k] - exact
                if lack > most:
                    best, most = k, lack
        if best < 0:
            # more arcs than rays
            break
        step = 1 if given < wanted else -1
        counts[best] += step
        given += step
    return min(given, wanted)
