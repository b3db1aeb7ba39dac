"""The total field at points off the body: by the currents of the whole body, or by the creeping rays that come there.

    u(y) = e^{ikd.y} + int (u dG/dn_x - du/dn G) dS                          currents, everywhere
    u(y) = sum of the waves of the rays whose tangents pass through y         rays, in the shadow

Currents (`creeping.field.currents`) know no caustics and no shadow boundary, but they err by a share of the incident
wave, and must be a quarter of a wavelength away; nearer, the field is between theirs and that on the body
(`creeping.field.near_layer`). Rays err by a share of what they bring, which in the deep shadow is
far less. So rays serve in the shadow where nothing is the matter with them and their error is the smaller one.

Sources: [LK59], [CK13]; Derivations, F8, F17 and F20.
"""

import numpy as np

from creeping._typing import Any, ArrayLike, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.errors import InvalidInputError, SurfaceError
from creeping.field.arguments import checked, checked_plain
from creeping.field.boundary import Boundary, BoundaryLike, boundary_name
from creeping.field.currents.kept import affordable, kept_currents
from creeping.field.currents.total import far_enough, total_at
from creeping.field.far_geometry import fan_strips
from creeping.field.near_layer import layer_field
from creeping.field.near_wave import shed_waves
from creeping.field.on_body import rays_on, total_on
from creeping.field.point_result import FieldStatus, NearField, judged
from creeping.field.ray_sums import own_error, ray_sum
from creeping.field.surface import scalar_boundary
from creeping.geodesics.bundle import as_points
from creeping.geometry.surface import normal, size
from creeping.rays.fan import RayFan
from creeping.rays.shedding import shed_near
from creeping.shadow.occlusion import occluded

METHODS = ("auto", "currents", "rays")
ON_BODY = 1e-7
"""Distance from the body, in its sizes, below which a point counts as on it."""
FINE = 0.01
"""Error of rays up to which currents are not asked."""
MISSING = 2.0
"""Bound of what rays leave out on the lit side, the incident wave and a reflected one; in the shadow it is 1."""


