"""Marched waves of a whole fan, as functions of a ray's place on the shadow line and of its length.

    u = y(sigma, s) |J|^(-1/2) e^{ik(d.x0 + s) - i pi N/2},   k_c = k - i y_s/y

y varies slowly, has no poles on caustics, and no end where creeping modes have theirs: cubic splines between rays and
steps. It is that of the march and that of creeping modes of second order, in inverse proportion to the squares of their
errors: the march takes over where curvature varies, twists or changes its sign, and hands back to modes where they have
decayed below what the top of its layer lets through. k_c is the wavenumber that the wave has along the surface.

Also here: the waves of a whole fan at points of the body, by marching: rays that pass through, and beams where those
merge.

Both go together as `creeping.field.waves.beams` says.

Sources: [P82]; Derivations, F22 and F24.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import RectBivariateSpline, make_interp_spline

from creeping._typing import Any, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.field.boundary import Boundary
from creeping.field.marching.fan_rays import FLAT, fan_profiles, wide_rows
from creeping.field.marching.layer import MarchedRays, march_rays
from creeping.field.marching.plan import MarchStatus
from creeping.field.results.point_result import columns_of
from creeping.field.waves.beams import MOST_TURNED, Components, beams_beside_rays, blended_sum, variation, wide
from creeping.field.waves.far_geometry import fan_strips
from creeping.field.waves.ray_sums import RaySum, own_error
from creeping.field.waves.surface import surface_waves
from creeping.geometry.piecewise import has_edges, is_piecewise
from creeping.geometry.surface import Surface, memo_of
from creeping.rays.ends import AT_CREASES, RayStatus
from creeping.rays.fan import RayFan
from creeping.rays.quantities import RayPoints
from creeping.rays.shedding import ShedRays
from creeping.rays.strips import Strip

TWISTED = 0.4
"""Error of y, as a share of it, by the root of what the twist adds to its phase."""
FAVOUR = {"electric hard": 0.5}
"""How much more the error of modes counts than that of the march, 1 if not named: measured against the equation on
three ellipsoids and a sphere, k = 10 and 20, among 0.05 to 2."""


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
            places, values = strip.positions, table
            if strip.closed:
                # six rays more at either end
                beyond = min(6, len(places))
                rows = np.arange(-beyond, len(places) + beyond)
                values = table[rows % len(places)]
                places = places[rows % len(places)] + strip.period * (rows // len(places))
            degree = min(3, len(places) - 1)
            real, imaginary = (
                RectBivariateSpline(places, self.times, part, kx=degree) for part in (values.real, values.imag)
            )
            found.append((real, imaginary))
        return found


def without_tubes(rays: RayPoints) -> RayPoints:
    """Points of rays whose J is 1, so that their wave is y but for its phase."""
    lanes = rays.lanes.copy()
    lanes[..., 6:9] = 1.0, 0.0, 0.0
    return RayPoints(lanes, rays.starts, rays.time, rays.alive, rays.scale)


def resampled(strip: Strip, values: ComplexArray, times: FloatArray) -> ComplexArray:
    """Values (rays, steps) of a strip's own steps at other times (m,), L: (rays, m)."""
    return np.asarray(make_interp_spline(strip.times, values, k=3, axis=1)(times))


