"""Fields of many incidences on a body without rays: its integral equation, solved for all of them together.

Also here: fields of many incidences on a body with edges, joints or tips: of each alone, as `creeping.far_field` has
them.

Also here: far fields of n incidences with m observers each, as a sweep stores them; those of one incidence may be
replaced.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping.errors import InvalidInputError, SingularIncidenceError, SurfaceError
from creeping.field.arguments import UNRESOLVED
from creeping.field.boundary import BoundaryLike, parse_boundary
from creeping.field.equation.solving import solve_together, solved_alone
from creeping.field.far import far_field
from creeping.field.results.far_result import FarField
from creeping.geodesics.integrator import ErrorEstimate
from creeping.geometry.arguments import rays_refused
from creeping.geometry.surface import Surface
from creeping.rays.fan import RayFan, launch
from creeping.rays.transport import Flow
from creeping.shadow.line import ShadowLine, ShadowLines, lines_together, shadow_line
from creeping.shadow.status import OK
from creeping.sweeping.request import VALID, SweepRequest

SERVED = "rays+optics"
"""What serves in place of isolated rays alone, as `creeping.FarField.method` says it."""

BY_OBSERVER = ("total", "creeping", "reflected", "forward", "error", "unresolved")


@dataclass(frozen=True, eq=False)
class NoFlow:
    """In place of a flow for a body without rays: it knows the body, and carries nothing."""

    body: Any

    @property
    def horizon(self) -> float:
        """As of flows."""
        return 1.0

    @property
    def error(self) -> ErrorEstimate | None:
        """As of flows."""
        return None

    def transport(self, states: FloatArray, times: FloatArray) -> FloatArray:
        """There is nothing to carry.

        Raises
        ------
        InvalidInputError
        """
        raise InvalidInputError(rays_refused(self.body))


class SolvedSweeper:
    """Results of incidences, as `creeping.sweeping.sweeper.Sweeper` gives them, for a body without rays.

    Parameters
    ----------
    flow : NoFlow
    request : SweepRequest

    Raises
    ------
    InvalidInputError
        If rays are asked for.
    """

    def __init__(self, flow: NoFlow, request: SweepRequest) -> None:
        if request.quantity == "rays" or request.method == "rays" or request.accuracy is not None:
            raise InvalidInputError(rays_refused(flow.body))
        self.flow, self.request = flow, request
        self.passed: Callable[[float], None] = lambda _: None

    def __call__(self, incidences: FloatArray) -> dict[str, np.ndarray[Any, Any]]:
        """Arrays of results of unit directions (n, 3), the first axis the incidence.

        Raises
        ------
        InvalidInputError
            If the equation of one incidence takes too long or too much memory.
        """
        request, body = self.request, self.flow.body
        d = np.asarray(incidences, dtype=float)
        out = request.empty(len(d))
        out["incidence_status"][:] = OK
        bistatic, done = request.quantity == "bistatic", 0
        for k, wavenumber in enumerate(request.wavenumbers):
            for name, which, suffix in request.problems:
                boundary = parse_boundary(name)
                solution = solved_alone(body, d, wavenumber, boundary, fine=request.method == "equation")
                for row in range(len(d)):
                    observers = np.array(request.observation) if bistatic else -d[row : row + 1]
                    field = FieldArrays.of(solution.far_field(observers, row), 1)
                    for part, values in field.arrays.items():
                        if part + suffix in out:
                            out[part + suffix][(row, *which, k)] = values[0] if bistatic else values[0, 0]
                    done += 1
                    self.passed(done / (len(d) * len(request.problems) * len(request.wavenumbers)))
        return out


def piecewise_lines(
    body: Surface, directions: FloatArray, n_rays: int
) -> tuple[tuple[ShadowLine | None, ...], ShadowLines]:
    """Lines of unit directions (n, 3), None where one crosses itself, and what sweeps say of them."""
    lines: list[ShadowLine | None] = []
    for direction in directions:
        try:
            lines.append(shadow_line(body, direction))
        except SingularIncidenceError:
            lines.append(None)
    return tuple(lines), lines_together(directions, lines, n_rays)


def fill_piecewise(
    flow: Flow,
    request: SweepRequest,
    lines: tuple[ShadowLine | None, ...],
    out: dict[str, np.ndarray[Any, Any]],
    passed: Callable[[float], None] = lambda _: None,
) -> None:
    """Fields of incidences with these lines into arrays whose first axis is the incidence; ``passed`` of `Sweeper`."""
    bistatic = request.quantity == "bistatic"
    there = {row: line for row, line in enumerate(lines) if line is not None}
    rows = list(there)
    asked = list(product(request.problems, enumerate(request.wavenumbers)))
    # the equation is solved for all incidences at once, and these come before the next one
    together = request.order == 2 and request.method in ("auto", "equation")
    jobs = [(row, one) for one in asked for row in rows] if together else [(r, one) for r in rows for one in asked]
    directions = np.array([line.direction for line in there.values()])
    fans: dict[int, RayFan] = {}
    for done, (row, ((name, which, suffix), (k, wavenumber))) in enumerate(jobs, 1):
        boundary, line = parse_boundary(name), there[row]
        if together and row == rows[0]:
            solve_together(flow.body, directions, wavenumber, boundary)
        if row not in fans:
            fan = launch(flow, line, length=request.length, n_rays=request.n_rays, max_gap=np.inf, measured=False)
            fans = {**fans, row: fan} if together else {row: fan}
        observers = np.array(request.observation) if bistatic else -line.direction[None]
        field = _field(fans[row], observers, wavenumber, boundary, request)
        for part, values in FieldArrays.of(field, 1).arrays.items():
            if part + suffix in out:
                out[part + suffix][(row, *which, k)] = values[0] if bistatic else values[0, 0]
        if field.validity is not None:
            numbers = (field.validity.least_k_rho, field.validity.largest_transverse)
            for known, value in zip(VALID, numbers, strict=True):
                out[known][row, k] = value
        passed(done / len(jobs))


def _field(
    fan: RayFan, observers: FloatArray, wavenumber: float, boundary: BoundaryLike, request: SweepRequest
) -> FarField:
    """Far field of one incidence; what no mesh of the body resolves is as rays have it, and says so."""
    asked: dict[str, Any] = {"wavenumber": wavenumber, "boundary": boundary, "order": request.order}
    try:
        return far_field(fan, observers, method=request.method, **asked)
    except SurfaceError:
        return far_field(fan, observers, method="rays", **asked)


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
