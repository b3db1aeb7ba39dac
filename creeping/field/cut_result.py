"""The total field on a plane cut through a body: a rectangle of points, and the field at those outside the body.

    x = point + a e_1 + b e_2,   a along ``across``, b along ``up``

Sources: Derivations, F17 and F26.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from creeping._presenting import Drawn, brief
from creeping._typing import Any, ArrayLike, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.field.arguments import PLAIN, checked, checked_plain
from creeping.field.boundary import BoundaryLike
from creeping.field.equation.solution import Solution
from creeping.field.near import conductor_field, near_field
from creeping.field.results.conductor_result import ConductorField
from creeping.field.results.point_result import FieldStatus, NearField
from creeping.field.routes import TRUST, affordable
from creeping.geometry.arguments import number_between, one_of, positive_number, real_array
from creeping.geometry.directions import unit_direction
from creeping.geometry.surface import Surface, inside, project
from creeping.rays.fan import RayFan
from creeping.shadow.line import ShadowLine

if TYPE_CHECKING:
    import xarray

INSIDE = -1
"""Status on the grid where there is no field."""

ENOUGH, MOST = 60_000, 400_000
"""Points of a cut that is given no step, and of any."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class CutGrid:
    """Points of a cut before their field is known; attributes as of `FieldCut`."""

    direction: FloatArray
    point: FloatArray
    axes: FloatArray
    across: FloatArray
    up: FloatArray
    outside: BoolArray
    wavenumber: float

    @property
    def points(self) -> FloatArray:
        """Grid points (ny, nx, 3), L."""
        return grid_points(self.point, self.axes, self.across, self.up)

    @property
    def step(self) -> float:
        """Larger of the two grid spacings, L."""
        return float(max(self.across[1] - self.across[0], self.up[1] - self.up[0]))


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class FieldCut(CutGrid, Drawn):
    """Field on a rectangular grid (ny, nx) in a plane.

    Attributes
    ----------
    body : Surface
    direction : (3,)
        Direction of incidence.
    line : ShadowLine or None
        Shadow line of the incidence; None for a cut of a `Solution`.
    point : (3,), L
        Origin of ``across`` and ``up``.
    axes : (2, 3)
        Orthogonal unit vectors along ``across`` and ``up``.
    across, up : (nx,) and (ny,), L
        Coordinates of the grid points.
    outside : (ny, nx) bool
        Whether each grid point is outside the body.
    wavenumber : float, 1/L
    field : NearField or ConductorField
        Field at the m points outside the body, row by row.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> line = cr.shadow_line(ball, direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, length=3.2, n_rays=24)
    >>> cut = cr.field_cut(fan, wavenumber=8.0, boundary="hard", extent=(3.0, 3.0), step=0.5)
    >>> cut.points.shape, cut.axes.round(6).tolist(), cut.status_counts
    ((7, 7, 3), [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]], {'OK': 40})
    >>> bool(abs(cut.wave()[4, 5]) < abs(cut.wave()[4, 1])), int((~cut.outside).sum())         # dark, lit
    (True, 9)
    """

    body: Surface
    line: ShadowLine | None
    field: NearField | ConductorField

    @property
    def quantities(self) -> tuple[str, ...]:
        """Quantities that `wave` and `magnitude` accept: "u", or "E" and "H" for a conductor."""
        return ("E", "H") if isinstance(self.field, ConductorField) else ("u",)

    @property
    def error(self) -> FloatArray:
        """Error of the field (ny, nx), NaN inside the body."""
        return np.asarray(self.on_grid(self.field.error))

    @property
    def status(self) -> IntArray:
        """Codes of `FieldStatus` (ny, nx), -1 inside the body."""
        return np.asarray(self.on_grid(self.field.status, INSIDE))

    @property
    def status_counts(self) -> dict[str, int]:
        """Number of points outside the body by name of status; only statuses that occur."""
        return self.field.status_counts

    def on_grid(self, values: Any, inside: Any = np.nan) -> Any:
        """Place values (m, ...) of the outside points on the grid (ny, nx, ...); fill the interior with ``inside``.

        Raises
        ------
        InvalidInputError
            If the number of values is not m.
        """
        given = np.asarray(values)
        if len(given) != len(self.field.points):
            raise InvalidInputError(f"{len(given)} values for {len(self.field.points)} points outside; give one each")
        found = np.full((*self.outside.shape, *given.shape[1:]), inside, dtype=given.dtype)
        found[self.outside] = given
        return found

    def wave(self, quantity: str | None = None) -> ComplexArray:
        """Complex field (ny, nx), NaN inside the body: u, or the component of E or H along the incident E or H."""
        chosen = self._chosen(quantity)
        if isinstance(self.field, NearField):
            return np.asarray(self.on_grid(self.field.values, complex(np.nan, np.nan)))
        own = self.field.incident_electric / np.linalg.norm(self.field.incident_electric)
        if chosen == "H":
            own = np.cross(self.direction, own)
        return np.asarray(self.on_grid(np.einsum("nc,c->n", getattr(self.field, chosen), own.conj())))

    def magnitude(self, quantity: str | None = None) -> FloatArray:
        """|u|, |E| or |H| (ny, nx), NaN inside the body."""
        chosen = self._chosen(quantity)
        if isinstance(self.field, NearField):
            return np.abs(self.wave())
        return np.asarray(self.on_grid(np.linalg.norm(getattr(self.field, chosen), axis=-1)))

    def shadow_points(self) -> FloatArray:
        """Intersections of the shadow line, if any, with the rectangle: (n, 2), L, coordinates across and up."""
        found = [np.zeros((0, 2))]
        normal = np.cross(*self.axes)
        for curve in self.line.curves if self.line else ():
            nodes = np.concatenate([curve.points, curve.points[:1]]) if curve.closed else curve.points
            height = (nodes - self.point) @ normal
            at = np.flatnonzero(height[:-1] * height[1:] < 0)
            share = (height[at] / (height[at] - height[at + 1]))[:, None]
            crossing = project(self.body, (1 - share) * nodes[at] + share * nodes[at + 1])
            touching = nodes[:-1][height[:-1] == 0]
            found.append((np.concatenate([crossing, touching]) - self.point) @ self.axes.T)
        flat = np.concatenate(found)
        low, high = (np.array([self.across[end], self.up[end]]) for end in (0, -1))
        return np.asarray(flat[np.all((flat >= low) & (flat <= high), axis=1)])

    def to_xarray(self) -> xarray.Dataset:
        """``xarray.Dataset`` of field, parts, error and status over ``up`` and ``across``; NaN inside the body."""
        flat, dims = self.field.to_xarray(), ("up", "across")
        fill = {"i": INSIDE, "U": ""}
        variables = {
            name: ((*dims, *one.dims[1:]), self.on_grid(one.values, fill.get(one.dtype.kind, np.nan)), one.attrs)
            for name, one in flat.data_vars.items()
        }
        unit = {"units": self.field.length_unit}
        coordinates: dict[str, Any] = {"across": (("across",), self.across, unit), "up": (("up",), self.up, unit)}
        coordinates |= {name: (dims, self.points[..., i], unit) for i, name in enumerate("xyz")}
        kept = {name: one for name, one in flat.coords.items() if "point" not in one.dims}
        vectors = {"point": self.point, "across": self.axes[0], "up": self.axes[1]}
        words = {name: vector.tolist() for name, vector in vectors.items()}
        found: xarray.Dataset = type(flat)(variables, coordinates | kept, flat.attrs | words)
        return found

    def _chosen(self, quantity: str | None) -> str:
        if quantity is None:
            return self.quantities[0]
        if quantity not in self.quantities:
            raise InvalidInputError(f"quantity = {quantity!r} is not one of {', '.join(self.quantities)}")
        return quantity

    def __repr__(self) -> str:
        field, rows = self.field, repr(self.field).splitlines()
        one, other = (f"({', '.join(f'{v:.4g}' for v in axis + 0.0)})" for axis in self.axes)
        return (
            f"FieldCut({len(self.across)} x {len(self.up)} points {self.step:.3g} {field.length_unit} apart, "
            f"k = {field.wavenumber:g}, {field.boundary}, on {brief(self.body)})\n"
            f"  across {one}, up {other}; {np.sum(~self.outside)} points inside\n"
            f"{rows[1]}\n{rows[2]}"
        )


