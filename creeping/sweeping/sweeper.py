"""What computes the results of a sweep: lines of many incidences, then all their rays at once, or their fields."""

from collections.abc import Callable
from contextlib import suppress

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping.errors import SurfaceError
from creeping.field.boundary import BoundaryLike, parse_boundary
from creeping.field.currents.whole_body import far_by_currents
from creeping.field.far import far_field
from creeping.field.problem import Problem
from creeping.field.results.far_result import FarField
from creeping.field.routes import far_currents
from creeping.field.validity_range import launch_validity, validities
from creeping.field.waves.far_geometry import FarGeometry
from creeping.field.waves.far_rays import Parts, parts_of
from creeping.geodesics.equations import natural_horizon
from creeping.geodesics.states import ATTENUATION, P, X, whole_lanes
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.surface import Surface
from creeping.rays.fan import RayFan, launch, ray_arrays
from creeping.rays.reach import early_length
from creeping.rays.strips import Strip, strips_of
from creeping.rays.tracer import RayTracer
from creeping.rays.transport import Flow, carried
from creeping.shadow.line import ShadowLine, ShadowLines, shadow_line, shadow_lines
from creeping.shadow.status import SINGULAR
from creeping.sweeping.request import CURVED, VALID, SweepRequest
from creeping.sweeping.solved_fields import FieldArrays, fill_piecewise, piecewise_lines

BATCH, FIELD_BATCH = 16_384, 65_536
"""Rays carried at a time, so that what is known of them stays in the caches; fields are assembled by many calls on few
numbers, and want more."""

Arrays = dict[str, np.ndarray[Any, Any]]
Made = tuple[IntArray, FarGeometry, list[Parts]]
"""Rows of incidences, and what their fields are made of, one `Parts` for each boundary and wavenumber."""
Told = Callable[[IntArray, FarGeometry, list[Parts]], None]
Passed = Callable[[float], None]
"""Called with the share that is done, above 0 and up to 1."""


def outputs_of(body: Surface, request: SweepRequest) -> int:
    """Equal steps of the rays at which a request needs them: what a flow for it is to be tuned for."""
    if request.quantity == "rays":
        return request.n_steps
    return int(np.ceil(request.length / natural_horizon(body) - 1e-9))


