"""The compiled route of a sweep: lines of many incidences, then the rays of all of them at once."""

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray
from creeping.geodesics.integrator import pack
from creeping.geometry.speed import speed_of
from creeping.geometry.surface import Surface
from creeping.rays.fan import Flow, RayStatus, rough_from
from creeping.rays.single import SingleRayTracer
from creeping.rays.spreading import spread
from creeping.rays.transport import carried
from creeping.shadow.attachment import line_tangents
from creeping.shadow.many import ShadowLines, shadow_lines
from creeping.shadow.status import NO_RAY, SINGULAR
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
    states, there = carried(flow, lines, times, lanes=12), lines.curve_index != NO_RAY
    J, rate, stalled = _spreading(flow.body, lines, states)
    detachment = states[..., -1, 11]
    status = np.where(np.isfinite(detachment), int(RayStatus.DETACHED), int(RayStatus.OK))
    if hasattr(flow.body, "rough"):
        path = np.concatenate([lines.launch_points[:, :, None], states[..., :3]], axis=2)
        rough = np.full(there.shape, np.inf)
        rough[there] = rough_from(flow.body, path[there], np.concatenate([[0.0], times]))
        status = np.where(rough < detachment, int(RayStatus.ROUGH), status)
        detachment = np.minimum(detachment, rough)
    status[stalled] = RayStatus.STALLED
    out["ray_status"][:] = np.where(there, status, NO_RAY)
    out["curve_index"][:], out["arclength"][:] = lines.curve_index, lines.arclength
    out["launch_phase"][:], out["detachment"][:] = lines.launch_phase, np.where(there, detachment, np.nan)
    for name, values in (
        ("points", states[..., :3]),
        ("directions", states[..., 3:6]),
        ("spreading", J),
        ("spreading_rate", rate),
        ("attenuation", states[..., 10]),
    ):
        out[name][:] = values
        if not there.all():
            out[name][~there] = np.nan


def _spreading(body: Surface, lines: ShadowLines, states: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
    """J and J' (n, rays, m), and rays that do not move (n, rays)."""
    if speed_of(body) is None:
        # J(0) = 1, J'(0) = 0: the first column of the Jacobi matrix
        return states[..., 6], states[..., 7], np.zeros(states.shape[:2], dtype=bool)
    n, rays, m = states.shape[:3]
    points = np.nan_to_num(lines.launch_points).reshape(-1, 3)
    directions = np.repeat(lines.directions, rays, axis=0)
    tangents = np.concatenate(
        [line_tangents(body, part, d) for part, d in zip(points.reshape(n, rays, 3), lines.directions, strict=True)]
    )
    # `spread` takes the speed at the launch point from the first step
    start = pack(points, directions, lanes=12)[:, None]
    path = np.concatenate([start, states.reshape(-1, m, 12)], axis=1)
    J, rate, stalled = spread(body, np.concatenate([points, tangents], axis=1), directions, path)
    return J[:, 1:].reshape(n, rays, m), rate[:, 1:].reshape(n, rays, m), stalled.reshape(n, rays)
