"""The fan of creeping rays: geodesics launched from the shadow line along the wave, with initial tangent d.

Ray sigma starts at x0(sigma) with p = d, of a point source the unit vector from it to x0; on a plain body t is
arclength. Neighbouring rays part by J = c I,

    I(t) = I(0) M11(t) + I'(0) M12(t),   I(0) = 1/c,   I'(0) = (J'(0) - (p.grad c))/c,

M the Jacobi matrix that the flow carries along, sigma measured across the ray, J(0) = 1 and J'(0) as in
`creeping.geodesics.equations.launch_spreading`. Every zero of J passed is a caustic. A creeping ray needs kappa_n > 0:
where kappa_n first falls to 0 it is detached; its geometry goes on, its field does not.

Sources: Derivations, R3, R4 and R19.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np

from creeping._presenting import DrawnOnBody, brief
from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.geodesics.attenuation import curvature_values
from creeping.geodesics.equations import points_of_charts
from creeping.geodesics.integrator import ErrorEstimate, trace_states
from creeping.geodesics.pieces import Passages, passages, trace_pieces
from creeping.geodesics.states import ATTENUATION, P, X, known_steps, pack, whole_lanes
from creeping.geometry.arguments import flag, one_of, real_number, whole_number
from creeping.geometry.checks import unit_of
from creeping.geometry.curvature import gaussian_curvature, normal_curvature
from creeping.geometry.evaluators import speed_of, speed_values
from creeping.geometry.piecewise import has_edges, is_piecewise
from creeping.geometry.surface import Surface, fingerprint, memo, size
from creeping.rays.ends import AT_CREASES, ENDED, FEW_RAYS, Losses, RayStatus, Starts, ends_of, outline_share
from creeping.rays.reach import AUTO, HARD_DECAY, IN_RANGE, ray_length
from creeping.rays.transport import Flow, carried, checked_flow, spread, zeros_passed
from creeping.shadow.attachment import LaunchPoints, line_tangents
from creeping.shadow.line import ShadowLine, checked_launch_from
from creeping.shadow.status import NO_RAY
from creeping.storage.memory import within_budget


@dataclass(frozen=True, eq=False, repr=False)
class RayFan(DrawnOnBody):
    """Creeping rays of one incidence, sampled at common travel times.

    Rays that start on one arc of the shadow line are consecutive, in their order along the arc.

    Attributes
    ----------
    body, line : Surface, ShadowLine
    points, directions : (rays, steps, 3), L and 1
    travel_time : (steps,), L (time for a weighted body)
    eikonal : (rays, steps), L
        Phase over k: d.x0 + travel_time, where x0 is the launch point. For a point source the distance from the source
        to x0 takes the place of d.x0.
    spreading, spreading_rate : (rays, steps), 1 and 1/L
        J and its derivative J'.
    curvature : (rays, steps), 1/L
        kappa_n.
    attenuation : (rays, steps), L^(1/3)
        Integral of c max(kappa_n, 0)^(2/3) over travel time; constant after detachment.
    caustic_index : (rays, steps)
        Number of zeros of J passed so far.
    status : (rays,)
        Codes of `RayStatus`.
    detachment : (rays,), L
        Travel time at which kappa_n first falls to 0 or the ray reaches a non-smooth region, an edge or a tip; inf if
        none of these happens. A ray that reaches an edge or a tip stays there.
    curve_index, arc_index : (rays,)
        Numbers of the curve and of the arc that the ray starts on; with ``launch_from="all"`` each curve is one arc.
    arclength, spacing : (rays,), L
        Arclength of the launch point along its curve, and length of the curve that the ray represents.
    closed_arcs : tuple of bool
        For each arc, whether its first and last ray are neighbours.
    error : ErrorEstimate
        Error of (x, p) at the last step, measured on a sample of rays against direct integration.
    flow : PhaseMap or DirectFlow
        Flow that advanced the rays.

    Examples
    --------
    >>> import numpy as np
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> line = cr.shadow_line(ball, direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, length=2.0, n_rays=16)
    >>> bool(abs(fan.spreading[:, -1] - np.cos(2.0)).max() < 1e-6), list(fan.status_counts)    # J = cos s
    (True, ['OK'])
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
    spacing: FloatArray
    closed_arcs: tuple[bool, ...]
    error: ErrorEstimate
    flow: Flow

    @property
    def length(self) -> float:
        """Travel time of the last step."""
        return float(self.travel_time[-1])

    @property
    def status_counts(self) -> dict[str, int]:
        """Number of rays by name of status; only statuses that occur."""
        return {s.name: int(np.sum(self.status == s)) for s in RayStatus if np.any(self.status == s)}

    @property
    def largest_gap(self) -> float:
        """Largest distance between neighbouring rays at any step, L; 0 if no arc has two rays."""
        widest = 0.0
        for arc, closed in enumerate(self.closed_arcs):
            rays = self.points[self.arc_index == arc]
            if len(rays) > 1:
                following = np.roll(rays, -1, axis=0)[: None if closed else -1]
                apart = np.linalg.norm(following - rays[: len(following)], axis=-1)
                widest = max(widest, float(np.nanmax(apart, initial=0.0)))
        return widest

    @property
    def launched(self) -> BoolArray:
        """Whether the incident wave launched each ray, even if the ray ended early: (rays,)."""
        return np.isin(self.status, (RayStatus.OK, *ENDED))

    @cached_property
    def crossings(self) -> Passages:
        """Crossings of joints by rays on a piecewise smooth body: ray number, travel time, crease number, (n,) each."""
        starts = pack(self.points[:, 0], self.directions[:, 0])
        return passages(self.body, starts, self.length, rtol=getattr(self.flow, "rtol", 1e-10))

    @property
    def least_radius(self) -> float:
        """Least 1/kappa_n, L, on the first part of the rays; NaN without rays, or for a weighted body.

        The first part ends where the Fock parameter is 1, for the wavenumber k at which the median of k/kappa_n over
        the launch points is 10.
        """
        if speed_of(self.body) is not None or not np.any(self.launched):
            return float("nan")
        curvature = self.curvature[self.launched]
        k = IN_RANGE * float(np.median(curvature[:, 0]))
        largest = float(np.max(curvature, initial=0.0, where=np.cbrt(k / 2) * self.attenuation[self.launched] < 1))
        return 1 / largest if largest > 0 else float("nan")

    def losses(self, wavenumber: float | None = None) -> Losses:
        """Shares of shadow line, rays and silhouette that edges and tips take; ``wavenumber`` is that of `launch`."""
        launched, lost = self.launched, 0.0
        ended = launched & np.isin(self.status, AT_CREASES)
        if np.any(ended):
            k = IN_RANGE * float(np.median(self.curvature[launched, 0])) if wavenumber is None else wavenumber
            # a ray that has ended stays where it is, and so does its attenuation
            left = np.exp(-np.cbrt(max(k, 0.0) / 2) * self.attenuation[ended, -1] * HARD_DECAY)
            lost = float(np.sum(self.spacing[ended] * left) / np.sum(self.spacing[launched]))
        return Losses(self.line.edge_share, lost, outline_share(self.line))

    def __repr__(self) -> str:
        counts = ", ".join(f"{count} {name}" for name, count in self.status_counts.items())
        error = f"rms {self.error.rms:.1e}, max {self.error.max:.1e} ({self.error.samples} rays traced)"
        arcs = len(self.closed_arcs)
        radius = f"; radius of curvature {self.least_radius:.3g} {unit_of(self.body)} at least"
        sharpest = "" if np.isnan(self.least_radius) else radius
        return (
            f"RayFan({len(self.points)} rays x {len(self.travel_time)} steps to {self.length:g}, "
            f"{arcs} arc{'s' * (arcs != 1)}, on {brief(self.body)})\n"
            f"  {counts or 'no rays'}; caustics passed: {int(self.caustic_index[:, -1:].max(initial=0))}{sharpest}\n"
            f"  error at the end: {error if self.error.samples else 'not measured'}"
        )


