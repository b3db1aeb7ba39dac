"""The field of a body by its integral equation alone: for as many incidences as there are, no creeping ray is needed.

Tiles of the body (`creeping.field.equation.tiles`), the matrix of the equation on two surfaces
(`creeping.field.equation.matrix`), GMRES for all incidences together, and what the currents radiate. Edges and tips
diffract as they do: the equation knows them. What the currents leave of the incident wave inside the body is their
error (`creeping.field.currents.whole_body`).

Sources: [CK13, sec. 3.2 and 6.2], [SS86]; Derivations, F36.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property

import numpy as np

from creeping._typing import Any, ArrayLike, ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.arguments import checked, checked_plain, observers_of
from creeping.field.boundary import CONDUCTOR, Boundary, BoundaryLike, boundary_name, scalar_boundaries
from creeping.field.currents.far_sum import far_by_currents
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.field.equation.charge import charges
from creeping.field.equation.columns import TOGETHER, is_dense, solved_columns
from creeping.field.equation.currents import ON_BODY, ConductorTileCurrents, TileCurrents, lit_ground, twice_incident
from creeping.field.equation.matrix import EACH, VECTOR, Matrix
from creeping.field.equation.tiles import Tiles, tiles_of
from creeping.field.far_result import FarField
from creeping.field.point_result import FieldStatus, NearField, SurfaceField, judged
from creeping.field.polarisation import spherical_frame
from creeping.geodesics.bundle import as_points
from creeping.geometry.covering import patches_of
from creeping.geometry.directions import unit_directions
from creeping.geometry.surface import Surface, size
from creeping.geometry.unit import unit_of
from creeping.kernels.threads import thread_count
from creeping.storage.memory import within_budget

PRODUCTS = 25
"""Products with the matrix, about, that an incidence takes."""
PER_NODE, NEAR_VECTOR = 5e-4, 2.0
"""Seconds of a core that integrals over tiles near to a node take, and what those of a conductor take of that."""
PER_ENTRY = 4e-10
"""Seconds of an entry of the matrix in a product with one of several columns."""
SUM, SUM_VECTOR = 1e-5, 4e-5
"""Seconds of a node in a split sum for one column."""
SECONDS = 30.0
"""What the equation may take, unless the caller says."""
TOUCHING = 1e-6
"""Distance from the body, in its sizes, up to which a point is on it."""


def solve(
    body: Surface,
    directions: ArrayLike,
    *,
    wavenumber: float,
    boundary: BoundaryLike,
    seconds: float = SECONDS,
    progress: Callable[[str], None] | None = None,
) -> Solution:
    """The field that a body scatters, by its integral equation: no shadow line and no rays are needed.

    Parameters
    ----------
    body : Surface
        Smooth, or of pieces with edges, joints and tips.
    directions : (3,) or (m, 3)
        Of incidence; need not be unit. All are solved together.
    wavenumber : float, 1/L
    boundary : "soft", "hard", "pec" or ImpedanceBoundary
    seconds : float
        What it may take, about, with all cores; more is refused before it starts.
    progress : callable, optional
        Is told in words what is done, with the number of nodes, the time and the memory that it takes.

    Returns
    -------
    Solution

    Raises
    ------
    InvalidInputError
        On bad arguments, for a weighted body, and if it would take more time or memory than it may.
    SurfaceError
        If the body has no mesh.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> solution = cr.solve(sc.Cylinder(1.0, 2.0), (1, 0, 0), wavenumber=3.0, boundary="hard")
    >>> far = solution.far_field([(1, 0, 0), (-1, 0, 0)])
    >>> far.method.tolist(), bool(far.error.max() < 0.01 * abs(far.total).max())
    (['equation', 'equation'], True)
    """
    checked_plain(body)
    kinds = scalar_boundaries(boundary)
    k = checked(wavenumber, 2)
    d = unit_directions(directions, "directions of incidence").reshape(-1, 3)
    tell = progress or (lambda words: None)
    kind = CONDUCTOR if len(kinds) == 2 else kinds[0]
    tiles = tiles_of(patches_of(body), k, kind)
    takes, memory = cost(len(tiles.points), kind, len(d))
    told = f"{len(tiles.points)} nodes, about {takes:.2g} s and {memory / 1e9:.2g} GB"
    if takes > seconds:
        raise InvalidInputError(
            f"the integral equation at wavenumber {k:g} has {told}, more than the {seconds:g} s that it may take; "
            "give seconds=, or a lower wavenumber, or let rays serve (creeping.far_field)"
        )
    what = f"the integral equation between {len(tiles.points)} nodes for {len(d)} incidences"
    within_budget(memory, what, "lower the wavenumber or give fewer")
    tell(f"{told}: integrals between the nodes")
    return Solution(body, d, k, boundary, kind, tiles, tell)


def cost(nodes: int, boundary: Boundary, incidences: int) -> tuple[float, float]:
    """Seconds and bytes, about, that the equation between nodes takes, of one incidence or of several."""
    vector = boundary.kind == "conductor"
    columns = incidences * (2 if vector else 1)
    # of incidences their values and changes, and what GMRES keeps
    kept = 64.0 * nodes * incidences * (6 if vector else 1) + TOGETHER
    near = 2 * nodes * PER_NODE * (NEAR_VECTOR if vector else 1.0)
    if is_dense(nodes, boundary):
        entries = float(nodes) ** 2 * (4 if vector else 1)
        pairs = 2 * float(nodes) ** 2 * EACH * (VECTOR if vector else 1.0)
        products = PRODUCTS * entries * PER_ENTRY * columns
        # the matrix and its transpose
        return (pairs + near + products) / thread_count(), 16 * entries + kept
    each, memory = (SUM_VECTOR, 2e4 * 4) if vector else (SUM, 2e4)
    return near / thread_count() + PRODUCTS * columns * each * nodes, memory * nodes + kept


class Solution:
    """What `solve` found: currents of the whole body for m incidences, and the fields that they give.

    Attributes
    ----------
    body : Surface
    directions : (m, 3)
        Of incidence.
    wavenumber : float, 1/L
    boundary : "soft", "hard", "pec" or ImpedanceBoundary
    nodes : int
    steps : int
        Of GMRES.
    left : (m,) or (m, 2)
        What is left of the equation, as a share of its right side.

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
        tiles: Tiles,
        tell: Callable[[str], None],
    ) -> None:
        self.body, self.directions, self.wavenumber, self.boundary = body, directions, wavenumber, boundary
        self._kind, self._matrix = kind, Matrix(tiles, wavenumber, kind)
        self.nodes = len(tiles.points)
        matrix = self._matrix
        magnetic = np.swapaxes(np.cross(directions[:, None], spherical_frame(directions)), 1, 2)
        right, under = (
            twice_incident(kind, places, directions, wavenumber, magnetic) for places in (matrix.nodes, matrix.inner)
        )
        found = solved_columns(matrix, right, under, tell)
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
                lit=lit_ground(self.body, tiles.points, tiles.normals, d),
                rim=np.zeros((0, 3)),
                rim_length=0.0,
                unserved=0.0,
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
        """Far field of one incidence in directions (..., 3), which need not be unit, with its error."""
        return self._far(observers_of(observation), self.currents(incidence))

    def _far(self, r: FloatArray, currents: SurfaceCurrents) -> FarField:
        return far_by_currents(currents, r, self.boundary)

    def backscatter(self) -> FarField:
        """Far field of each incidence back to where it comes from, in directions -d (m,)."""
        each = [self._far(-d[None], self.currents(number)) for number, d in enumerate(self.directions)]
        first = each[0]
        lanes = ("directions", "creeping", "reflected", "forward", "method", "unresolved", "error")
        joined: dict[str, Any] = {name: np.concatenate([getattr(one, name) for one in each]) for name in lanes}
        return replace(first, **joined)

    def near_field(self, points: ArrayLike, incidence: int = 0) -> NearField:
        """Field u at points (..., 3), L, outside the body at any distance from it, of one incidence.

        Raises
        ------
        InvalidInputError
            If points are inside the body, and of a conductor.
        """
        self._scalar("near_field")
        y = as_points(points)
        x = y.reshape(-1, 3)
        inside = np.flatnonzero(self.body.level(x) < 0)
        currents = self.currents(incidence)
        off = self._matrix.tiles.located(x)[3]
        on = off < TOUCHING * size(self.body)
        inside = inside[off[inside] > TOUCHING * size(self.body)]
        if len(inside):
            raise InvalidInputError(
                f"{len(inside)} of {len(x)} points are inside the body (deepest: row "
                f"{inside[np.argmax(off[inside])]}, {off[inside].max():.3g}); give points on it or outside"
            )
        incident, scattered = np.exp(1j * self.wavenumber * (x @ currents.direction)), np.zeros(len(x), dtype=complex)
        scattered[~on] = currents.scattered(x[~on])
        if np.any(on):
            total = 0.0 if self._kind.kind == "soft" else currents.on_body(x[on]).values
            scattered[on] = total - incident[on]
        error = np.full(len(x), ON_BODY * currents.extinction)
        close = np.flatnonzero(currents.next_to(x))
        if len(close):
            error[close] = currents.error_next_to(x[close])
        lanes = self._lanes(y, incident + scattered, error, 1.0)
        shape = y.shape[:-1]
        nothing = np.zeros(shape, dtype=complex)
        return NearField(
            **lanes, incident=incident.reshape(shape), scattered=scattered.reshape(shape), creeping=nothing
        )

    def surface_field(self, points: ArrayLike, incidence: int = 0) -> SurfaceField:
        """Field u, or du/dn of a soft body, at the places of the body nearest to points (..., 3), L, of one incidence.

        Raises
        ------
        InvalidInputError
            Of a conductor.
        """
        self._scalar("surface_field")
        y = as_points(points)
        currents, unit = self.currents(incidence), self.wavenumber if self._kind.kind == "soft" else 1.0
        found = currents.on_body(y)
        lanes = self._lanes(y, found.values, found.error, unit)
        lit, nothing = found.lit.reshape(y.shape[:-1]), np.zeros_like(lanes["values"])
        return SurfaceField(
            **lanes, lit=np.where(lit, lanes["values"], nothing), creeping=np.where(lit, nothing, lanes["values"])
        )

    def _scalar(self, name: str) -> None:
        """Refuse a conductor."""
        if self._kind.kind == "conductor":
            other = "conductor_current" if name == "surface_field" else "conductor_field"
            raise InvalidInputError(f"{name} is of scalar fields; a conductor's are by creeping.{other}")

    def _lanes(self, points: FloatArray, values: ComplexArray, error: FloatArray, unit: float) -> dict[str, Any]:
        """What fields at points (..., 3) have in common."""
        shape = points.shape[:-1]
        by = np.full(len(values), "extinction")
        status = judged(np.full(len(values), int(FieldStatus.OK)), values, error, by, unit)
        return {
            "points": points.copy(),
            "values": values.reshape(shape),
            "error": error.reshape(shape),
            "error_by": by.reshape(shape),
            "status": status.reshape(shape),
            "method": np.full(shape, "equation"),
            "wavenumber": self.wavenumber,
            "boundary": boundary_name(self.boundary),
            "order": 2,
            "length_unit": unit_of(self.body),
        }
