"""Curvatures of the body F = 0.

With g = grad F, H the Hessian of F and p, b unit tangents:

    kappa_n = p.Hp/|g|          normal curvature along p, positive where the body is convex along p
    K = (g.adj(H) g)/|g|^4      Gaussian curvature

Sources: [G05]; Derivations, R1.
"""

import numpy as np

from creeping._typing import FloatArray
from creeping.geometry.surface import Surface


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
    g, h = body.gradient(points), body.hessian(points)
    norm = np.linalg.norm(g, axis=-1)
    n = g / norm[..., None]
    tangential = np.eye(3) - n[..., :, None] * n[..., None, :]
    shape = tangential @ h @ tangential / norm[..., None, None]
    return float(np.max(np.abs(np.linalg.eigvalsh(shape))))


def curvature_norms(body: Surface, x: FloatArray) -> FloatArray:
    """Norm of the shape operator at points (n, 3): the larger principal curvature up to a factor √2, (n,), 1/L."""
    if not len(x):
        return np.zeros(0)
    gradient = body.gradient(x)
    g = np.linalg.norm(gradient, axis=1)
    n = gradient / g[:, None]
    P = np.eye(3) - n[:, :, None] * n[:, None, :]
    return np.asarray(np.linalg.norm(P @ body.hessian(x) @ P, axis=(1, 2)) / g)
