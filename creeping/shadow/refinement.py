"""Closed curves n.q = 0 on the body, their topology from a mesh that is refined until the signs decide it.

Where a triangle could hide a crossing, a loop or a gap, it is split. It cannot if, with h = n.q, its gradient g on the
body, and e its longest edge,

    all h_i of one sign and min |h_i| > 2 e max |g_i|   (no zero inside), or
    g_i.g_j > |g_i||g_j|/2 for all i, j                 (the zeros inside are one graph).

Curves leave a triangle by the edge whose sign falls in counter-clockwise order, so they come out closed, with the lit
side (h < 0) on the left seen from outside: along T = grad F x Hq/|.|.

Sources: Derivations, R9.
"""

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.geometry.incident import travel
from creeping.geometry.surface import Surface, project, size
from creeping.geometry.triangulation import Triangulation
from creeping.shadow.critical_points import CriticalPoints, incidence
from creeping.shadow.panels import PanelCurve, fit_panels, onto_line

MAX_DEPTH = 22
"""Refinements of a triangle, each halving its edges."""
MAX_TRIANGLES = 400_000


def shadow_curves(body: Surface, wave: FloatArray, mesh: Triangulation, critical: CriticalPoints) -> list[PanelCurve]:
    """Trace the closed curves n.q = 0, exact at every arclength.

    Parameters
    ----------
    body, wave : Surface, (3,) or (4,)
    mesh : Triangulation
    critical : CriticalPoints
        Of n.q, none at n.q = 0; what an error names.

    Returns
    -------
    list of PanelCurve

    Raises
    ------
    SingularIncidenceError
        If the topology is not settled at the finest mesh.
    """
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
    return [_curve(body, wave, mesh, edges[loop], h) for loop in loops]


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


def _curve(body: Surface, wave: FloatArray, mesh: Triangulation, ends: IntArray, h: FloatArray) -> PanelCurve:
    """Curve through the crossings of a loop of edges (k, 2)."""
    a, b = mesh.vertices[ends[:, 0]], mesh.vertices[ends[:, 1]]
    spacing = np.linalg.norm(b - a, axis=1)
    nodes = _crossings(body, wave, a, h[ends[:, 0]], b, h[ends[:, 1]])
    polished = onto_line(body, wave, nodes, reach=1e-3 * size(body))
    # the bracket holds the branch; a polish that leaves it has gone to another one
    stayed = np.linalg.norm(polished - nodes, axis=1) < 1e-3 * spacing
    return fit_panels(body, wave, polished[stayed], spacing[stayed])


def _crossings(
    body: Surface, wave: FloatArray, a: FloatArray, ha: FloatArray, b: FloatArray, hb: FloatArray
) -> FloatArray:
    """Points with n.q = 0 on edges brought onto the body, by the Illinois rule in t of a + t (b - a): (k, 3)."""
    low, high = np.zeros(len(a)), np.ones(len(a))
    h_low, h_high = ha.copy(), hb.copy()
    moved_high = np.full(len(a), -1)
    points = a
    for _ in range(12):
        t = (low * h_high - high * h_low) / np.where(h_high == h_low, 1.0, h_high - h_low)
        points = project(body, a + t[:, None] * (b - a), iterations=4)
        value = _values(body, wave, points)
        if np.max(np.abs(value)) < 1e-9:
            break
        to_high = (value >= 0) == (h_high >= 0)
        # an end kept twice has its value halved, so that both ends close in
        h_low = np.where(to_high, np.where(moved_high == 1, 0.5 * h_low, h_low), value)
        h_high = np.where(to_high, value, np.where(moved_high == 0, 0.5 * h_high, h_high))
        moved_high = to_high.astype(int)
        low, high = np.where(to_high, low, t), np.where(to_high, t, high)
    return np.asarray(points)
