"""The current J = n x H and the charge n.E at points of a perfect conductor.

    J = (1 - W)(J_lit + J_thrown) + sum_rays w_i J_i,  W = W(xi; 0, 0.6),  w_i = W for rays that have just left the line
    n.E = div J/(ik),   dH_n/dn = -div (J x n)

J_lit and J_i are those of `creeping.field.currents.conductor`, J_thrown is what the ground receives from other parts of
the body (`creeping.field.currents.bounce`); where rays merge beams stand for them
(`creeping.field.conductor.on_body`). Where the integral equation is solved its solution stands for all of it, and
n.E is that of `creeping.field.equation.currents`. Divergences are by `creeping.field.conductor.on_body`.
Errors and statuses are those of scalar fields on the body (`creeping.field.on_body`), |J| in place of |u|; on lit
ground BEYOND |J_thrown| stands besides, for what comes to it later. The charge of expansions has the error of J.

Also here: the current of creeping waves where their rays merge, by Gaussian beams that carry vectors.

Beams of `creeping.field.conductor.vector_waves`, whose waves are creeping modes of second order.

Also here: surface divergence of a tangential field on a body, by its differences between points to either side.

    div v = Σ_t t.[v(x + h t) - v(x - h t)]/2h,   t two tangents at x, kh = CLOSE

Sources: [CK13, sec. 6.2]; [P82]; Derivations, F18, F26 and F24.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from creeping._typing import Any, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.field.arguments import fock_parameter
from creeping.field.beams import STRONG, beams_beside_rays, blended_sum, seconds, variation
from creeping.field.boundary import CONDUCTOR, ELECTRIC_HARD
from creeping.field.conductor.marched import current_marches, marched_current
from creeping.field.conductor.vector_waves import VectorWaves
from creeping.field.currents.conductor import ConductorCurrents, lit_vectors, ray_scalars, ray_vectors
from creeping.field.currents.nodes import TAKEN_OVER, axes_of_incidence, lit_part
from creeping.field.equation.currents import ON_BODY, ConductorTileCurrents, along_body
from creeping.field.far_geometry import fan_strips
from creeping.field.lit_ground import composed, convex, lit_error
from creeping.field.point_result import LEAST_WORTH, WORTH, FieldStatus, PointValues, Words, measured_field
from creeping.field.ray_sums import RaySum, own_error, ray_sum, total_of
from creeping.field.strip_waves import StripTable, modes_on_strip, resampled, without_tubes
from creeping.field.surface import surface_waves
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.quadrature import nodes_at
from creeping.geometry.surface import Surface, normal, project, size
from creeping.rays.fan import RayFan
from creeping.rays.quantities import RayPoints
from creeping.rays.shedding import ShedRays, shed_on
from creeping.rays.status import RayStatus

MERGED = 1e-3
"""Error of the sum over rays, as a share of the incident wave, from which beams are asked."""
FAVOUR = {"beams": 1.0, "march": 0.3}
"""Share of the error of what serves already, below which another sum takes its place: where modes hold they know more
of a conductor than what is marched does."""
BEYOND = 1.0
"""What the ground receives later than at first, to and fro and by shed rays, as a share of what it does at first."""
WORST = 0.99
"""Error of a ray, as a share of it, at most: one that has ended is none of those that beams are made of."""

STEPS = 12.0
"""Steps a wavelength at which waves are kept along rays."""
FEWEST = 8
"""Rays of a strip from which waves are interpolated between them."""
LONGEST = 60.0
"""Seconds that beams may take."""

CLOSE = 0.02
"""kh: expansions are smooth to rounding."""


class Crosses(NamedTuple):
    """Points (n,) of a body and those to either side of them, in blocks of n: the points first.

    Attributes
    ----------
    points, normals : (5 n, 3), L and 1
    apart : (2, n, 3), L
        What the two points along each tangent are apart.
    """

    points: FloatArray
    normals: FloatArray
    apart: FloatArray

    def divergence(self, values: ComplexArray) -> ComplexArray:
        """Divergence, 1/L, of values (5 n, 3, p): (n, p)."""
        ends = values.reshape(5, -1, *values.shape[1:])[1:]
        slopes = np.sum(self.apart[..., None] * (ends[0::2] - ends[1::2]), axis=2)
        return np.asarray(np.sum(slopes / np.sum(self.apart**2, axis=2)[..., None], axis=0))


def crosses(body: Surface, direction: FloatArray, points: FloatArray, k: float) -> Crosses:
    """Crosses at points of a body (n, 3), L."""
    n = normal(body, points)
    first = axes_of_incidence(n, direction)
    sides = [project(body, points + sign * CLOSE / k * t) for t in (first, np.cross(n, first)) for sign in (1.0, -1.0)]
    apart = np.stack([a - b for a, b in zip(sides[0::2], sides[1::2], strict=True)])
    around = np.concatenate([points, *sides])
    return Crosses(around, normal(body, around), apart)


@dataclass(frozen=True, eq=False)
class OnConductor:
    """What is on the body at points (n,), for each of p incident polarisations.

    Attributes
    ----------
    current : list of PointValues
        J (n, 3) of each polarisation.
    charge : (n, p) complex
        n.E, in units of the incident E.
    charge_error : (n, p)
    slope : (n, p) complex, optional
        (1/k) dH_n/dn of expansions, whose error is that of J.
    """

    current: list[PointValues]
    charge: ComplexArray
    charge_error: FloatArray
    slope: ComplexArray | None = None


def on_conductor(
    fan: RayFan,
    points: FloatArray,
    k: float,
    electric: ComplexArray,
    left: FloatArray,
    currents: ConductorCurrents | None,
) -> OnConductor:
    """J and n.E, of expansions dH_n/dn too, at points of the body (n, 3), for incident E0 (3, p).

    ``left`` (p,) is what ``currents`` of the whole body leave inside of each incident wave, 0 on a body that is convex.
    """
    if isinstance(currents, ConductorTileCurrents):
        return _solved_on(currents, points, left)
    cross = crosses(fan.body, fan.line.direction, points, k)
    served, total = _by_expansions(fan, cross, k, electric, left, currents)
    magnetic = np.cross(total, cross.normals[:, :, None], axis=1)
    charge, turned = cross.divergence(total), cross.divergence(magnetic)
    error = np.stack([one.error for one in served], axis=1)
    return OnConductor(served, charge / (1j * k), error, -turned / k)


def _solved_on(currents: ConductorTileCurrents, points: FloatArray, left: FloatArray) -> OnConductor:
    """J and the charge of solved currents at points (n, 3), L."""
    found = currents.on_body(points)
    values = found.values
    if not is_piecewise(currents.body):
        # normals of tiles are not quite those of the body; on an edge each face has its own
        values = along_body(normal(currents.body, points), values)
    served = []
    for i, share in enumerate(left):
        J, error = values[:, :, i], np.maximum(found.error[:, i], ON_BODY * float(share))
        one, lit = measured_field(J, error, "equation", "extinction"), found.lit[:, None]
        served.append(replace(one, wave=np.where(lit, J, 0.0), creeping=np.where(lit, 0.0, J)))
    return OnConductor(served, *currents.charge_on_body(points, found.values))


def _by_expansions(
    fan: RayFan,
    cross: Crosses,
    k: float,
    electric: ComplexArray,
    left: FloatArray,
    currents: ConductorCurrents | None,
) -> tuple[list[PointValues], ComplexArray]:
    """J of expansions at points (n,) for each polarisation, and at them and around them (5n, 3, p)."""
    around, normals = cross.points, cross.normals
    count = len(around) // 5
    lit, lit_off, share = _lit_at(fan, around, normals, k, electric)
    if currents is not None and not convex(fan):
        at = np.flatnonzero(share > 0)
        thrown = share[at, None, None] * currents.reflected_onto(around[at], normals[at])
        lit[at] += thrown
        lit_off[at] = np.hypot(lit_off[at], BEYOND * np.linalg.norm(thrown, axis=1))
    rays, by = _rays_at(fan, around, normals, k, electric, 1 - share)
    served, total = [], np.empty_like(lit)
    for i, (sums, method) in enumerate(zip(rays, by, strict=True)):
        centre = RaySum(sums.values[:count], sums.error, sums.status, sums.faded)
        parts = lit[:count, :, i], lit_off[:count, i], share[:count]
        one = composed(fan, parts, centre, method, float(left[i]), k, CONDUCTOR, 1.0)
        served.append(one)
        # what is left out at a point is left out around it
        dropped = np.all(one.creeping == 0, axis=1) | ~np.all(np.isfinite(sums.values[:count]), axis=1)
        total[:, :, i] = lit[:, :, i] + np.where(np.tile(dropped, 5)[:, None], 0.0, sums.values)
    return served, total


def _lit_at(
    fan: RayFan, points: FloatArray, normals: FloatArray, k: float, electric: ComplexArray
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """The lit side's part of J at points (n, 3, p), its error (n, p), and its share (n,)."""
    body, d, p = fan.body, fan.line.direction, electric.shape[1]
    at, part = lit_part(body, fan.line, nodes_at(body, points, normals), k)
    J, other = (lit_vectors(part, d, electric, k, o) for o in (2, 1))
    values, error, share = (
        np.zeros((len(points), 3, p), dtype=complex),
        np.zeros((len(points), p)),
        np.zeros(len(points)),
    )
    share[at] = part.weights
    values[at] = part.weights[:, None, None] * J
    large, change = np.linalg.norm(J, axis=1), np.linalg.norm(J - other, axis=1)
    for i in range(p):
        off = lit_error(part, large[:, i], change[:, i], k, CONDUCTOR, 2, size(body))
        error[at, i] = part.weights * off
    return values, error, share


