"""The field of each geodesic between two monopoles on a conductor, E along n of an electric moment along n.

Per unit of the moment and times the admittance of free space, with the letters of `creeping.field.slot_waves`,

    E_n = ik w {V + (T0s² + T0r²) V_1/(2M) + [(ν² - 1/4)/(ka)²] - 1} + T0s T0r S0

V to second order, of "electric hard" waves: what a slot across the path gives along b, H_b, and the charge at the foot,
E_n = (i/k) (curl H)_n. The bracket stands under the integral of V, with all that it has there,

    p t/M + a t²/M²,   a = q + p E M/ξ,   p = 1, q = 1/4,
    p [V_1 + iE V_3 + L V_2 + i(P/ξ) V_1 - iH V]/M + a V_2/M² + r V,
    r = (4q - 3a) (i/(2 ξ M))² - p (3 E/ξ - L)/(2 ξ² M),   which leaves 1 + i/ks + (i/ks)² on a plane, 2 ξ M = ks

and in modes as a factor g = 1 + p τ/M + a τ²/M² of [1 + L τ + (H/ξ)/τ² + iP/ξ], less (H/ξ) g'/τ, since R² has a double
pole: t R² = 1 - R', so that under the integral it is iξ V.

Sources: [PW81] for leading order; Derivations, F33.
"""

import numpy as np

from creeping._typing import ComplexArray, FloatArray, IntArray
from creeping.field.port_waves import second_order
from creeping.field.slot_waves import SlotTerms, geodesic_waves, paths_of
from creeping.field.special.airy import hard_modes
from creeping.field.special.coupling_function import coupling_function
from creeping.rays.port_rays import PortRays


class MonopoleTerms(SlotTerms):
    """What the waves of geodesics (m,) depend on beside length and spreading; parameters as of `SlotTerms`."""

    def upright(self, order: int) -> ComplexArray:
        """E_n without w (m,), 1/L."""
        V1 = coupling_function(self.xi, 1)
        # a slot has T0s T0r at V_1; the mean of squares is more than that by half the square of the difference
        charge = 0.5 * (self.T0[:, 0] - self.T0[:, 1]) ** 2 * V1 / self.square
        charge = charge + self.bracket(order, np.ones_like(self.xi), 0.25)
        return np.asarray(self.carried(order)[:, 0, 0] + 1j * self.k * charge)

    def bracket(self, order: int, first: FloatArray, rest: float) -> ComplexArray:
        """What the factor p t/M + a t²/M², a = q + p E M/ξ, adds to V (m,); p is ``first`` and q ``rest``.

        For small ξ p i/ks + 4q (i/ks)² of V, 2 ξ M = ks, is left.
        """
        V = coupling_function(self.xi)
        if order == 1:
            return np.asarray(first * coupling_function(self.xi, 1) / self.square - 4 * rest * self.near**2 * V)

        def early(some: IntArray, V: ComplexArray) -> ComplexArray:
            return self._early_bracket(some, V, first[some], rest)

        def late(some: IntArray, count: int) -> ComplexArray:
            return self._late_bracket(some, count, first[some, None], rest)

        return second_order(self.xi, V, early, late)

    def _early_bracket(self, some: IntArray, V: ComplexArray, first: FloatArray, rest: float) -> ComplexArray:
        """Under the integral."""
        hard = self.hard
        xi, M, near, E, H, L, P = (of[some] for of in (self.xi, self.square, self.near, hard.E, hard.H, hard.L, hard.P))
        V1, V2, V3 = (coupling_function(xi, power) for power in (1, 2, 3))
        a = rest + first * E * M / xi
        r = (3 * a - 4 * rest) * near**2 - first * (3 * E / xi - L) / (2 * xi**2 * M)
        turned = V1 + 1j * E * V3 + L * V2 + 1j * P / xi * V1 - 1j * H * V
        return np.asarray(first * turned / M + a * V2 / M**2 + r * V)

    def _late_bracket(self, some: IntArray, count: int, first: FloatArray, rest: float) -> ComplexArray:
        """By so many modes."""
        xi, root, E = self.xi[some], np.sqrt(np.pi * self.xi[some]), self.hard.E[some]
        tau, small = hard_modes(count).tau, 1 / self.square[some, None]
        a = rest * small**2 + first * (E / xi)[:, None] * small
        decayed, bracket = self.hard.modes_of_second_order(some, count)
        twice = (self.hard.H[some] / xi)[:, None] * (first * small + 2 * a * tau) / tau
        total = np.sum(decayed * (bracket * (first * small * tau + a * tau**2) - twice), axis=-1)
        return np.asarray(np.exp(0.25j * np.pi) * root * total)


def monopole_waves(rays: PortRays, wavenumber: float, order: int) -> ComplexArray:
    """E_n of all geodesics (m,), 1/L^2; infinite on caustics."""
    terms = MonopoleTerms(*paths_of(rays, wavenumber))
    w, _ = geodesic_waves(rays, terms, wavenumber, order)
    with np.errstate(invalid="ignore"):
        return np.asarray(w * terms.upright(order))