def grid_points(point: FloatArray, axes: FloatArray, across: FloatArray, up: FloatArray) -> FloatArray:
    """Points of a grid (ny, nx, 3), L."""
    return np.asarray(point + across[:, None] * axes[0] + up[:, None, None] * axes[1])


def status_words(cut: FieldCut) -> str:
    """Points outside that are not OK, by status, in words; empty where there are none."""
    return ", ".join(f"{count} {name}" for name, count in cut.status_counts.items() if name != FieldStatus.OK.name)


def field_cut(
    source: RayFan | Solution,
    *,
    wavenumber: float | None = None,
    boundary: BoundaryLike = "soft",
    point: ArrayLike | None = None,
    across: ArrayLike | None = None,
    up: ArrayLike | None = None,
    extent: ArrayLike | None = None,
    step: float | None = None,
    order: int = 2,
    method: str = "auto",
    polarisation: str | ArrayLike | None = None,
    incidence: int = 0,
) -> FieldCut:
    """Total field on a rectangle of a plane, at the points outside the body: `near_field` or `conductor_field`.

    Parameters
    ----------
    source : RayFan or Solution
        A fan long enough to pass where rays leave towards the points; or what `solve` returns, of any body.
    wavenumber : float, 1/L
        For a fan; a solution has its own wavenumber and boundary.
    boundary : "soft", "hard", ImpedanceBoundary or "pec"
    point : (3,), L, optional
        Centre of the rectangle; by default the centre of the body's bounding box.
    across, up : (3,), optional
        Directions that span the plane; ``up`` is made orthogonal to ``across``. By default the direction of the wave,
        and the longest side of the bounding box that is not along that direction.
    extent : (width, height), L, optional
        By default the bounding box plus a margin of 0.75 times its longest side.
    step : float, L, optional
        Grid spacing; by default an eighth of a wavelength. It grows to at most a fifth of a wavelength if `near_field`
        would otherwise find currents too expensive, and further if the grid would exceed 60 000 points.
    order, method
        For a fan, as for `near_field`; on a conductor order 2, and method "auto" or "equation".
    polarisation : "theta", "phi" or (3,) complex, optional
        Polarisation of the incident wave, for a conductor; by default "theta".
    incidence : int
        For a solution, the number of the incidence, from 0.

    Returns
    -------
    FieldCut
        ``plot()`` draws it, `creeping.plotting.field_cut_picture` writes a picture.

    Raises
    ------
    InvalidInputError
        If the directions span no plane, the extent or step is not usable, the grid has more than 400 000 points or lies
        within the body, or for the reasons given at `near_field` and `conductor_field`.
    SurfaceError
        As `near_field`.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), cr.shadow_line(ball, (1, 0, 0)), length=3.0, n_rays=24)
    >>> cut = cr.field_cut(fan, wavenumber=30.0, boundary="pec", extent=(3.0, 2.5), step=0.4, polarisation=(0, 0, 1))
    >>> cut.quantities, cut.magnitude("H").shape, cut.to_xarray()["E"].dims
    (('E', 'H'), (9, 9), ('up', 'across', 'component'))
    >>> solution = cr.solve(sc.Cylinder(1.0, 2.0), (1, 0, 0), wavenumber=3.0, boundary="hard")
    >>> cr.field_cut(solution, step=0.5).status_counts["OK"] > 20
    True
    """
    given = wavenumber, boundary, order, method
    grid = cut_grid(source, *given, point=point, across=across, up=up, extent=extent, step=step, incidence=incidence)
    conductor = (boundary if isinstance(source, RayFan) else source.boundary) == "pec"
    if not conductor and polarisation is not None:
        raise InvalidInputError("polarisation is of a conductor's field; give it with boundary='pec'")
    wave = "theta" if polarisation is None else polarisation
    x, k, line = grid.points[grid.outside], grid.wavenumber, None
    field: NearField | ConductorField
    if isinstance(source, Solution):
        field = source.conductor_field(x, incidence, wave) if conductor else source.near_field(x, incidence)
    else:
        line = source.line
        field = (
            conductor_field(source, x, wavenumber=k, polarisation=wave, method=method)
            if conductor
            else near_field(source, x, wavenumber=k, boundary=boundary, order=order, method=method)
        )
    return FieldCut(body=source.body, line=line, field=field, **vars(grid))