def _rays_at(
    fan: RayFan,
    around: FloatArray,
    normals: FloatArray,
    k: float,
    electric: ComplexArray,
    share: FloatArray,
) -> tuple[list[RaySum], list[Words]]:
    """Sums over rays at points and around them (5n, 3), with the error and status of the points alone (n,).

    One for each polarisation, and what serves at each point; ``share`` (5n,) is that of rays next to the line.
    """
    count = len(around) // 5
    found = shed_on(fan_strips(fan), fan.body, around)
    of = normals[found.observer]
    # rays pass through points of the body that differ from those of the strip by its error alone
    twist = nodes_at(fan.body, around[found.observer], of).twist(found.rays.directions)
    young = fock_parameter(found.rays, k) < TAKEN_OVER
    weight = np.where(young, share[found.observer], 1.0)[:, None, None]
    with np.errstate(invalid="ignore"):
        waves, other = (weight * ray_vectors(found.rays, of, twist, fan.line.direction, electric, k, o) for o in (2, 1))
    waves, other = (np.where(weight > 0, wave, 0.0) for wave in (waves, other))
    middle = found.observer < count
    strength = _strength(found.rays, weight, k)
    sums, methods, parts = [], [], []
    for i in range(electric.shape[1]):
        pair = waves[middle, :, i], other[middle, :, i]
        own = own_error(found.rays[middle], pair, k, CONDUCTOR, 2, mixed=strength[middle])
        one = ray_sum(fan, found[middle], count, pair[0], own, k, ELECTRIC_HARD, strength[middle])
        sums.append(replace(one, values=total_of(waves[:, :, i], found.observer, 5 * count)))
        methods.append(np.full(count, "rays"))
        parts.append(own)
    asked = np.any([(one.status == FieldStatus.CAUSTIC) | (one.error > MERGED) for one in sums], axis=0)
    at = np.flatnonzero(asked)
    if len(at) and beams_serve(fan, 5 * len(at), k):
        by_beams = _beams_at(fan, around, at, found, (waves, strength, weight[:, 0, 0]), share, k, electric)
        _take_better(sums, methods, by_beams, at, "beams")
    at = np.flatnonzero(np.any([(one.status != FieldStatus.OK) | (one.error > MERGED) for one in sums], axis=0))
    if len(at) and current_marches(fan, 5 * len(at), k):
        rows, shed, mine = _found_at(found, len(around), at)
        marched = marched_current(fan, shed, around[rows], normals[rows], share[rows], young[mine], k, electric)
        its = [replace(one, **_of_points(one, len(at))) for one in marched]
        _take_better(sums, methods, its, at, "march")
    return sums, methods


