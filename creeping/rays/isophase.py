"""Iso-phase curves of a fan: where travel time, or the eikonal d.x0 + t, has one value.

Ray sigma meets the level at t(sigma) = level, or level - d.x0(sigma); of a point source R(sigma) is in place of d.x0.
Between two steps the ray is the quintic polynomial with the positions, velocities x' and accelerations x'' of both
ends, put back on the body.

Also here: curves in the plane of two angles, cut where an angle jumps.

An angle jumps by 2 pi across its seam at +-pi: both ends are carried on to the seam. An azimuth jumps by about pi where
a curve passes a pole: no line in the plane belongs there, and the ends stay as they are.

Sources: [YC06b]; Derivations, R14.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from creeping._presenting import DrawnOnBody
from creeping._typing import ArrayLike, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.geodesics.equations import vector_field
from creeping.geometry.arguments import flag, one_of, real_array
from creeping.geometry.checks import UNKNOWN, unit_of
from creeping.geometry.evaluators import speed_of, speed_values
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.surface import project
from creeping.rays.ends import AT_CREASES
from creeping.rays.fan import RayFan


@dataclass(frozen=True, eq=False, repr=False)
class IsoPhaseCurve(DrawnOnBody):
    """One connected curve of constant travel time or eikonal; a level may have several curves.

    Attributes
    ----------
    level : float, L (time for a weighted body)
        Value of the travel time or the eikonal on the curve.
    of : {"travel_time", "eikonal"}
    points : (m, 3), L
        In the order of the rays.
    closed : bool
        Whether the last point connects to the first.
    parameters : (m, 2)
        (theta, phi) of the points, radians; not unwrapped.
    rays : (m,)
        Number of the ray that each point lies on.
    unit : str
        Unit of length: "m" if the body states it, else "L".

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> line = cr.shadow_line(ball, direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, length=2.0, n_rays=16)
    >>> curve, = cr.iso_phase_curves(fan, 1.0)
    >>> curve.level, curve.of, curve.closed
    (1.0, 'travel_time', True)
    """

    level: float
    of: str
    points: FloatArray
    closed: bool
    parameters: FloatArray
    rays: IntArray
    unit: str = UNKNOWN

    @property
    def parameter_pieces(self) -> list[FloatArray]:
        """The curve in the parameter plane, split where an angle jumps between pi and -pi: list of (k, 2), radians."""
        return split_at_seam(self.parameters, closed=self.closed)

    @property
    def length(self) -> float:
        """Length of the polyline through the points, L."""
        path = np.concatenate([self.points, self.points[: int(self.closed)]])
        return float(np.sum(np.linalg.norm(np.diff(path, axis=0), axis=1)))

    def __repr__(self) -> str:
        shape = "closed" if self.closed else "open"
        missing = int(np.sum(~np.all(np.isfinite(self.points), axis=1)))
        return (
            f"IsoPhaseCurve({self.of} = {self.level:g}, {len(self.points)} points, {shape}, "
            f"length {self.length:.4g} {self.unit}"
            f"{f'; {missing} points not finite' * (missing > 0)})"
        )


def iso_phase_curves(
    fan: RayFan, levels: ArrayLike, *, of: str = "travel_time", beyond_detachment: bool = True
) -> list[IsoPhaseCurve]:
    """Iso-phase curves of a fan.

    Parameters
    ----------
    fan : RayFan
    levels : scalar or (m,), L (time for a weighted body)
    of : {"travel_time", "eikonal"}
        Travel time from the shadow line (the definition of Ying and Candes 2006), or the phase of the wave over k.
    beyond_detachment : bool
        Whether to continue curves beyond detachment, where rays are still geodesics but carry no creeping wave.

    Returns
    -------
    list of IsoPhaseCurve
        Ordered by level, then by arc. A level that no two neighbouring rays reach gives no curve.

    Raises
    ------
    InvalidInputError
        On an unknown quantity or a level that is not finite.

    Examples
    --------
    >>> import numpy as np
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> line = cr.shadow_line(ball, direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, length=2.0, n_rays=16)
    >>> curve, = cr.iso_phase_curves(fan, 1.0)
    >>> bool(abs(curve.points[:, 2] - np.sin(1.0)).max() < 1e-6)                    # a circle of latitude
    True
    """
    one_of(fan, "fan", RayFan, "creeping.launch")
    if not isinstance(of, str) or of not in ("travel_time", "eikonal"):
        raise InvalidInputError(f"of = {of!r} is neither 'travel_time' nor 'eikonal'")
    values = np.atleast_1d(real_array(levels, "levels"))
    if values.ndim != 1 or not np.all(np.isfinite(values)):
        raise InvalidInputError("levels must be finite numbers, one or a list of them")
    if len(values) > 100_000:
        raise InvalidInputError(f"{len(values)} levels are more than 100000; ask for fewer")
    beyond_detachment = flag(beyond_detachment, "beyond_detachment")
    if not len(fan.points):
        return []
    offset = fan.eikonal[:, 0] - fan.travel_time[0] if of == "eikonal" else np.zeros(len(fan.points))
    last = _whole_steps(fan)
    if not beyond_detachment:
        last = np.minimum(last, fan.detachment)
    pieces = []
    for level in values:
        time = level - offset
        met = np.flatnonzero((time >= 0) & (time <= last))
        pieces += [(float(level), run, time[run], closed) for run, closed in _runs(fan, met)]
    if not pieces:
        return []
    # all points in one call: a level has few
    rays, times = (np.concatenate([piece[k] for piece in pieces]) for k in (1, 2))
    points = _points_at(fan, rays, times)
    parameters = fan.body.parameters(points)
    ends = np.cumsum([len(run) for _, run, _, _ in pieces])[:-1]
    parts = zip(pieces, np.split(points, ends), np.split(parameters, ends), strict=True)
    unit = unit_of(fan.body)
    return [IsoPhaseCurve(level, of, x, closed, angles, run, unit) for (level, run, _, closed), x, angles in parts]


def _whole_steps(fan: RayFan) -> FloatArray:
    """Travel time up to which the steps of each ray are whole (rays,): one that has come to an edge stays there."""
    out = np.full(len(fan.points), fan.length)
    if not is_piecewise(fan.body):
        return out
    moving = np.any(np.diff(fan.points, axis=1) != 0, axis=2)
    stopped = ~moving[:, -1]
    out[stopped] = fan.travel_time[np.maximum(np.sum(moving[stopped], axis=1) - 1, 0)]
    # in the last step
    late = moving[:, -1] & np.isin(fan.status, AT_CREASES) & (fan.detachment < fan.length)
    out[late] = fan.travel_time[-2]
    return out


def _runs(fan: RayFan, met: IntArray) -> Iterable[tuple[IntArray, bool]]:
    """Groups of neighbouring rays among those that meet the level, and whether the group closes."""
    for arc, closes in enumerate(fan.closed_arcs):
        rays = np.flatnonzero(fan.arc_index == arc)
        here = met[fan.arc_index[met] == arc]
        if not len(here):
            continue
        if len(here) == len(rays):
            if len(rays) > 1:
                yield here, closes and len(rays) > 2
            continue
        groups = np.split(here, np.flatnonzero(np.diff(here) > 1) + 1)
        if closes and len(groups) > 1 and here[0] == rays[0] and here[-1] == rays[-1]:
            # a run that crosses the start of a closed arc is one run
            groups = [np.concatenate([groups[-1], groups[0]]), *groups[1:-1]]
        for group in groups:
            if len(group) > 1:
                yield group, False


def _points_at(fan: RayFan, rays: IntArray, times: FloatArray) -> FloatArray:
    """Points of the rays at one time each, by quintics between steps: (n,), (n,) -> (n, 3)."""
    velocity, turning = vector_field(fan.body, fan.points, fan.directions)
    acceleration, speed = speed_values(fan.body, fan.points)[..., None] * turning, speed_of(fan.body)
    if speed is not None:
        # x'' = (c p)' with c' = grad c.x'
        acceleration += np.sum(speed.gradient(fan.points) * velocity, axis=-1, keepdims=True) * fan.directions
    steps = fan.travel_time
    k = np.clip(np.searchsorted(steps, times, side="right") - 1, 0, len(steps) - 2)
    h = (steps[k + 1] - steps[k])[:, None]
    s = (times - steps[k])[:, None] / h
    cube = s**3
    end = cube * (10 - 15 * s + 6 * s**2)
    points = (1 - end) * fan.points[rays, k] + end * fan.points[rays, k + 1]
    points += h * (s - cube * (6 - 8 * s + 3 * s**2)) * velocity[rays, k]
    points += h * cube * (-4 + 7 * s - 3 * s**2) * velocity[rays, k + 1]
    points += h**2 * 0.5 * (s**2 - cube * (3 - 3 * s + s**2)) * acceleration[rays, k]
    points += h**2 * 0.5 * cube * (1 - 2 * s + s**2) * acceleration[rays, k + 1]
    return project(fan.body, points)


def split_at_seam(parameters: FloatArray, *, closed: bool) -> list[FloatArray]:
    """Cut a curve of angles at seams and poles.

    Parameters
    ----------
    parameters : (m, 2)
        Angles in [-pi, pi].
    closed : bool
        Whether the last point is joined to the first.

    Returns
    -------
    list of (k, 2)
        Pieces in order; no step of a piece exceeds pi/2.
    """
    path = np.concatenate([parameters, parameters[:1]]) if closed else parameters
    # a longer step, seams apart, only the passage of a pole makes on a well sampled curve
    longest = np.pi / 2
    if np.all(np.abs(np.diff(path, axis=0)) <= longest):
        return [np.array(path)] if len(path) > 1 else []
    pieces: list[FloatArray] = []
    current = [path[0]]
    for after in path[1:]:
        jump = after - current[-1]
        short = jump - 2 * np.pi * np.round(jump / (2 * np.pi))
        if np.any(np.abs(short) > longest):
            pieces.append(np.array(current))
            current = [after]
            continue
        # a step may cross the seams of both angles
        for axis in (0, 1):
            jump = after - current[-1]
            if abs(jump[axis]) <= np.pi:
                continue
            side = np.sign(current[-1][axis]) or 1.0
            short = jump - 2 * np.pi * np.round(jump / (2 * np.pi))
            share = (side * np.pi - current[-1][axis]) / short[axis] if short[axis] != 0 else 0.0
            crossing = current[-1] + np.clip(share, 0.0, 1.0) * short
            entry = crossing.copy()
            crossing[axis], entry[axis] = side * np.pi, -side * np.pi
            pieces.append(np.array([*current, crossing]))
            current = [entry]
        current.append(after)
    pieces.append(np.array(current))
    return [piece for piece in pieces if len(piece) > 1]
