"""The field on the body: u, or du/dn where u = 0, of creeping rays in the shadow, of the wave itself on the lit side.

    u = (1 - W) e^{ikd.x} u_lit + sum_rays w_i u_i,   W = W(xi; 0, 0.6),   w_i = W for rays that have just left the line

with u_lit the lit side's expansion (`creeping.field.currents.lit`), which holds to a little beyond the line, and 1 for
w_i of rays that come from afar. `creeping.field.lit_ground` says how far it is off. On a body that may reflect onto
itself, hides part of its line, or has edges, joints or tips, or if it is asked for, the solution of the integral
equation stands for both, where it is affordable (`creeping.field.equation`).

Also here: each ray's own wave on the body, along the whole of a fan: by creeping modes, and by marching where these
have none.

Modes end where a ray detaches, at joints, and where an admittance varies; the marched wave, of a plane wave alone,

    u = y |J|^(-1/2) e^{ik(d.x0 + s) - i pi N/2}

goes on (`creeping.field.marching.fan_waves`). On a caustic either is infinite.

Also here: each ray's own field from what the fan carries already; for pictures that follow a hand.

First order of `creeping.field.waves.surface`, with ξ = (k/2)^(1/3) A and A the fan's attenuation integral:

    u e^{-ik(d.x0 + s)} = (ρ1/ρ2)^(1/6) |J|^(-1/2) e^{-iπN/2} g(ξ)          hard, impedance
    du/dn/k: the same with F(ξ)/m2                                          soft

Sources: [F46], [LK59]; Derivations, F9, F16, F20, F22 and F3.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from dataclasses import replace

import numpy as np

from creeping._typing import ArrayLike, BoolArray, ComplexArray, FloatArray
from creeping.errors import InvalidInputError, SurfaceError
from creeping.field.arguments import PLAIN, checked, checked_method, checked_plain, fock_parameter, scales
from creeping.field.body_currents import affordable, cached_currents, solved_currents
from creeping.field.boundary import Boundary, BoundaryLike, ImpedanceBoundary, boundary_name
from creeping.field.creeping_modes import fock_scale
from creeping.field.currents.nodes import TAKEN_OVER, lit_part, lit_waves
from creeping.field.currents.whole_body import POINTS as INNER
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.field.equation.currents import TileCurrents
from creeping.field.lit_ground import composed, convex, lit_error, without_tips
from creeping.field.marching.fan_waves import fan_waves, march_alone, marchable, marched_sum, marches, spread_out
from creeping.field.results.point_result import FieldStatus, PointValues, SurfaceField, Words, judged, measured_field
from creeping.field.special.fock import surface_function
from creeping.field.validity_range import validity
from creeping.field.waves.far_geometry import fan_strips
from creeping.field.waves.gaussian_beams import beam_length
from creeping.field.waves.ray_sums import NARROW_ALONE, RaySum, own_error, ray_sum, tube_share
from creeping.field.waves.surface import scalar_boundary, surface_waves
from creeping.geodesics.bundle import as_points, on_body
from creeping.geometry.arguments import one_of
from creeping.geometry.checks import unit_of
from creeping.geometry.incident import PointSource, plane_direction
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.quadrature import nodes_at
from creeping.geometry.surface import normal, size
from creeping.rays.fan import RayFan
from creeping.rays.quantities import RayPoints
from creeping.rays.shedding import shed_on
from creeping.rays.strips import ray_points

SCALAR: dict[str, BoundaryLike] = {"soft": "soft", "hard": "hard"}

QUARTERS = np.array([1.0, -1j, -1.0, 1j])
"""e^{-iπN/2}."""


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
        Usable as the array of its values. Without points, of shape (rays, steps): the contribution of each ray alone.
        Creeping modes give it up to detachment and marching beyond; the fan of a point source, whose incident wave is
        e^{ikR}/(4 pi R), has modes only. It is infinite at caustics of the ray (status CAUSTIC), and 0 after the ray
        has ended (DETACHED) or if the wave did not launch the ray (NO_RAY). With points (...): the total field. In
        the shadow it is the sum over all rays through a point, or 0 if no ray passes (NO_RAY or TRUNCATED). Waves are
        marched, with beams where rays merge, and so continue across caustics and beyond detachment; creeping modes
        are used where marching is impossible or takes more than a minute, and for order 1 (``method``).

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
    one_of(fan, "fan", RayFan, "creeping.launch")
    checked_plain(fan.body)
    kind = scalar_boundary(boundary)
    k = checked(wavenumber, order, fan.body)
    checked_method(method, order, PLAIN)
    if points is None:
        if method == "equation":
            raise InvalidInputError("method 'equation' is of the field at points, not of each ray's own; give points")
        return own_waves(fan, k, boundary, kind, order)
    y = as_points(points)
    shape = y.shape[:-1]
    on = on_body(fan.body, y).reshape(-1, 3)
    solved = cached_currents(fan, k, boundary, solve=True) if method == "equation" else None
    total = total_on(fan, on, k, kind, order, solved)
    status = judged(total.status, total.values, total.error, total.error_by, k if kind.kind == "soft" else 1.0)
    return SurfaceField(
        points=y.copy(),
        values=total.values.reshape(shape),
        error=total.error.reshape(shape),
        error_by=total.error_by.reshape(shape),
        status=status.reshape(shape),
        method=total.method.reshape(shape),
        lit=total.wave.reshape(shape),
        creeping=total.creeping.reshape(shape),
        wavenumber=k,
        boundary=boundary_name(boundary),
        order=order,
        validity=validity(fan, wavenumber=k),
        length_unit=unit_of(fan.body),
    )


def rays_on(
    fan: RayFan, points: FloatArray, k: float, kind: Boundary, order: int, share: FloatArray | None = None
) -> tuple[RaySum, Words]:
    """Creeping waves at points of the body (n, 3), and the method: the march where it is possible, else modes.

    ``share`` (n,) is that of rays that have just left the line.
    """
    marched = marches(fan, kind, order, len(points), k)
    if march_alone(fan.body, kind) and not marched:
        nothing = np.zeros(len(points))
        none = RaySum(nothing.astype(complex), nothing, np.full(len(points), int(FieldStatus.NO_RAY)), nothing)
        return none, np.full(len(points), "none")
    found = shed_on(fan_strips(fan), fan.body, points)
    young = np.zeros(len(found.observer), dtype=bool)
    if share is not None:
        young = fock_parameter(found.rays, k) < TAKEN_OVER
    if marched:
        return marched_sum(fan, found, points, share, young, k, kind), np.full(len(points), "march")
    waves, other = (surface_waves(found.rays, k, kind, o) for o in (order, 3 - order))
    if share is not None:
        weight = np.where(young, share[found.observer], 1.0)
        # a wave may be infinite
        waves, other = (np.where(weight > 0, wave * np.where(weight > 0, weight, 1.0), 0.0) for wave in (waves, other))
    error = own_error(found.rays, (waves, other), k, kind, order)
    return ray_sum(fan, found, len(points), waves, error, k, kind), np.full(len(points), "rays")


def total_on(
    fan: RayFan,
    points: FloatArray,
    k: float,
    kind: Boundary,
    order: int,
    currents: SurfaceCurrents | None = None,
) -> PointValues:
    """Total field at points of the body (n, 3).

    ``currents`` are those of the wavenumber and boundary, if they are at hand.
    """
    jointed, unit = is_piecewise(fan.body), k if kind.kind == "soft" else 1.0
    # an admittance that steps is smeared by expansions, of which their currents tell
    alone = not jointed and convex(fan) and not kind.varies
    if not currents:
        currents = solved_currents(fan, k, _boundary_of(kind)) if alone else _currents_of(fan, k, kind)
    if isinstance(currents, TileCurrents) and order == 2:
        return _solved_on(currents, points)
    checked_plain(fan.body, edgeless="the field at points of the body")
    currents = None if alone else currents
    lit = _lit_at(fan, points, k, kind, order)
    rays, by = rays_on(fan, points, k, kind, order, 1 - lit[2])
    left = currents.extinction if currents else 0.0 if alone else np.nan
    if currents and order == 2 and kind.kind in ("soft", "hard") and not jointed:
        thrown = currents.reflected_onto(points, normal(fan.body, points))
        # as much may come later, to and fro, and to the dark side, whose rays do not know of it
        lit = lit[0] + lit[2] * thrown, np.hypot(lit[1], np.abs(thrown)), lit[2]
    field = composed(fan, lit, rays, by, left, k, kind, unit)
    return without_tips(field) if jointed else field


def _solved_on(currents: TileCurrents, points: FloatArray) -> PointValues:
    """Total field of solved currents at points of the body (n, 3)."""
    found = currents.on_body(points)
    field = measured_field(found.values, found.error, "equation", "extinction")
    return replace(field, wave=np.where(found.lit, found.values, 0.0), creeping=np.where(found.lit, 0.0, found.values))


def _currents_of(fan: RayFan, k: float, kind: Boundary) -> SurfaceCurrents | None:
    """Currents of the whole body; None if they cost too much or there is no mesh for them."""
    try:
        # as many points as they are judged at
        return cached_currents(fan, k, _boundary_of(kind)) if affordable(fan, INNER, k) else None
    except (InvalidInputError, SurfaceError):
        return None


def _boundary_of(kind: Boundary) -> BoundaryLike:
    impedance = kind.kind == "impedance"
    return ImpedanceBoundary(kind.coating or kind.admittance) if impedance else SCALAR[kind.kind]


def _lit_at(
    fan: RayFan, points: FloatArray, k: float, kind: Boundary, order: int
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """The lit side's part of the field at points of the body (n, 3), its error, and its share: (n,) each."""
    body, d = fan.body, fan.line.direction
    at, part = lit_part(body, fan.line, nodes_at(body, points, normal(body, points)), k)
    u, other = lit_waves(part, d, size(body), k, kind)[:: 1 if order == 2 else -1]
    values, error, share = np.zeros(len(points), dtype=complex), np.zeros(len(points)), np.zeros(len(points))
    share[at] = part.weights
    values[at] = part.weights * u
    error[at] = part.weights * lit_error(part, np.abs(u), np.abs(u - other), k, kind, order, size(body))
    return values, error, share


