"""Compiled geometrical optics of the reflected wave on the line normal to a ray's start.

The reflected ray from a place s' before the start s_a, r = d - 2 (d.n) n, meets the line at a height n and a length l:

    x(s') + l r = x(s_a) + n n(s_a),   c = -d.n(s'),   rho_1 = c/(2 kappa),   rho_2 = 1/(2 kappa_t c)
    u = R sqrt(rho_1/(rho_1 + l)) sqrt(rho_2/(rho_2 + l)) e^{ik (d.x(s') + l)},   u_n = ik (r.n(s_a)) u
    R = -1 soft, 1 hard, (c - eta)/(c + eta) for an impedance

Places s' go back from s_a by steps whose heights are an element apart: towards rays that leave the line they run away
fast. The phase between them is Hermite's cubic, its slope r.n being known; the amplitude is linear, for it jumps where
the curvature does. Above the last ray that meets the line there is nothing.

Sources: [KLS56]; Derivations, F22.
"""

import numpy as np
from numba import njit

from creeping.field.kernels.ray_profile import angle, displacement, interval, value
from creeping.kernels.block import strict_options

LEAST_COSINE = 1e-3
"""Of incidence."""
LEAST_FORWARD, FORWARD = 0.02, 0.2
"""Reflected rays whose share along the start's tangent is between these are faded out: they rise too steeply for a wave
that is marched, and a wave that ended at a height would radiate from there."""
FIRST, LARGEST, LEAST = 0.1, 0.05, 1e-6
"""Steps back: the first in terms of the spacing of heights, the largest and the least of the way back."""


@njit(**strict_options)
def reflected(k, soft, s, cubics, curve, transverse, eta, start, stop, nodes, out):
    """Fill out (nodes, 2) with u and u_n on the line above ``start``; returns the height up to which rays meet it.

    cubics and curve are those of `ray_profile`, transverse and eta the cubics of kappa_t and of the admittance; rays
    come from places between ``stop`` and ``start``.
    """
    apart = nodes[-1] - nodes[-2]
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
        meets = c > LEAST_COSINE and forward > LEAST_FORWARD and length >= 0.0 and (first or h > h0)
        if not first and (not meets or h - h0 > apart):
            # towards the last ray that meets the line, or to the next height
            step *= 0.5
            if step < LEAST * (start - stop):
                break
            continue
        if not meets:
            break
        tube = 1.0 / (1.0 + length * max(2.0 * value(cubics[i], t), 0.0) / c)
        tube /= max(1.0 + 2.0 * length * value(transverse[i], t) * c, 0.05)
        local = value(eta[i], t)
        a1 = (-1.0 + 0j if soft else (c - local) / (c + local)) * np.sqrt(tube)
        part = min(1.0, max(0.0, (forward - LEAST_FORWARD) / (FORWARD - LEAST_FORWARD)))
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
            step = min(FIRST * apart, LARGEST * (start - stop))
        else:
            at = there
            if d < 0.4 * apart:
                step = min(2 * step, LARGEST * (start - stop))
        h0, f0, a0, s0, first = h, f1, a1, s1, False
    for j in range(node, len(nodes)):
        out[j, 0], out[j, 1] = 0j, 0j
    return h0
