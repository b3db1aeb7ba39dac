"""Compiled sums over currents at nodes y of what comes to points x of the body from above their horizon.

    u(x) = sum_y r W(t) [a_y + b_y n_y.(x - y) (1/R - ik)/R] e^{ikR}/R,   t = n_x.(y - x)/R > 0,   R = |x - y|

    J(x) = 2 sum_y W(t) n_x x (g x J_y),   g = (y - x)/R (1/R - ik) e^{ikR}/R          of a conductor

W rises from 0 at the horizon to 1 at t = low; r is 2, what a mirror makes of a wave, or for du/dn of a soft one -2ikt.
Blocks of nodes, in balls, are left out where none is above the horizon: first for a block of points, then for each.

Also here: compiled sums over flat triangles of weights w times ∫ e^{ik q.x} dS, q one vector or another.

The phase is linear on a triangle: with u and v those of two corners relative to the third, φ0,

    ∫ e^{iφ} dS = 2A e^{iφ0} I,   I = (g(u) - g(v))/(i(u - v)),   g(x) = (e^{ix} - 1)/(ix) = e^{ix/2} sin(x/2)/(x/2)

φ0 is that of the corner opposite to the side whose phases differ most, so that only where all are alike,
|u - v| < 0.2, differences cancel: there, with h_j the sum of u^a v^b over a + b = j,

    I = Σ_j i^j h_j/(j + 2)!,   j < 8, the next is below 1e-12

Sources: Derivations, F29 and F13.
"""

import math

import numpy as np
from numba import njit

from creeping.field.kernels.near_pairs import TOUCHING
from creeping.kernels.block import entry_options, options
from creeping.kernels.exponential import cosine_sine


@njit(**entry_options)
def balls(points, normals, block, centres, radii, axes, spreads):
    """Fill centres (b, 3), radii (b,), mean normals (b, 3) and their spreads (b,) of blocks of points (3, n)."""
    n = points.shape[1]
    for b in range(len(radii)):
        first, last = b * block, min((b + 1) * block, n)
        for c in range(3):
            middle, axis = 0.0, 0.0
            for i in range(first, last):
                middle += points[c, i]
                axis += normals[c, i]
            centres[b, c], axes[b, c] = middle / (last - first), axis / (last - first)
        far, off = 0.0, 0.0
        for i in range(first, last):
            away, turn = 0.0, 0.0
            for c in range(3):
                away += (points[c, i] - centres[b, c]) ** 2
                turn += (normals[c, i] - axes[b, c]) ** 2
            far, off = max(far, away), max(off, turn)
        radii[b], spreads[b] = math.sqrt(far), math.sqrt(off)


@njit(**options)
def _above(b, of, nodes, some):
    """Number of blocks of nodes of which some may be above the horizon of block b of the points, and which they are."""
    centres, radii, axes, spreads = of
    others, widths = nodes[0], nodes[1]
    count = 0
    for a in range(len(widths)):
        dx, dy, dz = others[a, 0] - centres[b, 0], others[a, 1] - centres[b, 1], others[a, 2] - centres[b, 2]
        reach = math.sqrt(dx * dx + dy * dy + dz * dz) + radii[b] + widths[a]
        up = axes[b, 0] * dx + axes[b, 1] * dy + axes[b, 2] * dz
        if up + radii[b] + widths[a] + spreads[b] * reach > 0.0:
            some[count] = a
            count += 1
    return count


@njit(**options)
def _sunk(x, normals, j, nodes, a):
    """Whether the ball about block a of the nodes lies below the horizon of point j."""
    centres, radii = nodes[0], nodes[1]
    up = 0.0
    for c in range(3):
        up += normals[c, j] * (centres[a, c] - x[c, j])
    return up + radii[a] <= 0.0


@njit(**options)
def _risen(t, low):
    """Smooth step from the horizon."""
    w = min(t / low, 1.0)
    return w * w * (3.0 - 2.0 * w)


