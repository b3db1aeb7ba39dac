"""Compiled marching of a boundary layer along blocks of rays, in Hermite elements across it.

A block has LANES rays with one grid of heights; each has its own curvatures, steps and boundary data. With the
matrices of `creeping.field.marching.profile`, m and t the heights of its potentials, and c = kappa_n, e, c0 and a at
mid step as of `creeping.field.kernels.ray_load`,

    w = y/sqrt(h),   h = 1 + c m(n) + e t(n)
    K = c0 M0 - D0/k^2 + c [2 M1 - 2 D1/k^2] + c^2 [M2 - D2/k^2]
        + a M[t^2] - e {2 D[t] + 2c D[m t] + e D[t^2]}/k^2
    (M0 + b_j K_j) w_j = M0 w + b_j g_j/k^2 e_0,   w(s + ds) = sum_j c_j w_j

K_j is K with beta/k^2 at (0, 0), for w' + beta w = g_j on the surface; if soft, w_j = g_j there instead. Matrices are
complex symmetric of half-width 3 and factorised as L D L^T without pivoting, which never was unstable.

Sources: [C93]; Derivations, F22.
"""

import numpy as np
from numba import njit

from creeping.kernels.block import entry_options, options
from creeping.kernels.vectors import LANES, load, root, spread, store

ROW = 2 * LANES
"""Floats of a complex number of each ray; arrays are flat, real parts before imaginary ones."""
BAND = 4 * ROW


@njit(**options)
def times(ar, ai, br, bi):
    """Complex product."""
    return ar * br - ai * bi, ar * bi + ai * br


@njit(**options)
def minus_times(zr, zi, ar, ai, br, bi):
    """Complex z - a b."""
    return zr - ar * br + ai * bi, zi - ar * bi - ai * br


@njit(**options)
def operator(mats, step, out):
    """K of a step in columns: out (nd, BAND) flat, entries (j - 3 + i, j) for i = 0..3; step (4, LANES).

    ``mats`` (8, nd, 8) are those of the elements, real and imaginary parts by turns.
    """
    c, e, first, square = load(step[0], 0), load(step[1], 0), load(step[2], 0), load(step[3], 0)
    for j in range(mats.shape[1]):
        for i in range(8):
            total = first * spread(mats[0, j, i]) + spread(mats[1, j, i]) + square * spread(mats[4, j, i])
            total = total + c * (spread(mats[2, j, i]) + c * spread(mats[3, j, i]) + e * spread(mats[6, j, i]))
            total = total + e * (spread(mats[5, j, i]) + e * spread(mats[7, j, i]))
            store(out, j * BAND + i * LANES, total)


@njit(**options)
def mass(mats, w, out):
    """M0 w; w and out (nd, ROW) flat."""
    nd = mats.shape[1]
    for j in range(nd):
        x, y = spread(0.0), spread(0.0)
        for i in range(max(0, j - 3), min(nd, j + 4)):
            low, high = min(i, j), max(i, j)
            at = 2 * (low - high + 3)
            re, im = spread(mats[0, high, at]), spread(mats[0, high, at + 1])
            p, q = load(w, i * ROW), load(w, i * ROW + LANES)
            u, v = times(re, im, p, q)
            x, y = x + u, y + v
        store(out, j * ROW, x)
        store(out, j * ROW + LANES, y)


@njit(**options)
def entry(mats, K, j, i, br, bi):
    """Entry (j - 3 + i, j) of M0 + bK."""
    at = j * BAND + i * ROW
    u, v = times(br, bi, load(K, at), load(K, at + LANES))
    return spread(mats[0, j, 2 * i]) + u, spread(mats[0, j, 2 * i + 1]) + v


@njit(**options)
def keep(f, at, x, y):
    """Store a complex vector."""
    store(f, at, x)
    store(f, at + LANES, y)


