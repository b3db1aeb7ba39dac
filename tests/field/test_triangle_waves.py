"""Waves from flat triangles against quadrature, and against each other where a triangle is cut in two."""

import numpy as np

from creeping.field.waves.piecewise_far import phase_sums

K = 7.0


def quadrature(corners, vectors, k):
    """Integral of e^{ik q.x} over triangles (t, 3, 3) by 40 x 40 points of Gauss's rule on each: (m, t)."""
    u, w = np.polynomial.legendre.leggauss(40)
    u, w = 0.5 * (1 + u), 0.5 * w
    along, across = np.meshgrid(u, u, indexing="ij")
    places = np.stack([1 - along, along * (1 - across), along * across], axis=-1).reshape(-1, 3)
    share = np.outer(w * u, w).ravel()
    x = np.einsum("pk,tkc->tpc", places, corners)
    doubled = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return np.einsum("p,mtp,t->mt", share, np.exp(1j * k * np.einsum("tpc,mc->mtp", x, vectors)), doubled)


def test_waves_of_triangles_are_those_of_quadrature(rng):
    sides = 10 ** rng.uniform(-6, 0, (60, 1, 1))
    corners = rng.normal(size=(60, 1, 3)) + sides * rng.normal(size=(60, 3, 3))
    vectors = np.concatenate([rng.normal(size=(12, 3)), np.zeros((1, 3))])
    found = phase_sums(corners, vectors, K, np.eye(60))
    exact = quadrature(corners, vectors, K)
    np.testing.assert_allclose(found, exact, rtol=1e-11, atol=1e-18)


def test_a_side_along_the_front_and_weights_that_are_complex(rng):
    # u = v, u = 0 and v = 0
    corners = np.array([[[0, 0, 0], [2, 0, 0], [2, 1, 0]], [[0, 0, 0], [0, 1, 0], [2, 1, 0]]], dtype=float)
    weights = rng.normal(size=(2, 3)) + 1j * rng.normal(size=(2, 3))
    vectors = np.array([[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0], [1.0, -2.0, 0]])
    exact = quadrature(corners, vectors, K) @ weights
    np.testing.assert_allclose(phase_sums(corners, vectors, K, weights), exact, rtol=1e-12, atol=1e-12)


def test_a_triangle_is_the_sum_of_its_parts(rng):
    whole = rng.normal(size=(20, 3, 3))
    middle = 0.5 * (whole[:, 0] + whole[:, 1])
    parts = np.stack([np.stack([whole[:, 0], middle, whole[:, 2]], 1), np.stack([middle, whole[:, 1], whole[:, 2]], 1)])
    vectors, one = rng.normal(size=(9, 3)), np.ones((20, 1))
    both = sum(phase_sums(part, vectors, 30 * K, one) for part in parts)
    np.testing.assert_allclose(both, phase_sums(whole, vectors, 30 * K, one), rtol=0, atol=1e-12)
