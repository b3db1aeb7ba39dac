"""The attenuation integral: against quadrature of traced curvature, its numpy twin, and the exact sphere."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import creeping as cr
import scatterers as sc
from creeping.phaseflow.attenuation import NODES, chebyshev_times, extend, first_zero, gauss_rule, halves, lagrange
from creeping.phaseflow.bundle import random_bundle_points
from creeping.phaseflow.geodesic import normal_curvature
from creeping.phaseflow.tracing import pack, trace_states

NON_CONVEX = {"torus": sc.Torus(), "twisted": sc.TwistedEllipsoid()}


def traced_curvature(body, state):
    """kappa_n along one ray as a function of time, by direct integration."""

    def kappa(t):
        end = trace_states(body, state[None, :6], np.array([t]), rtol=1e-13)[0, 0]
        return float(normal_curvature(body, end[:3], end[3:]))

    return kappa


def by_quadrature(body, state, length):
    """A and the time of detachment of one ray, by brentq and quad."""
    kappa = traced_curvature(body, state)
    grid = np.linspace(0, length, 161)
    values = trace_states(body, state[None, :6], grid, rtol=1e-12)[0]
    curved = normal_curvature(body, values[:, :3], values[:, 3:6])
    below = np.flatnonzero(curved <= 0)
    end = np.inf
    if len(below):
        end = 0.0 if below[0] == 0 else brentq(kappa, grid[below[0] - 1], grid[below[0]], xtol=1e-13)
    stop = min(end, length)
    # t = stop (1 - s^3) takes the root of the power out of the integrand's end
    total = 3 * stop * quad(lambda s: s * s * max(kappa(stop * (1 - s**3)), 0) ** (2 / 3), 0, 1, epsabs=1e-10)[0]
    return total, end


@pytest.mark.parametrize("name", NON_CONVEX)
def test_carried_by_the_map_through_detachment(name, rng):
    body = NON_CONVEX[name]
    flow = cr.build_phase_map(body, tolerance=1e-7, length=2.0, outputs=8)
    states = pack(*random_bundle_points(body, 400, rng=rng), lanes=12)
    times = np.arange(1, 9) / 4
    got = flow.transport(states, times)
    direct = cr.DirectFlow(body, rtol=1e-12).transport(states, times)
    same = np.isinf(got[:, -1, 11]) == np.isinf(direct[:, -1, 11])
    # a ray that touches kappa_n = 0 may detach for one and pass for the other
    assert np.mean(same) > 0.98
    assert np.sqrt(np.mean((got[same, :, 10] - direct[same, :, 10]) ** 2)) < 2e-5
    ended = same & np.isfinite(direct[:, -1, 11])
    assert ended.sum() > 50
    assert np.median(np.abs(got[ended, -1, 11] - direct[ended, -1, 11])) < 1e-6
    for row in np.flatnonzero(same)[:4]:
        total, end = by_quadrature(body, states[row], 2.0)
        assert direct[row, -1, 10] == pytest.approx(total, abs=1e-6)
        assert got[row, -1, 10] == pytest.approx(total, abs=1e-5)
        assert direct[row, -1, 11] == pytest.approx(end, abs=1e-8)


def test_sphere_is_exact():
    body = sc.Sphere(radius=2.0)
    flow = cr.build_phase_map(body, horizon=0.5, grid=(12, 16))
    states = pack(*random_bundle_points(body, 10, rng=np.random.default_rng(0)), lanes=12)
    got = flow.transport(states, np.array([0.5, 3.0]))
    np.testing.assert_allclose(got[..., 10], 0.5 ** (2 / 3) * np.array([[0.5, 3.0]] * 10), rtol=1e-12)
    assert np.all(np.isinf(got[..., 11]))


def test_weighted_rate_carries_the_speed():
    body = sc.Sphere(speed="2 + 0*x")
    states = pack(*random_bundle_points(body, 10, rng=np.random.default_rng(0)), lanes=12)
    for flow in (cr.build_phase_map(body, horizon=0.25, grid=(12, 16)), cr.DirectFlow(body)):
        got = flow.transport(states, np.array([0.5]))
        np.testing.assert_allclose(got[..., 10], 2 * 0.5, rtol=1e-10)


def test_times_between_leaps_agree_with_direct_flow(rng):
    body = sc.TwistedEllipsoid()
    flow = cr.build_phase_map(body, tolerance=1e-7)
    states = pack(*random_bundle_points(body, 50, rng=rng), lanes=12)
    times = np.array([0.1, 0.33, 0.9])
    got, direct = flow.transport(states, times), cr.DirectFlow(body, rtol=1e-12).transport(states, times)
    np.testing.assert_allclose(got[..., :11], direct[..., :11], atol=3e-5)


def test_kernel_equals_numpy_twin(rng):
    body = sc.Torus()
    flow = cr.build_phase_map(body, horizon=0.3, grid=(32, 24), precision="double")
    states = pack(*random_bundle_points(body, 300, rng=rng), lanes=12)
    one, other = flow.leap(states, 1), flow.leap_numpy(states)
    np.testing.assert_allclose(one[:, :11], other[:, :11], rtol=0, atol=1e-11)
    np.testing.assert_allclose(one[:, 11], other[:, 11], rtol=1e-9)
    assert np.isfinite(one[:, 11]).sum() > 20


def test_rules():
    times = chebyshev_times()
    coefficients = np.arange(1.0, NODES + 1)
    polynomial = np.polynomial.Polynomial(coefficients)
    at = np.linspace(0, 1, 7)
    np.testing.assert_allclose(lagrange(at) @ polynomial(times), polynomial(at), rtol=1e-12)
    both = np.concatenate([polynomial(times / 2), polynomial(0.5 + times / 2)])
    np.testing.assert_allclose(halves() @ both, polynomial(times), rtol=1e-12)
    assert np.sum(gauss_rule()[1]) == pytest.approx(1)
    assert first_zero(0.3 - times) == pytest.approx(0.3, abs=1e-12)
    assert first_zero(1 + times) == np.inf
    assert first_zero(-times) == 0.0


def test_a_detached_ray_stays_so():
    total, end = np.array([1.0]), np.array([0.25])
    extend(np.ones((1, NODES)), 0.5, np.array([0.5]), total, end)
    assert (total[0], end[0]) == (1.0, 0.25)
