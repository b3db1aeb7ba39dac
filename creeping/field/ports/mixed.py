"""What slots bring to monopoles by each geodesic, with its error, and by beams where these merge.

A beam carries E_n, its components as in `creeping.field.ports.mixed` without the term in J2'/J2: at the slot moments
turn with the angle of the ray, and by stationary phase that term comes back. n does not turn.

Also here: the field of each geodesic from a slot in a conductor to a monopole on it: E along n of moments along b and
t.

Per unit of the moment, with the letters of `creeping.field.ports.antenna_waves`, m1 and T0s of the slot's end, m2 and
T0m of the monopole's, and c the J2'/J2 of the slot's end,

    E_n from b   -ik w {V + (T0s²/m1² + T0m²/m2²) V_1/2 + [ν/(ka)] - 1 + (i/2k) c V} - T0s T0m S0
    E_n from t   -T0m S0 - X_s

V to second order, of "electric hard" waves. A monopole stands for a slot along -b with the factor ν/(ka) of its own end
more, so that the bracket is that of `creeping.field.ports.antenna_waves` with p = M/(2 m2²) = m1/(2 m2) and q = 0.

On a plane, 2 ξ M = ks, -ik w (1 + i/ks) is left. By reciprocity H along b and t of a unit electric moment along n is
minus that, b and t those of the path from the slot.

Sources: [P82]; Derivations, F34; [PW81] for leading order.
"""

import numpy as np

from creeping._typing import Any, ComplexArray, FloatArray
from creeping.field.ports.antenna_waves import (
    TWIST,
    VARIES,
    MonopoleTerms,
    SlotBeams,
    SlotWaves,
    geodesic_waves,
    paths_of,
    slot_sources,
)
from creeping.field.ports.sources import PortSources
from creeping.field.ports.waves import PathTerms
from creeping.field.special.airy import coupling_function, soft_coupling_function
from creeping.rays.port_rays import PortRays


def mixed_sources(rays: PortRays, axes: FloatArray, k: float, order: int) -> PortSources:
    """Waves of slots at first ports to monopoles at second ones, 1/L^2; axes (n, 3) are tangents and normals."""
    return slot_sources(rays, axes, k, order, mixed_waves, MixedBeams)


class MixedBeams(SlotBeams):
    """Beams of a slot along an axis (3,), a unit tangent at its port; their field (n, 2), 1/L^2, is E_n.

    And that of a slot across, which tells what is the most that one could give.
    """

    def received(self, fields: ComplexArray, axes: FloatArray) -> ComplexArray:
        """E_n of the slot itself (n,), whatever the axes."""
        return fields[:, 0]

    def _carry(self, components: ComplexArray, start: FloatArray) -> None:
        # b and p in terms of the axis, and of n x axis
        both = np.stack([start, start[:, ::-1] * (1, -1)])
        self.carried = np.ascontiguousarray(np.einsum("rsc,arc->rsa", components[:, :, 0], both))
        self.leaning = np.zeros_like(self.carried)

    def _of_paths(self, path: tuple[Any, ...], order: int) -> tuple[PathTerms, ComplexArray]:
        terms = MixedTerms(*path)
        return terms.hard, terms.crossed(order)


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
