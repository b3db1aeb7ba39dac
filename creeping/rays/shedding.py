"""Which creeping rays are shed towards an observer: all of them, off the body or on it.

    at y off the body         x(σ, s) + l p(σ, s) = y,  l > 0
    at y on the body          x(σ, s) = y

In each case two functions on the strip vanish together, n.v and b.v with v = y - x (on the body: y - x along two
tangents at y). Cells in which both change sign start Newton's method on the strip's splines. From a point at a low
height h above the body n.v > 0 only on a spot within √(2h/κ) of the point below it, which may be smaller than a cell:
there the search starts on the rays through the point below, √(2h/κₙ) before it.

Sources: Derivations, R12.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.geometry.directions import first_of_equals, tangent_frames
from creeping.geometry.patches import Rows
from creeping.geometry.quadrature import SYMMETRIC, nearest_points
from creeping.geometry.surface import Surface, normal, project, size
from creeping.rays.quantities import RayPoints
from creeping.rays.strips import Strip, gather
from creeping.shadow.attachment import occluded

CLOSE = 1e-9
"""Residual at which a search ends, in radians or body sizes; splines of a coarse fan leave up to 1000 times that."""


@dataclass(frozen=True, eq=False)
class ShedRays(Rows):
    """Rays that reach observers.

    Attributes
    ----------
    observer : (n,) of int
        Row of the observer.
    strip : (n,) of int
        Strip of the ray.
    sigma : (n,), L
        Its position on the strip.
    rays : RayPoints
        (n,) Where the rays leave the body, or are on it.
    reach : (n,), L
        l from there to the observer: 0 on the body.
    """

    observer: IntArray
    strip: IntArray
    sigma: FloatArray
    rays: RayPoints
    reach: FloatArray


_Functions = tuple[FloatArray, FloatArray, Callable[[IntArray, IntArray], BoolArray]]
_Step = Callable[[RayPoints, tuple[FloatArray, FloatArray], FloatArray], tuple[FloatArray, FloatArray]]
_Places = tuple[IntArray, IntArray, FloatArray, FloatArray]
"""Observers (n,), strips (n,), σ and s (n,)."""


def free_ways(body: Surface, rays: RayPoints, reach: FloatArray | float = np.inf) -> BoolArray:
    """Whether the tangents of rays (n,) get clear of the body up to a distance, L: (n,).

    Splines between rays leave points inside the body and tangents that dip into it by their error: both are put right.
    """
    x = project(body, rays.points)
    n = normal(body, x)
    along = rays.directions - np.sum(rays.directions * n, axis=-1, keepdims=True) * n
    return ~occluded(body, x, -along, reach)


def shed_near(strips: tuple[Strip, ...], body: Surface, points: FloatArray) -> ShedRays:
    """Rays whose tangents pass through the points (m, 3) off the body."""
    scale = size(body)

    def functions(some: FloatArray, x: FloatArray, n: FloatArray, b: FloatArray, p: FloatArray) -> _Functions:
        across, aside = (some @ v - np.sum(x * v, axis=0) for v in (n, b))
        return across, aside, lambda row, at: np.sum((some[row] - x[:, at].T) * p[:, at].T, axis=1) > 0

    def step(at: RayPoints, slopes: tuple[FloatArray, FloatArray], target: FloatArray) -> tuple[FloatArray, FloatArray]:
        away = target - at.points
        reach = np.sum(away * at.directions, axis=-1) / np.sum(at.directions**2, axis=-1)
        columns = [v[:, :3] + reach[:, None] * v[:, 3:] for v in slopes]
        # the length l is eliminated: only what lies across p counts
        columns = [v - np.sum(v * at.directions, axis=-1, keepdims=True) * at.directions for v in columns]
        return np.stack(columns, axis=-1) / scale, (away - reach[:, None] * at.directions) / scale

    low = _before_feet(strips, body, points)
    observer, strip, sigma, rays = _search(strips, body, points, functions, step, low)
    reach = np.sum((points[observer] - rays.points) * rays.directions, axis=-1)
    ahead = reach > 0
    return ShedRays(observer[ahead], strip[ahead], sigma[ahead], rays[ahead], reach[ahead])


def _before_feet(strips: tuple[Strip, ...], body: Surface, points: FloatArray) -> _Places:
    """About where rays leave towards points (m, 3) so low above the body that cells may miss it."""
    foot, _, hessians, height = nearest_points(body, points)
    # |H|/|grad F| is no less than either curvature
    bent = np.linalg.norm(hessians[:, SYMMETRIC], axis=(1, 2))
    widest = max((max(strip.cell) for strip in strips), default=0.0)
    low = np.flatnonzero((height > 0) & (height < 2 * bent * widest**2))
    found = shed_on(strips, body, foot[low])
    row, curvature, s = low[found.observer], found.rays.curvature[1], found.rays.time
    with np.errstate(divide="ignore", invalid="ignore"):
        before = s - np.sqrt(2 * height[row] / curvature)
    good = (curvature > 0) & (before > 0)
    return row[good], found.strip[good], found.sigma[good], before[good]


def shed_on(strips: tuple[Strip, ...], body: Surface, points: FloatArray) -> ShedRays:
    """Rays that pass through the points (m, 3) on the body."""
    scale = size(body)
    normals = normal(body, points)
    frames = np.concatenate([points, normals, *tangent_frames(normals)], axis=1)

    def functions(some: FloatArray, x: FloatArray, n: FloatArray, b: FloatArray, p: FloatArray) -> _Functions:
        y, outward, e, f = (some[:, 3 * k : 3 * k + 3] for k in range(4))
        return (
            e @ x - np.sum(e * y, axis=1, keepdims=True),
            f @ x - np.sum(f * y, axis=1, keepdims=True),
            lambda row, at: np.sum(outward[row] * n[:, at].T, axis=1) > 0,
        )

    def step(at: RayPoints, slopes: tuple[FloatArray, FloatArray], target: FloatArray) -> tuple[FloatArray, FloatArray]:
        columns = np.stack([slopes[0][:, :3], slopes[1][:, :3]], axis=-1) / scale
        residual = (target[:, :3] - at.points) / scale
        # splines keep x on the body to their own error only: what counts lies in the tangent plane at y
        outward = target[:, 3:6]
        return columns, residual - np.sum(residual * outward, axis=-1, keepdims=True) * outward

    found = _search(strips, body, frames, functions, step)
    return ShedRays(*found, np.zeros(len(found[0])))


def _search(
    strips: tuple[Strip, ...],
    body: Surface,
    targets: FloatArray,
    functions: Callable[..., _Functions],
    step: _Step,
    more: _Places | None = None,
) -> tuple[IntArray, IntArray, FloatArray, RayPoints]:
    """Solve on all strips, from cells and from places besides: observers (n,), strips (n,), positions (n,), points."""
    none = np.zeros(0, dtype=int)
    found = [(none, none, np.zeros(0), np.zeros(0))]
    for k, strip in enumerate(strips):
        seeds = _seeds(strip, body, targets, functions)
        if more is not None:
            its = more[1] == k
            seeds = tuple(np.concatenate([one, more[i][its]]) for one, i in zip(seeds, (0, 2, 3), strict=True))  # type: ignore[assignment]
        row, sigma, s = _newton(strip, targets, *seeds, step)
        found.append((row, np.full(len(row), k), sigma, s))
    observer, which, sigma, s = (np.concatenate(of) for of in zip(*found, strict=True))
    return observer, which, sigma, gather(strips, which, sigma, s)


def _seeds(
    strip: Strip, body: Surface, targets: FloatArray, functions: Callable[..., _Functions]
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Observers and middles (σ, s) of the cells in which both functions change sign."""
    columns = strip.coarse_steps
    rays = strip.rays[:, columns]
    sigma = strip.positions
    lanes = rays.lanes
    if strip.closed:
        sigma, lanes = np.append(sigma, sigma[0] + strip.period), np.concatenate([lanes, lanes[:1]])
    shape = lanes.shape[:2]
    x, p = lanes[..., 0:3].reshape(-1, 3), lanes[..., 3:6].reshape(-1, 3)
    n = normal(body, x)
    fields = [np.ascontiguousarray(v.T) for v in (x, n, np.cross(n, p), p)]
    found = [(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0))]
    # values of a function for several observers that are held at once
    block = max(1, 4_000_000 // max(1, len(x)))
    for first in range(0, len(targets), block):
        f, g, ahead = functions(targets[first : first + block], *fields)
        row, ray, column = np.nonzero(_changes(f.reshape(-1, *shape)) & _changes(g.reshape(-1, *shape)))
        corner = ray * shape[1] + column
        forward = ahead(row, corner) | ahead(row, corner + shape[1] + 1)
        row, ray, column = row[forward], ray[forward], column[forward]
        found.append(
            (
                row + first,
                0.5 * (sigma[ray] + sigma[ray + 1]),
                0.5 * (strip.times[columns][column] + strip.times[columns][column + 1]),
            )
        )
    return tuple(np.concatenate(parts) for parts in zip(*found, strict=True))  # type: ignore[return-value]


def _changes(values: FloatArray) -> BoolArray:
    """Cells (..., rays - 1, steps - 1) whose corners have not all one sign."""
    positive = values > 0
    first = positive[:, :-1, :-1]
    return np.asarray(
        (first != positive[:, 1:, :-1]) | (first != positive[:, :-1, 1:]) | (first != positive[:, 1:, 1:])
    )


def _newton(
    strip: Strip, targets: FloatArray, row: IntArray, sigma: FloatArray, s: FloatArray, step: _Step
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Newton's method from the seeds, without those that leave their neighbourhood, and without duplicates."""
    start_sigma, start_s = sigma, s
    widths = strip.cell
    residual = np.full(len(row), np.inf)
    for _ in range(12):
        at = strip.at(sigma, s)
        slopes = strip.slopes(sigma, s)[:, :6], strip.slopes(sigma, s, 1)[:, :6]
        columns, gap = step(at, slopes, targets[row])
        residual = np.linalg.norm(gap, axis=-1)
        if np.all(residual < CLOSE):
            break
        gram = np.einsum("nij,nik->njk", columns, columns)
        right = np.einsum("nij,ni->nj", columns, gap)
        # where both columns are one there is no solution
        gram[:, [0, 1], [0, 1]] += 1e-14 * np.trace(gram, axis1=1, axis2=2)[:, None] + 1e-300
        move = np.linalg.solve(gram, right[..., None])[..., 0]
        move = np.clip(np.nan_to_num(move), -np.array(widths), np.array(widths))
        sigma = sigma + move[:, 0]
        s = np.clip(s + move[:, 1], 0.0, strip.times[-1])
    good = (
        (residual < 100 * CLOSE) & (np.abs(sigma - start_sigma) < 3 * widths[0]) & (np.abs(s - start_s) < 3 * widths[1])
    )
    low, high = strip.positions[0] - widths[0], strip.positions[-1] + widths[0]
    if not strip.closed:
        good &= (sigma > low) & (sigma < high)
    row, sigma, s = row[good], strip.wrap(sigma[good]), s[good]

    def alike(i: IntArray, j: IntArray) -> BoolArray:
        apart = np.abs(sigma[i] - sigma[j])
        if strip.closed:
            apart = np.minimum(apart, strip.period - apart)
        return np.asarray((apart <= 1e-5 * widths[0]) & (np.abs(s[i] - s[j]) <= 1e-5 * widths[1]))

    kept = first_of_equals(row, alike)
    return row[kept], sigma[kept], s[kept]