def cut_grid(
    source: RayFan | Solution,
    wavenumber: float | None = None,
    boundary: BoundaryLike = "soft",
    order: int = 2,
    method: str = "auto",
    *,
    point: ArrayLike | None = None,
    across: ArrayLike | None = None,
    up: ArrayLike | None = None,
    extent: ArrayLike | None = None,
    step: float | None = None,
    incidence: int = 0,
) -> CutGrid:
    """Points at which `field_cut` would compute the field; arguments, errors as there.

    Examples
    --------
    >>> import creeping as cr, scatterers as sc
    >>> fan = cr.launch(cr.DirectFlow(sc.Sphere(), rtol=1e-6), cr.shadow_line(sc.Sphere(), (1, 0, 0)), n_rays=16)
    >>> grid = cut_grid(fan, wavenumber=8.0, extent=(3.0, 3.0), step=0.5)
    >>> grid.outside.shape, int(grid.outside.sum())
    ((7, 7), 40)
    """
    if isinstance(source, Solution):
        if wavenumber is not None or (boundary, order, method) != ("soft", 2, "auto"):
            raise InvalidInputError("a solution has its own wavenumber, boundary and method; leave them out")
        k, weight = source.wavenumber, 0.0
        if isinstance(incidence, float) or not 0 <= incidence < len(source.directions):
            raise InvalidInputError(f"incidence = {incidence}: the solution has {len(source.directions)}, from 0")
        direction = source.directions[incidence]
    else:
        one_of(source, "source", RayFan, "creeping.launch, or give what creeping.solve returns")
        k, weight = _checked(source, wavenumber, boundary, order, method)
        direction = source.line.direction
    body = source.body
    box = np.asarray(body.bounds, dtype=float)
    middle = 0.5 * (box[0] + box[1]) if point is None else real_array(point, "point")
    if middle.shape != (3,) or not np.all(np.isfinite(middle)):
        raise InvalidInputError(f"point has shape {middle.shape}; give three finite coordinates")
    axes = _axes(direction, across, up, box[1] - box[0])
    sides = _sides(extent, axes, box)

    def enough(spacing: float) -> bool:
        fan = source if isinstance(source, RayFan) and method == "auto" else None
        return fan is None or affordable(fan, int(weight * _count(sides, spacing)), k)

    # no further apart than the spacing, the middle among them
    spacing = _spacing(sides, step, k, enough)
    halves = np.maximum(1, np.ceil(0.5 * sides / spacing * (1 - 1e-9))).astype(int)
    a, b = (0.5 * side * np.arange(-half, half + 1) / half for side, half in zip(sides, halves, strict=True))
    shape = len(b), len(a)
    whole = CutGrid(
        direction=direction, point=middle.copy(), axes=axes, across=a, up=b, outside=np.ones(shape, bool), wavenumber=k
    )
    x = whole.points.reshape(-1, 3)
    # NaN of a level is deep inside
    outside = (body.level(x) >= 0 if hasattr(body, "level") else ~inside(body, x)).reshape(shape)
    if not np.any(outside):
        raise InvalidInputError(f"all {outside.size} points are inside the body; give a larger extent")
    return replace(whole, outside=outside)


