"""Compiled loading of a ray into a lane of a block: its steps, its boundary data and the waves at its heights.

    at mid step   kappa_n,   e = tau Lambda,   kappa_a = kappa_t - e,   c0 = [(kappa_n + e - kappa_a)^2/4 + V]/k^2,
                  a = tau (4 kappa_n Lambda - 3 tau),   beta = ik eta + (kappa_n + e - kappa_a)/2,   b_j (1 + Lambda^2)
    incident      y = sqrt(J h_a) e^{ik(d.x - s + q n)},   y_n = (ikq + kappa_a/(2 h_a)) y,   h_a = 1 + kappa_a m(n)
    reflected     y = u sqrt(J h_a) e^{-iks}, by optics, faded out in the absorber

The reflected wave is that of the plane across the line, where wavenumber and lengths along the ray are shorter by
cos = 1/sqrt(1 + Lambda^2); on the plane curve of the profile, as long as the ray, heights are longer by 1/cos.

Also here: compiled geometrical optics of the reflected wave on the line normal to a ray's start.

The reflected ray from a place s' before the start s_a, r = d - 2 (d.n) n, meets the line at a height n and a length l:

    x(s') + l r = x(s_a) + n n(s_a),   c = -d.n(s'),   rho_1 = c/(2 kappa),   rho_2 = 1/(2 kappa_t c)
    u = R sqrt(rho_1/(rho_1 + l)) sqrt(rho_2/(rho_2 + l)) e^{ik (d.x(s') + l)},   u_n = ik (r.n(s_a)) u
    R = -1 soft, 1 hard, (c - eta)/(c + eta) for an impedance

Places s' go back from s_a by steps whose heights are an element apart: towards rays that leave the line they run away
fast. The phase between them is Hermite's cubic, its slope r.n being known; the amplitude is linear, for it jumps where
the curvature does. Above the last ray that meets the line there is nothing.

Also here: compiled traces on the surface of a plane wave that passes through each pole of a rational step.

The step acts on the plane wave r_0 e^{ikqn}, r_0 = sqrt(1 + kappa_a n), q = d.n, as on any other; its part at a pole is
again a slowly varying amplitude r times e^{ikqn}, in powers of n:

    (1 + b X)(r e) = r_0 e
    X(r e) = [sigma r + D r] e,   D r = (h^2 (2ikq r' + r'') + h c r')/k^2,   h = 1 + c n,   c = kappa_n + e
    sigma = -h^2 q^2 + i h c q/k + c0 - c^2/(4k^2) + 2 kappa_n n + (kappa_n^2 + a) n^2
    r = sum_i r_i,   (1 + b sigma) r_i = -b D r_(i-1),   (1 + b sigma) r_0 = sqrt(1 + kappa_a n)

e, c0, a and kappa_a are those of `creeping.field.kernels.ray_load`. It is a series in 1/(k rho), asymptotic only: of
its partial sums the one is taken whose sum over the poles is nearest to the wave at the step's end, which is known;
what is missing there is then shared among the poles.

Sources: [KLS56]; Derivations, F22; [C93].
"""

import numpy as np
from numba import njit

from creeping.field.kernels.ray_profile import angle, displacement, interval, value
from creeping.kernels.block import options, strict_options
from creeping.kernels.vectors import LANES

LEAST_FORWARD = 0.02
"""Share along the start's tangent below which reflected rays are nothing, faded out from 0.2 on: they rise too steeply
for a wave that is marched, and a wave that ended at a height would radiate from there."""
TERMS = 7
"""Powers of n."""
ROUNDS = 4
"""Terms of the series in 1/(k rho)."""


