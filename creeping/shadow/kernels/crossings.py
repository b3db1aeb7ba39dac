"""Compiled search for the places where the state of a shadow line may change: cusps and crossings.

Seen along q the line is a plane curve: of a point source by the stereographic projection of the sphere of directions,
which takes curves that cross to curves that cross and that of a plane wave for its limit. It has a cusp where
kappa_n(q) = 0, since T is along q there, and visibility changes only at cusps and, where two of its pieces cross, on
the one behind (the larger x.d, or R). Positions are node numbers with fractions, u, within a component of equally
spaced nodes.

Sources: [K84]; Derivations, R10.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import strict_options as options
from creeping.shadow.kernels.newton import HALF, interpolate

BOX = 8
"""Segments of a box."""
LIMIT = 64
"""Breaks of a line at most."""


@njit(**options)
def cusps(values, first, number, places):
    """Zeros of kappa_n(q) along a component into ``places``; returns their number and whether some may be hidden.

    Hidden are pairs of zeros between neighbours: an extremum nearer to 0 than half its second difference, or two
    changes in neighbouring cells.
    """
    count, hidden, last = 0, False, -2
    for k in range(number):
        a, b = values[first + k], values[first + (k + 1) % number]
        if (a > 0.0) != (b > 0.0):
            if count < places.shape[0]:
                places[count] = k + _zero(values, first, number, k, a, b)
                count += 1
            else:
                hidden = True
            hidden |= k == last + 1
            last = k
        else:
            before = values[first + (k - 1) % number]
            bend = before - 2.0 * a + b
            # an extremum on its own side of 0
            if (before - a) * (b - a) > 0.0 and (before > 0.0) == (a > 0.0):
                hidden |= abs(a) < 0.5 * abs(bend)
    return count, hidden


@njit(**options)
def _zero(values, first, number, k, a, b):
    """Zero in [0, 1] of the polynomial between node k and the next, values a and b, by the Illinois method."""
    low, high, side = 0.0, 1.0, 0
    rows, w, found = values.reshape(1, -1), np.empty(2 * HALF), np.empty((1, 1))
    for _ in range(40):
        u = (low * b - high * a) / (b - a)
        interpolate(rows, first, number, k + u, w, found, 0)
        value = found[0, 0]
        if high - low < 1e-13 or value == 0.0:
            return u
        if (value > 0.0) == (b > 0.0):
            high, b = u, value
            if side == 1:
                a *= 0.5
            side = 1
        else:
            low, a = u, value
            if side == -1:
                b *= 0.5
            side = -1
    return 0.5 * (low + high)


@njit(**options)
def plane_of(d, e, f):
    """Orthonormal e, f across d."""
    k = 0
    for axis in range(1, 3):
        if abs(d[axis]) < abs(d[k]):
            k = axis
    norm = math.sqrt(1.0 - d[k] * d[k])
    for axis in range(3):
        e[axis] = ((1.0 if axis == k else 0.0) - d[k] * d[axis]) / norm
    f[0], f[1], f[2] = d[1] * e[2] - d[2] * e[1], d[2] * e[0] - d[0] * e[2], d[0] * e[1] - d[1] * e[0]


@njit(**options)
def project(x, tangents, n, wave, box, plane):
    """Fill plane (5, cap): the line seen along q, its depth, and its slopes; returns the four extreme nodes.

    These are -1 where a point source stands among the body, so that no picture has all of it inside.
    """
    e, f, axis, apart = np.empty(3), np.empty(3), wave[:3].copy(), True
    if wave[3] != 0.0:
        apart = _axis_of(x, n, wave, box, axis)
    plane_of(axis, e, f)
    if wave[3] == 0.0:
        _flat(x, tangents, n, axis, e, f, plane)
    else:
        _stereographic(x, tangents, n, wave, axis, e, f, plane)
    left = right = low = high = 0
    for i in range(n):
        left = i if plane[0, i] < plane[0, left] else left
        right = i if plane[0, i] > plane[0, right] else right
        low = i if plane[1, i] < plane[1, low] else low
        high = i if plane[1, i] > plane[1, high] else high
    return (left, right, low, high) if apart else (-1, -1, -1, -1)


@njit(**options)
def _flat(x, tangents, n, d, e, f, plane):
    """Components of x across d and along it, and of T across."""
    for i in range(n):
        plane[0, i] = e[0] * x[0, i] + e[1] * x[1, i] + e[2] * x[2, i]
        plane[1, i] = f[0] * x[0, i] + f[1] * x[1, i] + f[2] * x[2, i]
        plane[2, i] = d[0] * x[0, i] + d[1] * x[1, i] + d[2] * x[2, i]
        plane[3, i] = e[0] * tangents[0, i] + e[1] * tangents[1, i] + e[2] * tangents[2, i]
        plane[4, i] = f[0] * tangents[0, i] + f[1] * tangents[1, i] + f[2] * tangents[2, i]


@njit(**options)
def _stereographic(x, tangents, n, wave, axis, e, f, plane):
    """u = e.y/(1 + a.y), v = f.y/(1 + a.y), with y = q/|q| and dy = w (T - (T.y) y)/|q|."""
    y, dy, w = np.empty(3), np.empty(3), wave[3]
    for i in range(n):
        square = along = 0.0
        for k in range(3):
            y[k] = wave[k] + w * x[k, i]
            square += y[k] * y[k]
        norm = math.sqrt(square)
        for k in range(3):
            y[k] /= norm
            along += y[k] * tangents[k, i]
        for k in range(3):
            dy[k] = w * (tangents[k, i] - along * y[k]) / norm
        share = 1.0 / (1.0 + axis[0] * y[0] + axis[1] * y[1] + axis[2] * y[2])
        change = axis[0] * dy[0] + axis[1] * dy[1] + axis[2] * dy[2]
        plane[0, i] = share * (e[0] * y[0] + e[1] * y[1] + e[2] * y[2])
        plane[1, i] = share * (f[0] * y[0] + f[1] * y[1] + f[2] * y[2])
        plane[2, i] = norm / w
        plane[3, i] = share * (e[0] * dy[0] + e[1] * dy[1] + e[2] * dy[2] - plane[0, i] * change)
        plane[4, i] = share * (f[0] * dy[0] + f[1] * dy[1] + f[2] * dy[2] - plane[1, i] * change)


@njit(**options)
def _axis_of(x, n, wave, box, axis):
    """Fill the axis (3,) of the picture of a point source; returns whether all of the body is on its side.

    It points to the middle of the body if all of its box is ahead; else, of that and the six along the coordinates, it
    is the one whose opposite, the point at infinity of the picture, is furthest from the line.
    """
    tried, best, most = np.zeros((7, 3)), 0, -1.0
    square = 0.0
    for k in range(3):
        tried[0, k] = wave[k] + wave[3] * 0.5 * (box[0, k] + box[1, k])
        square += tried[0, k] * tried[0, k]
        tried[1 + k, k], tried[4 + k, k] = 1.0, -1.0
    for k in range(3):
        tried[0, k] /= math.sqrt(square + 1e-290)
    ahead = square > 0.0
    for corner in range(8):
        dot = 0.0
        for k in range(3):
            dot += tried[0, k] * (wave[k] + wave[3] * box[(corner >> k) & 1, k])
        ahead &= dot > 0.0
    for c in range(0 if ahead or n == 0 else 7):
        nearest = 2.0
        for i in range(n):
            dot = norm = 0.0
            for k in range(3):
                y = wave[k] + wave[3] * x[k, i]
                dot += tried[c, k] * y
                norm += y * y
            nearest = min(nearest, 1.0 + dot / math.sqrt(norm))
        usable = c > 0 or square > 0.5e-6
        if usable and nearest > most:
            best, most = c, nearest
    for k in range(3):
        axis[k] = tried[best, k]
    return ahead


@njit(**options)
def convex(plane, starts, components):
    """Whether the line seen along q is one convex curve, which does not cross itself."""
    if components != 1:
        return False
    n, turns = starts[1], 0
    left = right = True
    for k in range(n - 1):
        turn = plane[3, k] * plane[4, k + 1] - plane[4, k] * plane[3, k + 1]
        left &= turn > 0.0
        right &= turn < 0.0
        turns += (plane[3, k] > 0.0) != (plane[3, k + 1] > 0.0)
    turns += (plane[3, n - 1] > 0.0) != (plane[3, 0] > 0.0)
    return (left or right) and turns == 2


@njit(**options)
def crossings(plane, starts, components, spacing, boxes, owner, places, where):
    """Places (component ``where``, u) of the pieces behind at crossings of the line seen along q; their number.

    boxes (6, cap / BOX) is work space for the bounds of BOX segments and the sum of their chords. -1 if there are too
    many.
    """
    total = 0
    for c in range(components):
        first, number = starts[c], starts[c + 1] - starts[c]
        for b in range(number // BOX):
            owner[total] = c
            _bound(plane, first, number, b, boxes, total)
            total += 1
    count = 0
    for p in range(total):
        for q in range(p, total):
            if boxes[0, p] > boxes[1, q] or boxes[0, q] > boxes[1, p]:
                continue
            if boxes[2, p] > boxes[3, q] or boxes[2, q] > boxes[3, p]:
                continue
            count = _between(plane, starts, spacing, owner, boxes, p, q, places, where, count)
            if count < 0:
                return -1
    return count


@njit(**options)
def _bound(plane, first, number, b, boxes, p):
    """Bounds of the segments of box b of a component, and the chord across them."""
    i = first + b * BOX
    end = first + (b * BOX + BOX) % number
    low0 = high0 = plane[0, end]
    low1 = high1 = plane[1, end]
    for k in range(i, i + BOX):
        low0, high0 = min(low0, plane[0, k]), max(high0, plane[0, k])
        low1, high1 = min(low1, plane[1, k]), max(high1, plane[1, k])
    boxes[0, p], boxes[1, p], boxes[2, p], boxes[3, p] = low0, high0, low1, high1
    boxes[4, p], boxes[5, p] = plane[0, end] - plane[0, i], plane[1, end] - plane[1, i]


@njit(**options)
def _between(plane, starts, spacing, owner, boxes, p, q, places, where, count):
    """Crossings of the segments of two boxes."""
    c1, c2 = owner[p], owner[q]
    f1, n1, f2, n2 = starts[c1], starts[c1 + 1] - starts[c1], starts[c2], starts[c2 + 1] - starts[c2]
    k1, k2 = p * BOX, q * BOX
    for c in range(c1):
        k1 -= starts[c + 1] - starts[c]
    for c in range(c2):
        k2 -= starts[c + 1] - starts[c]
    if c1 == c2:
        gap = (k2 - k1) % n1
        if (gap <= BOX or gap >= n1 - BOX) and _one_way(plane, f1, n1, k1, k2, boxes, p, q):
            return count
    for a in range(BOX):
        i, j = f1 + k1 + a, f1 + (k1 + a + 1) % n1
        for b in range(BOX):
            m, n = f2 + k2 + b, f2 + (k2 + b + 1) % n2
            if (p == q and b <= a + 1) or i == n or j == m:
                continue
            if not _cross(plane, i, j, m, n):
                continue
            one, two = _solve(plane, f1, n1, k1 + a, spacing[c1], f2, n2, k2 + b, spacing[c2])
            # the piece behind loses the light
            behind_first = plane[2, i] > plane[2, m]
            if count == places.shape[0]:
                return -1
            where[count] = c1 if behind_first else c2
            places[count] = one % n1 if behind_first else two % n2
            count += 1
    return count


@njit(**options)
def _one_way(plane, first, number, k1, k2, boxes, p, q):
    """Whether all segments of two boxes go to one side of a line: then they do not cross each other."""
    a, b = boxes[4, p] + boxes[4, q], boxes[5, p] + boxes[5, q]
    for k in (k1, k2):
        for s in range(BOX):
            i, j = first + k + s, first + (k + s + 1) % number
            if not a * (plane[0, j] - plane[0, i]) + b * (plane[1, j] - plane[1, i]) > 0.0:
                return False
    return True


@njit(**options)
def _side(plane, i, j, m):
    """Twice the area of nodes i, j, m."""
    return (plane[0, j] - plane[0, i]) * (plane[1, m] - plane[1, i]) - (plane[1, j] - plane[1, i]) * (
        plane[0, m] - plane[0, i]
    )


@njit(**options)
def _cross(plane, i, j, m, n):
    """Whether segment ij crosses segment mn."""
    return (_side(plane, i, j, m) > 0.0) != (_side(plane, i, j, n) > 0.0) and (_side(plane, m, n, i) > 0.0) != (
        _side(plane, m, n, j) > 0.0
    )


@njit(**options)
def _cubic(plane, row, i, j, h, u):
    """Component ``row`` across d, and its derivative, at u of the cubic from node i to node j, h apart."""
    v = 1.0 - u
    p, q = plane[row, i], plane[row, j]
    s, t = h * plane[3 + row, i], h * plane[3 + row, j]
    value = v * v * (1.0 + 2.0 * u) * p + u * u * (3.0 - 2.0 * u) * q + u * v * (v * s - u * t)
    slope = 6.0 * u * v * (q - p) + v * (v - 2.0 * u) * s + u * (u - 2.0 * v) * t
    return value, slope


@njit(**options)
def _solve(plane, first, number, k, h, first2, number2, m, g):
    """Places at which two pieces cross near those of the chords after nodes k and m; of the chords where that fails.

    Newton's method on the cubics between nodes, which do not leave their cell by much, and then on the polynomials.
    """
    i, j, p, q = first + k % number, first + (k + 1) % number, first2 + m % number2, first2 + (m + 1) % number2
    a, b = plane[0, j] - plane[0, i], plane[1, j] - plane[1, i]
    c, d = plane[0, q] - plane[0, p], plane[1, q] - plane[1, p]
    e, f = plane[0, p] - plane[0, i], plane[1, p] - plane[1, i]
    determinant = a * d - b * c
    one, two = k + (e * d - f * c) / determinant, m + (e * b - f * a) / determinant
    start, begin = one, two
    for _ in range(8):
        # the crossing of the cubics may lie in a cell next to that of the chords
        k, m = np.int64(math.floor(one)), np.int64(math.floor(two))
        i, j, p, q = first + k % number, first + (k + 1) % number, first2 + m % number2, first2 + (m + 1) % number2
        x, a = _cubic(plane, 0, i, j, h, one - k)
        y, b = _cubic(plane, 1, i, j, h, one - k)
        z, c = _cubic(plane, 0, p, q, g, two - m)
        w, d = _cubic(plane, 1, p, q, g, two - m)
        determinant = a * d - b * c
        e, f = z - x, w - y
        one += min(max((e * d - f * c) / determinant, -1.0), 1.0)
        two += min(max((e * b - f * a) / determinant, -1.0), 1.0)
    if not (abs(one - start) < 2.0 and abs(two - begin) < 2.0):
        return start, begin
    here, there, w = np.empty((5, 1)), np.empty((5, 1)), np.empty(2 * HALF)
    for _ in range(3):
        interpolate(plane, first, number, one, w, here, 0)
        interpolate(plane, first2, number2, two, w, there, 0)
        a, b, c, d = h * here[3, 0], h * here[4, 0], g * there[3, 0], g * there[4, 0]
        determinant = a * d - b * c
        e, f = there[0, 0] - here[0, 0], there[1, 0] - here[1, 0]
        one += min(max((e * d - f * c) / determinant, -1.0), 1.0)
        two += min(max((e * b - f * a) / determinant, -1.0), 1.0)
    return one, two
