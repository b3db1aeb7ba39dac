"""The far field of a plane wave, u_s ~ f(r) e^{ikR}/R: by the currents of the whole body, or ray by ray.

Currents (`creeping.field.currents`) have no caustics, blends or hand-overs, and measure their own error; their cost
grows like k^2 with every direction. Rays (`creeping.field.waves.far_rays`) cost the same at any k and tell what each of
them gives; where the reflected field has a caustic they err. Their error is an estimate, whose level is measured
against currents at a lower wavenumber (`creeping.field.far`) where the method was left to the program.

Also here: the error of a far field by rays where currents cost too much: measured at a lower wavenumber, carried up.

At the highest wavenumber k0 whose currents cost little, rays are compared with currents, which measure their own error
epsilon, in directions spread over the sphere. With e the error that rays state (`creeping.field.waves.far_rays`),

    level = the 95th percentile of |f_rays - f_currents|/e at k0
    error = [(level e)^2 + (epsilon (k0/k)^p f_rms)^2]^(1/2),   p = 1, and 0 where part of the line launches no ray

e falls as fast as the order that it is of; of a conductor, whose second order is a rule away from the sphere, a level
above 1 tells of a term of first order, and grows like k. The second term is what rays and currents both lack.

Also here: how uncertain a far field is because its body is known only approximately.

Sources: [LK59], [CK13]; Derivations, F10 to F17.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from creeping._typing import ArrayLike, FloatArray
from creeping.errors import SurfaceError
from creeping.field.arguments import checked, checked_method, checked_plain, observers_of
from creeping.field.body_currents import surface_currents
from creeping.field.boundary import BoundaryLike, scalar_boundaries
from creeping.field.currents.whole_body import far_by_currents
from creeping.field.results.far_result import FarField
from creeping.field.routes import TRUST, Problem, expected_nodes, far_currents
from creeping.field.validity_range import validity
from creeping.field.waves.far_geometry import far_geometry
from creeping.field.waves.far_rays import field_of
from creeping.field.waves.piecewise_far import piecewise_far_field, tip_waves
from creeping.geometry.arguments import one_of
from creeping.geometry.checks import unit_of
from creeping.geometry.directions import fibonacci_directions
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.surface import memo, size
from creeping.rays.fan import RayFan
from creeping.rays.uncertain_body import coarse_factor, coarse_fan
from creeping.storage.memory import blocks, within_budget
from creeping.storage.parts import Keeping, not_kept

LEAST_BYTES, KEPT_BYTES, RAY_BYTES, FAN_BYTES = 250.0, 1000.0, 33_000.0, 500.0
"""Of a direction: its field by any way, of a conductor thrice that; by rays, twice while parts are joined; what rays
take, twice as the geometry of the directions before is kept; and for each k size, the fan integral."""

TOGETHER = 1024
"""Directions by rays that are kept at a time: some seconds of work."""


def far_field(
    fan: RayFan,
    observation: ArrayLike,
    *,
    wavenumber: float,
    boundary: BoundaryLike = "soft",
    order: int = 2,
    method: str = "auto",
) -> FarField:
    """Far field scattered by the body of a fan, and its error.

    Parameters
    ----------
    fan : RayFan
        Its rays must be long enough to pass the places where waves leave towards the observers. Paths longer than the
        rays are left out.
    observation : (..., 3)
        Directions r from the body to the observers; need not be unit. Flattened to (m, 3).
    wavenumber : float, 1/L
    boundary : "soft", "hard", "pec" or ImpedanceBoundary
    order : 2 or 1
        Order of the creeping waves. Order 1, the leading order, uses sums over rays only.
    method : {"auto", "currents", "rays", "equation"}
        "currents" radiates the currents of the whole body (of a body with edges, those of its integral equation),
        "rays" sums over isolated rays. "auto" uses currents if they take less than about ten seconds and the order is
        2, else rays. Where expansions of the currents are known to fail, it solves the integral equation
        (`creeping.surface_currents`). "equation" solves it wherever possible, which takes minutes at high wavenumbers.
        For a body with edges the equation is that of `creeping.solve`;
        "auto" allows it half a minute, and uses coarse tiles, with a larger error, if fine ones take longer. If the
        equation is not solved for a body with edges, or a conductor with joints or tips, the field is the sum of
        isolated rays and physical optics (`creeping.field.waves.piecewise_far`); ``method`` is then "rays+optics".

    Returns
    -------
    FarField
        The fan caches geometry and currents: repeated calls with the same directions or wavenumber are faster.

    Raises
    ------
    InvalidInputError
        On bad directions, wavenumber, boundary, order or method, for a weighted body, or if
        method="equation" and the body has edges, is rough or needs too many nodes.
    SurfaceError
        If currents are requested and the wavenumber is so high that no mesh of the body resolves the wave.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> line = cr.shadow_line(ball, direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, length=3.0, n_rays=16)
    >>> ff = cr.far_field(fan, [(0, 1, 0)], wavenumber=30.0, boundary="soft")
    >>> round(float(abs(ff.total[0])), 3), bool(ff.error[0] < 2e-3), ff.method.tolist()     # about radius/2
    (0.504, True, ['currents'])
    """
    return far_in_parts(fan, observation, wavenumber=wavenumber, boundary=boundary, order=order, method=method)


def far_in_parts(
    fan: RayFan,
    observation: ArrayLike,
    *,
    wavenumber: float,
    boundary: BoundaryLike,
    order: int,
    method: str = "auto",
    keep: Keeping = not_kept,
) -> FarField:
    """As `far_field`; ``keep`` stores the finished parts: ``rays-`` of some directions after the other, or sums."""
    one_of(fan, "fan", RayFan, "creeping.launch")
    checked_plain(fan.body)
    scalar_boundaries(boundary)
    k = checked(wavenumber, order, fan.body)
    checked_method(method, order)
    r = observers_of(observation)
    least = LEAST_BYTES * (3 if boundary == "pec" else 1)
    within_budget(least * len(r), f"the field in {len(r)} directions", "ask for fewer", asked=len(r))
    piecewise = is_piecewise(fan.body)
    currents = far_currents(Problem(fan, k, boundary, order, method), len(r))
    if currents:
        # the equation knows of tips, expansions do not
        left_out = tip_waves(fan, k) if piecewise and not currents.solved else 0.0
        far = far_by_currents(currents, r, boundary, left_out=left_out, keep=keep)
        return replace(far, validity=validity(fan, wavenumber=k))
    within_budget(KEPT_BYTES * len(r), f"the field in {len(r)} directions", "ask for fewer", asked=len(r))
    # what is kept has the same parts whatever memory is free
    each = RAY_BYTES + FAN_BYTES * k * size(fan.body)
    firsts = range(0, len(r), TOGETHER)
    parts = blocks(len(r), each) if keep is not_kept else [slice(first, first + TOGETHER) for first in firsts]

    def some_of(some: slice) -> FarField:
        if piecewise:
            return piecewise_far_field(fan, r[some], k, boundary, order)
        return field_of(far_geometry(fan, r[some]), k, boundary, order)

    def kept(some: slice) -> FarField:
        if keep is not_kept:
            return some_of(some)
        return FarField.unpacked(keep(f"rays-{some.start}", lambda: some_of(some).packed()))

    far = FarField.joined([kept(some) for some in parts])
    far = replace(far, validity=validity(fan, wavenumber=k), unit=unit_of(fan.body))
    auto = method == "auto" and order == 2 and len(r) > 0 and not piecewise
    level = measured_level(fan, k, boundary) if auto else None
    return level.applied(far) if level else far


class Level(NamedTuple):
    """What the comparison found.

    Attributes
    ----------
    wavenumber : float, 1/L
        k0.
    factor : float
        Level of the error that rays state.
    shared : float, L
        Epsilon f_rms.
    unserved : float
        Share of the shadow line that launches no ray.
    """

    wavenumber: float
    factor: float
    shared: float
    unserved: float

    def applied(self, far: FarField) -> FarField:
        """A far field by rays with its error as the level has it."""
        factor = self.factor
        if far.total.ndim > 1 and factor > 1:
            factor *= far.wavenumber / self.wavenumber
        both = self.shared * (1.0 if self.unserved > 0 else self.wavenumber / far.wavenumber)
        return replace(
            far,
            error=np.hypot(factor * far.error, both),
            error_by="extrapolated",
            measured_at=self.wavenumber,
        )


def measured_level(fan: RayFan, wavenumber: float, boundary: BoundaryLike) -> Level | None:
    """The level at the highest affordable wavenumber below one, 1/L; None where there are no currents to compare with.

    It is kept with the fan.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> line = cr.shadow_line(ball, direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, length=3.0, n_rays=32)
    >>> level = measured_level(fan, 1e4, "soft")
    >>> 20 < level.wavenumber < 60, 0.2 <= level.factor < 2, level.shared < 1e-2
    (True, True, True)
    """
    # whatever the wavenumber, so that many have the comparison in common
    highest = 100 / size(fan.body)
    for _ in range(3):
        highest *= np.sqrt(TRUST.level_nodes / max(expected_nodes(fan, highest), 1))
    k0 = min(wavenumber, float(highest))
    return memo(fan, f"level {boundary} {k0!r}", lambda: _measured(fan, k0, boundary))


def _measured(fan: RayFan, k0: float, boundary: BoundaryLike) -> Level | None:
    try:
        # what expansions lack there they lack at k as well
        currents = surface_currents(fan, wavenumber=k0, boundary=boundary, solve=False)
    except SurfaceError:
        return None
    r = fibonacci_directions(TRUST.level_directions)
    geometry = far_geometry(fan, r)
    rays = field_of(geometry, k0, boundary, 2)
    off = np.abs(rays.total - currents.far(r))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = (off / rays.error).reshape(-1)
    ratio = np.minimum(ratio[~np.isnan(ratio)], 1e9)
    shared = currents.extinction * currents.mean_amplitude
    if not len(ratio) or not np.isfinite(shared):
        return None
    factor = float(np.clip(np.quantile(ratio, 0.95), *TRUST.levels))
    return Level(k0, factor, float(shared), currents.unserved)


def far_field_uncertainty(
    fan: RayFan, observation: ArrayLike, *, wavenumber: float, boundary: BoundaryLike = "soft", order: int = 2
) -> FloatArray | None:
    """Change of the far field when the body is replaced by its second fit (`coarse_fit`).

    Shadow line and rays are computed again on the second fit. The change is about the error of the less accurate fit.
    Where the second fit uses a coarser grid that resolves the body, it is two to four times the error of the fan's
    field. For a subdivided mesh it is multiplied by ``coarse_factor`` and is about the error of the fan's field. The
    error of the asymptotic method is not included.

    Parameters
    ----------
    fan : RayFan
        Of a body from a file; see `creeping.rays.uncertain_body`.
    observation, wavenumber, boundary, order
        As for `far_field`.

    Returns
    -------
    (m,) or (m, 2, 2), L, or None
        |f - f on the second fit| times ``coarse_factor``; None for a body that is known exactly.

    Raises
    ------
    InvalidInputError
        For the reasons given at `far_field`.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> fan = cr.launch(cr.DirectFlow(ball), cr.shadow_line(ball, direction=(0, 0, 1)), length=0.5, n_rays=8)
    >>> cr.far_field_uncertainty(fan, [(0, 0, -1)], wavenumber=30.0) is None    # a sphere is known exactly
    True
    """
    one_of(fan, "fan", RayFan, "creeping.launch")
    checked_plain(fan.body)
    scalar_boundaries(boundary)
    checked(wavenumber, order)
    observers_of(observation)
    other = coarse_fan(fan)
    if other is None:
        return None
    mine, its = (
        far_field(one, observation, wavenumber=wavenumber, boundary=boundary, order=order) for one in (fan, other)
    )
    return coarse_factor(fan) * np.abs(mine.total - its.total)
