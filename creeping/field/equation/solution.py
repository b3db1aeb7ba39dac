"""The field of a body by its integral equation alone: for as many incidences as there are, no creeping ray is needed.

Edges and tips diffract as they do: the equation knows them. What the currents leave of the incident wave inside the
body is their error (`creeping.field.currents.whole_body`).

Sources: [CK13, sec. 3.2 and 6.2]; Derivations, F36.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from creeping._typing import Any, ArrayLike, BoolArray, ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.arguments import observers_of
from creeping.field.boundary import Boundary, BoundaryLike, boundary_name
from creeping.field.currents.whole_body import SurfaceCurrents, far_by_currents
from creeping.field.equation.columns import solved_columns
from creeping.field.equation.currents import ConductorTileCurrents, TileCurrents, charges, twice_incident
from creeping.field.equation.effort import FULL, Effort
from creeping.field.equation.matrix import Matrix
from creeping.field.results.conductor_result import ConductorCurrent, ConductorField, vector_near, vector_on_body
from creeping.field.results.far_result import FarField, incident_mix, spherical_frame
from creeping.field.results.point_result import (
    NearField,
    SurfaceField,
    columns_of,
    measured_field,
    scalar_near,
    scalar_on_body,
)
from creeping.field.waves.reflected import plane_reflection
from creeping.geodesics.states import as_points
from creeping.geometry.checks import unit_of
from creeping.geometry.surface import Surface, size
from creeping.geometry.surface import inside as inside_of
from creeping.shadow.attachment import is_lit
from creeping.storage.parts import Keeping, not_kept

TOUCHING = 1e-6
"""Distance from the body, in its sizes, up to which a point is on it."""


class Solution:
    """Solution of the integral equation for m incidences: currents on the whole body, and the fields they radiate.

    Attributes
    ----------
    body : Surface
    directions : (m, 3)
        Directions of incidence.
    wavenumber : float, 1/L
    boundary : "soft", "hard", "pec" or ImpedanceBoundary
    nodes : int
        Number of quadrature nodes.
    steps : int
        Number of GMRES iterations.
    effort : Effort
        Whether coarse tiles were used, and the limit of GMRES iterations.
    left : (m,) or (m, 2)
        Residual of the equation relative to its right-hand side.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> solution = cr.solve(sc.Sphere(), [(1, 0, 0), (0, 0, 1)], wavenumber=2.0, boundary="soft")
    >>> u = solution.near_field([(0, 0, -1.001), (0, 0, 3)], incidence=1)
    >>> u.shape, bool(abs(u.values[0]) < 0.01), solution.backscatter().total.shape
    ((2,), True, (2,))
    """

    def __init__(
        self,
        body: Surface,
        directions: FloatArray,
        wavenumber: float,
        boundary: BoundaryLike,
        kind: Boundary,
        matrix: Matrix,
        tell: Callable[[str], None],
        effort: Effort = FULL,
        keep: Keeping = not_kept,
    ) -> None:
        self.body, self.directions, self.wavenumber, self.boundary = body, directions, wavenumber, boundary
        self._kind, self._matrix = kind, matrix
        self.nodes, self.effort = len(matrix.root), effort
        matrix.many |= len(directions) > 1
        magnetic = np.swapaxes(np.cross(directions[:, None], spherical_frame(directions)), 1, 2)
        right, under = (
            twice_incident(kind, places, directions, wavenumber, magnetic) for places in (matrix.nodes, matrix.inner)
        )
        start = self._optics() if effort.coarse else None
        found = solved_columns(matrix, right, under, tell, keep, start=start, steps=effort.steps)
        self.steps, self.left = found.steps, found.left
        both = np.stack([found.values, found.change])
        if matrix.vector:
            a, b = matrix.nodes.a[:, :, None], matrix.nodes.b[:, :, None]
            # (n, 3, m, 2)
            J = a * both[:, :, 0, None] + b * both[:, :, 1, None]
            both, self.left = J.reshape(2, self.nodes, 3, len(directions), 2), self.left.reshape(-1, 2)
        else:
            both = both[:, :, 0]
        self._values: ComplexArray = both[0]
        self._change: ComplexArray = both[1]

    def _optics(self) -> ComplexArray:
        """Currents of physical optics, as shares of twice the incident wave: (n, m)."""
        x, n = self._matrix.nodes[:2]
        shares = []
        for d in self.directions:
            lit = is_lit(self.body, x, n, d)
            reflected = plane_reflection(np.abs(n @ d), self._kind.at(x))
            shares.append(lit if self._kind.kind in ("soft", "conductor") else lit * 0.5 * (1 + reflected))
        return np.asarray(np.stack(shares, axis=1), dtype=complex)

    def __repr__(self) -> str:
        worst = max(float(self.currents(number).extinction) for number in range(min(len(self.directions), 8)))
        return (
            f"Solution({len(self.directions)} incidences, k = {self.wavenumber:g}, {boundary_name(self.boundary)})\n"
            f"  {self.nodes} nodes, {self.steps} steps; {100 * worst:.2g} % of the incident wave left inside"
        )

    def currents(self, incidence: int = 0) -> TileCurrents | ConductorTileCurrents:
        """Currents of one incidence at the nodes."""
        found = self._made.get(incidence)
        if found is None:
            tiles, d = self._matrix.tiles, self.directions[incidence]
            vector = self._kind.kind == "conductor"
            at = (slice(None),) * (2 if vector else 1) + (incidence,)
            known: dict[str, Any] = {"charges": lambda: self._charges[:, incidence]} if vector else {}
            make: Any = ConductorTileCurrents if vector else TileCurrents
            found = self._made[incidence] = make(
                body=self.body,
                direction=d,
                points=tiles.points,
                normals=tiles.normals,
                weights=tiles.weights,
                travel=np.broadcast_to(d, tiles.points.shape),
                values=self._values[at],
                change=self._change[at],
                lit=is_lit(self.body, tiles.points, tiles.normals, d),
                wavenumber=self.wavenumber,
                boundary=self._kind,
                solved=True,
                matrix=self._matrix,
                **known,
            )
        return found

    @cached_property
    def _charges(self) -> ComplexArray:
        """n.E at the nodes (n, m, 2)."""
        return charges(self._matrix.soft_one, self._values, self.directions)

    @cached_property
    def _made(self) -> dict[int, TileCurrents | ConductorTileCurrents]:
        return {}

    def far_field(self, observation: ArrayLike, incidence: int = 0) -> FarField:
        """Far field of one incidence, given by its number, in directions (..., 3), which need not be unit."""
        return self._far(observers_of(observation), self.currents(incidence))

    def _far(self, r: FloatArray, currents: SurfaceCurrents) -> FarField:
        return far_by_currents(currents, r, self.boundary)

    def backscatter(self) -> FarField:
        """Backscatter: the far field of each incidence d in direction -d, (m,)."""
        each = [self._far(-d[None], self.currents(number)) for number, d in enumerate(self.directions)]
        return FarField.joined(each)

    def near_field(self, points: ArrayLike, incidence: int = 0) -> NearField:
        """Total field u of one incidence at points (..., 3), L, outside the body or on it, at any distance.

        Raises
        ------
        InvalidInputError
            If points are inside the body, or the boundary is "pec".
        """
        self._scalar("near_field")
        y = as_points(points)
        x, currents = y.reshape(-1, 3), self.currents(incidence)
        on = self._on(x)
        total = np.zeros(len(x), dtype=complex)
        total[~on] = currents.incident_at(x[~on]) + currents.scattered(x[~on])
        if np.any(on) and self._kind.kind != "soft":
            total[on] = currents.on_body(x[on]).values
        field = measured_field(total, currents.error_around(x), "equation")
        return scalar_near(field, y, currents.incident_at(x), self._facts)

    def conductor_field(
        self, points: ArrayLike, incidence: int = 0, polarisation: str | ArrayLike | None = None
    ) -> ConductorField:
        """Total E and H of one incidence at points (..., 3), L, outside a conductor or on it, at any distance.

        ``polarisation`` is E0, as for `creeping.conductor_field`; by default both theta and phi.

        Raises
        ------
        InvalidInputError
            If points are inside the body, the polarisation is not usable, or the boundary is not "pec".
        """
        y, single = as_points(points), polarisation is not None
        x, currents = y.reshape(-1, 3), self._polarised("conductor_field", incidence, polarisation)
        on, incident = self._on(x), currents.incident_at(x)
        total = np.empty_like(incident)
        total[~on] = currents.total(x[~on], on[~on])[0]
        if np.any(on):
            found = currents.on_body(x[on])
            n = found.normals[:, :, None]
            charge = currents.charge_on_body(x[on], found.values)[0]
            total[on] = np.concatenate([n * charge[:, None], np.cross(found.values, n, axis=1)], axis=1)
        pairs = zip(columns_of(total), columns_of(currents.error_around(x)), strict=True)
        columns = [measured_field(values, error, "equation") for values, error in pairs]
        facts = self._facts | {"incident_electric": _electric(currents, single)}
        return vector_near(columns, y, incident, facts, single=single)

    def conductor_current(
        self, points: ArrayLike, incidence: int = 0, polarisation: str | ArrayLike | None = None
    ) -> ConductorCurrent:
        """J and n.E of one incidence on a conductor, at the surface points nearest to points (..., 3), L.

        ``polarisation`` is that of `conductor_field`.

        Raises
        ------
        InvalidInputError
            If the polarisation is not usable, or the boundary is not "pec".
        """
        y, single = as_points(points), polarisation is not None
        currents = self._polarised("conductor_current", incidence, polarisation)
        found = currents.on_body(y)
        pairs = zip(columns_of(found.values), columns_of(found.error), strict=True)
        columns = [measured_field(J, error, "equation", lit=found.lit) for J, error in pairs]
        charge = currents.charge_on_body(y, found.values)
        facts = self._facts | {"incident_electric": _electric(currents, single)}
        return vector_on_body(columns, charge, y, facts, single=single)

    def surface_field(self, points: ArrayLike, incidence: int = 0) -> SurfaceField:
        """u, or du/dn on a soft body, of one incidence at the surface points nearest to points (..., 3), L.

        Raises
        ------
        InvalidInputError
            If the boundary is "pec".
        """
        self._scalar("surface_field")
        y, unit = as_points(points), self.wavenumber if self._kind.kind == "soft" else 1.0
        found = self.currents(incidence).on_body(y)
        field = measured_field(found.values, found.error, "equation", lit=found.lit)
        return scalar_on_body(field, y, unit, self._facts)

    def _on(self, x: FloatArray) -> BoolArray:
        """Whether points (m, 3), L, are on the body (m,); none may be inside."""
        tiles = self._matrix.tiles
        inside = np.flatnonzero(tiles.inside(x) if tiles.alone else inside_of(self.body, x))
        off, least = tiles.located(x)[3], TOUCHING * size(self.body)
        inside = inside[off[inside] > least]
        if len(inside):
            raise InvalidInputError(
                f"{len(inside)} of {len(x)} points are inside the body (deepest: row "
                f"{inside[np.argmax(off[inside])]}, {off[inside].max():.3g}); give points on it or outside"
            )
        return np.asarray(off < least)

    def _polarised(self, name: str, incidence: int, polarisation: str | ArrayLike | None) -> ConductorTileCurrents:
        """Currents of a conductor for E0."""
        currents = self.currents(incidence)
        if not isinstance(currents, ConductorTileCurrents):
            other = name.replace("conductor_field", "near_field").replace("conductor_current", "surface_field")
            raise InvalidInputError(f"{name} is of conductors; the {boundary_name(self.boundary)} body has {other}")
        found = currents.polarised(incident_mix(polarisation, currents.direction))
        assert isinstance(found, ConductorTileCurrents)
        return found

    def _scalar(self, name: str) -> None:
        """Refuse a conductor."""
        if self._kind.kind == "conductor":
            other = "conductor_current" if name == "surface_field" else "conductor_field"
            raise InvalidInputError(f"{name} is of scalar fields; a conductor has {other}")

    @property
    def _facts(self) -> dict[str, Any]:
        """What results at points say of it."""
        return {
            "wavenumber": self.wavenumber,
            "boundary": boundary_name(self.boundary),
            "order": 2,
            "length_unit": unit_of(self.body),
        }


def _electric(currents: ConductorTileCurrents, single: bool) -> ComplexArray:
    """E0 (3, p), or (3,) of a single one."""
    return currents.incident_electric[:, 0] if single else currents.incident_electric
