"""V and U of each geodesic between two ports, to second order: what hard and soft waves on it lose.

    w = (κ1 κ2)^(1/6)/(2π √(A |J2|)) e^{iks - iπN/2},   A = ∫ κₙ^(2/3) ds,   ξ = (k/2)^(1/3) A,   M = m1 m2

is the wave of a source of e^{ikr}/(4πr) in free space, without its V; with constant curvature it is 1/(2π √(s |J2|)).

V, second order:
    under the integral of V     i E t² + L t + i P/ξ,   and -(H/ξ) R² for R
    in modes                    exp{i (E τ² - H/τ)} [1 + L τ + (H/ξ)/τ² + i P/ξ]
    E = (2/k)^(1/3) ∫ κₙ^(4/3) [1/60 - (2/45) B - ρ² (g²/4 - (2/3) g T + (2/5) T²)] ds
    H = (2/k)^(1/3) ∫ κₙ^(4/3) [1/10 + r/4 - B/60 - (3/20) ρ² T²] ds
    L = (2/ks) (k/2)^(1/3) ∫ κₙ^(2/3) [r/3 - 1/12 - (5/18) ρ² T²] ds - [(1 + ρ² T²)/10 + B/15]/M
    P = (3/4) E/ξ - L/2,   which keeps V(0) = 1

In modes the decay has one order more, that of sphere and cylinder, ν = ka + mτ + c/m + d/m³ with h = H M/ξ,

    d = -τ³/1400 + 1/100 + h/10 - h²/(2τ³),   the exponent i ξ d/M²

On a conductor (``electric``) H is less by (1/2) (2/k)^(1/3) ∫ κₙ^(-2/3) K ds, K the Gaussian curvature.

U, of soft waves, second order, under its integral and in its modes:
    i E t² + L t + i P/ξ,          exp{i E τ²} [1 + L τ + i P/ξ],       P = (15/4) E/ξ - (3/2) L
    L = the integral above + [(1 + ρ² T²)/6 - B/9]/M
and, third order, the exponent i ξ (-τ³/1400 - 1/140)/M².

B = ρρ'' - (2/3) ρ'², T = p.Hb/|∇F|, the last brackets of L the mean of both ends. And w times -(i/8k) (J2'/J2 - 1/s),
the mean of both ends, the next term of the transport along the body.

Sources: [PW81] for leading order; Derivations, F25 and F28.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from creeping._typing import ComplexArray, FloatArray, IntArray
from creeping.field.airy import (
    MODES,
    coupling_function,
    hard_modes,
    soft_coupling_function,
    soft_modes,
)
from creeping.field.boundary import fock_scale
from creeping.field.waves.shed_wave import SECOND_ORDER, limited, smoothstep
from creeping.rays.port_rays import PortRays

LIMIT = 0.5
"""Bound of what second order adds at small ξ, and along the body, as a share of the wave: a series at its end."""


class Path(NamedTuple):
    """What the waves of geodesics (m,) depend on beside their spreading, at one wavenumber.

    Attributes
    ----------
    wavenumber : float, 1/L
    arclength : (m,), L
    curvature, torsion, bend : (m, 2), 1/L, 1/L and 1
        Of both ends, as of `creeping.rays.port_rays.PortRays`.
    integrals : (m, 5)
    turning : (m, 2)
        0 for beams, whose sum brings it in.
    """

    wavenumber: float
    arclength: FloatArray
    curvature: FloatArray
    torsion: FloatArray
    bend: FloatArray
    integrals: FloatArray
    turning: FloatArray


def path_of(rays: PortRays, wavenumber: float) -> Path:
    """`Path` of all geodesics (m,)."""
    ends = rays.curvature, rays.torsion, rays.bend
    return Path(wavenumber, rays.arclength, *ends, rays.integrals, rays.turning)


def bare_waves(rays: PortRays, factor: FloatArray, k: float, order: int) -> ComplexArray:
    """Waves w (m,), 1/L, infinite on caustics, of their factors (κ1 κ2)^(1/6)/(2π √A)."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        phase: ComplexArray = np.exp(1j * (k * rays.arclength - 0.5 * np.pi * rays.caustics))
        w = factor * phase / np.sqrt(np.abs(rays.spreading))
        if order == 2:
            rate = np.mean(rays.rates, axis=1) / rays.spreading
            w = w * (1 + limited(-0.125j / k * (rate - 1 / rays.arclength), LIMIT))
    return w


