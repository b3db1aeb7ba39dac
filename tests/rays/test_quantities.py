"""Quantities along creeping rays: closed forms on the sphere and the spheroid, direct traces, detached rays."""

import numpy as np
import pytest
import shared_bodies as sc
from scipy.integrate import solve_ivp
from tolerances import ALONG_RAY

import creeping as cr
from creeping.geometry.curvature import gaussian_curvature, normal_curvature
from creeping.rays.strips import ray_points as points_of
from creeping.rays.tracer import RayTracer

INCIDENCE = (0.3, 0.5, 0.81)
TRIAXIAL = sc.Ellipsoid(1.0, 0.8, 0.6)


def launched(body, direction=INCIDENCE, **options):
    options = {"length": 3.0, "n_rays": 12, "n_steps": 30, "max_gap": np.inf} | options
    return cr.launch(cr.DirectFlow(body, rtol=1e-12), cr.shadow_line(body, direction), **options)


def test_sphere_in_closed_form():
    fan = launched(sc.Sphere(2.0), length=25.0, n_rays=5)
    s, rays = points_of(fan)
    every = np.broadcast_to(s, rays.time.shape)
    assert s[0] == 0
    assert s[-1] == pytest.approx(25.0)
    np.testing.assert_allclose(rays.time, every)
    d = np.array(INCIDENCE) / np.linalg.norm(INCIDENCE)
    x0 = rays.points[:, :1]
    np.testing.assert_allclose(rays.points, np.cos(s / 2)[:, None] * x0 + np.sin(s / 2)[:, None] * 2 * d, atol=1e-8)
    np.testing.assert_allclose(rays.spreading, np.cos(every / 2), atol=1e-8)
    np.testing.assert_allclose(rays.spreading_rate, -np.sin(every / 2) / 2, atol=1e-8)
    for value in (*rays.curvature, *rays.transverse):
        np.testing.assert_allclose(value, 0.5, atol=1e-9)
    for value in (*rays.radius_rate, *rays.radius_bend):
        np.testing.assert_allclose(value, 0, atol=1e-5)
    powers = (0.5 ** (1 / 3), 0.5 ** (2 / 3), 0.5 ** (4 / 3), 0.5 ** (4 / 3), 0.0)
    for k, power in enumerate(powers):
        np.testing.assert_allclose(rays.integrals[..., k], power * every, atol=1e-6)
    np.testing.assert_allclose(rays.eikonal, every, atol=1e-9)
    np.testing.assert_allclose(rays.width, 1, atol=1e-9)
    np.testing.assert_allclose(rays.first_normal, np.broadcast_to(x0 / 2, rays.points.shape), atol=1e-9)
    assert np.all(rays.alive)


def test_zeros_passed_on_the_sphere():
    s, rays = points_of(launched(sc.Sphere(), length=12.0, n_rays=3))
    apart = np.abs(np.mod(s + np.pi / 4, np.pi / 2) - np.pi / 4) > 1e-3
    # J = cos s has its zeros at (k + 1/2)π; J' = -sin s, whose zero at the launch point counts
    for ray in rays.caustics:
        np.testing.assert_array_equal(ray[apart], np.floor(s / np.pi + 0.5)[apart])
    for ray in rays.far_caustics:
        np.testing.assert_array_equal(ray[apart], (1 + np.floor(s / np.pi))[apart])
    behind = (np.cos(s) * np.sin(s) > 0)[apart]
    np.testing.assert_array_equal((rays.far_caustics - rays.caustics)[0, apart], behind)


def spheroid_meridian(a, c, length):
    """Arclength to κₙ, κ_t, and their integrals, on the meridian of x = a cos u, z = c sin u from u = 0."""

    def rate(s, y):
        u = y[0]
        speed = np.sqrt(a**2 * np.sin(u) ** 2 + c**2 * np.cos(u) ** 2)
        kappa, across = a * c / speed**3, c / a / speed
        # ρ = speed³/(ac), with (speed²)' = (a² - c²) sin 2u / speed
        square, first = speed**2, (a**2 - c**2) * np.sin(2 * u) / speed
        second = (2 * (a**2 - c**2) * np.cos(2 * u) / speed - first**2 / (2 * speed)) / speed
        rho = speed**3 / (a * c)
        rho1 = 1.5 * np.sqrt(square) * first / (a * c)
        rho2 = (0.75 * first**2 / np.sqrt(square) + 1.5 * np.sqrt(square) * second) / (a * c)
        varying = rho * rho2 - 2 / 3 * rho1**2
        root = np.cbrt(kappa)
        return [1 / speed, root, root**2, root**4, root * across, root**4 * varying]

    found = solve_ivp(rate, (0, length), np.zeros(6), rtol=1e-11, atol=1e-13, dense_output=True)
    return found.sol


