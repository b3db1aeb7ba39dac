"""Shadow lines as equally spaced nodes, on the coarsest mesh that is certain of them.

Where no mesh is certain, or next to a singular direction, a line is followed with its topology proven (`following`).

Sources: Derivations, R6 and R8.
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.geometry.evaluators import evaluators
from creeping.geometry.incident import rows_of
from creeping.geometry.memo import memo
from creeping.geometry.surface import Surface, normal, project, size
from creeping.kernels.threads import in_slices
from creeping.shadow.arcs import Arcs, finished
from creeping.shadow.curves import Curves, LineNodes
from creeping.shadow.meshes import LineMeshes
from creeping.shadow.status import FOLLOWED, NEAR_SINGULAR, OK, SINGULAR

FORBIDDEN = 1e-6
"""v of `critical_distances` below which a line counts as one that crosses itself."""


def prepared(body: Surface) -> LineMeshes:
    """Meshes of a body, made once."""
    return memo(body, "line meshes", lambda: LineMeshes(body))


def box_of(body: Surface) -> FloatArray:
    """Bounds as kernels take them: (2, 3), L."""
    return np.ascontiguousarray(body.bounds, dtype=float)


def critical_distances(body: Surface, waves: FloatArray) -> FloatArray:
    """v, least |n.q|/|q| at critical points of n.q with K = 0, inf without one: (n, 3 or 4) -> (n,).

    Of a point source within one body size no more than its height in body sizes: there its line is a small loop.
    """
    rows, ends = rows_of(waves), prepared(body).critical.reshape(-1, 9)
    n, b, x = (np.ascontiguousarray(ends[:, k : k + 3]) for k in (0, 3, 6))
    least = np.full(len(rows), np.inf)

    def run(part: slice) -> None:
        for row in range(part.start, part.stop):
            d, w = rows[row, :3], rows[row, 3]
            q = d + w * x if w else np.broadcast_to(d, x.shape)
            # where q comes to be along the null direction between two ends
            along = (np.sum(b * q, axis=1) if w else b @ d).reshape(-1, 2)
            crossed = np.repeat((along[:, 0] > 0) != (along[:, 1] > 0), 2)
            if crossed.any():
                value = np.sum(n[crossed] * q[crossed], axis=1) / np.linalg.norm(q[crossed], axis=1)
                (first, last), (low, high) = along[crossed[::2]].T, value.reshape(-1, 2).T
                least[row] = np.min(np.abs(low + first / (first - last) * (high - low)))

    in_slices(run, len(rows), multiple=1)
    for row in np.flatnonzero(rows[:, 3]):
        height = clearance(body, -rows[row, :3] / rows[row, 3])
        if height < size(body):
            least[row] = min(least[row], height / size(body))
    return least


def clearance(body: Surface, point: FloatArray) -> float:
    """Distance of a point (3,) from the body, L, negative inside; far away, of points 0.04 body sizes apart."""
    vertices = prepared(body).coarsest.vertices
    distances = np.linalg.norm(vertices - point, axis=1)
    height, near = float(np.min(distances)), vertices[[np.argmin(distances)]]
    for _ in range(16 if height < 0.3 * size(body) else 0):
        n, away = normal(body, near), point - near
        # by parts of the way: a foot next to a centre of curvature would be passed
        near = project(body, near + 0.5 * (away - np.sum(away * n, axis=1, keepdims=True) * n))
        height = min(height, float(np.linalg.norm(near - point)))
    return height if float(body.level(point[None])[0]) > 0 else -height


def judged(v: FloatArray, certain: BoolArray, turn: float, tier: int) -> tuple[BoolArray, IntArray]:
    """Which lines go on to the next mesh, and the codes of the others.

    A line is certain if every step was certain of it and the direction is so far from a singular one, v > e^2 with e
    the mean angle between neighbouring normals, that the mesh cannot have missed a small loop.
    """
    far = v > turn * turn
    last = tier >= LineMeshes.count - 2
    code = np.where(certain, np.where(far, OK, NEAR_SINGULAR), FOLLOWED)
    onward = ~certain | (~far & (not last))
    return (onward if tier < LineMeshes.count - 1 else np.zeros_like(onward)), code


class Traced(NamedTuple):
    """Lines of several waves on one mesh: their nodes, None where there is no line, and whether they are certain."""

    nodes: list[LineNodes | None]
    certain: BoolArray


def traced(body: Surface, waves: FloatArray, tier: int) -> Traced:
    """Nodes of the lines of waves (n, 4) on a mesh."""
    from creeping.shadow.kernels.trace import CERTAIN, CURVES, ERROR, FOUND, KNOWN, LEAST_NODES, lines_on_mesh

    mesh, n = prepared(body).packed(tier), len(waves)
    most = mesh[-1] + (LEAST_NODES + 8) * CURVES
    x, T, kappa = np.empty((n, most, 3)), np.empty((n, most, 3)), np.empty((n, most))
    starts, spacing, known = np.empty((n, CURVES + 1), np.int64), np.empty((n, CURVES)), np.zeros((n, KNOWN))
    with evaluators(body) as parts:
        extent = float(np.max(np.ptp(box_of(body), axis=0)))
        lines_on_mesh(*parts[:2], extent, mesh, waves, x, T, kappa, starts, spacing, known)
    nodes: list[LineNodes | None] = [None] * n
    for row in np.flatnonzero(known[:, FOUND]):
        curves = int(known[row, FOUND])
        own = slice(starts[row, curves])
        parts_of = x[row, own], T[row, own], kappa[row, own], starts[row, : curves + 1], spacing[row, :curves]
        nodes[row] = LineNodes(*parts_of, float(known[row, ERROR]))
    return Traced(nodes, known[:, CERTAIN] > 0)


class Sought(NamedTuple):
    """The line of a wave, nodes and arcs, None where it is to be followed; its code, and v."""

    line: tuple[LineNodes, Arcs] | None
    code: int
    distance: float


def line_nodes(body: Surface, wave: FloatArray) -> Sought:
    """The line of a wave on the coarsest mesh that is certain of it."""
    row = rows_of(wave)[None]
    v = critical_distances(body, row)
    if v[0] < FORBIDDEN:
        return Sought(None, SINGULAR, float(v[0]))
    for tier in range(LineMeshes.count):
        (nodes,), certain = traced(body, row, tier)
        line = None
        if nodes is not None:
            found = finished(body, Curves.of(row, [nodes]), 0)
            line, certain = (nodes, found.arcs), certain & found.certain
        onward, code = judged(v, certain, prepared(body).turn(tier), tier)
        if not onward[0]:
            return Sought(line if certain[0] else None, int(code[0]), float(v[0]))
    raise AssertionError("the last mesh sends no line on")
