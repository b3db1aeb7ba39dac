"""The field on the body: u, or du/dn where u = 0, or J and n.E of a conductor, lit or in the shadow.

    u = (1 - W) u_lit + sum_rays w_i u_i,   W = W(xi; 0, 0.6),   w_i = W for rays that have just left the line

with u_lit the lit side's expansion (`creeping.field.currents.lit`), which holds to a little beyond the line, and what
that side receives from other parts of the body (`creeping.field.currents.radiation`); w_i is 1 for rays that come from
afar. Waves along rays are marched, with beams where rays merge (`creeping.field.marching.fan_waves`), or are creeping
modes where the march is impossible or would take too long. `creeping.field.lit_ground` says how far it is off. On a
body that may reflect onto itself, hides part of its line, or has edges, joints or tips, or if it is asked for, the
solution of the integral equation stands for all of it, where it is affordable (`creeping.field.equation`).

Of a conductor all of this is of J = n x H, of each polarisation, and

    n.E = div J/(ik),   dH_n/dn = -div (J x n),   div v = sum_t t.[v(x + h t) - v(x - h t)]/2h,   kh = 0.02

with two tangents t at x. The charge of expansions has the error of J in both of its slopes. Errors are those of scalar
fields, |J| in place of |u|; what comes to the lit side later is taken to be as much as what comes there at first.

Sources: [F46], [LK59]; [CK13, sec. 6.2], [P82]; Derivations, F9, F16, F18, F20, F22, F24 and F26.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from creeping._typing import ArrayLike, ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.arguments import PLAIN, checked_plain, fock_parameter
from creeping.field.boundary import ELECTRIC_HARD, SOFT, BoundaryLike
from creeping.field.currents.conductor import ConductorWaves, lit_vectors, ray_vectors
from creeping.field.currents.nodes import TAKEN_OVER, axes_of_incidence, lit_part, lit_waves
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.field.equation.currents import ON_BODY, ConductorTileCurrents, TileCurrents, along_body
from creeping.field.lit_ground import composed, lit_error, without_tips
from creeping.field.marching.fan_waves import fan_waves, march_alone, marched_sums, scalar_on_rays
from creeping.field.on_rays import own_waves
from creeping.field.results.conductor_result import ConductorCurrent, vector_on_body
from creeping.field.results.point_result import (
    FieldStatus,
    PointValues,
    SurfaceField,
    Words,
    columns_of,
    measured_field,
    scalar_on_body,
)
from creeping.field.routes import Problem, currents_behind, left_behind, marches, stands_alone
from creeping.field.waves.beams import wide
from creeping.field.waves.far_geometry import fan_strips
from creeping.field.waves.ray_sums import RaySum, own_error, ray_sum, total_of
from creeping.field.waves.surface import surface_waves
from creeping.geodesics.states import as_points, on_body
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.quadrature import nodes_at
from creeping.geometry.surface import Surface, normal, project, size
from creeping.rays.fan import RayFan
from creeping.rays.quantities import RayPoints
from creeping.rays.shedding import shed_on


def surface_field(
    fan: RayFan,
    points: ArrayLike | None = None,
    *,
    wavenumber: float,
    boundary: BoundaryLike = "soft",
    order: int = 2,
    method: str = "auto",
) -> SurfaceField:
    """Field on the body and its error: u, or du/dn (1/L) on a soft boundary.

    Parameters
    ----------
    fan : RayFan
    points : (..., 3), L, optional
        Points on the body, lit or in the shadow.
    wavenumber : float, 1/L
    boundary : "soft", "hard" or ImpedanceBoundary
    order : 2 or 1
    method : {"auto", "equation"}
        With points: "auto" uses rays and the lit side's expansion where they apply; "equation" uses the solution of
        the integral equation everywhere (`surface_currents` with ``solve=True``).

    Returns
    -------
    SurfaceField
        Usable as the array of its values. Without points, (rays, steps): the contribution of each ray alone. It is
        computed by creeping modes up to detachment and by marching beyond; for the fan of a point source, whose
        incident wave is e^{ikR}/(4 pi R), by modes only. It is infinite at caustics of the ray (status CAUSTIC), and 0
        after the ray has ended (DETACHED) or if the wave did not launch the ray (NO_RAY). With points (...): the total
        field. In the shadow this is the sum over all rays through a point, or 0 if no ray passes (NO_RAY or
        TRUNCATED). Waves are marched, with beams where rays merge, so that they continue across caustics and beyond
        detachment. Creeping modes replace marching where it is impossible or takes more than a minute, and for order 1.

    Raises
    ------
    InvalidInputError
        On bad points, wavenumber, boundary, order or method, for a weighted body, or if points are given for the fan of
        a point source.
    SurfaceError
        If method="equation" and the wavenumber is too high for any mesh of the body.

    Examples
    --------
    >>> import numpy as np
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> line = cr.shadow_line(ball, direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, length=3.0, n_rays=16)
    >>> u = cr.surface_field(fan, wavenumber=30.0, boundary="hard")
    >>> u.shape == fan.spreading.shape, bool(abs(u[0, -1]) < abs(u[0, 0]))
    (True, True)
    >>> u = cr.surface_field(fan, [(0, 0, -1), (0, 0.8, 0.6)], wavenumber=30.0, boundary="hard")
    >>> np.abs(u).round(1).tolist(), u.method.tolist(), bool(u.error.max() < 0.05)
    ([2.0, 0.5], ['lit', 'march'], True)
    """
    problem = Problem.scalar(fan, wavenumber, boundary, order, method, PLAIN)
    if points is None:
        if method == "equation":
            raise InvalidInputError("method 'equation' is of the field at points, not of each ray's own; give points")
        return own_waves(problem)
    y = as_points(points)
    x = on_body(fan.body, y).reshape(-1, 3)
    found = field_on_body(problem, x, currents_behind(problem))
    return scalar_on_body(found.columns[0], y, problem.unit, problem.facts())


def conductor_current(
    fan: RayFan,
    points: ArrayLike,
    *,
    wavenumber: float,
    polarisation: str | ArrayLike | None = None,
    method: str = "auto",
) -> ConductorCurrent:
    """Current J = n x H and charge n.E at points of a perfect conductor, and their errors.

    Parameters
    ----------
    fan : RayFan
    points : (..., 3), L
        Points on the body, lit or in the shadow.
    wavenumber : float, 1/L
    polarisation : "theta", "phi" or (3,) complex, optional
        E0 of the incident wave, transverse and of any length; by default both theta and phi.
    method : {"auto", "equation"}
        As for `conductor_field`.

    Returns
    -------
    ConductorCurrent
        J in units of the incident H, the charge in units of the incident E; usable as the array of J.

    Raises
    ------
    InvalidInputError
        On points off the body or not finite, a bad wavenumber, polarisation or method, for a weighted body, or if the
        equation is needed (method="equation", or a body with edges or joints) and cannot be solved.
    SurfaceError
        If the equation has to be solved and the wavenumber is too high for any mesh of the body.

    Examples
    --------
    >>> import numpy as np
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> line = cr.shadow_line(ball, direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, length=4.0, n_rays=24)
    >>> J = cr.conductor_current(fan, [(0, 1, 0), (1, 0, 0)], wavenumber=30.0, polarisation=(1, 0, 0))
    >>> np.linalg.norm(J, axis=1).round(1).tolist(), np.abs(J.charge).round(1).tolist()   # E across n, and along it
    ([0.3, 1.4], [0.0, 1.5])
    """
    problem = Problem.conductor(fan, wavenumber, polarisation, method)
    y, single = as_points(points), polarisation is not None
    x = on_body(fan.body, y).reshape(-1, 3)
    found = field_on_body(problem, x, currents_behind(problem))
    facts = problem.facts() | {"incident_electric": problem.electric[:, 0] if single else problem.electric}
    return vector_on_body(found.columns, (found.charge, found.charge_error), y, facts, single=single)


class OnBody(NamedTuple):
    """What is on the body at points (n,).

    Attributes
    ----------
    columns : list of PointValues
        u or du/dn (n,), or J (n, 3) of each polarisation.
    charge : (n, p) complex
        n.E of a conductor, in units of the incident E.
    charge_error : (n, p)
    slope : (n, p) complex
        (1/k) dH_n/dn of a conductor's expansions, whose error is that of J.
    """

    columns: list[PointValues]
    charge: ComplexArray = np.zeros((0, 0), dtype=complex)
    charge_error: FloatArray = np.zeros((0, 0))
    slope: ComplexArray = np.zeros((0, 0), dtype=complex)


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
    sides = [project(body, points + sign * 0.02 / k * t) for t in (first, np.cross(n, first)) for sign in (1.0, -1.0)]
    apart = np.stack([a - b for a, b in zip(sides[0::2], sides[1::2], strict=True)])
    around = np.concatenate([points, *sides])
    return Crosses(around, normal(body, around), apart)


def field_on_body(problem: Problem, points: FloatArray, currents: SurfaceCurrents | None) -> OnBody:
    """The field at points of the body (n, 3); ``currents`` of the whole body are those that stand behind it, if any."""
    if isinstance(currents, (TileCurrents, ConductorTileCurrents)) and problem.order == 2:
        return _solved_on(currents, points)
    checked_plain(problem.body, edgeless="the field at points of the body")
    currents = None if stands_alone(problem) else currents
    if not problem.vector:
        columns, _ = _by_expansions(problem, points, normal(problem.body, points), len(points), currents)
        return OnBody([without_tips(one) for one in columns] if is_piecewise(problem.body) else columns)
    cross = crosses(problem.body, problem.direction, points, problem.wavenumber)
    columns, each = _by_expansions(problem, cross.points, cross.normals, len(points), currents)
    J, k = np.stack(each, axis=-1), problem.wavenumber
    charge, turned = cross.divergence(J), cross.divergence(np.cross(J, cross.normals[:, :, None], axis=1))
    # of two slopes, each of which errs as J does
    error = np.sqrt(2) * np.stack([one.error for one in columns], axis=1)
    return OnBody(columns, charge / (1j * k), error, -turned / k)


def _solved_on(currents: TileCurrents | ConductorTileCurrents, points: FloatArray) -> OnBody:
    """Solved currents at points (n, 3), L, and a conductor's charge."""
    found = currents.on_body(points)
    if isinstance(currents, TileCurrents):
        return OnBody([measured_field(found.values, found.error, "equation", lit=found.lit)])
    values = found.values
    if not is_piecewise(currents.body):
        # normals of tiles are not quite those of the body; on an edge each face has its own
        values = along_body(normal(currents.body, points), values)
    error = np.maximum(found.error, ON_BODY * np.max(currents.left_of_each, axis=0))
    pairs = zip(columns_of(values), columns_of(error), strict=True)
    columns = [measured_field(J, off, "equation", lit=found.lit) for J, off in pairs]
    return OnBody(columns, *currents.charge_on_body(points, found.values))


