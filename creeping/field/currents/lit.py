"""Currents of a plane wave on the lit side, uniform up to and a little beyond the shadow line.

With c = -n.d, kappa_a and kappa_b the normal curvatures along and across the plane of incidence, rho' the rate of
rho = 1/kappa_a along it, t the entry of the shape operator between both directions, m = (k rho/2)^(1/3), xi = -m c,
r = kappa_b/kappa_a, T = (t rho)^2 and an admittance eta (0 hard), all times e^{ikd.x}:

    optics    u = 2c/(c + eta) + [R (kappa_a/c^2 + e kappa_b) - kappa_a (1 - c^2) R'/c]/(ik(c + eta))
              - 2 d.grad eta/(ik (c + eta)^3),   R = (c - eta)/(c + eta), R' = 2 eta/(c + eta)^2
              soft  du/dn = -2ikc [1 + i (kappa_a/c^2 + e kappa_b)/(2kc)]
    Fock      u = e^{i xi^3/3} [g + (rho'/m) E + D/m^2 + G],   soft  du/dn = (k/m) times the same with F in place of g
              E = -i (xi^4/12) g - i (xi^2/6) Dg - (xi/6) g - (i/12) D^2 g - (q/6)[xi g_q + i g + i q g_q]
              D = i (3/20) xi^5 g + i (xi^3/6) Dg + i (xi/60) D^2 g - Dg/30 - g_q/10 - (2/15) q (Dg)_q
                  + (r/4)(xi^2 g + Dg - e g_q)
                  + rho rho'' [i (xi^5/60) g + i (xi^3/18) Dg + (xi^2/12) g + i (7 xi/180) D^2 g + Dg/180 + g_q/60]
                  + rho'^2 [(-xi^8/288 + i (11/360) xi^5 + xi^2/72) g + (-xi^6/72 + i (5/108) xi^3) Dg
                            + (-xi^4/48 + i (17/1080) xi) D^2 g - (xi^2/72) D^3 g - D^4 g/288 + (13/540) Dg - g_q/90]
                  + T [-i (xi^5/20) g + i (xi^3/18) Dg - (xi^2/12) g + i (19 xi/180) D^2 g - (53/180) Dg + (7/60) g_q]
              G = rho (d.grad eta) [g + 2 q g_q + (q^2 g_qq - D g_qq)/2]
              soft  Dg times 1/10, -1/60, 7/180 and -7/60 for -1/30, 1/180, 13/540 and -53/180, xi^2 g/4 in T, nothing
                    that has g_q; of a conductor - (r/2) g(xi; 0)

e is 1, of a conductor's polarisations -1 (`creeping.field.currents.lit`). g(xi; q) is Fock's function, D^n g
it with t^n under its integral, g_q = dg/dq. Optics is the series of Luneburg and Kline on the boundary: with psi the
reflected eikonal, Lap psi = 2 kappa_a/c + 2 c kappa_b there. Fock's current is that of the shadow
(`creeping.field.waves.surface`) with the arclength behind the line replaced by c, and its |J|^(-1/2) by 1 + r
xi^2/(4m^2). E and D must then fall off towards the light, where D/m^2 becomes the term of optics in kappa_b, which
gives the factors of Dg and g_q that the shadow leaves open; the term in T is what the circular cylinder asks for, met
obliquely. G is what the layer under an admittance that varies remembers of what it has passed. So it holds wherever
kappa_a > 0; optics alone stands elsewhere. Of an impedance the terms in rho'', rho'^2 and T are left out.

Also here: currents J = n x H of a plane wave on the lit side of a perfect conductor, uniform up to the shadow line.

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

Sources: [KLS56], [F46]; [CK13, sec. 6.2], [F46]; Derivations, F16 and F18.
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import BoolArray, ComplexArray, FloatArray, IntArray
from creeping.field.boundary import ELECTRIC_HARD, ELECTRIC_SOFT, Boundary, fock_scale
from creeping.field.fock import surface_function, surface_slope
from creeping.field.waves.reflected import plane_reflection
from creeping.field.waves.shed_wave import limited, smoothstep

OPTICS = (4.0, 8.0)
"""-xi over which Fock's current gives way to optics."""
BOUND = 0.5
"""Bound of the second order, as a share of the first: beyond a third of it the expansion fails."""
LEAST_SCALE = 0.7
"""m below which nothing is expanded in 1/m^2."""
STEEPEST = 20.0
"""Bound of |kappa_b/kappa_a| in the second order."""