def launch(
    flow: Flow,
    line: ShadowLine,
    *,
    length: float | Literal["auto"] = AUTO,
    wavenumber: float | None = None,
    n_rays: int | None = None,
    n_steps: int | None = None,
    launch_from: str = "attached",
    max_gap: float | None = None,
    measured: bool = True,
) -> RayFan:
    """Launch the fan of creeping rays of an incidence.

    Parameters
    ----------
    flow : PhaseMap or DirectFlow
        Flow on the same body as the shadow line.
    line : ShadowLine
    length : float or "auto", L (travel time for a weighted body)
        Length of the rays. "auto" ends where the wave at ``wavenumber`` has decayed for any boundary
        (`creeping.rays.reach`), but at 4 body sizes at most. For a weighted body it is the travel time of 1.5 body
        sizes.
    wavenumber : float, optional, 1/L
        Lowest wavenumber for which "auto" must suffice; by default that with a median k rho of 10 at the launch points.
    n_rays : int, optional
        Number of rays, distributed over the arcs by length. By default one per point of the line; with
        several arcs at most 4096 or 32 per arc, whichever is more.
    n_steps : int, optional
        Number of equal steps of travel time. By default 64 or more, as many as are needed to count caustics.
    launch_from : {"attached", "all"}
        "attached" launches where the wave grazes a convex, unoccluded part of the line. "all" launches from occluded
        and concave points too, as in Figure 6 of Ying and Candes 2006.
    max_gap : float, optional
        Rays are inserted until neighbours stay closer than this, L. By default 0.1 body sizes; inf inserts none.
        Insertion stops at 32 times as many rays; on a body with edges, spacings are halved at most four times.
        `RayFan.largest_gap` gives the gap that remains.
    measured : bool
        Whether to measure the error at the end of the rays.

    Returns
    -------
    RayFan
        Empty (0 rays) if no point of the line launches a ray.

    Raises
    ------
    InvalidInputError
        If flow and line belong to different bodies, or a number is out of range.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> line = cr.shadow_line(ball, direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, wavenumber=30.0, n_rays=16)
    >>> len(fan.points) >= 16, fan.error.rms < 1e-6             # rays are inserted where neighbours are far apart
    (True, True)
    >>> round(fan.length, 1)                                    # beyond, less than e^-7.5 is left of the wave
    3.5
    """
    one_of(line, "line", ShadowLine, "creeping.shadow_line")
    checked_flow(flow)
    body = line.body
    if flow.body is not body and fingerprint(flow.body) != fingerprint(body):
        raise InvalidInputError(f"the flow is of {flow.body!r}, the line of {body!r}; use one body for both")
    checked_launch_from(launch_from)
    n_rays, n_steps = (None if n is None else whole_number(n, "n_rays or n_steps") for n in (n_rays, n_steps))
    gap = 0.1 * size(body) if max_gap is None else real_number(max_gap, "max_gap")
    if not gap > 0:
        raise InvalidInputError(f"max_gap = {max_gap!r} is not positive; give inf for no refinement")
    measured, length = flag(measured, "measured"), ray_length(line, length, wavenumber=wavenumber)
    steps = n_steps or enough_steps(body, length)
    count = n_rays or sum(len(curve.points) for curve in line.curves)
    lanes = whole_lanes(body)
    within_budget(24.0 * lanes * count * steps, f"{steps} steps of {count} rays", "ask for fewer, or shorter ones")
    times = np.linspace(0.0, length, steps + 1)
    starts = Starts.of(line, n_rays, launch_from)
    states = _carry(flow, line, starts, times)
    # next to edges gaps are halved four times
    most, passes = min(200_000, max(32 * len(starts.arc), FEW_RAYS)), 4 if has_edges(body) else 200_000
    for _ in range(0 if np.isinf(gap) else passes):
        arc, position = starts.parting(states[..., X], gap, known_steps(states, times))
        if not len(arc) or len(starts.arc) + len(arc) > most:
            break
        more = Starts.at(line, starts.arcs, arc, position)
        states = np.concatenate([states, _carry(flow, line, more, times)])
        starts, order = starts.joined(more)
        states = states[order]
    fan = fan_of(flow, line, starts.launch_points(line), states, times)
    return replace(fan, error=end_error(fan)) if measured else fan


