"""Where creeping rays cross the horizon n.r = 0 of a distant observer: nodes of the integrals over the shadow line.

On a ray, (n.r)' = κₙ p.r + τ b.r. A fan integral takes every crossing with p.r > 0; the shadow half of the forward
integral takes the first one of each ray that starts with n.r < 0. Its lit half runs over the mid-horizon
n.(d + r) = 0, n.d < 0, which meets the shadow line where n is perpendicular to both d and r, the joints.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.rays.ray_points import RayPoints
from creeping.rays.shadow import ShadowLine
from creeping.rays.strips import Strip, gather
from creeping.surface import Surface, normal, size


@dataclass(frozen=True, eq=False)
class HorizonRays:
    """Nodes on creeping rays: observer row (n,), points (n,), and weight dσ⊥ (n,), L."""

    observer: IntArray
    rays: RayPoints
    weight: FloatArray


@dataclass(frozen=True, eq=False)
class MidHorizon:
    """Nodes on the mid-horizon.

    Attributes
    ----------
    observer : (n,) of int
    points, normals : (n, 3)
    weight : (n,), L
        Arclength across q = (d + r)/|d + r|.
    along, across : (n,), 1/L
        Normal curvatures along q and n x q.
    """

    observer: IntArray
    points: FloatArray
    normals: FloatArray
    weight: FloatArray
    along: FloatArray
    across: FloatArray


class HorizonGrid:
    """Normals of the strips at evenly spaced σ, fine enough for a wavenumber, and coarse steps.

    Parameters
    ----------
    strips : tuple of Strip
    body : Surface
    spacing : float, L
        Largest spacing of σ.
    """

    def __init__(self, strips: tuple[Strip, ...], body: Surface, spacing: float) -> None:
        self.strips, self.body = strips, body
        self.parts = []
        for strip in strips:
            low, high = strip.span
            count = max(len(strip.positions), int(np.ceil((high - low) / spacing)))
            sigma = low + (high - low) * (np.arange(count) + 0.5) / count
            s = strip.times[strip.coarse_steps]
            pairs = np.stack(np.meshgrid(sigma, s, indexing="ij"), axis=-1).reshape(-1, 2)
            n = normal(body, strip.at(pairs[:, 0], pairs[:, 1]).points)
            self.parts.append((sigma, s, n.reshape(count, len(s), 3), (high - low) / count))

    def crossings(self, observer: IntArray, directions: FloatArray) -> HorizonRays:
        """Every crossing with p.r > 0, for unit directions (m, 3) of the observers (m,)."""
        found: list[tuple[FloatArray, ...]] = []
        for k, (sigma, s, n, step) in enumerate(self.parts):
            for row, r in zip(observer, directions, strict=True):
                height = n @ r
                ray, j = np.nonzero(height[:, :-1] * height[:, 1:] < 0)
                share = height[ray, j] / (height[ray, j] - height[ray, j + 1])
                at = s[j] + share * (s[j + 1] - s[j])
                found.append(
                    (
                        np.full(len(ray), row),
                        np.full(len(ray), k),
                        sigma[ray],
                        at,
                        np.full(len(ray), step),
                        np.broadcast_to(r, (len(ray), 3)),
                    )
                )
        if not found:
            return HorizonRays(np.zeros(0, dtype=int), gather(self.strips, *_NOTHING), np.zeros(0))
        row, which, sigma, s, step, r = (np.concatenate(parts) for parts in zip(*found, strict=True))
        row, which = row.astype(np.int64), which.astype(np.int64)
        s, rays = _polish(self.strips, self.body, which, sigma, s, r)
        keep = np.sum(rays.directions * r, axis=1) > 0
        return HorizonRays(row[keep], rays[keep], (step * rays.width)[keep])


_NOTHING = (np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0))


def _polish(
    strips: tuple[Strip, ...], body: Surface, which: IntArray, sigma: FloatArray, s: FloatArray, r: FloatArray
) -> tuple[FloatArray, RayPoints]:
    """Newton's method along each ray on n.r: s (n,) and the points there."""
    limit = 0.5 * max((strip.cell[1] for strip in strips), default=0.0)
    for _ in range(3):
        rays = gather(strips, which, sigma, s)
        gradient = body.gradient(rays.points)
        g = np.linalg.norm(gradient, axis=1)
        n = gradient / g[:, None]
        turned = np.einsum("nij,nj->ni", body.hessian(rays.points), rays.directions) / g[:, None]
        rate = np.sum((turned - np.sum(turned * n, axis=1, keepdims=True) * n) * r, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            move = np.nan_to_num(-np.sum(n * r, axis=1) / rate)
        s = np.maximum(s + np.clip(move, -limit, limit), 0.0)
    return s, gather(strips, which, sigma, s)


def joints(strip: Strip, direction: FloatArray, r: FloatArray) -> list[tuple[float, float, bool]]:
    """Intervals (σ start, σ end, shadow) of a strip with n0.r of one sign, negative on the shadow half."""
    low, high = strip.span
    sigma = np.linspace(low, high, 4 * len(strip.positions) + 1)

    def height(at: FloatArray) -> FloatArray:
        return np.asarray(strip.first_normals(at) @ r)

    values = height(sigma)
    changes = np.flatnonzero(values[:-1] * values[1:] < 0)
    left, right = sigma[changes], sigma[changes + 1]
    negative = values[changes] < 0
    for _ in range(45):
        middle = 0.5 * (left + right)
        same = (height(middle) < 0) == negative
        left, right = np.where(same, middle, left), np.where(same, right, middle)
    cuts = 0.5 * (left + right)
    if not len(cuts):
        return [(low, high, bool(values[0] < 0))]
    if strip.closed:
        edges = np.append(cuts, cuts[0] + strip.period)
        after = [not negative[k] for k in range(len(cuts))]
    else:
        edges = np.concatenate([[low], cuts, [high]])
        after = [bool(values[0] < 0), *(not negative[k] for k in range(len(cuts)))]
    return [(float(a), float(b), bool(s)) for a, b, s in zip(edges[:-1], edges[1:], after, strict=True)]


def forward_nodes(
    strips: tuple[Strip, ...], line: ShadowLine, observer: IntArray, directions: FloatArray, counts: IntArray
) -> tuple[HorizonRays, MidHorizon, IntArray]:
    """Gauss nodes of both halves of the forward integral, and observers (rows) for which some were not found.

    Parameters
    ----------
    observer : (m,)
        Rows of the observers.
    directions : (m, 3)
    counts : (m,)
        Nodes on each interval between joints.
    """
    d = line.direction
    shadow: list[tuple[FloatArray, ...]] = []
    lit: list[tuple[FloatArray, ...]] = []
    lost: list[int] = []
    for row, r, count in zip(observer, directions, counts, strict=True):
        nodes, weights = np.polynomial.legendre.leggauss(int(count))
        for k, strip in enumerate(strips):
            for start, end, dark in joints(strip, d, r):
                sigma = start + (end - start) * (nodes + 1) / 2
                weight = (end - start) / 2 * weights
                if dark:
                    s, ok = _first_crossing(strip, line.body, sigma, r)
                    shadow.append((np.full(ok.sum(), row), np.full(ok.sum(), k), sigma[ok], s[ok], weight[ok], np.broadcast_to(r, (int(ok.sum()), 3))))
                else:
                    points, across, ok = _mid_horizon(strip, line, sigma, r)
                    lit.append((np.full(ok.sum(), row), points[ok], weight[ok] * across[ok], np.broadcast_to(r, (int(ok.sum()), 3))))
                if not np.all(ok):
                    lost.append(int(row))
    return _shadow_half(strips, line.body, shadow), _lit_half(line, lit), np.unique(np.array(lost, dtype=np.int64))


def _first_crossing(strip: Strip, body: Surface, sigma: FloatArray, r: FloatArray) -> tuple[FloatArray, BoolArray]:
    """First s at which n.r rises through 0 on the rays σ (n,), to a coarse step, and whether there is one."""
    s = strip.times[strip.coarse_steps]
    heights = strip.coarse_normals(body) @ r
    rises = heights > 0
    first = np.argmax(rises, axis=1)
    found = rises.any(axis=1)
    # a ray near a joint may rise within its first step: linear interpolation serves every start
    before = np.maximum(first - 1, 0)
    rows = np.arange(len(first))
    with np.errstate(divide="ignore", invalid="ignore"):
        share = heights[rows, before] / (heights[rows, before] - heights[rows, first])
    crossing = np.where(first > 0, s[before] + np.nan_to_num(share) * (s[first] - s[before]), 0.0)
    positions = strip.positions
    if strip.closed:
        positions = np.concatenate([positions[-1:] - strip.period, positions, positions[:1] + strip.period])
        crossing = np.concatenate([crossing[-1:], crossing, crossing[:1]])
        found = np.concatenate([found[-1:], found, found[:1]])
    at = strip.wrap(sigma)
    return np.interp(at, positions, crossing), np.interp(at, positions, found.astype(float)) > 0.5


def _shadow_half(strips: tuple[Strip, ...], body: Surface, parts: list[tuple[FloatArray, ...]]) -> HorizonRays:
    if not parts:
        return HorizonRays(np.zeros(0, dtype=np.int64), gather(strips, *_NOTHING), np.zeros(0))
    row, which, sigma, s, weight, r = (np.concatenate(p) for p in zip(*parts, strict=True))
    s, rays = _polish(strips, body, which.astype(np.int64), sigma, s, r)
    return HorizonRays(row.astype(np.int64), rays, weight * rays.width)


def _mid_horizon(
    strip: Strip, line: ShadowLine, sigma: FloatArray, r: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Points (n, 3) of the mid-horizon beside the rays σ, d(arclength across q)/dσ, and whether they were found.

    Each is sought from the launch point in the plane of n0 and d: F = 0, n.q = 0, (x - x0).b0 = 0.
    """
    body = line.body
    q = line.direction + r
    q = q / np.linalg.norm(q)
    start = strip.at(sigma, np.zeros(len(sigma)))
    x0 = start.points
    b0 = np.cross(start.first_normal, line.direction)
    x = x0.copy()
    largest = 0.2 * size(body)
    for _ in range(25):
        gradient = body.gradient(x)
        bent = body.hessian(x) @ q
        rows = np.stack([gradient, bent, b0], axis=1)
        right = -np.stack([body.level(x), gradient @ q, np.sum((x - x0) * b0, axis=1)], axis=1)
        move = np.einsum("nij,nj->ni", np.linalg.pinv(rows), right)
        long = np.linalg.norm(move, axis=1, keepdims=True)
        x = x + move * np.minimum(1.0, largest / np.maximum(long, 1e-300))
        if np.all(long < 1e-13 * size(body)):
            break
    n = normal(body, x)
    found = (np.abs(n @ q) < 1e-9) & (n @ line.direction < 1e-9) & (np.linalg.norm(x - x0, axis=1) < size(body))
    found &= np.abs(body.level(x)) <= 1e-9 * np.linalg.norm(body.gradient(x), axis=1) * size(body)
    order = np.argsort(sigma)
    slope = make_interp_spline(sigma[order], x[order], k=min(7, len(sigma) - 1))(sigma, nu=1)
    return x, np.abs(np.sum(slope * np.cross(n, q), axis=1)), found


def _lit_half(line: ShadowLine, parts: list[tuple[FloatArray, ...]]) -> MidHorizon:
    if not parts:
        none = np.zeros(0)
        return MidHorizon(np.zeros(0, dtype=np.int64), np.zeros((0, 3)), np.zeros((0, 3)), none, none, none)
    row, x, weight, r = (np.concatenate(p) for p in zip(*parts, strict=True))
    body = line.body
    gradient = body.gradient(x)
    g = np.linalg.norm(gradient, axis=1)
    n = gradient / g[:, None]
    q = line.direction + r
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    H = body.hessian(x)
    along, across = (np.einsum("ni,nij,nj->n", v, H, v) / g for v in (q, np.cross(n, q)))
    return MidHorizon(row.astype(np.int64), x, n, weight, along, across)
