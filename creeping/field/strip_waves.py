"""Complex functions on the strips of a fan, and the creeping modes' wave as one of them.

    u = y(sigma, s) |J|^(-1/2) e^{ik(d.x0 + s) - i pi N/2}

y varies slowly and has no poles on caustics: cubic splines between rays and steps.

Source: Derivations, F22.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import RectBivariateSpline, make_interp_spline

from creeping._typing import Any, ComplexArray, FloatArray
from creeping.field.boundary import Boundary
from creeping.field.ray_sums import own_error
from creeping.field.surface import surface_waves
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
