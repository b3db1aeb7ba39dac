"""Compiled loading of a ray into a lane of a block: its steps, its boundary data and the waves at its heights.

    at mid step   kappa_n,   e = tau Lambda,   kappa_a = kappa_t - e,   c0 = [(kappa_n + e - kappa_a)^2/4 + V]/k^2,
                  a = tau (4 kappa_n Lambda - 3 tau),   beta = ik eta + (kappa_n + e - kappa_a)/2,   b_j (1 + Lambda^2)
    incident      y = sqrt(J h_a) e^{ik(d.x - s + q n)},   y_n = (ikq + kappa_a/(2 h_a)) y,   h_a = 1 + kappa_a m(n)
    reflected     y = u sqrt(J h_a) e^{-iks}, by optics, faded out in the absorber

The reflected wave is that of the plane across the line, where wavenumber and lengths along the ray are shorter by
cos = 1/sqrt(1 + Lambda^2); on the plane curve of the profile, as long as the ray, heights are longer by 1/cos.

Sources: [KLS56]; Derivations, F22.
"""

import numpy as np
from numba import njit

from creeping.field.kernels.plane_wave import drive
from creeping.field.kernels.ray_profile import displacement, interval, value
from creeping.field.kernels.reflected_wave import reflected
from creeping.kernels.block import strict_options
from creeping.kernels.vectors import LANES

LEAST_SPREADING, LEAST_TUBE = 0.05, 0.2
"""J and h_a below which the incident wave's tube is held: behind the line rays may cross."""


@njit(**strict_options)
def load_steps(
    k,
    soft,
    lane,
    s,
    kappa,
    across,
    spreading,
    torsion,
    lean,
    potential,
    eta,
    phase,
    climb,
    edges,
    driven,
    b,
    c,
    steps,
    poles,
    weights,
    g,
    beta,
    lit,
):
    """Fill a lane of a block with a ray's steps, the last of them repeated to the block's end.

    kappa to climb are cubics between the nodes s; b and c (n, p) are those of its n steps between ``edges``.
    steps (steps, 4, LANES) gets kappa_n, e, c0 and a; lit (driven + 1, 4) gets q = d.n, d.x - s, kappa_a and J at the
    edges of driven steps. Returns the largest misfit of the traces.
    """
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
        lit[i, 3] = max(value(spreading[j], t), LEAST_SPREADING)
    misfit = np.zeros(max(driven, 1))
    drive(k, soft, driven, mid, lit, local, oblique, c, lane, g, misfit)
    return np.max(misfit)


@njit(**strict_options)
def load_waves(
    k,
    soft,
    lane,
    s,
    bend,
    curve,
    across,
    lean,
    eta,
    start,
    stop,
    lit,
    nodes,
    levels,
    fade,
    scale,
    wave,
    incident,
):
    """Fill a lane with the reflected wave at the start and the incident one at the end of the driven steps.

    bend and curve are those of the profile's plane curve; levels (4, nodes) hold m and m' in the first two rows; fade
    (nodes, 2) is what the reflected wave is multiplied with, and its slope; wave and incident (2 nodes, 2 LANES) get
    values and slopes, slopes times ``scale``.
    """
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
        tube = max(1.0 + lit[0, 2] * height, LEAST_TUBE)
        widening = 0.5 * lit[0, 2] * rate / tube
        y = u[j, 0] * fade[j, 0] * first * np.sqrt(tube)
        slope = u[j, 1] / cosine * fade[j, 0] + u[j, 0] * (fade[j, 1] + widening * fade[j, 0])
        slope *= first * np.sqrt(tube) * scale
        wave[2 * j, lane], wave[2 * j, LANES + lane] = y.real, y.imag
        wave[2 * j + 1, lane], wave[2 * j + 1, LANES + lane] = slope.real, slope.imag
        tube = max(1.0 + lit[last, 2] * height, LEAST_TUBE)
        y = np.sqrt(lit[last, 3] * tube) * np.exp(1j * k * (lit[last, 1] + nodes[j] * q))
        slope = scale * (1j * k * q + 0.5 * lit[last, 2] * rate / tube) * y
        incident[2 * j, lane], incident[2 * j, LANES + lane] = y.real, y.imag
        incident[2 * j + 1, lane], incident[2 * j + 1, LANES + lane] = slope.real, slope.imag
