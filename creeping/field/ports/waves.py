"""The wave of each geodesic between two ports on a hard body.

    u = e^{iks - iπN/2} (κ1 κ2)^(1/6) [V + second order]/(2π √(A |J2|)),   A = ∫ κₙ^(2/3) ds,   ξ = (k/2)^(1/3) A

for a source of e^{ikr}/(4πr) in free space; with constant curvature the factor is 1/(2π √(s |J2|)). Second order:

    under the integral of V     i E t² + L t + i P/ξ,   and -(H/ξ) R² for R
    in modes                    exp{i (E τ² - H/τ)} [1 + L τ + (H/ξ)/τ² + i P/ξ]
    E = (2/k)^(1/3) ∫ κₙ^(4/3) [1/60 - (2/45) B - ρ² (g²/4 - (2/3) g T + (2/5) T²)] ds
    H = (2/k)^(1/3) ∫ κₙ^(4/3) [1/10 + r/4 - B/60 - (3/20) ρ² T²] ds
    L = (2/ks) (k/2)^(1/3) ∫ κₙ^(2/3) [r/3 - 1/12 - (5/18) ρ² T²] ds - [(1 + ρ² T²)/10 + B/15]/(m1 m2)
    P = (3/4) E/ξ - L/2,   which keeps V(0) = 1

In modes the decay has one order more, that of sphere and cylinder, ν = ka + mτ + c/m + d/m³ with h = H m1 m2/ξ,

    d = -τ³/1400 + 1/100 + h/10 - h²/(2τ³),   the exponent i ξ d/(m1 m2)²

B = ρρ'' - (2/3) ρ'², T = p.Hb/|∇F|, the last bracket the mean of both ends. And V times -(i/8k) (J2'/J2 - 1/s), the
mean of both ends, the next term of the transport along the body.

Sources: [PW81] for leading order; Derivations, F25.
"""

from collections.abc import Callable

import numpy as np

from creeping._typing import ComplexArray, FloatArray, IntArray
from creeping.field.creeping_modes import fock_scale
from creeping.field.special.airy import MODES, coupling_function, hard_modes
from creeping.field.waves.shed_wave import SECOND_ORDER, limited, smoothstep
from creeping.rays.port_rays import PortRays

LIMIT = 0.5
"""Bound of what second order adds at small ξ, and along the body, as a share of the wave."""
DEEP, FEW = 2.5, 4
"""ξ beyond which so few modes do, to 1e-6."""


def second_order(
    xi: FloatArray,
    plain: ComplexArray,
    early: Callable[[IntArray, ComplexArray], ComplexArray],
    late: Callable[[IntArray, int], ComplexArray],
) -> ComplexArray:
    """What second order adds (m,) to ``plain``: early under the integral at small ξ, late by so many modes beyond.

    ``early(rows, plain)`` and ``late(rows, count)`` are asked for the rows that each serves, and blended.
    """
    weight = smoothstep(xi, *SECOND_ORDER)
    before, beyond = np.flatnonzero(weight < 1), np.flatnonzero(weight > 0)
    change = np.zeros_like(plain)
    change[before] = (1 - weight[before]) * early(before, plain[before])
    for some, count in ((beyond[xi[beyond] <= DEEP], MODES), (beyond[xi[beyond] > DEEP], FEW)):
        change[some] += weight[some] * late(some, count)
    return change