def _found_at(found: ShedRays, total: int, at: IntArray) -> tuple[IntArray, ShedRays, BoolArray]:
    """Rows of the points ``at`` and of those around them among (5n,), their rays, and which of all rays these are."""
    count = total // 5
    rows = np.concatenate([at + block * count for block in range(5)])
    row = np.full(total, -1)
    row[rows] = np.arange(len(rows))
    mine = row[found.observer] >= 0
    return rows, replace(found[mine], observer=row[found.observer[mine]]), mine


def _of_points(one: RaySum, few: int) -> dict[str, Any]:
    """Error, status and what has faded of the points alone."""
    return {name: getattr(one, name)[:few] for name in ("error", "status", "faded")}


def _take_better(sums: list[RaySum], methods: list[Words], others: list[RaySum], at: IntArray, name: str) -> None:
    """Put other sums in place of those that are not OK or err more, at the points ``at`` of each polarisation.

    Where rays have ended and no sum is OK the march knows of more waves.
    """
    for i, its in enumerate(others):
        mine = sums[i]
        status, error = mine.status[at], mine.error[at]
        # what is worth little by itself is replaced by anything that is worth more
        size = np.linalg.norm(mine.values[at], axis=1)
        poor = error > np.maximum(WORTH * size, LEAST_WORTH)
        less = np.where(poor, error, FAVOUR[name] * error)
        better = (its.status == FieldStatus.OK) & ((status != FieldStatus.OK) | (its.error < less))
        better |= (name == "march") & (status == FieldStatus.DETACHED) & (its.status == FieldStatus.DETACHED)
        sums[i], methods[i] = _taken(mine, its, at, at[better], methods[i], name)