def near_field(
    fan: RayFan,
    points: ArrayLike,
    *,
    wavenumber: float,
    boundary: BoundaryLike = "soft",
    order: int = 2,
    method: str = "auto",
) -> NearField:
    """Total field u at points on or off the body, with its error; it acts as an array.

    Parameters
    ----------
    fan : RayFan
        Long enough to pass where rays leave towards the points.
    points : (..., 3), L
        Outside the body or on it.
    wavenumber : float, 1/L
    boundary : "soft", "hard" or ImpedanceBoundary
    order : 2 or 1
        Second-order creeping waves, or the leading order, which is by rays.
    method : {"auto", "currents", "rays"}
        The currents of the whole body, or the sum over creeping rays, which on the lit side is not the total field
        (status LIT). "auto" takes, point by point, rays in the shadow where they err less, currents elsewhere, unless
        these cost more than some ten seconds or the order is 1. Nearer to the body than a quarter of a wavelength
        "layer" stands for currents: what is between them and the field on the body (`creeping.field.near_layer`). Where
        that has no foot, over bays or ground without rays, rays serve.

    Returns
    -------
    NearField
        In units of the incident wave; ``method`` says what served at each point.

    Raises
    ------
    InvalidInputError
        On points inside the body or not finite, a bad wavenumber, boundary, order or method, and for a weighted body.
    SurfaceError
        If currents are asked for and the wavenumber is too high for any mesh of the body.

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
    checked_plain(fan.body)
    kind = scalar_boundary(boundary)
    k = checked(wavenumber, order)
    if method not in METHODS:
        raise InvalidInputError(f"method = {method!r} is not one of {', '.join(map(repr, METHODS))}")
    if method == "currents" and order != 2:
        raise InvalidInputError(f"method 'currents' has no order {order}; give method='rays'")
    y = as_points(points)
    flat = y.reshape(-1, 3)
    on = _checked_height(fan, flat) <= ON_BODY
    field = _Assembled(fan, flat, on, k, kind, order)
    if method == "rays":
        field.rays_on_body()
    else:
        field.total_on_body()
        asked = ~on & ((field.status != FieldStatus.OK) | (field.error > FINE) | (method == "currents"))
        if order == 2 and np.any(asked):
            field.by_currents(asked, boundary, method)
    arrays = field.arrays()
    arrays["status"] = judged(arrays["status"], arrays["values"], arrays["error"], arrays["error_by"], 1.0)
    return NearField(
        points=y.copy(),
        wavenumber=k,
        boundary=boundary_name(boundary),
        order=order,
        **{name: value.reshape(y.shape[:-1]) for name, value in arrays.items()},
    )


def _checked_height(fan: RayFan, points: FloatArray) -> FloatArray:
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


class _Assembled:
    """Field at points (n, 3), first by rays; parts, error, status and method (n,)."""

    def __init__(self, fan: RayFan, points: FloatArray, on: BoolArray, k: float, kind: Boundary, order: int) -> None:
        self.fan, self.points, self.on, self.k, self.kind, self.order = fan, points, on, k, kind, order
        n = len(points)
        self.incident, self.scattered, self.creeping = np.zeros((3, n), dtype=complex)
        self.error, self.status = np.zeros(n), np.zeros(n, dtype=np.int64)
        self.error_by, self.method = np.full(n, "expansion", dtype="<U10"), np.full(n, "rays", dtype="<U8")
        self.lit = np.zeros(n, dtype=bool)
        off = np.flatnonzero(~on)
        if not len(off):
            return
        body, d = fan.body, fan.line.direction
        shed = shed_near(fan_strips(fan), body, points[off])
        free = ~occluded(body, shed.rays.points, -shed.rays.directions, shed.reach)
        shed = shed[free]
        waves, other = (shed_waves(shed.rays, shed.reach, k, kind, o) for o in (order, 3 - order))
        rays = ray_sum(
            fan, shed, len(off), waves, own_error(shed.rays, (waves, other), k, kind, order, on=False), k, kind
        )
        self.lit[off] = ~occluded(body, points[off], d)
        self._take(off, rays.values, rays.error, np.where(self.lit[off], FieldStatus.LIT, rays.status))

    def _take(self, at: IntArray, creeping: ComplexArray, error: FloatArray, status: IntArray) -> None:
        """Rays at some points."""
        self.creeping[at], self.status[at] = creeping, status
        bad = status != FieldStatus.OK
        # a sum that is not to be trusted has the whole of its waves for a bound already
        missing = np.where(status == FieldStatus.LIT, MISSING, np.where(error > 0, 0.0, 1.0))
        self.error[at] = error + np.where(bad, missing, 0.0)
        self.error_by[at] = np.where(bad, "bound", "expansion")

    def rays_on_body(self) -> None:
        """Creeping rays alone at points on the body."""
        at = np.flatnonzero(self.on)
        if not len(at):
            return
        if self.kind.kind == "soft":
            self.method[at] = "boundary"
            return
        rays = rays_on(self.fan, self.points[at], self.k, self.kind, self.order)
        lit = normal(self.fan.body, self.points[at]) @ self.fan.line.direction < 0
        lit[lit] = ~occluded(self.fan.body, self.points[at][lit], self.fan.line.direction)
        self._take(at, rays.values, rays.error, np.where(lit, FieldStatus.LIT, rays.status))

    def total_on_body(self) -> None:
        """Total field at points on the body, the lit side's expansion included."""
        at = np.flatnonzero(self.on)
        if not len(at) or self.kind.kind == "soft":
            self.method[at] = "boundary"
            return
        total = total_on(self.fan, self.points[at], self.k, self.kind, self.order)
        lit = total["method"] != "rays"
        self.incident[at] = np.where(lit, np.exp(1j * self.k * (self.points[at] @ self.fan.line.direction)), 0.0)
        self.creeping[at], self.scattered[at] = total["creeping"], total["lit"] - self.incident[at]
        for name in ("error", "error_by", "status", "method"):
            getattr(self, name)[at] = total[name]

    def by_currents(self, asked: BoolArray, boundary: BoundaryLike, method: str) -> None:
        """Let currents serve where they are asked for, far enough and, unless they must, better."""
        at = np.flatnonzero(asked)
        if method == "auto" and not affordable(self.fan, len(at), self.k):
            return
        try:
            far = far_enough(self.fan.body, self.k, self.points[at])
            currents = kept_currents(self.fan, self.k, boundary)
        except SurfaceError:
            if method == "currents":
                raise
            return
        must = method == "currents"
        at, close = at[far], at[~far]
        incident, scattered, error = total_at(currents, self.points[at], ~self.lit[at])
        self._prefer(at, incident + scattered, error, "currents", must)
        if len(close):
            layer = layer_field(self.fan, currents, self.points[close], self.kind)
            at = close[layer.there]
            self._prefer(at, layer.values[layer.there], layer.error[layer.there], "layer", must)

    def _prefer(self, at: IntArray, values: ComplexArray, error: FloatArray, name: str, must: bool) -> None:
        """Let values serve at some points where they must, or are better than what rays give."""
        known = np.isfinite(error)
        better = must | (error < self.error[at]) | (known & (self.status[at] != FieldStatus.OK))
        at, known = at[better], known[better]
        self.incident[at] = np.exp(1j * self.k * (self.points[at] @ self.fan.line.direction))
        self.scattered[at], self.creeping[at] = values[better] - self.incident[at], 0.0
        # of a body that is nowhere thick enough to look inside nothing is known but the size of the wave
        self.error[at], self.error_by[at] = np.where(known, error[better], 1.0), np.where(known, "extinction", "bound")
        self.status[at], self.method[at] = FieldStatus.OK, name

    def arrays(self) -> dict[str, Any]:
        """What a result is made of, each (n,)."""
        names = ("incident", "scattered", "creeping", "error", "error_by", "status", "method")
        arrays = {name: getattr(self, name) for name in names}
        return arrays | {"values": self.incident + self.scattered + self.creeping}