def second_order(
    xi: FloatArray,
    plain: ComplexArray,
    early: Callable[[IntArray, ComplexArray], ComplexArray],
    late: Callable[[IntArray, int], ComplexArray],
) -> ComplexArray:
    """What second order adds (m,) to ``plain``: early under the integral at small ξ, late by modes beyond.

    ``early(rows, plain)`` and ``late(rows, count)`` are asked for the rows that each serves, and blended.
    """
    weight = smoothstep(xi, *SECOND_ORDER)
    before, beyond = np.flatnonzero(weight < 1), np.flatnonzero(weight > 0)
    change = np.zeros_like(plain)
    change[before] = (1 - weight[before]) * early(before, plain[before])
    # beyond ξ = 2.5 four modes do, to 1e-6: e^{-ξ Im τ} of the fifth, τ = 7.37 e^{iπ/3}, over the first's
    for some, count in ((beyond[xi[beyond] <= 2.5], MODES), (beyond[xi[beyond] > 2.5], 4)):
        change[some] += weight[some] * late(some, count)
    return change


class HardWave:
    """V of geodesics (m,), with its ξ, M, E, H, L and P."""

    def __init__(self, path: Path, *, electric: bool = False) -> None:
        k, integrals = path.wavenumber, path.integrals
        root = np.cbrt(k / 2)
        m1, m2 = (fock_scale(k, path.curvature[:, end]) for end in range(2))
        self.xi, self.M = root * integrals[:, 0], m1 * m2
        third = integrals[:, 2] - 0.5 * integrals[:, 4] if electric else integrals[:, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            leaning = (path.torsion / path.curvature) ** 2
            ends = np.mean(0.1 * (1 + leaning) + path.bend / 15, axis=1) / self.M
            self.E, self.H = integrals[:, 1] / root, third / root
            self.L = 2 * root * integrals[:, 3] / (k * path.arclength) - ends
            self.P = 0.75 * self.E / self.xi - 0.5 * self.L
        factor = np.cbrt(np.sqrt(np.prod(np.maximum(path.curvature, 0.0), axis=1)))
        self.factor = factor / (2 * np.pi * np.sqrt(integrals[:, 0]))

    def value(self, order: int) -> ComplexArray:
        """V and what second order adds (m,)."""
        plain = coupling_function(self.xi)
        return plain if order == 1 else plain + second_order(self.xi, plain, self._early, self._late)

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
        small = 1 / self.M[some, None]
        h = H / xi / small
        third = xi * small**2 * (0.01 + h / 10 - tau**3 / 1400 - h**2 / (2 * tau**3))
        exponent = limited(1j * (E * tau**2 - H / tau + third), 0.5 * np.abs(leading))
        bracket = limited(L * tau + H / xi / tau**2 + 1j * P / xi, 2.0)
        return np.exp(leading + exponent) / tau, 1 + bracket

    def charge(self, order: int, first: FloatArray, rest: float) -> ComplexArray:
        """What the factor p t/M + a t²/M², a = q + p E M/ξ, adds to V (m,); p is ``first`` and q ``rest``.

        Under the integral of V, with all that it has there,

            p [V_1 + iE V_3 + L V_2 + i(P/ξ) V_1 - iH V]/M + a V_2/M² + r V,
            r = (4q - 3a) (i/(2 ξ M))² - p (3 E/ξ - L)/(2 ξ² M)

        which for small ξ leaves p i/ks + 4q (i/ks)² of V, 2 ξ M = ks. In modes it is a factor g = 1 + p τ/M + a τ²/M²
        of [1 + L τ + (H/ξ)/τ² + iP/ξ], less (H/ξ) g'/τ, since R² has a double pole: t R² = 1 - R', so that under the
        integral it is iξ V.
        """
        V = coupling_function(self.xi)
        if order == 1:
            near = 0.5 / (self.xi * self.M)
            return np.asarray(first * coupling_function(self.xi, 1) / self.M - 4 * rest * near**2 * V)

        def early(some: IntArray, V: ComplexArray) -> ComplexArray:
            return self._early_charge(some, V, first[some], rest)

        def late(some: IntArray, count: int) -> ComplexArray:
            return self._late_charge(some, count, first[some, None], rest)

        return second_order(self.xi, V, early, late)

    def _early_charge(self, some: IntArray, V: ComplexArray, first: FloatArray, rest: float) -> ComplexArray:
        """Under the integral."""
        xi, M, E, H, L, P = (of[some] for of in (self.xi, self.M, self.E, self.H, self.L, self.P))
        V1, V2, V3 = (coupling_function(xi, power) for power in (1, 2, 3))
        a = rest + first * E * M / xi
        r = (3 * a - 4 * rest) * (0.5 / (xi * M)) ** 2 - first * (3 * E / xi - L) / (2 * xi**2 * M)
        turned = V1 + 1j * E * V3 + L * V2 + 1j * P / xi * V1 - 1j * H * V
        return np.asarray(first * turned / M + a * V2 / M**2 + r * V)

    def _late_charge(self, some: IntArray, count: int, first: FloatArray, rest: float) -> ComplexArray:
        """By so many modes."""
        xi, root, E = self.xi[some], np.sqrt(np.pi * self.xi[some]), self.E[some]
        tau, small = hard_modes(count).tau, 1 / self.M[some, None]
        a = rest * small**2 + first * (E / xi)[:, None] * small
        decayed, bracket = self.modes_of_second_order(some, count)
        twice = (self.H[some] / xi)[:, None] * (first * small + 2 * a * tau) / tau
        total = np.sum(decayed * (bracket * (first * small * tau + a * tau**2) - twice), axis=-1)
        return np.asarray(np.exp(0.25j * np.pi) * root * total)


class SoftWave:
    """U of geodesics (m,)."""

    def __init__(self, path: Path, hard: HardWave) -> None:
        root = np.cbrt(path.wavenumber / 2)
        self.xi, self.M, self.E = hard.xi, hard.M, hard.E
        with np.errstate(divide="ignore", invalid="ignore"):
            leaning = (path.torsion / path.curvature) ** 2
            ends = np.mean((1 + leaning) / 6 - path.bend / 9, axis=1) / self.M
            self.L = 2 * root * path.integrals[:, 3] / (path.wavenumber * path.arclength) + ends
            self.P = 3.75 * self.E / self.xi - 1.5 * self.L

    def value(self, order: int) -> ComplexArray:
        """U and what second order adds (m,)."""
        plain = soft_coupling_function(self.xi)
        return plain if order == 1 else plain + second_order(self.xi, plain, self._early, self._late)

    def _early(self, some: IntArray, plain: ComplexArray) -> ComplexArray:
        """What second order adds, under the integral."""
        xi, E, L, P = (values[some] for values in (self.xi, self.E, self.L, self.P))
        first, second = (soft_coupling_function(xi, power) for power in (1, 2))
        return limited(1j * E * second + L * first + 1j * P / xi * plain, LIMIT * np.abs(plain))

    def _late(self, some: IntArray, count: int) -> ComplexArray:
        """What second order adds, by so many modes."""
        tau = soft_modes(count).tau
        xi, E, L, P = (values[some, None] for values in (self.xi, self.E, self.L, self.P))
        leading = 1j * xi * tau
        third = -xi / self.M[some, None] ** 2 * (tau**3 / 1400 + 1 / 140)
        exponent = limited(1j * (E * tau**2 + third), 0.5 * np.abs(leading))
        bracket = limited(L * tau + 1j * P / xi, 2.0)
        total = np.sum(np.exp(leading) * (np.exp(exponent) * (1 + bracket) - 1), axis=-1)
        return np.asarray(2 * np.exp(-0.25j * np.pi) * np.sqrt(np.pi) * self.xi[some] ** 1.5 * total)
