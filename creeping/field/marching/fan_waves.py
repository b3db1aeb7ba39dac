"""Marched waves of a whole fan, as functions of a ray's place on the shadow line and of its length.

    u = y(sigma, s) |J|^(-1/2) e^{ik(d.x0 + s) - i pi N/2},   k_c = k - i y_s/y

y varies slowly and has no poles on caustics nor an end where creeping modes have theirs: cubic splines between rays and
steps. k_c is the wavenumber that the wave has along the surface.

Source: Derivations, F22.
"""

from dataclasses import dataclass
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
from scipy.interpolate import RectBivariateSpline, make_interp_spline

from creeping._typing import Any, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.field.boundary import Boundary
from creeping.field.far_geometry import fan_strips
from creeping.field.marching.fan_rays import fan_profiles, wide_rows
from creeping.field.marching.layer import MarchedRays, march_rays
from creeping.field.marching.plan import MarchStatus
from creeping.field.ray_sums import own_error
from creeping.field.surface import surface_waves
from creeping.rays.fan import RayFan
from creeping.rays.quantities import RayPoints
from creeping.rays.strips import Strip

WRAPPED = 6
"""Rays of a closed strip beyond either end that its splines go through."""
KEPT = 2
"""Marches kept with a fan, of so many wavenumbers and boundaries."""
FEWEST = 64
"""Steps at least that are kept of a ray."""
_WAVES: "WeakKeyDictionary[RayFan, dict[tuple[float, Boundary], FanWaves]]" = WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class FanWaves:
    """Marched waves of the strips of a fan.

    Attributes
    ----------
    strips : tuple of Strip
    rows : list of (rays,) of int
        Of each strip's rays in ``marched``.
    marched : MarchedRays
    times : (steps,), L
        At which waves are kept.
    boundary : Boundary
    """

    strips: tuple[Strip, ...]
    rows: list[IntArray]
    marched: MarchedRays
    times: FloatArray
    boundary: Boundary

    @property
    def wavenumber(self) -> float:
        """K, 1/L."""
        return self.marched.wavenumber

    def at(self, strip: int, sigma: FloatArray, s: FloatArray) -> ComplexArray:
        """Y at places (n,) of a strip: (n,)."""
        real, imaginary = self._splines[strip]
        sigma = self.strips[strip].wrap(sigma)
        return np.asarray(real.ev(sigma, s) + 1j * imaginary.ev(sigma, s))

    def slope(self, strip: int, sigma: FloatArray, s: FloatArray) -> ComplexArray:
        """Its derivative y_s, 1/L times its unit, at places (n,) of a strip: (n,)."""
        real, imaginary = self._splines[strip]
        sigma = self.strips[strip].wrap(sigma)
        return np.asarray(real.ev(sigma, s, dy=1) + 1j * imaginary.ev(sigma, s, dy=1))

    def across(self, strip: int, sigma: FloatArray, s: FloatArray) -> ComplexArray:
        """Its derivative in sigma at places (n,) of a strip: (n,)."""
        real, imaginary = self._splines[strip]
        sigma = self.strips[strip].wrap(sigma)
        return np.asarray(real.ev(sigma, s, dx=1) + 1j * imaginary.ev(sigma, s, dx=1))

    def error(self, strip: int, sigma: FloatArray, s: FloatArray) -> FloatArray:
        """Error of y at places (n,) of a strip, that of the next ray; infinite where that has no wave: (n,)."""
        ray = self.rows[strip][self.strips[strip].nearest(sigma)]
        return self._errors[ray, np.clip(np.searchsorted(self.times, s), 0, len(self.times) - 1)]

    @cached_property
    def _errors(self) -> FloatArray:
        """Error of y (rays, steps)."""
        m = self.marched
        found = np.stack([np.interp(self.times, m.s[ray], m.error[ray]) for ray in range(len(m))])
        late = self.times[None, :] > m.reliable[:, None]
        found = np.where(late, np.maximum(found, np.max(np.abs(m.values), axis=1)[:, None]), found)
        for strip, rows in zip(self.strips, self.rows, strict=True):
            by_modes = ~self.served[rows]
            found[rows[by_modes]] = self._modes(strip, by_modes)[1]
        return found

    @cached_property
    def served(self) -> BoolArray:
        """Whether a ray has a wave (rays,)."""
        return ~np.isin(self.marched.status, (MarchStatus.UNLIT, MarchStatus.UNSTABLE))

    @cached_property
    def _splines(self) -> list[tuple[RectBivariateSpline, RectBivariateSpline]]:
        """Splines of the real and the imaginary part of y on each strip."""
        found = []
        for strip, rows in zip(self.strips, self.rows, strict=True):
            values = np.stack([self.marched.at(ray, self.times) for ray in rows])
            values[~self.served[rows]] = self._modes(strip, ~self.served[rows])[0]
            places, values = _around(strip, values)
            degree = min(3, len(places) - 1)
            found.append(
                (
                    RectBivariateSpline(places, self.times, values.real, kx=degree),
                    RectBivariateSpline(places, self.times, values.imag, kx=degree),
                )
            )
        return found


    def lean(self, strip: int, sigma: FloatArray, s: FloatArray) -> FloatArray:
        """Lambda at places (n,) of a strip: (n,)."""
        return np.asarray(self._leans[strip].ev(self.strips[strip].wrap(sigma), s))

    @cached_property
    def _leans(self) -> list[RectBivariateSpline]:
        """Splines of Lambda on each strip."""
        profiles, found = self.marched.profiles, []
        for strip, rows in zip(self.strips, self.rows, strict=True):
            values = np.stack([profiles.value_of("lean", ray, self.times) for ray in rows])
            places, values = _around(strip, values)
            found.append(RectBivariateSpline(places, self.times, values, kx=min(3, len(places) - 1)))
        return found

    def _modes(self, strip: Strip, chosen: BoolArray) -> tuple[ComplexArray, FloatArray]:
        """Y of creeping modes on rays that are not marched, 0 where they have ended, and its error (chosen, steps)."""
        rays = strip.rays[chosen]
        if not len(rays.time):
            return np.zeros((0, len(self.times)), dtype=complex), np.zeros((0, len(self.times)))
        lanes = rays.lanes.copy()
        lanes[..., 6:9] = 1.0, 0.0, 0.0
        k, kind = self.wavenumber, self.boundary
        plain = RayPoints(lanes, rays.starts, rays.time, rays.alive, rays.scale)
        waves = surface_waves(plain, k, kind, 2), surface_waves(plain, k, kind, 1)
        error = np.where(rays.alive, own_error(plain, waves, k, kind, 2, on=True), np.inf)
        y = make_interp_spline(strip.times, waves[0] * np.exp(-1j * k * rays.eikonal), k=3, axis=1)(self.times)
        # the step before tells
        at = np.clip(np.searchsorted(strip.times, self.times), 0, len(strip.times) - 1)
        return np.asarray(y), error[:, at]


def _around(strip: Strip, values: Any) -> tuple[FloatArray, Any]:
    """Places of a strip's rays and values (rays, ...) there, with some beyond either end of a closed one."""
    places = strip.positions
    if not strip.closed:
        return places, values
    count = len(places)
    around = np.arange(-min(WRAPPED, count), count + min(WRAPPED, count))
    return places[around % count] + strip.period * (around // count), values[around % count]


def fan_waves(fan: RayFan, *, wavenumber: float, boundary: Boundary) -> FanWaves:
    """Marched waves of a fan, made once for each of the last wavenumbers and boundaries."""
    kept = _WAVES.setdefault(fan, {})
    key = (wavenumber, boundary)
    if key not in kept:
        while len(kept) >= KEPT:
            kept.pop(next(iter(kept)))
        marched = march_rays(fan_profiles(fan), wavenumber=wavenumber, boundary=boundary)
        steps = int(np.max(np.sum(np.diff(marched.s, axis=1)[:, :] > 0, axis=1), initial=FEWEST))
        kept[key] = FanWaves(fan_strips(fan), wide_rows(fan), marched, np.linspace(0.0, fan.length, steps + 1), boundary)
    return kept[key]
