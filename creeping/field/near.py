"""The total field at points off the body or on it: by currents, by the creeping rays that come there, or between them.

    u(y) = e^{ikd.y} + int (u dG/dn_x - du/dn G) dS                          currents, everywhere
    u(y) = sum of the waves of the rays whose tangents pass through y         rays, in the shadow

Currents (`creeping.field.currents`) know no caustics and no shadow boundary, but they err by a share of the incident
wave, and must be a quarter of a wavelength away; nearer, the field is between theirs and that on the body
(`creeping.field.layer`), unless they solve the equation (`creeping.field.equation.currents`). Rays err by a share of
what they bring, which in the deep shadow is far less. So rays are used in the shadow where their status is OK
and their error is the smaller one (`creeping.field.routes`). On the body E = (n.E) n and H = J x n of a conductor.

Also here: e and H of the creeping rays whose tangents pass through points off a conductor.

    H = h u b - e (i kappa_t1/(kT)) u p,   E = -h u n        electric hard
    E = e v b,                             H = e v n         electric soft

p, n and b = n x p are those where the ray leaves, h = H0.b and e = E0.b those where it has landed, u and v the waves of
`creeping.field.waves.surface`, T = J + l J' the width of the ray's tube. A ray carries b onto b and n onto n; what h
varies by across rays gives H along them, (i/k) dh/db, as in the current on the body. E and H along rays that come from
what u and v vary by along n, of the order m/(k l) at the distance l, are left out; the error counts them.

Sources: [LK59], [PBM80]; [CK13, sec. 6.2]; Derivations, F8, F14, F17, F18, F20 and F26.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from creeping._typing import ArrayLike, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.field.arguments import checked_plain, scales
from creeping.field.boundary import ELECTRIC_HARD, ELECTRIC_SOFT, BoundaryLike
from creeping.field.currents.conductor import amplitudes
from creeping.field.currents.whole_body import OFF, SurfaceCurrents, far_enough
from creeping.field.layer import heights_of, layer_fields
from creeping.field.lit_ground import LEFT, UNKNOWN
from creeping.field.marching.fan_waves import march_alone
from creeping.field.on_body import field_on_body, rays_on
from creeping.field.results.conductor_result import ConductorField, vector_near
from creeping.field.results.point_result import (
    FieldStatus,
    NearField,
    PointValues,
    columns_of,
    measured_field,
    scalar_near,
)
from creeping.field.routes import (
    Problem,
    Route,
    Served,
    affords,
    answered,
    currents_behind,
    currents_near,
    left_behind,
    poor,
    solved_by_itself,
)
from creeping.field.waves.far_geometry import fan_strips
from creeping.field.waves.ray_sums import RaySum, own_error, ray_sum
from creeping.field.waves.surface import height_above, shed_waves
from creeping.geodesics.states import as_points
from creeping.geometry.surface import normal, size
from creeping.rays.fan import RayFan
from creeping.rays.shedding import ShedRays, free_ways, shed_near
from creeping.shadow.attachment import occluded

ON_BODY = 1e-7
"""Distance from the body, in its sizes, below which a point counts as on it."""


def near_field(
    fan: RayFan,
    points: ArrayLike,
    *,
    wavenumber: float,
    boundary: BoundaryLike = "soft",
    order: int = 2,
    method: str = "auto",
) -> NearField:
    """Total field u and its error at points outside the body or on it.

    Parameters
    ----------
    fan : RayFan
        Its rays must be long enough to pass the places where waves leave the body towards the points.
    points : (..., 3), L
        Outside the body or on it.
    wavenumber : float, 1/L
    boundary : "soft", "hard" or ImpedanceBoundary
    order : 2 or 1
        Order of the creeping waves. Order 1, the leading order, uses sums over rays only.
    method : {"auto", "currents", "rays", "equation"}
        "currents" radiates the currents of the whole body. "rays" sums over creeping rays; on the lit side this is
        not the total field (status LIT). "auto" uses rays at shadow points where their error is smaller, and currents
        elsewhere if they take less than about forty seconds and the order is 2. A body with joints always uses
        currents off its surface. "equation" uses currents from the integral equation (`surface_currents` with
        ``solve=True``). Closer to the body than a quarter of a wavelength the field is interpolated between the
        currents' field and the field on the body ("layer", see `creeping.field.layer`), or taken from rays where the
        surface below has no usable field, e.g. in a concave region.

    Returns
    -------
    NearField
        In units of the incident wave; usable as the array of its values. ``method`` names the method at each point.

    Raises
    ------
    InvalidInputError
        On points inside the body or not finite, a bad wavenumber, boundary, order or method, for a weighted body or one
        with edges, or if method="equation" and the body is rough or needs too many nodes.
    SurfaceError
        If currents are requested and the wavenumber is too high for any mesh of the body.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> line = cr.shadow_line(ball, direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, length=4.0, n_rays=24)
    >>> u = cr.near_field(fan, [(0.3, 0.0, 1.5), (0.0, 2.0, -0.5)], wavenumber=30.0, boundary="soft")
    >>> u.shape, round(float(abs(u[0])), 2), u.method.tolist()
    ((2,), 0.04, ['rays', 'currents'])
    """
    problem = Problem.scalar(fan, wavenumber, boundary, order, method)
    checked_plain(fan.body, edgeless="the near field by rays" if method == "rays" or order == 1 else "")
    y = as_points(points)
    flat = y.reshape(-1, 3)
    (field,) = _fields(problem, flat)
    return scalar_near(field, y, problem.incident_at(flat), problem.facts())


def conductor_field(
    fan: RayFan,
    points: ArrayLike,
    *,
    wavenumber: float,
    polarisation: str | ArrayLike | None = None,
    method: str = "auto",
) -> ConductorField:
    """Total E and H, and their error, at points outside a perfect conductor or on it.

    Parameters
    ----------
    fan : RayFan
        Its rays must be long enough to pass the places where waves leave the body towards the points.
    points : (..., 3), L
        Outside the body or on it.
    wavenumber : float, 1/L
    polarisation : "theta", "phi" or (3,) complex, optional
        E0 of the incident wave, transverse and of any length; by default both theta and phi.
    method : {"auto", "equation"}
        "auto" uses rays and currents by expansions where they apply. "equation" uses the solution of the integral
        equation everywhere (`surface_currents` with ``solve=True``), as "auto" does for a piecewise smooth body.

    Returns
    -------
    ConductorField
        E, and H times the impedance of free space, in units of the incident E.

    Raises
    ------
    InvalidInputError
        On points inside the body or not finite, a bad wavenumber, polarisation or method, for a weighted body, or if
        the equation is needed (method="equation", or a body with edges or joints) and cannot be solved.
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
    >>> field = cr.conductor_field(fan, [(0, 0, -1), (0, 2.0, -0.5)], wavenumber=12.0, polarisation=(1, 0, 0))
    >>> field.method.tolist(), np.abs(field.H[0]).round(1).tolist(), np.abs(field.E[0]).round(1).tolist()
    (['lit', 'currents'], [0.0, 2.0, 0.0], [0.0, 0.0, 0.0])
    """
    problem = Problem.conductor(fan, wavenumber, polarisation, method)
    y, single = as_points(points), polarisation is not None
    flat = y.reshape(-1, 3)
    columns = _fields(problem, flat)
    facts = problem.facts() | {"incident_electric": problem.electric[:, 0] if single else problem.electric}
    return vector_near(columns, y, problem.incident_at(flat), facts, single=single)


def _fields(problem: Problem, points: FloatArray) -> list[PointValues]:
    """The field at points (n, 3), L, off the body or on it, of each polarisation."""
    asked = _Points(problem, points)
    nothing = np.zeros((len(points), 6) if problem.vector else len(points), dtype=complex)
    none = PointValues(
        *(nothing, nothing, np.where(asked.dark, 1.0, UNKNOWN), np.full(len(points), "bound")),
        *(np.where(asked.dark, FieldStatus.NO_RAY, FieldStatus.LIT).astype(np.int64), np.full(len(points), "none")),
    )
    must = problem.needs_currents or problem.kind.varies
    routes = [Route(lambda _: asked.on, asked.on_body, must=True), Route(asked.for_rays, asked.by_rays, must=True)]
    if problem.method != "rays" and problem.order == 2:
        routes.append(Route(asked.for_currents, asked.by_currents, must=must))
        routes.append(Route(asked.left_over, asked.by_rays, must=True))
    return answered([none] * problem.columns, routes)


@dataclass(frozen=True, eq=False)
class _Points:
    """Points of a problem (n, 3), L, and the routes to the field there."""

    problem: Problem
    points: FloatArray

    @cached_property
    def on(self) -> BoolArray:
        """Whether points are on the body (n,)."""
        return checked_height(self.problem.fan, self.points) <= ON_BODY

    @cached_property
    def dark(self) -> BoolArray:
        """Whether points off the body are in its shadow (n,)."""
        dark, off = np.zeros(len(self.points), dtype=bool), ~self.on
        dark[off] = occluded(self.problem.body, self.points[off], self.problem.direction)
        return dark

    @cached_property
    def solved(self) -> SurfaceCurrents | None:
        """Currents that stand for the field everywhere."""
        return None if self.problem.method == "rays" else solved_by_itself(self.problem)

    def on_body(self, at: IntArray) -> Served:
        """Points on the body."""
        problem, x = self.problem, self.points[at]
        if problem.kind.kind == "soft":
            nothing = np.zeros(len(at))
            return [(at, [measured_field(nothing.astype(complex), nothing, "boundary", "expansion")])]
        n = normal(problem.body, x)
        if problem.method == "rays":
            lit = n @ problem.direction < 0
            lit[lit] = ~occluded(problem.body, x[lit], problem.direction)
            (rays,), by = rays_on(problem, x, n, len(x), np.ones(len(x)))
            return [(at, [replace(rays_alone(rays, lit), method=by)])]
        found = field_on_body(problem, x, currents_behind(problem))
        if not problem.vector:
            return [(at, found.columns)]
        charges = zip(found.columns, found.charge.T, found.charge_error.T, strict=True)
        return [(at, [_beside(J, charge, error, n) for J, charge, error in charges])]

    def for_rays(self, _: list[PointValues]) -> BoolArray:
        """Points in the shadow, and lit ones if currents cost too much: these know better of them."""
        problem, off = self.problem, ~self.on
        if march_alone(problem.body, problem.kind) or problem.needs_currents:
            return np.zeros_like(off)
        currents = problem.method != "rays" and problem.order == 2 and affords(problem, int(np.sum(off)))
        return off & (self.dark | (not currents))

    def left_over(self, columns: list[PointValues]) -> BoolArray:
        """Points without a field yet."""
        none = np.full(len(self.points), not march_alone(self.problem.body, self.problem.kind))
        return np.asarray(none & ~self.on & (columns[0].method == "none"))

    def by_rays(self, at: IntArray) -> Served:
        """Creeping rays."""
        problem, lit = self.problem, ~self.dark[at]
        columns = [rays_alone(one, lit) for one in shed_sums(problem, self.points[at])]
        if problem.vector:
            left = left_behind(problem, currents_behind(problem))
            columns = [_from_elsewhere(one, float(its)) for one, its in zip(columns, left, strict=True)]
        return [(at, columns)]

    def for_currents(self, columns: list[PointValues]) -> BoolArray:
        """Points (n,) with a poor field by rays; all if the equation is solved."""
        return ~self.on & (poor(columns) | (self.solved is not None))

    def by_currents(self, at: IntArray) -> Served:
        """Currents of the whole body; next to it, unless solved, the layer between them and the field on it."""
        problem, x, found = self.problem, self.points[at], []
        currents = self.solved or currents_near(problem, len(at))
        if currents is None:
            return []
        far = np.ones(len(x), dtype=bool)
        if not currents.solved:
            far = far_enough(problem.body, problem.wavenumber, x, heights_of(problem)[0] if problem.vector else OFF)
        if np.any(far):
            pair = currents.total(x[far], self.dark[at[far]])
            by = "equation" if currents.solved else "currents"
            each = zip(*(columns_of(part) for part in pair), strict=True)
            found.append((at[far], [measured_field(values, error, by) for values, error in each]))
        if not np.all(far):
            rows, layer = layer_fields(problem, currents, x[~far])
            found.append((at[~far][rows], layer))
        return found


def _beside(J: PointValues, charge: ComplexArray, charge_error: FloatArray, n: FloatArray) -> PointValues:
    """E and H (n, 6) of a polarisation on the body, with normals n (n, 3)."""
    share = np.linalg.norm(J.wave, axis=1), np.linalg.norm(J.creeping, axis=1)
    with np.errstate(invalid="ignore"):
        # the charge belongs to both parts as the current does
        part = np.where(share[0] + share[1] > 0, share[0] / (share[0] + share[1]), 1.0)
        wave, creeping = (
            np.concatenate([(its * charge)[:, None] * n, np.cross(one, n)], axis=1)
            for its, one in ((part, J.wave), (1 - part, J.creeping))
        )
    # E there is the charge's
    return replace(J, wave=wave, creeping=creeping, error=np.maximum(J.error, charge_error))


def _from_elsewhere(rays: PointValues, left: float) -> PointValues:
    """Rays with the error by waves that come from elsewhere on the body, of which ``left`` inside of it tells."""
    known = np.isfinite(left)
    return replace(
        rays,
        error=np.hypot(rays.error, LEFT * left if known else UNKNOWN),
        error_by=rays.error_by if known else np.full(len(rays.error), "bound"),
    )


def checked_height(fan: RayFan, points: FloatArray) -> FloatArray:
    """F/|grad F| in body sizes (n,), about the height above the body near it."""
    gradient = np.linalg.norm(fan.body.gradient(points), axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        # at the centre grad F may vanish: deep inside
        height = np.nan_to_num(fan.body.level(points) / gradient, nan=-1.0) / size(fan.body)
    inside = np.flatnonzero(height < -ON_BODY)
    if len(inside):
        raise InvalidInputError(
            f"{len(inside)} of {len(points)} points are inside the body (worst: row "
            f"{inside[np.argmin(height[inside])]}, depth about {-height.min() * size(fan.body):.3g}); give points on "
            "it or outside"
        )
    return np.asarray(height)


def rays_alone(rays: RaySum, lit: BoolArray) -> PointValues:
    """A sum over rays as the field, with a bound of what it lacks on the lit side and where it is not to be trusted."""
    status = np.where(lit, FieldStatus.LIT, rays.status).astype(np.int64)
    bad = status != FieldStatus.OK
    # a sum that is not to be trusted has the whole of its waves for a bound already
    missing = np.where(lit, UNKNOWN, np.where(rays.error > 0, 0.0, 1.0))
    return PointValues(
        wave=np.zeros_like(rays.values),
        creeping=rays.values,
        error=rays.error + np.where(bad, missing, 0.0),
        error_by=np.where(bad, "bound", "expansion"),
        status=status,
        method=np.full(len(status), "rays"),
    )


def shed_sums(problem: Problem, points: FloatArray) -> list[RaySum]:
    """Sums over rays at points off the body (n, 3), L: of u, or of E and H (n, 6) for each polarisation."""
    fan, k, kind, order = problem.fan, problem.wavenumber, problem.kind, problem.order
    shed = shed_near(fan_strips(fan), fan.body, points)
    shed = shed[free_ways(fan.body, shed.rays, shed.reach)]
    height = height_above(shed.rays, shed.reach, k)
    if not problem.vector:
        pair = tuple(shed_waves(shed.rays, shed.reach, k, kind, o) for o in (order, 3 - order))
        error = own_error(shed.rays, (pair[0], pair[1]), k, kind, order, height=height)
        return [ray_sum(fan, shed, len(points), pair[0], error, k, kind)]
    both = [_vectors(fan, shed, k, problem.electric, o) for o in (2, 1)]
    coupled = np.linalg.norm(np.sum(both[0][:, 3:] * shed.rays.directions[:, :, None], axis=1, keepdims=True), axis=1)
    m = scales(shed.rays, k)[1]
    strength = np.max([np.linalg.norm(wave[:, :3], axis=1).max(axis=1, initial=0.0) for wave in both], axis=0)
    found = []
    for waves, other, along_ray in zip(*(columns_of(one) for one in both), coupled.T, strict=True):
        own = own_error(shed.rays, (waves, other), k, kind, 2, height=height)
        # what E and H have along the ray beside the term in kappa_t1, and half of that
        along = np.minimum(1.5 * m / (k * np.maximum(shed.reach, 1e-300)), 1.0)
        own = np.linalg.norm([own, along * np.linalg.norm(waves, axis=1), 0.5 * along_ray], axis=0)
        found.append(ray_sum(fan, shed, len(points), waves, own, k, ELECTRIC_HARD, strength))
    return found


def _vectors(fan: RayFan, shed: ShedRays, k: float, electric: ComplexArray, order: int) -> ComplexArray:
    """E and H (m, 6, p) of each ray."""
    rays = shed.rays
    p, n = rays.directions, normal(fan.body, rays.points)
    b = np.cross(n, p)
    axes = np.broadcast_to(fan.line.direction, rays.first_normal.shape)
    h, e = amplitudes(rays.first_normal, axes, fan.line.direction, electric)
    with np.errstate(invalid="ignore"):
        u, v = (shed_waves(rays, shed.reach, k, kind, order) for kind in (ELECTRIC_HARD, ELECTRIC_SOFT))
        hu, ev = h * u[:, None], e * v[:, None]
        E = -n[:, :, None] * hu[:, None] + b[:, :, None] * ev[:, None]
        H = b[:, :, None] * hu[:, None] + n[:, :, None] * ev[:, None]
        # 1/T is held where rays merge, as 1/J is on the body
        tube, m = rays.spreading + shed.reach * rays.spreading_rate, scales(rays, k)[1]
        aside = -1j / k * rays.transverse[0] * u * tube / (tube**2 + 1 / m**4)
        H = H + p[:, :, None] * (e * aside[:, None])[:, None]
    return np.concatenate([E, H], axis=1)