def test_spheroid_meridian_in_closed_form():
    # incidence along the axis: the shadow line is the equator, every ray a meridian
    body = sc.Ellipsoid(1.0, 1.0, 1.5)
    fan = launched(body, (0, 0, 1), n_rays=6)
    s, rays = points_of(fan)
    expected = spheroid_meridian(1.0, 1.5, 3.0)(s)
    u = expected[0]
    np.testing.assert_allclose(rays.points[..., 2], np.broadcast_to(1.5 * np.sin(u), rays.time.shape), atol=ALONG_RAY)
    # meridians part like their distance from the axis
    np.testing.assert_allclose(rays.spreading, np.broadcast_to(np.cos(u), rays.time.shape), atol=ALONG_RAY)
    for k, tolerance in enumerate((1, 1, 1, 1, 100)):
        wanted = np.broadcast_to(expected[1 + k], rays.time.shape)
        np.testing.assert_allclose(rays.integrals[..., k], wanted, atol=tolerance * ALONG_RAY, err_msg=str(k))


def test_every_ray_obeys_jacobi_and_stays_on_the_body():
    fan = launched(TRIAXIAL)
    _, rays = points_of(fan)
    g = np.linalg.norm(TRIAXIAL.gradient(rays.points), axis=-1)
    assert np.max(np.abs(TRIAXIAL.level(rays.points)) / g) < 1e-9
    np.testing.assert_allclose(np.linalg.norm(rays.directions, axis=-1), 1, atol=1e-9)
    # J'' + K J = 0 by a central difference of J'
    step = rays.time[0, 1] - rays.time[0, 0]
    rate, J, K = rays.spreading_rate, rays.spreading, gaussian_curvature(TRIAXIAL, rays.points)
    bend = (8 * (rate[:, 3:-1] - rate[:, 1:-3]) - (rate[:, 4:] - rate[:, :-4])) / (12 * step)
    np.testing.assert_allclose(bend, -(K * J)[:, 2:-2], atol=2e-3)
    np.testing.assert_allclose(np.tan(rays.prufer), -rays.scale * rate / J, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(rays.curvature[1], normal_curvature(TRIAXIAL, rays.points, rays.directions), atol=1e-12)


@pytest.mark.parametrize("body", [sc.Torus(), sc.TwistedEllipsoid()])
def test_detached_rays_end(body):
    fan = launched(body, (1, 1, 1), length=4.0, n_rays=60, launch_from="all")
    s, rays = points_of(fan)
    # nor are those alive that the wave does not launch
    assert not np.any(rays.alive[~fan.launched])
    gone = np.flatnonzero(np.isfinite(fan.detachment) & (fan.status == cr.RayStatus.DETACHED))
    assert len(gone) > 3
    for ray in gone:
        past = s >= fan.detachment[ray]
        np.testing.assert_array_equal(rays.alive[ray], ~past)
        ended = rays.integrals[ray, past]
        assert len(ended)
        # integrals stop at detachment
        np.testing.assert_allclose(ended, np.broadcast_to(ended[0], ended.shape), atol=1e-12)
    assert np.all(np.isfinite(rays.lanes))
    assert np.all(rays.alive[fan.status == cr.RayStatus.OK])
    assert np.all(np.diff(rays.integrals[..., :3], axis=1) >= -1e-12)


def test_times_of_the_fan_itself():
    for n_steps in (2, 5, 40, 300):
        fan = launched(TRIAXIAL, n_steps=n_steps, n_rays=3)
        s, rays = points_of(fan, fan.travel_time)
        np.testing.assert_array_equal(s, fan.travel_time)
        np.testing.assert_allclose(rays.points, fan.points, atol=1e-9)
        np.testing.assert_allclose(rays.spreading, fan.spreading, atol=1e-8)


def test_a_ray_does_not_depend_on_those_it_is_traced_with(rng):
    fan = launched(sc.TwistedEllipsoid(), n_rays=300)
    tracer, d = RayTracer(fan.body, 3.0), np.broadcast_to(fan.line.direction, (len(fan.points), 3))
    starts, tangents = tracer.onto_line(fan.points[:, 0], d)
    times = rng.uniform(0, 3, len(starts))
    whole = tracer.at(d, starts, tangents, times).rays
    np.testing.assert_array_equal(whole[5:9].eikonal, whole.eikonal[5:9])
    for row in (0, 17, 250):
        one = tracer.at(d[row : row + 1], starts[row : row + 1], tangents[row : row + 1], times[row : row + 1]).rays
        np.testing.assert_array_equal(one.lanes[0], whole.lanes[row])
        np.testing.assert_array_equal(one.starts[0], whole.starts[row])


def test_weighted_body_is_refused():
    fan = launched(sc.Sphere(speed="1 + x/4"), length=1.0)
    with pytest.raises(cr.CreepingError, match="speed"):
        points_of(fan)
