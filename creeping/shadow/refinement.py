"""A shadow line followed by itself: its topology from a mesh that is refined until the signs decide it, then panels.

The last resort, some tenths of a second a line; what comes out is a `LineNodes` like any other.

Where a triangle could hide a crossing, a loop or a gap, it is split. It cannot if, with h = n.q, its gradient g on the
body, and e its longest edge,

    all h_i of one sign and min |h_i| > 2 e max |g_i|   (no zero inside), or
    g_i.g_j > |g_i||g_j|/2 for all i, j                 (the zeros inside are one graph).

Curves leave a triangle by the edge whose sign falls in counter-clockwise order, so they come out closed, with the lit
side (h < 0) on the left seen from outside: along T = grad F x Hq/|.|.

Sources: Derivations, R9.
"""

import numpy as np
from scipy.optimize.elementwise import find_root

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.geometry.incident import travel
from creeping.geometry.surface import Surface, project, size
from creeping.geometry.triangulation import Triangulation
from creeping.shadow.critical_points import CriticalPoints, critical_points, incidence
from creeping.shadow.curves import LineNodes, moved_onto_lines
from creeping.shadow.panels import PanelCurve, fit_panels

MAX_DEPTH = 22
"""Refinements of a triangle, each halving its edges."""
MAX_TRIANGLES = 400_000


NODES = (512, 16_384)
"""Fewest and most nodes of a curve."""
A_PANEL = 24
"""Nodes on the shortest panel."""


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
        count = int(np.clip(np.ceil(A_PANEL * curve.length / shortest), *NODES))
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
        raise _unsettled(
            critical, f"has {len(loops)} curves on one mesh and {len(again)} on the next; it nearly crosses itself"
        )
    return [_curve(body, wave, mesh, edges[loop]) for loop in loops]


def _values(body: Surface, wave: FloatArray, points: FloatArray) -> FloatArray:
    gradient = body.gradient(points)
    return np.asarray(np.sum(gradient * travel(wave, points), axis=-1) / np.linalg.norm(gradient, axis=-1))


def _unsettled(critical: CriticalPoints, trouble: str, points: FloatArray | None = None) -> Exception:
    if points is None:
        points = critical.points[np.argsort(np.abs(critical.values))[:1]]
    return critical.error(trouble, points)


def _resolve(
    body: Surface, wave: FloatArray, mesh: Triangulation, critical: CriticalPoints
) -> tuple[Triangulation, FloatArray]:
    """Split triangles until none can hide a part of n.q = 0; the mesh and n.q at its vertices."""
    h, g = incidence(body, wave, mesh.vertices)
    for _ in range(MAX_DEPTH):
        unsafe = _unsafe(body, mesh, h, g)
        if not unsafe.any():
            _check_signs(critical, mesh, h)
            return mesh, h
        if len(mesh.triangles) > MAX_TRIANGLES:
            break
        mesh = _split(body, mesh, unsafe)
        new_h, new_g = incidence(body, wave, mesh.vertices[len(h) :])
        h, g = np.concatenate([h, new_h]), np.concatenate([g, new_g])
    corner = mesh.vertices[mesh.triangles[np.flatnonzero(_unsafe(body, mesh, h, g))[:1], 0]]
    raise _unsettled(critical, "nearly crosses itself, closer than the finest mesh can tell,", corner)


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
        raise _unsettled(critical, "nearly crosses itself", critical.points[near][wrong])


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
