"""Maps without azimuth of bodies of revolution: against direct integration, full tables, and what is known exactly."""

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.geodesics.states import pack, random_bundle_points
from creeping.geometry.revolution import charted_axis, rotations
from creeping.phaseflow import rotation as compiled_models
from creeping.phaseflow.building import Plan, build_direct
from creeping.phaseflow.coordinates import model_of
from creeping.phaseflow.splines import Grid

TILTED = np.array([1.0, 2.0, 2.0]) / 3


class _Ramp(sc.ExpressionSpeed):
    """A speed that grows along TILTED."""

    axis_of_revolution = tuple(TILTED)


class _Tilted(sc.Sphere):
    """A weighted sphere, of revolution about the axis of its speed."""

    axis_of_revolution = tuple(TILTED)


# shapes, axes and speeds that the kernels were not written with
CASES = {
    "torus": (sc.Torus(1.1, 0.35), 0.25, (90, 96), "ring"),
    "long": (sc.Ellipsoid(1.4, 0.7, 0.7), 0.25, (60, 64), "meridian"),
    "flat": (sc.Ellipsoid(1.1, 0.7, 1.1), 0.4, (60, 64), "meridian"),
    "tilted": (_Tilted(speed=_Ramp("1 + 0.3*(x + 2*y + 2*z)/3")), 0.5, (60, 64), "meridian"),
}


@pytest.fixture(scope="module", params=list(CASES))
def built(request):
    body, horizon, grid, name = CASES[request.param]
    flow = cr.build_phase_map(body, horizon=horizon, grid=grid, cache=False)
    assert flow.model.name == name and flow.leaps[-1].state.shape[:2] == (1, 1)
    return flow


def rays(body, n, lanes, seed=11):
    return pack(*random_bundle_points(body, n, rng=np.random.default_rng(seed)), lanes=lanes)


def rms(a, b):
    return float(np.sqrt(np.mean((a - b) ** 2)))


def test_leaps_follow_direct_integration(built):
    states, times = rays(built.body, 1000, 12), built.horizon * np.array([1.0, 6.0])
    exact = cr.DirectFlow(built.body, rtol=1e-12).transport(states, times)
    found = built.transport(states, times)
    for k, bound in enumerate((2e-8, 3e-7)):
        assert rms(found[:, k, :6], exact[:, k, :6]) < bound
        assert rms(found[:, k, 6:10], exact[:, k, 6:10]) < 100 * bound
    detached = np.isfinite(exact[..., 11])
    # a ray that grazes kappa_n = 0 may be judged either way
    assert np.mean(np.isfinite(found[..., 11]) != detached) <= 1e-3
    alike = np.isfinite(found[..., 11]) == detached
    assert rms(found[..., 10][alike], exact[..., 10][alike]) < 3e-6
    assert detached.any() == isinstance(built.body, sc.Torus)


def test_flow_commutes_with_turns(built):
    axis = charted_axis(built.body)
    x, p = random_bundle_points(built.body, 300, rng=np.random.default_rng(12))
    turn = rotations(axis, 2 * np.pi * np.random.default_rng(13).random(300))
    turned = np.einsum("nij,nj->ni", turn, x), np.einsum("nij,nj->ni", turn, p)
    ends = built.flow(*turned, 2.3)
    for end, there in zip(ends, built.flow(x, p, 2.3), strict=True):
        np.testing.assert_allclose(end, np.einsum("nij,nj->ni", turn, there), atol=1e-11)


def test_clairaut(built):
    """a.(x x p)/c, the angular momentum about the axis, is one along a ray."""
    axis, speed = charted_axis(built.body), built.body.speed
    x, p = random_bundle_points(built.body, 500, rng=np.random.default_rng(14))
    ends = built.flow(x, p, built.horizon * np.array([1.0, 4.0, 9.0]))
    of = [np.cross(a, b) @ axis / (1.0 if speed is None else speed.value(a)) for a, b in ((x, p), ends)]
    assert np.abs(of[1] - of[0][:, None]).max() < 1e-5
    assert rms(of[1], of[0][:, None]) < 2e-7


