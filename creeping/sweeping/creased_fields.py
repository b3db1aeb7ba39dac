"""Fields of many incidences on a body with edges, joints or tips: of each alone, as `creeping.far_field` has them."""

from collections.abc import Callable

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.errors import SingularIncidenceError, SurfaceError
from creeping.field.boundary import BoundaryLike, parse_boundary
from creeping.field.equation.kept import solve_together
from creeping.field.far import far_field
from creeping.field.far_result import FarField
from creeping.geometry.creased import has_edges
from creeping.geometry.surface import Surface
from creeping.rays.fan import RayFan, launch
from creeping.rays.transport import Flow
from creeping.shadow.line import ShadowLine, shadow_line
from creeping.shadow.many import ShadowLines, lines_together
from creeping.sweeping.field_arrays import FieldArrays
from creeping.sweeping.request import VALID, SweepRequest

SERVED = "rays+optics"
"""What serves in place of isolated rays alone, as `creeping.FarField.method` says it."""


def creased_lines(
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


def fill_creased(
    flow: Flow,
    request: SweepRequest,
    lines: tuple[ShadowLine | None, ...],
    out: dict[str, np.ndarray[Any, Any]],
    passed: Callable[[float], None] = lambda _: None,
) -> None:
    """Fields of incidences with these lines into arrays whose first axis is the incidence; ``passed`` of `Sweeper`."""
    _solved(flow.body, request, lines)
    bistatic = request.quantity == "bistatic"
    each = len(request.problems) * len(request.wavenumbers)
    for row, line in enumerate(lines):
        if line is None:
            continue
        fan = launch(flow, line, length=request.length, n_rays=request.n_rays, max_gap=np.inf, measured=False)
        observers = np.array(request.observation) if bistatic else -line.direction[None]
        for problem, (name, which, suffix) in enumerate(request.problems):
            boundary = parse_boundary(name)
            for k, wavenumber in enumerate(request.wavenumbers):
                field = _field(fan, observers, wavenumber, boundary, request)
                for part, values in FieldArrays.of(field, 1).arrays.items():
                    if part + suffix in out:
                        out[part + suffix][(row, *which, k)] = values[0] if bistatic else values[0, 0]
                if field.validity is not None:
                    numbers = (field.validity.least_k_rho, field.validity.largest_transverse)
                    for known, value in zip(VALID, numbers, strict=True):
                        out[known][row, k] = value
                passed((row + (problem * len(request.wavenumbers) + k + 1) / each) / len(lines))


def _solved(body: Surface, request: SweepRequest, lines: tuple[ShadowLine | None, ...]) -> None:
    """Solve the equation of a body with edges for all incidences at once, where `far_field` will ask for each."""
    d = np.array([line.direction for line in lines if line is not None])
    if not has_edges(body) or not len(d) or request.order != 2 or request.method not in ("auto", "equation"):
        return
    for name, _, _ in request.problems:
        for wavenumber in request.wavenumbers:
            solve_together(body, d, wavenumber, parse_boundary(name))


def _field(
    fan: RayFan, observers: FloatArray, wavenumber: float, boundary: BoundaryLike, request: SweepRequest
) -> FarField:
    """Far field of one incidence; by its equation a conductor has that of "auto" where rays do not resolve it."""
    asked: dict[str, Any] = {"wavenumber": wavenumber, "boundary": boundary, "order": request.order}
    plain = boundary == "pec" and not has_edges(fan.body)
    by_rays = request.method == "rays" or (request.method == "auto" and plain)
    if by_rays:
        field = far_field(fan, observers, method="rays", **asked)
        if request.method == "rays" or not len(FieldArrays.of(field, 1).unclear):
            return field
    try:
        return far_field(fan, observers, method=request.method, **asked)
    except SurfaceError:
        # what no mesh of the body resolves is as rays have it, and says so
        return field if by_rays else far_field(fan, observers, method="rays", **asked)
