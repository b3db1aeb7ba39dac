"""The composed map: against direct integration, and its own group law."""

import numpy as np
import pytest
from tolerances import COMPOSED, MAP

import creeping as cr
import scatterers as sc
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.states import pack, random_bundle_points
from creeping.phaseflow.building import Plan, build_direct
from creeping.phaseflow.coordinates import has_mirrors, model_of
from creeping.phaseflow.splines import Grid


def rms(a, b):
    return float(np.sqrt(np.mean(np.sum((a - b) ** 2, axis=-1))))


def test_composed_map_follows_the_tracer(body, rng):
    flow = cr.build_phase_map(body, tolerance=COMPOSED / 4, length=2.5)
    states = pack(*random_bundle_points(body, 60, rng=rng), jacobi=True)
    times = np.sort([0.0, 0.3, flow.horizon, 1.7, 2.5])
    exact = trace_states(body, states, times, rtol=1e-12)
    got = flow.transport(states, times)
    assert rms(got[..., :6][:, 0], exact[..., :6][:, 0]) < 1e-14
    for k in range(1, len(times)):
        assert rms(got[:, k, :6], exact[:, k, :6]) < COMPOSED, times[k]
    # M grows with the ray: relative to its own size
    size = 1 + np.abs(exact[..., 6:])
    assert np.sqrt(np.mean(((got - exact)[..., 6:] / size) ** 2)) < 10 * COMPOSED


def test_stays_on_the_bundle(body, phase_map, rng):
    x, p = phase_map(body).flow(*random_bundle_points(body, 40, rng=rng), 5.0)
    assert np.abs(body.level(x)).max() < 1e-12
    np.testing.assert_allclose(np.linalg.norm(p, axis=-1), 1, atol=1e-14)
    assert np.abs(np.sum(p * body.gradient(x), axis=-1)).max() < 1e-12


NAMES = ("sphere", "ellipsoid", "triaxial", "torus", "twisted", "weighted")
CUBIC = [
    # one whose map has two axes and one with three; the other bodies' models are those of degree 5
    pytest.param(name, 3, 4e-5, marks=() if name in ("torus", "twisted") else pytest.mark.slow)
    for name in NAMES
]


@pytest.mark.parametrize("body, degree, bound", [*((name, 5, 1e-5) for name in NAMES), *CUBIC], indirect=["body"])
def test_models_of_bodies_and_one_leap_by_splines_of_either_degree(body, degree, bound, rng):
    states, time = pack(*random_bundle_points(body, 100, rng=rng), jacobi=True), np.array([0.3])
    exact = trace_states(body, states, time, rtol=1e-12)
    for precision in ("single", "double"):
        flow = cr.build_phase_map(body, horizon=0.3, grid=(20, 28), degree=degree, precision=precision, cache=False)
        # twice what was measured, of maps that are packed and not
        assert rms(flow.transport(states[:, :6], time), exact[..., :6]) < 2 * bound
        found = flow.transport(states, time)
        assert rms(found[..., :6], exact[..., :6]) < 2 * bound and rms(found[..., 6:], exact[..., 6:]) < 20 * bound
    mirrored = isinstance(body, sc.Ellipsoid)
    revolved = "ring" if isinstance(body, sc.Torus) else "meridian"
    turns = body.speed is None and body.axis_of_revolution is not None
    assert flow.model.name == (revolved if turns else "octant" if mirrored else "rotation")


@pytest.mark.slow
def test_folded_map_equals_the_whole(rng):
    body = sc.Ellipsoid(1.0, 0.8, 0.6)
    states = pack(*random_bundle_points(body, 500, rng=rng), lanes=12)
    times = np.array([0.5, 2.0])
    exact = cr.DirectFlow(body, rtol=1e-12).transport(states, times)
    for name, nodes in (("rotation", (27, 27, 36)), ("octant", (16, 16, 36))):
        plan = Plan(0.5, Grid(nodes, 5, (False, False)), doublings=1)
        flow = build_direct(body, model_of(body, name), plan, lambda _: None, rtol=1e-11)
        assert flow.model.name == name
        got = flow.transport(states, times)
        for k in range(2):
            assert rms(got[:, k, :6], exact[:, k, :6]) < 2e-7
            assert rms(got[:, k, 6:11], exact[:, k, 6:11]) < 5e-6


def test_mirrors_are_verified():
    class Shifted(sc.Ellipsoid):
        """Says that it has mirrors, but its sphere map has none."""

        def forward(self, s):
            return super().forward(s) + np.array([0.1, 0, 0])

    assert has_mirrors(sc.Ellipsoid(1.0, 0.8, 0.6))
    assert not has_mirrors(Shifted(1.0, 0.8, 0.6))
    assert not has_mirrors(sc.TwistedEllipsoid())
    assert not has_mirrors(sc.Sphere(speed="1 + x"))


