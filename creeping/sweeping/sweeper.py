"""What computes the results of a sweep: lines of many incidences, then all their rays at once, or their fields.

Fields are those that `creeping.far_field` has for each incidence. What many incidences have in common is done once:

    rays        lines, searches and fans of all incidences together; "auto" takes currents where rays leave one unclear
    singular    the equation of all incidences whose lines cross themselves, as it needs none
    currents, equation, pieces      each incidence by the dispatcher, the equation solved for all of them before
    no rays     a body of flat triangles, or several: the equation of all incidences
    t-matrix    one matrix for each wavenumber and boundary
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, lru_cache
from itertools import product
from pathlib import Path

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping.errors import InvalidInputError, SingularIncidenceError, SurfaceError
from creeping.field.arguments import UNRESOLVED
from creeping.field.boundary import BoundaryLike, parse_boundary
from creeping.field.currents.whole_body import far_by_currents
from creeping.field.equation.solving import POOR, asked_solution, solution_for, solve_together, solved_alone
from creeping.field.far import far_field
from creeping.field.results.far_result import FarField
from creeping.field.routes import Problem, far_currents
from creeping.field.tmatrix.computing import kept_t_matrix
from creeping.field.validity_range import is_reached, launch_validity, validities
from creeping.field.waves.far_geometry import FarGeometry
from creeping.field.waves.far_rays import Parts, parts_of
from creeping.geodesics.equations import natural_horizon
from creeping.geodesics.integrator import ErrorEstimate
from creeping.geodesics.states import ATTENUATION, P, X, whole_lanes
from creeping.geometry.arguments import rays_refused
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.surface import Surface
from creeping.rays.fan import RayFan, launch, ray_arrays
from creeping.rays.reach import early_length
from creeping.rays.strips import Strip, strips_of
from creeping.rays.tracer import RayTracer
from creeping.rays.transport import Flow, carried
from creeping.shadow.line import ShadowLine, ShadowLines, lines_together, shadow_line, shadow_lines
from creeping.shadow.status import LineStatus
from creeping.sweeping.request import CURVED, VALID, SweepRequest

BY_OBSERVER = ("total", "creeping", "reflected", "forward", "error", "unresolved")

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


@dataclass(frozen=True, eq=False)
class NoFlow:
    """In place of a flow for a body without rays, or whose rays nothing asks for: it knows the body."""

    body: Any
    horizon: float = 1.0
    error: ErrorEstimate | None = None

    def transport(self, states: FloatArray, times: FloatArray) -> FloatArray:
        """There is nothing to carry.

        Raises
        ------
        InvalidInputError
        """
        raise InvalidInputError(rays_refused(self.body))


class Sweeper:
    """Results of incidences.

    The same call gives the same bits, and by rays an incidence has the same results in whatever company it is computed.

    Parameters
    ----------
    flow : PhaseMap, DirectFlow or NoFlow
    request : SweepRequest

    Attributes
    ----------
    passed : callable
        Called with the share of the incidences of a call whose fields are done, from time to time.
    store : Path, optional
        Where T-matrices are kept.

    Raises
    ------
    InvalidInputError
        If fields are asked for of a weighted body, or rays of a body that has none.
    """

    def __init__(self, flow: Flow, request: SweepRequest) -> None:
        self.flow, self.request = flow, request
        self.passed: Passed = lambda _: None
        self.store: Path | None = None
        fields = request.quantity != "rays"
        self._together = fields and (request.method == "t-matrix" or isinstance(flow, NoFlow))
        if isinstance(flow, NoFlow) and (not fields or request.method == "rays" or request.accuracy is not None):
            raise InvalidInputError(rays_refused(flow.body))
        self._piecewise = is_piecewise(flow.body)
        by_rays = fields and not (self._together or self._piecewise)
        self._tracer = RayTracer(flow.body, request.length) if by_rays else None
        self._early = min(request.length, early_length(flow.body, min(request.wavenumbers))) if by_rays else 0.0

    @property
    def body(self) -> Surface:
        """Body of the flow."""
        return self.flow.body

    def __call__(self, incidences: FloatArray, told: Told | None = None) -> Arrays:
        """Arrays of results of unit directions (n, 3), the first axis the incidence; see `SweepRequest.variables`.

        ``told`` is called with what the fields of some of them are made of: their rows, geometry and parts.

        Raises
        ------
        InvalidInputError
            If the equation of a body without rays, or a T-matrix, takes too long or too much memory.
        """
        incidences = np.asarray(incidences, dtype=float)
        out = self.request.empty(len(incidences))
        if self._together:
            out["incidence_status"][:] = LineStatus.OK
            self._fill_together(incidences, out)
            return out
        # rays at a time, so that what is known of them stays in the caches; fields are assembled by many calls on few
        # numbers, and want more
        batch = max(1, (16_384 if self._tracer is None else 65_536) // self.request.n_rays)
        for first in range(0, len(incidences), batch):
            part = slice(first, first + batch)
            count = len(incidences[part])

            def passed(share: float, first: int = first, count: int = count) -> None:
                self.passed((first + share * count) / len(incidences))

            made = self._batch(incidences[part], {name: values[part] for name, values in out.items()}, passed)
            if told and made:
                told(first + made[0], *made[1:])
        return out

    def _cases(self) -> list[Any]:
        """Each wavenumber with its number, and each boundary with its place and suffix: what is asked of an incidence.

        Boundaries of one frequency follow each other: they share what is of the frequency alone.
        """
        return list(product(enumerate(self.request.wavenumbers), self.request.problems))

    def _observers(self, directions: FloatArray) -> FloatArray:
        """Directions (n, m, 3) in which the fields of incidences (n, 3) are observed."""
        seen = self.request.observation
        return np.broadcast_to(np.array(seen), (len(directions), len(seen), 3)) if seen else -directions[:, None]

    def _put(self, out: Arrays, rows: Any, case: Any, arrays: Arrays) -> None:
        """Put fields (n, m, ...) of incidences into the results of one wavenumber and boundary."""
        (k, _), (_, place, suffix) = case
        for name, values in arrays.items():
            if name + suffix in out:
                # one observer is no axis of "monostatic"
                out[name + suffix][(rows, *place, k)] = values if self.request.observation else values[:, 0]

    def _fill_together(self, incidences: FloatArray, out: Arrays) -> None:
        """Fields by T-matrices, or by the equation of a body without another method."""
        request, cases = self.request, self._cases()
        for number, case in enumerate(cases):
            (_, wavenumber), (name, place, suffix) = case
            boundary = parse_boundary(name)
            if request.method == "t-matrix":
                T = kept_t_matrix(self.body, wavenumber, boundary, self.store)
                poor = not T.extinction <= POOR
                each = iter([T.backscatter(incidences)])
                if request.observation:
                    each = T.far_fields(incidences, np.array(request.observation))
            else:
                fine, poor = request.method == "equation", False
                solution = solved_alone(self.body, incidences, wavenumber, boundary, fine=fine)
                seen = self._observers(incidences)
                each = (solution.far_field(seen[row], row) for row in range(len(incidences)))
            first = 0
            for field in each:
                some = FieldArrays.of(field, len(field.total) // (len(request.observation) or 1))
                rows = slice(first, first := first + len(some.arrays["total"]))
                self._put(out, rows, case, some.arrays)
                self.passed((number + first / len(incidences)) / len(cases))
            # as of currents that are solved one by one
            if poor:
                out["unresolved" + suffix][(slice(None), *place, case[0][0])] = True

    def _batch(self, incidences: FloatArray, out: Arrays, passed: Passed) -> Made | None:
        request, each = self.request, None
        if self._piecewise and request.quantity != "rays":
            each = [_line_of(self.body, direction) for direction in incidences]
            lines = lines_together(incidences, each, request.n_rays)
        else:
            lines = shadow_lines(self.body, incidences, request.n_rays)
        fill_lines(lines, out)
        if request.quantity == "rays":
            fill_rays(self.flow, lines, request.travel_times, out)
            return None
        singular = lines.status == LineStatus.SINGULAR
        if request.order == 2 and request.method != "rays":
            self._fill_without_lines(incidences, np.flatnonzero(singular), out)
        rows = np.flatnonzero(~singular)
        if not len(rows):
            return None
        if self._tracer is not None:
            launched = lines.launch[rows]
            for name, found in zip(
                VALID, validities(self.body, launched, self._early, request.wavenumbers), strict=True
            ):
                out[name][rows] = found
            if request.method in ("rays", "auto"):
                return self._fill_by_rays(lines, rows, self._tracer, out, passed)
        # fields of each incidence as the dispatcher has them
        request, cases = self.request, self._cases()
        directions, observers = incidences[rows], self._observers(incidences[rows])
        # the equation is solved for all incidences at once, and these come before the next one
        together = request.order == 2 and (
            request.method == "equation" or (self._piecewise and request.method in ("auto", "currents"))
        )
        fans = lru_cache(None if together else 1)(
            lambda number: self._fan(directions[number], each[rows[number]] if each else None)
        )
        numbers = range(len(rows))
        jobs = list(product(cases, numbers)) if together else [(case, n) for n, case in product(numbers, cases)]
        for done, (case, number) in enumerate(jobs, 1):
            (k, wavenumber), (name, _, _) = case
            boundary = parse_boundary(name)
            if together and number == 0:
                solve_together(self.body, directions, wavenumber, boundary, fine=request.method == "equation")
            field = _field(fans(number), observers[number], wavenumber, boundary, request)
            some = rows[number : number + 1]
            self._put(out, some, case, FieldArrays.of(field, 1).arrays)
            if field.validity is not None and self._piecewise:
                for known, value in zip(VALID, field.validity, strict=True):
                    out[known][some, k] = value
            passed(done / len(jobs))
        return None

    def _fill_by_rays(self, lines: ShadowLines, rows: IntArray, tracer: RayTracer, out: Arrays, passed: Passed) -> Made:
        """Fields of all incidences by their rays, and by currents where "auto" takes these."""
        request, directions = self.request, lines.directions[rows]
        observers = self._observers(directions)
        fans = cache(lambda number: self._fan(directions[number]))

        def forward(number: int) -> tuple[ShadowLine, tuple[Strip, ...]]:
            fan = self._fan(directions[number])
            return fan.line, tuple(strip for strip in strips_of(fan) if len(strip.positions) > 1)

        geometry = FarGeometry(self.flow, lines.launch[rows], tracer, observers, lines.attached[rows], forward)
        cases, made, kinds = self._cases(), list[Parts](), len(request.problems)
        for case in cases:
            (_, wavenumber), (name, _, _) = case
            boundary = parse_boundary(name)
            made.append(parts_of(geometry, wavenumber, boundary, request.order))
            field = FieldArrays.of(made[-1].field(boundary), len(rows))
            unclear = field.unclear if request.method == "auto" else np.arange(0)
            if len(unclear) > 1 and not is_reached(self.body, wavenumber):
                # expansions of the currents will fail for most of them
                solve_together(self.body, directions[unclear], wavenumber, boundary)
            for number in unclear:
                other = _by_currents(fans(number), observers[number], wavenumber, boundary)
                if other is not None and field.improved_by(number, other):
                    field.replace(number, other)
            self._put(out, rows, case, field.arrays)
            passed(len(made) / len(cases))
        return rows, geometry, [parts for which in range(kinds) for parts in made[which::kinds]]

    def _fill_without_lines(self, incidences: FloatArray, rows: IntArray, out: Arrays) -> None:
        """Fields of incidences whose lines cross themselves, by the equation if it costs little enough; else none."""
        observers, asked = self._observers(incidences), self.request.method == "equation"
        for case in self._cases() if len(rows) else ():
            (_, wavenumber), (name, _, _) = case
            boundary = parse_boundary(name)
            solve_together(self.body, incidences[rows], wavenumber, boundary, fine=asked)
            for row in rows:
                # what costs too much, or has no mesh, stays NaN and unresolved
                with suppress(InvalidInputError, SurfaceError):
                    find = asked_solution if asked else solution_for
                    solved = find(self.body, incidences[row], wavenumber, boundary)
                    if solved:
                        field = solved.solution.far_field(observers[row], solved.incidence)
                        self._put(out, [row], case, FieldArrays.of(field, 1).arrays)

    def _fan(self, direction: FloatArray, line: ShadowLine | None = None) -> RayFan:
        line, request = line or shadow_line(self.body, direction), self.request
        return launch(self.flow, line, length=request.length, n_rays=request.n_rays, max_gap=np.inf, measured=False)


def _line_of(body: Surface, direction: FloatArray) -> ShadowLine | None:
    """The shadow line of an incidence, None where it crosses itself."""
    with suppress(SingularIncidenceError):
        return shadow_line(body, direction)
    return None


def _field(
    fan: RayFan, observers: FloatArray, wavenumber: float, boundary: BoundaryLike, request: SweepRequest
) -> FarField:
    """Far field of one incidence; what no mesh of the body resolves is as rays have it, and says so."""
    asked: dict[str, Any] = {"wavenumber": wavenumber, "boundary": boundary, "order": request.order}
    try:
        return far_field(fan, observers, method=request.method, **asked)
    except SurfaceError:
        return far_field(fan, observers, method="rays", **asked)


def _by_currents(fan: RayFan, observers: FloatArray, wavenumber: float, boundary: BoundaryLike) -> FarField | None:
    """Far field of one incidence by currents, if there are any that are affordable."""
    with suppress(SurfaceError):
        currents = far_currents(Problem(fan, wavenumber, boundary), len(observers))
        return far_by_currents(currents, observers, boundary) if currents else None
    return None


def fill_lines(lines: ShadowLines, out: dict[str, Any]) -> None:
    """Results of the lines."""
    known = lines.status != LineStatus.SINGULAR
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


@dataclass(frozen=True, eq=False)
class FieldArrays:
    """Arrays (n, m) or (n, m, 2, 2), by name.

    Attributes
    ----------
    arrays : dict
        Field and its parts, L, NaN where they are not known apart, its error, L, ``unresolved``, ``by_currents``.
    """

    arrays: dict[str, np.ndarray[Any, Any]]

    @classmethod
    def of(cls, field: FarField, incidences: int) -> "FieldArrays":
        """Arrays of a far field whose rows are the observers of one incidence after the other."""
        arrays = {name: getattr(field, name) for name in BY_OBSERVER}
        arrays = {name: np.array(v).reshape(incidences, -1, *v.shape[1:]) for name, v in arrays.items()}
        by_currents = np.isin(field.method, ("currents", "equation", "t-matrix")).reshape(arrays["unresolved"].shape)
        return cls(arrays | {"by_currents": by_currents})

    @property
    def unclear(self) -> IntArray:
        """Incidences with an observer that is unresolved, or whose error is large or not known."""
        total = np.abs(self.arrays["total"])
        size, error = (v.reshape(*v.shape[:2], -1).max(axis=2, initial=0.0) for v in (total, self.arrays["error"]))
        off = ~(error < UNRESOLVED * size.max(axis=1, keepdims=True, initial=0.0))
        return np.flatnonzero(np.any(off | self.arrays["unresolved"], axis=1))

    def improved_by(self, number: int, field: FarField) -> bool:
        """Whether another far field has the smaller error, rms over the observers, than that of an incidence."""
        mine, its = (np.sqrt(np.mean(np.asarray(error) ** 2)) for error in (self.arrays["error"][number], field.error))
        return bool(its < mine) or not np.isfinite(mine)

    def replace(self, number: int, field: FarField) -> None:
        """Put another far field in the place of one incidence's."""
        for name in BY_OBSERVER:
            self.arrays[name][number] = getattr(field, name)
        self.arrays["by_currents"][number] = True