def test_rays_through_the_poles(built):
    if built.model.name == "ring":
        pytest.skip("a torus has no poles")
    axis, source = charted_axis(built.body), built.body.atlas.sphere_map
    pole = source.forward(np.array([axis, -axis]))
    across = np.cross(axis, [0.3, -0.5, 0.7])
    p = np.stack([across, np.cross(axis, across)]) / np.linalg.norm(across)
    h = built.horizon
    x0, p0 = cr.trace(built.body, pole, p, h)
    # from the poles, to them, and over them
    for start, time in (((pole, p), 2 * h), ((x0, -p0), h), ((x0, -p0), 2.5 * h)):
        exact = cr.trace(built.body, *start, time, rtol=1e-12)
        for one, other in zip(built.flow(*start, time), exact, strict=True):
            np.testing.assert_allclose(one, other, atol=1e-6)


def test_great_circles():
    body, t = sc.Sphere(1.3), np.array([0.7, 2.0, 9.0])
    flow = cr.build_phase_map(body, horizon=0.7, grid=(16, 16), cache=False)
    states = rays(body, 200, 12)
    x, p = states[:, None, :3], states[:, None, 3:6]
    s = (0.7 * np.round(t / 0.7) / 1.3)[:, None]
    found = flow.transport(states, 1.3 * s[:, 0])
    np.testing.assert_allclose(found[..., :3], x * np.cos(s) + 1.3 * p * np.sin(s), atol=1e-11)
    np.testing.assert_allclose(found[..., 3:6], p * np.cos(s) - x / 1.3 * np.sin(s), atol=1e-11)
    # M12 = R sin(s/R), A = s R^(-2/3)
    np.testing.assert_allclose(found[..., 8], np.broadcast_to(1.3 * np.sin(s[:, 0]), (200, 3)), atol=1e-10)
    np.testing.assert_allclose(found[..., 10], np.broadcast_to(1.3 ** (1 / 3) * s[:, 0], (200, 3)), atol=1e-9)


def test_full_table_of_a_torus():
    """Angles of both kinds, as of one whose speed is not of revolution."""
    body, horizon, _, _ = CASES["torus"]
    model = model_of(body, "angles")
    plan = Plan(horizon, Grid((8, 90, 96), 5, model.periodic), tolerance=1e-7)
    flow = build_direct(body, model, plan, lambda _: None, rtol=1e-11)
    assert flow.leaps[-1].is_packed and not flow.grid.is_flat
    states, times = rays(body, 1000, 12), horizon * np.array([1.0, 5.0])
    a, b = flow.transport(states, times), cr.DirectFlow(body, rtol=1e-12).transport(states, times)
    np.testing.assert_array_equal(np.isfinite(a[..., 11]), np.isfinite(b[..., 11]))
    assert rms(a[..., :6], b[..., :6]) < 1e-6
    assert rms(a[..., 10], b[..., 10]) < 3e-6


@pytest.mark.parametrize("lanes", [6, 12])
def test_order_of_composition_changes_nothing(built, lanes, monkeypatch):
    states, times = rays(built.body, 1000, lanes), built.horizon * np.array([1.0, 4.0])
    plain = built.transport(states, times)
    monkeypatch.setattr(compiled_models, "ORDERED", 100)
    monkeypatch.setattr(compiled_models, "NEAR", 0)
    np.testing.assert_array_equal(built.transport(states, times), plain)


@pytest.mark.parametrize("name, precision", [("torus", "single"), ("long", "double")])
def test_stored_and_opened(name, precision, tmp_path):
    body, horizon, _, model = CASES[name]
    flow = cr.build_phase_map(body, horizon=horizon, grid=(9, 24, 28), precision=precision, cache=False)
    assert flow.grid.nodes == (1, 24, 28)
    again = cr.load_phase_map(flow.save(tmp_path / "map"), body)
    assert again.digest == flow.digest and again.model.name == model and again.grid == flow.grid
    states = rays(body, 50, 12)
    np.testing.assert_array_equal(again.leap(states, 2), flow.leap(states, 2))
    assert "1 x 1 x 24 x 28 nodes" in repr(again)


def test_grids_of_too_few_nodes_are_refused():
    with pytest.raises(cr.CreepingError, match=r"at least \[1, 6, 6\] for degree 5"):
        cr.build_phase_map(sc.Torus(), horizon=0.5, grid=(5, 8), cache=False)
    with pytest.raises(cr.CreepingError, match=r"at least \[1, 10, 6\] for degree 5"):
        cr.build_phase_map(sc.Sphere(), horizon=0.5, grid=(9, 8), cache=False)
