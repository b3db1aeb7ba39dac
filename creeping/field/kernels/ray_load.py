"""Compiled loading of a ray into a lane of a block: its steps, its boundary data and the waves at its heights.

    at mid step   kappa_n, kappa_t, beta = ik eta + (kappa_n - kappa_t)/2
    incident      y = sqrt(J h_t) e^{ik(d.x - s + q n)},   y_n = (ikq + kappa_t/(2 h_t)) y,   h_t = 1 + kappa_t m(n)
    reflected     y = u sqrt(J h_t) e^{-iks}, by optics, faded out in the absorber

Sources: [KLS56]; Derivations, F22.
"""

import numpy as np
from numba import njit

from creeping.field.kernels.plane_wave import drive
from creeping.field.kernels.ray_profile import angle, displacement, interval, value
from creeping.field.kernels.reflected_wave import reflected
from creeping.kernels.block import strict_options
from creeping.kernels.vectors import LANES

LEAST_SPREADING, LEAST_TUBE = 0.05, 0.2
"""J and h_t below which the incident wave's tube is held: behind the line rays may cross."""


@njit(**strict_options)
def load_steps(
    k, soft, lane, s, kappa, transverse, spreading, eta, curve, edges, driven, b, c, steps, poles, weights, g, beta, lit
):
    """Fill a lane of a block with a ray's steps, the last of them repeated to the block's end.

    kappa, transverse, spreading and eta are cubics between the nodes s, curve the ray's plane curve; b and c (n, p) are
    those of its n steps between ``edges``. steps (2, steps, LANES) gets kappa_n and kappa_t; lit (driven + 1, 4) gets
    psi, d.x - s, kappa_t and J at the edges of driven steps. Returns the largest misfit of the traces.
    """
    n = len(edges) - 1
    p = b.shape[1]
    mid, local = np.empty((n, 2)), np.empty(n, np.complex128)
    for i in range(n):
        at = 0.5 * (edges[i] + edges[i + 1])
        j = interval(s, at)
        t = at - s[j]
        mid[i, 0], mid[i, 1], local[i] = value(kappa[j], t), value(transverse[j], t), value(eta[j], t)
    for i in range(poles.shape[0]):
        at = min(i, n - 1)
        steps[0, i, lane], steps[1, i, lane] = mid[at, 0], mid[at, 1]
        slope = 1j * k * local[at] + 0.5 * (mid[at, 0] - mid[at, 1])
        beta[i, lane], beta[i, LANES + lane] = slope.real, slope.imag
        for j in range(p):
            poles[i, j, lane], poles[i, j, LANES + lane] = b[at, j].real, b[at, j].imag
            weights[i, j, lane], weights[i, j, LANES + lane] = c[at, j].real, c[at, j].imag
    for i in range(driven + 1):
        j = interval(s, edges[i])
        t = edges[i] - s[j]
        lit[i, 0] = angle(kappa[j], curve[j, 0], t)
        lit[i, 1] = curve[j, 1] + displacement(kappa[j], curve[j, 0], t)[0] - edges[i]
        lit[i, 2] = value(transverse[j], t)
        lit[i, 3] = max(value(spreading[j], t), LEAST_SPREADING)
    misfit = np.zeros(max(driven, 1))
    drive(k, soft, driven, mid, lit, local, b, c, lane, g, misfit)
    return np.max(misfit)


@njit(**strict_options)
def load_waves(
    k,
    soft,
    lane,
    s,
    kappa,
    transverse,
    eta,
    curve,
    start,
    stop,
    lit,
    nodes,
    heights,
    rates,
    fade,
    scale,
    wave,
    incident,
):
    """Fill a lane with the reflected wave at the start and the incident one at the end of the driven steps.

    fade (nodes, 2) is what the reflected wave is multiplied with, and its slope; wave and incident (2 nodes, 2 LANES)
    get values and slopes, slopes times ``scale``.
    """
    u = np.empty((len(nodes), 2), np.complex128)
    reflected(k, soft, s, kappa, curve, transverse, eta, start, stop, nodes, u)
    last = len(lit) - 1
    q = np.sin(lit[last, 0])
    first = np.sqrt(lit[0, 3]) * np.exp(-1j * k * start)
    for j in range(len(nodes)):
        tube = max(1.0 + lit[0, 2] * heights[j], LEAST_TUBE)
        widening = 0.5 * lit[0, 2] * rates[j] / tube
        y = u[j, 0] * fade[j, 0] * first * np.sqrt(tube)
        slope = (u[j, 1] * fade[j, 0] + u[j, 0] * (fade[j, 1] + widening * fade[j, 0])) * first * np.sqrt(tube)
        slope *= scale
        wave[2 * j, lane], wave[2 * j, LANES + lane] = y.real, y.imag
        wave[2 * j + 1, lane], wave[2 * j + 1, LANES + lane] = slope.real, slope.imag
        tube = max(1.0 + lit[last, 2] * heights[j], LEAST_TUBE)
        y = np.sqrt(lit[last, 3] * tube) * np.exp(1j * k * (lit[last, 1] + nodes[j] * q))
        slope = scale * (1j * k * q + 0.5 * lit[last, 2] * rates[j] / tube) * y
        incident[2 * j, lane], incident[2 * j, LANES + lane] = y.real, y.imag
        incident[2 * j + 1, lane], incident[2 * j + 1, LANES + lane] = slope.real, slope.imag
