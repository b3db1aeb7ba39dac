"""Monge charts (see `scatterers.charts.monge`), and a choice of them that covers a body, by lazy greedy set cover.

h is followed from the centre of the square: over s q, s to 1, Newton steps h <- h - F/(g.N) start from the Taylor
series of the place before, dh/ds = -(g.q)/(g.N). Charts are chosen over a cloud of points of the body.

With S the shape operator P H P/|grad F| and kappa the larger |eigenvalue|, a chart about a point of the cloud is as
wide as n.N >= LEAST and w max(kappa) <= 0.9 allow on its square widened by the margin. It covers the points with
n.N >= 0.45 and |q.E1|, |q.E2| <= w - gap, ``gap`` being how far other points of the body may be from a point of the
cloud: so what lies between is covered too. Gaps are measured by `probes`, points between those of the cloud.

The greedy rule is that of [C79]; Derivations, B3.
"""

from dataclasses import dataclass
from heapq import heapify, heapreplace

import numpy as np
from scipy.sparse import coo_array
from scipy.spatial import cKDTree

from creeping._typing import BoolArray, FloatArray, IntArray
from scatterers.body import tangents
from scatterers.charts.samples import Field, step_onto
from scatterers.kernels.charts import ATLAS


@dataclass(frozen=True, eq=False)
class MongeCharts:
    """Charts by their squares, or one of them with (...) = ().

    Attributes
    ----------
    level, gradient : callable
        F and its gradient, (..., 3) -> (...) and (..., 3).
    centres : (..., 3), L
    axes : (..., 3, 3)
        Rows E1, E2, N.
    half : (...), L
        Half widths.
    bend : (..., 2, 2), 1/L
        Second derivatives of h at the centres.
    """

    level: Field
    gradient: Field
    centres: FloatArray
    axes: FloatArray
    half: FloatArray
    bend: FloatArray

    def __getitem__(self, index: int | IntArray) -> "MongeCharts":
        parts = (np.asarray(v[index]) for v in (self.centres, self.axes, self.half, self.bend))
        return MongeCharts(self.level, self.gradient, *parts)

    def points(self, uv: FloatArray) -> FloatArray:
        """Points of the body, L, over (u, v) (..., 2), broadcast against the charts: (..., 3)."""
        e1, e2, n = np.moveaxis(self.axes, -2, 0)
        s = 2 * uv - 1
        half = self.half[..., None]
        q = half * (s[..., :1] * e1 + s[..., 1:] * e2)
        # h, dh/ds and d2h/ds2 at the centre
        h, slope = np.zeros(q.shape[:-1]), np.zeros(q.shape[:-1])
        bend = self.half**2 * np.einsum("...i,...ij,...j->...", s, self.bend, s)
        last = 0.0
        for step in (0.3, 0.55, 0.75, 0.9, 1.0):
            ds = step - last
            h = h + ds * (slope + 0.5 * ds * bend)
            h, moved, g = self._newton(step * q, h, 2 if step < 1 else 12)
            along = -np.sum(g * q, axis=-1) / self._lean(g, n)
            bend, slope, last = (along - slope) / ds, along, step
        x = self.centres + q + h[..., None] * n
        lost = ~(moved <= 1e-9 * self.half)
        if lost.any():
            # beyond the reach of a chart there may be nothing over a point: any place on the body keeps rays finite
            y, reach = x[lost], 0.25 * np.broadcast_to(self.half, lost.shape)[lost]
            for _ in range(20):
                y = y + np.nan_to_num(step_onto(self.level(y), self.gradient(y), reach)[0])
            x[lost] = y
        return np.asarray(x)

    def _newton(self, q: FloatArray, h: FloatArray, most: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Height over q, length of the last step, and the gradient before it."""
        n = self.axes[..., 2, :]
        for _ in range(most):
            x = self.centres + q + h[..., None] * n
            g = self.gradient(x)
            step = np.clip(-self.level(x) / self._lean(g, n), -0.25 * self.half, 0.25 * self.half)
            h = h + step
            moved = np.abs(step)
            if np.all(moved <= 1e-10 * self.half):
                break
        return h, moved, g

    @staticmethod
    def _lean(g: FloatArray, n: FloatArray) -> FloatArray:
        """g.N, kept away from zero: with less a graph over the tangent plane is not followed."""
        return np.asarray(np.maximum(np.sum(g * n, axis=-1), 0.05 * np.linalg.norm(g, axis=-1) + 1e-300))


# least n.N on the widened square, and on points that look for their chart
LEAST, VALID = 0.2, 0.4
# how much a chart that meets another sheet, or has no height, is shrunk
SHRINK = 0.93


def probes(level: Field, gradient: Field, cloud: FloatArray, *, seed: int) -> FloatArray:
    """Points of the body about those of a cloud (n, 3), L, four for each: (4 n, 3)."""
    rng = np.random.default_rng(seed)
    n = gradient(cloud)
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    around, _ = cKDTree(cloud).query(cloud, k=[6])
    radius = np.repeat(around[:, 0], 4) * np.sqrt(rng.random(4 * len(cloud)))
    shift = rng.normal(size=(4 * len(cloud), 3))
    n = np.repeat(n, 4, axis=0)
    shift -= np.sum(shift * n, axis=-1, keepdims=True) * n
    x = np.repeat(cloud, 4, axis=0) + radius[:, None] * shift / np.linalg.norm(shift, axis=-1, keepdims=True)
    for _ in range(5):
        g = gradient(x)
        step = level(x) / np.sum(g * g, axis=-1)
        x -= step[:, None] * g
        if np.max(np.abs(step)) < 1e-9 * np.max(radius):
            break
    return np.asarray(x)


@dataclass(frozen=True, eq=False)
class _Cloud:
    """Points of a body, with what the choice of charts needs to know there.

    Attributes
    ----------
    level, gradient : callable
    points : (n, 3)
    axes : (n, 3, 3)
        Rows E1, E2 (principal), N.
    curvatures : (n, 2)
        Along E1 and E2, positive where convex.
    gap : (n,)
        How far others may be for which this is the nearest.
    tree : cKDTree
    first, neighbours : (n + 1,), (k,)
        Neighbours in compressed rows.
    """

    level: Field
    gradient: Field
    points: FloatArray
    axes: FloatArray
    curvatures: FloatArray
    gap: FloatArray
    tree: cKDTree
    first: IntArray
    neighbours: IntArray

    @classmethod
    def of(cls, level: Field, gradient: Field, hessian: Field, points: FloatArray) -> "_Cloud":
        axes, curvatures = _principal(gradient(points), hessian(points))
        tree = cKDTree(points)
        distance, nearest = tree.query(probes(level, gradient, points, seed=0))
        gap = np.zeros(len(points))
        np.maximum.at(gap, nearest, distance)
        # what few probes missed
        gap = np.maximum(gap, np.median(gap))
        pairs = tree.query_pairs(2.2 * float(gap.max()), output_type="ndarray")
        # sheets of a thin body are no neighbours
        pairs = pairs[np.sum(axes[pairs[:, 0], 2] * axes[pairs[:, 1], 2], axis=-1) > 0.5]
        n = len(points)
        graph = coo_array((np.ones(len(pairs), dtype=np.int8), pairs.T), shape=(n, n))
        rows = (graph + graph.T).tocsr()
        first, neighbours = rows.indptr.astype(np.int64), rows.indices.astype(np.int64)
        return cls(level, gradient, points, axes, curvatures, gap, tree, first, neighbours)

    def graphs(self, start: IntArray, half: FloatArray) -> MongeCharts:
        """Charts about points of the cloud."""
        bend = -self.curvatures[start][:, :, None] * np.eye(2)
        return MongeCharts(self.level, self.gradient, self.points[start], self.axes[start], half, bend)

    @property
    def bent(self) -> FloatArray:
        """Largest curvature of the points."""
        return np.asarray(np.abs(self.curvatures).max(axis=-1))

    def spread(self, among: IntArray, apart: float) -> IntArray:
        """Some of the points ``among``: two are so many smaller radii of curvature apart, or a tenth of the box."""
        alive = np.zeros(len(self.points), dtype=bool)
        alive[among] = True
        chosen = []
        extent = float(np.linalg.norm(np.ptp(self.points, axis=0)))
        radius = apart / np.maximum(self.bent, apart / (0.1 * extent))
        for k in among:
            if alive[k]:
                chosen.append(k)
                near = np.array(self.tree.query_ball_point(self.points[k], radius[k]), dtype=np.int64)
                distance = np.linalg.norm(self.points[near] - self.points[k], axis=-1)
                # flat parts leave the points of nearby edges alone
                alive[near[distance <= radius[near]]] = False
        return np.array(chosen, dtype=np.int64)


def _principal(gradient: FloatArray, hessian: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Frames (n, 3, 3), rows E1, E2, N, and the curvatures (n, 2) along E1 and E2."""
    size = np.linalg.norm(gradient, axis=-1)
    n = gradient / size[:, None]
    e, f = tangents(n)
    a, b, c = (np.einsum("ni,nij,nj->n", p, hessian, q) / size for p, q in ((e, e), (e, f), (f, f)))
    angle = 0.5 * np.arctan2(2 * b, a - c)
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    axes = np.stack([cos * e + sin * f, cos * f - sin * e, n], axis=1)
    middle, spread = 0.5 * (a + c), np.hypot(0.5 * (a - c), b)
    return axes, np.stack([middle + spread, middle - spread], axis=-1)


class _Candidates:
    """Charts to choose from: number of the centre, half width, covered points, bounds of the heights.

    Their axes are the principal directions at the centre.
    """

    def __init__(self, cloud: _Cloud, margin: float) -> None:
        self.cloud, self.wider = cloud, 1 + margin
        self.start = np.zeros(0, dtype=np.int64)
        self.half, self.heights = np.zeros(0), np.zeros((0, 2))
        self.covered: list[IntArray] = []

    def add(self, start: IntArray, longest: FloatArray) -> None:
        """Charts about points of the cloud, half widths ``longest`` at most."""
        from scatterers.kernels.charts import grow

        # as often as a chart that meets another sheet, or has no height, is shrunk
        times = 8
        cloud = self.cloud
        normals = np.ascontiguousarray(cloud.axes[:, 2])
        graph = cloud.points, normals, cloud.bent, cloud.first, cloud.neighbours, cloud.gap
        for attempt in range(times):
            if not len(start):
                return
            axes = np.ascontiguousarray(cloud.axes[start])
            half, begin, covered, heights = grow(
                start, axes, longest * self.wider, *graph, LEAST, 0.45, 0.9 * self.wider, self.wider
            )
            lists = np.split(covered, begin[1:-1])
            # corners are where a point of the cloud may be too far to tell
            torn = self._torn(cloud.graphs(start, half), 2)
            good = ~torn if attempt < times - 1 else np.ones(len(start), dtype=bool)
            self.start = np.concatenate([self.start, start[good]])
            self.half = np.concatenate([self.half, half[good]])
            self.heights = np.concatenate([self.heights, heights[good]])
            self.covered += [lists[k] if not torn[k] else lists[k][:0] for k in np.flatnonzero(good)]
            start, longest = start[~good], SHRINK * half[~good]

    def _torn(self, graphs: MongeCharts, side: int) -> BoolArray:
        """Charts over whose widened squares, tried at side x side points, there is no graph."""
        s = np.linspace(-self.wider, self.wider, side)
        uv = 0.5 + 0.5 * np.stack(np.meshgrid(s, s), axis=-1).reshape(-1, 1, 2)
        x = graphs.points(uv)
        q = np.einsum("nij,pnj->pni", graphs.axes[:, :2], x - graphs.centres) / graphs.half[:, None]
        n = graphs.gradient(x)
        lean = np.einsum("pnj,nj->pn", n, graphs.axes[:, 2]) / np.linalg.norm(n, axis=-1)
        bad = (np.max(np.abs(q - (2 * uv - 1)), axis=-1) > 1e-6) | ~(lean > 0.5 * LEAST)
        return np.asarray(np.any(bad, axis=0))

    def chosen(self) -> list[int]:
        """Greedily few that cover what all of them cover."""
        free = np.ones(len(self.cloud.points), dtype=bool)
        heap = [(-len(c), k) for k, c in enumerate(self.covered)]
        heapify(heap)
        found: list[int] = []
        # gains only fall: one that is still the largest when counted anew is the best
        while heap and heap[0][0] < 0:
            gain, k = heap[0]
            now = -int(np.count_nonzero(free[self.covered[k]]))
            if now == gain:
                free[self.covered[k]] = False
                found.append(k)
                now = 0
            heapreplace(heap, (now, k))
        # without those whose points others cover
        times = np.zeros(len(self.cloud.points), dtype=np.int64)
        for k in found:
            times[self.covered[k]] += 1
        kept = []
        for k in found:
            if np.all(times[self.covered[k]] > 1):
                times[self.covered[k]] -= 1
            else:
                kept.append(k)
        return kept

    def bounds(self, k: int) -> FloatArray:
        """Bounds of the height over the unit square, for points between those of the cloud too."""
        low, high = self.heights[k]
        slack = 0.1 * (high - low) + 2 * self.cloud.gap.max()
        return np.array([low - slack, high + slack])

    def valid(self, k: int) -> tuple[IntArray, FloatArray]:
        """Points of the cloud that would take the chart for theirs, and their max(|2u - 1|, |2v - 1|)."""
        cloud, low_high = self.cloud, self.bounds(k)
        centre, axes = cloud.points[self.start[k]], cloud.axes[self.start[k]]
        radius = np.sqrt(2 * self.half[k] ** 2 + np.max(low_high**2))
        near = np.array(cloud.tree.query_ball_point(centre, radius), dtype=np.int64)
        q = (cloud.points[near] - centre) @ axes.T
        rho = np.max(np.abs(q[:, :2]), axis=-1) / self.half[k]
        good = (
            (rho <= 1) & (cloud.axes[near, 2] @ axes[2] >= VALID) & (q[:, 2] >= low_high[0]) & (q[:, 2] <= low_high[1])
        )
        return near[good], rho[good]

    def failing(self, graphs: MongeCharts, which: list[int]) -> list[int]:
        """Charts that another sheet of the body enters, or over whose widened square there is no graph."""
        cloud, torn = self.cloud, self._torn(graphs, 7)
        bad = []
        for k, no_graph in zip(which, torn, strict=True):
            near, rho = self.valid(k)
            inside = rho * self.half[k] <= self.half[k] - cloud.gap[near]
            if no_graph or not np.all(np.isin(near[inside], self.covered[k])):
                bad.append(k)
        return bad


def covered_by(
    level: Field, gradient: Field, hessian: Field, points: FloatArray, margin: float
) -> tuple[MongeCharts, FloatArray]:
    """Charts that cover the body and all its cloud of points (n, 3), L, and the parameters of their locator.

    Raises
    ------
    ValueError
        If no cover is found; with how much is left.
    """
    cloud = _Cloud.of(level, gradient, hessian, points)
    # distance of candidates in radii of curvature
    candidates, apart = _Candidates(cloud, margin), 0.25
    fresh, before = cloud.spread(np.arange(len(points)), apart), len(points)
    for _ in range(12):
        candidates.add(fresh, np.full(len(fresh), np.inf))
        which = candidates.chosen()
        graphs = cloud.graphs(candidates.start[which], candidates.half[which])
        bad = candidates.failing(graphs, which)
        if bad:
            candidates.add(candidates.start[bad], SHRINK**4 * candidates.half[bad])
            for k in bad:
                candidates.covered[k] = candidates.covered[k][:0]
        missed = np.ones(len(points), dtype=bool)
        for k in which:
            missed[candidates.covered[k]] = False
        if not bad and not missed.any():
            return graphs, _located(candidates, graphs, which)
        if not bad and missed.sum() >= before:
            break
        before = missed.sum()
        fresh = cloud.spread(np.flatnonzero(missed), 0.5 * apart)
    first = int(np.argmax(missed))
    raise ValueError(
        f"no charts for {int(missed.sum())} of {len(points)} points of the body (first near "
        f"{points[first].round(4).tolist()}, with a radius of curvature of {1 / cloud.bent[first]:.2g} L and points "
        f"{cloud.gap[first]:.2g} L apart); give a denser cloud, or a body without thin or sharp parts"
    )


def _located(candidates: _Candidates, graphs: MongeCharts, which: list[int]) -> FloatArray:
    """Parameters of the locator of these charts, as `scatterers.kernels.charts` orders them.

    Each voxel lists the charts that suit the points of the body in it best, or nearly so.
    """
    cloud, number = candidates.cloud, len(which)
    eps = 1.01 * float(cloud.gap.max())
    found = [candidates.valid(k) for k in which]
    point = np.concatenate([near for near, _ in found])
    rho = np.concatenate([r for _, r in found])
    chart = np.repeat(np.arange(len(which)), [len(near) for near, _ in found])
    best = np.full(len(cloud.points), np.inf)
    np.minimum.at(best, point, rho)
    # rho changes by eps/w at most on the way from a point of the cloud to any that is nearest to it
    good = rho <= best[point] + 2 * eps / graphs.half.min()
    point, chart = point[good], chart[good]
    # a ball about a point of the cloud meets at most the voxels of the corners of the cube about it
    side = max(2.01 * eps, 0.3 * float(np.median(graphs.half)))
    origin = cloud.points.min(0) - 1.5 * eps
    shape = (np.ceil((cloud.points.max(0) + 1.5 * eps - origin) / side)).astype(np.int64)
    corners = np.stack(np.meshgrid(*3 * [[-eps, eps]]), axis=-1).reshape(-1, 1, 3)
    voxel = np.floor((cloud.points[point] + corners - origin) / side).astype(np.int64)
    code = np.ravel_multi_index(tuple(np.moveaxis(voxel, -1, 0)), tuple(shape))
    pairs = np.unique((code * number + chart).ravel())
    code, chart = pairs // number, pairs % number
    voxel, begin, count = np.unique(code, return_index=True, return_counts=True)
    # behind the charts the table, an empty list, then that of each voxel with its length before it
    first = ATLAS.charts + ATLAS.width * number
    lists = first + int(np.prod(shape))
    entry = lists + 1 + begin + np.arange(len(voxel))
    table = np.full(int(np.prod(shape)), float(lists))
    table[voxel] = entry
    tail = np.zeros(1 + len(chart) + len(voxel))
    tail[entry - lists] = count
    tail[np.arange(len(chart)) + np.repeat(np.arange(len(voxel)), count) + 2] = chart
    header = np.array([*origin, 1 / side, *shape, first, VALID, candidates.wider], dtype=float)
    heights = np.stack([candidates.bounds(k) for k in which])
    rows = [graphs.centres, graphs.axes.reshape(-1, 9), 1 / graphs.half[:, None], heights]
    return np.concatenate([header, np.concatenate(rows, axis=1).ravel(), table, tail])