@njit(**strict_options)
def load_steps(k, soft, lane, s, cubics, eta, edges, driven, b, c, steps, poles, weights, g, beta, lit):
    """Fill a lane of a block with a ray's steps, the last of them repeated to the block's end.

    ``cubics`` between the nodes s are those of what is named below; b and c (n, p) are those of its n steps between
    ``edges``.
    steps (steps, 4, LANES) gets kappa_n, e, c0 and a; lit (driven + 1, 4) gets q = d.n, d.x - s, kappa_a and J at the
    edges of driven steps. Returns the largest misfit of the traces.
    """
    kappa, across, spreading, torsion, lean, potential, phase, climb = cubics
    n = len(edges) - 1
    p = b.shape[1]
    mid, aside = np.empty((n, 4)), np.empty(n)
    local, oblique = np.empty(n, np.complex128), np.empty((n, p), np.complex128)
    for i in range(n):
        at = 0.5 * (edges[i] + edges[i + 1])
        j = interval(s, at)
        t = at - s[j]
        bend, twist, lag = value(kappa[j], t), value(torsion[j], t), value(lean[j], t)
        aside[i], local[i] = value(across[j], t), value(eta[j], t)
        mid[i, 0], mid[i, 1] = bend, twist * lag
        mid[i, 2] = (0.25 * (bend + mid[i, 1] - aside[i]) ** 2 + value(potential[j], t)) / (k * k)
        mid[i, 3] = twist * (4.0 * bend * lag - 3.0 * twist)
        for m in range(p):
            oblique[i, m] = b[i, m] * (1.0 + lag * lag)
    for i in range(poles.shape[0]):
        at = min(i, n - 1)
        for m in range(4):
            steps[i, m, lane] = mid[at, m]
        slope = 1j * k * local[at] + 0.5 * (mid[at, 0] + mid[at, 1] - aside[at])
        beta[i, lane], beta[i, LANES + lane] = slope.real, slope.imag
        for j in range(p):
            poles[i, j, lane], poles[i, j, LANES + lane] = oblique[at, j].real, oblique[at, j].imag
            weights[i, j, lane], weights[i, j, LANES + lane] = c[at, j].real, c[at, j].imag
    for i in range(driven + 1):
        j = interval(s, edges[i])
        t = edges[i] - s[j]
        lit[i, 0], lit[i, 1], lit[i, 2] = value(climb[j], t), value(phase[j], t), value(across[j], t)
        # behind the line rays may cross: their tube is held
        lit[i, 3] = max(value(spreading[j], t), 0.05)
    misfit = np.zeros(max(driven, 1))
    drive(k, soft, driven, mid, lit, local, oblique, c, lane, g, misfit)
    return np.max(misfit)


@njit(**strict_options)
def load_waves(k, soft, lane, s, bend, curve, across, lean, eta, start, stop, lit, grid, wave, incident):
    """Fill a lane with the reflected wave at the start and the incident one at the end of the driven steps.

    bend and curve are those of the profile's plane curve; levels (4, nodes) hold m and m' in the first two rows; fade
    (nodes, 2) is what the reflected wave is multiplied with, and its slope; wave and incident (2 nodes, 2 LANES) get
    values and slopes, slopes times ``scale``.
    """
    nodes, levels, fade, scale = grid
    u = np.empty((len(nodes), 2), np.complex128)
    i = interval(s, start)
    t = start - s[i]
    square = 1.0 / (1.0 + value(lean[i], t) ** 2)
    cosine = np.sqrt(square)
    along = curve[i, 1] + displacement(bend[i], curve[i, 0], t)[0]
    reflected(k * square, soft, s, bend, curve, across * cosine, eta, start, stop, nodes / cosine, u)
    last = len(lit) - 1
    q = lit[last, 0]
    first = np.sqrt(lit[0, 3]) * np.exp(1j * k * (lit[0, 1] - square * along))
    for j in range(len(nodes)):
        height, rate = levels[0, j], levels[1, j]
        tube = max(1.0 + lit[0, 2] * height, 0.2)
        widening = 0.5 * lit[0, 2] * rate / tube
        y = u[j, 0] * fade[j, 0] * first * np.sqrt(tube)
        slope = u[j, 1] / cosine * fade[j, 0] + u[j, 0] * (fade[j, 1] + widening * fade[j, 0])
        slope *= first * np.sqrt(tube) * scale
        wave[2 * j, lane], wave[2 * j, LANES + lane] = y.real, y.imag
        wave[2 * j + 1, lane], wave[2 * j + 1, LANES + lane] = slope.real, slope.imag
        tube = max(1.0 + lit[last, 2] * height, 0.2)
        y = np.sqrt(lit[last, 3] * tube) * np.exp(1j * k * (lit[last, 1] + nodes[j] * q))
        slope = scale * (1j * k * q + 0.5 * lit[last, 2] * rate / tube) * y
        incident[2 * j, lane], incident[2 * j, LANES + lane] = y.real, y.imag
        incident[2 * j + 1, lane], incident[2 * j + 1, LANES + lane] = slope.real, slope.imag