@njit(**options)
def factorise(mats, K, rhs, pole, soft, g, beta, per, f):
    """Eliminate (M0 + bK) w = rhs downwards; f (nd, BAND) flat keeps l1, l2, l3 and r/d of every row.

    The window of four rows is in registers: a11 ... a44 its upper half, r1 ... r4 its right-hand sides.
    """
    # numba would compile `entry` for each pair of constants
    nd, o = mats.shape[1], np.int64(0)
    br, bi = load(pole, 0), load(pole, LANES)
    a11r, a11i = entry(mats, K, o, o + 3, br, bi)
    a12r, a12i = entry(mats, K, o + 1, o + 2, br, bi)
    a22r, a22i = entry(mats, K, o + 1, o + 3, br, bi)
    a13r, a13i = entry(mats, K, o + 2, o + 1, br, bi)
    a23r, a23i = entry(mats, K, o + 2, o + 2, br, bi)
    a33r, a33i = entry(mats, K, o + 2, o + 3, br, bi)
    a14r, a14i = entry(mats, K, o + 3, o, br, bi)
    a24r, a24i = entry(mats, K, o + 3, o + 1, br, bi)
    a34r, a34i = entry(mats, K, o + 3, o + 2, br, bi)
    a44r, a44i = entry(mats, K, o + 3, o + 3, br, bi)
    r1r, r1i = load(rhs, 0), load(rhs, LANES)
    r2r, r2i = load(rhs, ROW), load(rhs, ROW + LANES)
    r3r, r3i = load(rhs, 2 * ROW), load(rhs, 2 * ROW + LANES)
    r4r, r4i = load(rhs, 3 * ROW), load(rhs, 3 * ROW + LANES)
    gr, gi = load(g, 0), load(g, LANES)
    zero = spread(0.0)
    if soft:
        r2r, r2i = minus_times(r2r, r2i, a12r, a12i, gr, gi)
        r3r, r3i = minus_times(r3r, r3i, a13r, a13i, gr, gi)
        r4r, r4i = minus_times(r4r, r4i, a14r, a14i, gr, gi)
        a11r, a11i, a12r, a12i, a13r, a13i, a14r, a14i = spread(1.0), zero, zero, zero, zero, zero, zero, zero
        r1r, r1i = gr, gi
    else:
        pr, pi = br * spread(per), bi * spread(per)
        u, v = times(pr, pi, load(beta, 0), load(beta, LANES))
        a11r, a11i = a11r + u, a11i + v
        u, v = times(pr, pi, gr, gi)
        r1r, r1i = r1r + u, r1i + v
    for j in range(nd):
        scale = spread(1.0) / (a11r * a11r + a11i * a11i)
        dr, di = a11r * scale, zero - a11i * scale
        l1r, l1i = times(a12r, a12i, dr, di)
        l2r, l2i = times(a13r, a13i, dr, di)
        l3r, l3i = times(a14r, a14i, dr, di)
        zr, zi = times(r1r, r1i, dr, di)
        keep(f, j * BAND, l1r, l1i)
        keep(f, j * BAND + ROW, l2r, l2i)
        keep(f, j * BAND + 2 * ROW, l3r, l3i)
        keep(f, j * BAND + 3 * ROW, zr, zi)
        a11r, a11i = minus_times(a22r, a22i, l1r, l1i, a12r, a12i)
        a12r_, a12i_ = minus_times(a23r, a23i, l1r, l1i, a13r, a13i)
        a22r, a22i = minus_times(a33r, a33i, l2r, l2i, a13r, a13i)
        a13r_, a13i_ = minus_times(a24r, a24i, l1r, l1i, a14r, a14i)
        a23r, a23i = minus_times(a34r, a34i, l2r, l2i, a14r, a14i)
        a33r, a33i = minus_times(a44r, a44i, l3r, l3i, a14r, a14i)
        a12r, a12i, a13r, a13i = a12r_, a12i_, a13r_, a13i_
        u, v = r1r, r1i
        r1r, r1i = minus_times(r2r, r2i, l1r, l1i, u, v)
        r2r, r2i = minus_times(r3r, r3i, l2r, l2i, u, v)
        r3r, r3i = minus_times(r4r, r4i, l3r, l3i, u, v)
        if j + 4 < nd:
            a14r, a14i = entry(mats, K, j + 4, o, br, bi)
            a24r, a24i = entry(mats, K, j + 4, o + 1, br, bi)
            a34r, a34i = entry(mats, K, j + 4, o + 2, br, bi)
            a44r, a44i = entry(mats, K, j + 4, o + 3, br, bi)
            r4r, r4i = load(rhs, (j + 4) * ROW), load(rhs, (j + 4) * ROW + LANES)
        else:
            a14r, a14i, a24r, a24i, a34r, a34i = zero, zero, zero, zero, zero, zero
            a44r, a44i, r4r, r4i = spread(1.0), zero, zero, zero