def own_waves(fan: RayFan, k: float, boundary: BoundaryLike, kind: Boundary, order: int) -> SurfaceField:
    """Each ray's own contribution at the times of a fan (rays, steps).

    Raises
    ------
    InvalidInputError
        If nothing but marching knows the wave, and these rays cannot be marched, or the order is 1.
    """
    rays, launched = ray_points(fan, fan.travel_time)[1], fan.launched[:, None]
    shape = rays.time.shape
    alone, sphere = march_alone(fan.body, kind), isinstance(fan.line.source, PointSource)
    if alone:
        plane_direction(fan.line.source, "a wave that is marched")
    marches = not sphere and marchable(fan, kind, order, fewest=2)
    if alone and not marches:
        raise InvalidInputError(
            "beyond joints, and where an admittance varies, rays are marched, to second order: give order=2, and a fan "
            f"with more rays on each arc of the shadow line than this one, which has {len(fan.status)} in all"
        )
    by_modes = rays.alive & ~np.full(shape, alone)
    values, error, wide = _by_modes(rays, by_modes, k, kind, order)
    method = np.full(shape, "rays", dtype="<U5")
    beyond = launched & ~by_modes
    if np.any(beyond) and marches:
        marched, off = _by_marching(fan, rays, k, kind)
        known = beyond & np.isfinite(off) & (off < np.abs(marched))
        values[known], error[known], method[known] = marched[known], off[known], "march"
        wide[known] = _wide(fan, rays, k)[known]
        beyond &= ~known
    status = np.select(
        [np.broadcast_to(~launched, shape), beyond, wide < NARROW_ALONE],
        [FieldStatus.NO_RAY, FieldStatus.DETACHED, FieldStatus.CAUSTIC],
        FieldStatus.OK,
    )
    ok = status == FieldStatus.OK
    unit = k if kind.kind == "soft" else 1.0
    error = np.where(ok, error, np.where(np.abs(values) > 0, np.abs(values), unit))
    error_by = np.where(ok, "expansion", "bound")
    return SurfaceField(
        points=rays.points.copy(),
        values=values,
        error=error,
        error_by=error_by,
        status=judged(status, values, error, error_by, unit),
        method=method,
        lit=np.zeros(shape, dtype=complex),
        creeping=values,
        wavenumber=k,
        boundary=boundary_name(boundary),
        order=order,
        validity=validity(fan, wavenumber=k),
        length_unit=unit_of(fan.body),
    )


