"""The fan of one incidence by the route of sweeps: milliseconds, where following the line to rounding takes tenths.

It is the fan of `creeping.rays.launch` with a line that has no curves to draw, equal numbers of rays and no rays
inserted, and an error that has not been measured.
"""

from dataclasses import replace

import numpy as np

from creeping._errors import SingularIncidenceError
from creeping._typing import Any, ArrayLike, FloatArray
from creeping.phaseflow.geodesic import normal_curvature
from creeping.phaseflow.tracing import MapError, compiled_parts, pack, trace_states
from creeping.rays.fan import CHECKED_RAYS, Flow, RayFan, RayStatus, launch, rough_from
from creeping.rays.launch_points import line_tangents
from creeping.rays.shadow import ShadowLine, shadow_line
from creeping.rays.spreading import spread, zeros_passed
from creeping.surface import unit_direction
from creeping.sweeping.carrying import carried
from creeping.sweeping.request import NO_RAY, SINGULAR
from creeping.sweeping.shadow_lines import shadow_lines


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
    starts = lines.launch_points[0, there]
    first = pack(starts, np.broadcast_to(d, starts.shape), lanes=12)[:, None]
    states = np.concatenate([first, carried(flow, lines, times[1:], lanes=12)[0, there]], axis=1)
    return _assembled(flow, ShadowLine(body, d, (), distance), lines, there, states, times)


def measured(fan: RayFan) -> RayFan:
    """The fan with the error of (x, p) at its end, against direct integration of some rays."""
    if not len(fan.points):
        return fan
    chosen = np.unique(np.linspace(0, len(fan.points) - 1, CHECKED_RAYS).astype(int))
    starts = pack(fan.points[chosen, 0], fan.directions[chosen, 0])
    exact = trace_states(fan.body, starts, fan.travel_time[-1:], rtol=1e-12)[:, 0]
    ends = np.concatenate([fan.points[chosen, -1], fan.directions[chosen, -1]], axis=1)
    error = np.linalg.norm(ends - exact, axis=1)
    return replace(fan, error=MapError(float(np.sqrt(np.mean(error**2))), float(error.max()), len(chosen)))


def _assembled(flow: Flow, line: ShadowLine, lines: Any, there: Any, states: FloatArray, times: FloatArray) -> RayFan:
    body, d, starts = line.body, line.direction, states[:, 0, :3]
    points, directions = states[..., :3].copy(), states[..., 3:6].copy()
    across = np.concatenate([starts, line_tangents(body, starts, d)], axis=1)
    spreading, rate, stalled = spread(body, across, np.broadcast_to(d, starts.shape), states)
    rough = rough_from(body, points, times)
    # a flow writes where a ray detaches beside every state
    detachment = states[:, -1, 11]
    status = np.where(np.isfinite(detachment), int(RayStatus.DETACHED), int(RayStatus.OK))
    status[rough < detachment] = RayStatus.ROUGH
    status[stalled] = RayStatus.STALLED
    arcs = lines.arc_index[0, there].astype(np.int64)
    numbers, arc = np.unique(arcs, return_inverse=True)
    closed = lines.closed[0, there]
    return RayFan(
        body=body,
        line=line,
        points=points,
        directions=directions,
        travel_time=times,
        eikonal=lines.launch_phase[0, there][:, None] + times,
        spreading=spreading,
        spreading_rate=rate,
        curvature=normal_curvature(body, points, directions),
        attenuation=states[..., 10].copy(),
        caustic_index=zeros_passed(spreading),
        status=status.astype(np.int64),
        detachment=np.minimum(detachment, rough),
        curve_index=lines.curve_index[0, there].astype(np.int64),
        arc_index=arc.astype(np.int64),
        arclength=lines.arclength[0, there],
        closed_arcs=tuple(bool(closed[np.flatnonzero(arc == k)[0]]) for k in range(len(numbers))),
        error=MapError(0.0, 0.0, 0),
        flow_error=flow.error,
    )
