"""The field of each geodesic between two monopoles on a conductor, E along n of an electric moment along n.

Per unit of the moment and times the admittance of free space, with the letters of `creeping.field.slot_waves`,

    E_n = ik w {V + (T0s² + T0r²) V_1/(2M) + [(ν² - 1/4)/(ka)²] - 1} + T0s T0r S0

V to second order, of "electric hard" waves: what a slot across the path gives along b, H_b, and the charge at the foot,
E_n = (i/k) (curl H)_n. The bracket stands under the integral of V, with all that it has there,

    t/M + a t²/M²,   a = 1/4 + E M/ξ,
    V_1/M + iE V_3/M + L V_2/M + i(P/ξ) V_1/M - iH V/M + a V_2/M² + r V,
    r = (1 - 3a) (i/(2 ξ M))² - (3 E/ξ - L)/(2 ξ² M),   which leaves 1 + i/ks + (i/ks)² on a plane, 2 ξ M = ks

and in modes as a factor g = 1 + τ/M + a τ²/M² of [1 + L τ + (H/ξ)/τ² + iP/ξ], less (H/ξ) g'/τ, since R² has a double
pole: t R² = 1 - R', so that under the integral it is iξ V.

Sources: [PW81] for leading order; Derivations, F33.
"""

import numpy as np

from creeping._typing import ComplexArray, IntArray
from creeping.field.port_waves import second_order
from creeping.field.slot_waves import SlotTerms, geodesic_waves
from creeping.field.special.airy import hard_modes
from creeping.field.special.coupling_function import coupling_function
from creeping.rays.port_rays import PortRays


class MonopoleTerms(SlotTerms):
    """What the waves of geodesics (m,) depend on beside length and spreading; parameters as of `SlotTerms`."""

    def upright(self, order: int) -> ComplexArray:
        """E_n without w (m,), 1/L."""
        V, V1 = coupling_function(self.xi), coupling_function(self.xi, 1)
        if order == 1:
            charge = V1 / self.square - self.near**2 * V
        else:
            charge = second_order(self.xi, V, self._early_charge, self._late_charge)
        # a slot has T0s T0r at V_1; the mean of squares is more than that by half the square of the difference
        charge = charge + 0.5 * (self.T0[:, 0] - self.T0[:, 1]) ** 2 * V1 / self.square
        return np.asarray(self.carried(order)[:, 0, 0] + 1j * self.k * charge)

    def _early_charge(self, some: IntArray, V: ComplexArray) -> ComplexArray:
        """What the bracket adds to V, under the integral."""
        hard = self.hard
        xi, M, near, E, H, L, P = (of[some] for of in (self.xi, self.square, self.near, hard.E, hard.H, hard.L, hard.P))
        V1, V2, V3 = (coupling_function(xi, power) for power in (1, 2, 3))
        a = 0.25 + E * M / xi
        r = (1 - 3 * a) * -(near**2) - (3 * E / xi - L) / (2 * xi**2 * M)
        turned = V1 + 1j * E * V3 + L * V2 + 1j * P / xi * V1 - 1j * H * V
        return np.asarray(turned / M + a * V2 / M**2 + r * V)

    def _late_charge(self, some: IntArray, count: int) -> ComplexArray:
        """What it adds, by so many modes."""
        xi, root, E = self.xi[some], np.sqrt(np.pi * self.xi[some]), self.hard.E[some]
        tau, small = hard_modes(count).tau, 1 / self.square[some, None]
        a = 0.25 * small**2 + (E / xi)[:, None] * small
        decayed, bracket = self.hard.modes_of_second_order(some, count)
        twice = (self.hard.H[some] / xi)[:, None] * (small + 2 * a * tau) / tau
        total = np.sum(decayed * (bracket * (small * tau + a * tau**2) - twice), axis=-1)
        return np.asarray(np.exp(0.25j * np.pi) * root * total)


def monopole_waves(rays: PortRays, wavenumber: float, order: int) -> ComplexArray:
    """E_n of all geodesics (m,), 1/L^2; infinite on caustics."""
    terms = MonopoleTerms(wavenumber, rays.arclength, rays.curvature, rays.torsion, rays.bend, rays.integrals)
    w, _ = geodesic_waves(rays, terms, wavenumber, order)
    with np.errstate(invalid="ignore"):
        return np.asarray(w * terms.upright(order))
