"""Fields of many incidences: `far_field` one by one to the last bit, reciprocity, and the exact sphere."""

import numpy as np
import pytest
import shared_bodies as sc
from oracles.plain_sweep import PlainSweeper

import creeping as cr
from creeping.field.waves.far_geometry import FarGeometry
from creeping.rays.tracer import RayTracer
from creeping.shadow.line import shadow_lines
from creeping.sweeping.request import sweep_request
from creeping.sweeping.sweeper import Sweeper
from tests.reference import sphere

TRIAXIAL, TWISTED = sc.Ellipsoid(1.2, 0.8, 0.6), sc.TwistedEllipsoid()
DIRECTIONS = np.array([[0.3, 0.5, 0.812], [-0.7, 0.2, 0.4], [0.1, -0.8, 0.5]])
DIRECTIONS /= np.linalg.norm(DIRECTIONS, axis=1, keepdims=True)


def geometry_of(flow, d, n_rays, length):
    launch = shadow_lines(flow.body, d, n_rays).launch
    tracer, attached = RayTracer(flow.body, length), np.ones(len(d))
    return FarGeometry(flow, launch, tracer, -d[:, None], attached, lambda _: pytest.fail("no lobe here"))


@pytest.mark.parametrize("body", [TRIAXIAL, TWISTED, sc.Torus()])
@pytest.mark.parametrize("quantity", ["monostatic", "bistatic"])
def test_a_sweep_is_far_field_one_by_one_to_the_last_bit(quantity, body):
    seen = {"observation": cr.fibonacci_directions(7)} if quantity == "bistatic" else {}
    options = {"length": 3.0, "n_rays": 64, "wavenumbers": [15.0, 60.0], "boundary": ["soft", "hard", "pec"]}
    request = sweep_request(quantity, **options, **seen)
    flow = cr.DirectFlow(body, rtol=1e-8)
    found, plain = Sweeper(flow, request)(DIRECTIONS), PlainSweeper(flow, request)(DIRECTIONS)
    for name in found:
        np.testing.assert_array_equal(found[name], plain[name], err_msg=name)


@pytest.mark.slow
def test_a_body_with_numpy_methods_only_sweeps(rng):
    exact = sc.Ellipsoid(1.2, 0.8, 0.6)
    names = ("level", "gradient", "hessian", "bounds", "parameters")
    plain = type("Plain", (), {})()
    for name in names:
        setattr(plain, name, getattr(exact, name))
    plain.atlas = type("Atlas", (), {"charts": exact.atlas.charts, "locate": exact.atlas.locate})()
    request = sweep_request("monostatic", length=1.5, n_rays=8, wavenumbers=[20.0], boundary="hard")
    one, other = (Sweeper(cr.DirectFlow(body, rtol=1e-8), request)(DIRECTIONS[:1]) for body in (exact, plain))
    np.testing.assert_allclose(one["line_length"], other["line_length"], rtol=1e-11)
    for name in ("creeping", "reflected"):
        np.testing.assert_allclose(one[name], other[name], rtol=1e-4)


def test_rays_there_and_back_are_one():
    # every ray shed towards r = -d, reversed, is another one
    geometry = geometry_of(cr.DirectFlow(TWISTED, rtol=1e-8), DIRECTIONS, 256, 4.0)
    rays = geometry.shed.rays
    for row in range(3):
        mine = np.flatnonzero(geometry.shed.observer == row)
        assert len(mine) >= 4 and len(mine) % 2 == 0
        order = np.argsort(rays.time[mine])
        pairs = mine[order].reshape(-1, 2)
        np.testing.assert_allclose(rays.time[pairs[:, 0]], rays.time[pairs[:, 1]], atol=1e-4)
        alive = rays.alive[pairs].all(axis=1)
        # J' and the integrals are the same both ways, curvature at one end is that at the other
        one, two = pairs[alive].T
        np.testing.assert_allclose(rays.spreading_rate[one], rays.spreading_rate[two], rtol=1e-3)
        np.testing.assert_allclose(rays.integrals[one, :4], rays.integrals[two, :4], rtol=1e-4)
        np.testing.assert_allclose(rays.curvature[0][one], rays.curvature[1][two], rtol=1e-3)
    np.testing.assert_allclose(rays.directions, -DIRECTIONS[geometry.shed.observer], atol=3e-4)


@pytest.mark.parametrize("kind", ["direct", "map"])
def test_no_ray_is_counted_twice_or_lost(kind):
    body, d = sc.Ellipsoid(1.0, 0.7, 0.5), cr.fibonacci_directions(60)
    flow = cr.DirectFlow(body, rtol=1e-8)
    if kind == "map":
        flow = cr.build_phase_map(body, tolerance=3e-5, length=4.5, n_steps=9)
    geometry = geometry_of(flow, d, 128, 4.5)
    shed = geometry.shed
    assert np.all(geometry.leaves)
    for row in range(60):
        mine = np.flatnonzero(shed.observer == row)
        # a way there and its way back
        assert len(mine) % 2 == 0
        x = shed.rays.points[mine]
        apart = np.linalg.norm(x[:, None] - x, axis=-1) + 10 * np.eye(len(mine))
        assert np.min(apart, initial=10) > 1e-3


@pytest.mark.parametrize("boundary", ["soft", "hard"])
def test_sphere_backscatter(boundary):
    ka = np.array([10.0, 20.0, 40.0])
    request = sweep_request("monostatic", length=4.5, wavenumbers=ka, boundary=boundary)
    found = Sweeper(cr.DirectFlow(sc.Sphere(), rtol=1e-9), request)(np.array([[0.0, 0.6, 0.8]]))
    exact = np.array([sphere.far_field(k, 1.0, np.array([-1.0]), boundary)[0] for k in ka])
    total = found["total"][0, 0]
    assert np.all(np.abs(total - exact) < 0.02 * np.abs(exact))


@pytest.mark.slow
def test_currents_serve_the_incidences_that_rays_do_not_resolve():
    # on the twisted ellipsoid the reflected field folds over, on the triaxial one it does not
    seen = cr.fibonacci_directions(40)
    for body, k, some in ((TWISTED, 20.0, True), (TRIAXIAL, 60.0, False)):
        flow = cr.DirectFlow(body, rtol=1e-8)
        options = {"length": 6.0, "n_rays": 64, "wavenumbers": [k], "boundary": ["soft", "pec"], "observation": seen}
        found = Sweeper(flow, sweep_request("bistatic", **options, method="auto"))(DIRECTIONS)
        assert found["by_currents"].any() == some
        for row, d in enumerate(DIRECTIONS):
            fan = cr.launch(flow, cr.shadow_line(body, d), length=6.0, n_rays=64, max_gap=np.inf)
            for suffix, boundary, at in (("", "soft", (row, 0, 0)), ("_pec", "pec", (row, 0))):
                taken = found["by_currents" + suffix][at]
                # all of an incidence or nothing
                assert taken.all() or not taken.any()
                method = "currents" if taken.all() else "rays"
                far = cr.far_field(fan, seen, wavenumber=k, boundary=boundary, method=method)
                np.testing.assert_array_equal(found["creeping" + suffix][at], far.creeping)
                np.testing.assert_array_equal(found["error" + suffix][at], far.error)
