"""Specular points of a plane wave: where the body mirrors the incidence d into the direction r.

    n(x) = (r - d)/|r - d|,   cos θᵢ = n.r = -n.d,   K = κ1 κ2

The shape operator S = dn/dx turns a step on the body into one of its normal. Seeds are the triangles of a mesh whose
normals surround the one that is wanted.

Also here: specular points of a body with creases: those of each smooth piece that lie on it, and which of them stand
clear.

A reflected ray forms over the Fresnel zone of its specular point, √(π/(k|κ| cos θᵢ)) along a principal direction of
curvature κ. Nearer than that to an edge or tip, and half as near to a joint, the point alone does not give the
reflected field; nor does it on a facet or a cylinder, where the zone is without end.

Sources: Derivations, F13.
"""

from dataclasses import dataclass

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.geometry.curvature import bending
from creeping.geometry.directions import first_of_equals, tangent_frames
from creeping.geometry.patches import Rows
from creeping.geometry.piecewise import SMOOTH, nearest_crease, pieces_of, tiles_of
from creeping.geometry.surface import Surface, normal, project, size
from creeping.geometry.triangulation import Triangulation, triangulate
from creeping.shadow.attachment import occluded

FLAT = 1e-4
"""Determinant of L S + n n^T, L the body's size, over the square of its norm, below which a point counts as flat."""


@dataclass(frozen=True, eq=False)
class SpecularPoints(Rows):
    """Specular points that the wave reaches and whose reflected ray leaves the body.

    Attributes
    ----------
    observer : (n,) of int
        Row of the observer direction.
    points, normals : (n, 3)
    cosine : (n,)
        cos θᵢ.
    along, across, twist : (n,), 1/L
        Entries of the shape operator: normal curvatures along a and across, and what mixes them.
    plane : (n, 3)
        Unit tangent a in the plane of incidence, the way that the wave goes; any tangent at normal incidence.
    principal : (n, 2), 1/L
        κ1 <= κ2, positive where convex.
    shape : (n,), 1/L
        Λ of `shape_term`; 1/(2a) on a sphere, 3/(16a) on a cylinder.
    """

    observer: IntArray
    points: FloatArray
    normals: FloatArray
    cosine: FloatArray
    along: FloatArray
    across: FloatArray
    twist: FloatArray
    plane: FloatArray
    principal: FloatArray
    shape: FloatArray

    @property
    def sine(self) -> FloatArray:
        """Sine of the angle of incidence (n,)."""
        return np.sqrt(np.maximum(1 - self.cosine**2, 0.0))

    def path(self, direction: FloatArray, observers: FloatArray) -> FloatArray:
        """(d - r).x (n,), L, of the incidence of each point (n, 3) and the observers (m, 3)."""
        return np.asarray(np.sum((direction - observers[self.observer]) * self.points, axis=1))


def specular_points(
    body: Surface, direction: FloatArray, observers: FloatArray, mesh: Triangulation | None = None
) -> SpecularPoints:
    """All lit specular points of the unit directions r (m, 3) for the unit incidence d, (3,) or one for each r.

    A direction r = d has none. ``mesh`` spares making one.
    """
    difference = observers - direction
    length = np.linalg.norm(difference, axis=1)
    rows = np.flatnonzero(length > 1e-9)
    wanted = difference[rows] / length[rows, None]
    mesh = mesh or triangulate(body)
    which, seeds = _seeds(body, mesh.vertices, mesh.triangles, wanted)
    which, points = _newton(body, seeds, wanted, which)
    row = rows[which]
    n = normal(body, points)
    incident = np.broadcast_to(direction, observers.shape)
    free = ~(occluded(body, points, incident[row]) | occluded(body, points, -observers[row]))
    row, points, n = row[free], points[free], n[free]
    r = observers[row]
    q = r + incident[row]
    # backscatter has no plane of incidence: any tangent will do
    q = np.where(np.linalg.norm(q, axis=1, keepdims=True) > 1e-9, q, tangent_frames(n)[0])
    q = q - np.sum(q * n, axis=1, keepdims=True) * n
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    _, H = bending(body, points)
    b = np.cross(n, q)
    along, across, mixed = (np.einsum("ni,nij,nj->n", v, H, w) for v, w in ((q, q), (b, b), (q, b)))
    matrix = np.stack([np.stack([along, mixed], axis=-1), np.stack([mixed, across], axis=-1)], axis=-2)
    principal, axes = np.linalg.eigh(matrix)
    # in flat regions the field is not finite: large, and for its next term unresolved
    principal = np.copysign(np.maximum(np.abs(principal), 1e-8 / size(body)), principal)
    frame = np.einsum("nak,nai->nki", axes, np.stack([q, b], axis=1))
    return SpecularPoints(
        observer=row,
        points=points,
        normals=n,
        cosine=np.sum(n * r, axis=1),
        along=along,
        across=across,
        twist=mixed,
        plane=q,
        principal=principal,
        shape=shape_term(body, points, n, frame, principal),
    )


