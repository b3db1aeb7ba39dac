"""Traced and composed rays against closed forms and conserved quantities."""

import numpy as np
import pytest
import shared_bodies as sc
from tolerances import INVARIANT, TRACE

import creeping as cr
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.states import pack, random_bundle_points
from creeping.geometry.curvature import gaussian_curvature

TIMES = np.array([0.4, 1.0, 2.5, 4.0])


def carriers(body, phase_map):
    """Direct and composed rays, each with the drift it is allowed."""
    flow = phase_map(body)
    return [(cr.DirectFlow(body, rtol=1e-12), INVARIANT), (flow, 200 * flow.error.rms)]


def test_clairaut_on_the_torus(phase_map, rng):
    body = sc.Torus()
    x, p = random_bundle_points(body, 30, rng=rng)
    # rho cos(angle to the parallel) = x p_y - y p_x
    before = x[:, 0] * p[:, 1] - x[:, 1] * p[:, 0]
    for flow, bound in carriers(body, phase_map):
        y, q = flow.flow(x, p, TIMES)
        after = y[..., 0] * q[..., 1] - y[..., 1] * q[..., 0]
        np.testing.assert_allclose(after, np.broadcast_to(before[:, None], after.shape), atol=bound)


def test_torus_equators_have_constant_curvature():
    body = sc.Torus()
    # outer: K = 1/(r (R + r)) = 4/3, inner: K = -1/(r (R - r)) = -4
    outer, inner = np.array([[1.5, 0, 0]]), np.array([[0.5, 0, 0]])
    p = np.array([[0.0, 1.0, 0.0]])
    m = trace_states(body, pack(outer, p, jacobi=True), TIMES, rtol=1e-12)[0, :, 6:]
    np.testing.assert_allclose(m[:, 0], np.cos(np.sqrt(4 / 3) * TIMES), atol=TRACE)
    # the inner equator is unstable: the ray itself leaves it as exp(2 t) times rounding
    m = trace_states(body, pack(inner, p, jacobi=True), TIMES[:3], rtol=1e-12)[0, :, 6:]
    np.testing.assert_allclose(m[:, 0], np.cosh(2 * TIMES[:3]), rtol=1e-9)


def test_joachimsthal_on_the_triaxial_ellipsoid(phase_map, rng):
    body = sc.Ellipsoid(1.0, 0.8, 0.6)
    axes2 = np.array([1.0, 0.8, 0.6]) ** 2
    x, p = random_bundle_points(body, 30, rng=rng)

    def invariant(x, p):
        return np.sum(x**2 / axes2**2, axis=-1) * np.sum(p**2 / axes2, axis=-1)

    before = invariant(x, p)[:, None]
    for flow, bound in carriers(body, phase_map):
        after = invariant(*flow.flow(x, p, TIMES))
        assert np.max(np.abs(after / before - 1)) < 10 * bound


def test_spheroid_against_karney(rng):
    geographic = pytest.importorskip("geographiclib.geodesic")
    # Karney's series are of order 6 in the third flattening: 1e-14 at this one
    a, c = 1.0, 0.98
    earth = geographic.Geodesic(a, 1 - c / a)
    body = sc.Ellipsoid(a, a, c)
    for lat, azimuth, s in [(10.0, 35.0, 2.0), (-40.0, 120.0, 3.0), (0.0, 90.0, 1.0), (65.0, -20.0, 2.5)]:
        masks = geographic.Geodesic.ALL
        row = earth.Direct(lat, 0.0, azimuth, s, masks)

        def frame(latitude, longitude):
            lat, lon = np.radians([latitude, longitude])
            n = a**2 / np.hypot(a * np.cos(lat), c * np.sin(lat))
            x = np.array([n * np.cos(lat) * np.cos(lon), n * np.cos(lat) * np.sin(lon), c**2 / a**2 * n * np.sin(lat)])
            north = np.array([-np.sin(lat) * np.cos(lon), -np.sin(lat) * np.sin(lon), np.cos(lat)])
            return x, north, np.array([-np.sin(lon), np.cos(lon), 0.0])

        x, north, east = frame(lat, 0.0)
        p = np.cos(np.radians(azimuth)) * north + np.sin(np.radians(azimuth)) * east
        end = trace_states(body, pack(x, p, jacobi=True), np.array([s]), rtol=1e-12)[0, 0]
        y, north, east = frame(row["lat2"], row["lon2"])
        q = np.cos(np.radians(row["azi2"])) * north + np.sin(np.radians(row["azi2"])) * east
        np.testing.assert_allclose(end[:3], y, atol=TRACE)
        np.testing.assert_allclose(end[3:6], q, atol=TRACE)
        # geodesic scale and reduced length [K13]
        np.testing.assert_allclose([end[6], end[8]], [row["M12"], row["m12"]], atol=10 * TRACE)


def test_moebius_speed_is_the_round_sphere(rng):
    # the weight 2a/((1 - z) + a^2 (1 + z)) = 1/c is the pull-back of the round metric by the dilation a of the plane
    a = 1.7
    body = sc.Sphere(speed=f"((1 - z) + {a**2}*(1 + z))/(2*{a})")

    def dilate(x):
        plane = a * x[..., :2] / (1 - x[..., 2:])
        r2 = np.sum(plane**2, axis=-1, keepdims=True)
        return np.concatenate([2 * plane, r2 - 1], axis=-1) / (r2 + 1)

    x, p = random_bundle_points(body, 30, rng=rng)
    h = 1e-6
    y = dilate(x)
    c = body.speed.value(x)[:, None]
    q = c * (dilate((x + h * p) / np.hypot(1, h)) - dilate((x - h * p) / np.hypot(1, h))) / (2 * h)
    ends = cr.trace(body, x, p, TIMES, rtol=1e-12)[0]
    expected = np.cos(TIMES)[:, None] * y[:, None] + np.sin(TIMES)[:, None] * q[:, None]
    np.testing.assert_allclose(dilate(ends), expected, atol=1e-7)


def test_gaussian_curvature_in_closed_form(rng):
    x, _ = random_bundle_points(sc.Ellipsoid(1.0, 0.8, 0.6), 20, rng=rng)
    axes = np.array([1.0, 0.8, 0.6])
    expected = 1 / (np.prod(axes) ** 2 * np.sum(x**2 / axes**4, axis=-1) ** 2)
    np.testing.assert_allclose(gaussian_curvature(sc.Ellipsoid(1.0, 0.8, 0.6), x), expected, rtol=1e-12)
    x, _ = random_bundle_points(sc.Torus(), 20, rng=rng)
    rho = np.hypot(x[:, 0], x[:, 1])
    np.testing.assert_allclose(gaussian_curvature(sc.Torus(), x), 4 * (rho - 1) / rho, atol=1e-12)
