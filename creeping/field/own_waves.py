"""Each ray's own wave on the body, along the whole of a fan: by creeping modes, and by marching where these have none.

Modes end where a ray detaches, at joints, and where an admittance varies; the marched wave, of a plane wave alone,

    u = y |J|^(-1/2) e^{ik(d.x0 + s) - i pi N/2}

goes on (`creeping.field.marching.fan_waves`). On a caustic either is infinite.

Source: Derivations, F9 and F22.
"""

import numpy as np

from creeping._typing import BoolArray, ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.beams import length_scale
from creeping.field.boundary import Boundary, BoundaryLike, boundary_name
from creeping.field.marching.fan_waves import fan_waves, march_alone, marchable, spread_out
from creeping.field.point_result import FieldStatus, SurfaceField, judged
from creeping.field.ray_scales import scales
from creeping.field.ray_sums import NARROW_ALONE, own_error, tube_share
from creeping.field.surface import surface_waves
from creeping.field.validity_range import validity
from creeping.geometry.incident import PointSource, plane_direction
from creeping.geometry.unit import unit_of
from creeping.rays.fan import RayFan
from creeping.rays.fan_points import ray_points
from creeping.rays.quantities import RayPoints


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
    a = length_scale(fan)
    share = np.abs(rays.spreading) / (np.abs(rays.spreading) + a * np.abs(rays.spreading_rate))
    return np.asarray(share * np.cbrt(0.5 * k * a))
