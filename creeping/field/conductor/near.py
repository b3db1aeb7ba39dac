"""E and H at points off a perfect conductor or on it, and the current on it, for plane waves of chosen polarisation.

    on the body              E = (n.E) n,  H = J x n, by J and its divergence     `creeping.field.conductor.on_body`
    a quarter wavelength off the radiation of the whole body's currents           `creeping.field.conductor.layer`
    nearer                   between the two                                      `creeping.field.conductor.layer`
    anywhere, solved         tiles of the integral equation                       `creeping.field.equation.currents`
    in the shadow            creeping rays, where they state the smaller error    `creeping.field.conductor.near`

Also here: e and H of the creeping rays whose tangents pass through points off a conductor.

    H = h u b - e (i kappa_t1/(kT)) u p,   E = -h u n        electric hard
    E = e v b,                             H = e v n         electric soft

p, n and b = n x p are those where the ray leaves, h = H0.b and e = E0.b those where it has landed, u and v the waves of
`creeping.field.waves.near_wave`, T = J + l J' the width of the ray's tube. A ray carries b onto b and n onto n; what h
varies by across rays gives H along them, (i/k) dh/db, as in the current on the body. E and H along rays that come from
what u and v vary by along n, of the order m/(k l) at the distance l, are left out; the error counts them.

Sources: [CK13, sec. 6.2]; [LK59], [PBM80]; Derivations, F18, F20, F26, F8 and F14.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from dataclasses import replace

import numpy as np

from creeping._typing import Any, ArrayLike, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.errors import SurfaceError
from creeping.field.arguments import PLAIN, checked, checked_method, checked_plain, scales
from creeping.field.body_currents import affordable, cached_currents, solved_currents
from creeping.field.boundary import CONDUCTOR, ELECTRIC_HARD, ELECTRIC_SOFT
from creeping.field.conductor.layer import incident_fields, layer_fields, lowest_height, total_fields
from creeping.field.conductor.on_body import OnConductor, on_conductor
from creeping.field.currents.conductor import ConductorCurrents, amplitudes
from creeping.field.currents.whole_body import POINTS as INNER
from creeping.field.currents.whole_body import far_enough
from creeping.field.equation.currents import ConductorTileCurrents
from creeping.field.lit_ground import LEFT, UNKNOWN, convex
from creeping.field.near import MISSING, ON_BODY, checked_height, rays_alone
from creeping.field.results.conductor_result import ConductorCurrent, ConductorField, Fields, by_polarisation
from creeping.field.results.far_result import incident_mix, spherical_frame
from creeping.field.results.point_result import FieldStatus, PointValues, judged, measured_field, zero_field
from creeping.field.validity_range import validity
from creeping.field.waves.far_geometry import fan_strips
from creeping.field.waves.near_wave import height_above, shed_waves
from creeping.field.waves.ray_sums import RaySum, own_error, ray_sum
from creeping.geodesics.bundle import as_points, on_body
from creeping.geometry.arguments import one_of
from creeping.geometry.checks import unit_of
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.surface import normal
from creeping.rays.fan import RayFan
from creeping.rays.shedding import ShedRays, free_ways, shed_near
from creeping.shadow.attachment import occluded

VECTOR = 1.5
"""What sums for both fields of a polarisation cost, in terms of a scalar's."""
FINE = 1e-4
"""Error of rays up to which currents are not asked."""

