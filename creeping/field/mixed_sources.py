"""What slots bring to monopoles by each geodesic, with its error, and by beams where these merge.

A beam carries E_n, its components as in `creeping.field.mixed_waves` without the term in J2'/J2: at the slot moments
turn with the angle of the ray, and by stationary phase that term comes back. n does not turn.

Sources: [P82]; Derivations, F34.
"""

import numpy as np

from creeping._typing import Any, ComplexArray, FloatArray
from creeping.field.mixed_waves import MixedTerms, mixed_waves
from creeping.field.port_sources import PortSources
from creeping.field.port_waves import PathTerms
from creeping.field.slot_sources import SlotBeams, slot_sources
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