class PathTerms:
    """What the wave of geodesics (m,) depends on, at one wavenumber, beside their length and spreading.

    Parameters
    ----------
    wavenumber : float, 1/L
    arclength : (m,), L
    curvature, torsion, bend : (m, 2), 1/L, 1/L and 1
        Of both ends, as of `creeping.rays.port_rays.PortRays`.
    integrals : (m, 4), or more
        The first four of them.
    """

    def __init__(
        self,
        wavenumber: float,
        arclength: FloatArray,
        curvature: FloatArray,
        torsion: FloatArray,
        bend: FloatArray,
        integrals: FloatArray,
    ) -> None:
        root = np.cbrt(wavenumber / 2)
        m1, m2 = (fock_scale(wavenumber, curvature[:, end]) for end in range(2))
        self.xi = root * integrals[:, 0]
        self.square = m1 * m2
        with np.errstate(divide="ignore", invalid="ignore"):
            leaning = (torsion / curvature) ** 2
            ends = np.mean(0.1 * (1 + leaning) + bend / 15, axis=1) / self.square
            self.E, self.H = integrals[:, 1] / root, integrals[:, 2] / root
            self.L = 2 * root * integrals[:, 3] / (wavenumber * arclength) - ends
            self.P = 0.75 * self.E / self.xi - 0.5 * self.L
        self.factor = np.cbrt(np.sqrt(np.prod(np.maximum(curvature, 0.0), axis=1)))
        self.factor = self.factor / (2 * np.pi * np.sqrt(integrals[:, 0]))

    def wave(self, order: int) -> ComplexArray:
        """Factor times [V + second order] (m,), 1/L^(1/2)."""
        plain = coupling_function(self.xi)
        if order == 1:
            return np.asarray(self.factor * plain)
        return np.asarray(self.factor * (plain + second_order(self.xi, plain, self._early, self._late)))

    def _early(self, some: IntArray, plain: ComplexArray) -> ComplexArray:
        """What second order adds, under the integral."""
        xi, E, H, L, P = (values[some] for values in (self.xi, self.E, self.H, self.L, self.P))
        total = 1j * E * coupling_function(xi, 2) + L * coupling_function(xi, 1) + 1j * P / xi * plain
        return limited(total - H / xi * coupling_function(xi, squared=True), LIMIT * np.abs(plain))

    def _late(self, some: IntArray, count: int) -> ComplexArray:
        """What second order adds, by so many modes."""
        tau = hard_modes(count).tau
        plain = np.exp(1j * self.xi[some, None] * tau) / tau
        decayed, bracket = self.modes_of_second_order(some, count)
        total = np.sum(decayed * bracket - plain, axis=-1)
        return np.asarray(np.exp(0.25j * np.pi) * np.sqrt(np.pi * self.xi[some]) * total)

    def modes_of_second_order(self, some: IntArray, count: int) -> tuple[ComplexArray, ComplexArray]:
        """So many modes e^{iξτ + ...}/τ, and their brackets: (m, count), (m, count)."""
        tau = hard_modes(count).tau
        xi, E, H, L, P = (values[some, None] for values in (self.xi, self.E, self.H, self.L, self.P))
        leading = 1j * xi * tau
        small = 1 / self.square[some, None]
        h = H / xi / small
        third = xi * small**2 * (0.01 + h / 10 - tau**3 / 1400 - h**2 / (2 * tau**3))
        exponent = limited(1j * (E * tau**2 - H / tau + third), 0.5 * np.abs(leading))
        bracket = limited(L * tau + H / xi / tau**2 + 1j * P / xi, 2.0)
        return np.exp(leading + exponent) / tau, 1 + bracket


def path_terms(rays: PortRays, wavenumber: float) -> PathTerms:
    """Of all geodesics (m,)."""
    return PathTerms(wavenumber, rays.arclength, rays.curvature, rays.torsion, rays.bend, rays.integrals)


def port_waves(rays: PortRays, terms: PathTerms, wavenumber: float, order: int) -> ComplexArray:
    """Wave of each geodesic (m,), 1/L; infinite on its caustic."""
    s = rays.arclength
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        wave = terms.wave(order) / np.sqrt(np.abs(rays.spreading))
        phase = wavenumber * s - 0.5 * np.pi * rays.caustics
        if order == 2:
            across = -0.125j / wavenumber * (np.mean(rays.rates, axis=1) / rays.spreading - 1 / s)
            wave = wave * (1 + limited(across, LIMIT))
    return np.asarray(wave * np.exp(1j * phase))
