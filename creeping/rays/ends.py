"""What becomes of rays: where they start, and where they end before the fan does.

They end detached, at what a body calls not smooth, at its edges and tips.

Also here: where the rays of one fan start: the launch points of the line, and further ones between them.

A position is an arclength that grows along its arc, beyond the curve's length where the arc comes round.

Also here: how much of a body with edges and tips the creeping rays of an incidence do not serve.

    line        (l_e + l_t)/(l + l_e + l_t)               l of the curves, l_e on edges, l_t next to tips
    rays        sum' h e^(-ξ Im τ)/sum h                  h the spacing of rays, sum' over those that ended there
    outline     the same as line, dl |T - (T.d) d| for dl, of l the attached part alone

ξ = (k/2)^(1/3) A with the attenuation integral A up to the end; Im τ is that of the slowest mode of any boundary, so
the share is one of amplitudes and rather too large.

Also here: where rays come to a place at which the body (`Surface.non_smooth`) is not smooth enough for them.

Sources: Derivations, R4, R6 and F3.
"""

from enum import IntEnum
from typing import NamedTuple

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping.geodesics.states import CREASE, DETACHMENT, END, WHOLE, X
from creeping.geometry.piecewise import is_piecewise, nearest_crease
from creeping.geometry.surface import Surface, size
from creeping.shadow.attachment import Arc, LaunchPoints
from creeping.shadow.line import ShadowLine


class RayStatus(IntEnum):
    """Status of a ray: whether it was launched, and where it ended.

    Examples
    --------
    >>> import creeping as cr
    >>> cr.RayStatus.OK.name, int(cr.RayStatus.OK)
    ('OK', 0)
    """

    OK = 0
    DETACHED = 1
    """kappa_n fell to 0 at ``RayFan.detachment``; the field ends there."""
    OCCLUDED = 2
    """Launched on request from a point that the incident wave does not reach."""
    CONCAVE = 3
    """Launched on request from a point where kappa_n(d) <= 0: no creeping ray."""
    STALLED = 4
    """The speed vanishes at the launch point, so the ray does not move and J is not defined (NaN)."""
    NON_SMOOTH = 5
    """Reached, at ``RayFan.detachment``, a region that the body declares non-smooth, or a point at which the geodesic
    cannot be continued; the field ends there."""
    EDGE = 6
    """Reached an edge of the body at ``RayFan.detachment``; its contribution beyond is left out."""
    TIP = 7
    """Reached a tip of the body at ``RayFan.detachment``; its contribution beyond is left out."""


AT_CREASES = (RayStatus.EDGE, RayStatus.TIP)
"""Statuses of rays that end at a crease,"""
ENDED = (RayStatus.DETACHED, RayStatus.NON_SMOOTH, *AT_CREASES)
"""and of rays whose field ends at ``RayFan.detachment``."""
FEW_RAYS = 4096
"""Rays that are enough for a line of several arcs to begin with, or 32 for each in the mean: of many holes and fillets
each has as many points as a body's only curve."""
NON_SMOOTH_SPACING = 0.005
"""Spacing at which rays are looked at for non-smooth regions, in sizes of the body."""


def ends_of(
    body: Any, points: FloatArray, path: FloatArray, times: FloatArray, status: IntArray
) -> tuple[IntArray, FloatArray]:
    """Status of rays, and the travel time at which the field of each ends, inf where it does not.

    Parameters
    ----------
    body : Surface
    points : (rays, 3), L
        Where they start.
    path : (rays, steps, lanes)
        Their states at the times.
    times : (steps,), L
    status : (rays,)
        That of the line where they start: a ray that never was a creeping ray keeps it.
    """
    # a flow writes where a ray detaches beside every state
    detachment, creeping = path[:, -1, DETACHMENT], status == RayStatus.OK
    status = np.where(creeping & np.isfinite(detachment), RayStatus.DETACHED, status)
    first = detachment
    if path.shape[-1] > WHOLE:
        end = path[:, -1, END]
        # the last is of number -1: a ray that could not go on, far from any crease
        kinds = np.array([*(_of_crease(crease, RayStatus.EDGE) for crease in body.creases), RayStatus.NON_SMOOTH])
        status = np.where(creeping & (end < first), kinds[path[:, -1, CREASE].astype(np.int64)], status)
        first = np.minimum(first, end)
    if hasattr(body, "non_smooth"):
        begun = np.concatenate([points[:, None], path[..., X]], axis=1) if times[0] > 0 else path[..., X]
        since = np.concatenate([[0.0], times]) if times[0] > 0 else times
        met = non_smooth_from(body, begun, since)
        # a ray that begins there has ended at the same time, without a crease
        sooner = np.isfinite(met) & (met <= first)
        status = np.where(creeping & sooner, _refused(body, begun, since, met), status)
        first = np.minimum(first, met)
    return status, first


