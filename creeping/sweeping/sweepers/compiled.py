"""The compiled route of a sweep: lines of many incidences, then the rays of all of them at once."""

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.geodesics.states import ATTENUATION, WHOLE, P, X
from creeping.geometry.surface import Surface
from creeping.rays.fan import ray_arrays
from creeping.rays.single import SingleRayTracer
from creeping.rays.transport import Flow, carried
from creeping.shadow.many import ShadowLines, shadow_lines
from creeping.shadow.status import SINGULAR
from creeping.sweeping.request import SweepRequest
from creeping.sweeping.sweepers.monostatic import fill_monostatic

BATCH, FIELD_BATCH = 16_384, 65_536
"""Rays carried at a time, so that what is known of them stays in the caches; fields are assembled by many calls on few
numbers, and want more."""


class CompiledSweeper:
    """Results of incidences (n, 3) on a body with a compiled level; see `PlainSweeper`.

    Parameters
    ----------
    flow : PhaseMap or DirectFlow
    request : SweepRequest
    """

    def __init__(self, flow: Flow, request: SweepRequest) -> None:
        self.flow, self.request = flow, request
        self._tracer = None if request.quantity == "rays" else SingleRayTracer(flow.body, request.length)

    @property
    def body(self) -> Surface:
        """Body of the flow."""
        return self.flow.body

    def __call__(self, incidences: FloatArray) -> dict[str, np.ndarray[Any, Any]]:
        """Arrays of results, the first axis the incidence; see `SweepRequest.variables`."""
        incidences = np.asarray(incidences, dtype=float)
        out = self.request.empty(len(incidences))
        together = BATCH if self._tracer is None else FIELD_BATCH
        batch = max(1, together // self.request.n_rays)
        for first in range(0, len(incidences), batch):
            part = slice(first, first + batch)
            self._batch(incidences[part], {name: values[part] for name, values in out.items()})
        return out

    def _batch(self, incidences: FloatArray, out: dict[str, Any]) -> None:
        lines = shadow_lines(self.body, incidences, self.request.n_rays)
        fill_lines(lines, out)
        if self._tracer is None:
            fill_rays(self.flow, lines, self.request.travel_times, out)
        else:
            fill_monostatic(self.flow, lines, self._tracer, self.request, out)


def fill_lines(lines: ShadowLines, out: dict[str, Any]) -> None:
    """Results of the lines."""
    known = lines.status != SINGULAR
    out["incidence_status"][:] = lines.status
    out["curves"][known] = lines.curves[known]
    out["line_length"][:], out["line_error"][:] = lines.length, lines.error
    for name in ("attached", "occluded", "concave", "singular_distance"):
        out[name][:] = getattr(lines, name)


def fill_rays(flow: Flow, lines: ShadowLines, times: FloatArray, out: dict[str, Any]) -> None:
    """Results of the rays."""
    launch = lines.launch
    states, there = carried(flow, launch, times, components=WHOLE), launch.there
    rays = ray_arrays(flow.body, launch, states, times)
    out["ray_status"][:], out["detachment"][:] = rays.status, rays.detachment
    out["curve_index"][:], out["arclength"][:] = launch.curve_index, launch.arclength
    out["launch_phase"][:] = launch.phase
    for name, values in (
        ("points", states[..., X]),
        ("directions", states[..., P]),
        ("spreading", rays.spreading),
        ("spreading_rate", rays.spreading_rate),
        ("attenuation", states[..., ATTENUATION]),
    ):
        out[name][:] = values
        if not there.all():
            out[name][~there] = np.nan