def _strength(rays: RayPoints, weight: FloatArray, k: float) -> FloatArray:
    """|u| of rays (m,): what their currents of either polarisation are made of."""
    with np.errstate(invalid="ignore"):
        return np.where(weight[:, 0, 0] > 0, np.abs(surface_waves(rays, k, ELECTRIC_HARD, 1)) * weight[:, 0, 0], 0.0)


def _taken(mine: RaySum, its: RaySum, at: IntArray, better: IntArray, method: Words, name: str) -> tuple[RaySum, Words]:
    """A sum with another, at points ``at`` and around them, in its place at the points ``better``."""
    count = len(mine.status)
    row = np.full(count, -1)
    row[at] = np.arange(len(at))
    values, error, status = mine.values.copy(), mine.error.copy(), mine.status.copy()
    for block in range(5):
        values[better + block * count] = its.values[row[better] + block * len(at)]
    error[better], status[better] = its.error[row[better]], its.status[row[better]]
    method = method.astype("<U8")
    method[better] = name
    return RaySum(values, error, status, mine.faded), method


def _beams_at(
    fan: RayFan,
    around: FloatArray,
    at: IntArray,
    found: ShedRays,
    waves: tuple[ComplexArray, FloatArray, FloatArray],
    share: FloatArray,
    k: float,
    electric: ComplexArray,
) -> list[RaySum]:
    """Sums of beams at the points ``at`` and around them, each with the error and status of the points alone.

    ``waves`` of the rays found are J (m, 3, p), |u| (m,), and their weights (m,).
    """
    few, p = len(at), electric.shape[1]
    rows, shed, mine = _found_at(found, len(around), at)
    J, strength, weight = waves[0][mine], waves[1][mine], waves[2][mine]
    # an infinite wave is that of a caustic: beams serve there
    own, strength = np.where(np.isfinite(J), J, 0.0), np.where(np.isfinite(strength), strength, 0.0)
    beams = mode_waves_of(fan, k, electric)
    sums = beams_beside_rays(
        fan, beams, shed, around[rows], own.reshape(len(own), 3 * p), share[rows], beams.components
    )
    y, across = np.zeros((2, len(shed.sigma)), dtype=complex)
    for number in range(len(beams.strips)):
        these = np.flatnonzero(shed.strip == number)
        place = number, shed.sigma[these], shed.rays.time[these]
        y[these], across[these] = beams.at(*place), beams.across(*place)
    eta, n = variation(fan, shed, y, across, k), normal(fan.body, around[rows])
    large, part = _without_caustics(fan, shed, around[rows], k, electric)
    with np.errstate(divide="ignore"):
        large = large * (weight * np.minimum(np.abs(shed.rays.spreading) ** -0.5, STRONG))[:, None]
    out = []
    for i in range(p):
        both = sums[0].reshape(-1, 3, p)[:, :, i], sums[1].reshape(-1, 3, p)[:, :, i]
        whole = blended_sum(fan, shed, own[:, :, i], strength, large[:, i], part[:, i], eta, both, k, ELECTRIC_HARD)
        # feet of beams have tangents of their own
        tangential = whole.values - np.sum(n * whole.values, axis=1, keepdims=True) * n
        out.append(RaySum(tangential, whole.error[:few], whole.status[:few], whole.faded[:few]))
    return out


