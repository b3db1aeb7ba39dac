"""Crossings of an observer's horizon, of the shadow line, and the nodes of the forward integral."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.geometry.surface import normal
from creeping.rays.observer_contour import forward_nodes
from creeping.rays.strips import strips_of

D = np.array([0.3, 0.5, 0.81]) / np.linalg.norm([0.3, 0.5, 0.81])
RADIUS = 2.0
SPHERE, TRIAXIAL = sc.Sphere(RADIUS), sc.Ellipsoid(1.0, 0.8, 0.6)
E = np.cross(D, [1.0, 0, 0]) / np.linalg.norm(np.cross(D, [1.0, 0, 0]))


@pytest.fixture(scope="module")
def fans():
    def made(body, length):
        line = cr.shadow_line(body, D)
        return cr.launch(cr.DirectFlow(body, rtol=1e-11), line, length=length, n_rays=80, max_gap=np.inf)

    return {"sphere": made(SPHERE, 8.0), "triaxial": made(TRIAXIAL, 2.0)}


def directions_at(*angles):
    return np.array([np.cos(a) * D + np.sin(a) * E for a in angles])


@pytest.mark.parametrize("theta", [0.02, 0.3, 1.0])
def test_forward_nodes_of_the_sphere(fans, theta):
    fan = fans["sphere"]
    r = directions_at(theta)
    shadow, lit, missing = forward_nodes(strips_of(fan), fan.line, np.array([0]), r, np.array([40]))
    assert not len(missing)
    # both halves are half great circles, of arclength πa across the wave
    assert shadow.weight.sum() == pytest.approx(np.pi * RADIUS, rel=1e-6)
    assert lit.weight.sum() == pytest.approx(np.pi * RADIUS, rel=1e-4)
    np.testing.assert_allclose(normal(SPHERE, shadow.rays.points) @ r[0], 0, atol=1e-8)
    assert np.all(shadow.rays.time <= np.pi * RADIUS / 2)
    np.testing.assert_allclose(lit.normals @ (D + r[0]), 0, atol=1e-8)
    assert np.all(lit.normals @ D < 1e-9)
    for value in (lit.along, lit.across):
        np.testing.assert_allclose(value, 1 / RADIUS, rtol=1e-9)


def test_forward_nodes_of_the_ellipsoid(fans):
    fan = fans["triaxial"]
    r = directions_at(0.1, 0.25, 0.5)
    shadow, lit, missing = forward_nodes(strips_of(fan), fan.line, np.array([0, 2]), r, np.array([30, 60]))
    assert not len(missing)
    assert set(shadow.observer) == set(lit.observer) == {0, 2}
    n = normal(TRIAXIAL, shadow.rays.points)
    np.testing.assert_allclose(np.sum(n * r[shadow.observer], axis=1), 0, atol=1e-7)
    assert np.all(np.sum(shadow.rays.first_normal * r[shadow.observer], axis=1) < 0)
    np.testing.assert_allclose(np.sum(lit.normals * (D + r[lit.observer]), axis=1), 0, atol=1e-8)
    assert np.max(np.abs(TRIAXIAL.level(lit.points))) < 1e-8
    # both halves project on the same chord, from crossing to crossing across the plane of d and r; Green's theorem on
    # an affine circle: the sum of widths across q is that of the shadow line of the direction q
    for k in (0, 2):
        q = (D + r[k]) / np.linalg.norm(D + r[k])
        line = cr.shadow_line(TRIAXIAL, q)
        curve = line.curves[0]
        s = np.linspace(0, curve.length, 4001)[:-1]
        x = curve.at(s)
        step = np.roll(x, -1, axis=0) - x
        width = np.sum(np.abs(np.sum(step * np.cross(normal(TRIAXIAL, x), q), axis=1))) / 2
        assert lit.weight[lit.observer == k].sum() == pytest.approx(width, rel=1e-3)
