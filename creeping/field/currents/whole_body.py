"""Currents of the whole body: what a plane wave excites on it, by the lit side's and the creeping rays' expansions.

    hard, impedance   u, with du/dn = -ik eta u
    soft              du/dn, with u = 0
    conductor         n x H (`creeping.field.currents.conductor`)

and what they say of their own error: currents that are exact cancel the incident wave everywhere inside the body, so
what they leave of it there, rms, is epsilon, their error. With f_rms^2 = Im f(d)/k by the optical theorem, the mean of
|f|^2 over all directions of a body that absorbs nothing, and f' what the second order adds to f, by rays and by the lit
side apart, epsilon' what f' leaves inside,

    error(r) = epsilon [(2.5 f_rms)^2 (1 + 0.3 max(0, S - 1)) + |f|^2 + (2 |f'|(r)/epsilon')^2]^(1/2)
    |f'|^2 = |f'_lit|^2 + |f'_rays|^2,   S(r) = |closed integral of e^{ik(d - r).x} dl|^2/(pi l/k)

S is for what is wrong next to the shadow line, of length l: where the line lies in one phase, ahead and back along an
axis of symmetry, it adds up; over all directions S is 1 in the mean. |f| itself is large ahead, and with it what a
relative error of all currents gives.

It is meant to hold in 95 of 100 directions; both factors were set so on four bodies. A conductor has 2.8 and 2.3 in
their place, since epsilon is smaller beside the true error there.

Also here: the total field at points off the body by currents, with its error.

With epsilon what currents leave of the incident wave inside the body, epsilon' what u', of second order, leaves there,
R the distance from the body's middle and f_rms the rms of the far field,

    error = epsilon [(L s)^2 + (S |u'|/epsilon')^2]^(1/2),   |u'|^2 = |u'_lit|^2 + |u'_rays|^2
    s = [1 + (R/f_rms)^2]^(-1/2) in the light,   s = [1 + (R/(k f_rms^2))^2]^(-1/2) in the shadow

since the scattered field is f_rms/R, rms over all directions, and f(d)/R = k f_rms^2/R at most, straight ahead, where
it is no more than the incident wave itself.

Sources: [F46], [LK59], [CK13, sec. 3.2]; Derivations, F16 and F17; [CK13, sec. 3.2]; Derivations, F17 and F20. L and S
were set on four bodies (`studies.accuracy.point_coverage`).
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from creeping._progress import say
from creeping._typing import Any, ArrayLike, BoolArray, ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.arguments import UNRESOLVED, observers_of
from creeping.field.boundary import Boundary, BoundaryLike, boundary_name
from creeping.field.currents.radiation import far_of_scalar, field_of_scalar, phase_sums, received
from creeping.field.results.far_result import FarField
from creeping.geodesics.states import as_points
from creeping.geometry.checks import unit_of
from creeping.geometry.quadrature import body_nodes, inner_points
from creeping.geometry.surface import Surface
from creeping.storage.parts import Keeping, not_kept

DEPTH = 0.25
"""Least depth, in wavelengths, of the points inside at which currents are tested: nearer the sums over nodes err."""
SHALLOW = 0.12
"""Least depth where the body is too thin for that."""
POINTS = 100
"""Points inside at which currents are tested."""
OFF = 0.25
"""Least distance from the body, in wavelengths, at which currents are valid."""


@dataclass(frozen=True, eq=False, repr=False)
class SurfaceCurrents:
    """Surface currents of the whole body at quadrature nodes.

    Attributes
    ----------
    body : Surface
    direction : (3,)
        Direction of incidence d.
    points, normals : (n, 3), L and 1
        Nodes and outward normals.
    weights : (n,), L^2
        Quadrature weights. In the penumbra, where both expansions have nodes, the weights include the blending factor.
    travel : (n, 3)
        Direction in which the phase advances: d on the lit side, the tangent of the ray on creeping rays.
    values : (n,) complex
        Field u, or du/dn (1/L) on a soft boundary. On a conductor (n, 3, 2): n x H for incident waves of unit E along
        theta and phi.
    change : shaped as ``values``
        Second-order part of the values; for solved currents the residual of the equation.
    lit : (n,) of bool
        Whether the lit side's expansion gave the value, rather than creeping rays. For solved currents: whether the
        node is lit.
    wavenumber : float, 1/L
    boundary : Boundary
    rim : (l, 3), L
        Equally spaced points of the shadow line; empty for solved currents.
    rim_length : float, L
        Length of the shadow line.
    unserved : float
        Share of the shadow line that launches no creeping ray; the currents behind that part are missing.
    solved : bool
        Whether the values solve the integral equation on the whole body (`creeping.field.equation`).

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
    travel: FloatArray
    values: ComplexArray
    change: ComplexArray
    lit: BoolArray
    wavenumber: float
    boundary: Boundary
    rim: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    rim_length: float = 0.0
    unserved: float = 0.0
    solved: bool = False
    _factors: ClassVar[tuple[float, float]] = (2.5, 2.0)
    """Factors of the error: of what all directions share, and of what the second order says of each."""
    _levels: ClassVar[tuple[float, float, float]] = (2.0, 4.0, 2.0)
    """L in the light and in the shadow, and S, of the error at points."""
    _least: ClassVar[float] = 0.0
    """What is left inside, at least: points deep inside may know less of what is wrong."""

    def __repr__(self) -> str:
        dark = "in the dark" if self.solved else "on rays"
        return (
            f"SurfaceCurrents({int(self.lit.sum())} lit nodes, {int((~self.lit).sum())} {dark}, "
            f"k = {self.wavenumber:g}, {self.boundary.kind}{', solved' if self.solved else ''})\n"
            f"  {100 * self.unserved:.3g} % of the shadow line launch no ray"
        )

    def part(self, which: BoolArray) -> SurfaceCurrents:
        """Currents at the nodes selected by a mask (n,)."""
        names = ["points", "normals", "weights", "travel", "values", "change", "lit"]
        found: SurfaceCurrents = replace(self, **{name: getattr(self, name)[which] for name in names})
        return found

    def far(self, directions: ArrayLike) -> ComplexArray:
        """Far-field amplitude f, L, in directions (m, 3): (m,)."""
        return self.far_of(np.ones(len(self.lit), dtype=bool), directions)

    def far_of(self, part: BoolArray, directions: ArrayLike) -> ComplexArray:
        """Contribution to `far` of the nodes selected by a mask (n,), L: (m, 3) -> (m,)."""
        return self._radiated(self.values, part, observers_of(directions))

    def scattered(self, points: ArrayLike) -> ComplexArray:
        """Scattered field at points (m, 3), L, at least a quarter of a wavelength off the surface: (m,).

        Raises
        ------
        InvalidInputError
            If a point is nearer to a node than an eighth of a wavelength, where the quadrature fails.
        """
        return self._field(self.values, self._off_the_body(points))

    def _off_the_body(self, points: ArrayLike) -> FloatArray:
        """Points (m, 3), none of them nearer to a node than sums over nodes are integrals."""
        x = as_points(points).reshape(-1, 3)
        wavelength = 2 * np.pi / self.wavenumber
        near, _ = self._nodes.query(x, distance_upper_bound=SHALLOW * wavelength)
        close = np.flatnonzero(np.isfinite(near))
        if len(close):
            raise InvalidInputError(
                f"{len(close)} of {len(x)} points are within {SHALLOW:g} wavelengths of the body "
                f"(first: row {close[0]}); near_field and surface_field give the field there"
            )
        return x

    @property
    def bounces(self) -> bool:
        """Whether `reflected_onto` supports the boundary."""
        return self.boundary.kind in ("soft", "hard", "conductor")

    def reflected_onto(self, points: FloatArray, normals: FloatArray) -> ComplexArray:
        """Field u (du/dn if soft) that nodes radiate onto points (m, 3), L, of the body; normals (m, 3): (m,)."""
        u, slope = self._scalar(self.values)
        nothing = np.zeros(len(self.points), dtype=complex)
        single, double = (nothing if one is None else one / (4 * np.pi) for one in (slope, u))
        nodes = self.points, self.normals
        return received((points, normals), nodes, -single, double, self.wavenumber, soft=self.boundary.kind == "soft")

    @cached_property
    def inner_points(self) -> FloatArray:
        """Interior points at which the residual field is measured (m, 3), L; none if the body is too thin."""
        wavelength = 2 * np.pi / self.wavenumber
        found = (inner_points(self.body, depth * wavelength, POINTS) for depth in (DEPTH, SHALLOW))
        return next((points for points in found if len(points)), np.zeros((0, 3)))

    @cached_property
    def extinction(self) -> float:
        """Extinction error: rms residual field inside, relative to the incident wave; NaN if the body is too thin.

        It estimates the relative rms error of the far field over all directions, within a factor of about 2. For
        solved currents it is at least 2e-5. For a conductor it is the rms over both polarisations.
        """
        return float(np.sqrt(np.mean(self._left**2)))

    @cached_property
    def mean_amplitude(self) -> float:
        """Rms of |f| over all directions, L; an upper bound for a body that absorbs."""
        return float(np.sqrt(np.mean(self._amplitude**2)))

    def error(self, directions: ArrayLike) -> FloatArray:
        """Error of f, L, that covers 95 % of directions: (m, 3) -> (m,), for a conductor (m, 2, 2)."""
        r = observers_of(directions)
        level, shape = self._factors
        lit, dark = (self._radiated(self.change, part, r) for part in (self.lit, ~self.lit))
        change = np.hypot(np.abs(lit), np.abs(dark)) / self._change_inside
        # both polarisations of a scattered wave have a share in its rms
        share = self._amplitude / np.sqrt(1 + np.ndim(self._amplitude))
        along = self._together(r).reshape(-1, *(1,) * (change.ndim - 1))
        error = self._left * np.hypot(np.hypot(level * share * along, np.abs(self.far(r))), shape * change)
        # sums over the nodes of expansions err by as much, of spheres of ka = 100 to 250, however little is left inside
        return np.asarray(np.hypot(error, 0.0 if self.solved else 4e-4 * self._amplitude))

    def total(self, points: FloatArray, dark: BoolArray) -> tuple[ComplexArray, FloatArray]:
        """Total field and its error at points (m, 3), L, off the body; ``dark`` (m,) marks shadow points: (m,) each."""
        lit, shadow, factor = self._levels
        if self.boundary.kind == "impedance":
            # most of what is wrong with its currents stands at the line and radiates ahead
            lit = 1.3
        level = level_at(self, points, dark, self.mean_amplitude, lit, shadow)
        x = self._off_the_body(points)
        # on the lit nodes and on the others, whose second orders count apart
        lit_part, dark_part = (self._parts_of_field(part, x) for part in (self.lit, ~self.lit))
        shape = np.hypot(np.abs(lit_part[1]), np.abs(dark_part[1])) / self._change_inside
        total = self.incident_at(x) + lit_part[0] + dark_part[0]
        return total, self.extinction * np.hypot(level, factor * shape)

    def incident_at(self, points: FloatArray) -> ComplexArray:
        """The incident wave at points (m, 3), L: (m,)."""
        return np.asarray(np.exp(1j * self.wavenumber * (points @ self.direction)))

    @cached_property
    def left_of_each(self) -> FloatArray:
        """Extinction error by field (rows) and incident wave (columns), as `extinction`: (1, 1)."""
        return np.array([[self.extinction]])

    def _together(self, directions: FloatArray) -> FloatArray:
        """[1 + 0.3 max(0, S - 1)]^(1/2) in unit directions (m, 3): (m,)."""
        if not len(self.rim):
            return np.ones(len(directions))
        k = self.wavenumber
        wave = np.exp(1j * k * (self.rim @ self.direction))
        step = self.rim_length / len(self.rim)
        S = np.abs(step * phase_sums(self.rim, wave[None], directions, k)[:, 0]) ** 2 / (np.pi * self.rim_length / k)
        return np.sqrt(1 + 0.3 * np.maximum(S - 1, 0.0))

    @cached_property
    def _nodes(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self.points)

    @cached_property
    def _left(self) -> FloatArray:
        """What is left inside of each incident wave, rms, as a share of it: () or (2,)."""
        x = self.inner_points
        return self._at_least(self._rms(self._remainder(x, self._field(self.values, x))))

    def _at_least(self, left: FloatArray) -> FloatArray:
        """What is left inside, no less than is known.

        With what it cannot tell: between nodes an admittance that steps may be another one, exactly solved.
        """
        return np.hypot(np.maximum(left, self._least), self.stepped / (self._factors[0] * self._amplitude))

    @cached_property
    def stepped(self) -> float:
        """Error of f, L, from admittance steps somewhere between nodes: rms sum of k/(4 pi) 2 |u| delta eta dS."""
        if not self.boundary.varies:
            return 0.0
        eta = np.broadcast_to(self.boundary.at(self.points).admittance, (len(self.points),))
        # from a node to the next five; |u| of a wave that comes back is up to 2
        step = np.max(np.abs(eta[self._nodes.query(self.points, 6)[1]] - eta[:, None]), axis=1)
        off = np.where(step > 0.05, step, 0.0) * self.weights * np.abs(self.values)
        return float(self.wavenumber / (4 * np.pi) * np.sqrt(np.sum(off**2) / 12) * 2)

    def _remainder(self, points: FloatArray, scattered: ComplexArray) -> ComplexArray:
        """Incident and scattered field at points (m, 3), L: (m, ...)."""
        wave = np.exp(1j * self.wavenumber * (points @ self.direction))
        return np.asarray(scattered + np.multiply.outer(wave, self._incident))

    @cached_property
    def _change_inside(self) -> FloatArray:
        """Rms inside of what the second order adds, of each incident wave."""
        return self._rms(self._field(self.change, self.inner_points))

    @cached_property
    def _amplitude(self) -> FloatArray:
        """Rms of |f| over all directions, L, of each incident wave."""
        forward = self.far(self.direction[None])[0]
        return np.asarray(np.sqrt(np.abs(forward.imag) / self.wavenumber))

    def _rms(self, field: ComplexArray) -> FloatArray:
        """Rms over points (m, ...), components added, of each incident wave."""
        size = np.abs(field) ** 2
        size = size.sum(axis=1) if size.ndim > 1 else size
        return np.sqrt(np.mean(size, axis=0)) if len(size) else np.full(size.shape[1:], np.nan)

    def _radiated(self, values: ComplexArray, part: BoolArray, directions: FloatArray) -> ComplexArray:
        """f (m, ...) of values (n, ...) on some of the nodes."""
        u, slope = (None if one is None else one[part] for one in self._scalar(values))
        return far_of_scalar((self.points[part], self.normals[part]), u, slope, directions, self.wavenumber)

    def _field(self, values: ComplexArray, points: FloatArray) -> ComplexArray:
        """Field (m, ...) of values (n, ...) at points."""
        return field_of_scalar((self.points, self.normals), *self._scalar(values), points, self.wavenumber)

    def _parts_of_field(self, part: BoolArray, points: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Fields (m, ...) of the values and of their second order on some of the nodes."""
        columns = self._scalar(np.stack([self.values, self.change]))
        u, slope = (None if one is None else one[:, part] for one in columns)
        field = field_of_scalar((self.points[part], self.normals[part]), u, slope, points, self.wavenumber)
        return field[:, 0], field[:, 1]

    @property
    def _incident(self) -> ComplexArray:
        """Amplitude of the incident wave."""
        return np.ones((), dtype=complex)

    def _scalar(self, values: ComplexArray) -> tuple[ComplexArray | None, ComplexArray | None]:
        """u dS and du/dn dS, None for nothing."""
        strength = np.asarray(values * self.weights)
        if self.boundary.kind == "soft":
            return None, strength
        if self.boundary.kind == "hard":
            return strength, None
        return strength, np.asarray(-1j * self.wavenumber * self.boundary.at(self.points).admittance * strength)


def far_enough(body: Surface, wavenumber: float, points: FloatArray, least: float) -> BoolArray:
    """Whether points (n, 3), L, are so far off the body that sums over nodes are integrals: (n,).

    ``least`` is the distance asked for, in wavelengths.

    Raises
    ------
    SurfaceError
        If the wavenumber, 1/L, is too high for any mesh of the body.
    """
    # the nodes of the lit side, on the whole of the body
    return body_nodes(body, 2 * wavenumber).distance(points) > least * 2 * np.pi / wavenumber


def level_at(
    currents: SurfaceCurrents, points: FloatArray, dark: BoolArray, mean: float, lit: float, shadow: float
) -> FloatArray:
    """L s (n,) at points (n, 3), L, with f_rms = ``mean`` and L in the light and the shadow."""
    middle = np.mean(np.asarray(currents.body.bounds, dtype=float), axis=0)
    away = np.linalg.norm(points - middle, axis=1)
    in_shadow = shadow / np.hypot(1, away / (currents.wavenumber * mean**2))
    return np.asarray(np.where(dark, in_shadow, lit / np.hypot(1, away / mean)))


def far_by_currents(
    currents: SurfaceCurrents,
    r: FloatArray,
    boundary: BoundaryLike,
    *,
    left_out: float = 0.0,
    keep: Keeping = not_kept,
) -> FarField:
    """Far field in unit directions (m, 3); its error is that of the currents and ``left_out``, L.

    ``keep`` has each sum over nodes, which takes as long for all directions as for a few.
    """

    def summed(name: str, make: Callable[[], Any]) -> Any:
        say(f"sums over currents, {name}")
        return keep(f"currents-{name}", lambda: {"f": make()})["f"]

    lit = summed("lit", lambda: currents.far_of(currents.lit, r))
    dark = summed("dark", lambda: currents.far_of(~currents.lit, r))
    error = np.hypot(summed("error", lambda: currents.error(r)), left_out)
    largest = np.max(np.abs(np.concatenate([lit + dark, currents.far(currents.direction[None])])))
    off = ~(error < UNRESOLVED * largest)
    return FarField(
        directions=r.copy(),
        total=lit + dark,
        parts={"lit": lit, "dark": dark},
        method=np.full(len(r), "equation" if currents.solved else "currents", dtype="<U16"),
        unresolved=off.any(axis=tuple(range(1, off.ndim))),
        error=error,
        error_by="extinction",
        wavenumber=currents.wavenumber,
        boundary=boundary_name(boundary),
        order=2,
        unit=unit_of(currents.body),
    )
