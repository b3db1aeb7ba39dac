"""Shadow lines as equally spaced nodes on meshes, and what a body is prepared with for them.

Where no mesh is certain, or next to a singular direction, a line is followed with its topology proven (`refinement`).

The gradient of n.d along the body is S d with S the shape operator. On n.d = 0 it vanishes only where K = 0 and d is
the null direction a of S there: those directions are singular, and form curves on the sphere. They bound the regions
in which the number of curves of the line is constant; to first order v = |n.d| at a critical point is the angle to
them.

Sources: Derivations, R6, R8 and R11.
"""

from functools import cached_property
from threading import RLock
from weakref import ref

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.geometry.curvature import gaussian_curvature, parabolic_crossings
from creeping.geometry.evaluators import evaluators
from creeping.geometry.incident import rows_of
from creeping.geometry.surface import Surface, memo, normal, project, size
from creeping.geometry.triangulation import Triangulation, triangulate
from creeping.kernels.threads import in_threads
from creeping.shadow.curves import LineNodes
from creeping.shadow.refinement import halved
from creeping.shadow.status import LineStatus

TIERS = ((2_500, 512), (10_000, 2048), (40_000, 4096), (160_000, 8192))
"""Vertices of the meshes, and nodes of a line on them; the last mesh is the one before with every edge halved."""


class LineMeshes:
    """Meshes from coarse to fine, each made when first asked for, and where K = 0.

    Parameters
    ----------
    body : Surface

    Raises
    ------
    SurfaceError
        If F = 0 has no closed triangulation in its bounds.
    """

    count = len(TIERS)

    def __init__(self, body: Surface) -> None:
        # no strong reference: meshes are kept as long as their body lives
        self._body = ref(body)
        self._meshes: dict[int, Triangulation] = {}
        self._packed: dict[int, tuple[Any, ...]] = {}
        self._lock = RLock()
        self.mesh(0)

    def mesh(self, tier: int) -> Triangulation:
        """Triangulation of a tier."""
        body: Any = self._body()
        with self._lock:
            if tier not in self._meshes:
                last = tier == len(TIERS) - 1
                self._meshes[tier] = halved(body, self.mesh(tier - 1)) if last else _mesh_of(body, TIERS[tier][0])
            return self._meshes[tier]

    def packed(self, tier: int) -> tuple[Any, ...]:
        """Mesh of a tier as `shadow.kernels.trace.lines_on_mesh` takes it."""
        with self._lock:
            if tier not in self._packed:
                self._packed[tier] = _packed(self._body(), self.mesh(tier), TIERS[tier][1])  # type: ignore[arg-type]
            return self._packed[tier]

    def turn(self, tier: int) -> float:
        """Rms angle between the normals at the ends of an edge, radians."""
        return float(self.packed(tier)[5])

    @property
    def coarsest(self) -> Triangulation:
        """The first mesh."""
        return self.mesh(0)

    @cached_property
    def critical(self) -> FloatArray:
        """(n, n x a, x) at both ends of the segments of K = 0: (m, 2, 9)."""
        # the finer the mesh, the fewer small parabolic loops are missed
        return singular_segments(self._body(), self.mesh(len(TIERS) - 2))  # type: ignore[arg-type]


def _mesh_of(body: Surface, vertices: int) -> Triangulation:
    """Triangulation with about so many vertices."""
    cells = int(np.sqrt(vertices / 3))
    for _ in range(4):
        mesh = triangulate(body, cells=max(cells, 8))
        ratio = np.sqrt(vertices / len(mesh.vertices))
        if 0.93 < ratio < 1.07:
            break
        cells = round(cells * float(ratio))
    return mesh


def _packed(body: Surface, mesh: Triangulation, nodes: int) -> tuple[Any, ...]:
    n = normal(body, mesh.vertices)
    ends = n[mesh.triangles]
    turn = np.linalg.norm(ends - np.roll(ends, 1, axis=1), axis=-1)
    return (
        np.ascontiguousarray(mesh.vertices.T),
        np.ascontiguousarray(n.T),
        # of one layout, for which kernels are compiled once; without a sign, of which each index would be asked
        np.ascontiguousarray(mesh.triangles, dtype=np.uint32),
        neighbours_of(mesh.triangles),
        mesh.edge_length,
        float(np.sqrt(np.mean(turn**2))),
        nodes,
    )


