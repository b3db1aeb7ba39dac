"""The total field on a plane cut through a body: a rectangle of points, those outside the body with their field.

    x = point + a e_1 + b e_2,   a along ``across``, b along ``up``

Sources: Derivations, F17 and F26.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from creeping._typing import ArrayLike, BoolArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.arguments import PLAIN, checked, checked_plain
from creeping.field.body_currents import affordable
from creeping.field.boundary import BoundaryLike
from creeping.field.conductor.near import VECTOR, conductor_field
from creeping.field.conductor_result import ConductorField
from creeping.field.cut_result import FieldCut, grid_points
from creeping.field.near import near_field
from creeping.field.point_result import NearField
from creeping.geometry.arguments import number_between, one_of, positive_number, real_array
from creeping.geometry.directions import unit_direction
from creeping.rays.fan import RayFan

FINE, COARSE = 8, 5
"""Points a wavelength where no step is given; the fewer where more would cost too much."""
ENOUGH, MOST = 60_000, 400_000
"""Points of a cut that is given no step, and of any."""
AROUND = 0.75
"""Room beside the body of a cut that is given no extent, in the body's longest side."""
ALONG = np.cos(np.radians(30.0))
"""Cosine from which an axis counts as along a direction, and spans no plane with it."""


def field_cut(
    fan: RayFan,
    *,
    wavenumber: float,
    boundary: BoundaryLike = "soft",
    point: ArrayLike | None = None,
    across: ArrayLike | None = None,
    up: ArrayLike | None = None,
    extent: ArrayLike | None = None,
    step: float | None = None,
    order: int = 2,
    method: str = "auto",
    polarisation: str | ArrayLike | None = None,
) -> FieldCut:
    """Total field on a rectangle of a plane, at the points outside the body: `near_field` or `conductor_field`.

    Parameters
    ----------
    fan : RayFan
        Long enough to pass where rays leave towards the points.
    wavenumber : float, 1/L
    boundary : "soft", "hard", ImpedanceBoundary or "pec"
    point : (3,), L, optional
        In the middle; by default that of the body's box.
    across, up : (3,), optional
        Directions that span the plane. By default that of the wave, and the body's longest side that is not along it;
        ``up`` is taken at right angles to ``across``.
    extent : (width, height), L, optional
        By default the body with 0.75 of its longest side all round.
    step : float, L, optional
        Spacing of points. By default an eighth of a wavelength; coarser, down to a fifth, where currents would cost
        more than `near_field` takes them for, and coarser than that where there would be more than 60 000 points.
    order, method
        As of `near_field`; of a conductor 2, and "auto" or "equation".
    polarisation : "theta", "phi" or (3,) complex, optional
        Of the wave that falls on a conductor, by default "theta".

    Returns
    -------
    FieldCut
        ``plot()`` draws it, `creeping.plotting.field_cut_picture` writes a picture.

    Raises
    ------
    InvalidInputError
        On directions that span no plane, a bad extent or step, one that makes more than 400 000 points, a rectangle
        within the body, and as `near_field` and `conductor_field`.
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
    """
    k, conductor = _checked(fan, wavenumber, boundary, order, method)
    if not conductor and polarisation is not None:
        raise InvalidInputError("polarisation is of a conductor's field; give it with boundary='pec'")
    grid = cut_grid(
        fan,
        wavenumber=k,
        boundary=boundary,
        point=point,
        across=across,
        up=up,
        extent=extent,
        step=step,
        order=order,
        method=method,
    )
    field: NearField | ConductorField
    if conductor:
        wave = "theta" if polarisation is None else polarisation
        field = conductor_field(fan, grid.points, wavenumber=k, polarisation=wave, method=method)
    else:
        field = near_field(fan, grid.points, wavenumber=k, boundary=boundary, order=order, method=method)
    parts = {name: getattr(grid, name) for name in ("point", "axes", "across", "up", "outside")}
    return FieldCut(line=fan.line, field=field, **parts)


@dataclass(frozen=True, eq=False)
class CutGrid:
    """Points of a cut before their field is known.

    Attributes
    ----------
    point, axes, across, up, outside
        As of `FieldCut`.
    points : (m, 3), L
        Those outside the body, in the order of the grid's rows.
    """

    point: FloatArray
    axes: FloatArray
    across: FloatArray
    up: FloatArray
    outside: BoolArray
    points: FloatArray


