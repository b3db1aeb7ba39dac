"""Curvatures of the body F = 0.

With g = grad F, H the Hessian of F and p, b unit tangents:

    kappa_n = p.Hp/|g|          normal curvature along p, positive where the body is convex along p
    K = (g.adj(H) g)/|g|^4      Gaussian curvature

Also here: parabolic points of a body, K = 0, where its normals fold over.

With u the principal direction in which kappa_1 = 0 and g = u.grad kappa_1, a step s along u turns the normal by

    dn = u g s^2/2

so that near the image of the parabolic curve on the sphere of normals each normal is taken twice on one side,
sign(g) u, and not at all on the other.

Sources: [G05]; Derivations, R1 and B12.
"""

from dataclasses import dataclass

import numpy as np

from creeping._typing import FloatArray
from creeping.geometry.surface import Surface, memo, normal, project, size
from creeping.geometry.triangulation import Triangulation, triangulate

SECANTS = 24
"""Steps that bring a point of an edge onto K = 0."""
STEP = 1e-3
"""Distance over which curvature is differenced, in body sizes."""


def normal_curvature(body: Surface, points: FloatArray, directions: FloatArray) -> FloatArray:
    """kappa_n = p.Hp/|grad F| along unit tangents p, 1/L: (..., 3), (..., 3) -> (...).

    Examples
    --------
    >>> import scatterers as sc
    >>> float(normal_curvature(sc.Sphere(radius=2.0), np.array([2.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])))
    0.5
    """
    bent = second_form(directions, body.hessian(points))
    return np.asarray(bent / np.linalg.norm(body.gradient(points), axis=-1))