def shape_term(
    body: Surface, points: FloatArray, normals: FloatArray, frame: FloatArray, principal: FloatArray
) -> FloatArray:
    """Λ (n,), 1/L, of the next order of stationary phase: ∫ e^{-2iKh} du dv has the factor 1 - iΛ/K, K = k cos θᵢ.

    h(u, v) is the height of the body over its tangent plane, u and v along the principal axes. With ψ = -2h and its
    third and fourth derivatives ψ_uuu, ...,

        Λ = (ψ_uuuu/κ1² + 2 ψ_uuvv/(κ1κ2) + ψ_vvvv/κ2²)/32 - [15 ψ_uuu²/κ1³ + 27 ψ_uuv²/(κ1²κ2) + 27 ψ_uvv²/(κ1κ2²)
            + 15 ψ_vvv²/κ2³ + 18 ψ_uuu ψ_uvv/(κ1²κ2) + 18 ψ_uuv ψ_vvv/(κ1κ2²)]/576

    Parameters
    ----------
    frame : (n, 2, 3)
        Principal directions.
    principal : (n, 2), 1/L
    """
    if not len(points):
        return np.zeros(0)
    # heights on a 5 x 5 stencil; rounding and truncation of a fourth derivative balance at about this step
    step = 0.02 / np.max(np.abs(principal), axis=1)
    offsets = np.arange(-2, 3)
    u, v = (grid.ravel() for grid in np.meshgrid(offsets, offsets, indexing="ij"))
    plane = u[:, None, None] * frame[:, 0] + v[:, None, None] * frame[:, 1]
    base = points + step[:, None] * plane
    height = np.zeros((len(u), len(points)))
    for _ in range(8):
        x = base + height[..., None] * normals
        height = height - body.level(x) / np.sum(body.gradient(x) * normals, axis=-1)
    psi = -2 * height.reshape(5, 5, -1)
    one, two = np.array([0, -0.5, 0, 0.5, 0]), np.array([0, 1.0, -2, 1, 0])
    three, four = np.array([-0.5, 1, 0, -1, 0.5]), np.array([1.0, -4, 6, -4, 1])
    flat = np.array([0, 0, 1.0, 0, 0])

    def derivative(a: FloatArray, b: FloatArray, order: int) -> FloatArray:
        return np.asarray(np.einsum("i,j,ijn->n", a, b, psi) / step**order)

    uuu, vvv = derivative(three, flat, 3), derivative(flat, three, 3)
    uuv, uvv = derivative(two, one, 3), derivative(one, two, 3)
    p, q = principal[:, 0], principal[:, 1]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        fourth = derivative(four, flat, 4) / p**2 + 2 * derivative(two, two, 4) / (p * q)
        fourth = fourth + derivative(flat, four, 4) / q**2
        third = 15 * uuu**2 / p**3 + 27 * uuv**2 / (p**2 * q) + 27 * uvv**2 / (p * q**2) + 15 * vvv**2 / q**3
        third = third + 18 * uuu * uvv / (p**2 * q) + 18 * uuv * vvv / (p * q**2)
        return np.nan_to_num(fourth / 32 - third / 576, posinf=1e300, neginf=-1e300)


