"""The fan as smooth functions of (σ, s): each arc of neighbouring rays is a strip, interpolated by tensor splines.

σ is arclength along the shadow line, s arclength along the ray. On a closed arc σ is periodic. The rays themselves are
known at equal steps (`ray_points`).

Sources: Derivations, R4 and R19.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import BSpline, NdBSpline
from scipy.sparse.linalg import splu

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.geometry.incident import headings, openings
from creeping.geometry.surface import Surface, memo, normal
from creeping.rays.fan import RayFan
from creeping.rays.quantities import LANES, START_LANES, RayPoints
from creeping.rays.tracer import RayTracer
from creeping.shadow.attachment import line_tangents


def ray_points(fan: RayFan, times: FloatArray | None = None) -> tuple[FloatArray, RayPoints]:
    """Points of every ray of a fan, at equal steps that resolve the body if not at given times.

    Returns
    -------
    times : (m,), L
    points : RayPoints
        (rays, m)

    Raises
    ------
    InvalidInputError
        If the body is weighted.
    """
    # polynomials of degree 9 then err by about 3e-11
    tracer = RayTracer(fan.body, fan.length, turn=0.08)
    # so many points are enough, unless they were more than four steps apart: strips between them err by 3e-5 of J then,
    # between rays that lie much farther apart
    count = min(tracer.steps, max(512, -(-tracer.steps // 4)))
    equal: FloatArray = fan.length / count * np.arange(count + 1, dtype=np.float64)
    times = equal if times is None else times
    rays, steps = len(fan.points), len(times)
    starts, wave = fan.points[:, 0], fan.line.wave
    d = headings(wave, starts)
    tangents = line_tangents(fan.body, starts, d) if rays else np.zeros((0, 3))
    owner = np.repeat(np.arange(rays), steps)
    found = tracer.at(d, starts, tangents, np.tile(times, rays), owner, openings=openings(wave, starts)).rays
    launched = fan.launched
    alive = found.alive.reshape(rays, steps) & launched[:, None]
    return times, RayPoints(
        found.lanes.reshape(rays, steps, LANES),
        found.starts.reshape(rays, steps, START_LANES),
        np.broadcast_to(times, alive.shape),
        alive,
        found.scale,
    )


@dataclass(frozen=True, eq=False)
class Strip:
    """One arc of rays.

    Attributes
    ----------
    positions : (rays,), L
        σ of the rays, ascending; may pass the length of the curve where the arc wraps.
    times : (steps,), L
    rays : RayPoints
        Shape (rays, steps).
    period : float
        Length of the closed curve; inf for an open arc.
    """

    positions: FloatArray
    times: FloatArray
    rays: RayPoints
    period: float

    @property
    def closed(self) -> bool:
        """Whether the last ray is a neighbour of the first."""
        return bool(np.isfinite(self.period))

    @property
    def span(self) -> tuple[float, float]:
        """σ at both ends: half a spacing beyond the rays of an open arc."""
        low = float(self.positions[0])
        if self.closed:
            return low, low + self.period
        half = 0.5 * float(self.positions[-1] - low) / max(1, len(self.positions) - 1)
        return low - half, float(self.positions[-1]) + half

    def first_normals(self, sigma: FloatArray) -> FloatArray:
        """n at the launch points σ (n,): (n, 3)."""
        n = self._splines[1](self.wrap(sigma))[:, 6:9]
        return np.asarray(n / np.linalg.norm(n, axis=1, keepdims=True))

    def nearest(self, sigma: FloatArray) -> IntArray:
        """Ray next below σ: (n,) -> (n,)."""
        return np.clip(np.searchsorted(self.positions, self.wrap(sigma), side="right") - 1, 0, len(self.positions) - 1)

    def coarse_normals(self, body: Surface) -> FloatArray:
        """n at the coarse steps of the rays, cached: (rays, coarse steps, 3)."""
        return memo(self, "coarse normals", lambda: normal(body, self.rays.points[:, self.coarse_steps]))

    @property
    def coarse_steps(self) -> IntArray:
        """Steps at which a search looks first, the last one among them."""
        stride = max(1, (len(self.times) - 1) // 64)
        return np.unique(np.append(np.arange(0, len(self.times), stride), len(self.times) - 1))

    @property
    def cell(self) -> tuple[float, float]:
        """Largest spacing of rays, and of coarse steps, L."""
        gaps = np.diff(np.append(self.positions, self.positions[0] + self.period) if self.closed else self.positions)
        return float(np.max(gaps, initial=0.0)), float(np.max(np.diff(self.times[self.coarse_steps])))

    @cached_property
    def _splines(self) -> tuple[NdBSpline, NdBSpline]:
        """Splines of the lanes in (σ, s) and of the starts in σ."""
        sigma, lanes, starts = self.positions, self.rays.lanes, self.rays.starts[:, 0]
        if self.closed:
            # what a ray does to the spline fades by half from ray to ray: 40 on either side make it periodic
            rows = np.arange(-40, len(sigma) + 41)
            sigma = sigma[rows % len(sigma)] + self.period * (rows // len(sigma))
            lanes, starts = lanes[rows % len(lanes)], starts[rows % len(starts)]
        degree = 5 if len(sigma) > 5 else max(1, 2 * ((len(sigma) - 1) // 2) - 1)
        knots, table = _interpolating(sigma, lanes, degree)
        later, along = _interpolating(self.times, np.moveaxis(table, 1, 0), 5)
        first = BSpline(*_interpolating(sigma, starts, degree), degree)
        return NdBSpline((knots, later), np.moveaxis(along, 0, 1), (degree, 5)), first

    def wrap(self, sigma: FloatArray) -> FloatArray:
        """σ within the strip's period."""
        if not self.closed:
            return sigma
        return np.asarray(self.positions[0] + np.mod(sigma - self.positions[0], self.period))

    def at(self, sigma: FloatArray, s: FloatArray) -> RayPoints:
        """Points of the strip: (n,), (n,)."""
        lanes, starts = self._splines
        sigma = self.wrap(sigma)
        points, first = lanes(np.stack([sigma, s], axis=-1)), starts(sigma)
        # between a ray that has detached and one that has not, the interpolated curvature decides
        alive = self._alive(sigma, s) & (points[:, 9] > 0) & (first[:, 2] > 0)
        return RayPoints(points, first, s, np.asarray(alive), self.rays.scale)

    def slopes(self, sigma: FloatArray, s: FloatArray, along: int = 0) -> FloatArray:
        """Derivatives of the lanes in σ, or with 1 ``along`` the rays, in s: (n,), (n,) -> (n, LANES)."""
        return np.asarray(self._splines[0](np.stack([self.wrap(sigma), s], axis=-1), nu=(1 - along, along)))

    def _alive(self, sigma: FloatArray, s: FloatArray) -> BoolArray:
        """Whether both neighbouring rays are creeping there, at the step before."""
        ray = self.nearest(sigma)
        following = (ray + 1) % len(self.positions) if self.closed else np.minimum(ray + 1, len(self.positions) - 1)
        step = np.clip(np.searchsorted(self.times, s, side="right") - 1, 0, len(self.times) - 1)
        return np.asarray(self.rays.alive[ray, step] & self.rays.alive[following, step])


