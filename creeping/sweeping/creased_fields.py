"""Fields of many incidences on a body with edges, joints or tips: of each alone, as `creeping.far_field` has them."""

from collections.abc import Callable
from itertools import product

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.errors import SingularIncidenceError, SurfaceError
from creeping.field.boundary import BoundaryLike, parse_boundary
from creeping.field.equation.kept import solve_together
from creeping.field.far import far_field
from creeping.field.far_result import FarField
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
