"""What rays would still give that end too early: they are traced on, and their waves counted where they would leave.

    T(r) = 2 max |√(2 m1 m2/k) P |J'|^(-1/2)|   over s beyond the end and p within 0.3 of r,  |J'| >= |J| κₙ²/k

P is of first order, |J'| is held where rays merge at a caustic of the far field, and 2 stands for several rays of one
direction. Only rays with ξ Im τ < 7.5 at their ends are traced: of those with the length "auto" a tenth
at most.

Sources: [LK59]; Derivations, F3 and F4.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.field.boundary import Boundary
from creeping.field.creeping_modes import fock_scale, modes_of
from creeping.field.ray_scales import scales
from creeping.field.shed_wave import shed_wave
from creeping.geodesics.attenuation import curvature_values
from creeping.geometry.surface import Surface, size
from creeping.rays.quantities import RayPoints
from creeping.rays.reach import DECAY, LONGEST
from creeping.shadow.attachment import LaunchPoints, evenly_chosen, line_tangents

if TYPE_CHECKING:
    from creeping.rays.tracer import RayTracer

SOME = 32
"""Rays of an incidence that stand for all."""
SAMPLES = 64
"""Points of each beyond its end, over LONGEST body sizes."""
NEAR = float(np.cos(0.3))
"""p.r from which a point is one that leaves towards r: rays and points are some 0.2 apart."""
SEVERAL = 2.0
"""Rays that one direction may have lost."""
SLOW = 0.1
"""Least Im tau that is reckoned with."""


class Beyond(NamedTuple):
    """Points of rays beyond their ends: the incidence of each ray (rays,), and (rays, SAMPLES) points."""

    incidence: IntArray
    points: RayPoints


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
        self._incidence, ray = np.nonzero(evenly_chosen(launch.there, SOME))
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
        slowest = np.maximum(np.min(np.atleast_2d(modes_of(boundary, m).tau.imag), axis=-1), SLOW)
        late = np.cbrt(wavenumber / 2) * self._attenuation * slowest < DECAY
        if not np.any(late):
            return out
        incidences, points = self._traced_on(late)
        size_of = SEVERAL * _amplitude(points, wavenumber, boundary)
        for number in np.unique(incidences):
            rows, mine = np.flatnonzero(incidence == number), incidences == number
            amplitude, p = size_of[mine].ravel(), points.directions[mine].reshape(-1, 3)
            there = np.flatnonzero(amplitude > 0)
            # 64 observers at a time, for the memory's sake
            for first in range(0, len(rows), 64):
                some = rows[first : first + 64]
                near = directions[some] @ p[there].T > NEAR
                out[some] = np.max(np.where(near, amplitude[there], 0.0), axis=1, initial=0.0)
        return out

    def _traced_on(self, late: BoolArray) -> Beyond:
        """Some rays beyond their ends, each traced once."""
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
        return Beyond(self._incidence[late], points[rows[:, None] * SAMPLES + np.arange(SAMPLES)])


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
