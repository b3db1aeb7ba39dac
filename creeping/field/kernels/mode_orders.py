"""Compiled twin of `creeping.field.shed_wave.mode_sum` for constant modes and plane waves: both orders at once.

    P_1 e^{-iπ/4} = 2i√π Σ_p R_p e^{iξτ_p},   P_2 e^{-iπ/4} = 2i√π Σ_p R_p A_p e^{i(ξτ_p + δ_p)}
    δ = (2/k)^(1/3) (c_0 I_2 + c_r I_3 + c_v I_4) + a (ρ2'/m2 - ρ1'/m1)/12,   held below ξ|τ|/2
    A = 1 + (1/2) Σ_ends [s_0 + s_r r + τ (ω r + β ρρ'') - M0² ρρ''/60]/m²,   what is added to 1 held below 2

Each mode brings its complex constants, each ray real numbers, so that loops over a block of rays vectorise.

Sources: Derivations, F4 to F7.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import BLOCK, entry_options, options
from creeping.kernels.exponential import wave

I1, I2, I3, I4, U1, U2, RATE1, RATE2, R1, R2, BEND1, BEND2, LANES = range(13)
"""Numbers of a ray: integrals, (2 κ)^(1/3) at both ends, 0 where κ <= 0, ρ', and r and ρρ'', 0 where κ <= 0."""
TAU, RESIDUE, PLAIN, ACROSS, VARYING, ENDS, SLOPE, SLOPE_ACROSS, BENT, CONSTANTS = range(10)
"""Numbers of a mode: τ, R, the parts of c, a, those of ∂c/∂τ, and M0²/60."""
MOST_OF_DECAY, MOST_CHANGE = 0.5, 2.0
"""Bounds of the second order: of |δ| in parts of ξ|τ|, and of what A adds to 1."""
_FACTOR = 2 * math.sqrt(math.pi)


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
    rays : (LANES, n), n a multiple of BLOCK
    modes : (m, CONSTANTS, 2)
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
            v1, v2 = rays[U1, j] * root, rays[U2, j] * root
            w1, w2 = 0.5 * v1 * v1, 0.5 * v2 * v2
            xi[i] = s * rays[I1, j]
            by1[i], by2[i], by3[i] = rays[I2, j] / s, rays[I3, j] / s, rays[I4, j] / s
            ends[i] = (rays[RATE2, j] * v2 - rays[RATE1, j] * v1) / 12.0
            a0[i] = w1 + w2
            a1[i] = w1 * rays[R1, j] + w2 * rays[R2, j]
            a3[i] = w1 * rays[BEND1, j] + w2 * rays[BEND2, j]
            a2[i] = transverse_weight * a1[i] + beta * a3[i]
            for q in range(4):
                sums[q, i] = 0.0
        for p in range(modes.shape[0]):
            # real and imaginary parts of the constants
            tr, ti = modes[p, TAU, 0], modes[p, TAU, 1]
            rr, ri = modes[p, RESIDUE, 0], modes[p, RESIDUE, 1]
            pr, pi = modes[p, PLAIN, 0], modes[p, PLAIN, 1]
            cr, ci = modes[p, ACROSS, 0], modes[p, ACROSS, 1]
            vr, vi = modes[p, VARYING, 0], modes[p, VARYING, 1]
            er, ei = modes[p, ENDS, 0], modes[p, ENDS, 1]
            sr, si = modes[p, SLOPE, 0], modes[p, SLOPE, 1]
            xr, xim = modes[p, SLOPE_ACROSS, 0], modes[p, SLOPE_ACROSS, 1]
            br, bi = modes[p, BENT, 0], modes[p, BENT, 1]
            most2 = MOST_OF_DECAY * MOST_OF_DECAY * (tr * tr + ti * ti)
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
                held = _held(fr * fr + fi * fi, MOST_CHANGE * MOST_CHANGE)
                fr, fi = 1.0 + held * fr, held * fi
                gr, gi = rr * fr - ri * fi, rr * fi + ri * fr
                sums[2, i] += gr * cosine - gi * sine
                sums[3, i] += gr * sine + gi * cosine
        for i in range(BLOCK):
            for q in range(2):
                # times 2i√π
                out[2 * q, at + i] = -_FACTOR * sums[2 * q + 1, i]
                out[2 * q + 1, at + i] = _FACTOR * sums[2 * q, i]
