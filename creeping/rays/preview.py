"""The fan of one incidence by the route of sweeps: milliseconds, where following the line to rounding takes tenths.

It is the fan of `creeping.rays.launch` with a line that has no curves to draw, equal numbers of rays and no rays
inserted, and an error that has not been measured.
"""

from dataclasses import replace

import numpy as np

from creeping._typing import Any, ArrayLike
from creeping.errors import SingularIncidenceError
from creeping.geodesics.integrator import MapError, compiled_parts, pack
from creeping.geometry.directions import unit_direction
from creeping.rays.fan import Flow, RayFan, RayStatus, end_error, fan_of, launch
from creeping.rays.transport import carried
from creeping.shadow.attachment import line_tangents
from creeping.shadow.line import ShadowLine, shadow_line
from creeping.shadow.many import shadow_lines
from creeping.shadow.status import NO_RAY, SINGULAR


def quick_fan(flow: Flow, direction: ArrayLike, *, length: float, n_rays: int, n_steps: int) -> RayFan:
    """Fan of an incidence.

    Parameters
    ----------
    flow : PhaseMap or DirectFlow
    direction : (3,)
    length : float, L (travel time for a weighted body)
    n_rays, n_steps : int

    Returns
    -------
    RayFan
        On a body without a compiled level that of `launch`.

    Raises
    ------
    InvalidInputError
        On a bad direction.
    SingularIncidenceError
        If the shadow line crosses itself.
    """
    body: Any = flow.body
    d = unit_direction(direction)
    if compiled_parts(body) is None:
        line = shadow_line(body, d)
        return launch(flow, line, length=length, n_rays=n_rays, n_steps=n_steps, max_gap=np.inf)
    lines = shadow_lines(body, d[None], n_rays)
    distance = float(lines.singular_distance[0])
    if lines.status[0] == SINGULAR:
        raise SingularIncidenceError(
            f"the shadow line of direction {d.tolist()} crosses itself; turn it by a thousandth", distance=distance
        )
    times = np.linspace(0.0, length, n_steps + 1)
    there = lines.curve_index[0] != NO_RAY
    points = lines.launch_points[0, there]
    first = pack(points, np.broadcast_to(d, points.shape), lanes=12)[:, None]
    # arcs are numbered anew: those of no attached ray are left out
    _, at, arc = np.unique(lines.arc_index[0, there], return_index=True, return_inverse=True)
    return fan_of(
        flow,
        ShadowLine(body, d, (), distance),
        np.concatenate([points, line_tangents(body, points, d)], axis=1),
        np.concatenate([first, carried(flow, lines, times[1:], lanes=12)[0, there]], axis=1),
        times,
        launched=np.full(len(points), int(RayStatus.OK)),
        curve_index=lines.curve_index[0, there].astype(np.int64),
        arc_index=arc.astype(np.int64),
        arclength=lines.arclength[0, there],
        closed_arcs=tuple(bool(closed) for closed in lines.closed[0, there][at]),
        error=MapError(0.0, 0.0, 0),
    )


def measured(fan: RayFan) -> RayFan:
    """The fan with the error of (x, p) at its end, against direct integration of some rays."""
    states = np.concatenate([fan.points, fan.directions], axis=2)
    return replace(fan, error=end_error(fan.body, states[:, 0], states[:, -1], fan.length))
