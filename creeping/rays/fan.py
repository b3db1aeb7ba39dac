"""The fan of creeping rays: geodesics launched from the shadow line with initial tangent d.

Ray sigma starts at x0(sigma) with p = d; on a plain body t is arclength. Neighbouring rays part by J = c I,

    I(t) = I(0) M11(t) + I'(0) M12(t),   I(0) = 1/c,   I'(0) = (J'(0) - (p.grad c))/c,

M the Jacobi matrix that the flow carries along, sigma measured across the ray, J(0) = 1 and J'(0) as in
`creeping.geodesics.equations.launch_spreading`. Every zero of J passed is a caustic. A creeping ray needs kappa_n > 0:
where kappa_n first falls to 0 it is detached; its geometry goes on, its field does not.

Sources: Derivations, R3 and R4.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

import numpy as np

from creeping._presenting import DrawnOnBody, brief
from creeping._typing import Any, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.geodesics.equations import speed_values
from creeping.geodesics.integrator import MapError, pack, trace_states
from creeping.geometry.curvature import gaussian_curvature, normal_curvature
from creeping.geometry.surface import Surface, fingerprint, size
from creeping.rays.spreading import spread, zeros_passed
from creeping.shadow.attachment import (
    Arc,
    launch_positions,
    launching_arcs,
    line_tangents,
    parting_positions,
    position_statuses,
)
from creeping.shadow.line import ShadowLine

MAX_RAYS = 200_000
"""Rays beyond which refinement stops."""
ROUGH_SPACING = 0.005
"""Spacing at which rays are looked at for rough ground, in sizes of the body,"""
ROUGH_BLOCK = 64
"""so many rays at a time."""
CHECKED_RAYS = 16
"""Rays that are traced directly to measure the error of a fan."""


class Flow(Protocol):
    """What carries the rays: a `PhaseMap` or a `DirectFlow`."""

    @property
    def body(self) -> Surface:
        """Body whose flow it is."""
        ...

    @property
    def horizon(self) -> float:
        """Time of one leap."""
        ...

    @property
    def error(self) -> MapError | None:
        """Measured error of one leap, None if direct."""
        ...

    def transport(self, states: FloatArray, times: FloatArray) -> FloatArray:
        """Advance states (n, 12) to ascending times (m,): (n, m, 12)."""
        ...


class RayStatus(IntEnum):
    """What became of a ray."""

    OK = 0
    DETACHED = 1
    """kappa_n fell to 0 at ``RayFan.detachment``; the field ends there."""
    OCCLUDED = 2
    """Launched on request from a point that the incident wave does not reach."""
    CONCAVE = 3
    """Launched on request from a point where kappa_n(d) <= 0: no creeping ray."""
    STALLED = 4
    """The speed vanishes at the launch point, so the ray does not move and J is not defined (NaN)."""
    ROUGH = 5
    """Came at ``RayFan.detachment`` to where the body is not smooth enough, by its own word; the field ends there."""


LINE_STATUS = {"attached": RayStatus.OK, "occluded": RayStatus.OCCLUDED, "concave": RayStatus.CONCAVE}
"""Status of a ray that starts well, by the status of the line at its launch point."""


@dataclass(frozen=True, eq=False, repr=False)
class RayFan(DrawnOnBody):
    """Creeping rays of one incidence, all at the same travel times.

    Rays of one arc of the shadow line are consecutive and in its order.

    Attributes
    ----------
    body, line : Surface, ShadowLine
    points, directions : (rays, steps, 3), L and 1
    travel_time : (steps,), L (time for a weighted body)
    eikonal : (rays, steps), L
        d.x0 + travel_time.
    spreading, spreading_rate : (rays, steps), 1 and 1/L
        J and J'.
    curvature : (rays, steps), 1/L
        kappa_n.
    attenuation : (rays, steps), L^(1/3)
        Integral of c max(kappa_n, 0)^(2/3) over travel time; it stays from where the ray detaches.
    caustic_index : (rays, steps)
        Zeros of J passed.
    status : (rays,)
        Codes of `RayStatus`.
    detachment : (rays,), L
        Travel time at which kappa_n first falls to 0 or the ray comes to rough ground, inf if neither happens.
    curve_index, arc_index : (rays,)
        Curve of the shadow line, and arc: rays of one arc are neighbours; with ``status="all"`` an arc is a curve.
    arclength : (rays,), L
        Of the launch point along its curve.
    closed_arcs : tuple of bool
        Whether the first and last ray of each arc are neighbours too.
    error : MapError
        Of (x, p) at the end, measured on some rays against direct integration.
    flow_error : MapError or None
        Of one step of the map that carried the rays; None for direct integration.
    """

    body: Surface
    line: ShadowLine
    points: FloatArray
    directions: FloatArray
    travel_time: FloatArray
    eikonal: FloatArray
    spreading: FloatArray
    spreading_rate: FloatArray
    curvature: FloatArray
    attenuation: FloatArray
    caustic_index: IntArray
    status: IntArray
    detachment: FloatArray
    curve_index: IntArray
    arc_index: IntArray
    arclength: FloatArray
    closed_arcs: tuple[bool, ...]
    error: MapError
    flow_error: MapError | None

    @property
    def length(self) -> float:
        """Travel time of the last step."""
        return float(self.travel_time[-1])

    @property
    def status_counts(self) -> dict[str, int]:
        """Number of rays of each status that occurs, by name."""
        return {s.name: int(np.sum(self.status == s)) for s in RayStatus if np.any(self.status == s)}

    def __repr__(self) -> str:
        counts = ", ".join(f"{count} {name}" for name, count in self.status_counts.items())
        error = f"rms {self.error.rms:.1e}, max {self.error.max:.1e} ({self.error.samples} rays traced)"
        arcs = len(self.closed_arcs)
        return (
            f"RayFan({len(self.points)} rays x {len(self.travel_time)} steps to {self.length:g}, "
            f"{arcs} arc{'s' * (arcs != 1)}, on {brief(self.body)})\n"
            f"  {counts or 'no rays'}; caustics passed: up to {int(self.caustic_index[:, -1:].max(initial=0))}\n"
            f"  error at the end: {error if self.error.samples else 'not measured'}"
        )


def launch(
    flow: Flow,
    line: ShadowLine,
    *,
    length: float,
    n_rays: int | None = None,
    n_steps: int | None = None,
    status: str = "attached",
    max_gap: float | None = None,
) -> RayFan:
    """Launch the fan of creeping rays of an incidence.

    Parameters
    ----------
    flow : PhaseMap or DirectFlow
        Of the body of the line.
    line : ShadowLine
    length : float, L (travel time for a weighted body)
    n_rays : int, optional
        Rays, shared among the arcs by length; one per point of the line if not given.
    n_steps : int, optional
        Equal steps of travel time; at least 64 and enough to count caustics if not given.
    status : {"attached", "all"}
        "all" launches from occluded and concave points too, as in Figure 6 of Ying and Candes 2006.
    max_gap : float, optional
        Rays are inserted until neighbours stay closer than this, L; 0.1 body sizes if not given, inf for none.

    Returns
    -------
    RayFan
        Empty (0 rays) if no point of the line launches.

    Raises
    ------
    InvalidInputError
        If the flow is of another body, or a number is out of range.
    """
    body = line.body
    if flow.body is not body and fingerprint(flow.body) != fingerprint(body):
        raise InvalidInputError(f"the flow is of {flow.body!r}, the line of {body!r}; use one body for both")
    if not (np.isfinite(length) and length > 0):
        raise InvalidInputError(f"length = {length!r} is not a positive finite number")
    if status not in ("attached", "all"):
        raise InvalidInputError(f"status = {status!r} is neither 'attached' nor 'all'")
    for name, number in (("n_rays", n_rays), ("n_steps", n_steps)):
        if number is not None and (not isinstance(number, (int, np.integer)) or number < 1):
            raise InvalidInputError(f"{name} = {number!r} is not a whole number >= 1")
    gap = 0.1 * size(body) if max_gap is None else float(max_gap)
    if not gap > 0:
        raise InvalidInputError(f"max_gap = {max_gap!r} is not positive; give inf for no refinement")
    times = np.linspace(0.0, length, (n_steps or enough_steps(body, line, length)) + 1)
    arcs = launching_arcs(line, every=status == "all")
    arc, arclength = launch_positions(line, arcs, n_rays)
    starts = _starts(line, arcs, arc, arclength)
    states = _carry(flow, line, starts[:, :3], times)
    while True:
        new_arc, new_arclength = parting_positions(states[..., :3], arcs, arc, arclength, gap)
        if not len(new_arc) or len(arc) + len(new_arc) > MAX_RAYS:
            break
        new_starts = _starts(line, arcs, new_arc, new_arclength)
        arc, arclength = np.concatenate([arc, new_arc]), np.concatenate([arclength, new_arclength])
        order = np.lexsort((arclength, arc))
        arc, arclength = arc[order], arclength[order]
        starts = np.concatenate([starts, new_starts])[order]
        states = np.concatenate([states, _carry(flow, line, new_starts[:, :3], times)])[order]
    return _assemble(flow, line, arcs, arc, arclength, starts, states, times)


def enough_steps(body: Surface, line: ShadowLine, length: float) -> int:
    """Steps of a fan unless their number is given: at least 64, and four between two zeros of J.

    Zeros are at least pi/sqrt(max K) apart.
    """
    coarse = np.concatenate([curve.points for curve in line.curves] or [np.zeros((0, 3))])
    uv = np.stack(np.meshgrid(*[np.linspace(0, 1, 17)] * 2), axis=-1).reshape(-1, 2)
    points = np.concatenate([coarse, *(chart.point(uv) for chart in body.atlas.charts)])
    fastest = float(np.max(speed_values(body, points)))
    curved = float(np.sqrt(np.max(np.abs(gaussian_curvature(body, points))))) * fastest
    return int(max(64, np.ceil(4 * length * curved / np.pi)))


def _starts(line: ShadowLine, arcs: list[Arc], arc: IntArray, arclength: FloatArray) -> FloatArray:
    """Points and tangents of the line at the positions: (n, 6)."""
    starts = np.empty((len(arc), 6))
    curve_of = np.array([a.curve for a in arcs], dtype=int)
    for index, curve in enumerate(line.curves):
        mine = curve_of[arc] == index if len(arc) else np.zeros(0, dtype=bool)
        if np.any(mine):
            points = curve.at(arclength[mine] % curve.length)
            starts[mine] = np.concatenate([points, line_tangents(line.body, points, line.direction)], axis=1)
    return starts


def _carry(flow: Flow, line: ShadowLine, points: FloatArray, times: FloatArray) -> FloatArray:
    """States with all that rides along: (rays, steps, 12)."""
    if not len(points):
        return np.empty((0, len(times), 12))
    directions = np.broadcast_to(line.direction, points.shape)
    return flow.transport(pack(points, directions, lanes=12), times)


def _assemble(
    flow: Flow,
    line: ShadowLine,
    arcs: list[Arc],
    arc: IntArray,
    arclength: FloatArray,
    starts: FloatArray,
    states: FloatArray,
    times: FloatArray,
) -> RayFan:
    curve_index = np.array([arcs[k].curve for k in arc], dtype=np.int64)
    lengths = np.array([curve.length for curve in line.curves])
    first = pack(starts[:, :3], np.broadcast_to(line.direction, (len(starts), 3)))
    return fan_of(
        flow,
        line,
        starts,
        states,
        times,
        launched=np.array([LINE_STATUS[one] for one in position_statuses(line, arcs, arc, arclength)], dtype=np.int64),
        curve_index=curve_index,
        arc_index=arc,
        arclength=arclength % lengths[curve_index] if len(arc) else arclength,
        closed_arcs=tuple(a.closed for a in arcs),
        error=end_error(line.body, first, states[:, -1, :6], float(times[-1])),
    )


def fan_of(
    flow: Flow,
    line: ShadowLine,
    starts: FloatArray,
    states: FloatArray,
    times: FloatArray,
    *,
    launched: IntArray,
    **places: Any,
) -> RayFan:
    """Fan of rays that have been carried.

    Parameters
    ----------
    flow, line : Flow, ShadowLine
    starts : (rays, 6)
        Points and tangents of the line where rays start.
    states : (rays, steps, 12)
        At the times, the first of which is 0.
    times : (steps,)
    launched : (rays,)
        Codes of `RayStatus` where they start.
    **places
        ``curve_index``, ``arc_index``, ``arclength``, ``closed_arcs`` and ``error`` of the fan.
    """
    body = line.body
    points, directions = states[..., :3].copy(), states[..., 3:6].copy()
    spreading, rate, stalled = spread(body, starts, np.broadcast_to(line.direction, (len(starts), 3)), states)
    # a flow writes where a ray detaches beside every state
    detachment = states[:, -1, 11].copy()
    status = launched.copy()
    # a ray that never was a creeping ray keeps the reason
    status[(status == RayStatus.OK) & np.isfinite(detachment)] = RayStatus.DETACHED
    rough = rough_from(body, points, times)
    status[((status == RayStatus.OK) | (status == RayStatus.DETACHED)) & (rough < detachment)] = RayStatus.ROUGH
    status[stalled] = RayStatus.STALLED
    return RayFan(
        body=body,
        line=line,
        points=points,
        directions=directions,
        travel_time=times,
        eikonal=(starts[:, :3] @ line.direction)[:, None] + times,
        spreading=spreading,
        spreading_rate=rate,
        curvature=normal_curvature(body, points, directions),
        attenuation=states[..., 10].copy(),
        caustic_index=zeros_passed(spreading),
        status=status,
        detachment=np.minimum(detachment, rough),
        flow_error=flow.error,
        **places,
    )


def rough_from(body: Surface, points: FloatArray, times: FloatArray) -> FloatArray:
    """Travel time (rays,) of the last place before rough ground, inf on rays that do not come there."""
    rough: Any = getattr(body, "rough", None)
    if rough is None or not points.size:
        return np.full(len(points), np.inf)
    # between the steps on chords: rough places may be small
    parts = int(np.ceil(np.max(np.diff(times), initial=0.0) / (ROUGH_SPACING * size(body)))) or 1
    fine = np.interp(np.arange((len(times) - 1) * parts + 1) / parts, np.arange(len(times)), times)
    share = (np.arange(parts) / parts)[:, None]
    found = np.full(len(points), np.inf)
    for first in range(0, len(points), ROUGH_BLOCK):
        path = points[first : first + ROUGH_BLOCK, :, None]
        dense = path[:, :-1] + share * (path[:, 1:] - path[:, :-1])
        dense = np.concatenate([dense.reshape(len(path), -1, 3), path[:, -1]], axis=1)
        met = rough(dense)
        before = np.maximum(np.argmax(met, axis=1) - 1, 0)
        found[first : first + ROUGH_BLOCK] = np.where(met.any(axis=1), fine[before], np.inf)
    return found


def end_error(body: Surface, first: FloatArray, last: FloatArray, time: float) -> MapError:
    """Error of (x, p) at the end (rays, 6) against direct integration of evenly chosen rays from their start."""
    if not len(first):
        return MapError(0.0, 0.0, 0)
    chosen = np.unique(np.linspace(0, len(first) - 1, CHECKED_RAYS).astype(int))
    exact = trace_states(body, first[chosen], np.array([time]), rtol=1e-12)[:, 0]
    error = np.linalg.norm(last[chosen] - exact, axis=1)
    return MapError(float(np.sqrt(np.mean(error**2))), float(error.max()), len(chosen))
