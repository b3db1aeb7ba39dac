"""A shadow line followed by itself: critical points, a mesh refined until the signs decide its topology, then panels.

The last resort, some tenths of a second a line; what comes out is a `LineNodes` like any other.

With S the shape operator and q_T the tangential part of q, the gradient of h = n.q on Q is

    g = S q_T = P_T H q_T / |grad F|,   q_T = q - (n.q) n,   P_T = 1 - n n^T:

q turns by its own change, which is a multiple of dx and has no part along n. Apart from n = +-q/|q| it vanishes only
where K = 0 and q_T is the null direction. A critical point with h = 0 is a crossing or an isolated point of the shadow
line; a small |h| there is a near-crossing, a small loop or a gap.

Where a triangle could hide a crossing, a loop or a gap, it is split. It cannot if, with e its longest edge,

    all h_i of one sign and min |h_i| > 2 e max |g_i|   (no zero inside), or
    g_i.g_j > |g_i||g_j|/2 for all i, j                 (the zeros inside are one graph).

Curves leave a triangle by the edge whose sign falls in counter-clockwise order, so they come out closed, with the lit
side (h < 0) on the left seen from outside: along T = grad F x Hq/|.|.

Sources: Derivations, R6, R9, R11 and R19.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize.elementwise import find_root

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.errors import SingularIncidenceError
from creeping.geometry.directions import first_of_equals
from creeping.geometry.incident import travel
from creeping.geometry.surface import Surface, project, size
from creeping.geometry.triangulation import Triangulation
from creeping.shadow.curves import LineNodes, moved_onto_lines
from creeping.shadow.panels import PanelCurve, fit_panels

FORBIDDEN = 1e-6
"""|n.q|/|q| at a critical point below which the incidence is refused."""


@dataclass(frozen=True)
class CriticalPoints:
    """Critical points of n.q on the body with |n.q| < |q|.

    Attributes
    ----------
    points : (k, 3), L
    values : (k,)
        n.q/|q| there.
    """

    points: FloatArray
    values: FloatArray

    @property
    def distance(self) -> float:
        """Least |n.q|/|q|, inf if there is no critical point."""
        return float(np.min(np.abs(self.values), initial=np.inf))

    def refuse(self) -> None:
        """Raise SingularIncidenceError if the shadow line runs through a critical point."""
        if self.distance < FORBIDDEN:
            crossing = np.abs(self.values) < FORBIDDEN
            raise self.error("crosses itself", self.points[crossing])

    def error(self, trouble: str, points: FloatArray | None = None) -> SingularIncidenceError:
        """Error for the given points (k, 3), or the critical one nearest to the line, with the remedy."""
        if points is None:
            points = self.points[np.argsort(np.abs(self.values))[:1]]
        named = ", ".join(str(tuple((np.round(p, 6) + 0.0).tolist())) for p in points[:8])
        more = f" and {len(points) - 8} more" if len(points) > 8 else ""
        return SingularIncidenceError(
            f"the shadow line {trouble} at {len(points)} points: {named}{more} "
            f"(least |n.d| at a critical point {self.distance:.1e}); perturb the direction, or move the source, by say "
            "1e-3; fields of plane waves need no line: creeping.solve",
            points=points,
            distance=self.distance,
        )


def incidence(body: Surface, wave: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return n.q and its gradient on the body times the body's size: (..., 3) -> (...), (..., 3)."""
    gradient = body.gradient(points)
    norm = np.linalg.norm(gradient, axis=-1, keepdims=True)
    n, q = gradient / norm, travel(wave, points)
    h = np.einsum("...i,...i->...", n, np.broadcast_to(q, n.shape))
    across = (body.hessian(points) @ (q - h[..., None] * n)[..., None])[..., 0]
    across -= np.sum(across * n, axis=-1, keepdims=True) * n
    return h, across * (size(body) / norm)