def _seeds(body: Surface, vertices: FloatArray, triangles: IntArray, wanted: FloatArray) -> tuple[IntArray, FloatArray]:
    """Wanted normals (m,) and centres of the triangles whose normals surround them."""
    n = normal(body, vertices)
    corners = n[triangles]
    middle = corners.sum(axis=1)
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    # spherical cap around each triangle's normals, widened for curved sides
    reach = np.max(np.arccos(np.clip(np.einsum("tki,ti->tk", corners, middle), -1, 1)), axis=1)
    limit = np.cos(np.minimum(1.5 * reach + 1e-3, np.pi))
    found = []
    block = max(1, 4_000_000 // len(triangles))
    for first in range(0, len(wanted), block):
        row, t = np.nonzero(wanted[first : first + block] @ middle.T >= limit)
        found.append((row + first, vertices[triangles[t]].mean(axis=1)))
    which = np.concatenate([f[0] for f in found]) if found else np.zeros(0, dtype=int)
    points = np.concatenate([f[1] for f in found]) if found else np.zeros((0, 3))
    return which, project(body, points) if len(points) else points


def _newton(body: Surface, points: FloatArray, wanted: FloatArray, which: IntArray) -> tuple[IntArray, FloatArray]:
    """Move along the body until n = h; without duplicates and those that do not converge."""
    largest = 0.1 * size(body)
    points, active = points.copy(), np.arange(len(points))
    for _ in range(30):
        gap, step = _step(body, points[active], wanted[which[active]])
        moving = gap >= 1e-10
        active, step = active[moving], step[moving]
        if not len(active):
            break
        long = np.linalg.norm(step, axis=1)
        step *= np.minimum(1.0, largest / np.maximum(long, 1e-300))[:, None]
        points[active] = project(body, points[active] + step)
    good = np.sum((normal(body, points) - wanted[which]) ** 2, axis=1) < 1e-16
    which, points = which[good], points[good]
    near = 1e-6 * size(body)
    keep = first_of_equals(which, lambda i, j: np.linalg.norm(points[i] - points[j], axis=1) <= near)
    return which[keep], points[keep]


def _step(body: Surface, points: FloatArray, wanted: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Size of n - h, and the tangential Newton step S dx = h - n."""
    n, hessian = bending(body, points)
    gap = wanted - n
    # S on the tangent plane, without unit, made regular by the identity along n
    length = size(body)
    tangential = np.eye(3) - n[:, :, None] * n[:, None, :]
    shape = length * tangential @ hessian @ tangential + n[:, :, None] * n[:, None, :]
    right = length * (gap - np.sum(gap * n, axis=1, keepdims=True) * n)
    scale = np.sum(shape * shape, axis=(1, 2))
    flat = np.abs(np.linalg.det(shape)) < FLAT * scale
    step = np.empty_like(right)
    step[~flat] = np.linalg.solve(shape[~flat], right[~flat, :, None])[..., 0]
    # a flat point has no inverse: the least-squares step stays finite
    step[flat] = np.einsum("nij,nj->ni", np.linalg.pinv(shape[flat], rcond=1e-6), right[flat])
    return np.linalg.norm(gap, axis=1), step


def smooth_parts(body: Any) -> tuple[tuple[int, ...], ...]:
    """Numbers of the pieces of each part connected by joints and seams."""
    part = list(range(len(body.pieces)))
    for crease in body.creases:
        if crease.kind in SMOOTH:
            one, other = (part[k] for k in crease.pieces)
            part = [one if number == other else number for number in part]
    return tuple(tuple(k for k, number in enumerate(part) if number == one) for one in sorted(set(part)))


def specular_on_pieces(
    body: Any, numbers: tuple[int, ...], direction: FloatArray, observers: FloatArray
) -> list[SpecularPoints]:
    """Lit specular points on each of some pieces, of a unit direction and unit observers (m, 3)."""
    pieces, tiles, found = pieces_of(body), tiles_of(body, 0.05), []
    for number in numbers:
        corners = tiles.corners[tiles.pieces == number]
        bent = bending(pieces[number], corners.mean(axis=1))[1] if len(corners) else np.zeros((1, 3, 3))
        # none is on a flat piece
        if np.max(np.linalg.norm(bent, axis=(1, 2))) * size(body) < FLAT:
            continue
        # drawn to their middles: at a tip there is no normal
        corners = corners + 1e-6 * (corners.mean(axis=1, keepdims=True) - corners)
        vertices = corners.reshape(-1, 3)
        mesh = Triangulation(vertices, np.arange(len(vertices)).reshape(-1, 3))
        points = specular_points(pieces[number], direction, observers, mesh)
        # so far off the body it is asked whether anything is in the way
        x = points.points + 1e-7 * size(body) * points.normals
        there = np.zeros(len(x), dtype=bool)
        if len(x):
            r = observers[points.observer]
            there = (np.asarray(body.piece(points.points)) == number) & ~occluded(body, x, direction)
            there &= ~occluded(body, x, -r) & (points.normals @ direction < 0)
        found.append(points[there])
    return found


def stand_clear(body: Any, points: SpecularPoints, wavenumber: float) -> BoolArray:
    """Whether specular points are farther from all creases than their Fresnel zones reach (n,)."""
    if not len(points.points):
        return np.zeros(0, dtype=bool)
    bent = np.abs(points.principal).min(axis=1) * np.maximum(points.cosine, 1e-6)
    zone = np.sqrt(np.pi / (wavenumber * bent))
    sharp = nearest_crease(body, points.points, kinds=("edge", "tip"))[1]
    return np.asarray((sharp > zone) & (nearest_crease(body, points.points, kinds=("joint",))[1] > 0.5 * zone))
