"""The total field at points off the body: by the currents of the whole body, or by the creeping rays that come there.

    u(y) = e^{ikd.y} + int (u dG/dn_x - du/dn G) dS                          currents, everywhere
    u(y) = sum of the waves of the rays whose tangents pass through y         rays, in the shadow

Currents (`creeping.field.currents`) know no caustics and no shadow boundary, but they err by a share of the incident
wave, and must be a quarter of a wavelength away; nearer, the field is between theirs and that on the body
(`creeping.field.near`). Rays err by a share of what they bring, which in the deep shadow is
far less. So rays serve in the shadow where nothing is the matter with them and their error is the smaller one.

Also here: the total field nearer to the body than currents serve: between the field on it and that of currents above.

Along the normal at x, h above the body, t = kh and c = -n.d, at least 0.15,

    u = a cos ct + b sin(ct)/c + a' t sin(ct)/c + b' 3 (sin ct - ct cos ct)/c^3

with u and du/dn on the body from the surface field and u at 0.27 and 0.54 wavelengths from currents. Incident and
reflected wave of a plane are a and b; where the wave grazes the four are 1, t, t^2 and t^3. Each weight of a value is 1
at most; what four terms leave out is about 0.1 |kappa_1 + kappa_2|/k of the incident wave, 0.03 on an impedance; on a
saddle the root of kappa_1^2 + kappa_2^2 stands for the sum.

Sources: [LK59], [CK13]; Derivations, F8, F17 and F20.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from dataclasses import replace

import numpy as np

from creeping._typing import ArrayLike, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.errors import InvalidInputError, SurfaceError
from creeping.field.arguments import checked, checked_method, checked_plain
from creeping.field.body_currents import affordable, cached_currents, solved_currents
from creeping.field.boundary import Boundary, BoundaryLike, boundary_name
from creeping.field.currents.whole_body import SurfaceCurrents, far_enough, total_at
from creeping.field.equation.currents import TileCurrents
from creeping.field.marching.fan_waves import march_alone
from creeping.field.on_body import rays_on, total_on
from creeping.field.results.point_result import FieldStatus, NearField, PointValues, judged, measured_field, zero_field
from creeping.field.validity_range import validity
from creeping.field.waves.far_geometry import fan_strips
from creeping.field.waves.near_wave import height_above, shed_waves
from creeping.field.waves.ray_sums import RaySum, own_error, ray_sum
from creeping.field.waves.surface import scalar_boundary
from creeping.geodesics.bundle import as_points
from creeping.geometry.arguments import one_of
from creeping.geometry.checks import unit_of
from creeping.geometry.piecewise import has_edges
from creeping.geometry.quadrature import BodyNodes, nearest_points
from creeping.geometry.surface import Surface, normal, size
from creeping.rays.fan import RayFan
from creeping.rays.shedding import free_ways, shed_near
from creeping.shadow.attachment import occluded

ON_BODY = 1e-7
"""Distance from the body, in its sizes, below which a point counts as on it."""
FINE = 0.01
"""Error of rays up to which currents are not asked."""
MISSING = 2.0
"""Bound of what rays leave out on the lit side, the incident wave and a reflected one; in the shadow it is 1."""

ABOVE = (0.27, 0.54)
"""Heights, in wavelengths, of the points at which currents are asked."""
CLEAR = 0.2
"""Distance from all of the body that nodes must tell of these, in wavelengths: they are too far apart to tell more."""
GRAZING = 0.15
"""Least c: below, the four terms are powers of t to rounding."""
LEFT_OUT = {"soft": 0.1, "hard": 0.1, "impedance": 0.03}
"""Error of four terms, in |kappa_1 + kappa_2|/k, or on a saddle the root of the sum of squares."""
FOOT = 1e-6
"""Distance, in body sizes, up to which a point is above its foot."""


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
        currents' field and the field on the body ("layer", see `creeping.field.near`), or taken from rays where the
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
    one_of(fan, "fan", RayFan, "creeping.launch")
    kind = scalar_boundary(boundary)
    k = checked(wavenumber, order, fan.body)
    checked_method(method, order)
    checked_plain(fan.body, edgeless="the near field by rays" if method == "rays" or order == 1 else "")
    y = as_points(points)
    flat = y.reshape(-1, 3)
    on = checked_height(fan, flat) <= ON_BODY
    off, at = np.flatnonzero(~on), np.flatnonzero(on)
    dark = np.zeros(len(flat), dtype=bool)
    dark[off] = occluded(fan.body, flat[off], fan.line.direction)
    field = zero_field(len(flat), "boundary")
    must = method in ("currents", "equation") or has_edges(fan.body)
    solved: SurfaceCurrents | None = None
    if must:
        solved = cached_currents(fan, k, boundary, solve=True if method == "equation" else None)
    elif method == "auto" and order == 2:
        solved = solved_currents(fan, k, boundary)
    by_currents = method != "rays" and order == 2 and (must or affordable(fan, len(off), k))
    # of rays on the lit side nothing is known that currents do not know better
    marched = march_alone(fan.body, kind)
    plain = marched | (by_currents & ~dark)
    without, rays = off[plain[off]], off[~plain[off]]
    field = field.put(without, _no_rays(~dark[without]))
    field = field.put(rays, _rays_off(fan, flat[rays], ~dark[rays], k, kind, order)) if len(rays) else field
    if len(at) and kind.kind != "soft":
        its = fan, flat[at], k, kind, order
        field = field.put(at, _rays_alone_on(*its) if method == "rays" else total_on(*its, solved))
    asked = np.flatnonzero(~on & ((field.status != FieldStatus.OK) | (field.error > FINE) | (solved is not None)))
    if method != "rays" and order == 2 and len(asked):
        field = _with_currents(field, fan, flat, asked, dark, k, boundary, must=must or kind.varies, solved=solved)
    left = without[field.method[without] == "none"]
    if len(left) and not marched:
        field = field.put(left, _rays_off(fan, flat[left], ~dark[left], k, kind, order))
    return _result(field, fan, y, k, boundary, order)


def _result(
    field: PointValues, fan: RayFan, points: FloatArray, k: float, boundary: BoundaryLike, order: int
) -> NearField:
    """The field at points (..., 3), judged, in the parts that a reader wants."""
    shape = points.shape[:-1]
    phase = np.exp(1j * k * (points @ fan.line.direction))
    incident = np.where(np.isin(field.method, ("rays", "boundary", "none")).reshape(shape), 0.0, phase)
    scattered, creeping = field.wave.reshape(shape) - incident, field.creeping.reshape(shape)
    return NearField(
        points=points.copy(),
        values=incident + scattered + creeping,
        error=field.error.reshape(shape),
        error_by=field.error_by.reshape(shape),
        status=judged(field.status, field.values, field.error, field.error_by, 1.0).reshape(shape),
        method=field.method.reshape(shape),
        incident=incident,
        scattered=scattered,
        creeping=creeping,
        wavenumber=k,
        boundary=boundary_name(boundary),
        order=order,
        validity=validity(fan, wavenumber=k),
        length_unit=unit_of(fan.body),
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


def _rays_off(fan: RayFan, points: FloatArray, lit: BoolArray, k: float, kind: Boundary, order: int) -> PointValues:
    """Creeping rays at points off the body (n, 3)."""
    shed = shed_near(fan_strips(fan), fan.body, points)
    shed = shed[free_ways(fan.body, shed.rays, shed.reach)]
    waves, other = (shed_waves(shed.rays, shed.reach, k, kind, o) for o in (order, 3 - order))
    height = height_above(shed.rays, shed.reach, k)
    error = own_error(shed.rays, (waves, other), k, kind, order, height=height)
    return rays_alone(ray_sum(fan, shed, len(points), waves, error, k, kind), lit)


def _no_rays(lit: BoolArray) -> PointValues:
    """The field where no rays were asked (n,)."""
    nothing = np.zeros(len(lit), dtype=complex)
    status = np.where(lit, FieldStatus.LIT, FieldStatus.NO_RAY)
    return PointValues(
        wave=nothing,
        creeping=nothing,
        error=np.where(lit, MISSING, 1.0),
        error_by=np.full(len(lit), "bound"),
        status=status.astype(np.int64),
        method=np.full(len(lit), "none"),
    )


def _rays_alone_on(fan: RayFan, points: FloatArray, k: float, kind: Boundary, order: int) -> PointValues:
    """Creeping rays alone at points on the body (n, 3)."""
    d = fan.line.direction
    lit = normal(fan.body, points) @ d < 0
    lit[lit] = ~occluded(fan.body, points[lit], d)
    rays, by = rays_on(fan, points, k, kind, order)
    return replace(rays_alone(rays, lit), method=by)


def rays_alone(rays: RaySum, lit: BoolArray) -> PointValues:
    """A sum over rays as the field, with a bound of what it lacks on the lit side and where it is not to be trusted."""
    status = np.where(lit, FieldStatus.LIT, rays.status).astype(np.int64)
    bad = status != FieldStatus.OK
    # a sum that is not to be trusted has the whole of its waves for a bound already
    missing = np.where(lit, MISSING, np.where(rays.error > 0, 0.0, 1.0))
    return PointValues(
        wave=np.zeros_like(rays.values),
        creeping=rays.values,
        error=rays.error + np.where(bad, missing, 0.0),
        error_by=np.where(bad, "bound", "expansion"),
        status=status,
        method=np.full(len(status), "rays"),
    )


def _with_currents(
    field: PointValues,
    fan: RayFan,
    points: FloatArray,
    asked: IntArray,
    dark: BoolArray,
    k: float,
    boundary: BoundaryLike,
    *,
    must: bool,
    solved: SurfaceCurrents | None,
) -> PointValues:
    """The field with that of currents, or of the layer, at the points asked for where it must be or is better."""
    if not must and not affordable(fan, len(asked), k):
        return field
    try:
        currents = solved or cached_currents(fan, k, boundary)
        if isinstance(currents, TileCurrents):
            return field.replaced_where_better(asked, _solved_at(currents, points[asked], dark[asked]), must=must)
        far = far_enough(fan.body, k, points[asked])
    except SurfaceError:
        if must:
            raise
        return field
    at, close = asked[far], asked[~far]
    incident, scattered, error = total_at(currents, points[at], dark[at])
    field = field.replaced_where_better(
        at, measured_field(incident + scattered, error, "currents", "extinction"), must=must
    )
    if len(close):
        rows, layer = layer_field(fan, currents, points[close], scalar_boundary(boundary))
        field = field.replaced_where_better(close[rows], layer, must=must)
    return field


def _solved_at(currents: TileCurrents, points: FloatArray, dark: BoolArray) -> PointValues:
    """Total field of solved currents at points (n, 3), L, off the body, some of them in the dark."""
    incident, scattered, _ = total_at(currents, points, dark)
    return measured_field(incident + scattered, currents.error_around(points), "equation", "extinction")


def layer_field(
    fan: RayFan, currents: SurfaceCurrents, points: FloatArray, kind: Boundary
) -> tuple[IntArray, PointValues]:
    """Rows of the points (n, 3), L, less than half a wavelength off the body, that the layer serves, and its field."""
    body, k, d = fan.body, currents.wavenumber, currents.direction
    at, nodes, height, tops = feet_of(body, points, k, ABOVE)
    foot, n = nodes.points, nodes.normals
    surface = total_on(fan, foot, k, kind, 2, currents)
    good = np.flatnonzero(surface.status == FieldStatus.OK)
    at, surface, height, nodes = at[good], surface[good], height[good], nodes.part(good)
    known, errors = _on_body(surface.values, surface.error, k, kind.at(nodes.points))
    for top in tops:
        incident, scattered, its = total_at(currents, top[good], occluded(body, top[good], d))
        known.append(incident + scattered)
        errors.append(its)
    # waves behind the body run along it
    weights = _weights(np.maximum(-n[good] @ d, GRAZING), k * height)
    errors = [weights[:, i] * one for i, one in enumerate(errors)]
    values = np.sum(weights * np.stack(known, axis=1), axis=1)
    error = np.linalg.norm([*errors, LEFT_OUT[kind.kind] * nodes.bending / k], axis=0)
    return at, measured_field(values, error, "layer", "extinction+expansion")


def feet_of(
    body: Surface, points: FloatArray, k: float, above: tuple[float, ...], clear: float = CLEAR
) -> tuple[IntArray, BodyNodes, FloatArray, list[FloatArray]]:
    """Rows of the points (n, 3), L, at most two heights up that have a foot: feet, own heights, and points above them.

    Heights ``above`` are in wavelengths; at each of them the point above a foot is outside, and ``clear`` of the body.
    """
    foot, n, hessians, height = nearest_points(body, points)
    scale = size(body)
    there = np.linalg.norm(foot + height[:, None] * n - points, axis=1) < FOOT * scale
    there &= (height > 0) & (height < above[1] * 2 * np.pi / k)
    there &= np.abs(body.level(foot)) <= FOOT * scale * np.linalg.norm(body.gradient(foot), axis=1)
    tops = [foot + share * 2 * np.pi / k * n for share in above]
    for top in tops:
        at = np.flatnonzero(there)
        # over a bay they may be in the body or near its other side
        there[at] = (body.level(top[at]) > 0) & far_enough(body, k, top[at], clear)
    at = np.flatnonzero(there)
    nodes = BodyNodes(foot[at], n[at], np.ones(len(at)), hessians[at], 0.0)
    return at, nodes, height[at], [top[at] for top in tops]


def _on_body(
    on: ComplexArray, off: FloatArray, k: float, kind: Boundary
) -> tuple[list[ComplexArray], list[FloatArray]]:
    """The field u and (1/k) du/dn on the body (n,), and their errors."""
    nothing = np.zeros_like(on)
    if kind.kind == "soft":
        return [nothing, on / k], [np.abs(nothing), off / k]
    slope = np.asarray(-1j * kind.admittance * on)
    return [on, slope], [off, np.abs(kind.admittance) * off]


def _weights(c: FloatArray, t: FloatArray) -> FloatArray:
    """Weights (n, 4) of u and (1/k) du/dn on the body and of u at both heights above, at kh = t (n,)."""
    slope = np.tile([0.0, 1.0, 0.0, 0.0], (len(c), 1))
    rows = [layer_terms(c, 0.0), slope, *(layer_terms(c, 2 * np.pi * share) for share in ABOVE)]
    return solved(rows, layer_terms(c, t))


def layer_terms(c: FloatArray, t: ArrayLike) -> FloatArray:
    """The four terms (n, 4) at heights t (n,) or t, kh."""
    t = np.asarray(t, dtype=float)
    sine, cosine = np.sin(c * t), np.cos(c * t)
    return np.stack([cosine, sine / c, t * sine / c, 3 * (sine - c * t * cosine) / c**3], axis=1)


def solved(rows: list[FloatArray], terms: FloatArray) -> FloatArray:
    """Weights (n, r) of known values, whose terms are ``rows`` (n, r) each, that give what has ``terms`` (n, r)."""
    return np.asarray(np.linalg.solve(np.stack(rows, axis=2), terms[..., None])[..., 0])
