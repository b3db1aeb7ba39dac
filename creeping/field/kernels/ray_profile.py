"""Compiled plane curves with the curvature of a ray: cubics between nodes, their angle and position.

Beside a ray the layer sees its normal curvature only, so that waves are traced on the plane curve that has it. With
tangent (cos psi, sin psi), normal (sin psi, -cos psi) and the wave along the first axis,

    psi = int kappa ds,   d.x = int cos psi ds,   d.n = sin psi,   psi = 0, x = 0 at s = 0

Between two nodes kappa is the cubic through four nodes of the same piece; nodes that stand twice part the pieces.

Also here: compiled twin of `creeping.field.waves.shed_wave.mode_sum` for constant modes and plane waves: both orders at
once.

    P_1 e^{-iπ/4} = 2i√π Σ_p R_p e^{iξτ_p},   P_2 e^{-iπ/4} = 2i√π Σ_p R_p A_p e^{i(ξτ_p + δ_p)}
    δ = (2/k)^(1/3) (c_0 I_2 + c_r I_3 + c_v I_4) + a (ρ2'/m2 - ρ1'/m1)/12,   held below ξ|τ|/2
    A = 1 + (1/2) Σ_ends [s_0 + s_r r + τ (ω r + β ρρ'') - M0² ρρ''/60]/m²,   what is added to 1 held below 2

Each mode brings its complex constants, each ray real numbers, so that loops over a block of rays vectorise.

Also here: compiled sums of Gaussian beams at points of the body.

A point belongs to a ray's beam at each foot of it: there g = (y - x).p falls through 0. The foot is found between two
steps, n = (y - x).b with the arc for its chord, and

    (V + M n V') exp{log B + ik [S + (M/2) n^2]}

is added to each component, log B, S, M, V and V' linear between the steps. Points are reached from blocks of SPAN
steps only if those are near.

Sources: Derivations, F22 and F4 to F7.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import BLOCK, entry_options, options, strict_options
from creeping.kernels.exponential import wave

_x, _w = np.polynomial.legendre.leggauss(4)
GAUSS = tuple((float(x), float(w)) for x, w in zip((_x + 1) / 2, _w / 2, strict=True))
"""Places and weights on an interval of length 1."""
STEEPEST = 0.6
"""Height of a point above the tangent plane at a foot, over its distance: beyond, it is on another side of a body."""
SPAN = 16


@njit(**strict_options)
def cubics(s, values, out):
    """Coefficients out (m - 1, 4) of powers of s - s_i between nodes i and i + 1 of values (m,)."""
    m = len(s)
    begin = 0
    while begin < m:
        end = begin + 1
        while end < m and s[end] > s[end - 1]:
            end += 1
        for i in range(begin, end - 1):
            first = max(begin, min(i - 1, end - 4))
            # divided differences, then powers of s - s_i
            d = np.empty(4, values.dtype)
            for j in range(4):
                d[j] = values[first + j]
            for order in range(1, 4):
                for j in range(3, order - 1, -1):
                    d[j] = (d[j] - d[j - 1]) / (s[first + j] - s[first + j - order])
            p = np.zeros(4, values.dtype)
            p[0] = d[3]
            for j in range(2, -1, -1):
                shift = s[i] - s[first + j]
                for power in range(3, 0, -1):
                    p[power] = p[power] * shift + p[power - 1]
                p[0] = p[0] * shift + d[j]
            # element by element: to assign one array to another takes seconds to compile
            for power in range(4):
                out[i, power] = p[power]
        if end < m:
            out[end - 1] = 0.0
        begin = end


@njit(**strict_options)
def angle(c, psi, t):
    """Angle at t behind a node: psi + int of the cubic c."""
    return psi + t * (c[0] + t * (c[1] / 2 + t * (c[2] / 3 + t * c[3] / 4)))


@njit(**strict_options)
def displacement(c, psi, t):
    """Displacement (along, across) from a node to t behind it."""
    along, across = 0.0, 0.0
    for j in range(4):
        a = angle(c, psi, GAUSS[j][0] * t)
        along += GAUSS[j][1] * np.cos(a)
        across += GAUSS[j][1] * np.sin(a)
    return along * t, across * t


@njit(**strict_options)
def plane_curve(s, c, origin, curve):
    """Fill curve (m, 3) with psi and x at nodes; at the node ``origin`` they are 0."""
    m = len(s)
    curve[origin] = 0.0
    for i in range(origin, m - 1):
        t = s[i + 1] - s[i]
        along, across = displacement(c[i], curve[i, 0], t)
        curve[i + 1, 0] = angle(c[i], curve[i, 0], t)
        curve[i + 1, 1], curve[i + 1, 2] = curve[i, 1] + along, curve[i, 2] + across
    for i in range(origin - 1, -1, -1):
        t = s[i + 1] - s[i]
        # the cubic's angle at node i is that at i + 1 less its integral
        curve[i, 0] = curve[i + 1, 0] - angle(c[i], 0.0, t)
        along, across = displacement(c[i], curve[i, 0], t)
        curve[i, 1], curve[i, 2] = curve[i + 1, 1] - along, curve[i + 1, 2] - across


@njit(**strict_options)
def interval(s, at):
    """Interval that holds a place; at a joint the one ahead."""
    i = np.searchsorted(s, at, side="right") - 1
    i = max(0, min(i, len(s) - 2))
    # not between the two nodes of a joint
    while i > 0 and s[i + 1] <= s[i]:
        i -= 1
    return i


@njit(**strict_options)
def value(c, t):
    """Cubic at t."""
    return c[0] + t * (c[1] + t * (c[2] + t * c[3]))


@njit(**strict_options)
def sample(s, c, curve, at, out):
    """Fill out (n, 4) with kappa, psi and x at places (n,)."""
    for j in range(len(at)):
        i = interval(s, at[j])
        t = at[j] - s[i]
        out[j, 0] = value(c[i], t)
        out[j, 1] = angle(c[i], curve[i, 0], t)
        along, across = displacement(c[i], curve[i, 0], t)
        out[j, 2], out[j, 3] = curve[i, 1] + along, curve[i, 2] + across


@njit(**options)
def _held(size2, bound2):
    """What a change is multiplied with, 1/(1 + |change/bound|⁴)^(1/4); of squares of sizes, and 1 of no change."""
    ratio = size2 / bound2 if bound2 > 0.0 else (1e30 if size2 > 0.0 else 0.0)
    return 1.0 / math.sqrt(math.sqrt(1.0 + ratio * ratio))


@njit(**entry_options)
def mode_orders(rays, modes, k, transverse_weight, beta, start, stop, out):
    """Fill out (4, n), real and imaginary part of P_1 e^{-iπ/4} and of P_2 e^{-iπ/4}, for blocks from start to stop.

    Parameters
    ----------
    rays : (12, n), n a multiple of BLOCK
        I_1 to I_4; of both ends (2 κ)^(1/3), 0 where κ <= 0, ρ', and r and ρρ'', 0 where κ <= 0.
    modes : (m, 9, 2)
        τ, R, the three parts of c, a, the two of ∂c/∂τ, and M0²/60.
    k : float, 1/L
    transverse_weight, beta : float
        ω and β.
    start, stop : int
        Numbers of blocks.
    """
    # m/ρ^(1/3), and what makes 1/m of (2 κ)^(1/3)
    s, root = (0.5 * k) ** (1 / 3), k ** (-1 / 3)
    node = np.empty((9, BLOCK))
    xi, by1, by2, by3, ends = node[0], node[1], node[2], node[3], node[4]
    a0, a1, a2, a3 = node[5], node[6], node[7], node[8]
    sums = np.empty((4, BLOCK))
    for block in range(start, stop):
        at = block * BLOCK
        for i in range(BLOCK):
            j = at + i
            v1, v2 = rays[4, j] * root, rays[5, j] * root
            w1, w2 = 0.5 * v1 * v1, 0.5 * v2 * v2
            xi[i] = s * rays[0, j]
            by1[i], by2[i], by3[i] = rays[1, j] / s, rays[2, j] / s, rays[3, j] / s
            ends[i] = (rays[7, j] * v2 - rays[6, j] * v1) / 12.0
            a0[i] = w1 + w2
            a1[i] = w1 * rays[8, j] + w2 * rays[9, j]
            a3[i] = w1 * rays[10, j] + w2 * rays[11, j]
            a2[i] = transverse_weight * a1[i] + beta * a3[i]
            for q in range(4):
                sums[q, i] = 0.0
        for p in range(modes.shape[0]):
            # real and imaginary parts of the constants
            tr, ti = modes[p, 0, 0], modes[p, 0, 1]
            rr, ri = modes[p, 1, 0], modes[p, 1, 1]
            pr, pi = modes[p, 2, 0], modes[p, 2, 1]
            cr, ci = modes[p, 3, 0], modes[p, 3, 1]
            vr, vi = modes[p, 4, 0], modes[p, 4, 1]
            er, ei = modes[p, 5, 0], modes[p, 5, 1]
            sr, si = modes[p, 6, 0], modes[p, 6, 1]
            xr, xim = modes[p, 7, 0], modes[p, 7, 1]
            br, bi = modes[p, 8, 0], modes[p, 8, 1]
            most2 = 0.25 * (tr * tr + ti * ti)
            for i in range(BLOCK):
                lr, li = xi[i] * tr, xi[i] * ti
                cosine, sine = wave(-li, lr)
                sums[0, i] += rr * cosine - ri * sine
                sums[1, i] += rr * sine + ri * cosine
                dr = pr * by1[i] + cr * by2[i] + vr * by3[i] + er * ends[i]
                di = pi * by1[i] + ci * by2[i] + vi * by3[i] + ei * ends[i]
                held = _held(dr * dr + di * di, xi[i] * xi[i] * most2)
                cosine, sine = wave(-(li + held * di), lr + held * dr)
                fr = sr * a0[i] + xr * a1[i] + tr * a2[i] - br * a3[i]
                fi = si * a0[i] + xim * a1[i] + ti * a2[i] - bi * a3[i]
                held = _held(fr * fr + fi * fi, 4.0)
                fr, fi = 1.0 + held * fr, held * fi
                gr, gi = rr * fr - ri * fi, rr * fi + ri * fr
                sums[2, i] += gr * cosine - gi * sine
                sums[3, i] += gr * sine + gi * cosine
        for i in range(BLOCK):
            for q in range(2):
                # times 2i√π
                out[2 * q, at + i] = -2.0 * math.sqrt(math.pi) * sums[2 * q + 1, i]
                out[2 * q + 1, at + i] = 2.0 * math.sqrt(math.pi) * sums[2 * q, i]


@njit(**strict_options)
def spans_of(points, centres, radii):
    """Centres (rays, spans, 3) and radii (rays, spans) of balls around blocks of steps of points (rays, steps, 3)."""
    steps = points.shape[1]
    for ray in range(points.shape[0]):
        for span in range(centres.shape[1]):
            first, last = span * SPAN, min((span + 1) * SPAN, steps - 1)
            middle = points[ray, (first + last) // 2]
            far = 0.0
            for i in range(first, last + 1):
                square = 0.0
                for c in range(3):
                    square += (points[ray, i, c] - middle[c]) ** 2
                far = max(far, square)
            centres[ray, span] = middle
            radii[ray, span] = math.sqrt(far)


@njit(**strict_options)
def add_beams(
    at, points, tangents, sides, bend, S, amplitude, phase, M, k, cut, reach, centres, radii, V, lean, early, late
):
    """Add beams at the points ``at`` (n, 3) to ``early`` and ``late`` (n, c), by their feet before and behind ``cut``.

    points, tangents p and sides b (rays, steps, 3); bend = kappa_t, S, amplitude and phase of B (rays, steps) and the
    complex M with them; V and lean = V' (rays, steps, c) or (1, 1, c) if all are the same; ``cut`` is a step. Beams
    reach as far as ``reach``.
    """
    rays, steps = S.shape
    same = V.shape[0] == 1 and V.shape[1] == 1
    for j in range(at.shape[0]):
        x, y, z = at[j, 0], at[j, 1], at[j, 2]
        for ray in range(rays):
            for span in range(centres.shape[1]):
                a, b, c = x - centres[ray, span, 0], y - centres[ray, span, 1], z - centres[ray, span, 2]
                if a * a + b * b + c * c > (reach + radii[ray, span]) ** 2:
                    continue
                begin, end = span * SPAN, min((span + 1) * SPAN, steps - 1)
                before = 0.0
                for i in range(begin, end + 1):
                    a, b, c = x - points[ray, i, 0], y - points[ray, i, 1], z - points[ray, i, 2]
                    g = a * tangents[ray, i, 0] + b * tangents[ray, i, 1] + c * tangents[ray, i, 2]
                    square = a * a + b * b + c * c
                    # along n = p x b: a foot that the point stands high above or deep below is on another side
                    up = a * (tangents[ray, i, 1] * sides[ray, i, 2] - tangents[ray, i, 2] * sides[ray, i, 1])
                    up += b * (tangents[ray, i, 2] * sides[ray, i, 0] - tangents[ray, i, 0] * sides[ray, i, 2])
                    up += c * (tangents[ray, i, 0] * sides[ray, i, 1] - tangents[ray, i, 1] * sides[ray, i, 0])
                    beside = square < reach * reach and up * up <= STEEPEST * STEEPEST * square
                    if i > begin and before > 0.0 and g <= 0.0 and beside:
                        o, t = i - 1, before / (before - g)
                        n = 0.0
                        for e in range(3):
                            foot = points[ray, o, e] + t * (points[ray, i, e] - points[ray, o, e])
                            side = sides[ray, o, e] + t * (sides[ray, i, e] - sides[ray, o, e])
                            n += (at[j, e] - foot) * side
                        n *= 1.0 + (bend[ray, o] * n) ** 2 / 6.0
                        curve = M[ray, o] + t * (M[ray, i] - M[ray, o])
                        size = amplitude[ray, o] + t * (amplitude[ray, i] - amplitude[ray, o])
                        turn = phase[ray, o] + t * (phase[ray, i] - phase[ray, o])
                        way = S[ray, o] + t * (S[ray, i] - S[ray, o])
                        beam = np.exp(size + 1j * turn + 1j * k * (way + 0.5 * curve * n * n))
                        first, row, then = ray, o, i
                        if same:
                            first, row, then = 0, 0, 0
                        for e in range(V.shape[2]):
                            value = V[first, row, e] + t * (V[first, then, e] - V[first, row, e])
                            aside = lean[first, row, e] + t * (lean[first, then, e] - lean[first, row, e])
                            part = beam * (value + curve * n * aside)
                            if o < cut:
                                early[j, e] += part
                            else:
                                late[j, e] += part
                    before = g
