"""Where creeping rays cross the horizon n.r = 0 of a distant observer: nodes of the integrals over the shadow line.

On a ray, (n.r)' = κₙ p.r + τ b.r. A fan integral takes every crossing with p.r > 0; the shadow half of the forward
integral takes the first one of each ray that starts with n.r < 0. Its lit half runs over the bisector contour
n.(d + r) = 0, n.d < 0, which meets the shadow line where n is perpendicular to both d and r.

Sources: Derivations, R12, F10 and F11.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.optimize.elementwise import find_root

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.geometry.curvature import bending, second_form
from creeping.geometry.patches import Rows
from creeping.geometry.surface import Surface, normal, size
from creeping.rays.quantities import RayPoints
from creeping.rays.strips import Strip, gather
from creeping.shadow.line import ShadowLine


@dataclass(frozen=True, eq=False)
class HorizonRays(Rows):
    """Nodes on creeping rays: observer row (n,), points (n,), and weight dσ⊥ (n,), L."""

    observer: IntArray
    rays: RayPoints
    weight: FloatArray


@dataclass(frozen=True, eq=False)
class MidHorizon(Rows):
    """Nodes on the bisector contour n.(d + r) = 0.

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


def line_crossings(strip: Strip, r: FloatArray) -> list[tuple[float, float, bool]]:
    """Intervals (σ start, σ end, shadow) of a strip with n0.r of one sign, negative on the shadow half."""
    low, high = strip.span
    sigma = np.linspace(low, high, 4 * len(strip.positions) + 1)

    def height(at: FloatArray) -> FloatArray:
        return np.asarray(strip.first_normals(at) @ r)

    values = height(sigma)
    changes = np.flatnonzero(values[:-1] * values[1:] < 0)
    negative = values[changes] < 0
    cuts = find_root(height, (sigma[changes], sigma[changes + 1])).x if len(changes) else np.zeros(0)
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
    strips: tuple[Strip, ...], line: ShadowLine, wanted: IntArray, directions: FloatArray, counts: IntArray
) -> tuple[HorizonRays, MidHorizon, IntArray]:
    """Gauss nodes of both halves of the forward integral, and the observers for which some were not found.

    Parameters
    ----------
    wanted : (w,)
        Rows of the observers.
    directions : (m, 3)
        Unit directions of all observers, none of them d itself.
    counts : (w,)
        Nodes on each interval between crossings with the shadow line.
    """
    none = np.zeros(0, dtype=np.int64)
    dark, missing = [(none, none, np.zeros(0), np.zeros(0), np.zeros(0))], []
    lit = [_mid_nodes(line.body, 0, np.zeros((0, 3)), line.direction, np.zeros(0))]
    for row, count in zip(wanted, counts, strict=True):
        r = directions[row]
        q = (line.direction + r) / np.linalg.norm(line.direction + r)
        nodes, weights = np.polynomial.legendre.leggauss(int(count))
        for k, strip in enumerate(strips):
            for start, end, shadow in line_crossings(strip, r):
                sigma, weight = start + (end - start) * (nodes + 1) / 2, (end - start) / 2 * weights
                if shadow:
                    s, found = _first_crossing(strip, line.body, sigma, r)
                    rows = np.full((2, int(found.sum())), [[row], [k]])
                    dark.append((*rows, sigma[found], s[found], weight[found]))
                else:
                    x, across, found = _mid_horizon(strip, line, sigma, q)
                    lit.append(_mid_nodes(line.body, int(row), x[found], q, (weight * across)[found]))
                if not np.all(found):
                    missing.append(row)
    observer, which, places, times, widths = (np.concatenate(column) for column in zip(*dark, strict=True))
    # by Newton's method along each ray on n.r
    limit, towards = 0.5 * max((strip.cell[1] for strip in strips), default=0.0), directions[observer]
    for _ in range(3):
        rays = gather(strips, which, places, times)
        n, hessian = bending(line.body, rays.points)
        turned = np.einsum("nij,nj->ni", hessian, rays.directions)
        rate = np.sum((turned - np.sum(turned * n, axis=1, keepdims=True) * n) * towards, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            move = np.nan_to_num(-np.sum(n * towards, axis=1) / rate)
        times = np.maximum(times + np.clip(move, -limit, limit), 0.0)
    rays = gather(strips, which, places, times)
    shadow_half = HorizonRays(observer, rays, widths * rays.width)
    return shadow_half, MidHorizon.joined(lit), np.unique(np.array(missing, dtype=np.int64))


def _first_crossing(strip: Strip, body: Surface, sigma: FloatArray, r: FloatArray) -> tuple[FloatArray, BoolArray]:
    """First s at which n.r rises through 0 on the rays σ (n,), to a coarse step, and whether there is one."""
    s = strip.times[strip.coarse_steps]
    heights = strip.coarse_normals(body) @ r
    rises = np.asarray(heights > 0)
    first = np.argmax(rises, axis=1)
    found = np.asarray(rises.any(axis=1))
    # a ray near a crossing may rise within its first step: linear interpolation serves every start
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
    whole = np.interp(at, positions, found.astype(float))
    return np.interp(at, positions, crossing), np.asarray(whole > 0.5)


def _mid_horizon(
    strip: Strip, line: ShadowLine, sigma: FloatArray, q: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Points (n, 3) of the bisector contour beside the rays σ, d(arclength across q)/dσ, and whether they were found.

    Each is sought from the launch point in the plane of n0 and d: F = 0, n.q = 0, (x - x0).b0 = 0.
    """
    body = line.body
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
    found = np.asarray((np.abs(n @ q) < 1e-9) & (n @ line.direction < 1e-9))
    found &= np.linalg.norm(x - x0, axis=1) < size(body)
    found &= np.abs(body.level(x)) <= 1e-9 * np.linalg.norm(body.gradient(x), axis=1) * size(body)
    order = np.argsort(sigma)
    slope = make_interp_spline(sigma[order], x[order], k=min(7, len(sigma) - 1))(sigma, nu=1)
    return x, np.abs(np.sum(slope * np.cross(n, q), axis=1)), np.asarray(found)


def _mid_nodes(body: Surface, row: int, points: FloatArray, q: FloatArray, weight: FloatArray) -> MidHorizon:
    """Nodes of one observer at points (n, 3) of its contour."""
    n, hessian = bending(body, points)
    along, across = (second_form(v, hessian) for v in (np.broadcast_to(q, n.shape), np.cross(n, q)))
    return MidHorizon(np.full(len(points), row), points, n, weight, along, across)