@njit(**options)
def back_substitute(nd, f, weight, total):
    """Add c w to total (nd, ROW) flat, w the solution that f holds, c the weight (ROW,)."""
    cr, ci = load(weight, 0), load(weight, LANES)
    zero = spread(0.0)
    x1r, x1i, x2r, x2i, x3r, x3i = zero, zero, zero, zero, zero, zero
    for j in range(nd - 1, -1, -1):
        at = j * BAND
        zr, zi = load(f, at + 3 * ROW), load(f, at + 3 * ROW + LANES)
        zr, zi = minus_times(zr, zi, load(f, at + 2 * ROW), load(f, at + 2 * ROW + LANES), x3r, x3i)
        zr, zi = minus_times(zr, zi, load(f, at + ROW), load(f, at + ROW + LANES), x2r, x2i)
        zr, zi = minus_times(zr, zi, load(f, at), load(f, at + LANES), x1r, x1i)
        x3r, x3i, x2r, x2i, x1r, x1i = x2r, x2i, x1r, x1i, zr, zi
        u, v = times(zr, zi, cr, ci)
        store(total, j * ROW, load(total, j * ROW) + u)
        store(total, j * ROW + LANES, load(total, j * ROW + LANES) + v)


@njit(**options)
def turned(w, step, levels, scale, sense):
    """Replace nodal values and slopes of w by those of w h^(sense/2), h = 1 + c m, sense 1 or -1; rates are m'."""
    c, e = load(step[0], 0), load(step[1], 0)
    one, half = spread(1.0), spread(0.5 * scale * sense)
    for j in range(levels.shape[1]):
        h = one + c * spread(levels[0, j]) + e * spread(levels[2, j])
        f = root(h)
        if sense < 0.0:
            f = one / f
        slope = half * (c * spread(levels[1, j]) + e * spread(levels[3, j])) / h
        at = 2 * j * ROW
        for part in range(0, ROW, LANES):
            u = f * load(w, at + part)
            store(w, at + part, u)
            store(w, at + ROW + part, f * load(w, at + ROW + part) + slope * u)


@njit(**options)
def switch_to_total(w, incident, cut, lane):
    """Add the incident wave to a lane's scattered one and fade both out at the top; cut (nodes, 2): value, slope."""
    for j in range(len(cut)):
        t, dt = cut[j, 0], cut[j, 1]
        for part in (lane, LANES + lane):
            at = 2 * j * ROW + part
            u = w[at] + incident[at]
            w[at + ROW] = (w[at + ROW] + incident[at + ROW]) * t + u * dt
            w[at] = u * t


@njit(**options)
def meet_condition(w, beta, g, scale):
    """Make the slope on the surface g - beta w: the condition is a step's own from its start on."""
    u, v = times(load(beta, 0), load(beta, LANES), load(w, 0), load(w, LANES))
    store(w, ROW, spread(scale) * (load(g, 0) - u))
    store(w, ROW + LANES, spread(scale) * (load(g, LANES) - v))


@njit(**entry_options)
def march_block(mats, levels, cut, scale, k, soft, steps, poles, weights, g, beta, switch, incident, w, out):
    """March one block of rays.

    Parameters are C-contiguous: steps (steps, 4, LANES) with c, e, c0 and a at mid steps; levels (4, nodes) with m, m',
    t and t'; poles b_j and weights c_j (steps, p, ROW);
    g (steps, p + 1, ROW), at the poles and at the start of a step; beta (steps, ROW); switch (LANES,), the step before
    which a lane turns to the total wave; incident (nd ROW,) the wave added there; w (nd ROW,) values and slopes of y,
    slopes times scale, changed in place; out (steps + 1, 2, ROW) gets y and its slope on the surface.
    """
    nd = mats.shape[1]
    per = 1.0 / (k * k)
    K, f = np.empty(nd * BAND), np.empty(nd * BAND)
    rhs = np.empty(nd * ROW)
    for i in range(ROW):
        out[0, 0, i], out[0, 1, i] = w[i], w[ROW + i] / scale
    for step in range(len(steps)):
        for lane in range(LANES):
            if switch[lane] == step:
                switch_to_total(w, incident, cut, lane)
        turned(w, steps[step], levels, scale, -1.0)
        if not soft:
            meet_condition(w, beta[step], g[step, poles.shape[1]], scale)
        operator(mats, steps[step], K)
        mass(mats, w, rhs)
        w[:] = 0.0
        for j in range(poles.shape[1]):
            factorise(mats, K, rhs, poles[step, j], soft, g[step, j], beta[step], per, f)
            back_substitute(nd, f, weights[step, j], w)
        turned(w, steps[step], levels, scale, 1.0)
        for i in range(ROW):
            out[step + 1, 0, i], out[step + 1, 1, i] = w[i], w[ROW + i] / scale
