"""Quadrature over a whole body: nodes x, unit normals, weights dS and the shape operator, on F = 0 to rounding.

A closed mesh of bilinear quadrilaterals Y(u, v) near the body is mapped onto it by y = x + h n(x), its nearest points,
which tiles the body without gaps or overlaps, whatever its genus; Gauss's product rule on each tile, with

    dS = (Y_u x Y_v).n du dv/((1 + h kappa_1)(1 + h kappa_2)),

2 M = kappa_1 + kappa_2 and K from H. The integral of n over a closed surface is 0; what the rule gives for it tells
its error. Which mesh and rule are taken: `creeping.geometry.tile_rules`.

A body of smooth pieces is tiled by triangles, each mapped onto its own piece, with conical products of Gauss's rules.

Also here: points inside a body, by their depth under its surface.

A point is as deep as the nearest of many nodes of the body is far, less what the nodes are apart.

Sources: [G98], [DR84, sec. 2.7]; Derivations, B11.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.errors import SurfaceError
from creeping.geometry.curvature import adjugate_form, second_form
from creeping.geometry.evaluators import entries_of, evaluators
from creeping.geometry.piecewise import Tiles, is_piecewise, pieces_of
from creeping.geometry.surface import Surface, inside, memo, size
from creeping.geometry.tile_rules import CLOSED, FEWEST, MOST, MOST_CELLS, MOST_NODES, PieceRules, Rules, finer, graded
from creeping.kernels.threads import in_slices

SYMMETRIC = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])
"""Where xx, yy, zz, yz, xz, xy stand in a matrix."""
STEPS = 12
"""Newton steps to the nearest point."""
BESIDE = 8
"""Nodes next to a point that tell how far they are apart."""
STRETCH = (0.1, 10.0)
"""Bounds of (1 + h kappa_1)(1 + h kappa_2); at a tip, where curvatures are infinite, a triangle counts as flat."""

TRIED = 20_000
"""Points of the box that are tried."""
FEWER = 4000
"""The same where each costs a sum over nodes."""


@dataclass(frozen=True, eq=False)
class BodyNodes:
    """Quadrature of a body.

    Attributes
    ----------
    points, normals : (n, 3), L and 1
    weights : (n,), L^2
    hessians : (n, 6), 1/L
        xx, yy, zz, yz, xz, xy of H/|grad F|: t.Ht/|grad F| is the normal curvature along t.
    error : float
        Integral of n as a share of the area.
    each : int
        Nodes that follow each other on one triangle of a body of pieces, whose triangles differ in size; else 0.
    """

    points: FloatArray
    normals: FloatArray
    weights: FloatArray
    hessians: FloatArray
    error: float
    each: int = 0

    def part(self, at: IntArray) -> "BodyNodes":
        """Some of the nodes, by their numbers."""
        return BodyNodes(self.points[at], self.normals[at], self.weights[at], self.hessians[at], self.error)

    def curvature(self, directions: FloatArray) -> FloatArray:
        """Normal curvature, 1/L, along unit tangents (n, 3): (n,)."""
        return second_form(directions, self.hessians[:, SYMMETRIC])

    def twist(self, directions: FloatArray) -> FloatArray:
        """Off-diagonal entry of the shape operator, 1/L, between unit tangents p (n, 3) and n x p: (n,)."""
        across = np.cross(self.normals, directions)
        return np.asarray(np.einsum("ni,nij,nj->n", directions, self.hessians[:, SYMMETRIC], across))

    @property
    def total_curvature(self) -> FloatArray:
        """kappa_1 + kappa_2 (n,), 1/L."""
        return np.asarray(np.sum(self.hessians[:, :3], axis=1) - self.curvature(self.normals))

    @property
    def bending(self) -> FloatArray:
        """|kappa_1 + kappa_2| (n,), 1/L, of a saddle (kappa_1^2 + kappa_2^2)^(1/2): what curvature does to a field."""
        saddle = np.maximum(-adjugate_form(self.normals, self.hessians[:, SYMMETRIC]), 0.0)
        return np.asarray(np.sqrt(self.total_curvature**2 + 2 * saddle))

    def distance(self, points: FloatArray) -> FloatArray:
        """Distance of points (m, 3) from the body as nodes tell it, L: the nearest less their spacing."""
        return np.asarray(np.sqrt(np.maximum(self.nearest(points) ** 2 - (0.5 * self.spacing_at(points)) ** 2, 0.0)))

    def nearest(self, points: FloatArray) -> FloatArray:
        """Distance of points (m, 3) from the nearest node, L: (m,)."""
        return np.asarray(self._tree.query(points)[0])

    @property
    def spacing(self) -> float:
        """Distance between neighbouring nodes, L, of those that are furthest apart."""
        return float(np.sqrt(np.max(self.weights)))

    def spacing_at(self, points: FloatArray) -> FloatArray:
        """`spacing` of the nodes next to points (m, 3), L: (m,)."""
        if not self.each:
            return np.full(len(points), self.spacing)
        apart = np.repeat(np.sqrt(np.max(self.weights.reshape(-1, self.each), axis=1)), self.each)
        return np.asarray(np.max(apart[self._tree.query(points, BESIDE)[1]], axis=1))

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import cKDTree

        return cKDTree(self.points)


def body_nodes(body: Surface, rate: float) -> BodyNodes:
    """Nodes for integrands e^{i phase} whose phase changes by at most ``rate``, 1/L, along the body.

    Made once for each rule that rates lead to, and kept with the body.

    Raises
    ------
    SurfaceError
        If no mesh within bounds resolves the body or the rate.

    Examples
    --------
    >>> import scatterers as sc
    >>> nodes = body_nodes(sc.Torus(R=1.0, r=0.5), rate=20.0)
    >>> round(float(nodes.weights.sum()), 6), round(float(4 * np.pi**2 * 0.5), 6)
    (19.739209, 19.739209)
    """
    if is_piecewise(body):
        return _on_pieces(body, rate)
    found = memo(body, "quadratures", lambda: Rules(body, _nodes))
    while found.cells:
        cells, points, tiles = found.rule(body, rate)
        if points > MOST or tiles * points**2 > MOST_NODES:
            if points == FEWEST:
                break
            raise SurfaceError(
                f"a phase that turns once in {2 * np.pi / rate:.3g} L asks for more than {MOST_NODES} nodes; "
                "take a lower wavenumber, or rays"
            )
        nodes: BodyNodes = found.nodes(body, cells, points)
        if nodes.error <= CLOSED:
            return nodes
        found.cells = finer(cells) if cells < MOST_CELLS else 0
    found.cells = 0
    raise SurfaceError(
        f"no mesh of up to {MOST_CELLS} cells or {MOST_NODES} nodes integrates over the body, which is too thin or too "
        "sharp; use rays for its fields"
    )


def node_count(body: Surface, rate: float) -> int:
    """Nodes that `body_nodes` would have, without making them; more than MOST_NODES if no mesh will do.

    Examples
    --------
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> node_count(ball, 20.0) == len(body_nodes(ball, 20.0).points)
    True
    """
    if is_piecewise(body):
        return _piece_rules(body).rule(body, rate)[2]
    found = memo(body, "quadratures", lambda: Rules(body, _nodes))
    if not found.cells:
        return MOST_NODES + 1
    _, points, tiles = found.rule(body, rate)
    return MOST_NODES + 1 if points > MOST else tiles * points**2


def _nodes(body: Surface, mesh: tuple[FloatArray, IntArray], points: int) -> BodyNodes:
    vertices, tiles = mesh
    u, w = np.polynomial.legendre.leggauss(points)
    low, high = 0.5 * (1 - u), 0.5 * (1 + u)
    # bilinear weights of the corners, counter-clockwise, and their derivatives: (4, points, points)
    shape = np.stack([np.outer(a, b) for a, b in ((low, low), (high, low), (high, high), (low, high))])
    one = np.ones(points)
    by_u = 0.5 * np.stack([np.outer(s * one, b) for s, b in ((-1, low), (1, low), (1, high), (-1, high))])
    by_v = 0.5 * np.stack([np.outer(a, s * one) for a, s in ((low, -1), (high, -1), (high, 1), (low, 1))])
    corners = vertices[tiles]
    y, yu, yv = (np.einsum("kuv,qkx->quvx", part, corners).reshape(-1, 3) for part in (shape, by_u, by_v))
    areas = np.cross(yu, yv) * np.tile(np.outer(w, w).ravel(), len(tiles))[:, None]
    return _onto(body, y, areas)


def _onto(body: Surface, points: FloatArray, areas: FloatArray) -> BodyNodes:
    """Nodes of a body nearest to points with vectors of area (n, 3), L and L^2."""
    x, n, hessians, height = nearest_points(body, points)
    nodes = BodyNodes(x, n, np.ones(len(x)), hessians, 0.0)
    gauss = adjugate_form(n, hessians[:, SYMMETRIC])
    stretch = 1 + height * nodes.total_curvature + height**2 * gauss
    weights = np.sum(areas * n, axis=1) / stretch
    whole = float(np.sum(weights))
    # beyond the centres of curvature the map is not one to one
    folded = not np.all(stretch > STRETCH[0]) or not np.all(np.isfinite(weights))
    error = np.inf if folded else float(np.linalg.norm(weights @ n)) / whole
    return BodyNodes(x, n, weights, hessians, error)


def _piece_rules(body: Any) -> PieceRules:
    found: PieceRules = memo(body, "piece quadratures", lambda: PieceRules(body, _piece_nodes))
    return found


def _on_pieces(body: Any, rate: float) -> BodyNodes:
    """Nodes of a body of smooth pieces."""
    rules = _piece_rules(body)
    rung, points, count = rules.rule(body, rate)
    if count > MOST_NODES:
        raise SurfaceError(
            f"a phase that turns once in {2 * np.pi / rate:.3g} L asks for more than {MOST_NODES} nodes, or the "
            "body's pieces do not close; take a lower wavenumber, or rays"
        )
    nodes: BodyNodes = rules.nodes(body, rung, points)
    return nodes


def _piece_nodes(body: Any, side: float, points: int) -> BodyNodes:
    tiles = graded(body, Tiles(*body.tiles(side)))
    u, w = np.polynomial.legendre.leggauss(points)
    u, w = 0.5 * (1 + u), 0.5 * w
    # barycentric places of the conical product
    first, second = (part.ravel() for part in np.meshgrid(u, u, indexing="ij"))
    places = np.stack([1 - first, first * (1 - second), first * second], axis=1)
    share = np.outer(w * u, w).ravel()
    y = np.einsum("pk,qkx->qpx", places, tiles.corners).reshape(-1, 3)
    a, b, c = np.moveaxis(tiles.corners, 1, 0)
    areas = (np.cross(b - a, c - a)[:, None] * share[:, None]).reshape(-1, 3)
    owner = np.repeat(tiles.pieces, len(share))
    lanes = [np.empty((len(y), 3)), np.empty((len(y), 3)), np.empty(len(y)), np.empty((len(y), 6))]
    for number, piece in enumerate(pieces_of(body)):
        mine = np.flatnonzero(owner == number)
        if len(mine):
            found = _onto(piece, y[mine], areas[mine])
            flat = np.linalg.norm(areas[mine], axis=1)
            sound = (found.weights > STRETCH[0] * flat) & (found.weights < STRETCH[1] * flat)
            for lane, values in zip(lanes, (found.points, found.normals, found.weights, found.hessians), strict=True):
                lane[mine] = values
            lanes[2][mine[~sound]] = flat[~sound]
    x, n, weights, hessians = lanes
    whole = float(np.sum(weights))
    return BodyNodes(x, n, weights, hessians, float(np.linalg.norm(weights @ n)) / whole, points**2)


def nodes_at(body: Surface, points: FloatArray, normals: FloatArray) -> BodyNodes:
    """Points (n, 3) of the body, L, as nodes of weight 1."""
    g, h = body.gradient(points), body.hessian(points)
    entries = entries_of(h / np.linalg.norm(g, axis=-1)[:, None, None]).T
    return BodyNodes(points, normals, np.ones(len(points)), entries, 0.0)


def nearest_points(body: Surface, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Points of the body nearest to points near it: x, n (m, 3), H/|grad F| (m, 6) and the height above it (m,)."""
    from creeping.kernels.nearest import nearest

    m = len(points)
    x, n, hessians, height = np.empty((3, m)), np.empty((3, m)), np.empty((6, m)), np.empty(m)
    columns, close = np.ascontiguousarray(points.T), 1e-14 * size(body)
    with evaluators(body) as parts:

        def run(part: slice) -> None:
            found = [np.ascontiguousarray(values[..., part]) for values in (x, n, hessians, height)]
            nearest(*parts[:2], np.ascontiguousarray(columns[:, part]), STEPS, close, *found)
            x[:, part], n[:, part], hessians[:, part], height[part] = found

        in_slices(run, m)
    return np.ascontiguousarray(x.T), np.ascontiguousarray(n.T), np.ascontiguousarray(hessians.T), height