def _without_caustics(
    fan: RayFan, shed: ShedRays, points: FloatArray, k: float, electric: ComplexArray
) -> tuple[FloatArray, FloatArray]:
    """Size of each ray's J but for its tube, at least |u|, and the error of J as a share of that: (m, p) each."""
    rays, x = without_tubes(shed.rays), points[shed.observer]
    n = normal(fan.body, x)
    twist = nodes_at(fan.body, x, n).twist(rays.directions)
    pair = [ray_vectors(rays, n, twist, fan.line.direction, electric, k, o) for o in (2, 1)]
    u = np.abs(surface_waves(rays, k, ELECTRIC_HARD, 1))
    large = np.maximum(np.linalg.norm(pair[0], axis=1), u[:, None])
    off = [
        own_error(rays, (pair[0][:, :, i], pair[1][:, :, i]), k, CONDUCTOR, 2, mixed=u)
        for i in range(electric.shape[1])
    ]
    with np.errstate(divide="ignore", invalid="ignore"):
        return large, np.nan_to_num(np.minimum(np.stack(off, axis=1) / large, WORST))


class ModeWaves(VectorWaves):
    """Creeping modes of a conductor."""

    def at(self, strip: int, sigma: FloatArray, s: FloatArray) -> ComplexArray:
        """Y of u at places (n,) of a strip: (n,)."""
        return self._hard.at(strip, sigma, s)

    def slope(self, strip: int, sigma: FloatArray, s: FloatArray) -> ComplexArray:
        """Its derivative in s, 1/L: (n,)."""
        return self._hard.at(strip, sigma, s, ds=1)

    def across(self, strip: int, sigma: FloatArray, s: FloatArray) -> ComplexArray:
        """Its derivative in sigma, 1/L: (n,)."""
        return self._hard.at(strip, sigma, s, dsigma=1)

    def lean(self, strip: int, sigma: FloatArray, s: FloatArray) -> FloatArray:
        """0 (n,): modes know nothing of what varies across their rays."""
        return np.zeros(sigma.shape)

    def ratios(self, strip: int, sigma: FloatArray, s: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """(i/k) v/u and Du/(2 m^2 u) at places (n,) of a strip."""
        soft, changing = (table.at(strip, sigma, s) for table in self._ratios)
        return soft, changing

    @cached_property
    def _hard(self) -> StripTable:
        found = [modes_on_strip(strip, self.times, self.wavenumber, ELECTRIC_HARD)[0] for strip in self.strips]
        return StripTable(self.strips, self.times, found)

    @cached_property
    def _ratios(self) -> tuple[StripTable, StripTable]:
        """(i/k) v/u and Du/(2 m^2 u) on the strips' rays."""
        tables: tuple[list[ComplexArray], list[ComplexArray]] = ([], [])
        for strip in self.strips:
            hard, soft, changing = ray_scalars(without_tubes(strip.rays), self.wavenumber, 2)
            for table, wave in zip(tables, (soft, changing), strict=True):
                with np.errstate(divide="ignore", invalid="ignore"):
                    ratio = np.where(np.abs(hard) > 0, wave / hard, 0.0)
                table.append(resampled(strip, ratio, self.times))
        soft_table, changing_table = (StripTable(self.strips, self.times, table) for table in tables)
        return soft_table, changing_table


def mode_waves_of(fan: RayFan, wavenumber: float, electric: ComplexArray) -> ModeWaves:
    """Creeping modes of a conductor on a fan."""
    count = max(64, int(np.ceil(STEPS * fan.length * wavenumber / (2 * np.pi))))
    times = np.linspace(0.0, fan.length, count + 1)
    return ModeWaves(fan_strips(fan), times, wavenumber, fan.line.direction, electric)


def beams_serve(fan: RayFan, count: int, wavenumber: float) -> bool:
    """Whether beams can be made of a fan's modes, and cost little enough at ``count`` points."""
    strips = fan_strips(fan)
    return (
        len(strips) > 0
        and sum(len(strip.positions) for strip in strips) == len(fan.status)
        and min(len(strip.positions) for strip in strips) >= FEWEST
        and bool(np.all(fan.status == RayStatus.OK))
        and seconds(fan, strips, wavenumber, count) < LONGEST
    )
