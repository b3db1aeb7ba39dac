"""Currents of the whole body: what a plane wave excites on it, by the lit side's and the creeping rays' expansions.

    hard, impedance   u, with du/dn = -ik eta u
    soft              du/dn, with u = 0

and what they say of their own error: currents that are exact cancel the incident wave everywhere inside the body, so
what they leave of it there, rms, is epsilon, their error. With f_rms^2 = Im f(d)/k by the optical theorem, the mean of
|f|^2 over all directions of a body that absorbs nothing, and f' what the second order adds to f, by rays and by the lit
side apart, epsilon' what f' leaves inside,

    error(r) = epsilon [(2.5 f_rms)^2 + (2 |f'|(r)/epsilon')^2]^(1/2),   |f'|^2 = |f'_lit|^2 + |f'_rays|^2

It is meant to hold in 95 of 100 directions; both factors were set so on four bodies.

Sources: [F46], [LK59], [CK13, sec. 3.2]; Derivations, F16 and F17.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from creeping._typing import ArrayLike, BoolArray, ComplexArray, FloatArray
from creeping.field.arguments import checked
from creeping.field.boundary import Boundary, BoundaryLike
from creeping.field.currents.lit import lit_currents
from creeping.field.currents.nodes import lit_nodes, ray_nodes
from creeping.field.currents.radiation import far_of_scalar, field_of_scalar
from creeping.field.surface import scalar_boundary, surface_waves
from creeping.geodesics.bundle import as_points
from creeping.geometry.depth import inner_points
from creeping.geometry.surface import Surface
from creeping.rays.fan import RayFan

DEPTH = 0.25
"""Least depth, in wavelengths, of the points inside at which currents are judged: nearer the sums over nodes err."""
SHALLOW = 0.12
"""Least depth where the body is too thin for that."""
POINTS = 100
"""Points inside at which they are judged."""
LEVEL, SHAPE = 2.5, 2.0
"""Factors of the error: of what all directions share, and of what the second order says of each."""


@dataclass(frozen=True, eq=False, repr=False)
class SurfaceCurrents:
    """Currents at nodes of the body, whose weighted sums are integrals over it.

    Attributes
    ----------
    body : Surface
    direction : (3,)
        Of incidence.
    points, normals : (n, 3), L and 1
    weights : (n,), L^2
        Where two expansions share a region, each node has its share of the area.
    values : (n,) complex
        Field u, or du/dn (1/L) of the soft boundary.
    change : (n,) complex
        What of it is of second order.
    lit : (n,) of bool
        Whether the lit side's expansion served, else creeping rays.
    unserved : float
        Share of the shadow line from which no creeping ray starts: the currents behind it are missing.
    wavenumber : float, 1/L
    boundary : Boundary

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> line = cr.shadow_line(ball, direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, length=3.0, n_rays=16)
    >>> currents = cr.surface_currents(fan, wavenumber=12.0, boundary="soft")
    >>> bool(currents.extinction < 0.01), bool(abs(currents.far([(0, 0, -1)])[0]) - 0.5 < 0.01)
    (True, True)
    """

    body: Surface
    direction: FloatArray
    points: FloatArray
    normals: FloatArray
    weights: FloatArray
    values: ComplexArray
    change: ComplexArray
    lit: BoolArray
    unserved: float
    wavenumber: float
    boundary: Boundary

    def __repr__(self) -> str:
        return (
            f"SurfaceCurrents({int(self.lit.sum())} lit nodes, {int((~self.lit).sum())} on rays, "
            f"k = {self.wavenumber:g}, {self.boundary.kind})\n"
            f"  {100 * self.unserved:.3g} % of the shadow line launch no ray"
        )

    def far(self, directions: ArrayLike) -> ComplexArray:
        """Far-field amplitude f, L, in unit directions (m, 3): (m,)."""
        return self._far(self.values, np.ones(len(self.lit), dtype=bool), directions)

    def far_of(self, part: BoolArray, directions: ArrayLike) -> ComplexArray:
        """What some of the nodes (n,) give to `far`, L: (m, 3) -> (m,)."""
        return self._far(self.values, part, directions)

    def scattered(self, points: ArrayLike) -> ComplexArray:
        """Scattered field at points (m, 3), L, at least a quarter of a wavelength off the surface: (m,)."""
        return self._scattered(self.values, as_points(points))

    def left_inside(self, points: ArrayLike) -> ComplexArray:
        """What is left of the incident wave at points (m, 3), L, inside the body, as a share of it: (m,)."""
        x = as_points(points)
        return np.asarray(self.scattered(x) + np.exp(1j * self.wavenumber * (x @ self.direction)))

    @cached_property
    def inner_points(self) -> FloatArray:
        """Points inside the body at which the currents are judged (m, 3), L; none where it is nowhere thick enough."""
        wavelength = 2 * np.pi / self.wavenumber
        points = inner_points(self.body, DEPTH * wavelength, POINTS)
        return points if len(points) else inner_points(self.body, SHALLOW * wavelength, POINTS)

    @cached_property
    def extinction(self) -> float:
        """Rms of what is left of the incident wave inside, as a share of it; NaN if the body is nowhere thick enough.

        It is the error of the far field, rms over all directions, as a share of the field's rms, within a factor of
        about 2.
        """
        return _rms(self.left_inside(self.inner_points))

    @cached_property
    def mean_amplitude(self) -> float:
        """Rms of |f| over all directions, L, of a body that absorbs nothing; a bound of it if it absorbs."""
        return float(np.sqrt(abs(self.far(self.direction[None])[0].imag) / self.wavenumber))

    def error(self, directions: ArrayLike) -> FloatArray:
        """Error of f, L, that 95 of 100 directions keep to: (m, 3) -> (m,)."""
        lit, dark = (self._far(self.change, part, directions) for part in (self.lit, ~self.lit))
        shape = np.hypot(np.abs(lit), np.abs(dark)) / self._change_inside
        return np.asarray(self.extinction * np.hypot(LEVEL * self.mean_amplitude, SHAPE * shape))

    def changed(self, points: ArrayLike) -> FloatArray:
        """What the second order adds at points (m, 3), L, off the body, over what it adds inside, rms: (m,)."""
        x = as_points(points)
        lit, dark = (self._scattered(np.where(part, self.change, 0.0), x) for part in (self.lit, ~self.lit))
        return np.asarray(np.hypot(np.abs(lit), np.abs(dark)) / self._change_inside)

    @cached_property
    def _change_inside(self) -> float:
        """Rms inside of what the second order adds."""
        return _rms(self._scattered(self.change, self.inner_points))

    def _far(self, values: ComplexArray, part: BoolArray, directions: ArrayLike) -> ComplexArray:
        """f (m,) of values (n,) on some of the nodes."""
        r = np.asarray(directions, dtype=float)
        u, slope = (None if one is None else one[part] for one in self._scalar(values))
        return far_of_scalar(self.points[part], self.normals[part], u, slope, r, self.wavenumber)

    def _scattered(self, values: ComplexArray, points: FloatArray) -> ComplexArray:
        return field_of_scalar(self.points, self.normals, *self._scalar(values), points, self.wavenumber)

    def _scalar(self, values: ComplexArray) -> tuple[ComplexArray | None, ComplexArray | None]:
        """u dS and du/dn dS, None for nothing."""
        strength = np.asarray(values * self.weights)
        if self.boundary.kind == "soft":
            return None, strength
        if self.boundary.kind == "hard":
            return strength, None
        return strength, np.asarray(-1j * self.wavenumber * self.boundary.admittance * strength)


def surface_currents(fan: RayFan, *, wavenumber: float, boundary: BoundaryLike = "soft") -> SurfaceCurrents:
    """Currents of the whole body of a fan.

    Parameters
    ----------
    fan : RayFan
        Its flow and its line are used; rays are as long and as dense as the wavenumber asks for.
    wavenumber : float, 1/L
    boundary : "soft", "hard" or ImpedanceBoundary

    Returns
    -------
    SurfaceCurrents

    Raises
    ------
    InvalidInputError
        On a bad wavenumber or boundary, and for a weighted body.
    SurfaceError
        If the wavenumber is too high for any mesh of the body.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> line = cr.shadow_line(ball, direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, length=3.0, n_rays=16)
    >>> currents = cr.surface_currents(fan, wavenumber=12.0, boundary="hard")
    >>> currents.extinction < 0.02, bool(currents.error([(0, 1, 0)])[0] < 0.05)
    (True, True)
    """
    kind = scalar_boundary(boundary)
    k = checked(wavenumber, 2)
    d = fan.line.direction
    lit, shadow = lit_nodes(fan.body, fan.line, k), ray_nodes(fan, k, kind)
    wave = np.exp(1j * k * (lit.points @ d))
    orders = []
    for order in (2, 1):
        bright = wave * lit_currents(lit.cosine, lit.along, lit.across, lit.rate, lit.bend, k, kind, order)
        dark = surface_waves(shadow.rays, k, kind, order)
        # on a caustic of the body the current is infinite and its weight 0
        orders.append(np.concatenate([bright, np.where(np.isfinite(dark), dark, 0.0)]))
    return SurfaceCurrents(
        body=fan.body,
        direction=d,
        points=np.concatenate([lit.points, shadow.rays.points]),
        normals=np.concatenate([lit.normals, shadow.normals]),
        weights=np.concatenate([lit.weights, shadow.weights]),
        values=orders[0],
        change=orders[0] - orders[1],
        lit=np.arange(len(orders[0])) < len(wave),
        unserved=1.0 - float(fan.line.fractions["attached"]),
        wavenumber=k,
        boundary=kind,
    )


def _rms(values: ComplexArray) -> float:
    return float(np.sqrt(np.mean(np.abs(values) ** 2))) if len(values) else np.nan
