"""What follows when the incidence rests: the line to rounding, a fan with its error, the field on the body and afar.

Each step asks before it starts whether the request still stands, so that a newer one does not wait for long.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.explorer.preview import Preview
from creeping.explorer.request import ViewRequest
from creeping.field.body_currents import affordable, cached_currents, has_expansions
from creeping.field.far import far_field
from creeping.field.far_result import FarField
from creeping.geometry.directions import directions_from_angles
from creeping.geometry.evaluators import speed_of
from creeping.plotting.coloured_body import current_levels
from creeping.plotting.field_pictures import levels_of, surface_values
from creeping.rays.fan import RayFan, end_error, launch
from creeping.rays.transport import Flow
from creeping.shadow.line import ShadowLine, shadow_line

CUT_STEP = 2.0
"""Of the far-field cut, degrees."""
BLOCK = 512
"""Points of the body at a time: a newer request waits for no more."""
IsStale = Callable[[], bool]


@dataclass(frozen=True, eq=False)
class Refined:
    """Everything that takes seconds.

    Attributes
    ----------
    request : ViewRequest
    drawn : RayFan
        The fan on the page, its error now measured.
    line : ShadowLine
    fan : RayFan
        With rays inserted where neighbours part: that of the fields.
    body_levels : (n,) or None
        20 log10 of the total field on the vertices of the mesh, of a conductor of |n x H|, the root mean square of both
        polarisations; NaN where no ray passes, None on a weighted body, one with edges, and where it costs too much.
    cut_angles : (m,), degrees
        Theta of the cut, from -180 to 180 through the directions of azimuth ``request.cut`` and its opposite.
    far : FarField or None
    body_wave : (n,) complex or None
        The field that ``body_levels`` are of, u, or du/dn/k of the soft boundary; None of a conductor as well.
    """

    request: ViewRequest
    drawn: RayFan
    line: ShadowLine
    fan: RayFan
    body_levels: FloatArray | None
    cut_angles: FloatArray
    far: FarField | None
    body_wave: ComplexArray | None = None


def refined_view(flow: Flow, frame: Preview, vertices: FloatArray, stale: IsStale = lambda: False) -> Refined | None:
    """Follow up a preview; None as soon as ``stale()`` says that nobody waits for it any more.

    Raises
    ------
    SingularIncidenceError
        If the shadow line crosses itself.
    """
    request, body = frame.request, flow.body
    line, drawn = shadow_line(body, request.direction), replace(frame.fan, error=end_error(frame.fan))
    if stale():
        return None
    steps = len(frame.fan.travel_time) - 1
    fan = launch(flow, line, length=frame.fan.length, n_rays=request.rays, n_steps=steps)
    if stale():
        return None
    angles = np.arange(-180.0, 180.0 + CUT_STEP / 2, CUT_STEP)
    if speed_of(body) is not None:
        return Refined(request, drawn, line, fan, None, angles, None)
    levels, wave = _on_body(fan, request, vertices, stale)
    if stale():
        return None
    return Refined(request, drawn, line, fan, levels, angles, far_cut(fan, request, angles), wave)


def far_cut(fan: RayFan, request: ViewRequest, angles: FloatArray, method: str = "auto") -> FarField:
    """Far field of the cut at theta (m,), degrees."""
    directions = cut_directions(angles, request.cut)
    return far_field(fan, directions, wavenumber=request.wavenumber, boundary=request.kind, method=method)


def _on_body(
    fan: RayFan, request: ViewRequest, vertices: FloatArray, stale: IsStale
) -> tuple[FloatArray | None, ComplexArray | None]:
    """Levels of the total field at points of the body (n, 3), and its values, which a conductor does not have here.

    Nothing where currents cost too much, or the equation of a body that has no others.
    """
    k = request.wavenumber
    alone = not has_expansions(fan.body, request.kind)
    if request.boundary == "pec" or alone:
        # the far-field cut takes the same currents
        if not alone and not affordable(fan, 2 * round(360 / CUT_STEP), k, distant=True):
            return None, None
        try:
            currents = cached_currents(fan, k, request.kind)
        except InvalidInputError:
            return None, None
        if request.boundary == "pec":
            return current_levels(currents, vertices), None
    values = np.empty(len(vertices), dtype=complex)
    for first in range(0, len(vertices), BLOCK):
        part = slice(first, first + BLOCK)
        values[part] = surface_values(fan, vertices[part], wavenumber=k, boundary=request.kind)
        if stale():
            return None, None
    return levels_of(values), values


def cut_directions(angles: FloatArray, azimuth: float) -> FloatArray:
    """Directions of a cut: theta (m,) in degrees, negative on the opposite half plane: (m, 3)."""
    return directions_from_angles(np.radians(angles), np.radians(azimuth))