def _by_expansions(
    problem: Problem, points: FloatArray, normals: FloatArray, count: int, currents: SurfaceCurrents | None
) -> tuple[list[PointValues], list[ComplexArray]]:
    """The field of each polarisation at the first ``count`` of points (n, 3), and a vector's values at all (n, 3).

    ``currents`` say what comes from elsewhere on the body.
    """
    left = left_behind(problem, currents)
    lit, lit_off, share = _lit_at(problem, points, normals)
    if currents is not None and problem.order == 2 and currents.bounces and not is_piecewise(problem.body):
        # as much may come later, to and fro, and to the dark side, whose rays do not know of it
        at = np.flatnonzero(share > 0) if problem.vector else np.arange(len(points))
        thrown = currents.reflected_onto(points[at], normals[at])
        here = wide(share[at], lit) * thrown
        lit[at] += here
        lit_off[at] = np.hypot(lit_off[at], np.linalg.norm(here, axis=1) if problem.vector else np.abs(thrown))
    rays, by = rays_on(problem, points, normals, count, 1 - share)
    found, values = [], []
    for one, off, sums, behind in zip(columns_of(lit), columns_of(lit_off), rays, left, strict=True):
        centre = RaySum(sums.values[:count], sums.error, sums.status, sums.faded)
        parts = one[:count], off[:count], share[:count]
        field = composed(problem.fan, parts, centre, by, float(behind), problem.wavenumber, problem.kind, problem.unit)
        found.append(field)
        if problem.vector:
            # what is left out at a point is left out around it
            dropped = np.all(field.creeping == 0, axis=1) | ~np.all(np.isfinite(centre.values), axis=1)
            values.append(one + np.where(np.tile(dropped, 5)[:, None], 0.0, sums.values))
    return found, values


