"""The far field of a plane wave, u_s ~ f(r) e^{ikR}/R: by the currents of the whole body, or ray by ray.

Currents (`creeping.field.currents`) have no caustics, blends or hand-overs, and measure their own error; their cost
grows like k^2 with every direction. Rays (`creeping.field.far_rays`) cost the same at any k and tell what each of them
gives; where the reflected field has a caustic they err, and what they say of it is the size of their second order.

Sources: [LK59], [CK13]; Derivations, F10 to F17.
"""

from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np

from creeping._typing import ArrayLike, FloatArray
from creeping.errors import InvalidInputError, SurfaceError
from creeping.field.arguments import checked
from creeping.field.boundary import BoundaryLike, boundary_name, scalar_boundaries
from creeping.field.currents.whole_body import SurfaceCurrents, surface_currents
from creeping.field.far_geometry import far_geometry, observers_of
from creeping.field.far_rays import error_by_order, field_of
from creeping.field.far_result import FarField
from creeping.field.validity_range import validity
from creeping.geometry.quadrature import body_nodes
from creeping.geometry.surface import size
from creeping.rays.fan import RayFan

METHODS = ("auto", "currents", "rays")
AFFORDABLE = 3e9
"""Nodes times directions up to which "auto" takes currents: some ten seconds of one core."""
MOST_NODES = 1.5e6
"""Nodes up to which it does, for the memory's sake."""
UNRESOLVED = 0.1
"""Error, as a share of the largest |f|, from which a direction counts as unresolved."""
_CURRENTS: "WeakKeyDictionary[RayFan, dict[tuple[float, BoundaryLike], SurfaceCurrents]]" = WeakKeyDictionary()
KEPT = 2
"""Currents kept with a fan, of so many wavenumbers and boundaries."""


def far_field(
    fan: RayFan,
    observation: ArrayLike,
    *,
    wavenumber: float,
    boundary: BoundaryLike = "soft",
    order: int = 2,
    method: str = "auto",
) -> FarField:
    """Far field scattered by the body of a fan, with its error.

    Parameters
    ----------
    fan : RayFan
        Long enough to pass where rays leave towards the observers; rays beyond its length are left out.
    observation : (..., 3)
        Directions r from the body to the observers; need not be unit. Flattened to (m, 3).
    wavenumber : float, 1/L
    boundary : "soft", "hard", "pec" or ImpedanceBoundary
    order : 2 or 1
        Second-order creeping waves, or the leading order, which is by rays.
    method : {"auto", "currents", "rays"}
        The currents of the whole body, or isolated rays. "auto" takes currents unless they cost more than some ten
        seconds, the boundary is "pec" or the order 1.

    Returns
    -------
    FarField
        Geometry and currents are kept with the fan: the same directions, or the same frequency, cost less again.

    Raises
    ------
    InvalidInputError
        On bad directions, wavenumber, boundary, order or method, and for a weighted body.
    SurfaceError
        If currents are asked for and the wavenumber is too high for any mesh of the body.

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
    kinds = scalar_boundaries(boundary)
    k = checked(wavenumber, order)
    if method not in METHODS:
        raise InvalidInputError(f"method = {method!r} is not one of {', '.join(map(repr, METHODS))}")
    able = len(kinds) == 1 and order == 2
    if method == "currents" and not able:
        what = f"order {order}" if order != 2 else f"boundary {boundary!r}"
        raise InvalidInputError(f"method 'currents' has no {what}; give method='rays'")
    r = observers_of(observation)
    if method == "currents" or (method == "auto" and able and len(r) and _affordable(fan, len(r), k)):
        try:
            far = _by_currents(_currents(fan, k, boundary), r, boundary)
            return replace(far, validity=validity(fan, wavenumber=k))
        except SurfaceError:
            if method == "currents":
                raise
    geometry = far_geometry(fan, r)
    far = error_by_order(field_of(geometry, k, boundary, order), geometry, boundary)
    return replace(far, validity=validity(fan, wavenumber=k))


def _affordable(fan: RayFan, directions: int, wavenumber: float) -> bool:
    """Whether currents cost little enough, by the area of the body."""
    if not len(fan.points):
        return False
    try:
        area = float(np.sum(body_nodes(fan.body, 4 / size(fan.body)).weights))
    except SurfaceError:
        return False
    # some six nodes a wavelength on the lit half, and the least that a mesh has
    nodes = max(3e4, 0.5 * area * (6 * wavenumber / (2 * np.pi)) ** 2)
    return nodes < MOST_NODES and nodes * directions < AFFORDABLE


def _currents(fan: RayFan, wavenumber: float, boundary: BoundaryLike) -> SurfaceCurrents:
    kept = _CURRENTS.setdefault(fan, {})
    key = (wavenumber, boundary)
    if key not in kept:
        while len(kept) >= KEPT:
            kept.pop(next(iter(kept)))
        kept[key] = surface_currents(fan, wavenumber=wavenumber, boundary=boundary)
    return kept[key]


def _by_currents(currents: SurfaceCurrents, r: FloatArray, boundary: BoundaryLike) -> FarField:
    lit, dark = (currents.far_of(part, r) for part in (currents.lit, ~currents.lit))
    error = currents.error(r)
    largest = max(float(np.max(np.abs(lit + dark), initial=0.0)), abs(currents.far(currents.direction[None])[0]))
    return FarField(
        directions=r.copy(),
        creeping=dark,
        reflected=lit,
        forward=np.zeros(len(r), dtype=complex),
        method=np.full(len(r), "currents", dtype="<U16"),
        unresolved=~(error < UNRESOLVED * largest),
        error=error,
        error_by="extinction",
        wavenumber=currents.wavenumber,
        boundary=boundary_name(boundary),
        order=2,
    )
