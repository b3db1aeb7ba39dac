"""Fans: spreading against neighbouring rays, detachment, caustics, refinement, bad input."""

import numpy as np
import pytest
import shared_bodies as sc
from tolerances import SPREADING

import creeping as cr
from creeping.geometry.surface import normal
from creeping.shadow.attachment import line_tangents

INCIDENCE = (0.3, 0.5, 0.81)


def across_difference(fan, shift):
    """J by central differences: rays launched ``shift`` before and behind each ray of the fan along its line."""
    flow, line = cr.DirectFlow(fan.body, rtol=1e-12), fan.line
    difference = np.empty_like(fan.points)
    for index, curve in enumerate(line.curves):
        mine = fan.curve_index == index
        if mine.any():
            starts = [curve.at((fan.arclength[mine] + h) % curve.length) for h in (-shift, shift)]
            before, after = (flow.flow(x, line.direction, fan.travel_time)[0] for x in starts)
            difference[mine] = (after - before) / (2 * shift)
    b = np.cross(normal(fan.body, fan.points), fan.directions)
    # sigma is measured across the ray: b0.dx0, not along the line
    across = np.sum(b[:, 0] * line_tangents(fan.body, fan.points[:, 0], line.direction), axis=-1)
    return np.sum(b * difference, axis=-1) / across[:, None]


@pytest.fixture(scope="module")
def plain_line():
    return cr.shadow_line(sc.Sphere(), (1, 0, 0))


def test_spreading_is_the_distance_of_neighbouring_rays(body):
    if body.speed is not None:
        # a speed and a body without symmetry, so that J'(0) is not zero
        body = sc.Ellipsoid(1.0, 0.8, 0.6, speed="1 + x/4 + y*z/2")
    # not by a map: its J errs by more than (x, p)
    line = cr.shadow_line(body, INCIDENCE)
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-11), line, length=1.5, n_rays=24, n_steps=16, max_gap=np.inf)
    expected = across_difference(fan, 1e-4)
    # next to a caustic a relative error means nothing
    before_caustic = (fan.caustic_index == 0) & (np.abs(fan.spreading) > 0.05)
    error = np.abs(fan.spreading - expected)[before_caustic] / np.abs(expected[before_caustic])
    assert before_caustic.sum() > 100
    assert error.max() < SPREADING
    assert body.speed is None or np.abs(fan.spreading_rate[:, 0]).max() > 0.01


def test_spreading_rate_is_the_derivative_of_the_spreading(body, phase_map):
    fan = cr.launch(phase_map(body), cr.shadow_line(body, INCIDENCE), length=1.0, n_rays=12, n_steps=200)
    t = fan.travel_time
    middle = (fan.spreading[:, 2:] - fan.spreading[:, :-2]) / (t[2] - t[0])
    np.testing.assert_allclose(fan.spreading_rate[:, 1:-1], middle, atol=2e-3)
    np.testing.assert_allclose(fan.spreading[:, 0], 1.0)
    # the incident phase on an oblique line
    offset = fan.points[:, 0] @ fan.line.direction
    np.testing.assert_allclose(fan.eikonal, offset[:, None] + t, atol=1e-12)


def test_sphere_fan_in_closed_form(phase_map):
    d = np.array([1.0, 2.0, -0.5]) / np.sqrt(5.25)
    fan = cr.launch(phase_map("sphere"), cr.shadow_line(sc.Sphere(), d), length=7.0, n_rays=16)
    t = fan.travel_time
    np.testing.assert_allclose(fan.points, np.cos(t)[:, None] * fan.points[:, :1] + np.sin(t)[:, None] * d, atol=1e-6)
    np.testing.assert_allclose(fan.spreading, np.broadcast_to(np.cos(t), fan.spreading.shape), atol=1e-5)
    np.testing.assert_allclose(fan.curvature, 1.0, atol=1e-12)
    # zeros of cos t below 7: pi/2, 3 pi/2
    assert np.all(fan.caustic_index[:, -1] == 2)
    np.testing.assert_allclose(fan.eikonal, np.broadcast_to(t, fan.eikonal.shape), atol=1e-12)
    assert np.all(fan.status == cr.RayStatus.OK)


def test_map_and_direct_integration_launch_the_same_fan(body, phase_map):
    line = cr.shadow_line(body, INCIDENCE)
    options = {"length": 2.0, "n_rays": 20, "n_steps": 40, "max_gap": np.inf}
    by_map, direct = (cr.launch(flow, line, **options) for flow in (phase_map(body), cr.DirectFlow(body)))
    np.testing.assert_allclose(by_map.points, direct.points, atol=1e-4)
    np.testing.assert_array_equal(by_map.status, direct.status)
    assert direct.error.max < 1e-8
    assert by_map.error.rms < 2e-5


