"""Currents at the nodes of a body's tiles, which satisfy its integral equation, and their fields at any distance.

    u(x) = 2 u_inc + M u,   du/dn = 2 du_inc/dn - M* du/dn,   J = 2 n x H_inc + M J        on the body
    u(x) = u_inc + M u/2,   u(x) = u_inc - int du/dn G dS,   n x H = n x H_inc + M J/2      next to it

with the integrals over tiles of `creeping.field.equation.matrix`. Farther off than APART wavelengths fields are sums
over the fine nodes of each tile, where a current is what the polynomial through its own p x p nodes says.

Also here: the charge q = n.E on a conductor whose current is known, and the electric field at any distance from it.

    (1 + M*) q = 2 n.E_inc + 2ik n.int J G dS                             on the body, M* as of soft bodies
    E(x) = E_inc + ik int J G dS - int q grad_x G dS                      off it

since div J = ikq, and since the normal part of the second is q on the body and 0 inside. q so found is no derivative of
J: it holds next to edges and tips, where both grow without bound and differences of J tell nothing.

Sources: [CK13, sec. 3.2 and 6.2]; Derivations, F36; [CK13, sec. 6.3 and 6.4], [TY06].
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np

from creeping._typing import Any, ArrayLike, BoolArray, ComplexArray, FloatArray
from creeping.field.arguments import observers_of
from creeping.field.boundary import Boundary
from creeping.field.currents.conductor import ConductorCurrents
from creeping.field.currents.whole_body import DEPTH, POINTS, SHALLOW, SurfaceCurrents
from creeping.field.equation.columns import solved_columns
from creeping.field.equation.matrix import DIRECTIONS, Matrix, Places
from creeping.field.equation.tiles import Tiles, gauss
from creeping.field.results.far_result import spherical_frame
from creeping.geodesics.states import as_points
from creeping.geometry.directions import fibonacci_directions
from creeping.geometry.quadrature import box_points
from creeping.geometry.surface import Surface, size
from creeping.shadow.attachment import is_lit

APART = 0.12
"""Distance from the fine nodes, in wavelengths, from which sums over them are fields: what they err by falls off like
e^(-2 pi distance/spacing), to 1e-5 there."""
THIN = (DEPTH, SHALLOW, 0.05, 0.02, 0.005)
"""Least depths, in wavelengths, of points inside, the next where the body is too thin for one."""
DEEPEST = 50
"""Points inside a body that is thinner everywhere."""
ON_BODY, OFF_BODY = 10.0, 3.0
"""Error of currents at a point and of the field next to the body, and of that far from it, by what they leave inside;
series judge them at each height (`tests.field.equation.test_solution`)."""
LEAST, LEAST_NEAR = 1e-5, 2.5e-5
"""What is left inside, at least, for the far field, where errors of tiles cancel, and on the body and near it: a few
times what is left of the equation and what integrals over tiles err by (`studies.accuracy.edges`)."""
CHANGED = 2.0
"""Error of the far field by what is left of the equation, over what that radiates: cones, tori, almonds, boxes and
twisted ellipsoids after 2, 4 and 10 steps on coarse tiles, k = 10, are covered in 92 to 100 of 100 directions."""
UNRESOLVED = 2.0
"""Error by what tiles do not resolve, in what two ways to the same value differ by."""
SMOOTHED = 0.04
"""Share of what polynomials of tiles do not resolve that the equation leaves in currents away from edges: 0.01 to 0.03
on six bodies, k = 8 to 22. What is stated with it the same tests judge."""
LEVELS = {"hard": 1.1, "soft": 0.9, "impedance": 0.9, "conductor": 1.1}
"""Error of the far field over what is found of it, to hold in 95 of 100 directions (`studies.accuracy.edges`)."""
CLOSEST = 1e-6
"""Distance from an edge, over that of the nodes next to it, at least: on the edge itself currents are infinite."""
LOW = 2e-3
"""Height over the size of a tile from which integrals over its parts, halved twelve times at most, are good."""


def twice_normal(
    matrix: Matrix, places: Places, J: ComplexArray, directions: FloatArray, electric: ComplexArray | FloatArray
) -> ComplexArray:
    """2 n.E_inc + 2ik n.int J G dS at places (p,) of J (n, 3, m, c) at the nodes, E0 (m, 3, c): (p, m, c).

    ``matrix`` is that of soft bodies on the same tiles.
    """
    wave = 2 * np.exp(1j * matrix.k * (places.points @ directions.T))
    incident = wave[:, :, None] * np.einsum("px,mxc->pmc", places.normals, electric)
    potential = matrix.received(places, J, "single")
    return np.asarray(incident + 1j * matrix.k * np.einsum("px,pxmc->pmc", places.normals, potential))


def charges(matrix: Matrix, J: ComplexArray, directions: FloatArray) -> ComplexArray:
    """q at the nodes of J (n, 3, m, 2), of waves along directions (m, 3) with E0 along theta and phi: (n, m, 2)."""
    electric = np.swapaxes(spherical_frame(directions), 1, 2)
    right, under = (twice_normal(matrix, places, J, directions, electric) for places in (matrix.nodes, matrix.inner))
    found = solved_columns(matrix, right, under)
    return found.values.reshape(right.shape)


def scattered_electric(matrix: Matrix, points: FloatArray, J: ComplexArray, q: ComplexArray) -> ComplexArray:
    """Scattered E at points (p, 3), L, at any distance, of J (n, 3, c) and q (n, c): (p, 3, c)."""
    up = np.broadcast_to([0.0, 0.0, 1.0], points.shape)
    field = 0.5j * matrix.k * matrix.received(Places.at(points, up), J, "single")
    for axis, along in enumerate(np.eye(3)):
        places = Places.at(points, np.broadcast_to(along, points.shape))
        field[:, axis] -= 0.5 * matrix.received(places, q, "slope")
    return field


def twice_incident(
    boundary: Boundary, places: Places, directions: FloatArray, wavenumber: float, magnetic: ComplexArray | FloatArray
) -> ComplexArray:
    """2 u_inc or 2 du_inc/dn of waves (m,) at places (p,): (p, m); 2 n x H_inc of H0 (m, 3, c): (p, 2, m, c)."""
    wave = 2 * np.exp(1j * wavenumber * (places.points @ directions.T))
    if boundary.kind == "soft":
        return np.asarray(1j * wavenumber * (places.normals @ directions.T) * wave)
    if boundary.kind != "conductor":
        return np.asarray(wave)
    # a.(n x H) = -b.H, b.(n x H) = a.H
    rows = [-np.einsum("px,mxc->pmc", places.b, magnetic), np.einsum("px,mxc->pmc", places.a, magnetic)]
    return np.asarray(np.stack(rows, axis=1) * wave[:, None, :, None])


def along_body(normals: FloatArray, vectors: ComplexArray) -> ComplexArray:
    """Vectors (m, 3, c) without their parts along normals (m, 3)."""
    return np.asarray(vectors - normals[:, :, None] * np.einsum("mx,mxc->mc", normals, vectors)[:, None])


class OnBody(NamedTuple):
    """Current at places of the body (m, ...), their points and normals (m, 3), and whether they are lit (m,).

    Its error is (m,), of a conductor (m, p) for each polarisation.
    """

    values: ComplexArray
    error: FloatArray
    points: FloatArray
    normals: FloatArray
    lit: BoolArray


class _OnTiles(SurfaceCurrents):
    """What currents of scalar fields and of conductors share: the parts of their bases that know of tiles."""

    matrix: Matrix
    _least: ClassVar[float] = LEAST

    def on_body(self, points: ArrayLike) -> OnBody:
        """Current at the places of the body nearest to points (m, 3), L, as the equation gives it there.

        What it differs by from the polynomial of its tile that does not resolve; that and what is left inside are its
        error.
        """
        return self._at(self._places(points))

    def _at(self, places: Places) -> OnBody:
        """The current at places of tiles."""
        values = self._values_at(places)
        lit = is_lit(self.body, places.points, places.normals, self.direction)
        error = self._error_on(places, self.values, values, self.wavenumber if self.boundary.kind == "soft" else 1.0)
        return OnBody(values, error, places.points, places.normals, lit)

    def _values_at(self, places: Places) -> ComplexArray:
        """What the equation gives at places of tiles: (m, ...)."""
        soft = self.boundary.kind == "soft"
        sums = self._received(places, self.values, "slope" if soft else "double")
        magnetic = self._incident[None] if self._incident.ndim else np.zeros((1, 3, 0))
        wave = twice_incident(self.boundary, places, self.direction[None], self.wavenumber, magnetic)
        values = _vectors(places, wave[:, :, 0]) if self._incident.ndim else wave[:, 0]
        return values - sums if soft else values + sums

    def _places(self, points: ArrayLike) -> Places:
        """Places of the body nearest to points (m, 3), L."""
        tile, u, v, _ = self.matrix.tiles.located(as_points(points).reshape(-1, 3))
        return Places.of(self.matrix.tiles, (tile, u, v))

    def _unresolved(self, places: Places, nodes: ComplexArray, values: ComplexArray) -> FloatArray:
        """Error of polynomials through the nodes, by what values at places differ from them by: (m,) or (m, p)."""
        apart = values - self._between(places, nodes)
        return UNRESOLVED * (np.linalg.norm(apart, axis=1) if apart.ndim == 3 else np.abs(apart))

    def _error_on(self, places: Places, nodes: ComplexArray, values: ComplexArray, unit: float) -> FloatArray:
        """Error of values that the equation gives at places (m, ...): (m,), of a conductor (m, p).

        What polynomials do not resolve changes sign across a tile, about as e^(iqs) with 1/q = w/(2p + 1), w its width:
        where the surface curves little its double layer is small, across an edge it is not, and an impedance adds its
        single layer, which on a plane is k|eta|/q times it.
        """
        assert places.own is not None
        tiles, (tile, u, v) = self.matrix.tiles, places.own
        from_edge = tiles.from_edge(tile, u, v)
        away = from_edge * gauss(tiles.p)[0][0] * tiles.widths[tile]
        share = np.minimum(1.0, SMOOTHED + 1 / (1 + (away / tiles.reach[tile]) ** 2))
        share += np.abs(self.boundary.at(places.points).admittance) * self.wavenumber * tiles.reach[tile]
        unresolved = (share * self._unresolved(places, nodes, values).T).T
        error = np.hypot(ON_BODY * unit * np.maximum(self._left, LEAST), unresolved)
        if self.boundary.kind in ("soft", "conductor"):
            large = np.linalg.norm(values, axis=1) if values.ndim == 3 else np.abs(values)
            error = np.hypot(error, (_at_edges(from_edge) * large.T).T)
        return np.asarray(error)

    def between_nodes(self, points: ArrayLike) -> ComplexArray:
        """Current at the places of the body nearest to points (m, 3), L, by the polynomials of tiles: (m, ...)."""
        return self._between(self._places(points), self.values)

    def _between(self, places: Places, nodes: ComplexArray) -> ComplexArray:
        """What the polynomials of values at the nodes (n, ...) are at places of tiles: (m, ...)."""
        assert places.own is not None
        found = self.matrix.tiles.interpolated_at(nodes, *places.own)
        return along_body(places.normals, found) if nodes.ndim == 3 else found

    def _received(self, places: Places, values: ComplexArray, kind: str = "double") -> ComplexArray:
        """What places (m,) receive of values at the nodes, as of `Matrix.received`: (m, ...), J as vectors."""
        if values.ndim == 1:
            return self.matrix.received(places, values[:, None], kind)[:, 0]
        nodes = self.matrix.nodes
        both = np.stack([np.einsum("nx,nxc->nc", t, values) for t in (nodes.a, nodes.b)], axis=1)
        return _vectors(places, self.matrix.received(places, both))

    def error(self, directions: ArrayLike) -> FloatArray:
        """Error of f, L, that 95 of 100 directions keep to: (m, 3) -> (m,), of a conductor (m, 2, 2)."""
        known = super().error(directions)
        r = observers_of(directions)
        edges = self.matrix.edge_term.far(self.values, self.boundary.kind, r)
        # the same integral by two rules: what they differ by the polynomials of tiles do not resolve
        finer = self._finer._radiated(self._at_fine(self.values), self._finer.lit, r)
        far = self.far(r)
        unknown = np.hypot(edges[:, 0] if known.ndim == 1 else edges[:, None], UNRESOLVED * np.abs(far - finer))
        error = LEVELS[self.boundary.kind] * np.hypot(known, unknown)
        left = np.hypot(np.abs(self._radiated(self.change, self._everywhere, r)), self._change_amplitude)
        error = np.hypot(error, CHANGED * left)
        # phases of waves that come back from ground that is elsewhere
        moved = 2 * self.wavenumber * self.matrix.tiles.off
        return np.asarray(np.hypot(error, moved * np.hypot(np.abs(far), self._amplitude)))

    @property
    def _everywhere(self) -> BoolArray:
        return np.ones(len(self.lit), dtype=bool)

    @cached_property
    def _change_amplitude(self) -> FloatArray:
        """What the rest of the equation radiates, rms over all directions, L."""
        every = self._radiated(self.change, self._everywhere, fibonacci_directions(DIRECTIONS))
        return np.asarray(np.sqrt(np.mean(np.abs(every) ** 2, axis=0)))

    def _at_fine(self, values: ComplexArray) -> ComplexArray:
        """Values at the nodes, at the finer ones."""
        found = self.matrix.tiles.interpolated(values)
        return found if values.ndim == 1 else along_body(self.matrix.tiles.fine[1], found)

    def _off_the_body(self, points: ArrayLike) -> FloatArray:
        return as_points(points).reshape(-1, 3)

    def _field(self, values: ComplexArray, points: FloatArray) -> ComplexArray:
        far = ~self.next_to(points)
        out = np.empty((len(points), *values.shape[1:]), dtype=complex)
        out[far] = self._finer._field(self._at_fine(values), points[far])
        out[~far] = self._next_to(values, points[~far])
        return out

    def next_to(self, points: FloatArray) -> BoolArray:
        """Whether points (m, 3), L, are so near to the body that tiles are integrated (m,)."""
        away, _ = self.matrix.tiles.fine_tree.query(points)
        return np.asarray(away * self.wavenumber <= 2 * np.pi * APART)

    def total(self, points: FloatArray, dark: BoolArray) -> tuple[ComplexArray, FloatArray]:
        """Total field and its error at points (m, 3), L, at any distance, lit or not."""
        return self.incident_at(points) + self._scattered_at(points), self.error_around(points)

    def _scattered_at(self, points: FloatArray) -> ComplexArray:
        """Scattered field at points (m, 3), L, at any distance: (m,), of a conductor E and H (m, 6, p)."""
        return self.scattered(points)

    def error_around(self, points: FloatArray) -> FloatArray:
        """Error of the total field at points (m, 3), L, at any distance: (m,), of E and H (m, p).

        What the polynomials of a tile do not resolve of currents changes sign 2p + 1 times or so across its width w:
        its field fades over w/(2p + 1), slower once it has, and of what du/dn lacks it is that times w/(2p + 1). On the
        body potentials are halfway between the polynomials and what the equation gives. What the integrals over tiles
        err by is of many tiles: it fades as reach/distance, from ON_BODY of what is left inside to OFF_BODY, and that
        as waves do.
        """
        tiles = self.matrix.tiles
        away, nearest = tiles.fine_tree.query(points)
        tile = nearest // tiles.finer**2
        reach = tiles.reach[tile]
        of_tile = 0.5 * (reach if self.boundary.kind == "soft" else 1.0) / (1 + (away / reach) ** 2)
        left = self._left_inside
        near, off = ON_BODY / (1 + away / reach), OFF_BODY / (1 + away / size(self.body))
        integrals = np.hypot(
            np.multiply.outer(np.maximum(left, LEAST_NEAR), near), np.multiply.outer(np.maximum(left, LEAST), off)
        )
        error = np.maximum(of_tile * self._unresolved_of_tiles[tile].T, integrals).T
        edges = LEVELS[self.boundary.kind] * self.matrix.edge_term.near(self.values, self.boundary.kind, points)
        return np.asarray(np.hypot(error, edges[:, 0] if error.ndim == 1 else edges))

    @cached_property
    def _unresolved_of_tiles(self) -> FloatArray:
        """What the polynomials of tiles do not resolve of currents: (t,), of a conductor and its charge (t, p)."""
        found = self._unresolved_at(self.matrix.corners)
        return np.asarray(found.reshape(self.matrix.tiles.count, 4, *found.shape[1:]).max(axis=1))

    def _unresolved_at(self, places: Places) -> FloatArray:
        """What the polynomials of tiles do not resolve at places of them."""
        return self._unresolved(places, self.values, self._values_at(places))

    @property
    def _left_inside(self) -> FloatArray:
        """What is left inside of the incident wave, of a conductor of E and H (p,)."""
        return np.asarray(self._left)

    def _next_to(self, values: ComplexArray, points: FloatArray) -> ComplexArray:
        """Scattered field, of a conductor H, at points (m, 3) next to the body, of values at the nodes: (m, ...)."""
        return self._not_low(points, lambda x: self._integrated(values, x))

    def _not_low(self, points: FloatArray, field: Callable[[FloatArray], ComplexArray]) -> ComplexArray:
        """A field at points (m, 3) next to the body, of lower ones along a line through two that are not."""
        tiles = self.matrix.tiles
        tile, u, v, height = tiles.located(points)
        least = LOW * tiles.sizes[tile]
        low = np.flatnonzero(height < least)
        if not len(low):
            return field(points)
        foot, n = tiles.on(tile[low], u[low], v[low])
        step = least[low, None] * n
        x = points.copy()
        x[low] = foot + step
        found = field(np.concatenate([x, x[low] + step]))
        out, above = found[: len(x)], found[len(x) :]
        share = (height[low] / least[low] - 1).reshape(-1, *(1,) * (out.ndim - 1))
        out[low] += share * (above - out[low])
        return out

    def _integrated(self, values: ComplexArray, points: FloatArray) -> ComplexArray:
        x, z = (np.broadcast_to(row, points.shape) for row in np.eye(3)[[0, 2]])
        if self.boundary.kind == "soft":
            return -0.5 * self._received(Places.at(points, z), values, "single")
        across = 0.5 * self._received(Places.at(points, z), values)
        if values.ndim == 1:
            return across
        # (n x H) x n has no part along n: another n for that one
        H = np.cross(across, z[:, :, None], axis=1)
        H[:, 2] = np.cross(0.5 * self._received(Places.at(points, x), values), x[:, :, None], axis=1)[:, 2]
        return H

    @cached_property
    def inner_points(self) -> FloatArray:
        """Points inside the body at which the currents are tested (m, 3), L."""
        if self.matrix.inside is None:
            self.matrix.inside = inside_points(self.body, self.matrix.tiles, 2 * np.pi / self.wavenumber)
        return self.matrix.inside

    @cached_property
    def _finer(self) -> Any:
        """No currents, at the finer nodes."""
        x, normals, weights = self.matrix.tiles.fine
        nothing = np.zeros((len(x), *self.values.shape[1:]), dtype=complex)
        same = {name: getattr(self, name) for name in ("body", "direction", "wavenumber", "boundary")}
        make = ConductorCurrents if nothing.ndim > 1 else SurfaceCurrents
        return make(
            **same,
            points=x,
            normals=normals,
            weights=weights,
            travel=np.broadcast_to(self.direction, x.shape),
            values=nothing,
            change=nothing,
            lit=np.ones(len(x), dtype=bool),
            solved=True,
        )


def _at_edges(away: FloatArray) -> FloatArray:
    """What currents or fields (m,) lack next to edges at distances over that of the nodes next to it, as a share.

    Currents grow like r^(-1/2) at most. Polynomials of tiles are bounded: up to the first nodes, at d, they lack
    d^(1/2) r^(-1/2) - 1. What that is in all, d on each of two faces, is a line on the edge with the field 2d/(2 pi r).
    """
    grown = np.sqrt(1 / np.clip(away, CLOSEST, 1.0)) - 1
    return np.asarray(np.hypot(grown, 1 / (np.pi * np.maximum(away, 1.0))))


def inside_points(body: Surface, tiles: Tiles, wavelength: float) -> FloatArray:
    """Points inside a body (m, 3), L, evenly spread, as deep as it is thick enough for."""
    x = box_points(body, tiles.inside if tiles.alone else None)
    away, nearest = tiles.fine_tree.query(x)
    # half of what the nodes next to it are apart
    depth = np.sqrt(np.maximum(away**2 - tiles.fine[2][nearest], 0.0))
    each = (x[depth > least * wavelength][:POINTS] for least in THIN)
    found = next((points for points in each if len(points)), np.zeros((0, 3)))
    # of a thin or small body the deepest there are: what is left is integrated over tiles
    return found if len(found) else x[np.argsort(-depth, kind="stable")[:DEEPEST]][: int(np.sum(depth > 0))]


def _vectors(places: Places, both: ComplexArray) -> ComplexArray:
    """Vectors (m, 3, c) of parts along a and b (m, 2, c)."""
    return np.asarray(places.a[:, :, None] * both[:, :1] + places.b[:, :, None] * both[:, 1:])


@dataclass(frozen=True, eq=False, repr=False)
class TileCurrents(_OnTiles):
    """Currents of a scalar field at the nodes of tiles.

    Attributes
    ----------
    matrix : Matrix
        Of the equation that they satisfy.
    """

    matrix: Any = None


@dataclass(frozen=True, eq=False, repr=False)
class ConductorTileCurrents(_OnTiles, ConductorCurrents):
    """Currents n x H of a conductor at the nodes of tiles.

    Attributes
    ----------
    matrix : Matrix
        Of the equation that they satisfy.
    charges : callable
        Gives n.E at the nodes of E0 along theta and phi (n, 2).
    """

    matrix: Any = None
    charges: Any = None

    @cached_property
    def charge(self) -> ComplexArray:
        """n.E at the nodes (n, p), in units of the incident E."""
        return np.asarray(self.charges() @ self.mix)

    def charge_on_body(self, points: ArrayLike, J: ComplexArray) -> tuple[ComplexArray, FloatArray]:
        """n.E and its error, as `on_body`: (m, p) each; ``J`` (m, 3, p) is the current there."""
        places = self._places(points)
        assert places.own is not None
        values = self._charge_at(places)
        unresolved = self._unresolved(places, self.values, J)
        # the potential of what tiles do not resolve of J, which changes sign along the body
        potential = (self.wavenumber * self.matrix.tiles.reach[places.own[0]] * unresolved.T).T
        return values, np.hypot(self._error_on(places, self.charge, values, 1.0), potential)

    def _charge_at(self, places: Places) -> ComplexArray:
        """n.E at places of tiles."""
        matrix, d = self.matrix.soft_one, self.direction[None]
        J, electric = self.values[:, :, None], self.incident_electric[None]
        given = twice_normal(matrix, places, J, d, electric)[:, 0]
        return np.asarray(given - matrix.received(places, self.charge, "slope"))

    def scattered_electric(self, points: ArrayLike) -> ComplexArray:
        """Scattered E at points (m, 3), L, at any distance from the body: (m, 3, p)."""
        x = self._off_the_body(points)
        near = self.next_to(x)
        out = np.empty((len(x), 3, self.values.shape[2]), dtype=complex)
        out[~near] = self._electric(self.values, x[~near])
        if np.any(near):
            out[near] = self._not_low(
                x[near], lambda y: scattered_electric(self.matrix.soft_one, y, self.values, self.charge)
            )
        return out

    def _scattered_at(self, points: FloatArray) -> ComplexArray:
        return np.concatenate([self.scattered_electric(points), self.scattered(points)], axis=1)

    def error_around(self, points: FloatArray) -> FloatArray:
        """The same, and what currents lack next to edges, where E and H grow."""
        error, close = super().error_around(points), np.flatnonzero(self.next_to(points))
        if not (len(close) and self.matrix.tiles.edges[:, 1].max() >= 0):
            return error
        tiles = self.matrix.tiles
        tile, u, v, height = tiles.located(points[close])
        first = gauss(tiles.p)[0][0] * tiles.widths[tile]
        grown = _at_edges(np.hypot(tiles.from_edge(tile, u, v), height / first))
        size = np.maximum(np.linalg.norm(self.values, axis=1), np.abs(self.charge))
        largest = size.reshape(tiles.count, -1, size.shape[1]).max(axis=1)
        error[close] = np.hypot(error[close], grown[:, None] * largest[tile])
        return error

    def _unresolved_at(self, places: Places) -> FloatArray:
        of_charge = self._unresolved(places, self.charge, self._charge_at(places))
        return np.maximum(super()._unresolved_at(places), of_charge)

    @property
    def _left_inside(self) -> FloatArray:
        return np.asarray(np.max(self.left_of_each, axis=0))

    def _electric(self, values: ComplexArray, points: FloatArray) -> ComplexArray:
        found: ComplexArray = self._finer._electric(self._at_fine(values), points)
        return found