def enough_steps(body: Surface, length: float) -> int:
    """Steps of a fan unless their number is given: at least 64, and four between two zeros of J.

    Zeros are at least pi/sqrt(max K) apart.
    """

    def found() -> float:
        points = points_of_charts(body)
        fastest = float(np.max(speed_values(body, points)))
        return float(np.sqrt(np.max(np.abs(gaussian_curvature(body, points))))) * fastest

    curved = memo(body, "fastest oscillation of J", found)
    return int(max(64, np.ceil(4 * length * curved / np.pi)))


def _carry(flow: Flow, line: ShadowLine, starts: Starts, times: FloatArray) -> FloatArray:
    """States with all that is carried along: (rays, steps, 12)."""
    if not len(starts.arc):
        return np.empty((0, len(times), whole_lanes(flow.body)))
    return np.asarray(carried(flow, starts.launch_points(line), times, components=whole_lanes(flow.body))[0])


class RayArrays(NamedTuple):
    """What rays of n incidences are: J and J' (n, rays, steps), codes of `RayStatus` and detachment (n, rays)."""

    spreading: FloatArray
    spreading_rate: FloatArray
    status: IntArray
    detachment: FloatArray


def ray_arrays(body: Surface, launch: LaunchPoints, states: FloatArray, times: FloatArray) -> RayArrays:
    """Rays that have been carried.

    Parameters
    ----------
    body : Surface
    launch : LaunchPoints
        Of n incidences.
    states : (n, rays, steps, 12 or 14)
        At the times, not to be read where there is no ray.
    times : (steps,)
    """
    there = np.nonzero(launch.there)
    full = len(there[0]) == launch.there.size
    # a copy of all states takes as long as a leap
    path = states.reshape(-1, *states.shape[2:]) if full else states[there]
    points = launch.points.reshape(-1, 3) if full else launch.points[there]
    directions = launch.headings[there]
    tangents = None if speed_of(body) is None else line_tangents(body, points, directions)
    J, rate, stalled = spread(body, points, tangents, directions, launch.openings[there], path)
    # by the codes of `PointState`
    begun = np.array([RayStatus.OK, RayStatus.OCCLUDED, RayStatus.CONCAVE])[launch.state[there].astype(int)]
    status, first = ends_of(body, points, path, times, begun)
    status[stalled] = RayStatus.STALLED

    def placed(values: Any, fill: float) -> Any:
        shape = *launch.there.shape, *values.shape[1:]
        if full:
            return values.reshape(shape)
        out = np.full(shape, fill, dtype=values.dtype)
        out[there] = values
        return out

    return RayArrays(placed(J, np.nan), placed(rate, np.nan), placed(status, NO_RAY), placed(first, np.nan))


