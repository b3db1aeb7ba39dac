"""Rays shed towards observers: great circles in closed form, residuals, counts against a finer fan."""

import numpy as np
import pytest
import shared_bodies as sc
from body_checks import directions, unit
from tolerances import SHED

import creeping as cr
from creeping.geometry.surface import project
from creeping.rays.shedding import shed_near, shed_on
from creeping.rays.strips import strips_of

D = unit(np.array([0.3, 0.5, 0.81]))
SPHERE, TRIAXIAL = sc.Sphere(), sc.Ellipsoid(1.0, 0.8, 0.6)


@pytest.fixture(scope="module")
def strips():
    def made(body, length, n_rays):
        line = cr.shadow_line(body, D)
        flow = cr.DirectFlow(body, rtol=1e-11)
        return strips_of(cr.launch(flow, line, length=length, n_rays=n_rays, max_gap=np.inf))

    return {"sphere": made(SPHERE, 6.6, 48), "triaxial": made(TRIAXIAL, 3.2, 120)}


def turned(theta, alpha):
    """Unit vectors at the angle theta from D and alpha around it."""
    e = unit(np.cross(D, [1.0, 0, 0]))
    around = np.cos(alpha)[:, None] * e + np.sin(alpha)[:, None] * np.cross(D, e)
    return np.cos(theta)[:, None] * D + np.sin(theta)[:, None] * around


def test_near_rays_of_the_sphere(strips, rng):
    radius, theta, alpha = rng.uniform(1.05, 4, 20), rng.uniform(0.1, 1.2, 20), rng.uniform(-3, 3, 20)
    y = radius[:, None] * turned(theta, alpha)
    shed = shed_near(strips["sphere"], SPHERE, y)
    for k in range(20):
        mine = shed.observer == k
        reach = np.sqrt(radius[k] ** 2 - 1)
        np.testing.assert_allclose(shed.reach[mine], reach, atol=SHED)
        # the tangent from y touches at arctan(l) before it; the launch points are π/2 from D
        first = np.array([np.pi / 2 - theta[k], np.pi / 2 + theta[k]]) - np.arctan(reach)
        expected = np.concatenate([first, first + 2 * np.pi])
        expected = expected[(expected > 1e-6) & (expected < 6.6)]
        np.testing.assert_allclose(np.sort(shed.rays.time[mine]), expected, atol=SHED)


def test_near_rays_pass_through_their_points(strips, rng):
    y = project(TRIAXIAL, directions(rng, 40)) * rng.uniform(1.02, 5, 40)[:, None]
    shed = shed_near(strips["triaxial"], TRIAXIAL, y)
    assert len(shed.observer) > 20
    assert np.all(shed.reach > 0)
    end = shed.rays.points + shed.reach[:, None] * shed.rays.directions
    # the error of a spline of p grows with the distance
    assert np.max(np.linalg.norm(end - y[shed.observer], axis=1) / (1 + shed.reach)) < SHED


def test_rays_on_the_sphere_pass_through_their_points(strips, rng):
    theta = rng.uniform(0.05, 3.0, 20)
    y = turned(theta, rng.uniform(-3, 3, 20))
    shed = shed_on(strips["sphere"], SPHERE, y)
    np.testing.assert_allclose(shed.rays.points, y[shed.observer], atol=SHED)
    np.testing.assert_array_equal(shed.reach, 0)
    for k in range(20):
        ways = np.array([np.pi / 2 - theta[k], np.pi / 2 + theta[k]])
        expected = np.sort(np.concatenate([ways, ways + 2 * np.pi]))
        expected = expected[(expected > 0) & (expected < 6.6)]
        np.testing.assert_allclose(np.sort(shed.rays.time[shed.observer == k]), expected, atol=SHED)


def test_rays_on_the_ellipsoid_pass_through_their_points(strips, rng):
    sigma, s = rng.uniform(0, 4, 30), rng.uniform(0.2, 3.0, 30)
    y = strips["triaxial"][0].at(sigma, s).points
    shed = shed_on(strips["triaxial"], TRIAXIAL, y)
    np.testing.assert_allclose(shed.rays.points, y[shed.observer], atol=SHED)
    # the ray that a point was taken from is among those found
    for k in range(30):
        mine = shed.observer == k
        assert np.min(np.abs(shed.sigma[mine] - sigma[k]) + np.abs(shed.rays.time[mine] - s[k])) < 1e-5


def test_nothing_is_shed_by_no_strips_or_to_nobody(strips):
    for search in (shed_near, shed_on):
        assert len(search((), SPHERE, D[None]).observer) == 0