def test_model_coordinates_and_states_are_inverse(body, rng):
    model = model_of(body)
    chart = model.charts - 1
    u, v, angle = rng.random(50), rng.random(50), 2 * np.pi * rng.random(50)
    states = model.states(model.at(chart, u, v, angle))
    assert np.abs(body.level(states[:, :3])).max() < 1e-13
    np.testing.assert_allclose(np.linalg.norm(states[:, 3:], axis=1), 1, atol=1e-14)
    assert np.abs(np.sum(states[:, 3:] * body.gradient(states[:, :3]), axis=1)).max() < 1e-13
    # no displacement at all
    still = np.broadcast_to(0.0 if model.name in ("angles", "ring") else [1.0, 0, 0, 0], (50, 4))
    found = model.displacement(model.at(chart, u, v, angle), states[:, None], np.array([0.0]))
    np.testing.assert_allclose(found, still, atol=1e-13)


def test_group_law_and_reversal(body, phase_map, rng):
    flow = phase_map(body)
    x, p = random_bundle_points(body, 40, rng=rng)
    one = flow.flow(*flow.flow(x, p, 0.77), 0.9)
    both = flow.flow(x, p, 1.67)
    assert rms(one[0], both[0]) < 10 * MAP
    back = flow.flow(both[0], -both[1], 1.67)
    assert rms(back[0], x) < 10 * MAP
    assert rms(-back[1], p) < 10 * MAP


def test_error_is_what_a_fresh_sample_measures(body, phase_map, rng):
    flow = phase_map(body)
    assert flow.error.rms <= MAP
    x, p = random_bundle_points(body, 400, rng=rng)
    exact = np.concatenate(cr.trace(body, x, p, flow.horizon, rtol=1e-12), axis=-1)
    fresh = rms(np.concatenate(flow.apply(x, p), axis=-1), exact)
    assert 0.4 * flow.error.rms < fresh < 2.5 * flow.error.rms


def test_table_of_the_body_stands_in_for_a_dear_psi(rng):
    body = sc.Gridded.sampled(sc.Ellipsoid(1.2, 0.8, 0.8), 24)
    model = model_of(body)
    assert len(model._surface_table) == 6
    flow = cr.build_phase_map(body, tolerance=1e-5, length=2.0, n_steps=4, cache=False)
    first, length = pack(*random_bundle_points(body, 100, rng=rng)), np.array([2.0])
    ends = (one.transport(first, length)[:, 0] for one in (flow, cr.DirectFlow(body, rtol=1e-12)))
    assert rms(*ends) < 1e-5
    exact = model_of(body)
    exact._surface_table = np.zeros((0, 1, 1, 4))
    for chart in range(6):
        at = model.at(chart, rng.random(200), rng.random(200), 2 * np.pi * rng.random(200))
        states = model.states(at)
        error = np.linalg.norm(states - exact.states(at), axis=1)
        assert np.sqrt(np.mean(error**2)) < 3e-9
        # in again by the same table
        back = model.displacement(at, states[:, None], np.array([0.0]))
        np.testing.assert_allclose(back, np.broadcast_to([1.0, 0, 0, 0], (200, 4)), atol=1e-8)
        np.testing.assert_allclose(exact.displacement(at, states[:, None], np.array([0.0])), back, atol=1e-8)


def test_maps_in_space_carry_what_others_do(rng):
    body = sc.Ellipsoid(1.0, 0.8, 0.6)
    states = pack(*random_bundle_points(body, 50, rng=rng), lanes=12)
    times = np.array([0.4, 0.8])
    exact = cr.DirectFlow(body, rtol=1e-12).transport(states, times)
    for single in (False, True):
        plan = Plan(0.4, Grid((24, 24, 32), 5, (False, False)), single)
        flow = build_direct(body, model_of(body, "ambient"), plan, lambda _: None, rtol=1e-11)
        got = flow.transport(states, times)
        np.testing.assert_allclose(got[..., :11], exact[..., :11], atol=2e-4)


@pytest.fixture(scope="module")
def coarse():
    return cr.build_phase_map(sc.TwistedEllipsoid(), horizon=0.25, grid=(24, 24, 32), degree=5, cache=False)


@pytest.mark.parametrize("times", [[0.3, 1.17], [1.17, 2.95], np.linspace(0.06, 2.94, 49)])
def test_attenuation_at_times_between_leaps(coarse, times, rng):
    """Leaps and short traces from their ends, or one trace where times are many: either way as direct integration."""
    states = pack(*random_bundle_points(coarse.body, 200, rng=rng), lanes=12)
    got, exact = (f.transport(states, np.asarray(times)) for f in (coarse, cr.DirectFlow(coarse.body, rtol=1e-12)))
    assert rms(got[..., :6], exact[..., :6]) < 20 * coarse.error.rms
    np.testing.assert_allclose(got[..., 10], exact[..., 10], atol=1e-3)
    # some detach within a leap, some within what is left of one
    ended = np.isfinite(exact[..., 11]) & np.isfinite(got[..., 11])
    assert ended[:, -1].sum() > 20 and np.mean(np.isfinite(exact[..., 11]) == np.isfinite(got[..., 11])) > 0.99
    assert np.median(np.abs(got[..., 11][ended] - exact[..., 11][ended])) < 1e-4