class Ground(NamedTuple):
    """What currents of the lit side depend on at points (n,).

    Attributes
    ----------
    cosine : (n,)
        c = -n.d, to a little below 0.
    along, across, twist : (n,), 1/L
        Normal curvatures kappa_a and kappa_b, and the entry t of the shape operator between both directions.
    rate, bend : (n,)
        rho' and rho rho'', without unit; read where kappa_a > 0.
    """

    cosine: FloatArray
    along: FloatArray
    across: FloatArray
    twist: FloatArray
    rate: FloatArray
    bend: FloatArray

    def part(self, at: BoolArray | IntArray) -> "Ground":
        """Some of the points."""
        return Ground(*(values[at] for values in self))


def lit_currents(ground: Ground, wavenumber: float, boundary: Boundary, order: int = 2) -> ComplexArray:
    """Field u of the boundary, or du/dn (1/L) where u = 0, over e^{ikd.x}, at points of the lit side (n,).

    Parameters
    ----------
    ground : Ground
    wavenumber : float, 1/L
    boundary : Boundary
    order : 2 or 1

    Examples
    --------
    >>> from creeping.field.boundary import HARD
    >>> lit_currents(Ground(np.array([1.0]), *np.zeros((5, 1))), 10.0, HARD)     # twice the wave on a plane
    array([2.+0.j])
    """
    curved = (ground.along > 0) & (-fock_scale(wavenumber, ground.along) * ground.cosine > -OPTICS[1])
    out = np.empty(ground.cosine.shape, dtype=complex)
    for some, currents in ((~curved, _optics), (curved, _near_grazing)):
        out[some] = currents(ground.part(some), wavenumber, boundary.part(some), order)
    return out


def _optics(ground: Ground, k: float, boundary: Boundary, order: int) -> ComplexArray:
    along, across, c = ground.along, ground.across, np.maximum(ground.cosine, 1e-9)
    if boundary.kind.endswith("soft"):
        second = np.asarray(1j * (along / c**2 + boundary.sign * across) / (2 * k * c), dtype=complex)
        return np.asarray(-2j * k * c * (1 + (order == 2) * limited(second, BOUND)))
    eta = boundary.admittance
    R, slope = plane_reflection(c, boundary), 2 * eta / (c + eta) ** 2
    second = (R * (along / c**2 + boundary.sign * across) - along * (1 - c * c) * slope / c) / (2j * k * c)
    second = second + 1j * boundary.drift / (k * c * (c + eta) ** 2)
    return np.asarray(2 * c / (c + eta) * (1 + (order == 2) * limited(second, BOUND)))


def _near_grazing(at: Ground, wavenumber: float, boundary: Boundary, order: int) -> ComplexArray:
    """Fock's current, of second order at grazing, passing into optics: (n,)."""
    m = fock_scale(wavenumber, at.along)
    xi = -m * at.cosine
    q = boundary.q(m)
    scale = (wavenumber / m) * np.exp(1j * xi**3 / 3) if q is None else np.exp(1j * xi**3 / 3)
    g = surface_function(xi, q)
    out = g
    if order == 2:
        out = g + limited(_corrections(at, m, xi, q, g, boundary), BOUND * np.abs(g))
    out = out * scale
    far = smoothstep(-xi, *OPTICS)
    beyond = far > 0
    ray = _optics(at.part(beyond), wavenumber, boundary.part(beyond), order)
    out[beyond] = (1 - far[beyond]) * out[beyond] + far[beyond] * ray
    return np.asarray(out)