def critical_points(body: Surface, wave: FloatArray, mesh: Triangulation) -> CriticalPoints:
    """Locate the critical points of n.q, apart from n = +-q/|q|.

    Parameters
    ----------
    body, wave : Surface, (3,) or (4,)
    mesh : Triangulation
        Of the body; its vertices of locally least |g| are the starting points.

    Returns
    -------
    CriticalPoints
    """
    h, g = incidence(body, wave, mesh.vertices)
    steep = np.linalg.norm(g, axis=1)
    seeds = _seeds(mesh, h, steep)
    points = _solve(body, wave, mesh.vertices[seeds])
    h, g = incidence(body, wave, points)
    h = h / np.linalg.norm(travel(wave, points), axis=-1)
    off = np.abs(body.level(points)) / np.linalg.norm(body.gradient(points), axis=1)
    # at n = +-q/|q|, where the gradient vanishes for any body, 1 - |h| is the square of the error of the point
    found = (np.linalg.norm(g, axis=1) < 1e-8) & (off < 1e-9 * size(body)) & (np.abs(h) < 1 - 1e-8)
    order = np.flatnonzero(found)[np.argsort(np.abs(h[found]), kind="stable")]
    points, h, gap = points[order], h[order], 1e-5 * size(body)
    kept = first_of_equals(0 * order, lambda i, j: np.linalg.norm(points[i] - points[j], axis=1) <= gap)
    return CriticalPoints(points[kept], h[kept])