@njit(**entry_options)
def from_above(x, normals, of, y, sides, nodes, block, single, double, k, low, soft, first, last, out):
    """Fill rows of blocks first..last of out (m, 2), real and imaginary part of u, or of du/dn if ``soft``.

    Points x and their normals (3, m), nodes y and theirs ``sides`` (3, n), in blocks of so many with the `balls` ``of``
    and ``nodes``; single and double (2, n) the weights a and b, real before imaginary parts.
    """
    n = y.shape[1]
    per, least = k / (2 * math.pi), (TOUCHING / k) ** 2
    some = np.empty(len(nodes[1]), np.int64)
    for b in range(first, last):
        count = _above(b, of, nodes, some)
        for j in range(b * block, min((b + 1) * block, x.shape[1])):
            x0, x1, x2 = x[0, j], x[1, j], x[2, j]
            n0, n1, n2 = normals[0, j], normals[1, j], normals[2, j]
            p, q = 0.0, 0.0
            for a in range(count):
                if _sunk(x, normals, j, nodes, some[a]):
                    continue
                for i in range(some[a] * block, min((some[a] + 1) * block, n)):
                    dx, dy, dz = y[0, i] - x0, y[1, i] - x1, y[2, i] - x2
                    inverse = 1.0 / math.sqrt(max(dx * dx + dy * dy + dz * dz, least))
                    t = max((n0 * dx + n1 * dy + n2 * dz) * inverse, 0.0)
                    w = _risen(t, low) * inverse
                    c, s = cosine_sine(per / inverse)
                    lean = -(sides[0, i] * dx + sides[1, i] * dy + sides[2, i] * dz) * inverse
                    u = single[0, i] + lean * (double[0, i] * inverse + double[1, i] * k)
                    v = single[1, i] + lean * (double[1, i] * inverse - double[0, i] * k)
                    f, g = w * (u * c - v * s), w * (u * s + v * c)
                    if soft:
                        p += 2.0 * k * t * g
                        q -= 2.0 * k * t * f
                    else:
                        p += 2.0 * f
                        q += 2.0 * g
            out[j, 0], out[j, 1] = p, q


@njit(**options)
def _gradients(at, up, y, first, last, k, low, out):
    """Fill out (5, ...) with W g of nodes first..last: the direction from a point to each, then the complex factor."""
    per, least = k / (2 * math.pi), (TOUCHING / k) ** 2
    for i in range(first, last):
        dx, dy, dz = y[0, i] - at[0], y[1, i] - at[1], y[2, i] - at[2]
        inverse = 1.0 / math.sqrt(max(dx * dx + dy * dy + dz * dz, least))
        dx, dy, dz = dx * inverse, dy * inverse, dz * inverse
        w = _risen(max(up[0] * dx + up[1] * dy + up[2] * dz, 0.0), low) * inverse
        c, s = cosine_sine(per / inverse)
        j = i - first
        out[0, j], out[1, j], out[2, j] = dx, dy, dz
        out[3, j], out[4, j] = w * (c * inverse + s * k), w * (s * inverse - c * k)


@njit(**options)
def crossed_sum(g, J, first, last):
    """Sum of g x J over nodes first..last, real and imaginary parts of its components."""
    a0, a1, a2, b0, b1, b2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(first, last):
        j = i - first
        dx, dy, dz, c, s = g[0, j], g[1, j], g[2, j], g[3, j], g[4, j]
        u0, u1, u2 = dy * J[2, i] - dz * J[1, i], dz * J[0, i] - dx * J[2, i], dx * J[1, i] - dy * J[0, i]
        v0, v1, v2 = dy * J[5, i] - dz * J[4, i], dz * J[3, i] - dx * J[5, i], dx * J[4, i] - dy * J[3, i]
        a0 += c * u0 - s * v0
        a1 += c * u1 - s * v1
        a2 += c * u2 - s * v2
        b0 += c * v0 + s * u0
        b1 += c * v1 + s * u1
        b2 += c * v2 + s * u2
    return a0, a1, a2, b0, b1, b2


