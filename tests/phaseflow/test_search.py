"""Tuned maps keep their promise at the end of rays; the choice between map and direct integration."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.states import pack, random_bundle_points
from creeping.kernels.threads import thread_count
from creeping.phaseflow import rotation as compiled_models


def rms_at_end(flow, body, length, rng, rays=1000):
    states = pack(*random_bundle_points(body, rays, rng=rng))
    times = np.array([length])
    exact = trace_states(body, states, times, rtol=1e-13)
    return float(np.sqrt(np.mean(np.sum((flow.transport(states, times) - exact) ** 2, axis=2))))


@pytest.mark.parametrize("tolerance", [1e-5, *(pytest.param(t, marks=pytest.mark.slow) for t in (1e-3, 1e-7))])
def test_tolerance_is_met_after_the_whole_length(body, tolerance, rng):
    flow = cr.build_phase_map(body, tolerance=tolerance, length=4.0, carry_jacobi=False, cache=False)
    assert flow.growth.lengths[-1] == 4.0
    assert flow.growth.rms[-1] <= tolerance
    assert (4.0 / flow.horizon) % 1 == pytest.approx(0, abs=1e-9)
    assert rms_at_end(flow, body, 4.0, rng) <= tolerance


def test_horizon_divides_the_distance_of_outputs():
    flow = cr.build_phase_map(sc.Torus(), tolerance=1e-5, length=3.0, n_steps=10, cache=False)
    assert (0.3 / flow.horizon) % 1 == pytest.approx(0, abs=1e-9)


def test_a_long_horizon_is_followed_while_its_grid_is_sought():
    """On a torus a ray turns more than once over two natural horizons: of the ends alone it is not known how often."""
    flow = cr.build_phase_map(sc.Torus(1.0, 0.4), tolerance=1e-3, length=4.0, horizon=1.0, cache=False)
    assert flow.horizon == 1.0 and flow.growth.bound <= 1e-3


def test_chaos_is_said(rng):
    body = sc.TwistedEllipsoid()
    flow = cr.build_phase_map(body, tolerance=1e-4, length=8.0, carry_jacobi=False, cache=False)
    growth = flow.growth
    assert growth.rms_after(8.0) == pytest.approx(growth.rms[-1])
    assert growth.rms_after(0.5 * growth.lengths[0]) == growth.rms[0]
    assert growth.rms_after(16.0) > 5 * growth.rms_after(8.0)
    trusted = growth.trusted_length(1e-4)
    assert 7.9 <= trusted < 16.0
    assert rms_at_end(flow, body, trusted, rng, 400) < 5e-4
    assert growth.trusted_length(1e-12) == 0.0


def test_no_jacobi_matrix_without_ride_along(rng):
    body = sc.Sphere()
    flow = cr.build_phase_map(body, tolerance=1e-4, length=2.0, carry_jacobi=False, cache=False)
    assert not flow.has_jacobi
    with pytest.raises(cr.CreepingError, match="carry_jacobi=True"):
        flow.transport(pack(*random_bundle_points(body, 3, rng=rng), jacobi=True), np.array([2.0]))


@pytest.mark.parametrize("lanes", [6, 12])
@pytest.mark.parametrize("body", [sc.TwistedEllipsoid(), sc.Ellipsoid(1.0, 0.8, 0.6)], ids=repr)
def test_order_of_composition_changes_nothing(body, lanes, rng, monkeypatch):
    flow = cr.build_phase_map(body, horizon=0.25, grid=(20, 32))
    states = pack(*random_bundle_points(body, 1000, rng=rng), lanes=lanes)
    times = np.array([0.25, 1.0])
    plain = flow.transport(states, times)
    monkeypatch.setattr(compiled_models, "ORDERED", 100)
    monkeypatch.setattr(compiled_models, "NEAR", 0)
    monkeypatch.setattr(compiled_models, "SHARE", 300)
    # two kernels: they may fuse multiplications and additions differently
    np.testing.assert_allclose(flow.transport(states, times), plain, rtol=1e-9, atol=1e-12)


def test_threads_change_nothing(rng, monkeypatch):
    body = sc.Ellipsoid(1.2, 0.8, 0.8)
    flow = cr.build_phase_map(body, horizon=0.5, grid=(16, 24))
    states, found = pack(*random_bundle_points(body, 10_000, rng=rng), lanes=12), []
    for threads in ("1", "2"):
        monkeypatch.setenv("CREEPING_THREADS", threads)
        assert thread_count() == int(threads)
        found.append(flow.transport(states, np.array([1.0])))
    np.testing.assert_array_equal(*found)
    monkeypatch.setenv("CREEPING_THREADS", "many")
    with pytest.raises(cr.CreepingError, match="CREEPING_THREADS"):
        thread_count()


def test_state_that_is_not_a_number_reads_inside_the_table():
    flow = cr.build_phase_map(sc.Sphere(), horizon=0.5, grid=(12, 16))
    states = np.full((70, 6), np.nan)
    assert np.all(np.isnan(flow.leap(states, 3)))


def test_few_rays_are_integrated_directly():
    messages = []
    flow = cr.choose_flow(sc.Sphere(), n_rays=10, length=2.0, progress=messages.append, cache=False)
    assert isinstance(flow, cr.DirectFlow)
    assert flow.error.rms <= 1e-6
    assert "direct integration" in messages[-1]


def test_many_rays_are_mapped(rng):
    body, messages = sc.Ellipsoid(1.2, 0.8, 0.8), []
    flow = cr.choose_flow(
        body, n_rays=10**8, length=8.0, tolerance=1e-6, carry_jacobi=False, progress=messages.append, cache=False
    )
    assert isinstance(flow, cr.PhaseMap)
    assert "phase map" in messages[-1]
    assert rms_at_end(flow, body, 8.0, rng) <= 1e-6


def test_tolerance_below_any_map_is_integrated_directly(rng):
    body = sc.Ellipsoid(1.2, 0.8, 0.8)
    flow = cr.choose_flow(body, n_rays=10**9, length=2.0, tolerance=1e-11, cache=False)
    assert isinstance(flow, cr.DirectFlow)
    assert rms_at_end(flow, body, 2.0, rng, 200) <= 1e-11


@pytest.mark.parametrize("options", [{"n_rays": 2.5}, {"length": -1.0}, {"tolerance": 1e-15}, {"n_steps": 0}])
def test_bad_numbers_are_named(options):
    with pytest.raises(cr.CreepingError, match=next(iter(options))):
        cr.choose_flow(sc.Sphere(), **({"n_rays": 10, "length": 2.0, "cache": False} | options))


@pytest.mark.parametrize("options", [{"length": 2.0, "grid": (12, 16), "horizon": 0.5}, {"n_steps": 4}])
def test_length_and_steps_belong_together(options):
    with pytest.raises(cr.CreepingError, match="length"):
        cr.build_phase_map(sc.Sphere(), cache=False, **options)


@pytest.mark.parametrize("options", [{"rtol": 0.0}, {"rtol": float("nan")}, {"step": 0.0}, {"horizon": -1.0}])
def test_direct_flow_refuses_what_it_cannot_do(options):
    with pytest.raises(cr.CreepingError, match=next(iter(options))):
        cr.DirectFlow(sc.Sphere(), **options)


def test_numbers_of_numpy_name_the_same_map(tmp_path):
    options = {"tolerance": np.float64(1e-4), "n_steps": np.int64(2), "cache": tmp_path}
    cr.build_phase_map(sc.Sphere(), length=np.int64(2), **options)
    cr.build_phase_map(sc.Sphere(), length=2.0, **options)
    assert len(list(tmp_path.glob("*/manifest.json"))) == 1