ALONG, COUPLED = 1.5, 0.5
"""Error by what E and H have along the ray beside the term in kappa_t1, over m/(k l), and of that term."""


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
    k, mix = _checked(fan, wavenumber, polarisation, method)
    electric = np.asarray(spherical_frame(fan.line.direction).T @ mix, dtype=complex)
    y = as_points(points)
    flat = y.reshape(-1, 3)
    on = checked_height(fan, flat) <= ON_BODY
    off, at = np.flatnonzero(~on), np.flatnonzero(on)
    dark = np.zeros(len(flat), dtype=bool)
    dark[off] = occluded(fan.body, flat[off], fan.line.direction)
    fields = [_no_field(len(flat)) for _ in electric.T]
    left, currents, alone = _left_inside(fan, k, mix, method)
    if len(at):
        found = on_conductor(fan, flat[at], k, electric, left, currents)
        n = normal(fan.body, flat[at])
        fields = [one.put(at, _on_body(found, i, n)) for i, one in enumerate(fields)]
    if len(off) and alone:
        fields = [one.put(off, _unknown(len(off))) for one in fields]
        fields = _with_currents(fields, fan, flat, off, dark, left, currents, must=True)
    elif len(off):
        sums = shed_sums(fan, flat[off], k, electric)
        rays = [
            _from_elsewhere(rays_alone(its, ~dark[off]), float(its_left))
            for its, its_left in zip(sums, left, strict=True)
        ]
        fields = [one.put(off, its) for one, its in zip(fields, rays, strict=True)]
        fine = np.all([(one.status == FieldStatus.OK) & (one.error <= FINE) for one in fields], axis=0)
        solved = isinstance(currents, ConductorTileCurrents)
        asked = np.flatnonzero(~on & (~fine | solved))
        if len(asked):
            its = currents if solved else _for(fan, k, mix, len(asked))
            fields = _with_currents(fields, fan, flat, asked, dark, left, its)
    return _result(fields, fan, y, k, electric, single=polarisation is not None)


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
    k, mix = _checked(fan, wavenumber, polarisation, method)
    electric = np.asarray(spherical_frame(fan.line.direction).T @ mix, dtype=complex)
    y = as_points(points)
    left, currents, _ = _left_inside(fan, k, mix, method)
    found = on_conductor(fan, on_body(fan.body, y).reshape(-1, 3), k, electric, left, currents)
    shape, single = y.shape[:-1], polarisation is not None
    fields = found.current
    values, lit, creeping = (
        by_polarisation([getattr(one, name) for one in fields], shape, single=single)
        for name in ("values", "wave", "creeping")
    )
    return ConductorCurrent(
        points=y.copy(),
        values=values,
        charge=by_polarisation(list(found.charge.T), shape, single=single),
        charge_error=by_polarisation(list(found.charge_error.T), shape, single=single),
        lit=lit,
        creeping=creeping,
        **_judgement(fields, [np.linalg.norm(one.values, axis=1) for one in fields], shape, single),
        **_facts(fan, k, electric, single),
    )


def _checked(
    fan: RayFan, wavenumber: float, polarisation: str | ArrayLike | None, method: str
) -> tuple[float, ComplexArray]:
    """The wavenumber and the polarisations' components along theta and phi (2, p), if they and the body will do."""
    one_of(fan, "fan", RayFan, "creeping.launch")
    checked_plain(fan.body)
    checked_method(method, 2, PLAIN)
    return checked(wavenumber, 2, fan.body), incident_mix(polarisation, fan.line.direction)


def _places(count: int, mix: ComplexArray) -> int:
    """Points at which a scalar's sums cost as much as both fields of each polarisation at ``count``."""
    return int(np.ceil(VECTOR * mix.shape[1] * count))


def _left_inside(
    fan: RayFan, k: float, mix: ComplexArray, method: str
) -> tuple[FloatArray, ConductorCurrents | None, bool]:
    """What currents leave inside of each incident wave (p,), and they: 0 and none on a convex body; NaN if not known.

    And whether nothing but they will do.
    """
    alone = method == "equation" or is_piecewise(fan.body)
    if alone:
        currents = _currents(fan, k, mix, solve=True if method == "equation" else None)
        return np.max(currents.left_of_each, axis=0), currents, alone
    if convex(fan):
        solved = solved_currents(fan, k, "pec")
        if not isinstance(solved, ConductorTileCurrents):
            return np.zeros(mix.shape[1]), None, alone
        found: ConductorCurrents | None = solved.polarised(mix)
    else:
        found = _for(fan, k, mix, INNER)
    return np.full(mix.shape[1], np.nan) if found is None else np.max(found.left_of_each, axis=0), found, alone