def _seeds(mesh: Triangulation, h: FloatArray, steep: FloatArray) -> list[int]:
    """Vertices whose |g| no neighbour undercuts, and those of least |g| and of least |g| near the line."""
    most = 160
    lowest = steep.copy()
    for a, b in ((0, 1), (1, 2), (2, 0)):
        for i, j in ((mesh.triangles[:, a], mesh.triangles[:, b]), (mesh.triangles[:, b], mesh.triangles[:, a])):
            np.minimum.at(lowest, i, steep[j])
    minima = np.flatnonzero(steep <= lowest)
    minima = minima[np.argsort(steep[minima])][: most // 2]
    near = np.argsort(steep + 2 * np.abs(h))[: most // 4]
    least = np.argsort(np.where(np.abs(h) < 0.99, steep, np.inf))[: most // 4]
    return np.unique(np.concatenate([minima, near, least])).tolist()  # type: ignore[no-any-return]


def _residual(body: Surface, wave: FloatArray, points: FloatArray) -> FloatArray:
    """(g, F/|grad F|) without dimension: (..., 3) -> (..., 4)."""
    _, g = incidence(body, wave, points)
    off = body.level(points) / np.linalg.norm(body.gradient(points), axis=-1) / size(body)
    return np.concatenate([g, off[..., None]], axis=-1)


def _solve(body: Surface, wave: FloatArray, points: FloatArray) -> FloatArray:
    """Levenberg-Marquardt steps with damping |r|^2: fast for isolated, degenerate and continuous solutions alike."""
    points = np.array(points, dtype=float)
    length = size(body)
    # third derivatives by central differences: truncation 1e-10 against rounding 1e-11
    shifts = 1e-5 * length * np.eye(3)
    active = np.arange(len(points))
    for _ in range(40):
        x = points[active]
        r = _residual(body, wave, x)
        ahead = _residual(body, wave, x[:, None] + shifts)
        J = np.swapaxes(ahead - _residual(body, wave, x[:, None] - shifts), 1, 2) / 2e-5
        Jt = np.swapaxes(J, 1, 2)
        # the floor keeps the matrix regular where a whole curve is critical
        damping = np.maximum(np.sum(r * r, axis=1), 1e-14 * np.trace(Jt @ J, axis1=1, axis2=2) + 1e-28)
        step = np.linalg.solve(Jt @ J + damping[:, None, None] * np.eye(3), -(Jt @ r[..., None]))[..., 0]
        norm = np.linalg.norm(step, axis=1)
        step *= np.minimum(1.0, 0.1 / np.maximum(norm, 1e-300))[:, None]
        moved = x + length * step
        finite = np.all(np.isfinite(moved), axis=1)
        points[active[finite]] = moved[finite]
        active = active[finite & (norm > 1e-13)]
        if not len(active):
            break
    return points


def followed(body: Surface, wave: FloatArray, mesh: Triangulation) -> tuple[LineNodes, tuple[PanelCurve, ...], float]:
    """Nodes of the line of a wave, (3,) or (4,), its curves in panels, and the least |n.q|/|q| at a critical point.

    Raises
    ------
    SingularIncidenceError
        If the line crosses itself, or so nearly that its curves cannot be told apart.
    """
    critical = critical_points(body, wave, mesh)
    critical.refuse()
    curves = tuple(sorted(_curves(body, wave, mesh, critical), key=lambda curve: -curve.length))
    points, spacing = [], []
    for curve in curves:
        shortest = float(np.min(np.diff(curve.breaks)))
        # 24 nodes on the shortest panel
        count = int(np.clip(np.ceil(24 * curve.length / shortest), 512, 16_384))
        points.append(curve.at(curve.length * np.arange(count) / count))
        spacing.append(curve.length / count)
    x, T, kappa, _ = moved_onto_lines(body, wave, np.concatenate(points), reach=0.0, steps=0)
    starts = np.cumsum([0, *map(len, points)]).astype(np.int64)
    # panels are exact to rounding
    return LineNodes(x, T, kappa, starts, np.array(spacing), error=1e-12), curves, critical.distance


def _curves(body: Surface, wave: FloatArray, mesh: Triangulation, critical: CriticalPoints) -> list[PanelCurve]:
    mesh, h = _resolve(body, wave, mesh, critical)
    edges, sides = _edges(mesh.triangles)
    loops = _loops(sides, h[mesh.triangles] >= 0)
    finer = halved(body, mesh)
    h_finer = np.concatenate([h, _values(body, wave, finer.vertices[len(h) :])])
    again = _loops(_edges(finer.triangles)[1], h_finer[finer.triangles] >= 0)
    if len(again) != len(loops):
        raise critical.error(
            f"has {len(loops)} curves on one mesh and {len(again)} on the next; it nearly crosses itself"
        )
    return [_curve(body, wave, mesh, edges[loop]) for loop in loops]


def _values(body: Surface, wave: FloatArray, points: FloatArray) -> FloatArray:
    gradient = body.gradient(points)
    return np.asarray(np.sum(gradient * travel(wave, points), axis=-1) / np.linalg.norm(gradient, axis=-1))


def _resolve(
    body: Surface, wave: FloatArray, mesh: Triangulation, critical: CriticalPoints
) -> tuple[Triangulation, FloatArray]:
    """Split triangles until none can hide a part of n.q = 0; the mesh and n.q at its vertices."""
    h, g = incidence(body, wave, mesh.vertices)
    # edges are halved so often at most
    for _ in range(22):
        unsafe = _unsafe(body, mesh, h, g)
        if not unsafe.any():
            _check_signs(critical, mesh, h)
            return mesh, h
        if len(mesh.triangles) > 400_000:
            break
        mesh = _split(body, mesh, unsafe)
        new_h, new_g = incidence(body, wave, mesh.vertices[len(h) :])
        h, g = np.concatenate([h, new_h]), np.concatenate([g, new_g])
    corner = mesh.vertices[mesh.triangles[np.flatnonzero(_unsafe(body, mesh, h, g))[:1], 0]]
    raise critical.error("nearly crosses itself, closer than the finest mesh can tell,", corner)


def _unsafe(body: Surface, mesh: Triangulation, h: FloatArray, g: FloatArray) -> BoolArray:
    """Triangles that the two conditions of the module do not clear: (m,)."""
    corners = mesh.vertices[mesh.triangles]
    e = np.max(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2), axis=1) / size(body)
    values, slopes = h[mesh.triangles], g[mesh.triangles]
    steep = np.linalg.norm(slopes, axis=2)
    one_sign = np.all(values > 0, axis=1) | np.all(values < 0, axis=1)
    empty = one_sign & (np.min(np.abs(values), axis=1) > 2 * e * np.max(steep, axis=1))
    rolled = np.roll(slopes, 1, axis=1)
    cone = np.all(np.sum(slopes * rolled, axis=2) > 0.5 * steep * np.roll(steep, 1, axis=1), axis=1)
    return np.asarray(~(empty | cone))


def _check_signs(critical: CriticalPoints, mesh: Triangulation, h: FloatArray) -> None:
    """The vertex nearest to a critical point lies on the same side of n.q = 0."""
    from scipy.spatial import cKDTree

    near = np.abs(critical.values) < 0.1
    if not near.any():
        return
    _, nearest = cKDTree(mesh.vertices).query(critical.points[near])
    wrong = (h[nearest] >= 0) != (critical.values[near] >= 0)
    if wrong.any():
        raise critical.error("nearly crosses itself", critical.points[near][wrong])


def _edges(triangles: IntArray) -> tuple[IntArray, IntArray]:
    """Vertex pairs of the edges (k, 2), and the edges of each triangle (m, 3), edge j from corner j to j + 1."""
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    ends.sort(axis=1)
    stride = int(triangles.max()) + 1
    keys, sides = np.unique(ends[:, 0] * stride + ends[:, 1], return_inverse=True)
    return np.stack([keys // stride, keys % stride], axis=1), sides.reshape(-1, 3)


def _loops(sides: IntArray, corner_signs: BoolArray) -> list[IntArray]:
    """Cycles of crossed edges, in walking order: arrays of edge numbers."""
    following = np.roll(corner_signs, -1, axis=1)
    mixed = np.any(corner_signs != following, axis=1)
    # exactly one edge of a mixed triangle falls and one rises
    leave = sides[mixed, np.argmax(corner_signs & ~following, axis=1)[mixed]]
    enter = sides[mixed, np.argmax(~corner_signs & following, axis=1)[mixed]]
    successor = dict(zip(enter.tolist(), leave.tolist(), strict=True))
    loops = []
    while successor:
        start, edge = successor.popitem()
        loop = [start]
        while edge != start:
            loop.append(edge)
            edge = successor.pop(edge)
        loops.append(np.array(loop, dtype=np.int64))
    return loops


def halved(body: Surface, mesh: Triangulation) -> Triangulation:
    """The mesh with every edge halved; old vertices keep their numbers."""
    return _split(body, mesh, np.ones(len(mesh.triangles), dtype=bool))


def _split(body: Surface, mesh: Triangulation, marked: BoolArray) -> Triangulation:
    """Halve all edges of marked triangles; neighbours are split at their longest edge first, which keeps angles.

    Old vertices keep their numbers and new ones follow, on the body.
    """
    edges, sides = _edges(mesh.triangles)
    lengths = np.linalg.norm(mesh.vertices[edges[:, 0]] - mesh.vertices[edges[:, 1]], axis=1)
    longest = np.argmax(lengths[sides], axis=1)
    cut = np.zeros(len(edges), dtype=bool)
    cut[sides[marked]] = True
    while True:
        touched = np.any(cut[sides], axis=1)
        needed = sides[touched, longest[touched]]
        if np.all(cut[needed]):
            break
        cut[needed] = True
    number = np.full(len(edges), -1, dtype=np.int64)
    number[cut] = len(mesh.vertices) + np.arange(int(cut.sum()))
    middles = project(body, mesh.vertices[edges[cut]].mean(axis=1))
    # corners turned so that the longest edge comes first
    turn = (longest[:, None] + np.arange(3)) % 3
    v0, v1, v2 = np.take_along_axis(mesh.triangles, turn, axis=1).T
    m0, m1, m2 = number[np.take_along_axis(sides, turn, axis=1)].T
    by_case = {
        (False, False, False): [(v0, v1, v2)],
        (True, False, False): [(v0, m0, v2), (m0, v1, v2)],
        (True, True, False): [(v0, m0, v2), (m0, v1, m1), (m0, m1, v2)],
        (True, False, True): [(m0, v1, v2), (v0, m0, m2), (m2, m0, v2)],
        (True, True, True): [(v0, m0, m2), (m0, v1, m1), (m2, m1, v2), (m0, m1, m2)],
    }
    triangles = []
    for (c0, c1, c2), parts in by_case.items():
        case = ((m0 >= 0) == c0) & ((m1 >= 0) == c1) & ((m2 >= 0) == c2)
        triangles += [np.stack([corner[case] for corner in part], axis=1) for part in parts]
    return Triangulation(np.concatenate([mesh.vertices, middles]), np.concatenate(triangles))


def _curve(body: Surface, wave: FloatArray, mesh: Triangulation, ends: IntArray) -> PanelCurve:
    """Curve through the crossings of a loop of edges (k, 2), on edges brought onto the body."""
    a, b = mesh.vertices[ends[:, 0]], mesh.vertices[ends[:, 1]]
    spacing = np.linalg.norm(b - a, axis=1)

    def value(t: FloatArray, k: IntArray) -> FloatArray:
        return _values(body, wave, project(body, a[k] + t[:, None] * (b - a)[k], iterations=4))

    share = find_root(value, (0.0, 1.0), args=(np.arange(len(a)),), tolerances={"xatol": 1e-9}).x
    nodes = project(body, a + share[:, None] * (b - a), iterations=4)
    moved = moved_onto_lines(body, wave, nodes, reach=1e-3 * size(body), steps=4).points
    # the bracket holds the branch; a step that leaves it has gone to another one
    stayed = np.linalg.norm(moved - nodes, axis=1) < 1e-3 * spacing
    return fit_panels(body, wave, moved[stayed], spacing[stayed])
