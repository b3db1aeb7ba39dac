"""A shadow line as equally spaced nodes, on the coarsest mesh that is certain of it; its arcs and its launch points.

Where no mesh is certain, or next to a singular direction, the line is followed with its topology proven (`following`)
and the same kernels finish it.

Sources: Derivations, R6 and R8.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.geometry.evaluators import evaluators
from creeping.geometry.incident import rows_of
from creeping.geometry.memo import memo
from creeping.geometry.surface import Surface, normal, project, size
from creeping.kernels.threads import in_slices
from creeping.shadow.meshes import LineMeshes
from creeping.shadow.status import FOLLOWED, NEAR_SINGULAR, OK, SINGULAR

NEAR = 1e-3
"""Longest step, in body sizes, that brings an interpolated point onto the line."""
FORBIDDEN = 1e-6
"""v below which a line counts as one that crosses itself."""


@dataclass(frozen=True, eq=False)
class LineNodes:
    """Nodes of the closed curves of one line, the longest first.

    Attributes
    ----------
    points, tangents : (3, n), L and 1
        One curve after the other.
    curvature : (n,), 1/L
        kappa_n(q).
    starts : (curves + 1,)
        First node of each curve, and their number.
    spacing : (curves,), L
    error : float
        Estimated relative error of the length.
    """

    points: FloatArray
    tangents: FloatArray
    curvature: FloatArray
    starts: IntArray
    spacing: FloatArray
    error: float

    @property
    def length(self) -> float:
        """Length of all curves, L."""
        # one after the other, as the kernels add them
        return float(sum(self.spacing * np.diff(self.starts)))


@dataclass(frozen=True, eq=False)
class Finished:
    """Arcs and launch points of one line.

    Attributes
    ----------
    arcs : (a, 2)
        Ends in nodes of their curve, the second beyond their number where an arc comes round.
    curve, state : (a,)
        Of each arc.
    shares : (3,)
        Of the length, by state.
    launched : (rays, LAUNCHED), places : (rays,)
        See `creeping.shadow.kernels.trace`.
    certain : bool
    """

    arcs: FloatArray
    curve: IntArray
    state: IntArray
    shares: FloatArray
    launched: FloatArray
    places: np.ndarray[Any, np.dtype[np.int16]]
    certain: bool


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
    from creeping.shadow.kernels.trace import least_criticals

    rows = rows_of(waves)
    least = np.empty(len(rows))
    points = prepared(body).critical
    in_slices(lambda part: least_criticals(points, rows[part], least[part]), len(rows))
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


def line_nodes(body: Surface, wave: FloatArray) -> tuple[LineNodes | None, int, float]:
    """Nodes of the line of a wave, its code, and v; no nodes where the line is to be followed."""
    from creeping.shadow.kernels.trace import trace_nodes

    v = float(critical_distances(body, wave[None])[0])
    if v < FORBIDDEN:
        return None, SINGULAR, v
    box = box_of(body)
    for tier in range(LineMeshes.count):
        with evaluators(body) as parts:
            found, certain, x, T, kappa, starts, spacing, _, error = trace_nodes(
                *parts[:2], box, prepared(body).packed(tier), rows_of(wave)
            )
        nodes = LineNodes(x, T, kappa, starts, spacing, error) if found else None
        certain = nodes is not None and certain and finished(body, wave, nodes, 0).certain
        onward, code = judged(np.array([v]), np.array([certain]), prepared(body).turn(tier), tier)
        if not onward[0]:
            return nodes if certain else None, int(code[0]), v
    raise AssertionError("the last mesh sends no line on")


def polished(body: Surface, wave: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points next to a line moved onto it, with T and kappa_n(q): (n, 3) -> (n, 3), (n, 3), (n,)."""
    from creeping.kernels.block import BLOCK, aligned
    from creeping.shadow.kernels.newton import newton

    x, tangents, curvature = np.ascontiguousarray(points.T), np.empty((3, len(points))), np.empty(len(points))
    work, row = aligned(18, BLOCK), rows_of(wave)
    with evaluators(body) as parts:
        for _ in range(2):
            newton(*parts[:2], row, x, NEAR * size(body), work, tangents, curvature)
    return np.ascontiguousarray(x.T), np.ascontiguousarray(tangents.T), curvature


class Breaks(NamedTuple):
    """Where the state of a line may change: places and curves in order, the extreme nodes of its picture."""

    at: FloatArray
    where: IntArray
    number: int
    extreme: tuple[int, int, int, int]
    certain: bool


def finished(body: Surface, wave: FloatArray, nodes: LineNodes, n_rays: int, *, every: bool = False) -> Finished:
    """Arcs of a line, and so many launch points: on its attached arcs, or with ``every`` on the whole of it."""
    return shared(body, wave, nodes, _breaks(body, wave, nodes), n_rays, every=every)


def _breaks(body: Surface, wave: FloatArray, nodes: LineNodes) -> Breaks:
    from creeping.shadow.kernels.crossings import LIMIT
    from creeping.shadow.kernels.trace import find_breaks

    at, where = np.empty(LIMIT), np.empty(LIMIT, np.int64)
    certain, count, extreme = find_breaks(
        box_of(body), rows_of(wave), nodes.points, nodes.tangents, nodes.curvature, nodes.starts, len(nodes.spacing),
        nodes.spacing, at, where,
    )  # fmt: skip
    return Breaks(at, where, int(count), extreme, bool(certain))


def shared(
    body: Surface, wave: FloatArray, nodes: LineNodes, breaks: Breaks, n_rays: int, *, every: bool = False
) -> Finished:
    """Arcs between the breaks of a line, and launch points, as of `finished`."""
    from creeping.shadow.kernels.crossings import LIMIT
    from creeping.shadow.kernels.trace import ERROR, LAUNCHED, LENGTH, SHARES, SUMMARY, share_line
    from creeping.shadow.status import NO_RAY

    curves = len(nodes.spacing)
    summary, arcs = np.zeros(SUMMARY), np.empty((LIMIT + curves, 2))
    summary[LENGTH], summary[ERROR] = nodes.length, nodes.error
    which = np.empty((2, LIMIT + curves), np.int64)
    launched, places = np.full((n_rays, LAUNCHED), np.nan), np.full(n_rays, NO_RAY, np.int16)
    at, where, number, extreme, certain = breaks
    with evaluators(body) as parts:
        known, total = share_line(
            *parts[:2], box_of(body), rows_of(wave), nodes.points, nodes.starts, curves, nodes.spacing, extreme, at,
            where, number, every, summary, launched, places, arcs, which,
        )  # fmt: skip
    shares = summary[SHARES : SHARES + 3]
    return Finished(arcs[:total], which[0, :total], which[1, :total], shares, launched, places, certain and bool(known))
