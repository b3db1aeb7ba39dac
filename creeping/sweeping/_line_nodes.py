"""Compiled nodes of a shadow line: Newton steps onto it, equal arclength, and its length.

    F = 0, G = grad F.d = 0;   W = grad F x Hd,   T = W/|W|,   dx = -[F (Hd x W) + G (W x grad F)]/|W|^2

dx is the Newton step of least norm. Between neighbours x_0, x_1 with chord c and tangents T the curve is a cubic; its
arclength comes from the chord and the mean of T over the step, for nodes equally spaced,

    h = |c|/|A|,   A = [802 (T_0 + T_1) - 93 (T_-1 + T_2) + 11 (T_-2 + T_3)]/1440,

of order 6, against that of order 4, A = [13 (T_0 + T_1) - (T_-1 + T_2)]/24: their difference is the estimate.
"""

import math

import numpy as np
from numba import njit

from creeping.phaseflow._integrator import options

FAILED = 1e300


@njit(**options)
def rows(work, number, n):
    """Make an array (number, n) of the start of flat work space."""
    return work[: number * n].reshape(number, n)


@njit(**options)
def newton(level, level_par, d, x, reach, work, tangents, curvature):
    """Move x (3, n) by one Newton step, each at most ``reach``; returns the largest, FAILED where there is none.

    Fills T (3, n) and kappa_n(d) (n,) from where the points were.
    """
    n = x.shape[1]
    g = work[: 10 * n]
    values = g.reshape(10, n)
    level(x, values[0], values[1:4], values[4:], level_par)
    dx, dy, dz = d[0], d[1], d[2]
    xf, tf = x.reshape(-1), tangents.reshape(-1)
    worst, bad = 0.0, 0
    for i in range(n):
        F, gx, gy, gz = g[i], g[n + i], g[2 * n + i], g[3 * n + i]
        xx, yy, zz, yz, xz, xy = g[4 * n + i], g[5 * n + i], g[6 * n + i], g[7 * n + i], g[8 * n + i], g[9 * n + i]
        hx, hy, hz = xx * dx + xy * dy + xz * dz, xy * dx + yy * dy + yz * dz, xz * dx + yz * dy + zz * dz
        G = gx * dx + gy * dy + gz * dz
        wx, wy, wz = gy * hz - gz * hy, gz * hx - gx * hz, gx * hy - gy * hx
        square = wx * wx + wy * wy + wz * wz
        inverse = 1.0 / square if square > 1e-280 else 0.0
        sx = -(F * (hy * wz - hz * wy) + G * (wy * gz - wz * gy)) * inverse
        sy = -(F * (hz * wx - hx * wz) + G * (wz * gx - wx * gz)) * inverse
        sz = -(F * (hx * wy - hy * wx) + G * (wx * gy - wy * gx)) * inverse
        size = math.sqrt(sx * sx + sy * sy + sz * sz)
        part = min(1.0, reach / max(size, 1e-300))
        xf[i] += part * sx
        xf[n + i] += part * sy
        xf[2 * n + i] += part * sz
        root = math.sqrt(inverse)
        tf[i], tf[n + i], tf[2 * n + i] = wx * root, wy * root, wz * root
        norm = math.sqrt(gx * gx + gy * gy + gz * gz)
        curvature[i] = (dx * hx + dy * hy + dz * hz) / norm if norm > 0.0 else 0.0
        worst = max(worst, size)
        # also what is not a number
        bad += not (square > 1e-280 and size < 1e100)
    return FAILED if bad else worst


@njit(**options)
def prune(x, tangents, starts, components, least, kept, kept_starts):
    """List in ``kept`` the nodes that are ``least`` apart and go forward; returns whether a chord leans too far."""
    total, leans = 0, False
    for c in range(components):
        begin, end = starts[c], starts[c + 1]
        kept_starts[c] = total
        kept[total] = begin
        total += 1
        for i in range(begin + 1, end):
            ahead, square = _ahead(x, tangents, kept[total - 1], i)
            if square > least * least and ahead > 0.0:
                kept[total] = i
                total += 1
        while total - kept_starts[c] > 4:
            ahead, square = _ahead(x, tangents, kept[total - 1], begin)
            if square > least * least and ahead > 0.0:
                break
            total -= 1
        first, count = kept_starts[c], total - kept_starts[c]
        for m in range(count):
            ahead, square = _ahead(x, tangents, kept[first + m], kept[first + (m + 1) % count])
            leans |= not ahead > 0.5 * math.sqrt(square)
    kept_starts[components] = total
    return leans