def _for(fan: RayFan, k: float, mix: ComplexArray, count: int) -> ConductorCurrents | None:
    """Currents of the whole body for fields at so many points, None if they cost too much or there is no mesh."""
    try:
        return _currents(fan, k, mix) if affordable(fan, _places(count, mix), k) else None
    except SurfaceError:
        return None


def _currents(fan: RayFan, k: float, mix: ComplexArray, *, solve: bool | None = None) -> ConductorCurrents:
    """Currents of the whole body for these polarisations."""
    found = cached_currents(fan, k, "pec", solve=solve)
    assert isinstance(found, ConductorCurrents)
    return found.polarised(mix)


def _no_field(count: int) -> PointValues:
    """No E and no H (n, 6)."""
    none = zero_field(count, "rays")
    nothing = np.zeros((count, 6), dtype=complex)
    return PointValues(nothing, nothing, none.error, none.error_by, none.status, none.method)


def _unknown(count: int) -> PointValues:
    """E and H (n, 6) of which a bound alone is known."""
    nothing, words = np.zeros((count, 6), dtype=complex), np.full(count, "none")
    status = np.full(count, int(FieldStatus.UNRESOLVED), dtype=np.int64)
    return PointValues(nothing, nothing, np.full(count, MISSING), np.full(count, "bound"), status, words)


def _on_body(found: OnConductor, i: int, n: FloatArray) -> PointValues:
    """E and H (n, 6) of a polarisation on the body."""
    J = found.current[i]
    share = np.linalg.norm(J.wave, axis=1), np.linalg.norm(J.creeping, axis=1)
    with np.errstate(invalid="ignore"):
        # the charge belongs to both parts as the current does
        part = np.where(share[0] + share[1] > 0, share[0] / (share[0] + share[1]), 1.0)
        charge = found.charge[:, i]
        wave, creeping = (
            np.concatenate([(its * charge)[:, None] * n, np.cross(one, n)], axis=1)
            for its, one in ((part, J.wave), (1 - part, J.creeping))
        )
    # E there is the charge's
    error = np.maximum(J.error, found.charge_error[:, i])
    return PointValues(wave, creeping, error, J.error_by, J.status, J.method)


def _from_elsewhere(rays: PointValues, left: float) -> PointValues:
    """Rays with the error by waves that come from elsewhere on the body, of which ``left`` inside of it tells."""
    known = np.isfinite(left)
    return replace(
        rays,
        error=np.hypot(rays.error, LEFT * left if known else UNKNOWN),
        error_by=rays.error_by if known else np.full(len(rays.error), "bound"),
    )


def _with_currents(
    fields: list[PointValues],
    fan: RayFan,
    points: FloatArray,
    asked: IntArray,
    dark: BoolArray,
    left: FloatArray,
    currents: ConductorCurrents | None,
    *,
    must: bool = False,
) -> list[PointValues]:
    """Fields with those of currents, or of the layer, at the points asked for where they must be or are better."""
    if currents is None:
        return fields
    if isinstance(currents, ConductorTileCurrents):
        solution = _solved_at(currents, points[asked], dark[asked])
        return [one.replaced_where_better(asked, its, must=must) for one, its in zip(fields, solution, strict=True)]
    k = currents.wavenumber
    far = far_enough(fan.body, k, points[asked], lowest_height(currents))
    at, close = asked[far], asked[~far]
    if len(at):
        incident, scattered, error = total_fields(currents, points[at], dark[at])
        total = incident + scattered
        new = [measured_field(total[..., i], error[:, i], "currents", "extinction") for i in range(len(fields))]
        fields = [one.replaced_where_better(at, its, must=must) for one, its in zip(fields, new, strict=True)]
    if len(close):
        rows, layer = layer_fields(fan, currents, points[close], left)
        fields = [
            one.replaced_where_better(close[rows], its, must=must) for one, its in zip(fields, layer, strict=True)
        ]
    return fields