def _of_crease(crease: Any, other: RayStatus) -> RayStatus:
    """Status of rays that end at an edge or tip, or the other one."""
    return {"edge": RayStatus.EDGE, "tip": RayStatus.TIP}.get(crease.kind, other)


def _refused(body: Any, path: FloatArray, times: FloatArray, met: FloatArray) -> IntArray:
    """Status (rays,) of rays that come at times ``met`` to what is not smooth enough: a body with creases says why."""
    out = np.full(len(met), int(RayStatus.NON_SMOOTH))
    if not is_piecewise(body):
        return out
    rows = np.flatnonzero(np.isfinite(met))
    places = np.array([[np.interp(met[row], times, path[row, :, axis]) for axis in range(3)] for row in rows])
    crease, _ = nearest_crease(body, places.reshape(-1, 3))
    for row, number in zip(rows, crease, strict=True):
        out[row] = _of_crease(body.creases[number], RayStatus.NON_SMOOTH)
    return out


class Starts(NamedTuple):
    """Starts of one incidence in the order of their arcs.

    Attributes
    ----------
    arcs : list of Arc
        Those that hold rays.
    arc : (n,)
    position : (n,), L
    points : (n, 3), L
    state : (n,)
        Codes of `creeping.shadow.status.STATUSES`.
    spacing, arclength : (n,), L
        Length of the line that each stands for, and the position modulo the length of its curve.
    """

    arcs: list[Arc]
    arc: IntArray
    position: FloatArray
    points: FloatArray
    state: IntArray
    spacing: FloatArray
    arclength: FloatArray

    @classmethod
    def of(cls, line: ShadowLine, n_rays: int | None, launch_from: str) -> "Starts":
        """The launch points of a line: ``n_rays``, or for None at its spacing; one at least on each arc."""
        arcs = line.arcs(launch_from)
        if n_rays is None:
            shares = [(a.end - a.start) / line.curves[a.curve].length * len(line.curves[a.curve].points) for a in arcs]
            n_rays = sum(max(1, round(share)) for share in shares)
            if len(arcs) > 1:
                n_rays = min(n_rays, max(FEW_RAYS, 32 * len(arcs)))
        launch = line.launch_points(max(n_rays, len(arcs)), launch_from)
        there = np.flatnonzero(launch.there[0])
        _, arc = np.unique(launch.arc_index[0, there], return_inverse=True)
        position, found = launch.arclength[0, there].copy(), []
        for number in range(int(arc.max(initial=-1)) + 1):
            mine = np.flatnonzero(arc == number)
            curve, spacing = int(launch.curve_index[0, there[mine[0]]]), launch.spacing[0, there[mine]]
            round_ = np.cumsum(np.diff(position[mine], prepend=0.0) < 0)
            position[mine] += round_ * line.curves[curve].length
            closed = bool(launch.closed[0, there[mine[0]]] == 1)
            begin = float(position[mine[0]]) - (0.0 if closed else 0.5 * float(spacing[0]))
            found.append(Arc(curve, begin, begin + float(np.sum(spacing)), closed))
        state = launch.state[0, there].astype(np.int64)
        return cls(
            found, arc, position, launch.points[0, there], state, launch.spacing[0, there], launch.arclength[0, there]
        )

    @classmethod
    def at(cls, line: ShadowLine, arcs: list[Arc], arc: IntArray, position: FloatArray) -> "Starts":
        """Those at positions of the line (n,), (n,)."""
        points, state = np.empty((len(arc), 3)), np.empty(len(arc), dtype=np.int64)
        for number, one in enumerate(arcs):
            mine = np.flatnonzero(arc == number)
            points[mine] = line.curves[one.curve].at(position[mine])
            state[mine] = line.curves[one.curve].state_at(position[mine])
        lengths = np.array([line.curves[one.curve].length for one in arcs])
        return cls(arcs, arc, position, points, state, np.full(len(arc), np.nan), position % lengths[arc])

    def parting(self, points: FloatArray, gap: float, known: IntArray | None) -> tuple[IntArray, FloatArray]:
        """Arcs and positions half-way between neighbours that come to part by more than ``gap``: (m,), (m,).

        ``points`` (rays, steps, 3) are those of the rays. ``known`` (rays,) are the steps before each ray ends; what
        comes after says nothing.
        """
        found = [(np.zeros(0, dtype=np.int64), np.zeros(0))]
        for number, one in enumerate(self.arcs):
            mine = np.flatnonzero(self.arc == number)
            if len(mine) < 2:
                continue
            following, after = np.roll(mine, -1), np.roll(self.position[mine], -1)
            after[-1] += one.end - one.start
            if not one.closed:
                mine, following, after = mine[:-1], following[:-1], after[:-1]
            distance = np.linalg.norm(points[following] - points[mine], axis=-1)
            if known is not None:
                common = np.minimum(known[following], known[mine])
                distance[np.arange(distance.shape[1]) >= common[:, None]] = 0.0
            # below a spacing of rounding size more rays would tell nothing
            wide = (np.max(distance, axis=-1) > gap) & (after - self.position[mine] > 1e-9 * (one.end - one.start))
            middle = 0.5 * (self.position[mine] + after)[wide]
            found.append((np.full(len(middle), number), middle))
        arc, position = (np.concatenate(of) for of in zip(*found, strict=True))
        return arc, position

    def joined(self, more: "Starts") -> tuple["Starts", IntArray]:
        """Both in order, and where each comes from in the one followed by the other."""
        arc, position = np.concatenate([self.arc, more.arc]), np.concatenate([self.position, more.position])
        points, state = np.concatenate([self.points, more.points]), np.concatenate([self.state, more.state])
        order = np.lexsort((position, arc))
        arc, position, spacing = arc[order], position[order], np.empty(len(order))
        for number, one in enumerate(self.arcs):
            mine = arc == number
            s, long = position[mine], one.end - one.start
            # half the way to either neighbour
            ends = [s[-1] - long, *s, s[0] + long] if one.closed else [2 * one.start - s[0], *s, 2 * one.end - s[-1]]
            spacing[mine] = 0.5 * (np.array(ends[2:]) - np.array(ends[:-2]))
        arclength = np.concatenate([self.arclength, more.arclength])[order]
        return Starts(self.arcs, arc, position, points[order], state[order], spacing, arclength), order

    def launch_points(self, line: ShadowLine) -> LaunchPoints:
        """`LaunchPoints` of one incidence."""
        curve = np.array([self.arcs[k].curve for k in self.arc], dtype=np.int64)
        closed = np.array([self.arcs[k].closed for k in self.arc], dtype=float)
        arc = self.arc.astype(float)
        rows: tuple[Any, ...] = self.points, self.arclength, curve, arc, self.spacing, closed, self.state
        return LaunchPoints(line.wave[None], *(row[None] for row in rows))


