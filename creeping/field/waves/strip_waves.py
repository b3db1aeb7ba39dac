"""Complex functions on the strips of a fan, and the creeping modes' wave as one of them.

    u = y(sigma, s) |J|^(-1/2) e^{ik(d.x0 + s) - i pi N/2}

y varies slowly and has no poles on caustics: cubic splines between rays and steps.

Also here: the far field of many incidences as sums over sheets: rays and specular points that move with the incidence.

    f_c = sum over sheets of a_c exp(i k_c L)

A sheet is a ray shed towards an observer, or a specular point; its path L and its amplitudes a_c, one of each problem c
(a boundary, its component and a wavenumber), are smooth functions of the incidence where the field itself oscillates.

Sources: [LK59]; Derivations, F22, F3 and F23.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.interpolate import RectBivariateSpline, make_interp_spline

from creeping._typing import Any, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.field.boundary import Boundary
from creeping.field.waves.far_geometry import FarGeometry
from creeping.field.waves.far_rays import Parts
from creeping.field.waves.ray_sums import own_error
from creeping.field.waves.surface import surface_waves
from creeping.geometry.surface import size
from creeping.rays.quantities import RayPoints
from creeping.rays.strips import Strip

WRAPPED = 6
"""Rays of a closed strip beyond either end that its splines go through."""


@dataclass(frozen=True, eq=False)
class StripTable:
    """A complex function on strips.

    Attributes
    ----------
    strips : tuple of Strip
    times : (steps,), L
        At which it is kept.
    values : list of (rays, steps) complex
        Of each strip's rays.
    """

    strips: tuple[Strip, ...]
    times: FloatArray
    values: list[ComplexArray]

    def at(self, strip: int, sigma: FloatArray, s: FloatArray, *, dsigma: int = 0, ds: int = 0) -> ComplexArray:
        """The function, or a derivative of it, at places (n,) of a strip: (n,)."""
        real, imaginary = self._splines[strip]
        sigma = self.strips[strip].wrap(sigma)
        return np.asarray(real.ev(sigma, s, dx=dsigma, dy=ds) + 1j * imaginary.ev(sigma, s, dx=dsigma, dy=ds))

    @cached_property
    def _splines(self) -> list[tuple[RectBivariateSpline, RectBivariateSpline]]:
        """Splines of the real and the imaginary part on each strip."""
        found = []
        for strip, table in zip(self.strips, self.values, strict=True):
            places, values = around(strip, table)
            degree = min(3, len(places) - 1)
            real, imaginary = (
                RectBivariateSpline(places, self.times, part, kx=degree) for part in (values.real, values.imag)
            )
            found.append((real, imaginary))
        return found


def around(strip: Strip, values: Any) -> tuple[FloatArray, Any]:
    """Places of a strip's rays and values (rays, ...) there, with some beyond either end of a closed one."""
    places = strip.positions
    if not strip.closed:
        return places, values
    count = len(places)
    turns = np.arange(-min(WRAPPED, count), count + min(WRAPPED, count))
    return places[turns % count] + strip.period * (turns // count), values[turns % count]


def without_tubes(rays: RayPoints) -> RayPoints:
    """Points of rays whose J is 1, so that their wave is y but for its phase."""
    lanes = rays.lanes.copy()
    lanes[..., 6:9] = 1.0, 0.0, 0.0
    return RayPoints(lanes, rays.starts, rays.time, rays.alive, rays.scale)


def resampled(strip: Strip, values: ComplexArray, times: FloatArray) -> ComplexArray:
    """Values (rays, steps) of a strip's own steps at other times (m,), L: (rays, m)."""
    return np.asarray(make_interp_spline(strip.times, values, k=3, axis=1)(times))


def modes_on_strip(strip: Strip, times: FloatArray, k: float, kind: Boundary) -> tuple[ComplexArray, FloatArray]:
    """Y of creeping modes on a strip's rays and its error (rays, steps), infinite where they have ended."""
    rays = strip.rays
    plain = without_tubes(rays)
    waves = surface_waves(plain, k, kind, 2), surface_waves(plain, k, kind, 1)
    error = np.where(rays.alive, own_error(plain, waves, k, kind, 2), np.inf)
    y = resampled(strip, waves[0] * np.exp(-1j * k * rays.eikonal), times)
    # the larger of the steps about a place tells
    at = np.clip(np.searchsorted(strip.times, times), 1, len(strip.times) - 1)
    return y, np.maximum(error[:, at], error[:, at - 1])


class Sheets(NamedTuple):
    """Sheets of incidences with their observers.

    Attributes
    ----------
    observer : (n,) of int
        Row of the observer, ascending; those of one incidence follow each other.
    creeping : (n,) of bool
        Whether it is a shed ray, else a specular point.
    key : (n, 4)
        Where the ray leaves, and its time, in body sizes: what tells neighbours.
    path : (n,), L
        L.
    amplitudes : (n, problems), L
        Complex.
    """

    observer: IntArray
    creeping: BoolArray
    key: FloatArray
    path: FloatArray
    amplitudes: ComplexArray


def sheets_of(geometry: FarGeometry, parts: list[Parts]) -> Sheets:
    """Sheets of a geometry with the amplitudes of all its problems, one component after the other of each."""
    shed, specular = geometry.shed, geometry.specular
    rays, length = shed.rays, size(geometry.body)
    points = specular.points
    path = np.concatenate([rays.departing, specular.path(geometry.direction[specular.observer], geometry.directions)])
    key = np.concatenate(
        [
            np.concatenate([rays.points, rays.time[:, None]], axis=1),
            np.concatenate([points, np.zeros((len(points), 1))], axis=1),
        ]
    )
    waves = np.concatenate(
        [
            np.concatenate([_columns(one.shed_waves, len(shed.observer)) for one in parts], axis=1),
            np.concatenate([_columns(one.specular_waves, len(points)) for one in parts], axis=1),
        ]
    )
    numbers = np.concatenate([np.full(_width(one), one.wavenumber) for one in parts])
    with np.errstate(invalid="ignore"):
        amplitudes = waves * np.exp(-1j * numbers * path[:, None])
    observer = np.concatenate([shed.observer, specular.observer])
    creeping = np.arange(len(observer)) < len(shed.observer)
    # what has come to its end, or is hidden, is not there
    there = np.flatnonzero(np.any(amplitudes != 0, axis=1))
    order = there[np.argsort(observer[there], kind="stable")]
    return Sheets(observer[order], creeping[order], key[order] / length, path[order], amplitudes[order])


def isolated(geometry: FarGeometry, parts: list[Parts]) -> BoolArray:
    """Whether the field of each observer is that of its sheets, whatever the problem: no integral serves (m,)."""
    alone = np.ones(len(geometry.directions), dtype=bool)
    for one in parts:
        alone &= (one.in_forward == 0) & (one.in_fan == 0)
    return alone


def _width(parts: Parts) -> int:
    return 4 if parts.vector else 1


def _columns(waves: list[ComplexArray], count: int) -> ComplexArray:
    """Contributions of both polarisations of a conductor, or of the one scalar problem, as columns (count, ...)."""
    return np.asarray(np.sum(waves, axis=0, dtype=complex).reshape(count, -1) if count else np.zeros((0, _size(waves))))


def _size(waves: list[ComplexArray]) -> int:
    return int(np.prod(waves[0].shape[1:], dtype=int))