def fan_of(flow: Flow, line: ShadowLine, launch: LaunchPoints, states: FloatArray, times: FloatArray) -> RayFan:
    """Fan of one incidence whose rays have been carried: states (rays, steps, 12 or 14), the first time 0."""
    body = line.body
    rays = ray_arrays(body, launch, states[None], times)
    points, directions = states[..., X].copy(), states[..., P].copy()
    arc = launch.arc_index[0].astype(np.int64)
    # of a weighted body the kernel gives c^(3/2) times it
    curvature = (
        curvature_values(body, states.reshape(-1, states.shape[-1])).reshape(states.shape[:2])
        if speed_of(body) is None
        else normal_curvature(body, points, directions)
    )
    return RayFan(
        body=body,
        line=line,
        points=points,
        directions=directions,
        travel_time=times,
        eikonal=launch.phase[0][:, None] + times,
        spreading=rays.spreading[0],
        spreading_rate=rays.spreading_rate[0],
        curvature=curvature,
        attenuation=states[..., ATTENUATION].copy(),
        caustic_index=zeros_passed(rays.spreading[0]),
        status=rays.status[0],
        detachment=rays.detachment[0],
        curve_index=launch.curve_index[0],
        arc_index=arc,
        arclength=launch.arclength[0],
        spacing=launch.spacing[0],
        closed_arcs=tuple(bool(launch.closed[0, arc == k][0]) for k in range(int(arc.max(initial=-1)) + 1)),
        error=ErrorEstimate(0.0, 0.0, 0),
        flow=flow,
    )


def end_error(fan: RayFan) -> ErrorEstimate:
    """Error of (x, p) at the end of a fan, against direct integration of evenly chosen rays from their start."""
    if not len(fan.points):
        return ErrorEstimate(0.0, 0.0, 0)
    chosen = np.unique(np.linspace(0, len(fan.points) - 1, 16).astype(int))
    first = pack(fan.points[chosen, 0], fan.directions[chosen, 0])
    # a thousandth of what is to be measured
    rms = np.nan if fan.flow.error is None else fan.flow.error.rms
    rtol = float(np.clip(1e-3 * rms, 1e-12, 1e-9)) if np.isfinite(rms) and rms > 0 else 1e-12
    trace = trace_states if not is_piecewise(fan.body) else lambda *rays, rtol: trace_pieces(*rays, rtol=rtol).states
    exact = trace(fan.body, first, np.array([fan.length]), rtol=rtol)[:, 0]
    error = np.linalg.norm(np.concatenate([fan.points[chosen, -1], fan.directions[chosen, -1]], axis=1) - exact, axis=1)
    return ErrorEstimate(float(np.sqrt(np.mean(error**2))), float(error.max()), len(chosen))