def modes_on_strip(strip: Strip, times: FloatArray, k: float, kind: Boundary) -> tuple[ComplexArray, FloatArray]:
    """y of creeping modes on a strip's rays and its error (rays, steps), infinite where they have ended."""
    rays = strip.rays
    plain = without_tubes(rays)
    waves = surface_waves(plain, k, kind, 2), surface_waves(plain, k, kind, 1)
    error = np.where(rays.alive, own_error(plain, waves, k, kind, 2), np.inf)
    y = resampled(strip, waves[0] * np.exp(-1j * k * rays.eikonal), times)
    # the larger of the steps about a place tells
    at = np.clip(np.searchsorted(strip.times, times), 1, len(strip.times) - 1)
    return y, np.maximum(error[:, at], error[:, at - 1])


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
    alone : bool
        Whether no creeping modes stand beside them.
    ends : (rays,), L
        Where rays end for good, at edges and tips; inf for others.
    """

    strips: tuple[Strip, ...]
    rows: list[IntArray]
    marched: MarchedRays
    times: FloatArray
    boundary: Boundary
    alone: bool
    ends: FloatArray

    @property
    def wavenumber(self) -> float:
        """k, 1/L."""
        return self.marched.wavenumber

    def at(self, strip: int, sigma: FloatArray, s: FloatArray) -> ComplexArray:
        """y at places (n,) of a strip: (n,)."""
        return self._table.at(strip, sigma, s)

    def slope(self, strip: int, sigma: FloatArray, s: FloatArray) -> ComplexArray:
        """Derivative y_s, 1/L times the unit of y, at places (n,) of a strip: (n,)."""
        return self._table.at(strip, sigma, s, ds=1)

    def across(self, strip: int, sigma: FloatArray, s: FloatArray) -> ComplexArray:
        """Derivative of y in sigma at places (n,) of a strip: (n,)."""
        return self._table.at(strip, sigma, s, dsigma=1)

    def error(self, strip: int, sigma: FloatArray, s: FloatArray) -> FloatArray:
        """Error of y at places (n,) of a strip, that of the next ray; infinite where that has no wave: (n,)."""
        ray = self.strips[strip].nearest(sigma)
        return np.asarray(self._tables[strip][1][ray, np.clip(np.searchsorted(self.times, s), 0, len(self.times) - 1)])

    def along(self, ray: IntArray, times: FloatArray) -> tuple[ComplexArray, FloatArray]:
        """y and its error on the fan's own rays (n,), by their numbers, at times (n,), L: (n,) each."""
        y, error = np.zeros(len(ray), dtype=complex), np.full(len(ray), np.inf)
        for number, rows in enumerate(self.rows):
            place = np.full(len(self.ends), -1)
            place[rows] = np.arange(len(rows))
            mine = np.flatnonzero(place[ray] >= 0)
            at = number, self.strips[number].positions[place[ray[mine]]], times[mine]
            y[mine], error[mine] = self.at(*at), self.error(*at)
        return y, error

    @cached_property
    def _tables(self) -> list[tuple[ComplexArray, FloatArray]]:
        """y and its error (rays, steps) of each strip, by marching and by modes."""
        found, favour = [], FAVOUR.get(self.boundary.kind, 1.0)
        for strip, rows in zip(self.strips, self.rows, strict=True):
            y, error = self._by_marching(rows)
            if self.alone:
                found.append((np.where(np.isfinite(error), y, 0.0), error))
                continue
            modes, other = modes_on_strip(strip, self.times, self.wavenumber, self.boundary)
            with np.errstate(invalid="ignore", divide="ignore"):
                # of infinite errors neither wave counts
                share = 1 / (1 + (favour * other / error) ** 2)
                share = np.where(np.isfinite(error), np.where(np.isfinite(other), share, 0.0), np.isfinite(other))
                # both err in the same direction more often than not
                both = np.where(share < 1, (1 - share) * error, 0.0) + np.where(share > 0, share * other, 0.0)
            none = ~np.isfinite(error) & ~np.isfinite(other)
            found.append((np.where(none, 0.0, (1 - share) * y + share * modes), np.where(none, np.inf, both)))
        return found

    def _by_marching(self, rows: IntArray) -> tuple[ComplexArray, FloatArray]:
        """y and its error on rays (rows, steps), infinite where nothing could be marched."""
        m = self.marched
        y = np.stack([m.at(ray, self.times) for ray in rows])
        error = np.stack([np.interp(self.times, m.s[ray], m.error[ray]) for ray in rows])
        late = self.times[None, :] > m.reliable[rows, None]
        error = np.where(late, np.maximum(error, np.max(np.abs(m.values[rows]), axis=1)[:, None]), error)
        # in space what is left out goes like the next power of what the twist adds
        error = error + TWISTED * np.sqrt(self._twist(rows, y)) * np.abs(y)
        lacking = np.isin(m.status[rows], (MarchStatus.UNLIT, MarchStatus.UNSTABLE))
        return y, np.where(lacking[:, None] | (self.times > self.ends[rows, None]), np.inf, error)

    def _twist(self, rows: IntArray, y: ComplexArray) -> FloatArray:
        """(k/2) int |k_c/k - 1|^2 (Lambda^2 + tau^2/kappa_n^2) ds of rays (rows, steps)."""
        profiles, k = self.marched.profiles, self.wavenumber
        lean, torsion, kappa = (
            np.stack([profiles.value_of(name, ray, self.times) for ray in rows])
            for name in ("lean", "torsion", "curvature")
        )
        bent = np.maximum(kappa, FLAT * kappa[:, :1])
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            slope = np.gradient(y, self.times, axis=1)
            turned = np.minimum(np.nan_to_num(np.abs(slope / (k * y))), MOST_TURNED)
        density = 0.5 * k * turned**2 * (lean**2 + (torsion / bent) ** 2)
        return np.asarray(cumulative_trapezoid(density, self.times, axis=1, initial=0))

    @cached_property
    def _table(self) -> StripTable:
        return StripTable(self.strips, self.times, [y for y, _ in self._tables])

    def lean(self, strip: int, sigma: FloatArray, s: FloatArray) -> FloatArray:
        """Lambda at places (n,) of a strip: (n,)."""
        return self._leans.at(strip, sigma, s).real

    @cached_property
    def _leans(self) -> StripTable:
        value_of = self.marched.profiles.value_of
        each = [np.stack([value_of("lean", ray, self.times) for ray in rows]) for rows in self.rows]
        return StripTable(self.strips, self.times, [values.astype(complex) for values in each])


def spread_out(y: ComplexArray, rays: RayPoints, wavenumber: float) -> ComplexArray:
    """The wave u of y on rays (n,), infinite on their caustics."""
    with np.errstate(divide="ignore", invalid="ignore"):
        phase = wavenumber * rays.eikonal - 0.5 * np.pi * rays.caustics
        return np.asarray(y / np.sqrt(np.abs(rays.spreading)) * np.exp(1j * phase))