@njit(**entry_options)
def vectors_from_above(x, normals, of, y, nodes, block, currents, k, low, first, last, out):
    """Fill rows of blocks first..last of out (m, p, 6), real and imaginary part of J of p incident waves.

    ``currents`` (p, 6, n) are J dS/4 pi at the nodes, real parts of its components first; the others are as
    of `from_above`.
    """
    n, waves = y.shape[1], currents.shape[0]
    some, g, total = np.empty(len(nodes[1]), np.int64), np.empty((5, block)), np.empty((waves, 6))
    for b in range(first, last):
        count = _above(b, of, nodes, some)
        for j in range(b * block, min((b + 1) * block, x.shape[1])):
            at = x[0, j], x[1, j], x[2, j]
            n0, n1, n2 = normals[0, j], normals[1, j], normals[2, j]
            total[:] = 0.0
            for a in range(count):
                if _sunk(x, normals, j, nodes, some[a]):
                    continue
                start, end = some[a] * block, min((some[a] + 1) * block, n)
                _gradients(at, (n0, n1, n2), y, start, end, k, low, g)
                for q in range(waves):
                    part = crossed_sum(g, currents[q], start, end)
                    for c in range(6):
                        total[q, c] += part[c]
            for q in range(waves):
                for c in (0, 3):
                    h0, h1, h2 = total[q, c], total[q, c + 1], total[q, c + 2]
                    out[j, q, c] = 2.0 * (n1 * h2 - n2 * h1)
                    out[j, q, c + 1] = 2.0 * (n2 * h0 - n0 * h2)
                    out[j, q, c + 2] = 2.0 * (n0 * h1 - n1 * h0)


@njit(**options)
def _ramp(x):
    """Real and imaginary part of g."""
    c, s = cosine_sine(x / (4 * math.pi))
    ratio = 2 * s / x if x != 0.0 else 1.0
    return c * ratio, s * ratio


@njit(**options)
def _series(u, v):
    """Real and imaginary part of I where u - v is small."""
    real = imaginary = 0.0
    power, high, factor, turn = 1.0, 1.0, 0.5, 0
    for j in range(8):
        term = factor * power
        real += term if turn == 0 else (-term if turn == 2 else 0.0)
        imaginary += term if turn == 1 else (-term if turn == 3 else 0.0)
        high *= v
        power = power * u + high
        factor /= j + 3
        turn = (turn + 1) % 4
    return real, imaginary


@njit(**entry_options)
def triangle_waves(corners, vectors, weights, out):
    """Fill out (m, 2, w), real and imaginary parts, for vectors k q (m, 3), 1/L.

    Parameters
    ----------
    corners : (t, 3, 3), L
    weights : (t, w)
        2A is a factor of them.
    """
    columns = weights.shape[1]
    for row in range(vectors.shape[0]):
        qx, qy, qz = vectors[row, 0], vectors[row, 1], vectors[row, 2]
        for part in range(2):
            for column in range(columns):
                out[row, part, column] = 0.0
        for t in range(corners.shape[0]):
            a = qx * corners[t, 0, 0] + qy * corners[t, 0, 1] + qz * corners[t, 0, 2]
            b = qx * corners[t, 1, 0] + qy * corners[t, 1, 1] + qz * corners[t, 1, 2]
            c = qx * corners[t, 2, 0] + qy * corners[t, 2, 1] + qz * corners[t, 2, 2]
            ab, bc, ca = abs(a - b), abs(b - c), abs(c - a)
            if ab >= bc and ab >= ca:
                base, u, v = c, a - c, b - c
            elif bc >= ca:
                base, u, v = a, b - a, c - a
            else:
                base, u, v = b, c - b, a - b
            if abs(u - v) < 0.2:
                real, imaginary = _series(u, v)
            else:
                fr, fi = _ramp(u)
                gr, gi = _ramp(v)
                real, imaginary = (fi - gi) / (u - v), (gr - fr) / (u - v)
            turned, sine = cosine_sine(base / (2 * math.pi))
            wave, across = real * turned - imaginary * sine, real * sine + imaginary * turned
            for column in range(columns):
                out[row, 0, column] += wave * weights[t, column]
                out[row, 1, column] += across * weights[t, column]
