"""Compiled nodes of a shadow line: Newton steps onto it, equal arclength, and its length.

Sources: Derivations, R6 and R8.

    F = 0, G = grad F.d = 0;   W = grad F x Hd,   T = W/|W|,   dx = -[F (Hd x W) + G (W x grad F)]/|W|^2

dx is the Newton step of least norm. Between neighbours x_0, x_1 with chord c and tangents T the curve is a cubic; its
arclength comes from the chord and the mean of T over the step, for nodes equally spaced,

    h = |c|/|A|,   A = [802 (T_0 + T_1) - 93 (T_-1 + T_2) + 11 (T_-2 + T_3)]/1440,

of order 6, against that of order 4, A = [13 (T_0 + T_1) - (T_-1 + T_2)]/24: their difference is the estimate.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import BLOCK
from creeping.kernels.block import strict_options as options

FAILED = 1e300


@njit(**options)
def newton(level, level_par, d, x, reach, work, tangents, curvature):
    """Move x (3, n) by one Newton step, each at most ``reach``; returns the largest, FAILED where there is none.

    Fills T (3, n) and kappa_n(d) (n,) from where the points were. work (18, BLOCK) is work space.
    """
    n = x.shape[1]
    points, values, out = work[:3], work[3:13], work[13:18]
    worst = 0.0
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        for axis in range(3):
            points[axis, :count] = x[axis, start : start + count]
            # the last block is filled up with its last point
            points[axis, count:] = x[axis, start + count - 1]
        level(points, values[0], values[1:4], values[4:], level_par)
        worst = max(worst, _steps(points.reshape(-1), values.reshape(-1), out.reshape(-1), d, reach))
        for axis in range(3):
            x[axis, start : start + count] = points[axis, :count]
            tangents[axis, start : start + count] = out[axis, :count]
        curvature[start : start + count] = out[3, :count]
    return worst if worst < FAILED else FAILED


@njit(**options)
def _steps(x, g, out, d, reach):
    """Newton steps of one block, rows flat; out holds T and kappa_n(d). Constant offsets let the loop vectorise."""
    dx, dy, dz = d[0], d[1], d[2]
    worst = 0.0
    for i in range(BLOCK):
        F, gx, gy, gz = g[i], g[BLOCK + i], g[2 * BLOCK + i], g[3 * BLOCK + i]
        xx, yy, zz = g[4 * BLOCK + i], g[5 * BLOCK + i], g[6 * BLOCK + i]
        yz, xz, xy = g[7 * BLOCK + i], g[8 * BLOCK + i], g[9 * BLOCK + i]
        hx, hy, hz = xx * dx + xy * dy + xz * dz, xy * dx + yy * dy + yz * dz, xz * dx + yz * dy + zz * dz
        G = gx * dx + gy * dy + gz * dz
        wx, wy, wz = gy * hz - gz * hy, gz * hx - gx * hz, gx * hy - gy * hx
        # where W vanishes the step is too large for anything to hide it
        inverse = 1.0 / (wx * wx + wy * wy + wz * wz + 1e-290)
        sx = -(F * (hy * wz - hz * wy) + G * (wy * gz - wz * gy)) * inverse
        sy = -(F * (hz * wx - hx * wz) + G * (wz * gx - wx * gz)) * inverse
        sz = -(F * (hx * wy - hy * wx) + G * (wx * gy - wy * gx)) * inverse
        size = math.sqrt(sx * sx + sy * sy + sz * sz + 1e-290)
        part = min(1.0, reach / size)
        x[i] += part * sx
        x[BLOCK + i] += part * sy
        x[2 * BLOCK + i] += part * sz
        root = math.sqrt(inverse)
        out[i], out[BLOCK + i], out[2 * BLOCK + i] = wx * root, wy * root, wz * root
        bent = dx * hx + dy * hy + dz * hz
        out[3 * BLOCK + i] = bent / math.sqrt(gx * gx + gy * gy + gz * gz + 1e-290)
        out[4 * BLOCK + i] = size
    total = 0.0
    for i in range(4 * BLOCK, 5 * BLOCK):
        worst = max(worst, out[i])
        # the sum is not finite if one of them is not
        total += out[i]
    return worst if total < 1e100 else FAILED


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
        out[axis, m] = a * x[axis, i] + b * x[axis, j] + p * tangents[axis, i] + q * tangents[axis, j]


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
        counts[c] = max(64, 8 * np.int64(wanted * lengths[c] / whole / 8.0 + 0.5))


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
def _padded(rows, first, number, out):
    """Copy one component of rows (3, n) into out (3, number + 6), three nodes from the other end on either side."""
    for axis in range(3):
        out[axis, 3 : number + 3] = rows[axis, first : first + number]
        for k in range(3):
            out[axis, k] = rows[axis, first + number - 3 + k]
            out[axis, number + 3 + k] = rows[axis, first + k]


@njit(**options)
def spacings(x, tangents, first, number, h, places, slopes):
    """Arclengths h[first:] between neighbours of one component; returns its length and the estimate of its error.

    places, slopes (3, number + 6 or more) are left with its nodes and tangents, three more on either side.
    """
    _padded(x, first, number, places)
    _padded(tangents, first, number, slopes)
    length = doubt = least = 0.0
    for k in range(number):
        square = sixth = fourth = 0.0
        for axis in range(3):
            x_, t = places[axis], slopes[axis]
            c = x_[k + 4] - x_[k + 3]
            near, next_, far = t[k + 3] + t[k + 4], t[k + 2] + t[k + 5], t[k + 1] + t[k + 6]
            six = (802.0 / 1440.0) * near - (93.0 / 1440.0) * next_ + (11.0 / 1440.0) * far
            four = (13.0 / 24.0) * near - (1.0 / 24.0) * next_
            square += c * c
            sixth += six * six
            fourth += four * four
        # of unit length but for the turn of T
        h[first + k] = math.sqrt(square / (sixth + 1e-12))
        length += h[first + k]
        doubt += abs(h[first + k] - math.sqrt(square / (fourth + 1e-12)))
        least += 1.0 / (sixth + 1e-12) + 1.0 / (fourth + 1e-12)
    return (length, doubt) if least < 1e4 * number else (FAILED, FAILED)


@njit(**options)
def equalise(x, slopes, first, number, length, h):
    """Shift the nodes of one component along it to equal arclengths; ``slopes`` as `spacings` has left them."""
    step = length / number
    s = 0.0
    for k in range(number):
        move = k * step - s
        s += h[first + k]
        for axis in range(3):
            bend = (slopes[axis, k + 4] - slopes[axis, k + 2]) / (2.0 * step)
            x[axis, first + k] += move * (slopes[axis, k + 3] + 0.5 * move * bend)