def test_detachment_is_where_the_curvature_vanishes(phase_map):
    body = sc.TwistedEllipsoid()
    fan = cr.launch(phase_map(body), cr.shadow_line(body, (1, 1, 1)), length=4.0, n_rays=120)
    gone = np.flatnonzero(fan.status == cr.RayStatus.DETACHED)
    # a third of the line: MESH section 3 has 34 %, the earliest at 1.264
    assert fan.detachment[gone].min() == pytest.approx(1.264, abs=2e-3)
    even = cr.launch(phase_map(body), fan.line, length=4.0, n_rays=200, max_gap=np.inf)
    assert np.mean(np.isfinite(even.detachment)) == pytest.approx(0.34, abs=0.01)
    for ray in gone[::5]:
        x, p = cr.trace(body, fan.points[ray, 0], fan.directions[ray, 0], fan.detachment[ray], rtol=1e-12)
        bent = p @ body.hessian(x) @ p / np.linalg.norm(body.gradient(x))
        # the launch point is exact, the map's error of 1e-6 moves the root
        assert abs(bent) < 1e-4
        before = fan.travel_time < fan.detachment[ray]
        assert np.all(fan.curvature[ray, before] > -1e-6)


def test_only_attached_points_launch_unless_asked(phase_map):
    body = sc.Torus()
    line = cr.shadow_line(body, (1, 1, 1))
    some = cr.launch(phase_map(body), line, length=1.0, max_gap=np.inf)
    every = cr.launch(phase_map(body), line, length=1.0, max_gap=np.inf, launch_from="all")
    assert set(some.status) <= {cr.RayStatus.OK, cr.RayStatus.DETACHED}
    inner = every.curve_index == 1
    shares = [np.mean(every.status[inner] == s) for s in (cr.RayStatus.OCCLUDED, cr.RayStatus.CONCAVE)]
    np.testing.assert_allclose(shares, [0.15522848, 0.28736380], atol=0.01)
    assert np.all(every.status[~inner] <= cr.RayStatus.DETACHED)
    np.testing.assert_array_equal(every.launched, every.status <= cr.RayStatus.DETACHED)


def test_rays_are_inserted_where_neighbours_part(phase_map):
    body = sc.TwistedEllipsoid()
    line = cr.shadow_line(body, (1, 1, 1))
    plain = cr.launch(phase_map(body), line, length=4.0, n_rays=64, max_gap=np.inf)
    fine = cr.launch(phase_map(body), line, length=4.0, n_rays=64, max_gap=0.05)
    assert len(plain.points) == 64
    assert len(fine.points) > 64

    def widest(fan):
        return np.linalg.norm(np.roll(fan.points, -1, axis=0) - fan.points, axis=-1).max()

    assert widest(plain) > 0.2
    assert widest(fine) <= 0.05
    assert set(np.round(plain.arclength, 9)) <= set(np.round(fine.arclength, 9))


def test_stalled_rays_are_marked_not_silent(phase_map):
    # d across x: the line passes (-1, 0, 0), where the speed 1 + x vanishes
    body = sc.Sphere(speed="1 + x")
    line = cr.shadow_line(body, (0, 0, 1))
    fan = cr.launch(phase_map("weighted"), line, length=1.0, n_rays=64)
    at_zero = 1 + fan.points[:, 0, 0] < 1e-12
    assert np.all((fan.status == cr.RayStatus.STALLED) == at_zero)
    assert np.all(np.isfinite(fan.spreading[~at_zero]))


@pytest.mark.parametrize("options", [{"launch_from": "lit"}, {"n_rays": 0}, {"n_steps": 1.5}, {"max_gap": 0.0}])
def test_bad_input_is_named(options, plain_line):
    with pytest.raises(cr.CreepingError, match=next(iter(options))):
        cr.launch(cr.DirectFlow(plain_line.body), plain_line, **({"length": 1.0} | options))


def test_flow_of_another_body_is_refused_and_a_fan_says_its_error(plain_line, phase_map):
    with pytest.raises(cr.CreepingError, match="one body for both"):
        cr.launch(cr.DirectFlow(sc.Sphere(2.0)), plain_line, length=1.0)
    fan = cr.launch(phase_map("sphere"), plain_line, length=1.0, n_rays=8)
    assert len(repr(fan).splitlines()) == 3
    assert "error at the end" in repr(fan)