def _checked(
    fan: RayFan, wavenumber: float | None, boundary: BoundaryLike, order: int, method: str
) -> tuple[float, float]:
    """The wavenumber, and what a point costs in terms of one of a scalar field."""
    checked_plain(fan.body)
    conductor = isinstance(boundary, str) and boundary == "pec"
    if wavenumber is None:
        raise InvalidInputError("the field of a fan needs wavenumber=")
    k = checked(wavenumber, order, fan.body)
    if conductor and (order != 2 or method not in PLAIN):
        raise InvalidInputError("a conductor's field has order 2 and method 'auto' or 'equation'")
    return k, TRUST.vector if conductor else 1.0


def _axes(direction: FloatArray, across: ArrayLike | None, up: ArrayLike | None, box: FloatArray) -> FloatArray:
    """Unit vectors of a plane (2, 3)."""
    one = np.asarray(direction if across is None else unit_direction(across))
    if up is None:
        # within 30 degrees of it an axis spans no plane with a direction
        along = np.abs(one) > np.cos(np.radians(30.0))
        other = np.eye(3)[np.argmax(np.where(along, -1.0, box))]
    else:
        other = np.asarray(unit_direction(up))
        if abs(one @ other) > 1 - 1e-9:
            raise InvalidInputError(f"across and up are both along ({', '.join(f'{v:.4g}' for v in one)}); turn one")
    other = other - (one @ other) * one
    return np.stack([one, other / np.linalg.norm(other)])


def _sides(extent: ArrayLike | None, axes: FloatArray, box: FloatArray) -> FloatArray:
    """Width and height of the rectangle (2,), L."""
    if extent is None:
        edges = box[1] - box[0]
        # three quarters of its longest side beside the body
        return np.asarray(np.abs(axes) @ edges + 1.5 * float(edges.max()))
    sides = real_array(extent, "extent")
    if sides.shape != (2,) or not (np.all(np.isfinite(sides)) and np.all(sides > 0)):
        raise InvalidInputError(f"extent = {extent!r}: give a width and a height, positive and finite")
    return sides


def _count(sides: FloatArray, spacing: float) -> float:
    return float(np.prod(sides / spacing + 1))


def _spacing(sides: FloatArray, step: float | None, k: float, enough: Callable[[float], bool]) -> float:
    """Spacing of points, L, at which currents are not too expensive, if one is: ``enough``."""
    if step is not None:
        given = positive_number(step, "step")
        if _count(sides, given) > MOST:
            least = float(np.sqrt(np.prod(sides) / MOST))
            raise InvalidInputError(
                f"step = {given:g} makes {_count(sides, given):.3g} points; {MOST} are the most: "
                f"give {1.01 * least:.2g} or more, or a smaller extent"
            )
        return number_between(given, "step", 0.0, float(np.min(sides)))
    wavelength = 2 * np.pi / k
    # eight points a wavelength; down to five where more would cost too much
    spacing = wavelength / 8
    while spacing < wavelength / 5 and not enough(spacing):
        spacing = min(1.1 * spacing, wavelength / 5)
    if _count(sides, spacing) > ENOUGH:
        spacing = float(np.sqrt(np.prod(sides) / ENOUGH)) * 1.01
    # a few points even where the wave is longer than the rectangle
    return min(spacing, 0.125 * float(np.min(sides)))
