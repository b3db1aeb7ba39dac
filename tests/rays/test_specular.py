"""Specular points: closed forms on sphere and ellipsoid, curvatures by another route, all found and none hidden."""

import numpy as np
import pytest
import shared_bodies as sc
from body_checks import directions, unit
from tolerances import SHAPE_TERM, SPECULAR

from creeping.geometry.curvature import gaussian_curvature, normal_curvature
from creeping.geometry.surface import normal, project
from creeping.rays.specular import specular_points

D = unit(np.array([0.3, 0.5, 0.81]))


def test_sphere_in_closed_form(rng):
    r = directions(rng, 40)
    found = specular_points(sc.Sphere(2.0), D, r)
    np.testing.assert_array_equal(np.sort(found.observer), np.arange(40))
    r = r[found.observer]
    h = unit(r - D)
    np.testing.assert_allclose(found.points, 2 * h, atol=SPECULAR)
    np.testing.assert_allclose(found.normals, h, atol=SPECULAR)
    # half the angle between -d and r
    np.testing.assert_allclose(found.cosine, np.cos(np.arccos(-r @ D) / 2), atol=SPECULAR)
    for value in (found.along, found.across, *found.principal.T):
        np.testing.assert_allclose(value, 0.5, atol=SPECULAR)
    np.testing.assert_allclose(found.shape, 0.25, rtol=SHAPE_TERM)


def test_ellipsoid_in_closed_form(rng):
    axes = np.array([1.0, 0.8, 0.6])
    body = sc.Ellipsoid(*axes)
    r = directions(rng, 40)
    found = specular_points(body, D, r)
    # the point with normal n is A² n/|A n|
    np.testing.assert_array_equal(np.sort(found.observer), np.arange(40))
    r = r[found.observer]
    h = unit(r - D)
    np.testing.assert_allclose(found.points, axes**2 * h / np.linalg.norm(axes * h, axis=1)[:, None], atol=SPECULAR)
    # κ along the plane of incidence, and K by the adjugate
    q = unit(r + D)
    np.testing.assert_allclose(found.along, normal_curvature(body, found.points, q), rtol=1e-8)
    np.testing.assert_allclose(found.across, normal_curvature(body, found.points, np.cross(h, q)), rtol=1e-8)
    np.testing.assert_allclose(np.prod(found.principal, axis=1), gaussian_curvature(body, found.points), rtol=1e-8)
    np.testing.assert_allclose(np.sum(found.principal, axis=1), found.along + found.across, rtol=1e-10)
    assert np.all(found.principal[:, 0] <= found.principal[:, 1])
    # an affine map takes it to a sphere and its tangent planes along, the integral of e^{-2iKh} scaled:
    # a sphere's 1/(2a) becomes 1/(2 n.x), n.x the distance of the tangent plane from the centre
    distance = np.sum(found.normals * found.points, axis=1)
    np.testing.assert_allclose(found.shape, 1 / (2 * distance), rtol=SHAPE_TERM)


def blocked(body, x, direction):
    """Whether the ray from x enters the body, by dense samples that leave out the start."""
    t = np.linspace(1e-3, 6, 4000)
    return np.any(body.level(x + t[:, None] * direction) < -1e-9)


@pytest.mark.parametrize("body", [sc.Torus(), sc.TwistedEllipsoid()], ids=["torus", "twisted"])
def test_every_solution_mirrors_and_is_free(body, rng):
    d = np.ones(3) / np.sqrt(3)
    r = directions(rng, 30)
    found = specular_points(body, d, r)
    assert len(found.observer)
    r = r[found.observer]
    h = unit(r - d)
    np.testing.assert_allclose(normal(body, found.points), h, atol=SPECULAR)
    assert np.max(np.abs(body.level(found.points))) < 1e-9
    np.testing.assert_allclose(np.prod(found.principal, axis=1), gaussian_curvature(body, found.points), rtol=1e-6)
    for x, one in zip(found.points, r, strict=True):
        assert not blocked(body, x, -d)
        assert not blocked(body, x, one)


def test_all_points_of_the_torus_are_found(rng):
    # a normal n belongs to two points, in the plane of the axis and n: on the outer and on the inner half
    body = sc.Torus()
    d = np.array([0.6, 0.0, -0.8])
    r = directions(rng, 30)
    r = r[np.linalg.norm(r - d, axis=1) > 0.2]
    found = specular_points(body, d, r)
    for k, one in enumerate(r):
        h = unit(one - d)
        out = unit(h * [1, 1, 0])
        expected = project(body, np.array([out + 0.5 * h, -out + 0.5 * h]))
        np.testing.assert_allclose(normal(body, expected), [h, h], atol=2e-2)
        free = sum(not blocked(body, x, -d) and not blocked(body, x, one) for x in expected)
        assert np.sum(found.observer == k) == free


def test_forward_has_none_and_backscatter_has_one():
    body = sc.Ellipsoid(1.0, 0.8, 0.6)
    found = specular_points(body, D, np.array([D, -D, D]))
    np.testing.assert_array_equal(found.observer, [1])
    np.testing.assert_allclose(found.normals, -D[None], atol=SPECULAR)
    assert found.cosine[0] == pytest.approx(1)
    none = specular_points(body, D, D[None])
    assert len(none.observer) == 0
    assert none.principal.shape == (0, 2)


def test_grazing_directions_keep_their_point():
    # 0.1 to 1 degree beside the forward direction
    turned = D + np.array([2e-3, 0, 0]) - D * D[0] * 2e-3
    r = np.stack([turned / np.linalg.norm(turned)])
    found = specular_points(sc.Sphere(), D, r)
    assert len(found.observer) == 1
    assert found.cosine[0] == pytest.approx(np.linalg.norm(r[0] - D) / 2, rel=1e-6)
