"""Building: the paper's four examples, the choice from a tolerance, and contradictory requests."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.geodesics.states import random_bundle_points
from creeping.phaseflow.building import measure, upper_bound

EXAMPLES = {
    1: (sc.Ellipsoid(1.2, 0.8, 0.8), (16, 64), 5e-6),
    2: (sc.Torus(), (32, 64, 64), 6e-6),
    3: (sc.Sphere(speed="1 + x"), (16, 64), 2e-6),
    4: (sc.TwistedEllipsoid(), (24, 96), 1.5e-5),
}


@pytest.mark.parametrize("number", [2, 3, *(pytest.param(number, marks=pytest.mark.slow) for number in (1, 4))])
def test_examples_of_the_paper(number):
    body, grid, bound = EXAMPLES[number]
    flow = cr.build_phase_map(
        body, horizon=1 / 8, time_step=2**-10, stages=7, grid=grid, degree=3, method="tower", cache=False
    )
    assert len(flow.leaps) == 8
    # 2000 points: the rms of 200 scatters by a third around it
    assert measure(flow, samples=2000, rng=np.random.default_rng(number)).rms <= bound


def traced_rms(flow):
    """Rms error of (x, p) after one g_T0 against `trace`, of rays other than those by which a map judges itself."""
    x, p = random_bundle_points(flow.body, 300, rng=np.random.default_rng(20260311))
    traced = cr.trace(flow.body, x, p, flow.horizon, rtol=1e-13)
    off = np.concatenate(flow.apply(x, p), axis=-1) - np.concatenate(traced, axis=-1)
    return float(np.sqrt(np.mean(np.sum(off**2, axis=-1))))


def test_tolerance_is_met_from_a_choice_the_code_makes(body, phase_map):
    flow = phase_map(body)
    off = traced_rms(flow)
    assert off <= 1e-6
    # it does not flatter itself either; on the torus few rays carry most of the error
    assert off <= 3 * flow.error.rms + 1e-12
    assert flow.error.samples >= 200


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1e-8])
def test_other_tolerances(tolerance):
    flow = cr.build_phase_map(sc.Ellipsoid(1.0, 0.8, 0.6), tolerance=tolerance, cache=False)
    assert traced_rms(flow) <= tolerance


def test_bodies_of_any_scale():
    small = cr.build_phase_map(sc.Ellipsoid(1.2e-3, 0.8e-3, 0.8e-3), tolerance=1e-6, cache=False)
    large = cr.build_phase_map(sc.Ellipsoid(1.2e3, 0.8e3, 0.8e3), tolerance=1e-3, cache=False)
    assert traced_rms(small) <= 1e-6
    assert traced_rms(large) <= 1e-3
    assert large.horizon == pytest.approx(1e6 * small.horizon, rel=0.5)


@pytest.mark.parametrize(
    "options, match",
    [
        ({"tolerance": 0.0}, "tolerance"),
        ({"tolerance": float("nan")}, "tolerance"),
        ({"horizon": -1.0}, "horizon"),
        ({"degree": 4}, "degree 3 and 5"),
        ({"method": "magic"}, "method"),
        ({"grid": (4, 8)}, "at least"),
        ({"grid": (12.5, 16)}, "whole numbers"),
        ({"grid": 16}, "whole numbers"),
        ({"method": "tower"}, "needs horizon"),
        ({"method": "tower", "horizon": 0.125, "grid": (16, 32), "time_step": 0.03, "stages": 2}, "whole number"),
        ({"time_step": 0.01}, "belong to method='tower'"),
    ],
)
def test_contradictions_are_named(options, match):
    with pytest.raises(cr.CreepingError, match=match):
        cr.build_phase_map(sc.Sphere(), cache=False, **options)


@pytest.mark.parametrize("cache", [None, 0, 1])
def test_cache_is_a_switch_or_a_folder(cache):
    with pytest.raises(cr.CreepingError, match="cache"):
        cr.build_phase_map(sc.Sphere(), tolerance=1e-3, cache=cache)


def test_grid_too_coarse_for_the_tolerance_says_which_does():
    body = sc.TwistedEllipsoid()
    with pytest.raises(cr.CreepingError, match=r"about \(\d+, \d+, \d+\) should do") as caught:
        cr.build_phase_map(body, tolerance=1e-6, horizon=0.25, grid=(14, 16), cache=False)
    assert caught.value.rms > 1e-6


def test_unreachable_tolerance_says_what_was_reached():
    with pytest.raises(cr.CreepingError, match="the best"):
        cr.build_phase_map(sc.TwistedEllipsoid(), tolerance=1e-9, horizon=4.0, cache=False)


def test_the_bound_of_an_error_holds_for_any_size():
    rng = np.random.default_rng(5)
    errors = np.abs(rng.normal(size=40))
    square = errors**2
    plain = float(np.sqrt(np.mean(square) + 2 * np.std(square) / np.sqrt(len(square))))
    for scale in (1.0, 2.0**-300, 2.0**300):
        assert upper_bound(scale * errors) == scale * plain
    assert upper_bound(np.zeros(3)) == 0.0
