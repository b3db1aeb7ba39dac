"""Evenly spread points, against areas and gradients known otherwise."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.special import ellipeinc, ellipkinc

from tests.reference import clouds

BODIES = [clouds.ellipsoid(1.0, 0.8, 0.6), clouds.twisted_ellipsoid()]


def level(x):
    return np.sum((x / np.array([1.0, 0.8, 0.6])) ** 2, axis=-1) - 1


def gradient(x):
    return 2 * x / np.array([1.0, 0.8, 0.6]) ** 2


def whole(body, cloud):
    return np.concatenate([cloud.points * g for g in clouds.images(body.mirrors)])


def test_area_of_the_ellipsoid():
    a, b, c = 1.0, 0.8, 0.6
    angle, modulus = np.arccos(c / a), a**2 * (b**2 - c**2) / (b**2 * (a**2 - c**2))
    bow = ellipeinc(angle, modulus) * np.sin(angle) ** 2 + ellipkinc(angle, modulus) * np.cos(angle) ** 2
    area = 2 * np.pi * (c**2 + a * b / np.sin(angle) * bow)
    assert clouds.ellipsoid(a, b, c).area() == pytest.approx(area, rel=1e-4)


@pytest.mark.parametrize(
    "body",
    [*BODIES, replace(BODIES[1], mirrors=()), clouds.Torus(1.0, 0.4)],
    ids=["ellipsoid", "twisted", "without mirrors", "torus"],
)
def test_points_are_even_and_on_their_side(body):
    h = 0.06
    cloud = body.spread(h)
    assert np.all(cloud.points[:, list(body.mirrors)] > 0)
    points = whole(body, cloud)
    assert len(points) * h**2 == pytest.approx(body.area(), rel=0.03)
    nearest = cKDTree(points).query(points, k=2)[0][:, 1]
    # a square lattice would have h everywhere
    assert 0.45 * h < nearest.min() and nearest.max() < 1.2 * h
    # no hole: a finer cloud, of other bands, finds a point within a diagonal
    assert cKDTree(points).query(whole(body, body.spread(h / 2.7)))[0].max() < 1.1 * h


def test_points_and_normals_of_the_twisted_ellipsoid():
    def twisted(x):
        return 4 * x[..., 0] ** 2 + 4 * (x[..., 1] - 0.2 * np.cos(np.pi * x[..., 2])) ** 2 + x[..., 2] ** 2 - 1

    cloud = clouds.twisted_ellipsoid().spread(0.1)
    assert np.max(np.abs(twisted(cloud.points))) < 1e-14
    h = 1e-5 * np.eye(3)
    slopes = np.stack([twisted(cloud.points + e) - twisted(cloud.points - e) for e in h], axis=-1)
    slopes /= np.linalg.norm(slopes, axis=-1, keepdims=True)
    np.testing.assert_allclose(cloud.normals, slopes, atol=1e-8)


def test_star_is_the_body_of_its_level_set():
    body = clouds.star(level, gradient, (0, 1, 2), start=2.0)
    cloud = body.spread(0.08)
    assert np.max(np.abs(level(cloud.points))) < 1e-13
    assert body.area() == pytest.approx(BODIES[0].area(), rel=1e-4)
    assert np.all(np.sum(cloud.normals * gradient(cloud.points), axis=-1) > 0)


def test_points_of_a_torus():
    body = clouds.Torus(1.0, 0.4)
    cloud = body.spread(0.2)
    around = np.hypot(cloud.points[:, 0], cloud.points[:, 1])
    np.testing.assert_allclose((around - 1) ** 2 + cloud.points[:, 2] ** 2, 0.16, rtol=1e-13)
    centre = cloud.points * np.array([1, 1, 0]) / around[:, None]
    np.testing.assert_allclose(0.4 * cloud.normals, cloud.points - centre, atol=1e-14)
    # the tube unrolled: 2 pi r by 2 pi R
    assert body.area() == pytest.approx((2 * np.pi * 0.4) * (2 * np.pi), rel=1e-14)
