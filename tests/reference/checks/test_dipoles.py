"""Dipoles inside conductors, against partial waves on the sphere and reciprocity on another body."""

import numpy as np

from tests.reference import clouds, dipoles, sphere

Z = np.array([[0.0, 0.0, 1.0]])


def test_sphere():
    # theta along x and phi along y at z: in the plane y = 0 the first is parallel, the second across
    solution = dipoles.scatter(clouds.ellipsoid(1.0, 1.0, 1.0), 5.0, Z, depth=0.3, least=1000)
    angle = np.linspace(0.1, 3.0, 20)
    r = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    across, along = sphere.pec_far_field(5.0, 1.0, np.cos(angle))
    found = solution.far_field(r)[:, 0]
    assert solution.residual.max() < 1e-4
    np.testing.assert_allclose(found[:, 0, 0], along, atol=1e-5)
    np.testing.assert_allclose(found[:, 1, 1], across, atol=1e-5)
    np.testing.assert_allclose(found[:, [0, 1], [1, 0]], 0, atol=1e-5)


def test_reciprocity():
    body = clouds.ellipsoid(1.0, 0.8, 0.6)
    d = np.array([[0.6, 0.0, 0.8], [0.48, 0.64, -0.6]])
    solution = dipoles.scatter(body, 3.0, d, depth=0.2, least=800)
    # f(r <- d) is the transpose of f(-d <- -r), with theta turned at the opposite direction
    back = dipoles.scatter(body, 3.0, -d[::-1], depth=0.2, least=800)
    one, other = solution.far_field(d[1:])[0, 0], back.far_field(-d[:1])[0, 0]
    turn = np.diag([1.0, -1.0])
    np.testing.assert_allclose(one, turn @ other.T @ turn, atol=1e-3)


def test_near_field_of_the_sphere(rng):
    d = np.array([[0.36, 0.48, 0.8]])
    solution = dipoles.scatter(clouds.ellipsoid(1.0, 1.0, 1.0), 4.0, d, depth=0.3)
    x = rng.normal(size=(30, 3))
    x *= rng.uniform(1.0, 2.0, (30, 1)) / np.linalg.norm(x, axis=1, keepdims=True)
    found = solution.total(x)
    for i, e in enumerate(dipoles.frames(d)[0]):
        for mine, exact in zip(found, sphere.pec_total_field(4.0, 1.0, x, d[0], e), strict=True):
            np.testing.assert_allclose(mine[:, :, 0, i], exact, atol=1e-5)
