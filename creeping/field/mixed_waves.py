"""The field of each geodesic from a slot in a conductor to a monopole on it: E along n of moments along b and t.

Per unit of the moment, with the letters of `creeping.field.slot_waves`, m1 and T0s of the slot's end, m2 and T0m of the
monopole's, and c the J2'/J2 of the slot's end,

    E_n from b   -ik w {V + (T0s²/m1² + T0m²/m2²) V_1/2 + [ν/(ka)] - 1 + (i/2k) c V} - T0s T0m S0
    E_n from t   -T0m S0 - X_s

V to second order, of "electric hard" waves. A monopole stands for a slot along -b with the factor ν/(ka) of its own end
more, so that the bracket is that of `creeping.field.monopole_waves` with p = M/(2 m2²) = m1/(2 m2) and q = 0.

On a plane, 2 ξ M = ks, -ik w (1 + i/ks) is left. By reciprocity H along b and t of a unit electric moment along n is
minus that, b and t those of the path from the slot.

Sources: [PW81] for leading order; Derivations, F34.
"""

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.monopole_waves import MonopoleTerms
from creeping.field.slot_waves import TWIST, VARIES, SlotWaves, geodesic_waves, paths_of
from creeping.field.special.coupling_function import coupling_function, soft_coupling_function
from creeping.rays.port_rays import PortRays


class MixedTerms(MonopoleTerms):
    """What the waves of geodesics (m,) from slots to monopoles depend on; parameters as of `SlotTerms`."""

    def crossed(self, order: int) -> ComplexArray:
        """E_n of moments along b and t without w and J2'/J2 (m, 1, 2), 1/L."""
        k, M, (slot, monopole) = self.k, self.square, self.T0.T
        V1 = coupling_function(self.xi, 1)
        S0 = k * self.near * soft_coupling_function(self.xi)
        hard = self.hard.wave(order) / self.hard.factor + self.bracket(order, 0.5 * self.uneven[:, 1], 0.0)
        hard = hard + 0.5 * np.sum(self.uneven * self.T0**2, axis=1) * V1 / M
        return -np.stack([1j * k * hard + slot * monopole * S0, monopole * S0 + self.twisted(0)], axis=1)[:, None]

    def turning(self, cot: FloatArray, order: int) -> ComplexArray:
        """What J2'/J2 of the slot's end, 1/L, adds to the first of them (m,), 1/L."""
        return np.asarray(0.5 * cot * self.hard.wave(order) / self.hard.factor)

    def unsure(self) -> FloatArray:
        """Bound of what was not derived in what a moment along t gives, without w (m,), 1/L."""
        torsion = VARIES * np.abs(self.T0[:, 0] - self.T0[:, 1]) + TWIST * np.max(np.abs(self.T0), axis=1)
        return np.asarray(self.k * torsion * np.abs(coupling_function(self.xi, 1)) / self.square)


def mixed_waves(rays: PortRays, wavenumber: float, order: int) -> SlotWaves:
    """Of all geodesics (m,), slots at their first ports and monopoles at their second, received along n alone."""
    terms = MixedTerms(*paths_of(rays, wavenumber))
    w, _ = geodesic_waves(rays, terms, wavenumber, order)
    components, missing = np.zeros((len(rays), 2, 2), dtype=complex), np.zeros((len(rays), 2, 2))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        components[:, :1] = terms.crossed(order)
        components[:, 0, 0] += terms.turning(rays.rates[:, 0] / rays.spreading, order)
        components[:, 0] *= w[:, None]
        missing[:, 0, 1] = terms.unsure() * np.abs(w)
    here, there = rays.normals[rays.first], rays.normals[rays.second]
    t = rays.directions
    frames = np.stack([np.stack([np.cross(here, t[:, 0]), there], axis=1), t], axis=2)
    return SlotWaves(components, frames, missing)