class Losses(NamedTuple):
    """Shares, from 0 to 1, that edges and tips take; 0 of a smooth body.

    Attributes
    ----------
    line : float
        Of the length of the shadow line: it goes on along edges, where no creeping ray starts.
    rays : float
        Of the rays, that end at an edge or a tip, each by what is left of its wave there.
    outline : float
        Of the outline of the lit side seen along d, that has no creeping wave.
    """

    line: float
    rays: float
    outline: float


def outline_share(line: ShadowLine) -> float:
    """Share of the outline that is on edges and tips."""
    lost = line.at_tips + sum(_across(part.points, line.direction) for part in line.on_edges)
    if not lost:
        return 0.0
    kept = 0.0
    for curve in line.curves:
        for start, end, status in curve.arcs:
            if status == "attached":
                kept += _across(curve.at(np.linspace(start, end, 257)), line.direction)
    return float(lost / (lost + kept))


def _across(points: FloatArray, direction: FloatArray) -> float:
    """Length of a polyline seen along d, L."""
    chords = np.diff(points, axis=0)
    return float(np.sum(np.linalg.norm(chords - (chords @ direction)[:, None] * direction, axis=1)))


def non_smooth_from(body: Surface, points: FloatArray, times: FloatArray) -> FloatArray:
    """Travel time (rays,) of the last place before a non-smooth region, inf on rays that do not come there."""
    non_smooth: Any = getattr(body, "non_smooth", None)
    if non_smooth is None or not points.size:
        return np.full(len(points), np.inf)
    # between the steps on chords: non-smooth places may be small
    parts = int(np.ceil(np.max(np.diff(times), initial=0.0) / (NON_SMOOTH_SPACING * size(body)))) or 1
    fine = np.interp(np.arange((len(times) - 1) * parts + 1) / parts, np.arange(len(times)), times)
    share = (np.arange(parts) / parts)[:, None]
    found = np.full(len(points), np.inf)
    for first in range(0, len(points), 64):
        path = points[first : first + 64, :, None]
        dense = path[:, :-1] + share * (path[:, 1:] - path[:, :-1])
        dense = np.concatenate([dense.reshape(len(path), -1, 3), path[:, -1]], axis=1)
        met = non_smooth(dense)
        before = np.maximum(np.argmax(met, axis=1) - 1, 0)
        found[first : first + 64] = np.where(met.any(axis=1), fine[before], np.inf)
    return found