def _solved_at(currents: ConductorTileCurrents, points: FloatArray, dark: BoolArray) -> list[PointValues]:
    """E and H (n, 6) of each polarisation by solved currents at points (n, 3), L, off the body."""
    incident, scattered, _ = total_fields(currents, points, dark)
    total, error = incident + scattered, currents.error_around(points)
    return [measured_field(total[..., i], error[:, i], "equation", "extinction") for i in range(error.shape[1])]


def _result(
    fields: list[PointValues], fan: RayFan, points: FloatArray, k: float, electric: ComplexArray, *, single: bool
) -> ConductorField:
    """The field at points (..., 3), judged, in the parts that a reader wants."""
    shape = points.shape[:-1]
    waves = incident_fields(fan.line.direction, electric, points.reshape(-1, 3), k)
    parts: tuple[list[ComplexArray], ...] = ([], [], [])
    for i, one in enumerate(fields):
        incident = np.where((one.method == "rays")[:, None], 0.0, waves[..., i])
        for part, value in zip(parts, (incident, one.wave - incident, one.creeping), strict=True):
            part.append(np.asarray(value))
    incident_, scattered, creeping = (
        Fields(
            *(
                by_polarisation([v[:, part] for v in values], shape, single=single)
                for part in (slice(0, 3), slice(3, 6))
            )
        )
        for values in parts
    )
    sizes = [
        np.maximum(np.linalg.norm(one.values[:, :3], axis=1), np.linalg.norm(one.values[:, 3:], axis=1))
        for one in fields
    ]
    return ConductorField(
        points=points.copy(),
        incident=incident_,
        scattered=scattered,
        creeping=creeping,
        **_judgement(fields, sizes, shape, single),
        **_facts(fan, k, electric, single),
    )


def _judgement(
    fields: list[PointValues], sizes: list[FloatArray], shape: tuple[int, ...], single: bool
) -> dict[str, Any]:
    """Error, its source, status and method (..., p) of values so large."""
    status = [judged(v.status, s, v.error, v.error_by, 1.0) for v, s in zip(fields, sizes, strict=True)]
    arrays = {name: [getattr(v, name) for v in fields] for name in ("error", "error_by", "method")} | {"status": status}
    return {name: by_polarisation(values, shape, single=single) for name, values in arrays.items()}


def _facts(fan: RayFan, k: float, electric: ComplexArray, single: bool) -> dict[str, Any]:
    return {
        "incident_electric": electric[:, 0] if single else electric,
        "wavenumber": k,
        "boundary": "pec",
        "order": 2,
        "validity": validity(fan, wavenumber=k),
        "length_unit": unit_of(fan.body),
    }


def shed_sums(fan: RayFan, points: FloatArray, k: float, electric: ComplexArray) -> list[RaySum]:
    """Sums over rays of E and H (n, 6) at points off the body (n, 3), L, for each incident E0 (3, p)."""
    shed = shed_near(fan_strips(fan), fan.body, points)
    shed = shed[free_ways(fan.body, shed.rays, shed.reach)]
    pair = [_vectors(fan, shed, k, electric, order) for order in (2, 1)]
    coupled = np.linalg.norm(np.sum(pair[0][:, 3:] * shed.rays.directions[:, :, None], axis=1, keepdims=True), axis=1)
    m = scales(shed.rays, k)[1]
    strength = np.max([np.linalg.norm(wave[:, :3], axis=1).max(axis=1, initial=0.0) for wave in pair], axis=0)
    height, found = height_above(shed.rays, shed.reach, k), []
    for i in range(electric.shape[1]):
        waves, other = (wave[:, :, i] for wave in pair)
        own = own_error(shed.rays, (waves, other), k, CONDUCTOR, 2, height=height)
        along = np.minimum(ALONG * m / (k * np.maximum(shed.reach, 1e-300)), 1.0)
        own = np.linalg.norm([own, along * np.linalg.norm(waves, axis=1), COUPLED * coupled[:, i]], axis=0)
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
