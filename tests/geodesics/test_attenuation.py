"""The attenuation integral: against quadrature of traced curvature."""

import numpy as np
import pytest
import shared_bodies as sc
from scipy.integrate import quad
from scipy.optimize import brentq

import creeping as cr
from creeping.geodesics import attenuation
from creeping.geodesics.attenuation import (
    NODES,
    chebyshev_times,
    gauss_rule,
    halves,
)
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.states import pack, random_bundle_points
from creeping.geometry.curvature import normal_curvature
from creeping.geometry.evaluators import speed_values
from creeping.geometry.patches import interpolation

# unequal, repeated, with 0, and two that differ by rounding
AWKWARD = np.array([0.0, 0.0, 0.3, 0.3, np.nextafter(0.3, 1), 0.31, 0.9, 0.9 + 1e-9, 2.0])


def rate_along(body, state):
    """c^(3/2) kappa_n along one ray as a function of time, by direct integration."""

    def rate(t):
        ends = trace_states(body, state[None, :6], np.atleast_1d(t), rtol=1e-13)[0]
        x, p = ends[:, :3], ends[:, 3:6]
        return speed_values(body, x) ** 1.5 * normal_curvature(body, x, p)

    return rate


def by_quadrature(body, state, length):
    """A and the time of detachment of one ray, by brentq and quad."""
    rate = rate_along(body, state)
    grid = np.linspace(0, length, 161)
    below = np.flatnonzero(rate(grid) <= 0)
    end = np.inf
    if len(below):
        end = 0.0 if below[0] == 0 else brentq(lambda t: rate(t)[0], *grid[below[0] - 1 : below[0] + 1], xtol=1e-13)
    stop = min(end, length)
    # t = stop (1 - s^3) takes the root of the power out of the integrand's end
    total = 3 * stop * quad(lambda s: s * s * max(rate(stop * (1 - s**3))[0], 0) ** (2 / 3), 0, 1, epsabs=1e-10)[0]
    return total, end


@pytest.mark.parametrize("body", [sc.TwistedEllipsoid(), sc.Torus(speed="1 + 0.3*x + 0.2*z")], ids=repr)
def test_attenuation_and_detachment_are_those_of_quadrature(body, rng):
    states = pack(*random_bundle_points(body, 40, rng=rng), lanes=12)
    states[:20, 11], states[:, 10] = 0.25, 7.0
    got = cr.DirectFlow(body, rtol=1e-12).transport(states, AWKWARD)
    # detached rays stay so
    np.testing.assert_array_equal(got[:20, :, 10:], np.broadcast_to([7.0, 0.25], (20, len(AWKWARD), 2)))
    ended = np.isfinite(got[:, -1, 11])
    for row in (*(20 + np.flatnonzero(ended[20:])[:2]), *(20 + np.flatnonzero(~ended[20:])[:2])):
        total, end = by_quadrature(body, states[row], AWKWARD[-1])
        assert got[row, -1, 10] - 7 == pytest.approx(total, abs=1e-8)
        assert got[row, -1, 11] == pytest.approx(end, abs=1e-8)


def test_weighted_rate_carries_the_speed():
    body = sc.Sphere(speed="2 + 0*x")
    states = pack(*random_bundle_points(body, 10, rng=np.random.default_rng(0)), lanes=12)
    for flow in (cr.build_phase_map(body, horizon=0.25, grid=(12, 16)), cr.DirectFlow(body)):
        got = flow.transport(states, np.array([0.5]))
        np.testing.assert_allclose(got[..., 10], 2 * 0.5, rtol=1e-10)


def test_rules():
    times = chebyshev_times()
    coefficients = np.arange(1.0, NODES + 1)
    polynomial = np.polynomial.Polynomial(coefficients)
    at = np.linspace(0, 1, 7)
    np.testing.assert_allclose(interpolation(times, at) @ polynomial(times), polynomial(at), rtol=1e-12)
    both = np.concatenate([polynomial(times / 2), polynomial(0.5 + times / 2)])
    np.testing.assert_allclose(halves() @ both, polynomial(times), rtol=1e-12)
    assert np.sum(gauss_rule()[1]) == pytest.approx(1)


class Uncompiled:
    """A body without kernels."""

    def __init__(self, body):
        for name in ("level", "gradient", "hessian", "bounds", "atlas", "parameters"):
            setattr(self, name, getattr(body, name))


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


@pytest.mark.parametrize("time", [1e-320, 1e-14, 1e-5])
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


def test_rays_that_fail_are_numbered_through(rng, monkeypatch):
    body = sc.Torus()
    states = pack(*random_bundle_points(body, 100, rng=rng), lanes=12)
    states[70, 0] = np.nan
    monkeypatch.setattr(attenuation, "WORKSPACE", 1)
    with pytest.raises(cr.IntegrationError, match="rays from 64") as caught:
        cr.DirectFlow(body).transport(states, np.array([1.0]))
    assert 70 in caught.value.failed and min(caught.value.failed) >= 64


@pytest.mark.parametrize("body", [sc.Torus(1.0, 0.4), sc.Sphere(speed="1 + 0.2*x")], ids=["torus", "weighted"])
@pytest.mark.parametrize("count", [5, 150])
def test_curvatures_between_knots_are_those_of_the_rays(body, count, rng):
    times = np.linspace(0, 1.2, 7)
    states = trace_states(body, pack(*random_bundle_points(body, count, rng=rng)), times, rtol=1e-10)
    fine = attenuation.sliding(times[1:], 0.2, attenuation.fine_rules()[0])
    assert len(fine.times) == len(times)
    bent = attenuation._bent(body, states, fine)
    # of the rays themselves, traced to the points
    points = (fine.times[:-1, None] + np.diff(fine.times)[:, None] * attenuation.fine_rules()[0]).ravel()
    there = trace_states(body, states[:, 0], points, rtol=1e-12)
    wanted = attenuation.curvature_values(body, there.reshape(-1, 6)).reshape(count, len(fine.first), -1)
    assert np.allclose(np.moveaxis(bent[:, 1:-1], 2, 0), wanted, rtol=0, atol=1e-5)
