"""The field of one unit point source on a hard body at many points of the body: a row of the coupling of ports.

    u(x) = sum over geodesics from the source, or beams, as in `creeping.field.ports.couplings`

Only the source sends a fan, so that the cost grows with the number of points and not with its square.

Sources: [PW81], [P82]; Derivations, F25.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from creeping._typing import ArrayLike, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.boundary import BoundaryLike, boundary_name
from creeping.field.ports.couplings import CLOSEST, checked_wave, port_geodesics
from creeping.field.ports.sums import port_sums
from creeping.field.ports.tensor import path_waves
from creeping.field.results.labelled import power
from creeping.field.results.point_result import FieldStatus, PointField, point_dataset
from creeping.geodesics.states import as_points, on_body
from creeping.geometry.checks import unit_of
from creeping.geometry.surface import Surface, size
from creeping.rays.reach import AUTO

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True, eq=False, repr=False)
class PortField(PointField):
    """Field on a hard body of a unit source e^{ikr}/(4 pi r) on the body; usable as the array of its values.

    Attributes
    ----------
    points, values, error, error_by, status, method, wavenumber, boundary, order, validity, length_unit
        Shared by all fields at points, see `creeping.field.results.point_result.PointData`. Values and error, 1/L,
        are infinite at the source. ``method`` is "rays", "beams" near caustics, or "none" at the source.
    source : (3,), L
        Position of the source.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> u = cr.port_field(sc.Sphere(), (0, 0, 1), [(1, 0, 0), (0, 0.6, -0.8)], wavenumber=30.0)
    >>> u.shape, u.unit, u.status_counts
    ((2,), '1/L', {'OK': 2})
    """

    source: FloatArray

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return power(self.length_unit, -1)

    def to_xarray(self) -> xarray.Dataset:
        """``xarray.Dataset`` of values, error and status, one row per point."""
        return point_dataset(self, {"total": self.values}).assign_attrs(source=self.source.tolist())


def port_field(
    body: Surface,
    source: ArrayLike,
    points: ArrayLike,
    *,
    wavenumber: float,
    boundary: BoundaryLike = "hard",
    order: int = 2,
    length: float | Literal["auto"] = AUTO,
) -> PortField:
    """Field on a hard body of a unit point source e^{ikr}/(4 pi r) on the body: `coupling` of one port with many.

    Parameters
    ----------
    body : Surface
        Smooth and not weighted (without ``speed``).
    source : (3,), L
        On the body.
    points : (..., 3), L
        On the body.
    wavenumber : float, 1/L
    boundary : "hard"
    order : 2 or 1
    length : float or "auto", L
        Length up to which geodesics are traced, as for `coupling`.

    Returns
    -------
    PortField
        `creeping.plotting.coupling_picture` draws it over the whole body.

    Raises
    ------
    InvalidInputError
        On points off the body, a bad wavenumber, boundary, order or length, and for a weighted body or one with edges.
    SurfaceError
        If geodesics cannot be traced on the body.

    Examples
    --------
    The same as the entry of `coupling`.

    >>> import creeping as cr
    >>> import scatterers as sc
    >>> egg, ports = sc.Ellipsoid(1.2, 1.0, 0.8), [(1.2, 0, 0), (0, 1, 0)]
    >>> u = cr.port_field(egg, ports[0], ports[1:], wavenumber=30.0)
    >>> bool(abs(u[0] - cr.coupling(egg, ports, wavenumber=30.0)[0, 1]) < 1e-12)
    True
    """
    k = checked_wave(body, wavenumber, order, "ports", boundary)
    start, given = as_points(source), as_points(points)
    if start.shape != (3,):
        raise InvalidInputError(f"source has shape {start.shape}; give one point (3,)")
    x0, x = on_body(body, start[None])[0], on_body(body, given).reshape(-1, 3)
    count = len(x)
    values, error = np.full(count, np.inf, dtype=complex), np.full(count, np.inf)
    status, method = np.full(count, int(FieldStatus.CAUSTIC)), np.full(count, "none", dtype="<U5")
    away = np.linalg.norm(x - x0, axis=1) > CLOSEST * size(body)
    if np.any(away):
        rays = port_geodesics(body, np.concatenate([x0[None], x[away]]), k, length, sources=1)
        found = port_sums(path_waves(rays, ("point", "point"), rays.normals, k, order))
        values[away], error[away] = found.values[0, 1:], found.error[0, 1:]
        status[away], method[away] = found.status[0, 1:], found.method[0, 1:]
    shape = given.shape[:-1]
    return PortField(
        points=given.copy(),
        values=values.reshape(shape),
        error=error.reshape(shape),
        error_by=np.full(shape, "expansion"),
        status=status.reshape(shape),
        method=np.reshape(method, shape),
        source=x0,
        wavenumber=k,
        boundary=boundary_name(boundary),
        order=order,
        length_unit=unit_of(body),
    )