def _lit_at(problem: Problem, points: FloatArray, normals: FloatArray) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """The lit side's part at points (n, ...), its error (n,) or (n, p), and its share (n,)."""
    body, d, k, order = problem.body, problem.direction, problem.wavenumber, problem.order
    at, part = lit_part(body, problem.fan.line, nodes_at(body, points, normals), k)
    if problem.vector:
        wave, other = (lit_vectors(part, d, problem.electric, k, o) for o in (2, 1))
        large, change = np.linalg.norm(wave, axis=1), np.linalg.norm(wave - other, axis=1)
    else:
        wave, other = lit_waves(part, d, size(body), k, problem.kind)[:: 1 if order == 2 else -1]
        large, change = np.abs(wave), np.abs(wave - other)
    values = np.zeros((len(points), *wave.shape[1:]), dtype=complex)
    error, share = np.zeros((len(points), *large.shape[1:])), np.zeros(len(points))
    share[at] = part.weights
    values[at] = wide(part.weights, wave) * wave
    pairs = zip(columns_of(large), columns_of(change), strict=True)
    off = [part.weights * lit_error(part, *pair, k, problem.kind, order, size(body)) for pair in pairs]
    error[at] = np.stack(off, axis=-1) if problem.vector else off[0]
    return values, error, share


