"""Rays of bodies with edges, joints and tips against closed forms: where they go, J, and where they end."""

import numpy as np
import pytest
import shared_bodies as sc
from body_checks import unit
from piecewise_bodies import TwoBalls, cut_sphere

import creeping as cr
from creeping.errors import InvalidInputError
from creeping.geodesics.pieces import REACH, trace_pieces
from creeping.geodesics.states import ATTENUATION, M11, M12, M21, M22, P, X, pack
from creeping.geometry.surface import size

EXACT = 1e-12
"""Of rays by rtol = 1e-12, over four sizes of a body."""


CUT, CAPSULE, CONE = cut_sphere(0.5), sc.Capsule(0.5, 3.0), sc.Cone(0.5, 1.0)


def on_capsule(x, d, times, radius, half):
    """Helix, great circle and helix of a ray that starts on the side and goes up; and its J of both columns."""
    turn, rise = np.hypot(d[0], d[1]), d[2]
    side = np.sign(x[0] * d[1] - x[1] * d[0])
    begin, joint = np.arctan2(x[1], x[0]), (half - x[2]) / rise

    def helix(angle, z, way, up, t):
        angle = angle + way * turn / radius * t
        return np.stack([radius * np.cos(angle), radius * np.sin(angle), z + up * t], axis=-1)

    s = times - joint
    centre = np.array([0, 0, half])
    angle = begin + side * turn / radius * joint
    up = helix(begin, x[2], side, rise, times)
    first = helix(begin, x[2], side, rise, np.array([joint]))[0] - centre
    p = np.array([-np.sin(angle) * side * turn, np.cos(angle) * side * turn, rise])
    over = centre + first * np.cos(s / radius)[:, None] + radius * p * np.sin(s / radius)[:, None]
    down = helix(angle + np.pi, half, side, -rise, s - np.pi * radius)
    where = np.stack([s <= 0, (s > 0) & (s <= np.pi * radius)], axis=-1)
    points = np.select([where[:, :1], where[:, 1:]], [up, over], down)
    c, m = np.cos(s / radius), np.sin(s / radius)
    one = np.select([where[:, 0], where[:, 1]], [1 + 0 * s, c], -1)
    two = np.select([where[:, 0], where[:, 1]], [times, joint * c + radius * m], -joint - (s - np.pi * radius))
    return points, one, two, (joint, joint + np.pi * radius)


@pytest.mark.parametrize("start, step", [(0.2, None), (-0.9999, 0.05)])
def test_ray_over_a_capsule(start, step):
    body, d = CAPSULE, unit(np.array([1, 0, 1.5]))
    x, times = np.array([[0.0, -0.5, start]]), np.linspace(0, 2.6, 53)
    found = trace_pieces(body, pack(x, d[None], lanes=12), times, rtol=1e-12, step=step)
    points, one, two, joints = on_capsule(x[0], d, times, 0.5, 1.0)
    far, states = EXACT if step is None else 1e-10, found.states[0]
    np.testing.assert_allclose(states[:, X], points, atol=far)
    np.testing.assert_allclose(states[:, M11], one, atol=far)
    np.testing.assert_allclose(states[:, M12], two, atol=far)
    np.testing.assert_allclose(states[:, M11] * states[:, M22] - states[:, M12] * states[:, M21], 1, atol=far)
    np.testing.assert_allclose(found.passages.travel_time, [t for t in joints if t < 2.6], atol=EXACT)
    assert np.all(found.passages.crease == 1) and np.isinf(found.end[0])
    # kappa_n is (sin of the pitch)^2/R on the side and 1/R on the cap
    bent, whole = (d[0] ** 2 / 0.5) ** (2 / 3), 2 ** (2 / 3)
    inside = np.clip(times - joints[0], 0, np.pi * 0.5)
    np.testing.assert_allclose(states[:, ATTENUATION], bent * (times - inside) + whole * inside, atol=1e-9)


def test_fan_of_a_capsule_tells_its_crossings():
    body = CAPSULE
    line = cr.shadow_line(body, (1, 0, 0.5))
    fan = cr.launch(cr.DirectFlow(body), line, length=1.5, n_rays=16, max_gap=np.inf)
    assert set(fan.status_counts) == {"OK"} and fan.error.max < 1e-9
    rays, times, creases = fan.crossings
    assert set(creases) == {0, 1} and np.all(np.diff(rays) >= 0)
    flow = cr.DirectFlow(body)
    np.testing.assert_allclose(np.linalg.norm(fan.directions, axis=-1), 1, atol=1e-12)
    states = pack(fan.points[:, 0], fan.directions[:, 0])
    again = trace_pieces(body, states, np.array([1.5]), rtol=1e-12).states[:, 0]
    np.testing.assert_allclose(again[:, P], fan.directions[:, -1], atol=1e-9)
    for ray, time in list(zip(rays, times, strict=True))[::4]:
        assert abs(flow.flow(fan.points[ray, 0], line.direction, time)[0][2]) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("direction", [(1, 0, 0.2), (-1, 0, 2)])
