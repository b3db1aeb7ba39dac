"""Compiled traces on the surface of a plane wave that passes through each pole of a rational step.

The step acts on the plane wave r_0 e^{ikqn}, r_0 = sqrt(1 + kappa_a n), q = d.n, as on any other; its part at a pole is
again a slowly varying amplitude r times e^{ikqn}, in powers of n:

    (1 + b X)(r e) = r_0 e
    X(r e) = [sigma r + D r] e,   D r = (h^2 (2ikq r' + r'') + h c r')/k^2,   h = 1 + c n,   c = kappa_n + e
    sigma = -h^2 q^2 + i h c q/k + c0 - c^2/(4k^2) + 2 kappa_n n + (kappa_n^2 + a) n^2
    r = sum_i r_i,   (1 + b sigma) r_i = -b D r_(i-1),   (1 + b sigma) r_0 = sqrt(1 + kappa_a n)

e, c0, a and kappa_a are those of `creeping.field.kernels.ray_load`. It is a series in 1/(k rho), asymptotic only: of
its partial sums the one is taken whose sum over the poles is nearest to the wave at the step's end, which is known;
what is missing there is then shared among the poles.

Sources: [C93]; Derivations, F22.
"""

import numpy as np
from numba import njit

from creeping.kernels.block import options
from creeping.kernels.vectors import LANES

TERMS = 7
"""Powers of n."""
ROUNDS = 4
"""Terms of the series in 1/(k rho)."""


@njit(**options)
def multiply(a, b, out):
    """Product of two power series."""
    for i in range(TERMS):
        total = 0j
        for j in range(i + 1):
            total += a[j] * b[i - j]
        out[i] = total


@njit(**options)
def divide(a, b, out):
    """Quotient of two power series."""
    inverse = 1.0 / b[0]
    for i in range(TERMS):
        total = a[i]
        for j in range(i):
            total -= out[j] * b[i - j]
        out[i] = total * inverse


@njit(**options)
def transport(r, k, q, kappa, out):
    """D r in powers of n."""
    per = 1.0 / (k * k)
    for i in range(TERMS):
        # powers i of h^2 (2ikq r' + r'') + h kappa r'
        total = 0j
        for j in range(3):
            left = i - j
            if left >= 0:
                h2 = 1.0 if j == 0 else (2.0 * kappa if j == 1 else kappa * kappa)
                first = (left + 1) * r[left + 1] if left + 1 < TERMS else 0j
                second = (left + 2) * (left + 1) * r[left + 2] if left + 2 < TERMS else 0j
                total += h2 * (2j * k * q * first + second)
                if j < 2:
                    total += (kappa if j == 0 else kappa * kappa) * first
        out[i] = per * total


@njit(**options)
def pole_traces(k, q, kappa, first, linear, square, kappa_a, poles, weights, ratio, traces, work):
    """Fill traces (p, 2) with r and r' at n = 0 of each pole; returns how far their sum is from ``ratio``.

    ``kappa`` is c, ``first``, ``linear`` and ``square`` are c0, 2 kappa_n and kappa_n^2 + a; ``ratio`` is the wave
    at the step's end in terms of that at its start; work (5, TERMS) and (p, ROUNDS, 2).
    """
    p = len(poles)
    sigma, den, start, r, moved, sums = work
    for i in range(TERMS):
        sigma[i] = 0j
        start[i] = 0j
    sigma[0] = -q * q + 1j * kappa * q / k + first - kappa**2 / (4 * k * k)
    sigma[1] = linear - 2.0 * kappa * q * q + 1j * kappa * kappa * q / k
    sigma[2] = square - kappa * kappa * q * q
    start[0] = 1.0
    for i in range(1, TERMS):
        start[i] = start[i - 1] * kappa_a * (1.5 - i) / i
    for j in range(p):
        for i in range(TERMS):
            den[i] = poles[j] * sigma[i]
        den[0] += 1.0
        divide(start, den, r)
        for n in range(ROUNDS):
            if n > 0:
                transport(r, k, q, kappa, moved)
                for i in range(TERMS):
                    moved[i] *= -poles[j]
                divide(moved, den, r)
            sums[j, n, 0] = r[0] + (sums[j, n - 1, 0] if n > 0 else 0j)
            sums[j, n, 1] = r[1] + (sums[j, n - 1, 1] if n > 0 else 0j)
    best, least = 0, np.inf
    for n in range(ROUNDS):
        total = -ratio
        for j in range(p):
            total += weights[j] * sums[j, n, 0]
        if abs(total) < least:
            best, least = n, abs(total)
    for j in range(p):
        traces[j, 0], traces[j, 1] = sums[j, best, 0], sums[j, best, 1]
    return least


@njit(**options)
def drive(k, soft, driven, mid, edges, eta, poles, weights, lane, g, misfit):
    """Boundary values g of the scattered wave at the poles of a ray's first ``driven`` steps; later ones are left 0.

    mid (steps, 4) holds kappa_n, e, c0 and a at mid step; edges (steps + 1, 4) q = d.n, d.x - s, kappa_a and J; eta
    (steps,); g (steps, p + 1, 2 LANES) is filled in a lane, its last row with the condition at the step's start; misfit
    (steps,) gets what was to be shared among the poles.
    """
    p = poles.shape[1]
    traces = np.empty((p, 2), np.complex128)
    flat = np.empty((5, TERMS), np.complex128)
    work = (flat[0], flat[1], flat[2], flat[3], flat[4], np.empty((p, ROUNDS, 2), np.complex128))
    for i in range(driven):
        q0, q1 = edges[i, 0], edges[i + 1, 0]
        before = np.sqrt(edges[i, 3]) * np.exp(1j * k * edges[i, 1])
        after = np.sqrt(edges[i + 1, 3]) * np.exp(1j * k * edges[i + 1, 1])
        # kappa_t of one place in the amplitude and in the condition
        kt = edges[i, 2]
        ratio = after / before
        bend, linear, square = mid[i, 0] + mid[i, 1], 2.0 * mid[i, 0], mid[i, 0] ** 2 + mid[i, 3]
        misfit[i] = pole_traces(k, q0, bend, mid[i, 2], linear, square, kt, poles[i], weights[i], ratio, traces, work)
        size, missing = 0.0, 0j
        slope = 1j * k * eta[i] - 0.5 * kt
        for j in range(p):
            if soft:
                value = -traces[j, 0] * before
            else:
                value = -(traces[j, 1] + (1j * k * q0 + slope) * traces[j, 0]) * before
            traces[j, 0] = value
            missing -= weights[i, j] * value
            size += abs(weights[i, j]) ** 2
        begin = -1j * k * (q0 + eta[i]) * before
        g[i, p, lane], g[i, p, LANES + lane] = begin.real, begin.imag
        missing -= after if soft else 1j * k * (q1 + eta[i]) * after
        for j in range(p):
            value = traces[j, 0] + np.conj(weights[i, j]) / size * missing
            g[i, j, lane], g[i, j, LANES + lane] = value.real, value.imag
