"""The attenuation integral: against quadrature of traced curvature, its numpy twin, and the exact sphere."""

import numpy as np
import pytest
import shared_bodies as sc
from oracles.attenuation import extend, extend_along, first_zero
from oracles.leaps import leap as oracle
from scipy.integrate import quad
from scipy.optimize import brentq

import creeping as cr
from creeping.geodesics import attenuation
from creeping.geodesics.attenuation import (
    NODES,
    chebyshev_times,
    fine_rules,
    gauss_rule,
    halves,
    lagrange,
)
from creeping.geodesics.bundle import random_bundle_points
from creeping.geodesics.hermite import sliding
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.states import pack
from creeping.geometry.curvature import normal_curvature

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


@pytest.mark.slow
@pytest.mark.parametrize("name", NON_CONVEX)
def test_carried_by_the_map_through_detachment(name, rng):
    body = NON_CONVEX[name]
    flow = cr.build_phase_map(body, tolerance=1e-7, length=2.0, n_steps=8)
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


@pytest.mark.slow
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
    one, other = flow.leap(states, 1), oracle(flow, states)
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


# unequal, repeated, with 0, and two that differ by rounding
AWKWARD = np.array([0.0, 0.0, 0.3, 0.3, np.nextafter(0.3, 1), 0.31, 0.9, 0.9 + 1e-9, 2.0])


class Uncompiled:
    """A body without kernels."""

    def __init__(self, body):
        for name in ("level", "gradient", "hessian", "bounds", "atlas", "parameters"):
            setattr(self, name, getattr(body, name))


@pytest.mark.parametrize("body", [sc.Torus(), sc.TwistedEllipsoid(), sc.Torus(speed="1 + 0.3*x + 0.2*z")], ids=repr)
def test_traced_kernel_equals_numpy_twin(body, rng):
    states = pack(*random_bundle_points(body, 150, rng=rng), lanes=12)
    states[:20, 11], states[:, 10] = 0.25, 7.0
    got = cr.DirectFlow(body).transport(states, AWKWARD)
    spacing = attenuation.fine_spacing(body, 1e-10)
    fine = sliding(np.unique(AWKWARD[2:]), spacing, fine_rules()[0])
    traced = trace_states(body, states[:, :10], fine.times)
    out = np.empty_like(got)
    out[:, 0, 10:] = states[:, 10:]
    extend_along(body, traced, fine, np.searchsorted(fine.times, AWKWARD), out)
    np.testing.assert_array_equal(got[..., :10], out[..., :10])
    np.testing.assert_allclose(got[..., 10], out[..., 10], rtol=0, atol=1e-11)
    np.testing.assert_allclose(got[..., 11], out[..., 11], rtol=1e-9)
    np.testing.assert_array_equal(got[:20, :, 10:], np.broadcast_to([7.0, 0.25], (20, len(AWKWARD), 2)))
    assert 20 < np.isfinite(got[20:, -1, 11]).sum() < 130


def test_body_without_kernels_attenuates_the_same(rng):
    body = sc.Torus()
    states = pack(*random_bundle_points(body, 40, rng=rng), lanes=12)
    got = cr.DirectFlow(Uncompiled(body), rtol=1e-12).transport(states, AWKWARD)
    np.testing.assert_allclose(got, cr.DirectFlow(body, rtol=1e-12).transport(states, AWKWARD), atol=1e-9)


def test_output_times_change_nothing(rng):
    body = sc.TwistedEllipsoid()
    states = pack(*random_bundle_points(body, 200, rng=rng), lanes=12)
    flow = cr.DirectFlow(body, rtol=1e-12)
    one = flow.transport(states, np.array([2.0]))[:, 0]
    dense = np.sort(np.concatenate([AWKWARD, np.linspace(0, 2, 3001)]))
    for times in (AWKWARD, dense):
        other = flow.transport(states, times)
        np.testing.assert_allclose(other[:, -1, :10], one[:, :10], atol=1e-9)
        np.testing.assert_allclose(other[:, -1, 10], one[:, 10], atol=1e-6)
        np.testing.assert_allclose(other[:, -1, 11], one[:, 11], atol=1e-7)
        assert np.all(np.diff(other[..., 10], axis=1) >= 0)
        np.testing.assert_array_equal(other[:, 0], states)


