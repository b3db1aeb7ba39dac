"""Triangle meshes with vertices exactly on smooth bodies, even and uneven."""

from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

from creeping._typing import FloatArray, IntArray
from creeping.geometry.surface import normal
from creeping.geometry.triangulation import triangulate

Mesh = tuple[FloatArray, IntArray]


@cache
def geodesic_sphere(n: int) -> Mesh:
    """About n unit vectors, the faces of an icosahedron divided f times along each edge, and triangles."""
    f = max(1, round(np.sqrt((n - 2) / 10)))
    g = (1 + np.sqrt(5)) / 2
    corners = np.array([[0, s, t * g] for s in (1, -1) for t in (1, -1)])
    corners = np.concatenate([np.roll(corners, k, axis=1) for k in range(3)])
    near = np.linalg.norm(corners[:, None] - corners, axis=-1) < 2.1
    np.fill_diagonal(near, False)
    faces = [
        (a, b, c) for a in range(12) for b in range(a) for c in range(b) if near[a, b] and near[b, c] and near[c, a]
    ]
    points, triangles, count = [], [], 0
    inner = [(i, j) for i in range(f + 1) for j in range(f + 1 - i)]
    number = {ij: k for k, ij in enumerate(inner)}
    up = [(number[i, j], number[i + 1, j], number[i, j + 1]) for i, j in inner if i + j < f]
    down = [(number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]) for i, j in inner if i + j < f - 1]
    weights = np.array([(f - i - j, i, j) for i, j in inner]) / f
    for a, b, c in faces:
        if np.linalg.det(corners[[a, b, c]]) < 0:
            b, c = c, b
        points.append(weights @ corners[[a, b, c]])
        triangles.append(np.array(up + down) + count)
        count += len(inner)
    all_points = np.concatenate(points)
    all_points /= np.linalg.norm(all_points, axis=1)[:, None]
    _, first, inverse = np.unique(all_points.round(9) + 0.0, axis=0, return_index=True, return_inverse=True)
    return all_points[first], inverse.ravel()[np.concatenate(triangles)]


def torus_grid(n: int, minor: float = 0.5) -> Mesh:
    """A torus of radius 1 about z with about n vertices, twice as many along as around."""
    around = round(np.sqrt(n / 2))
    along = 2 * around
    i, j = (k.ravel() for k in np.meshgrid(np.arange(along), np.arange(around), indexing="ij"))
    psi, theta = 2 * np.pi * i / along, 2 * np.pi * j / around
    rho = 1 + minor * np.cos(theta)
    points = np.stack([rho * np.cos(psi), rho * np.sin(psi), minor * np.sin(theta)], axis=-1)

    def at(a: int, b: int) -> IntArray:
        return np.asarray((i + a) % along * around + (j + b) % around)

    quads = np.stack([at(0, 0), at(1, 0), at(1, 1), at(0, 1)], axis=1)
    return points, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


@cache
def slivers(body: Any, cells: int) -> Mesh:
    """Surface nets on a grid: triangles of all shapes."""
    found = triangulate(body, cells=cells)
    return found.vertices, found.triangles


@cache
def capsule(n: int, length: float = 2.0, radius: float = 0.5) -> Mesh:
    """A cylinder with hemispheres, of even triangles: C1, its curvature along z jumps from 0 to 1/radius."""
    edge = np.sqrt(2 * np.pi * radius * (length + 2 * radius) / (0.87 * n))
    meridian = radius * np.pi / 2
    rows = round(2 * meridian / edge) // 2 * 2
    middle = round(length / edge)
    # arc lengths of the rings; the joints lie half between rings, as nothing keeps a mesher from that
    total = 2 * meridian + length
    s = (np.arange(rows + middle) + 0.5) * total / (rows + middle)
    z, rho = _profile(s - total / 2, length, radius)
    counts = np.maximum(6, np.round(2 * np.pi * rho / edge)).astype(int)
    angles = [2 * np.pi * (np.arange(m) + 0.37 * k) / m for k, m in enumerate(counts)]
    rings = [
        np.stack([r * np.cos(a), r * np.sin(a), np.full(len(a), h)], axis=1)
        for a, r, h in zip(angles, rho, z, strict=True)
    ]
    ends = [np.array([[0, 0, sign * (length / 2 + radius)]]) for sign in (-1, 1)]
    points = np.concatenate([ends[0], *rings, ends[1]])
    from scipy.spatial import ConvexHull

    # strictly convex twin of the same topology: the capsule is convex, but flat along z
    twin = points.copy()
    bulge = 1 + 0.02 * (1 - (points[:, 2] / (length / 2 + radius)) ** 2)
    twin[:, :2] *= bulge[:, None]
    hull = ConvexHull(twin)
    triangles = hull.simplices.astype(np.int64)
    corners = twin[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inwards = np.sum(normal * hull.equations[:, :3], axis=1) < 0
    triangles[inwards] = triangles[inwards, ::-1]
    return points, triangles


def _profile(s: FloatArray, length: float, radius: float) -> tuple[FloatArray, FloatArray]:
    """Height and distance from the axis at arc length s from the middle."""
    angle = np.maximum(np.abs(s) - length / 2, 0) / radius
    return np.sign(s) * (np.minimum(np.abs(s), length / 2) + radius * np.sin(angle)), radius * np.cos(angle)


def noisy(points: FloatArray, triangles: IntArray, amount: float) -> Mesh:
    """Vertices moved along the normals by ``amount`` mean edges, rms."""
    corners = points[triangles]
    edge = np.mean(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1))
    normal = np.zeros_like(points)
    np.add.at(normal, triangles, np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, None])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    return points + amount * edge * np.random.default_rng(0).normal(size=(len(points), 1)) * normal, triangles