def _by_modes(
    rays: RayPoints, there: BoolArray, k: float, kind: Boundary, order: int
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Waves, their errors, and how clear of caustics they are, m |T|/(|J| + rho |J'|): (rays, steps) each."""
    values, error, wide = np.zeros(there.shape, dtype=complex), np.zeros(there.shape), np.full(there.shape, np.inf)
    if not np.any(there):
        return values, error, wide
    some = rays[there]
    waves, other = (surface_waves(some, k, kind, o) for o in (order, 3 - order))
    values[there], error[there] = waves, own_error(some, (waves, other), k, kind, order)
    with np.errstate(invalid="ignore"):
        wide[there] = tube_share(some, np.zeros(waves.shape)) * scales(some, k)[1]
    return values, error, wide


def _by_marching(fan: RayFan, rays: RayPoints, k: float, kind: Boundary) -> tuple[ComplexArray, FloatArray]:
    """Waves and their errors (rays, steps), infinite where there is no wave."""
    shape = rays.time.shape
    ray = np.repeat(np.arange(shape[0]), shape[1])
    y, off = fan_waves(fan, wavenumber=k, boundary=kind).along(ray, rays.time.ravel())
    with np.errstate(divide="ignore", invalid="ignore"):
        error = off.reshape(shape) / np.sqrt(np.abs(rays.spreading))
    return spread_out(y.reshape(shape), rays, k), error


def _wide(fan: RayFan, rays: RayPoints, k: float) -> FloatArray:
    """The same measure (rays, steps) where the ground need not be convex, in terms of the body's size."""
    a = beam_length(fan.body)
    share = np.abs(rays.spreading) / (np.abs(rays.spreading) + a * np.abs(rays.spreading_rate))
    return np.asarray(share * np.cbrt(0.5 * k * a))


def ray_magnitude(fan: RayFan, *, wavenumber: float, boundary: BoundaryLike = "soft") -> FloatArray:
    """|u|, or |du/dn|/k of the soft boundary, of each ray at its steps: (rays, steps).

    Parameters
    ----------
    fan : RayFan
    wavenumber : float, 1/L
    boundary : "soft", "hard" or ImpedanceBoundary

    Returns
    -------
    (rays, steps)
        Infinite at caustics, 0 where the creeping ray has ended.

    Raises
    ------
    InvalidInputError
        On a bad wavenumber or boundary, and for a weighted body.
    """
    return np.abs(ray_envelope(fan, wavenumber=wavenumber, boundary=boundary))


def ray_envelope(fan: RayFan, *, wavenumber: float, boundary: BoundaryLike = "soft") -> ComplexArray:
    """u, or du/dn/k, of each ray at its steps without the factor e^{ik eikonal}, fast to vary: (rays, steps).

    Arguments, errors and what is infinite or 0 as of `ray_magnitude`.
    """
    kind = scalar_boundary(boundary)
    k = checked(wavenumber, 1)
    checked_plain(fan.body)
    plane_direction(fan.line.source, "this magnitude")
    out = np.zeros(fan.spreading.shape, dtype=complex)
    here = creeps(fan)
    first = np.broadcast_to(fan.curvature[:, :1], here.shape)[here]
    last = fan.curvature[here]
    m = fock_scale(k, np.sqrt(first * last))
    wave = surface_function(np.cbrt(k / 2) * fan.attenuation[here], kind.q(m))
    with np.errstate(divide="ignore"):
        strength = np.cbrt(np.sqrt(last / first)) / np.sqrt(np.abs(fan.spreading[here]))
    if kind.kind == "soft":
        strength = strength / fock_scale(k, last)
    finite = np.isfinite(strength)
    turned = wave * QUARTERS[fan.caustic_index[here] % 4]
    # inf times a complex number would be NaN
    out[here] = np.where(finite, turned * np.where(finite, strength, 0.0), np.inf)
    return out


def creeps(fan: RayFan) -> BoolArray:
    """Whether each ray is a creeping ray at its steps: launched by the wave and not detached before (rays, steps)."""
    launched = fan.launched
    return np.asarray(launched[:, None] & (fan.travel_time < fan.detachment[:, None]) & (fan.curvature > 0))
