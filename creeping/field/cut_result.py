"""What a field on a plane is: a grid of points, and the field at those outside the body.

x = point + a e_1 + b e_2,   a along ``across``, b along ``up``

Sources: Derivations, F17 and F26.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from creeping._presenting import Drawn, brief
from creeping._typing import Any, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.field.conductor_result import ConductorField
from creeping.field.point_result import FieldStatus, NearField
from creeping.geometry.surface import Surface, project
from creeping.shadow.line import ShadowLine

if TYPE_CHECKING:
    import xarray

INSIDE = -1
"""Status on the grid where there is no field."""


@dataclass(frozen=True, eq=False, repr=False)
class FieldCut(Drawn):
    """Field on a rectangle (ny, nx) of a plane.

    Attributes
    ----------
    line : ShadowLine
        Of the incidence, and by it the body.
    point : (3,), L
        Where across and up are 0.
    axes : (2, 3)
        Unit vectors, across and up, at right angles.
    across, up : (nx,) and (ny,), L
    outside : (ny, nx) bool
    field : NearField or ConductorField
        At the points outside (m,), in the order of the grid's rows.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> line = cr.shadow_line(ball, direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, length=3.2, n_rays=24)
    >>> cut = cr.field_cut(fan, wavenumber=8.0, boundary="hard", extent=(3.0, 3.0), step=0.5)
    >>> cut.points.shape, cut.axes.round(6).tolist(), cut.status_counts
    ((7, 7, 3), [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]], {'OK': 39, 'UNRESOLVED': 1})
    >>> bool(abs(cut.wave()[4, 5]) < abs(cut.wave()[4, 1])), int((~cut.outside).sum())         # dark, lit
    (True, 9)
    """

    line: ShadowLine
    point: FloatArray
    axes: FloatArray
    across: FloatArray
    up: FloatArray
    outside: BoolArray
    field: NearField | ConductorField

    @property
    def body(self) -> Surface:
        """The body that is cut."""
        return self.line.body

    @property
    def points(self) -> FloatArray:
        """Points of the grid (ny, nx, 3), L."""
        return grid_points(self.point, self.axes, self.across, self.up)

    @property
    def step(self) -> float:
        """Larger spacing of the points, L."""
        return float(max(self.across[1] - self.across[0], self.up[1] - self.up[0]))

    @property
    def quantities(self) -> tuple[str, ...]:
        """What can be shown: "u", or "E" and "H" of a conductor."""
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
        """Number of points outside of each status that occurs, by name."""
        return self.field.status_counts

    def on_grid(self, values: Any, inside: Any = np.nan) -> Any:
        """Put values at the points outside (m, ...) on the grid (ny, nx, ...), another value inside the body.

        Raises
        ------
        InvalidInputError
            If there is not one for each point.
        """
        given = np.asarray(values)
        if len(given) != len(self.field.points):
            raise InvalidInputError(f"{len(given)} values for {len(self.field.points)} points outside; give one each")
        found = np.full((*self.outside.shape, *given.shape[1:]), inside, dtype=given.dtype)
        found[self.outside] = given
        return found

    def wave(self, quantity: str | None = None) -> ComplexArray:
        """Field with its phase (ny, nx), NaN inside: u; of E and H the component that the incident wave has."""
        chosen = self._chosen(quantity)
        if isinstance(self.field, NearField):
            return np.asarray(self.on_grid(self.field.values, complex(np.nan, np.nan)))
        own = self.field.incident_electric / np.linalg.norm(self.field.incident_electric)
        if chosen == "H":
            own = np.cross(self.line.direction, own)
        return np.asarray(self.on_grid(np.einsum("nc,c->n", getattr(self.field, chosen), own.conj())))

    def magnitude(self, quantity: str | None = None) -> FloatArray:
        """|u|, |E| or |H| (ny, nx), NaN inside."""
        chosen = self._chosen(quantity)
        if isinstance(self.field, NearField):
            return np.abs(self.wave())
        return np.asarray(self.on_grid(np.linalg.norm(getattr(self.field, chosen), axis=-1)))

    def shadow_points(self) -> FloatArray:
        """Where the shadow line crosses the plane, within the rectangle: (n, 2), L, across and up."""
        found = [np.zeros((0, 2))]
        normal = np.cross(*self.axes)
        for curve in self.line.curves:
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
        """Field, parts, error and status over ``up`` and ``across``, NaN inside the body: an ``xarray.Dataset``."""
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