def _corrections(
    at: Ground, m: FloatArray, xi: FloatArray, q: ComplexArray | float | None, g: ComplexArray, boundary: Boundary
) -> ComplexArray:
    """(rho'/m) E + D/m^2 (n,)."""
    rate, bend, m = at.rate, at.bend, np.maximum(m, LEAST_SCALE)
    r = np.clip(at.across / at.along, -STEEPEST, STEEPEST)
    T = np.minimum((at.twist / at.along) ** 2, STEEPEST)
    soft, constant = q is None, not isinstance(q, np.ndarray)
    one, two = (surface_function(xi, q, n) for n in (1, 2))
    varying = -1j * (xi**4 / 12 * g + xi**2 / 6 * one + two / 12) - xi / 6 * g
    curved = 0.15j * xi**5 * g + (1j * xi**3 / 6 + (1 / 10 if soft else -1 / 30)) * one + 1j * xi / 60 * two
    curved = curved + r / 4 * (xi**2 * g + one)
    if constant:
        three, four = (surface_function(xi, q, n) for n in (3, 4))
        curved = curved + bend * (
            (1j / 60 * xi**5 + xi**2 / 12) * g
            + (1j / 18 * xi**3 + (-1 / 60 if soft else 1 / 180)) * one
            + 7j / 180 * xi * two
        )
        curved = curved + rate**2 * (
            (-(xi**8) / 288 + 11j / 360 * xi**5 + xi**2 / 72) * g
            + (-(xi**6) / 72 + 5j / 108 * xi**3 + (7 / 180 if soft else 13 / 540)) * one
            + (-(xi**4) / 48 + 17j / 1080 * xi) * two
            - xi**2 / 72 * three
            - four / 288
        )
        curved = curved + T * (
            (-1j / 20 * xi**5 + xi**2 * (1 / 4 if soft else -1 / 12)) * g
            + (1j / 18 * xi**3 - (7 / 60 if soft else 53 / 180)) * one
            + 19j / 180 * xi * two
        )
    if boundary.kind == "electric soft":
        # the wave of the other polarisation, whose amplitude varies across the rays
        curved = curved - r / 2 * surface_function(xi, 0.0)
    if q is not None:
        slope = surface_slope(xi, q)
        varying = varying - q / 6 * (xi * slope + 1j * (g + q * slope))
        varies = bend / 60 - rate**2 / 90 + 7 / 60 * T if constant else 0.0
        curved = curved + (varies - 0.1 - 0.25 * boundary.sign * r) * slope
        if not constant:
            curved = curved - 2 / 15 * q * surface_slope(xi, q, 1)
    change = np.asarray(rate / m * varying + curved / m**2)
    if q is not None and np.any(boundary.drift):
        # G, differenced over a thousandth of q to either side
        pairs = [[surface_slope(xi, q * (1 + step), n) for step in (1e-3, -1e-3)] for n in (0, 1)]
        bent, turned = ((ahead - behind) / (2e-3 * q) for ahead, behind in pairs)
        change = change + boundary.drift / at.along * (g + 2 * q * slope + (q**2 * bent - turned) / 2)
    return np.asarray(change)


def lit_conductor(ground: Ground, wavenumber: float, order: int = 2) -> ComplexArray:
    """Components J_a, J_b (rows) for unit amplitudes h, e (columns), over e^{ikd.x}, at points (n,): (n, 2, 2).

    Parameters
    ----------
    ground, wavenumber, order
        As of `creeping.field.currents.lit.lit_currents`.

    Examples
    --------
    >>> lit_conductor(Ground(np.array([1.0]), *np.zeros((5, 1))), 10.0)[0].round(12).tolist()    # 2 n x H on a plane
    [[(-2-0j), 0j], [0j, (2+0j)]]
    """
    cosine, along, twist = ground.cosine, ground.along, ground.twist
    out = np.zeros((len(cosine), 2, 2), dtype=complex)
    out[:, 0, 0] = -lit_currents(ground, wavenumber, ELECTRIC_HARD, order)
    out[:, 1, 1] = 1j / wavenumber * lit_currents(ground, wavenumber, ELECTRIC_SOFT, order)
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
