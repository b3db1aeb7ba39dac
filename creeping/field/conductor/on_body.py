"""The current J = n x H and the charge n.E at points of a perfect conductor.

    J = (1 - W)(J_lit + J_thrown) + sum_rays w_i J_i,  W = W(xi; 0, 0.6),  w_i = W for rays that have just left the line
    n.E = div J/(ik),   dH_n/dn = -div (J x n)

J_lit is that of `creeping.field.currents.conductor`, J_thrown is what the surface receives from other parts of the body
(`creeping.field.currents.bounce`). J_i is marched, with beams where rays merge (`creeping.field.conductor.marched`), or
that of creeping modes where the march is impossible or would take too long. Where the integral equation is solved its
solution stands for all of it, and n.E is that of `creeping.field.equation.currents`. Errors and statuses are those of
scalar fields on the body (`creeping.field.on_body`), |J| in place of |u|; on the lit side BEYOND |J_thrown| stands
besides, for what comes to it later. The charge of expansions has the error of J in both of its slopes.

Also here: surface divergence of a tangential field on a body, by its differences between points to either side.

    div v = sum_t t.[v(x + h t) - v(x - h t)]/2h,   t two tangents at x, kh = CLOSE

Sources: [CK13, sec. 6.2]; [P82]; Derivations, F18, F24 and F26.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.arguments import fock_parameter
from creeping.field.boundary import CONDUCTOR, ELECTRIC_HARD
from creeping.field.conductor.marched import current_marches, marched_current
from creeping.field.currents.conductor import ConductorCurrents, lit_vectors, ray_vectors
from creeping.field.currents.nodes import TAKEN_OVER, axes_of_incidence, lit_part
from creeping.field.equation.currents import ON_BODY, ConductorTileCurrents, along_body
from creeping.field.lit_ground import composed, convex, lit_error
from creeping.field.results.point_result import PointValues, Words, measured_field
from creeping.field.waves.far_geometry import fan_strips
from creeping.field.waves.ray_sums import RaySum, own_error, ray_sum, total_of
from creeping.field.waves.surface import surface_waves
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.quadrature import nodes_at
from creeping.geometry.surface import Surface, normal, project, size
from creeping.rays.fan import RayFan
from creeping.rays.quantities import RayPoints
from creeping.rays.shedding import shed_on

BEYOND = 1.0
"""What the ground receives later than at first, to and fro and by shed rays, as a share of what it does at first."""
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
    # of two slopes, each of which errs as J does
    error = np.sqrt(2) * np.stack([one.error for one in served], axis=1)
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
    for i, sums in enumerate(rays):
        centre = RaySum(sums.values[:count], sums.error, sums.status, sums.faded)
        parts = lit[:count, :, i], lit_off[:count, i], share[:count]
        one = composed(fan, parts, centre, by, float(left[i]), k, CONDUCTOR, 1.0)
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
) -> tuple[list[RaySum], Words]:
    """Sums over rays at points and around them (5n, 3), with the error and status of the points alone (n,).

    One for each polarisation, and the method; ``share`` (5n,) is that of rays next to the line.
    """
    count = len(around) // 5
    found = shed_on(fan_strips(fan), fan.body, around)
    young = fock_parameter(found.rays, k) < TAKEN_OVER
    if current_marches(fan, len(around), k):
        sums = marched_current(fan, found, around, normals, share, young, k, electric)
        few = [RaySum(one.values, one.error[:count], one.status[:count], one.faded[:count]) for one in sums]
        return few, np.full(count, "march")
    of = normals[found.observer]
    # rays pass through points of the body that differ from those of the strip by its error alone
    twist = nodes_at(fan.body, around[found.observer], of).twist(found.rays.directions)
    weight = np.where(young, share[found.observer], 1.0)[:, None, None]
    with np.errstate(invalid="ignore"):
        waves, other = (weight * ray_vectors(found.rays, of, twist, fan.line.direction, electric, k, o) for o in (2, 1))
    waves, other = (np.where(weight > 0, wave, 0.0) for wave in (waves, other))
    middle = found.observer < count
    strength = _strength(found.rays, weight, k)
    sums = []
    for i in range(electric.shape[1]):
        pair = waves[middle, :, i], other[middle, :, i]
        own = own_error(found.rays[middle], pair, k, CONDUCTOR, 2, mixed=strength[middle])
        one = ray_sum(fan, found[middle], count, pair[0], own, k, ELECTRIC_HARD, strength[middle])
        sums.append(replace(one, values=total_of(waves[:, :, i], found.observer, 5 * count)))
    return sums, np.full(count, "rays")


def _strength(rays: RayPoints, weight: FloatArray, k: float) -> FloatArray:
    """|u| of rays (m,): what their currents of either polarisation are made of."""
    with np.errstate(invalid="ignore"):
        return np.where(weight[:, 0, 0] > 0, np.abs(surface_waves(rays, k, ELECTRIC_HARD, 1)) * weight[:, 0, 0], 0.0)