@pytest.mark.parametrize("time", [1e-320, 1e-150, 1e-14, 1e-9, 1e-5, 1e-3])
def test_short_times(time, rng):
    body = sc.Ellipsoid(1.0, 0.8, 0.6)
    states = pack(*random_bundle_points(body, 20, rng=rng), lanes=12)
    got = cr.DirectFlow(body).transport(states, np.array([0.5 * time, time]))
    rate = normal_curvature(body, states[:, :3], states[:, 3:6])[:, None] ** (2 / 3)
    np.testing.assert_allclose(got[..., 10], rate * [0.5 * time, time], rtol=1e-8 + 4 * time, atol=1e-100)
    assert np.all(np.isinf(got[..., 11]))


def test_slices_of_rays_change_nothing(rng, monkeypatch):
    body = sc.Torus()
    states = pack(*random_bundle_points(body, 150, rng=rng), lanes=12)
    flow, times = cr.DirectFlow(body), np.array([0.4, 2.0])
    whole = flow.transport(states, times)
    monkeypatch.setattr(attenuation, "WORKSPACE", 1)
    np.testing.assert_array_equal(flow.transport(states, times), whole)


@pytest.mark.parametrize("body", [sc.Ellipsoid(1.2, 1.0, 0.7), sc.Sphere(speed="1 + 0.3*x")], ids=repr)
def test_weighted_or_not_as_integrated_with_the_ray(body, rng):
    # the tracer's own lane of A, good where kappa_n has no zeros
    states = pack(*random_bundle_points(body, 100, rng=rng), lanes=12)
    times = np.array([1.0, 6.0])
    exact = trace_states(body, states[:, :11], times, rtol=1e-13)[..., 10]
    for rtol, step, bound in ((1e-12, None, 1e-8), (1e-8, None, 2e-6), (1e-8, 0.07, 2e-6)):
        got = cr.DirectFlow(body, rtol=rtol, step=step).transport(states, times)
        np.testing.assert_allclose(got[..., 10], exact, atol=bound)


def test_sliding_polynomial_has_degree_11(rng):
    outputs, points = np.array([0.2, 0.21, 1.0, 1.0 + 1e-13, 2.0]), gauss_rule(6)[0]
    fine = sliding(outputs, 0.25, points)
    polynomial = np.polynomial.Polynomial(rng.standard_normal(12), domain=[0, 2])
    knots = fine.times[fine.knots]
    assert np.all(np.diff(knots) >= 0.25 / 4) and np.all(np.diff(knots) <= 1.5 * 0.25) and knots[-1] == 2.0
    assert set(outputs) <= set(fine.times)
    data = np.stack([polynomial.deriv(d)(knots) if d else polynomial(knots) for d in range(3)], axis=1)
    at = fine.times[:-1, None] + np.diff(fine.times)[:, None] * points
    for weights, wanted, bound in ((fine.position, polynomial, 1e-12), (fine.velocity, polynomial.deriv(), 1e-10)):
        got = [weights[k] @ data[fine.first[k] : fine.first[k] + 4].ravel() for k in range(len(fine.first))]
        np.testing.assert_allclose(got, wanted(at), atol=bound)


def test_rays_that_fail_are_numbered_through(rng, monkeypatch):
    body = sc.Torus()
    states = pack(*random_bundle_points(body, 100, rng=rng), lanes=12)
    states[70, 0] = np.nan
    monkeypatch.setattr(attenuation, "WORKSPACE", 1)
    with pytest.raises(cr.IntegrationError, match="rays from 64") as caught:
        cr.DirectFlow(body).transport(states, np.array([1.0]))
    assert 70 in caught.value.failed and min(caught.value.failed) >= 64
