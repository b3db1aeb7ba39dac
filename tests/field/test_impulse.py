"""Responses to a pulse: delays against lengths of paths, errors, and what they share with range profiles."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr


@pytest.mark.parametrize("window", ["hann", "taylor", "none"])
def test_two_paths_stand_at_their_delays(window):
    k = np.linspace(150.0, 450.0, 301)
    u = 0.5 * np.exp(1.7j * k) + 0.2j * np.exp(2.4j * k)
    found = cr.impulse_response(u, k, start=0.5, window=window)
    np.testing.assert_allclose(found.arrivals(2, above=0.3), [1.7, 2.4], atol=found.resolution / 20)
    heights = np.interp([1.7, 2.4], found.delay, found.envelope)
    np.testing.assert_allclose(heights, [0.5, 0.2], rtol=0.02 if window != "none" else 0.1)
    # half power: 0.886 and 1.44 widths of 2 pi/(k_N - k_1)
    width = found.resolution / (2 * np.pi / 301)
    assert width == pytest.approx({"none": 0.886, "hann": 1.44, "taylor": 1.2}[window], rel=0.05)
    assert (found.delay[0], found.period) == pytest.approx((0.5, 2 * np.pi))


def test_values_are_the_sum_that_is_written():
    rng = np.random.default_rng(3)
    k = np.linspace(5.0, 12.0, 15)
    u = rng.normal(size=(15, 2)) + 1j * rng.normal(size=(15, 2))
    found = cr.impulse_response(u, k, window="none", start=-1.3)
    for number in (0, 17, 63):
        direct = np.mean(u * np.exp(-1j * k * found.delay[number])[:, None], axis=0)
        np.testing.assert_allclose(found.values[number], direct, rtol=1e-10)


def test_delays_are_seconds_by_a_speed():
    k = np.linspace(20.0, 60.0, 81)
    found = cr.impulse_response(np.exp(3j * k), k, speed=340.0, start=0.0)
    assert found.arrivals(1) == pytest.approx([3.0 / 340.0], rel=1e-3) and found.unit == "s"
    assert "s, repeats after" in repr(found)


def test_delays_come_round():
    # a path that is longer than the period stands where the period is taken off; also right at the seam
    k = np.linspace(20.0, 60.0, 81)
    period = 2 * np.pi / 0.5
    for start in (0.0, 1.0):
        found = cr.impulse_response(np.exp(1j * k * (period + 1.0)), k, start=start)
        assert found.arrivals(1) == pytest.approx([1.0], abs=1e-3)


@pytest.mark.slow
def test_creeping_paths_on_a_sphere_have_their_lengths():
    # to (x, 0, z) in the shadow: tangents from the two points where rays are shed, and arcs to them from the equator
    k = np.linspace(10.0, 50.0, 81)
    body = sc.Sphere()
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-8), cr.shadow_line(body, (0, 0, 1)), length=4.0, n_rays=24)
    x, z = 0.5, 1.2
    fields = [cr.near_field(fan, (x, 0.0, z), wavenumber=one, boundary="hard", method="rays") for one in k]
    found = cr.impulse_response(fields, k, start=0.0)
    r = np.hypot(x, z)
    tangent, beyond = np.sqrt(r**2 - 1), np.arccos(1 / r)
    # angles of the point from the equator on either side, less that of the tangent
    arcs = np.array([np.arctan2(z, side) for side in (x, -x)]) - beyond
    paths = arcs + tangent
    assert paths[1] - paths[0] > 3 * found.resolution
    early, late = found.arrivals(2)
    np.testing.assert_allclose([early, late], paths, atol=0.5 * found.resolution)
    # the wave of a mode is late by that of its group, a third of its phase over k: 0.005 to 0.02 of the arc
    assert 0 < early - paths[0] < 0.03 * arcs[0] + 0.01


def test_error_bounds_what_errors_can_do():
    rng = np.random.default_rng(7)
    k = np.linspace(10.0, 50.0, 41)
    off = rng.uniform(0.01, 0.05, 41)
    wrong = off * np.exp(1j * rng.uniform(0, 2 * np.pi, 41))
    right = cr.impulse_response(np.exp(2j * k), k)
    found = cr.impulse_response(np.exp(2j * k) + wrong, k, error=off)
    assert np.max(np.abs(found.values - right.values)) <= found.error
    # and it can be that large: errors in phase at one delay
    worst = cr.impulse_response(np.exp(2j * k) + off * np.exp(2j * k), k)
    assert np.max(np.abs(worst.values - right.values)) == pytest.approx(float(found.error), rel=1e-2)


def test_range_profile_is_half_of_it():
    k = np.linspace(100.0, 200.0, 101)
    f = np.exp(2j * k * 0.7)
    profile, found = cr.range_profile(f, k), cr.impulse_response(f, k)
    np.testing.assert_allclose(2 * profile.range, found.delay)
    assert profile.range[np.abs(profile.values).argmax()] == pytest.approx(0.7, abs=0.01)
    assert 2 * profile.resolution == pytest.approx(found.resolution)


def test_the_error_of_a_range_profile_is_a_bound_that_is_met():
    """By errors in phase with an echo; where one of them is not known, neither is the bound."""
    k, off = np.linspace(100.0, 200.0, 101), np.linspace(0.0, 0.2, 101)
    f, wrong = np.exp(2j * k * 0.7), np.exp(2j * k * -0.4) * off
    right, found = cr.range_profile(f, k), cr.range_profile(f + wrong, k, error=off)
    worst = np.max(np.abs(found.values - right.values))
    assert 0.99 * found.error < worst <= found.error * (1 + 1e-12)
    off[3] = np.inf
    assert cr.range_profile(f, k, error=off).error == np.inf and right.error == 0


def test_bad_input_is_refused():
    k = np.linspace(10.0, 50.0, 41)
    u = np.exp(2j * k)
    with pytest.raises(cr.InvalidInputError, match="1 of 41 are not"):
        cr.impulse_response(np.where(k == 20.0, np.nan, u), k)
    with pytest.raises(cr.InvalidInputError, match="as many wavenumbers"):
        cr.impulse_response(u[1:], k)
    with pytest.raises(cr.InvalidInputError, match="41 of it no number or negative"):
        cr.impulse_response(u, k, error=np.full(41, -1.0))
    with pytest.raises(cr.InvalidInputError, match="one response"):
        cr.impulse_response(np.stack([u, u], axis=1), k).arrivals()
    with pytest.raises(cr.InvalidInputError, match="speed"):
        cr.impulse_response(u, k, speed=0.0)
