"""What slots at ports bring by each geodesic, with its error, and by beams where these merge.

A beam carries H = A b + B p, its components as in `creeping.field.slot_waves` without the terms in J2'/J2 and 1/J2: off
its ray H turns with its front, to b - (q'/q) n p and p + (q'/q) n b, and by stationary phase those terms come back.

Error: that of a point source's wave, of all components, and what was not derived.

Sources: [P82]; Derivations, F24 and F28.
"""

from collections.abc import Callable

import numpy as np

from creeping._typing import Any, ComplexArray, FloatArray, IntArray
from creeping.field.port_beams import PortBeams
from creeping.field.port_sources import PortSources, Sums, path_error
from creeping.field.port_waves import PathTerms, path_terms
from creeping.field.slot_waves import SlotTerms, SlotWaves, slot_waves
from creeping.geometry.surface import Surface
from creeping.rays.port_rays import PortRays


def slot_sources(
    rays: PortRays,
    axes: FloatArray,
    k: float,
    order: int,
    waves_of: Callable[[PortRays, float, int], SlotWaves] = slot_waves,
    kind: type["SlotBeams"] | None = None,
) -> PortSources:
    """Waves of slots along unit tangents (n, 3) at their ports, 1/L^2, and beams of a kind, by default `SlotBeams`."""
    terms = path_terms(rays, k)
    made = waves_of(rays, k, order)
    source, receiver = axes[rays.first], axes[rays.second]
    waves = made.along(source, receiver)
    with np.errstate(invalid="ignore"):
        sizes = np.sqrt(np.sum(np.abs(made.components) ** 2, axis=(1, 2)))
        strength, missing = made.bounds(source, receiver)
        own = strength * path_error(rays, terms, k) + missing
        if order == 1:
            own = own + np.abs(waves_of(rays, k, 2).along(source, receiver) - waves)
    own = np.where(np.isfinite(sizes), own, 0.0)

    def beams(number: int) -> Sums:
        place = rays.body, rays.ports[number], rays.normals[number], axes[number], rays.length
        made = (kind or SlotBeams)(*place, k, order)

        def sums(targets: IntArray, beyond: float) -> tuple[ComplexArray, ComplexArray, FloatArray]:
            both = made.sums(rays.ports[targets], beyond)
            found, again = (made.received(field, axes[targets]) for field in both)
            return found, again, np.linalg.norm(both[0], axis=1)

        return sums

    return PortSources(terms.square, waves, sizes, own, k, True, beams)


class SlotBeams(PortBeams):
    """Beams of a slot along an axis (3,), a unit tangent at its port; their fields H (n, 3), 1/L^2."""

    def __init__(
        self,
        body: Surface,
        port: FloatArray,
        outward: FloatArray,
        axis: FloatArray,
        length: float,
        wavenumber: float,
        order: int,
    ) -> None:
        super().__init__(body, port, outward, length, wavenumber, order)
        from scipy.interpolate import CubicSpline

        _, p, b = self.rays[:3]
        shape = len(p), len(self.known), *self._components.shape[1:]
        components = CubicSpline(self.known, self._components.reshape(shape), axis=1)(self.at)
        start = np.stack([b[:, 0], p[:, 0]], axis=1) @ axis
        self._carry(components, start)

    def received(self, fields: ComplexArray, axes: FloatArray) -> ComplexArray:
        """Fields of `sums` along axes (n, 3): (n,)."""
        return np.asarray(np.einsum("nc,nc->n", fields, axes))

    def _carry(self, components: ComplexArray, start: FloatArray) -> None:
        """Take what is carried (rays, steps, components, 2) of the axis, along b and p at its port (rays, 2)."""
        _, p, b = self.rays[:3]
        along = np.einsum("rsac,rc->rsa", components, start)
        side, front = along[..., :1], along[..., 1:]
        self.carried = np.ascontiguousarray(side * b + front * p)
        self.leaning = np.ascontiguousarray((front * b - side * p) / self.turned[..., None])

    def _wave(self, path: tuple[Any, ...], order: int) -> ComplexArray:
        hard, components = self._of_paths(path, order)
        y = hard.wave(order)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = components * (hard.factor / y)[:, None, None]
        self._components = np.where(np.isfinite(ratio), ratio, 0.0)
        return y

    def _of_paths(self, path: tuple[Any, ...], order: int) -> tuple[PathTerms, ComplexArray]:
        """The hard wave's terms, and what is carried of moments along b and p (m, components, 2)."""
        terms = SlotTerms(*path)
        return terms.hard, terms.carried(order)