@njit(**options)
def _ahead(x, tangents, i, j):
    """Chord from node i to node j along the tangent of i, and its square."""
    ahead = square = 0.0
    for axis in range(3):
        c = x[axis, j] - x[axis, i]
        ahead += c * tangents[axis, i]
        square += c * c
    return ahead, square


@njit(**options)
def hermite(x, tangents, i, j, h, u, out, m):
    """Point at u in [0, 1] of the cubic from node i to node j, length about h, into out[:, m]."""
    v = 1.0 - u
    a, b = v * v * (1.0 + 2.0 * u), u * u * (3.0 - 2.0 * u)
    p, q = h * u * v * v, -h * u * u * v
    for axis in range(3):
        out[axis, m] = (
            a * x[axis, i] + b * x[axis, j] + p * tangents[axis, i] + q * tangents[axis, j]
        )


@njit(**options)
def _cubic_length(x, tangents, i, j):
    """Arclength of the cubic from node i to node j, to fourth order."""
    square = bend = 0.0
    for axis in range(3):
        c = x[axis, j] - x[axis, i]
        t = tangents[axis, j] - tangents[axis, i]
        square += c * c
        bend += t * t
    return math.sqrt(square) * (1.0 + bend / 24.0)


@njit(**options)
def share_nodes(x, tangents, kept, kept_starts, components, wanted, lengths, counts):
    """Lengths of the components, and numbers of nodes that share ``wanted``: multiples of 8, at least 64 each."""
    whole = 0.0
    for c in range(components):
        first, count = kept_starts[c], kept_starts[c + 1] - kept_starts[c]
        lengths[c] = 0.0
        for m in range(count):
            lengths[c] += _cubic_length(x, tangents, kept[first + m], kept[first + (m + 1) % count])
        whole += lengths[c]
    for c in range(components):
        counts[c] = max(64, 8 * int(round(wanted * lengths[c] / whole / 8.0)))


@njit(**options)
def resample(x, tangents, kept, first, count, length, out, place, number):
    """Put ``number`` nodes at equal arclengths of one component into out[:, place:]."""
    m, passed = 0, 0.0
    i, j = kept[first], kept[first + 1 % count]
    h = _cubic_length(x, tangents, i, j)
    for k in range(number):
        wanted = length * k / number
        while passed + h < wanted and m + 1 < count:
            passed += h
            m += 1
            i, j = kept[first + m], kept[first + (m + 1) % count]
            h = _cubic_length(x, tangents, i, j)
        hermite(x, tangents, i, j, h, min((wanted - passed) / h, 1.0), out, place + k)


@njit(**options)
def spacings(x, tangents, first, number, h):
    """Arclengths h[first:] between neighbours of one component; returns its length and the estimate of its error."""
    length = doubt = 0.0
    for k in range(number):
        a, b = first + k, first + (k + 1) % number
        a1, b1 = first + (k - 1) % number, first + (k + 2) % number
        a2, b2 = first + (k - 2) % number, first + (k + 3) % number
        square = sixth = fourth = 0.0
        for axis in range(3):
            c = x[axis, b] - x[axis, a]
            near = tangents[axis, a] + tangents[axis, b]
            next_ = tangents[axis, a1] + tangents[axis, b1]
            far = tangents[axis, a2] + tangents[axis, b2]
            six, four = (802.0 * near - 93.0 * next_ + 11.0 * far) / 1440.0, (13.0 * near - next_) / 24.0
            square += c * c
            sixth += six * six
            fourth += four * four
        if not (sixth > 1e-4 and fourth > 1e-4):
            return FAILED, FAILED
        chord = math.sqrt(square)
        h[a] = chord / math.sqrt(sixth)
        length += h[a]
        doubt += abs(h[a] - chord / math.sqrt(fourth))
    return length, doubt


@njit(**options)
def equalise(x, tangents, first, number, length, h, moved):
    """Shift the nodes of one component along it to equal arclengths; ``moved`` (number,) is work space."""
    step = length / number
    s = 0.0
    for k in range(number):
        moved[k] = k * step - s
        s += h[first + k]
    for k in range(number):
        move = moved[k]
        i, before, after = first + k, first + (k - 1) % number, first + (k + 1) % number
        for axis in range(3):
            bend = (tangents[axis, after] - tangents[axis, before]) / (2.0 * step)
            x[axis, i] += move * (tangents[axis, i] + 0.5 * move * bend)


def work_space(cap: int) -> np.ndarray:
    """Flat array that serves up to ``cap`` points."""
    return np.empty(16 * cap)
