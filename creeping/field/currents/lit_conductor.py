"""Currents J = n x H of a plane wave on the lit side of a perfect conductor, uniform up to the shadow line.

At each point a lies along the tangential part of d, b = n x a, c = -n.d; e = E0.b and h = H0.b are the incident wave's
amplitudes, kappa_a, kappa_b and t the entries of the shape operator in (a, b), m, xi and r as in
`creeping.field.currents.lit`. All times e^{ikd.x}:

    optics    J_a = -2h [1 + i(kappa_b - kappa_a/c^2)/(2kc)] - 2i t e/(kc^2)
              J_b = 2ce [1 + i(kappa_a/c^2 - kappa_b)/(2kc)] + 2i t h/(kc)
    grazing   J_a = -h [u + T (B - g_q/2)/m^2] - e (t rho/m)(xi g + iF)
              J_b = e (i/m)[v + T (g/2 - i xi B)/m^2] + h (t rho/m^2) B,     T = (t rho)^2, times e^{i xi^3/3}
              B = (Dg - xi^2 g)/2 - i xi F

u and v are the scalar currents g + ... and F + ... of the polarisations "electric hard" and "electric soft". Optics is
the integral equation of the magnetic field iterated once, its integral taken over the osculating paraboloid. The terms
in t are those of the circular cylinder met obliquely, which is exact, and where T = r; those in r of the sphere. Both
pass into optics.

Sources: [CK13, sec. 6.2], [F46]; Derivations, F18.
"""

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.boundary import ELECTRIC_HARD, ELECTRIC_SOFT
from creeping.field.creeping_modes import fock_scale
from creeping.field.currents.lit import BOUND, LEAST_SCALE, OPTICS, STEEPEST, lit_currents
from creeping.field.shed_wave import limited, smoothstep
from creeping.field.special.fock import surface_function, surface_slope


def lit_conductor(
    cosine: FloatArray,
    along: FloatArray,
    across: FloatArray,
    twist: FloatArray,
    rate: FloatArray,
    bend: FloatArray,
    wavenumber: float,
    order: int = 2,
) -> ComplexArray:
    """Components J_a, J_b (rows) for unit amplitudes h, e (columns), over e^{ikd.x}, at points (n,): (n, 2, 2).

    Parameters
    ----------
    cosine, along, across, twist, rate, bend, wavenumber, order
        As of `creeping.field.currents.lit.lit_currents`.

    Examples
    --------
    >>> lit_conductor(np.array([1.0]), *np.zeros((5, 1)), 10.0)[0].round(12).tolist()    # 2 n x H on a plane
    [[(-2-0j), 0j], [0j, (2+0j)]]
    """
    out = np.zeros((len(cosine), 2, 2), dtype=complex)
    out[:, 0, 0] = -lit_currents(cosine, along, across, twist, rate, bend, wavenumber, ELECTRIC_HARD, order)
    out[:, 1, 1] = (
        1j / wavenumber * lit_currents(cosine, along, across, twist, rate, bend, wavenumber, ELECTRIC_SOFT, order)
    )
    if order == 2:
        m = fock_scale(wavenumber, along)
        xi = -m * cosine
        graze = np.where((along > 0) & (xi > -OPTICS[1]), 1 - smoothstep(-xi, *OPTICS), 0.0)
        near, far = np.flatnonzero(graze > 0), np.flatnonzero(graze < 1)
        turn = np.clip(twist[near] / along[near], -STEEPEST, STEEPEST)
        out[near] += graze[near, None, None] * _grazing(xi[near], turn, np.maximum(m[near], LEAST_SCALE))
        c = np.maximum(cosine[far], 1e-9)
        coupled = limited(np.asarray(2j * twist[far] / (wavenumber * c), dtype=complex), BOUND * 2 * c)
        out[far, 0, 1] -= (1 - graze[far]) * coupled / c
        out[far, 1, 0] += (1 - graze[far]) * coupled
    return out


def _grazing(xi: FloatArray, turn: FloatArray, m: FloatArray) -> ComplexArray:
    """Terms in t rho (n,) near the shadow line: (n, 2, 2)."""
    g, one, F = surface_function(xi, 0.0), surface_function(xi, 0.0, 1), surface_function(xi, None)
    B = 0.5 * (one - xi**2 * g) - 1j * xi * F
    T, wave = turn**2, np.exp(1j * xi**3 / 3)
    parts = (
        (0, 0, -T / m**2 * (B - surface_slope(xi, 0.0) / 2), g),
        (0, 1, -turn / m * (xi * g + 1j * F), g),
        (1, 0, turn / m**2 * B, F / m),
        (1, 1, 1j / m * T / m**2 * (0.5 * g - 1j * xi * B), F / m),
    )
    out = np.empty((len(xi), 2, 2), dtype=complex)
    for row, column, term, leading in parts:
        out[:, row, column] = wave * limited(np.asarray(term), BOUND * np.abs(leading))
    return out
