"""The tracer: compiled against numpy, against scipy, and its answers to bad input."""

import numpy as np
import pytest
import shared_bodies as sc
from scipy.integrate import solve_ivp
from tolerances import JACOBI_DIFFERENCE, TRACE

import creeping as cr
from creeping.geodesics.equations import vector_field
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.states import pack, random_bundle_points
from creeping.geodesics.tableaus import RUNGE_KUTTA_4
from creeping.geometry.evaluators import speed_values
from creeping.geometry.surface import normal


def test_outputs_between_steps_are_where_steps_go(body, rng):
    states = pack(*random_bundle_points(body, 100, rng=rng), jacobi=True)
    # some equal, some at once after the start, one next to the end
    awkward = [0.0, 0.0, 1e-9, 0.1, 0.11, 0.11, 3.0 - 1e-13, 3.0, 3.0]
    times = np.sort(np.r_[awkward, rng.uniform(0, 3, 40)])
    exact = trace_states(body, states, times, rtol=0.0, step=0.02)
    for rtol in (1e-6, 1e-8, 1e-10):
        found = trace_states(body, states, times, rtol=rtol)
        growth = 1 + np.abs(exact[..., 6:]).max(axis=-1)
        assert np.max(np.abs(found - exact).max(axis=-1) / growth) < 100 * rtol
        x, p = found[..., :3], found[..., 3:6]
        n = normal(body, x)
        slope = np.linalg.norm(body.gradient(x), axis=-1)
        assert np.max(np.abs(body.level(x)) / slope) < 1e-14 + 10 * rtol**2
        np.testing.assert_allclose(np.linalg.norm(p, axis=-1), 1, atol=1e-15)
        np.testing.assert_allclose(np.sum(n * p, axis=-1), 0, atol=1e-14 + 10 * rtol**2)


def test_order_of_the_polynomial():
    body = sc.Ellipsoid(1.2, 0.8, 0.8)
    states = pack(*random_bundle_points(body, 64, rng=np.random.default_rng(4)), jacobi=True)
    steps, parts = np.array([0.5, 0.4, 0.32, 0.25]), np.array([0.15, 0.4, 0.5, 0.75])
    errors = []
    for h in steps:
        # so loose that the first step is taken as it is: errors are those of one polynomial
        found = trace_states(body, states, h * np.r_[parts, 1.0], rtol=1e-2, step=h)[:, :-1]
        errors.append(np.sqrt(np.mean((found - trace_states(body, states, h * parts, rtol=1e-13)) ** 2)))
    # of order 7: the error within a step is like h^8
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert errors[-1] > 1e-13 and slope == pytest.approx(8, abs=0.6)


def test_attenuation_ends_steps_at_outputs():
    # its rate has a kink where a ray leaves the outer half of a torus for the inner one
    body, times = sc.Torus(), np.linspace(0.1, 4, 40)
    states = pack(*random_bundle_points(body, 64, rng=np.random.default_rng(5)), jacobi=True)
    states = np.concatenate([states, np.zeros((64, 1))], axis=1)
    alone = np.stack([trace_states(body, states, times[: k + 1], rtol=1e-8)[:, -1] for k in range(5)], axis=1)
    np.testing.assert_array_equal(trace_states(body, states, times, rtol=1e-8)[:, :5], alone)