def almond(n: int) -> Mesh:
    """NASA almond of unit length with about n vertices: an ellipsoid to x = 0, then circles to a tip at x = 0.58333.

    Equations of Woo, Wang, Schuh and Sanders, IEEE Antennas Propag. Mag. 35 (1993) 84-89; vertices about as far apart
    along x as around, on rings, one at the blunt end and one at the tip.
    """
    x = np.linspace(-0.416667, 0.583333, 4001)
    y = _almond_width(x)
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    # sides of an ellipse with half axes y and y/3
    around = 4.0 * y * 1.114
    edge = np.sqrt(np.trapezoid(around, arc) / (0.87 * n))
    rings = int(arc[-1] / edge)
    at = (np.arange(rings) + 0.5) / rings * arc[-1]
    points, counts = [np.array([[x[0], 0.0, 0.0]])], []
    for k, s in enumerate(at):
        place, width = np.interp(s, arc, x), np.interp(s, arc, y)
        count = max(6, round(4.0 * width * 1.114 / edge))
        # even along the ellipse
        fine = np.linspace(0, 2 * np.pi, 721)
        along = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(np.cos(fine)), np.diff(np.sin(fine)) / 3))])
        psi = np.interp((np.arange(count) + 0.37 * k % 1) / count * along[-1], along, fine)
        width = float(_almond_width(np.array([place]))[0])
        points.append(np.stack([np.full(count, place), width * np.cos(psi), width / 3 * np.sin(psi)], axis=1))
        counts.append(count)
    points.append(np.array([[x[-1], 0.0, 0.0]]))
    return np.concatenate(points), _bands(points)


def _almond_width(x: FloatArray) -> FloatArray:
    blunt = 0.193333 * np.sqrt(np.maximum(1 - (x / 0.416667) ** 2, 0))
    sharp = 4.83345 * (np.sqrt(1 - (x / 2.08335) ** 2) - 0.96)
    return np.where(x < 0, blunt, np.maximum(sharp, 0))


def _bands(rings: list[FloatArray]) -> IntArray:
    """Triangles between rings of points by angle about the x axis, of which the first and last are single points."""
    triangles: list[tuple[int, int, int]] = []
    first = 0
    for lower, upper in pairwise(rings):
        a, b, i, j = len(lower), len(upper), 0, 0
        below = np.append(np.unwrap(np.arctan2(3 * lower[:, 2], lower[:, 1])), np.inf)
        above = np.append(np.unwrap(np.arctan2(3 * upper[:, 2], upper[:, 1])), np.inf)
        below[-1], above[-1] = below[0] + 2 * np.pi, above[0] + 2 * np.pi
        second = first + a
        while i < (a if a > 1 else 0) or j < (b if b > 1 else 0):
            step_below = i < (a if a > 1 else 0) and (
                j >= (b if b > 1 else 0) or below[i + 1] + below[i] < above[j + 1] + above[j]
            )
            if step_below:
                triangles.append((first + i % a, second + j % b, first + (i + 1) % a))
                i += 1
            else:
                triangles.append((first + i % a, second + j % b, second + (j + 1) % b))
                j += 1
        first = second
    return np.array(triangles)


def on_body(name: str, n: int) -> tuple[Any, FloatArray, IntArray]:
    """A body by name with an even mesh of about n vertices on it: "ellipsoid", "torus" or "twisted"."""
    import scatterers as sc

    if name == "torus":
        return sc.Torus(), *torus_grid(n)
    body: Any = {"ellipsoid": sc.Ellipsoid(1.2, 0.8, 0.8), "twisted": sc.TwistedEllipsoid()}[name]
    s, triangles = geodesic_sphere(n)
    return body, body.forward(s), triangles


def scattered(body: Any, points: FloatArray, triangles: IntArray, amount: float) -> FloatArray:
    """Vertices moved along the normals of their body by ``amount`` mean edges, rms."""
    corners = points[triangles]
    edge = float(np.mean(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1)))
    off = amount * edge * np.random.default_rng(0).normal(size=(len(points), 1))
    return points + off * normal(body, points)