def neighbours_of(triangles: IntArray) -> np.ndarray[Any, np.dtype[np.uint32]]:
    """Triangle across the edge from corner k to corner k + 1, for a closed oriented mesh: (m, 3) -> (m, 3)."""
    m = len(triangles)
    edges = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2).astype(np.int64)
    code = edges[:, 0] * (edges.max() + 1) + edges[:, 1]
    reverse = edges[:, 1] * (edges.max() + 1) + edges[:, 0]
    order = np.argsort(code)
    across = order[np.searchsorted(code[order], reverse)] // 3
    return np.asarray(across.reshape(m, 3), dtype=np.uint32)


def singular_segments(body: Surface, mesh: Triangulation) -> FloatArray:
    """Ends (n, n x a, x) of the segments in which K = 0 crosses the triangles of a mesh: (m, 2, 9)."""
    K = gaussian_curvature(body, mesh.vertices)
    t, k = np.nonzero((K[mesh.triangles] > 0) != (K[np.roll(mesh.triangles, -1, axis=1)] > 0))
    first, last = mesh.triangles[t, k], mesh.triangles[t, (k + 1) % 3]
    points, n, a, _ = parabolic_crossings(body, mesh.vertices[first], mesh.vertices[last], K[first], K[last])
    # two edges of a triangle are crossed; they follow each other in t
    n, a = n.reshape(-1, 2, 3), a.reshape(-1, 2, 3)
    a[:, 1] *= np.where(np.sum(a[:, 0] * a[:, 1], axis=-1) < 0, -1.0, 1.0)[:, None]
    return np.ascontiguousarray(np.concatenate([n, np.cross(n, a), points.reshape(-1, 2, 3)], axis=-1))


def prepared(body: Surface) -> LineMeshes:
    """Meshes of a body for shadow lines, cached."""
    return memo(body, "line meshes", lambda: LineMeshes(body))


def critical_distances(body: Surface, waves: FloatArray) -> FloatArray:
    """v, least |n.q|/|q| at critical points of n.q with K = 0, inf without one: (n, 3 or 4) -> (n,).

    Of a point source within one body size no more than its height in body sizes: there its line is a small loop.
    """
    rows, ends = rows_of(waves), prepared(body).critical.reshape(-1, 9)
    n, b, x = (np.ascontiguousarray(ends[:, k : k + 3]) for k in (0, 3, 6))
    least = np.full(len(rows), np.inf)

    def run(part: slice) -> None:
        q = rows[part, None, :3] + rows[part, None, 3:] * x
        # where q comes to be along the null direction between two ends
        along, value = (np.einsum("rek,ek->re", q, one).reshape(len(q), -1, 2) for one in (b, n))
        row, segment = np.nonzero((along[..., 0] > 0) != (along[..., 1] > 0))
        value = value[row, segment] / np.linalg.norm(q.reshape(len(q), -1, 2, 3)[row, segment], axis=-1)
        first, last = along[row, segment].T
        between = value[:, 0] + first / (first - last) * (value[:, 1] - value[:, 0])
        np.minimum.at(least, part.start + row, np.abs(between))

    # of many segments it takes much memory
    in_threads(run, len(rows), least=256, most=64)
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
    code = np.where(certain, np.where(far, LineStatus.OK, LineStatus.NEAR_SINGULAR), LineStatus.FOLLOWED)
    onward = ~certain | (~far & (not last))
    return (onward if tier < LineMeshes.count - 1 else np.zeros_like(onward)), code


def traced(body: Surface, waves: FloatArray, tier: int) -> tuple[list[LineNodes | None], BoolArray]:
    """Nodes of the lines of waves (n, 4) on a mesh, None where there is no line, and whether they are certain (n,)."""
    from creeping.shadow.kernels.trace import CURVES, LEAST_NODES, lines_on_mesh

    mesh, n = prepared(body).packed(tier), len(waves)
    most = mesh[-1] + (LEAST_NODES + 8) * CURVES
    x, T, kappa = np.empty((n, most, 3)), np.empty((n, most, 3)), np.empty((n, most))
    starts, spacing = np.empty((n, CURVES + 1), np.int64), np.empty((n, CURVES))
    found, certain, error = np.zeros(n, np.int64), np.zeros(n, dtype=bool), np.zeros(n)
    with evaluators(body) as parts:
        extent = float(np.max(np.ptp(body.bounds, axis=0)))
        lines_on_mesh(*parts[:2], extent, mesh, waves, x, T, kappa, starts, spacing, found, certain, error)
    nodes: list[LineNodes | None] = [None] * n
    for row in np.flatnonzero(found):
        curves = found[row]
        own = slice(starts[row, curves])
        parts_of = x[row, own], T[row, own], kappa[row, own], starts[row, : curves + 1], spacing[row, :curves]
        nodes[row] = LineNodes(*parts_of, float(error[row]))
    return nodes, certain