def rays_on(
    problem: Problem, points: FloatArray, normals: FloatArray, count: int, share: FloatArray
) -> tuple[list[RaySum], Words]:
    """Sums over rays at points of the body (n, 3), of each polarisation, and the method of the first ``count``.

    Errors and statuses are of the first ``count``, around which the others stand; ``share`` (n,) is that of rays that
    have just left the line.
    """
    fan, k, kind, vector = problem.fan, problem.wavenumber, problem.kind, problem.vector
    plain = ELECTRIC_HARD if vector else kind
    marched = marches(fan, plain, problem.order, len(points) * (2 if vector else 1), k)
    if march_alone(fan.body, kind) and not marched:
        nothing = np.zeros(count)
        none = np.full(count, int(FieldStatus.NO_RAY))
        return [RaySum(np.zeros(len(points), dtype=complex), nothing, none, nothing)], np.full(count, "none")
    found = shed_on(fan_strips(fan), fan.body, points)
    young = fock_parameter(found.rays, k) < TAKEN_OVER
    if marched:
        table = fan_waves(fan, wavenumber=k, boundary=plain)
        if vector:
            soft = fan_waves(fan, wavenumber=k, boundary=SOFT)
            both = ConductorWaves(table, soft, problem.direction, problem.electric)
            of = both.on_rays(fan.body, found, points, normals)
            sums = marched_sums(fan, table, found, points, share, young, of, both.components)
            # feet of beams have tangents of their own
            sums = [replace(one, values=_along(normals, one.values)) for one in sums]
        else:
            sums = marched_sums(fan, table, found, points, share, young, scalar_on_rays(table, found))
        few = [RaySum(one.values, one.error[:count], one.status[:count], one.faded[:count]) for one in sums]
        return few, np.full(count, "march")
    weight = np.where(young, share[found.observer], 1.0)
    waves, other = _modes(problem, found.rays, points[found.observer], normals[found.observer])
    with np.errstate(invalid="ignore"):
        # a wave may be infinite
        waves, other = (np.where(wide(weight, one) > 0, one * wide(weight, one), 0.0) for one in (waves, other))
    middle = found.observer < count
    strength = _strength(found.rays[middle], weight[middle], k) if vector else None
    sums = []
    for wave, its in zip(columns_of(waves), columns_of(other), strict=True):
        pair = wave[middle], its[middle]
        own = own_error(found.rays[middle], pair, k, kind, problem.order, mixed=strength)
        one = ray_sum(fan, found[middle], count, pair[0], own, k, plain, strength)
        sums.append(replace(one, values=total_of(wave, found.observer, len(points))))
    return sums, np.full(count, "rays")


def _modes(
    problem: Problem, rays: RayPoints, points: FloatArray, normals: FloatArray
) -> tuple[ComplexArray, ComplexArray]:
    """Creeping modes of rays at points of the body (m, 3), by the order asked for and by the other one: (m, ...)."""
    k, orders = problem.wavenumber, (problem.order, 3 - problem.order)
    if not problem.vector:
        first, second = (surface_waves(rays, k, problem.kind, order) for order in orders)
        return first, second
    # rays pass through points of the body that differ from those of the strip by its error alone
    twist = nodes_at(problem.body, points, normals).twist(rays.directions)
    with np.errstate(invalid="ignore"):
        first, second = (
            ray_vectors(rays, normals, twist, problem.direction, problem.electric, k, order) for order in orders
        )
    return first, second


def _along(normals: FloatArray, vectors: ComplexArray) -> ComplexArray:
    """Vectors (n, 3) without their parts along normals (n, 3)."""
    return np.asarray(vectors - np.sum(normals * vectors, axis=1, keepdims=True) * normals)


def _strength(rays: RayPoints, weight: FloatArray, k: float) -> FloatArray:
    """|u| of rays (m,): what their currents of either polarisation are made of."""
    with np.errstate(invalid="ignore"):
        return np.where(weight > 0, np.abs(surface_waves(rays, k, ELECTRIC_HARD, 1)) * weight, 0.0)