def march_alone(body: Surface, boundary: Boundary) -> bool:
    """Whether marching alone knows the waves: of an admittance that varies, and across joints."""
    return boundary.varies or (is_piecewise(body) and not has_edges(body))


def marchable(fan: RayFan, boundary: Boundary, order: int, fewest: int = 8) -> bool:
    """Whether the waves of a fan can be marched, with at least ``fewest`` rays on each strip."""
    strips = fan_strips(fan)
    return (
        order == 2
        and boundary.kind in ("soft", "hard", "impedance", "electric hard")
        and len(strips) > 0
        and sum(len(strip.positions) for strip in strips) == len(fan.status)
        and min(len(strip.positions) for strip in strips) >= fewest
        and not has_edges(fan.body)
        # where the line runs along a joint rays have no tube
        and all(bool(np.all(np.isfinite(part))) for strip in strips for part in (strip.rays.lanes, strip.rays.starts))
        and bool(np.all(np.isin(fan.status, (RayStatus.OK, RayStatus.DETACHED, *AT_CREASES))))
    )


def fan_waves(fan: RayFan, *, wavenumber: float, boundary: Boundary) -> FanWaves:
    """Marched waves of a fan, cached for the last wavenumbers and boundaries."""

    def make() -> FanWaves:
        marched = march_rays(fan_profiles(fan, boundary), wavenumber=wavenumber, boundary=boundary)
        times = np.linspace(0.0, fan.length, int(np.max(marched.counts, initial=64)) + 1)
        ends = np.where(np.isin(fan.status, AT_CREASES), fan.detachment, np.inf)
        alone = march_alone(fan.body, boundary)
        return FanWaves(fan_strips(fan), wide_rows(fan), marched, times, boundary, alone, ends)

    return memo_of(fan, "marched waves", (wavenumber, boundary), make, 2)


class OnRays(NamedTuple):
    """Waves of rays found (m,), but for their tubes.

    Attributes
    ----------
    values : (m,) or (m, 3, p) complex
    size, part : (m,) or (m, p)
        Size of each, at least that of the marched wave, and its error as a share of that.
    """

    values: ComplexArray
    size: FloatArray
    part: FloatArray


def scalar_on_rays(waves: FanWaves, shed: ShedRays) -> OnRays:
    """y of the rays found (m,)."""
    y, off = at_shed(shed, len(waves.strips), waves.at, waves.error)
    with np.errstate(divide="ignore", invalid="ignore"):
        return OnRays(y, np.abs(y), np.where(np.abs(y) > 0, off / np.abs(y), 0.0))


def at_shed(shed: ShedRays, strips: int, *functions: Callable[[int, FloatArray, FloatArray], Any]) -> list[Any]:
    """Values (m, ...) of each function(strip, sigma, s), s in L, for the m rays of ``shed``."""
    rows = [np.flatnonzero(shed.strip == number) for number in range(strips)]
    places = [(number, shed.sigma[mine], shed.rays.time[mine]) for number, mine in enumerate(rows)]
    back = np.argsort(np.concatenate(rows))
    return [np.concatenate([of(*place) for place in places])[back] for of in functions]


def marched_sums(
    fan: RayFan,
    waves: FanWaves,
    shed: ShedRays,
    points: FloatArray,
    share: FloatArray,
    young: BoolArray,
    of: OnRays,
    components: Components | None = None,
) -> list[RaySum]:
    """Sums of marched waves at points (n, 3), L, one, or one of each polarisation.

    ``waves`` are those that beams are made of, for a vector with ``components``; ``of`` says what the rays found (m,)
    bring. ``share`` (n,) is that of the rays next to the line, of which ``young`` (m,) says which they are.
    """
    k, observer, count = waves.wavenumber, shed.observer, len(points)
    # an infinite wave is that of a caustic: beams serve there
    tube = spread_out(np.ones(len(observer), dtype=complex), shed.rays, k)
    tube = np.where(np.isfinite(tube), tube, 0.0) * np.where(young, share[observer], 1.0)
    own = wide(tube, of.values) * of.values
    flat = own.reshape(len(own), int(np.prod(own.shape[1:]))) if own.ndim > 1 else own
    sums = beams_beside_rays(fan, waves, shed, points, flat, share, components)
    sides = (columns_of(one.reshape(count, *own.shape[1:])) for one in sums)
    y, slope = at_shed(shed, len(waves.strips), waves.at, waves.across)
    eta, found = variation(fan, shed, y, slope, k), []
    for wave, size, part, *beams in zip(*(columns_of(one) for one in (own, of.size, of.part)), *sides, strict=True):
        strength = np.abs(tube) * size
        # on a caustic a ray is no stronger than its neighbours
        bounded = np.minimum(strength, 1.5 * size)
        found.append(
            blended_sum(fan, shed, wave, strength, bounded, part, eta, (beams[0], beams[1]), k, waves.boundary)
        )
    return found
