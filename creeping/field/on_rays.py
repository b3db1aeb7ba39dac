"""Each ray's own wave on the body, along the whole of a fan: by creeping modes, and by marching where these have none.

Modes end where a ray detaches, at joints, and where an admittance varies; the marched wave, of a plane wave alone,

    u = y |J|^(-1/2) e^{ik(d.x0 + s) - i pi N/2}

goes on (`creeping.field.marching.fan_waves`). On a caustic either is infinite.

Also here: the same from what the fan carries already; for pictures that follow a hand.

First order of `creeping.field.waves.surface`, with ξ = (k/2)^(1/3) A and A the fan's attenuation integral:

    u e^{-ik(d.x0 + s)} = (ρ1/ρ2)^(1/6) |J|^(-1/2) e^{-iπN/2} g(ξ)          hard, impedance
    du/dn/k: the same with F(ξ)/m2                                          soft

Sources: [F46], [LK59]; Derivations, F3, F9 and F22.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

import numpy as np

from creeping._typing import BoolArray, ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.arguments import checked, checked_plain, scales
from creeping.field.boundary import Boundary, BoundaryLike, fock_scale
from creeping.field.fock import surface_function
from creeping.field.marching.fan_waves import fan_waves, march_alone, marchable, spread_out
from creeping.field.results.point_result import FieldStatus, PointValues, SurfaceField, scalar_on_body
from creeping.field.routes import Problem
from creeping.field.waves.beams import beam_length
from creeping.field.waves.ray_sums import own_error, tube_share
from creeping.field.waves.surface import scalar_boundary, surface_waves
from creeping.geometry.incident import PointSource, plane_direction
from creeping.rays.fan import RayFan
from creeping.rays.quantities import RayPoints
from creeping.rays.strips import ray_points


def own_waves(problem: Problem) -> SurfaceField:
    """Each ray's own contribution at the times of a fan (rays, steps).

    Raises
    ------
    InvalidInputError
        If nothing but marching knows the wave, and these rays cannot be marched, or the order is 1.
    """
    fan, k, kind, order = problem.fan, problem.wavenumber, problem.kind, problem.order
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
        # where the ground need not be convex the same measure goes by the body's size
        a = beam_length(fan.body)
        share = np.abs(rays.spreading) / (np.abs(rays.spreading) + a * np.abs(rays.spreading_rate))
        wide[known] = (share * np.cbrt(0.5 * k * a))[known]
        beyond &= ~known
    status = np.select(
        [np.broadcast_to(~launched, shape), beyond, wide < 1],
        [FieldStatus.NO_RAY, FieldStatus.DETACHED, FieldStatus.CAUSTIC],
        FieldStatus.OK,
    )
    ok, unit = status == FieldStatus.OK, problem.unit
    error = np.where(ok, error, np.where(np.abs(values) > 0, np.abs(values), unit))
    flat = PointValues(
        *(np.zeros(values.size, dtype=complex), values.ravel(), error.ravel()),
        *(np.where(ok, "expansion", "bound").ravel(), status.astype(np.int64).ravel(), method.ravel()),
    )
    return scalar_on_body(flat, rays.points, unit, problem.facts())


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


def ray_envelope(fan: RayFan, *, wavenumber: float, boundary: BoundaryLike) -> ComplexArray:
    """u, or du/dn/k, of each ray at its steps without the factor e^{ik eikonal}, fast to vary.

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
    # e^{-iπN/2}
    turned = wave * np.array([1.0, -1j, -1.0, 1j])[fan.caustic_index[here] % 4]
    # inf times a complex number would be NaN
    out[here] = np.where(finite, turned * np.where(finite, strength, 0.0), np.inf)
    return out


def creeps(fan: RayFan) -> BoolArray:
    """Whether each ray is a creeping ray at its steps: launched by the wave and not detached before (rays, steps)."""
    launched = fan.launched
    return np.asarray(launched[:, None] & (fan.travel_time < fan.detachment[:, None]) & (fan.curvature > 0))