def bending(body: Surface, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Normals n and H/|grad F|, 1/L, whose second form is the curvature of tangents: (n, 3), (n, 3, 3).

    Examples
    --------
    >>> import scatterers as sc
    >>> n, H = bending(sc.Sphere(radius=2.0), np.array([[2.0, 0.0, 0.0]]))
    >>> n.tolist(), float(second_form(np.array([[0.0, 1.0, 0.0]]), H)[0])
    ([[1.0, 0.0, 0.0]], 0.5)
    """
    gradient = body.gradient(points)
    g = np.linalg.norm(gradient, axis=1)
    return gradient / g[:, None], body.hessian(points) / g[:, None, None]


def second_form(directions: FloatArray, hessians: FloatArray) -> FloatArray:
    """p.Hp of vectors p and matrices H of any unit: (..., 3), (..., 3, 3) -> (...)."""
    return np.asarray(np.einsum("...i,...ij,...j->...", directions, hessians, directions))


def adjugate_form(gradients: FloatArray, hessians: FloatArray) -> FloatArray:
    """g.adj(H) g of vectors g and matrices H of any unit: (..., 3), (..., 3, 3) -> (...)."""
    # the columns of the adjugate of a symmetric matrix are cross products of its rows
    rows = [hessians[..., k, :] for k in range(3)]
    return second_form(gradients, np.stack([np.cross(rows[(k + 1) % 3], rows[(k + 2) % 3]) for k in range(3)], axis=-2))


def gaussian_curvature(body: Surface, points: FloatArray) -> FloatArray:
    """K = (g.adj(H) g)/|g|^4 with g = grad F, 1/L^2: (..., 3) -> (...).

    Examples
    --------
    >>> import scatterers as sc
    >>> gaussian_curvature(sc.Torus(R=1.0, r=0.5), np.array([[1.5, 0.0, 0.0], [0.5, 0.0, 0.0]])).round(6)
    array([ 1.333333, -4.      ])
    """
    g = body.gradient(points)
    return np.asarray(adjugate_form(g, body.hessian(points)) / np.sum(g * g, axis=-1) ** 2)


def principal_curvature_bound(body: Surface, points: FloatArray) -> float:
    """Largest |kappa_1| or |kappa_2| over points (..., 3), L, of the body, 1/L."""
    return float(np.max(np.abs(np.linalg.eigvalsh(_shape_operators(body, points)))))


def curvature_norms(body: Surface, x: FloatArray) -> FloatArray:
    """Norm of the shape operator at points (n, 3): the larger principal curvature up to a factor √2, (n,), 1/L."""
    return np.asarray(np.linalg.norm(_shape_operators(body, x), axis=(1, 2))) if len(x) else np.zeros(0)


def _shape_operators(body: Surface, x: FloatArray) -> FloatArray:
    """P H P/|grad F|, 1/L, P the projection onto tangents: (..., 3) -> (..., 3, 3)."""
    g = body.gradient(x)
    norm = np.linalg.norm(g, axis=-1)
    n = g / norm[..., None]
    P = np.eye(3) - n[..., :, None] * n[..., None, :]
    return np.asarray(P @ body.hessian(x) @ P / norm[..., None, None])


@dataclass(frozen=True, eq=False)
class ParabolicPoints:
    """Points of the parabolic curves, about one for each edge of a mesh that crosses them.

    Attributes
    ----------
    points, normals : (n, 3), L and 1
    axes : (n, 3)
        Unit tangents u of zero normal curvature, on the side where normals are taken twice.
    bend : (n,), 1/L^2
        g >= 0.
    across : (n,), 1/L
        The other principal curvature.
    """

    points: FloatArray
    normals: FloatArray
    axes: FloatArray
    bend: FloatArray
    across: FloatArray


def parabolic_points(body: Surface, mesh: Triangulation | None = None) -> ParabolicPoints:
    """Parabolic points of a body, cached; none on a convex one.

    Examples
    --------
    >>> import scatterers as sc
    >>> found = parabolic_points(sc.Torus(R=1.0, r=0.5))           # the circles on top and below, which lie in planes
    >>> bool(abs(abs(found.points[:, 2]) - 0.5).max() < 1e-6), bool(abs(found.across - 2.0).max() < 1e-4)
    (True, True)
    """
    return memo(body, "parabolic points", lambda: _found(body, mesh or triangulate(body)))


def _found(body: Surface, mesh: Triangulation) -> ParabolicPoints:
    K = gaussian_curvature(body, mesh.vertices)
    edges = mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    edges = edges[(edges[:, 0] < edges[:, 1]) & ((K[edges[:, 0]] > 0) != (K[edges[:, 1]] > 0))]
    points, n, u, across = parabolic_crossings(
        body, mesh.vertices[edges[:, 0]], mesh.vertices[edges[:, 1]], K[edges[:, 0]], K[edges[:, 1]]
    )
    step = STEP * size(body)
    ahead, behind = (gaussian_curvature(body, project(body, points + sign * step * u)) for sign in (1, -1))
    bend = (ahead - behind) / (2 * step) / across
    return ParabolicPoints(points, n, u * np.sign(bend)[:, None], np.abs(bend), across)


def parabolic_crossings(
    body: Surface, a: FloatArray, b: FloatArray, Ka: FloatArray, Kb: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Points of K = 0 between points of both signs (n, 3), L, by false position that halves the stale end.

    With n (n, 3), the unit tangent of zero normal curvature (n, 3), and the other principal curvature (n,), 1/L.
    """
    x = a
    for _ in range(SECANTS):
        share = (Ka / (Ka - Kb))[:, None]
        x = project(body, a + share * (b - a))
        K = gaussian_curvature(body, x)
        same = (K > 0) == (Ka > 0)
        a, Kb = np.where(same[:, None], x, a), np.where(same, 0.5 * Kb, K)
        b, Ka = np.where(same[:, None], b, x), np.where(same, K, 0.5 * Ka)
    n = normal(body, x)
    # of the three eigenvalues that of n is 0, and one of the others nearly
    curvatures, vectors = np.linalg.eigh(_shape_operators(body, x))
    largest = np.argmax(np.abs(curvatures), axis=1)[:, None]
    across = np.take_along_axis(curvatures, largest, axis=1)[:, 0]
    u = np.cross(n, np.take_along_axis(vectors, largest[..., None], axis=2)[:, :, 0])
    return x, n, u / np.maximum(np.linalg.norm(u, axis=1, keepdims=True), 1e-300), across