def _interpolating(places: FloatArray, values: FloatArray, degree: int) -> tuple[FloatArray, FloatArray]:
    """Knots and coefficients of the not-a-knot spline of odd degree through values (n, ...) at places (n,).

    What `scipy.interpolate.make_interp_spline` gives, for many columns in a hundredth of the time.
    """
    half = (degree + 1) // 2
    ends = np.repeat(places[[0]], degree + 1), np.repeat(places[[-1]], degree + 1)
    knots = np.concatenate([ends[0], places[half:-half], ends[1]])
    # not LAPACK's banded solver, which updates row by row: threads of its library then wait for each other
    solver = splu(BSpline.design_matrix(places, knots, degree).tocsc())
    return knots, solver.solve(values.reshape(len(places), -1)).reshape(values.shape)


def strip_rows(fan: RayFan) -> list[IntArray]:
    """Rows of the fan's rays on each of its strips, in their order."""
    rows = [np.flatnonzero(fan.arc_index == k) for k in range(len(fan.closed_arcs))]
    return [mine for mine in rows if len(mine)]


def strips_of(fan: RayFan) -> tuple[Strip, ...]:
    """One strip for each arc of the fan that has rays; one of a single ray cannot be interpolated."""
    times, everything = ray_points(fan)
    found = []
    lengths = [curve.length for curve in fan.line.curves]
    for mine in strip_rows(fan):
        closed = fan.closed_arcs[fan.arc_index[mine[0]]]
        length = lengths[int(fan.curve_index[mine[0]])]
        positions = np.unwrap(fan.arclength[mine], period=length)
        found.append(Strip(positions, times, everything[mine], length if closed else np.inf))
    return tuple(found)


def gather(strips: tuple[Strip, ...], which: IntArray, sigma: FloatArray, s: FloatArray) -> RayPoints:
    """Points of several strips together: numbers of strips (n,), σ (n,), s (n,)."""
    parts = [(np.flatnonzero(which == k), strip) for k, strip in enumerate(strips)]
    parts = [(rows, strip) for rows, strip in parts if len(rows)]
    if not parts:
        none, scale = np.zeros(0), strips[0].rays.scale if strips else 1.0
        return RayPoints(np.zeros((0, LANES)), np.zeros((0, START_LANES)), none, none > 0, scale)
    found = [strip.at(sigma[rows], s[rows]) for rows, strip in parts]
    order = np.argsort(np.concatenate([rows for rows, _ in parts]))
    return RayPoints.joined(found)[order]
