"""Cells of a fan on a body with creases in which a ray towards r is likely: of the others no ray need be traced.

A cell lies between two rays and two times; the search on the fan has it where n.r and b.r have both signs at its
corners. Where rays part at a tip such cells are many; most have no place where both heights vanish, or p = -r there.
With both heights bilinear in the cell, the place is one step of Newton's method from the nearest one in the cell; it is
likely up to a cell outside, where p.r, held in the cell, is above 0.8: rays leave towards r there and not past it.
Between rays that have parted, one on
either side of a tip, nothing is bilinear: neighbours are parted where they are

    |x_2 - x_1| > max(0.2 size, 3 |J| spacing)

apart, and what would come to such a cell counts as lost, as does what would come between a ray that has ended at a tip
and a neighbour that goes on. Fans are refined to gaps of 0.1, and J tells how far rays of coarser ones part. Elsewhere
r is no farther from the nearest p of the corners than 0.6 times what they are from each other: 1/√3 at most within a
triangle. Where the place tells nothing, within 0.03 sizes of a tip, where rays turn faster than samples tell, and where
both heights are as good as parallel, beyond 8 cells, a cell is likely if r is nearer than 0.4 to a corner's p, and
where r is nearer than 0.1 in any case: next to a tip bilinear functions bend.

Also here: what rays would still give that end too early: they are traced on, and their waves counted where they would
leave.

    T(r) = 2 max |√(2 m1 m2/k) P |J'|^(-1/2)|   over s beyond the end and p within 0.3 of r,  |J'| >= |J| κₙ²/k

P is of first order, |J'| is held where rays merge at a caustic of the far field, and 2 stands for several rays of one
direction. Only rays with ξ Im τ < 7.5 at their ends are traced: of those with the length "auto" a tenth
at most.

Sources: [LK59]; Derivations, R12, F3 and F4.
"""

from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.field.arguments import scales
from creeping.field.boundary import Boundary, fock_scale, modes_of
from creeping.field.waves.shed_wave import shed_wave
from creeping.geodesics.attenuation import curvature_values
from creeping.geodesics.pieces import to_tips
from creeping.geodesics.states import M11, P, X
from creeping.geometry.piecewise import tips_of
from creeping.geometry.surface import Surface, size
from creeping.rays.quantities import RayPoints
from creeping.rays.reach import DECAY, LONGEST
from creeping.shadow.attachment import LaunchPoints, evenly_chosen, line_tangents

if TYPE_CHECKING:
    from creeping.rays.tracer import RayTracer

SAMPLES = 64
"""Points of each ray beyond its end, over LONGEST body sizes."""