def inner_points(body: Surface, depth: float, count: int) -> FloatArray:
    """Points inside, at least ``depth``, L, under the surface, evenly spread: (count, 3), L.

    Fewer, or none, where the body is hardly or nowhere that thick; the same ones at every call.

    Examples
    --------
    >>> import scatterers as sc
    >>> points = inner_points(sc.Sphere(), 0.3, 50)
    >>> points.shape, bool(np.linalg.norm(points, axis=1).max() < 0.7)
    ((50, 3), True)
    """
    x, distance = memo(body, "depths", lambda: _depths(body))
    return np.asarray(x[distance > depth][:count])


def box_points(body: Surface, within: Callable[[FloatArray], BoolArray] | None = None) -> FloatArray:
    """Points inside, evenly spread over the body's box (n, 3), L; the same ones at every call.

    ``within`` tells which are, if it is not the body that does.
    """
    from scipy.stats import qmc

    low, high = np.asarray(body.bounds, dtype=float)
    x = low + (high - low) * qmc.Halton(3, scramble=False).random(TRIED if within is None else FEWER)
    return np.asarray(x[inside(body, x) if within is None else within(x)])


def _depths(body: Surface) -> tuple[FloatArray, FloatArray]:
    """Points inside (n, 3) and bounds of their depth (n,), L."""
    x = box_points(body)
    return x, body_nodes(body, 4 / size(body)).distance(x)