def test_against_scipy(body, rng):
    x, p = random_bundle_points(body, 2, rng=rng)
    ends = cr.trace(body, x, p, 2.0, rtol=1e-12)
    for k in range(2):

        def field(_, y):
            return np.concatenate(vector_field(body, y[:3], y[3:]))

        reference = solve_ivp(field, (0, 2), np.r_[x[k], p[k]], method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
        np.testing.assert_allclose(np.r_[ends[0][k], ends[1][k]], reference, atol=TRACE)


def test_jacobi_lane_is_the_derivative_in_the_angle(body, rng):
    x, p = random_bundle_points(body, 20, rng=rng)
    across, h = np.cross(normal(body, x), p), 1e-5
    end = trace_states(body, pack(x, p, jacobi=True), np.array([1.0]), rtol=1e-13)[:, 0]
    turned = [cr.trace(body, x, np.cos(a) * p + np.sin(a) * across, 1.0, rtol=1e-13)[0] for a in (h, -h)]
    b = np.cross(normal(body, end[:, :3]), end[:, 3:6])
    difference = np.sum(b * (turned[0] - turned[1]), axis=-1) / (2 * h)
    np.testing.assert_allclose(speed_values(body, end[:, :3]) * end[:, 8], difference, atol=JACOBI_DIFFERENCE)


def test_jacobi_matrix_has_determinant_one(body, rng):
    states = pack(*random_bundle_points(body, 20, rng=rng), jacobi=True)
    m = trace_states(body, states, np.array([1.0, 3.0]), rtol=1e-12)[..., 6:]
    np.testing.assert_allclose(m[..., 0] * m[..., 3] - m[..., 1] * m[..., 2], 1, atol=1e-9)


def test_shapes_follow_points_and_times():
    points = np.zeros((2, 5, 3))
    points[..., 0] = 1.0
    assert cr.trace(sc.Sphere(), points, [0, 1, 0], 0.5)[0].shape == (2, 5, 3)
    assert cr.trace(sc.Sphere(), points, [0, 1, 0], [0.0, 0.5])[1].shape == (2, 5, 2, 3)
    assert cr.trace(sc.Sphere(), [1, 0, 0], [0, 1, 0], 0.5)[0].shape == (3,)
    assert cr.trace(sc.Sphere(), np.zeros((0, 3)), np.zeros((0, 3)), 0.5)[0].shape == (0, 3)


def test_outputs_do_not_cost_steps():
    body = sc.Ellipsoid(1.0, 0.8, 0.6)
    states = pack(*random_bundle_points(body, 64, rng=np.random.default_rng(7)))
    ends, between = np.array([8.0]), np.linspace(0.01, 8, 800)
    one, many = [], []
    for times, taken in ((ends, one), (between, many)):
        trace_states(body, states, times, rtol=1e-8, taken=taken)
    assert abs(sum(one) - sum(many)) <= 0.1 * sum(one)


def test_estimates_are_those_of_one_method_and_no_times_no_outputs():
    states = pack(*random_bundle_points(sc.Sphere(), 3, rng=np.random.default_rng(0)))
    with pytest.raises(cr.CreepingError, match="equal steps"):
        trace_states(sc.Sphere(), states, np.array([1.0]), rtol=1e-6, method=RUNGE_KUTTA_4)
    assert trace_states(sc.Sphere(), states, np.empty(0)).shape == (3, 0, 6)


def test_step_far_too_large_is_an_error_not_a_nan():
    body = sc.TwistedEllipsoid()
    states = pack(*random_bundle_points(body, 40, rng=np.random.default_rng(0)))
    with pytest.raises(cr.CreepingError, match="shorten the step"):
        trace_states(body, states, np.array([1e6]), rtol=0.0, step=1e5)


@pytest.mark.parametrize(
    "points, directions, times, match",
    [
        ([2.0, 0, 0], [0, 1, 0], 1.0, "off the body"),
        ([1.0, 0, np.nan], [0, 1, 0], 1.0, "points are not finite"),
        ([1.0, 0, 0], [0, 0, 0], 1.0, "zero"),
        ([1.0, 0, 0], [1, 0, 0], 1.0, "normal to the body"),
        ([1.0, 0], [0, 1], 1.0, "x, y, z"),
        ([1.0, 0, 0], [0, 1, 0], -1.0, ">= 0"),
        ([1.0, 0, 0], [0, 1, 0], [1.0, 0.5], "ascend"),
        ([1.0, 0, 0], [0, 1, 0], np.nan, "finite"),
        ("point", [0, 1, 0], 1.0, "not an array of numbers"),
    ],
)
def test_bad_input_is_named(points, directions, times, match):
    with pytest.raises(cr.CreepingError, match=match):
        cr.trace(sc.Sphere(), points, directions, times)


@pytest.mark.parametrize("rtol", [0.0, 1.0, float("nan")])
def test_bad_tolerance_is_named(rtol):
    with pytest.raises(cr.CreepingError, match="rtol"):
        cr.trace(sc.Sphere(), [1, 0, 0], [0, 1, 0], 1.0, rtol=rtol)


def test_random_points_are_uniform_by_area():
    x, p = random_bundle_points(sc.Torus(), 20_000, rng=np.random.default_rng(1))
    # the outer half of the torus has (pi/2 + r/R)/pi of its area
    outer = np.mean(np.hypot(x[:, 0], x[:, 1]) > 1)
    assert outer == pytest.approx((np.pi / 2 + 0.5) / np.pi, abs=0.015)
    np.testing.assert_allclose(np.linalg.norm(p, axis=1), 1, atol=1e-14)


def test_times_that_differ_by_rounding():
    x, _ = cr.trace(sc.Sphere(), (1, 0, 0), (0, 1, 0), [0.3, 0.1 * 3])
    np.testing.assert_allclose(x[0], x[1], atol=1e-15)