class Sweeper:
    """Results of incidences.

    The same call gives the same bits, and an incidence has the same results in whatever company it is computed.

    Parameters
    ----------
    flow : PhaseMap or DirectFlow
    request : SweepRequest

    Attributes
    ----------
    passed : callable
        Called with the share of the incidences of a call whose fields are done, after each frequency and boundary.

    Raises
    ------
    InvalidInputError
        If fields are asked for of a weighted body.
    """

    def __init__(self, flow: Flow, request: SweepRequest) -> None:
        self.flow, self.request = flow, request
        self.passed: Passed = lambda _: None
        self._one_by_one = request.quantity != "rays" and is_piecewise(flow.body)
        together = request.quantity != "rays" and not self._one_by_one
        self._tracer = RayTracer(flow.body, request.length) if together else None
        self._early = 0.0
        if together:
            self._early = min(request.length, early_length(flow.body, min(request.wavenumbers)))

    @property
    def body(self) -> Surface:
        """Body of the flow."""
        return self.flow.body

    def __call__(self, incidences: FloatArray, told: Told | None = None) -> dict[str, np.ndarray[Any, Any]]:
        """Arrays of results of unit directions (n, 3), the first axis the incidence; see `SweepRequest.variables`.

        ``told`` is called with what the fields of some of them are made of: their rows, geometry and parts.
        """
        incidences = np.asarray(incidences, dtype=float)
        out = self.request.empty(len(incidences))
        together = BATCH if self._tracer is None else FIELD_BATCH
        batch = max(1, together // self.request.n_rays)
        for first in range(0, len(incidences), batch):
            part = slice(first, first + batch)
            count = len(incidences[part])

            def passed(share: float, first: int = first, count: int = count) -> None:
                self.passed((first + share * count) / len(incidences))

            made = self._batch(incidences[part], {name: values[part] for name, values in out.items()}, passed)
            if told and made:
                told(first + made[0], *made[1:])
        return out

    def _batch(self, incidences: FloatArray, out: dict[str, Any], passed: Passed) -> Made | None:
        if self._one_by_one:
            found, lines = piecewise_lines(self.body, incidences, self.request.n_rays)
            fill_lines(lines, out)
            fill_piecewise(self.flow, self.request, found, out, passed)
            return None
        lines = shadow_lines(self.body, incidences, self.request.n_rays)
        fill_lines(lines, out)
        if self._tracer is None:
            fill_rays(self.flow, lines, self.request.travel_times, out)
            return None
        return self._fill_fields(lines, self._tracer, out, passed)

    def _fill_fields(self, lines: ShadowLines, tracer: RayTracer, out: dict[str, Any], passed: Passed) -> Made | None:
        rows = np.flatnonzero(lines.status != SINGULAR)
        if not len(rows):
            return None
        request, directions = self.request, lines.directions[rows]
        for name, found in zip(
            VALID, validities(self.body, lines.launch[rows], self._early, request.wavenumbers), strict=True
        ):
            out[name][rows] = found
        bistatic = request.quantity == "bistatic"
        observers = -directions[:, None]
        if bistatic:
            observers = np.broadcast_to(np.array(request.observation), (len(rows), len(request.observation), 3))

        def forward(number: int) -> tuple[ShadowLine, tuple[Strip, ...]]:
            fan = self._fan(directions[number])
            return fan.line, tuple(strip for strip in strips_of(fan) if len(strip.positions) > 1)

        fans: dict[int, RayFan] = {}

        def fan_of(number: int) -> RayFan:
            if number not in fans:
                fans[number] = self._fan(directions[number])
            return fans[number]

        geometry = FarGeometry(self.flow, lines.launch[rows], tracer, observers, lines.attached[rows], forward)
        made: dict[tuple[int, int], Parts] = {}
        # boundaries of one frequency follow each other: they share what is of the frequency alone
        for k, wavenumber in enumerate(request.wavenumbers):
            for which, (name, place, suffix) in enumerate(request.problems):
                boundary = parse_boundary(name)
                parts = made[which, k] = parts_of(geometry, wavenumber, boundary, request.order)
                field = FieldArrays.of(parts.field(boundary), len(rows))
                if request.method in ("currents", "equation"):
                    for number in range(len(rows)):
                        asked: dict[str, Any] = {"wavenumber": wavenumber, "boundary": boundary}
                        # what no mesh of the body resolves stays as rays have it, and says so
                        with suppress(SurfaceError):
                            field.replace(
                                number, far_field(fan_of(number), observers[number], method=request.method, **asked)
                            )
                elif request.method == "auto":
                    for number in field.unclear:
                        other = _by_currents(fan_of(number), observers[number], wavenumber, boundary)
                        if other is not None and field.improved_by(number, other):
                            field.replace(number, other)
                for part, values in field.arrays.items():
                    if part + suffix in out:
                        out[part + suffix][(rows, *place, k)] = values if bistatic else values[:, 0]
                passed(len(made) / (len(request.problems) * len(request.wavenumbers)))
        return rows, geometry, [made[key] for key in sorted(made)]

    def _fan(self, direction: FloatArray) -> RayFan:
        line, request = shadow_line(self.body, direction), self.request
        return launch(self.flow, line, length=request.length, n_rays=request.n_rays, max_gap=np.inf, measured=False)


def _by_currents(fan: RayFan, observers: FloatArray, wavenumber: float, boundary: BoundaryLike) -> FarField | None:
    """Far field of one incidence by currents, if there are any that are affordable."""
    with suppress(SurfaceError):
        currents = far_currents(Problem(fan, wavenumber, boundary), len(observers))
        return far_by_currents(currents, observers, boundary) if currents else None
    return None


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
    for name, values in zip(CURVED, launch_validity(flow.body, launch), strict=True):
        out[name][:] = values
    states, there = carried(flow, launch, times, components=whole_lanes(flow.body)), launch.there
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