def test_cut_sphere(direction):
    body, times = CUT, np.linspace(0, 4, 81)
    line = cr.shadow_line(body, direction)
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-12), line, length=4.0, n_rays=24, n_steps=80, max_gap=np.inf)
    z, up = fan.points[:, 0, 2], line.direction[2]
    # z cos t + up sin t = 1/2 for the first time
    far, when = np.hypot(z, up), np.arctan2(up, z)
    end = np.where(far > 0.5, np.mod(when - np.arccos(np.minimum(0.5 / far, 1)), 2 * np.pi), np.inf)
    met = end < 4.0
    np.testing.assert_array_equal(fan.status == cr.RayStatus.EDGE, met)
    np.testing.assert_array_equal(fan.status == cr.RayStatus.OK, ~met)
    np.testing.assert_allclose(fan.detachment[met], end[met], atol=EXACT)
    assert np.all(np.isinf(fan.detachment[~met])) and np.all(fan.launched)
    before = times <= fan.detachment[:, None]
    exact = fan.points[:, :1] * np.cos(times)[:, None] + line.direction * np.sin(times)[:, None]
    np.testing.assert_allclose(fan.points[before], exact[before], atol=EXACT)
    np.testing.assert_allclose(fan.spreading[before], np.broadcast_to(np.cos(times), before.shape)[before], atol=EXACT)
    # a ray that has come to the edge stays there
    np.testing.assert_allclose(fan.points[met, -1, 2], 0.5, atol=EXACT)
    assert not len(fan.crossings.ray)


def test_cylinder():
    """It unrolls: straight lines, J = 1, up to the rim."""
    body = sc.Cylinder(0.5, 2.0)
    line = cr.shadow_line(body, (1, 0, 1))
    fan = cr.launch(cr.DirectFlow(body), line, length=4.0, n_rays=24, max_gap=np.inf)
    assert set(fan.status_counts) == {"EDGE"}
    np.testing.assert_allclose(fan.detachment, (1 - fan.points[:, 0, 2]) * np.sqrt(2), atol=EXACT)
    np.testing.assert_allclose(fan.spreading, 1, atol=EXACT)


def test_rays_into_a_tip_end_next_to_it():
    body = CONE
    near, slant = REACH * size(body), np.hypot(0.5, 1.0)
    x = np.array([[0.25, 0.0, 0.5], [0.25, 0.0, 0.5]])
    p = unit(np.array([[-0.5, 0, 1.0], [-0.5, 1e-2, 1.0]]))
    found = trace_pieces(body, pack(x, p), np.array([0.3, 1.0]), rtol=1e-10)
    # one comes to the tip; the other passes it by more than that
    assert found.crease.tolist() == [0, 1] or (found.crease[0] == 0 and np.isinf(found.end[1]))
    assert found.end[0] == pytest.approx(slant / 2 - near, abs=1e-9)
    line = cr.shadow_line(body, (1, 0, 1))
    flow = cr.DirectFlow(body)
    states = flow.transport(pack(x[:1], p[:1], lanes=14), np.array([0.0, 1.0]))
    assert states[0, :, 13].tolist() == [-1, 0] and states[0, 1, 12] == pytest.approx(found.end[0], abs=EXACT)
    assert cr.launch(flow, line, length=0.5, n_rays=8).launched.all()


def test_concave_edge_ends_rays_too():
    body = TwoBalls(0.7)
    fan = cr.launch(cr.DirectFlow(body), cr.shadow_line(body, (1, 0, 1)), length=3.0, n_rays=24, max_gap=np.inf)
    ended = fan.status == cr.RayStatus.EDGE
    assert ended.any()
    last = fan.points[ended, -1]
    np.testing.assert_allclose(last[:, 2], 0, atol=1e-10)
    np.testing.assert_allclose(np.hypot(*last[:, :2].T), np.sqrt(1 - 0.49), atol=1e-10)


def test_maps_are_refused_and_the_choice_is_direct():
    body = CUT
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-8), cr.shadow_line(body, (1, 0, 0.2)), length=3.0, n_rays=16)
    # neighbours that end apart are not refined for ever
    assert 16 <= len(fan.points) < 200
    with pytest.raises(InvalidInputError, match="DirectFlow"):
        cr.build_phase_map(body)
    with pytest.raises(InvalidInputError, match="DirectFlow"):
        cr.trace(body, (0, 0, -1), (1, 0, 0), 1.0)
    assert isinstance(cr.choose_flow(body, n_rays=10, length=1.0, tolerance=1e-6, cache=False), cr.DirectFlow)


def test_a_ray_that_begins_nowhere_is_no_ray_and_stops_none():
    """Newton finds no line next to some tips: NaN in one state was an IndexError of all."""
    x, p = np.array([[0.5, 0.0, 0.2], [np.nan] * 3, [0.0, 0.5, -0.3]]), np.tile([0.0, 0.0, 1.0], (3, 1))
    times = np.linspace(0.0, 1.0, 9)
    found = trace_pieces(CAPSULE, pack(x, p), times, rtol=1e-10, beyond=0.5)
    alone = trace_pieces(CAPSULE, pack(x[[0, 2]], p[[0, 2]]), times, rtol=1e-10, beyond=0.5)
    assert found.end[1] == 0 and found.crease[1] == -1 and np.all(np.isnan(found.states[1, :, X]))
    np.testing.assert_allclose(found.states[[0, 2]], alone.states, atol=1e-12)