def likely_found(
    body: Any,
    states: FloatArray,
    ends: FloatArray,
    spacing: FloatArray,
    parts: int,
    step: float,
    incidence: IntArray,
    found: IntArray,
    directions: FloatArray,
    places: FloatArray,
) -> IntArray:
    """Numbers of the cells in which a ray towards their observers is likely.

    Parameters
    ----------
    body : PiecewiseSurface
    states : (n, rays, K, 7 or more)
        At equal steps.
    ends : (n, rays, 2)
        Time at which each ray ends, and the number of the crease, as lanes have them.
    spacing : (n, rays), L
    parts, step : int, float
        Samples of a step, and its time.
    incidence : (m,)
        Of each cell.
    found : (m, 4)
        Observer, both rays and first sample of each cell.
    directions : (observers, 3)
    places : (m, 2)
        Nearest fractions of the cell, across the rays and along them.
    """
    rays, long = found[:, 1:3], step / parts
    begin, end = (found[:, 3] + places[:, 1]) * long, ends[incidence[:, None], rays, 0]
    at_tip = np.isin(ends[incidence[:, None], rays, 1], tips_of(body)[0])
    # an edge ends rays one after the other, a tip one of them alone
    until = np.fmin(np.max(end, axis=1), np.min(np.where(at_tip, end, np.inf), axis=1))
    likely = np.flatnonzero(begin <= until + long)
    if not len(likely):
        return likely
    n, rays, sample, incidence = len(likely), rays[likely], found[likely, 3], incidence[likely]
    observers = directions[found[likely, 0]]
    corner = np.stack([sample, sample + 1], axis=1)[:, None].repeat(2, axis=1)
    owner = (incidence[:, None] * states.shape[1] + rays)[:, :, None].repeat(2, axis=2)
    x, p = _between(states.reshape(-1, *states.shape[2:]), owner.reshape(-1), corner.reshape(-1), parts, step)
    g = np.asarray(body.gradient(x))
    with np.errstate(all="ignore"):
        normal = g / np.linalg.norm(g, axis=1, keepdims=True)
        p = p / np.linalg.norm(p, axis=1, keepdims=True)
        r = np.repeat(observers, 4, axis=0)
        f, h, ahead = (np.sum(v * r, axis=1).reshape(n, 2, 2) for v in (normal, np.cross(normal, p), p))
        u, v = places[likely].T
        (f0, fu, fv), (h0, hu, hv) = _bilinear(f, u, v), _bilinear(h, u, v)
        determinant = fu * hv - fv * hu
        u1, v1 = u - (f0 * hv - fv * h0) / determinant, v - (fu * h0 - f0 * hu) / determinant
        corners_of = p.reshape(n, 4, 3)
        apart = np.linalg.norm(corners_of - observers[:, None], axis=2).min(axis=1)
        wide = np.linalg.norm(corners_of[:, :, None] - corners_of[:, None], axis=3).max(axis=(1, 2))
        off = np.maximum(np.abs(u1 - 0.5), np.abs(v1 - 0.5))
        bent = (off > 8) | (to_tips(tips_of(body)[1], x).reshape(n, 4).min(axis=1) < 0.03 * size(body))
        near = (off <= 1.5) | bent | (apart <= 0.1)
        reach = np.where(bent, 0.4, np.minimum(0.6 * wide, 0.4))
        towards = _bilinear(ahead, np.clip(u1, 0, 1), np.clip(v1, 0, 1))[0] > 0.8
        corners, last = x.reshape(n, 2, 2, 3), np.minimum(sample // parts, states.shape[2] - 1)
        J, spacing = states[incidence[:, None], rays, last[:, None], M11], spacing[incidence, rays[:, 0], None]
        one = parted(body, corners[:, 0], corners[:, 1], np.max(np.abs(J), axis=1)[:, None], spacing)
        # where nothing can be told, a cell is likely
        return np.asarray(likely[((near & towards & (apart <= reach)) | ~np.isfinite(u1 + v1)) & ~np.any(one, axis=1)])


def parted(body: Any, x: FloatArray, other: FloatArray, spreading: FloatArray, spacing: FloatArray) -> BoolArray:
    """Whether neighbours at points (..., 3), L, with J and spacing (...), go on either side of a tip."""
    gap = np.linalg.norm(x - other, axis=-1)
    return np.asarray(gap > np.maximum(0.2 * size(body), 3 * np.abs(spreading) * spacing))


def _between(
    states: FloatArray, ray: IntArray, sample: IntArray, parts: int, step: float
) -> tuple[FloatArray, FloatArray]:
    """x and x' of rays at samples (n,), of the cubics between their states."""
    k = np.minimum(sample // parts, states.shape[1] - 2)
    u = ((sample - k * parts) / parts)[:, None]
    a, b = states[ray, k], states[ray, k + 1]
    ends = (1 - u) ** 2 * (1 + 2 * u) * a[:, X] + u**2 * (3 - 2 * u) * b[:, X]
    x = ends + step * u * (1 - u) * ((1 - u) * a[:, P] - u * b[:, P])
    slope = 6 * u * (1 - u) * (b[:, X] - a[:, X]) / step
    return x, slope + (1 - u) * (1 - 3 * u) * a[:, P] + u * (3 * u - 2) * b[:, P]


def _bilinear(c: FloatArray, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Value and slopes at (u, v) of what is c (n, 2, 2) at the corners."""
    low, high = c[:, 0, 0] + v * (c[:, 0, 1] - c[:, 0, 0]), c[:, 1, 0] + v * (c[:, 1, 1] - c[:, 1, 0])
    along = (1 - u) * (c[:, 0, 1] - c[:, 0, 0]) + u * (c[:, 1, 1] - c[:, 1, 0])
    return low + u * (high - low), high - low, along


class RayEnds:
    """Where the rays of n incidences end, and what comes after.

    Parameters
    ----------
    tracer : RayTracer
        Its length is that of the rays.
    launch : LaunchPoints
    states : (n, rays, steps, 6 or more)
        Of all rays at the times.
    times : (steps,), L
        From 0 to the end.
    """

    def __init__(self, tracer: "RayTracer", launch: LaunchPoints, states: FloatArray, times: FloatArray) -> None:
        self.body, self._tracer = tracer.body, tracer
        self._incidence, ray = np.nonzero(evenly_chosen(launch.there, 32))
        self._starts = launch.points[self._incidence, ray]
        self._directions = launch.directions[self._incidence]
        self._attenuation = _attenuation(self.body, states[self._incidence, ray], times)
        self._traced: tuple[IntArray, RayPoints | None] = (np.full(len(self._starts), -1), None)

    def lost(self, directions: FloatArray, incidence: IntArray, wavenumber: float, boundary: Boundary) -> FloatArray:
        """T(r) of observers (m,) of the incidences (m,), L: 0 where nothing is lost."""
        out = np.zeros(len(directions))
        if not len(self._starts):
            return out
        # of an impedance at the mean curvature, for the question is only which rays to trace on
        mean = self._attenuation**1.5 / self._tracer.length**1.5
        m = fock_scale(wavenumber, np.where(np.isfinite(mean), mean, 1.0))
        slowest = np.maximum(np.min(np.atleast_2d(modes_of(boundary, m).tau.imag), axis=-1), 0.1)
        late = np.cbrt(wavenumber / 2) * self._attenuation * slowest < DECAY
        if not np.any(late):
            return out
        incidences, points = self._traced_on(late)
        size_of = 2 * _amplitude(points, wavenumber, boundary)
        for number in np.unique(incidences):
            rows, mine = np.flatnonzero(incidence == number), incidences == number
            amplitude, p = size_of[mine].ravel(), points.directions[mine].reshape(-1, 3)
            there = np.flatnonzero(amplitude > 0)
            # 64 observers at a time, for the memory's sake
            for first in range(0, len(rows), 64):
                some = rows[first : first + 64]
                # rays and points are some 0.2 apart
                near = directions[some] @ p[there].T > np.cos(0.3)
                out[some] = np.max(np.where(near, amplitude[there], 0.0), axis=1, initial=0.0)
        return out

    def _traced_on(self, late: BoolArray) -> tuple[IntArray, RayPoints]:
        """Incidences of some rays (rays,), and (rays, SAMPLES) points beyond their ends, each ray traced once."""
        place, points = self._traced
        new = np.flatnonzero(late & (place < 0))
        if len(new):
            starts, directions = self._starts[new], self._directions[new]
            more = LONGEST * size(self.body) * np.arange(SAMPLES) / SAMPLES
            tangents = line_tangents(self.body, starts, directions)
            owner, times = np.repeat(np.arange(len(new)), SAMPLES), np.tile(self._tracer.length + more, len(new))
            found = self._tracer.at(directions, starts, tangents, times, owner).rays
            known = int(place.max(initial=-1)) + 1
            place = place.copy()
            place[new] = known + np.arange(len(new))
            points = found if points is None else RayPoints.joined([points, found])
            self._traced = place, points
        assert points is not None
        rows = place[late]
        return self._incidence[late], points[rows[:, None] * SAMPLES + np.arange(SAMPLES)]


def _attenuation(body: Surface, states: FloatArray, times: FloatArray) -> FloatArray:
    """Integral of kappa_n^(2/3), L^(1/3), by trapezia; inf of rays that have detached (n,)."""
    if not len(states):
        return np.zeros(0)
    curvature = curvature_values(body, states.reshape(-1, states.shape[-1])).reshape(states.shape[:2])
    whole = np.trapezoid(np.cbrt(np.maximum(curvature, 0.0)) ** 2, times, axis=1)
    return np.asarray(np.where(np.all(curvature > 0, axis=1), whole, np.inf))


def _amplitude(rays: RayPoints, wavenumber: float, boundary: Boundary) -> FloatArray:
    """What rays would give a far observer where they leave (...), L."""
    m1, m2 = scales(rays, wavenumber)
    wave = np.abs(shed_wave(rays, wavenumber, boundary, 1))
    least = np.abs(rays.spreading) * np.maximum(rays.curvature[1], 0.0) ** 2 / wavenumber
    with np.errstate(divide="ignore", invalid="ignore"):
        amplitude = np.sqrt(2 * m1 * m2 / wavenumber / np.maximum(np.abs(rays.spreading_rate), least)) * wave
    return np.asarray(np.where(rays.alive & np.isfinite(amplitude), amplitude, 0.0))
