"""Compiled nodes of a shadow line: Newton steps onto it, equal arclength, and its length.

Also here: compiled Newton steps of least norm of many points, each onto the shadow line of its own wave.

    F = 0,  G = grad F.q - w F = 0;   dx = -[F (Hq x W) + G (W x grad F)]/|W|^2,   W = grad F x Hq,   q = d + w x

A point stays where its next step would be rounding, whatever the others of its block do.

Sources: Derivations, R6, R8 and R19. q = d + w x; F = 0, G = grad F.q - w F = 0, whose gradient is Hq W = grad F x Hq,
T = W/|W|, dx = -[F (Hq x W) + G (W x grad F)]/|W|^2 dx is the Newton step of least norm. Between neighbours x_0, x_1
with chord c and tangents T the curve is a cubic; its arclength comes from the chord and the mean of T over the step,
for nodes equally spaced, h = |c|/|A|, A = sum_j a_j (T_-j + T_(1+j)), the integral of the polynomial through the
tangents of the nodes around; its order is the number of them. Twelve give the length, and how far eight are off is the
estimate of its error; [13 (T_0 + T_1) - (T_-1 + T_2)]/24 against six says whether the line is resolved; Derivations, R7
and R19.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import BLOCK, aligned, copy
from creeping.kernels.block import strict_options as options

FAILED = 1e300
HALF = 6
"""Nodes on either side that a polynomial along the line goes through."""
_TWELVE = np.array([548839986, -91373082, 27022635, -6409423, 995469, -73985]) / 958003200
_EIGHT = np.array([68323, -9531, 1879, -191]) / 120960
_INVERSE = np.array(
    [(-1.0) ** (2 * HALF - 1 - j) / (math.factorial(j) * math.factorial(2 * HALF - 1 - j)) for j in range(2 * HALF)]
)
"""Inverse products of the differences of the places 1 - HALF ... HALF."""

ROUNDING = float(np.finfo(float).eps)
ROWS = 22
"""Of work space: points, what is known of F there, waves, tangents, sizes of steps and the part taken of them."""


@njit(**options)
def newton(level, level_par, wave, x, reach, work, tangents, curvature):
    """Move x (3, n) by one Newton step, each at most ``reach``; returns the largest, FAILED where there is none.

    Fills T (3, n) and kappa_n(q) (n,) from where the points were. wave is (d, w), work (18, BLOCK) work space.
    """
    n = x.shape[1]
    points, values, out = work[:3], work[3:13], work[13:18]
    worst = 0.0
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        for axis in range(3):
            copy(x[axis, start : start + count], points[axis, :count])
            # the last block is filled up with its last point
            points[axis, count:] = x[axis, start + count - 1]
        level(points, values[0], values[1:4], values[4:], level_par)
        worst = max(worst, _steps(points.reshape(-1), values.reshape(-1), out.reshape(-1), wave, reach))
        for axis in range(3):
            copy(points[axis, :count], x[axis, start : start + count])
            copy(out[axis, :count], tangents[axis, start : start + count])
        copy(out[3, :count], curvature[start : start + count])
    return worst if worst < FAILED else FAILED


@njit(**options)
def _steps(x, g, out, wave, reach):
    """Newton steps of one block, rows flat; out holds T and kappa_n(q). Constant offsets let the loop vectorise."""
    dx, dy, dz, w = wave[0], wave[1], wave[2], wave[3]
    worst = 0.0
    for i in range(BLOCK):
        F, gx, gy, gz = g[i], g[BLOCK + i], g[2 * BLOCK + i], g[3 * BLOCK + i]
        xx, yy, zz = g[4 * BLOCK + i], g[5 * BLOCK + i], g[6 * BLOCK + i]
        yz, xz, xy = g[7 * BLOCK + i], g[8 * BLOCK + i], g[9 * BLOCK + i]
        qx, qy, qz = dx + w * x[i], dy + w * x[BLOCK + i], dz + w * x[2 * BLOCK + i]
        hx, hy, hz = xx * qx + xy * qy + xz * qz, xy * qx + yy * qy + yz * qz, xz * qx + yz * qy + zz * qz
        G = gx * qx + gy * qy + gz * qz - w * F
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
        bent = (qx * hx + qy * hy + qz * hz) / (qx * qx + qy * qy + qz * qz + 1e-290)
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
    """Copy one component of rows (3, n) into out (3, number + 2 HALF), HALF nodes from the other end on either side."""
    for axis in range(3):
        copy(rows[axis, first : first + number], out[axis, HALF : number + HALF])
        for k in range(HALF):
            out[axis, k] = rows[axis, first + number - HALF + k]
            out[axis, number + HALF + k] = rows[axis, first + k]


@njit(**options)
def spacings(x, tangents, first, number, h, places, slopes):
    """Arclengths h[first:] between neighbours of one component, by order 12.

    Returns its length, the sums of how far order 8 is off, and order 4 from order 6. places, slopes
    (3, number + 2 HALF or more) are left with its nodes and tangents, HALF more on either side.
    """
    _padded(x, first, number, places)
    _padded(tangents, first, number, slopes)
    length = error = rough = least = 0.0
    for k in range(number):
        i = k + HALF
        square = twelfth = eighth = sixth = fourth = 0.0
        for axis in range(3):
            t = slopes[axis]
            c = places[axis, i + 1] - places[axis, i]
            a, b, d = t[i] + t[i + 1], t[i - 1] + t[i + 2], t[i - 2] + t[i + 3]
            e, f, g = t[i - 3] + t[i + 4], t[i - 4] + t[i + 5], t[i - 5] + t[i + 6]
            twelve = _TWELVE[0] * a + _TWELVE[1] * b + _TWELVE[2] * d + _TWELVE[3] * e + _TWELVE[4] * f + _TWELVE[5] * g
            eight = _EIGHT[0] * a + _EIGHT[1] * b + _EIGHT[2] * d + _EIGHT[3] * e
            six = (802.0 / 1440.0) * a - (93.0 / 1440.0) * b + (11.0 / 1440.0) * d
            four = (13.0 / 24.0) * a - (1.0 / 24.0) * b
            square += c * c
            twelfth += twelve * twelve
            eighth += eight * eight
            sixth += six * six
            fourth += four * four
        # of unit length but for the turn of T
        h[first + k] = math.sqrt(square / max(twelfth, 1e-12))
        length += h[first + k]
        error += abs(h[first + k] - math.sqrt(square / max(eighth, 1e-12)))
        rough += abs(math.sqrt(square / max(sixth, 1e-12)) - math.sqrt(square / max(fourth, 1e-12)))
        least += 1.0 / max(twelfth, 1e-12) + 1.0 / max(fourth, 1e-12)
    return (length, error, rough) if least < 1e4 * number else (FAILED, FAILED, FAILED)


@njit(**options)
def equalise(x, slopes, first, number, length, h):
    """Shift the nodes of one component along it to equal arclengths; ``slopes`` as `spacings` has left them."""
    step = length / number
    s = 0.0
    for k in range(number):
        move = k * step - s
        s += h[first + k]
        for axis in range(3):
            bend = (slopes[axis, k + HALF + 1] - slopes[axis, k + HALF - 1]) / (2.0 * step)
            x[axis, first + k] += move * (slopes[axis, k + HALF] + 0.5 * move * bend)


@njit(**options)
def lagrange(u, w):
    """Weights w (2 HALF,) of the polynomial through the places 1 - HALF ... HALF at u in [0, 1]."""
    before = 1.0
    for j in range(2 * HALF):
        w[j] = before * _INVERSE[j]
        before *= u - (j + 1 - HALF)
    after = 1.0
    for j in range(2 * HALF - 1, -1, -1):
        w[j] *= after
        after *= u - (j + 1 - HALF)


@njit(**options)
def interpolate(rows, first, number, place, w, out, m):
    """Rows (r, n) of equally spaced nodes of a component at a place, by degree 2 HALF - 1, into out[:, m].

    w (2 HALF,) is work space.
    """
    k = np.int64(math.floor(place))
    lagrange(place - k, w)
    for row in range(out.shape[0]):
        total = 0.0
        for j in range(2 * HALF):
            total += w[j] * rows[row, first + (k + j + 1 - HALF) % number]
        out[row, m] = total


@njit(**options)
def move(level, level_par, waves, x, reach, steps, work, tangents, left):
    """Move x (n, 3) onto the lines of waves (n, 4), (d, w), by so many steps, each at most ``reach``.

    Fills the unit tangents (n, 3) W/|W| and the sizes (n,) of the next steps, where the points are in the end; neither
    is finite where there is no step. work (ROWS, BLOCK) is work space.
    """
    points, values, q, out = work[:3], work[3:13], work[13:17], work[17:22]
    for start in range(0, x.shape[0], BLOCK):
        count = min(BLOCK, x.shape[0] - start)
        for i in range(BLOCK):
            # the last block is filled up with its last point
            at = start + min(i, count - 1)
            for axis in range(3):
                points[axis, i] = x[at, axis]
            for part in range(4):
                q[part, i] = waves[at, part]
        for step in range(steps + 1):
            level(points, values[0], values[1:4], values[4:], level_par)
            if not _step(points.reshape(-1), values.reshape(-1), q.reshape(-1), out.reshape(-1), reach, step < steps):
                break
        for i in range(count):
            for axis in range(3):
                x[start + i, axis] = points[axis, i]
                tangents[start + i, axis] = out[axis, i]
            left[start + i] = out[3, i]


@njit(**options)
def _step(x, g, wave, out, reach, on):
    """One step of a block, rows flat, taken if ``on``; whether any point has moved. out holds T and the step's size."""
    for i in range(BLOCK):
        F, gx, gy, gz = g[i], g[BLOCK + i], g[2 * BLOCK + i], g[3 * BLOCK + i]
        xx, yy, zz = g[4 * BLOCK + i], g[5 * BLOCK + i], g[6 * BLOCK + i]
        yz, xz, xy = g[7 * BLOCK + i], g[8 * BLOCK + i], g[9 * BLOCK + i]
        w = wave[3 * BLOCK + i]
        qx, qy, qz = wave[i] + w * x[i], wave[BLOCK + i] + w * x[BLOCK + i], wave[2 * BLOCK + i] + w * x[2 * BLOCK + i]
        hx, hy, hz = xx * qx + xy * qy + xz * qz, xy * qx + yy * qy + yz * qz, xz * qx + yz * qy + zz * qz
        G = gx * qx + gy * qy + gz * qz - w * F
        wx, wy, wz = gy * hz - gz * hy, gz * hx - gx * hz, gx * hy - gy * hx
        inverse = 1.0 / (wx * wx + wy * wy + wz * wz)
        sx = -(F * (hy * wz - hz * wy) + G * (wy * gz - wz * gy)) * inverse
        sy = -(F * (hz * wx - hx * wz) + G * (wz * gx - wx * gz)) * inverse
        sz = -(F * (hx * wy - hy * wx) + G * (wx * gy - wy * gx)) * inverse
        size = math.sqrt(sx * sx + sy * sy + sz * sz)
        part = min(1.0, reach / size) if size > 0.0 else 1.0
        least = ROUNDING * max(abs(x[i]), abs(x[BLOCK + i]), abs(x[2 * BLOCK + i]))
        # a size that is no number is no small one
        part = part if on and not size <= least else 0.0
        x[i] += part * sx
        x[BLOCK + i] += part * sy
        x[2 * BLOCK + i] += part * sz
        root = math.sqrt(inverse)
        out[i], out[BLOCK + i], out[2 * BLOCK + i], out[3 * BLOCK + i] = wx * root, wy * root, wz * root, size
        out[4 * BLOCK + i] = part
    moved = False
    for i in range(4 * BLOCK, 5 * BLOCK):
        moved |= out[i] != 0.0
    return moved


@njit("float64[:, ::1]()", **options)
def work_space():
    """Work space of `move`."""
    return aligned(ROWS, BLOCK)