def cut_grid(
    fan: RayFan,
    *,
    wavenumber: float,
    boundary: BoundaryLike = "soft",
    point: ArrayLike | None = None,
    across: ArrayLike | None = None,
    up: ArrayLike | None = None,
    extent: ArrayLike | None = None,
    step: float | None = None,
    order: int = 2,
    method: str = "auto",
) -> CutGrid:
    """Points at which `field_cut` would compute the field; arguments, errors as there.

    Examples
    --------
    >>> import creeping as cr, scatterers as sc
    >>> fan = cr.launch(cr.DirectFlow(sc.Sphere(), rtol=1e-6), cr.shadow_line(sc.Sphere(), (1, 0, 0)), n_rays=16)
    >>> grid = cut_grid(fan, wavenumber=8.0, extent=(3.0, 3.0), step=0.5)
    >>> grid.outside.shape, grid.points.shape
    ((7, 7), (40, 3))
    """
    k, conductor = _checked(fan, wavenumber, boundary, order, method)
    box = np.asarray(fan.body.bounds, dtype=float)
    middle = 0.5 * (box[0] + box[1]) if point is None else real_array(point, "point")
    if middle.shape != (3,) or not np.all(np.isfinite(middle)):
        raise InvalidInputError(f"point has shape {middle.shape}; give three finite coordinates")
    axes = _axes(fan.line.direction, across, up, box[1] - box[0])
    sides = _sides(extent, axes, box)
    spacing = _spacing(fan, sides, step, k, conductor=conductor, method=method)
    a, b = (_steps(side, spacing) for side in sides)
    points = grid_points(middle, axes, a, b)
    # NaN of a level is deep inside
    outside = np.asarray(fan.body.level(points.reshape(-1, 3)) >= 0).reshape(points.shape[:2])
    if not np.any(outside):
        raise InvalidInputError(f"all {outside.size} points are inside the body; give a larger extent")
    return CutGrid(middle.copy(), axes, a, b, outside, points[outside])


def _checked(fan: RayFan, wavenumber: float, boundary: BoundaryLike, order: int, method: str) -> tuple[float, bool]:
    """The wavenumber, and whether the body is a conductor."""
    one_of(fan, "fan", RayFan, "creeping.launch")
    checked_plain(fan.body)
    conductor = isinstance(boundary, str) and boundary == "pec"
    k = checked(wavenumber, order)
    if conductor and (order != 2 or method not in PLAIN):
        raise InvalidInputError("a conductor's field has order 2 and method 'auto' or 'equation'")
    return k, conductor


def _axes(direction: FloatArray, across: ArrayLike | None, up: ArrayLike | None, box: FloatArray) -> FloatArray:
    """Unit vectors of a plane (2, 3)."""
    one = np.asarray(direction if across is None else unit_direction(across))
    if up is None:
        along = np.abs(one) > ALONG
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
        return np.asarray(np.abs(axes) @ edges + 2 * AROUND * float(edges.max()))
    sides = real_array(extent, "extent")
    if sides.shape != (2,) or not (np.all(np.isfinite(sides)) and np.all(sides > 0)):
        raise InvalidInputError(f"extent = {extent!r}: give a width and a height, positive and finite")
    return sides


def _steps(side: float, spacing: float) -> FloatArray:
    """Places along a side, no further apart than the spacing, the middle among them."""
    half = max(1, int(np.ceil(0.5 * side / spacing * (1 - 1e-9))))
    return np.asarray(0.5 * side * np.arange(-half, half + 1) / half)


def _count(sides: FloatArray, spacing: float) -> float:
    return float(np.prod(sides / spacing + 1))


def _spacing(fan: RayFan, sides: FloatArray, step: float | None, k: float, *, conductor: bool, method: str) -> float:
    """Spacing of points, L."""
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
    spacing = wavelength / FINE
    weight = VECTOR if conductor else 1.0
    while (
        method == "auto"
        and spacing < wavelength / COARSE
        and not affordable(fan, int(weight * _count(sides, spacing)), k)
    ):
        spacing = min(1.1 * spacing, wavelength / COARSE)
    if _count(sides, spacing) > ENOUGH:
        spacing = float(np.sqrt(np.prod(sides) / ENOUGH)) * 1.01
    # a few points even where the wave is longer than the rectangle
    return min(spacing, 0.125 * float(np.min(sides)))