@njit(**strict_options)
def reflected(k, soft, s, cubics, curve, transverse, eta, start, stop, nodes, out):
    """Fill out (nodes, 2) with u and u_n on the line above ``start``; returns the height up to which rays meet it.

    cubics and curve are those of `ray_profile`, transverse and eta the cubics of kappa_t and of the admittance; rays
    come from places between ``stop`` and ``start``.
    """
    apart, most = nodes[-1] - nodes[-2], 0.05 * (start - stop)
    psi, x0, y0 = 0.0, 0.0, 0.0
    h0, f0, a0, s0 = 0.0, 0.0, 0j, 0.0
    at, step = start, 0.0
    first, node = True, 0
    while node < len(nodes) and at > stop:
        there = max(at - step, stop)
        i = interval(s, there)
        t = there - s[i]
        turn = angle(cubics[i], curve[i, 0], t)
        along, across = displacement(cubics[i], curve[i, 0], t)
        x, y = curve[i, 1] + along, curve[i, 2] + across
        if first:
            psi, x0, y0 = turn, x, y
        mx, my = np.sin(turn), -np.cos(turn)
        c = -mx
        rx, ry = 1.0 + 2.0 * c * mx, 2.0 * c * my
        forward = rx * np.cos(psi) + ry * np.sin(psi)
        dx, dy = x0 - x, y0 - y
        length = (dx * np.cos(psi) + dy * np.sin(psi)) / forward if forward > 0.0 else -1.0
        h = (x + length * rx - x0) * np.sin(psi) - (y + length * ry - y0) * np.cos(psi)
        meets = c > 1e-3 and forward > LEAST_FORWARD and length >= 0.0 and (first or h > h0)
        if not first and (not meets or h - h0 > apart):
            # towards the last ray that meets the line, or to the next height
            step *= 0.5
            if step < 2e-5 * most:
                break
            continue
        if not meets:
            break
        tube = 1.0 / (1.0 + length * max(2.0 * value(cubics[i], t), 0.0) / c)
        tube /= max(1.0 + 2.0 * length * value(transverse[i], t) * c, 0.05)
        local = value(eta[i], t)
        a1 = (-1.0 + 0j if soft else (c - local) / (c + local)) * np.sqrt(tube)
        part = min(1.0, max(0.0, (forward - LEAST_FORWARD) / (0.2 - LEAST_FORWARD)))
        a1 *= part * part * part * (10.0 - 15.0 * part + 6.0 * part * part)
        f1, s1 = x + length, rx * np.sin(psi) - ry * np.cos(psi)
        d = h - h0
        while node < len(nodes) and nodes[node] <= h:
            w = 1.0 if first else (nodes[node] - h0) / d
            slow = (1 + 2 * w) * (1 - w) ** 2 * f0 + w * w * (3 - 2 * w) * f1
            phase = slow + d * w * (1 - w) * ((1 - w) * s0 - w * s1)
            u = ((1 - w) * a0 + w * a1) * np.exp(1j * k * phase)
            out[node, 0], out[node, 1] = u, 1j * k * ((1 - w) * s0 + w * s1) * u
            node += 1
        if first:
            step = min(0.1 * apart, most)
        else:
            at = there
            if d < 0.4 * apart:
                step = min(2 * step, most)
        h0, f0, a0, s0, first = h, f1, a1, s1, False
    for j in range(node, len(nodes)):
        out[j, 0], out[j, 1] = 0j, 0j
    return h0


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
