"""Occlusion of rays: spheres by the distance of the line, one direction for all or one each, a reach."""

import numpy as np
import pytest
import shared_bodies as sc

from creeping.geometry.surface import normal, project
from creeping.shadow.occlusion import occluded

D = np.array([0.3, 0.5, 0.81]) / np.linalg.norm([0.3, 0.5, 0.81])


def spread(n, rng):
    v = rng.normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def test_lit_and_dark_side_of_a_convex_body(rng):
    body = sc.Ellipsoid(1.0, 0.8, 0.6)
    x = project(body, spread(300, rng))
    facing = normal(body, x) @ D
    some = np.abs(facing) > 0.02
    np.testing.assert_array_equal(occluded(body, x, D)[some], (facing > 0)[some])


def test_a_direction_for_each_point_is_that_of_each_alone(rng):
    body = sc.Torus()
    x, d = project(body, spread(60, rng) * 1.3), spread(60, rng)
    together = occluded(body, x, d)
    alone = [occluded(body, x[k : k + 1], d[k])[0] for k in range(60)]
    np.testing.assert_array_equal(together, alone)
    assert 5 < together.sum() < 60
    np.testing.assert_array_equal(occluded(body, x, D), occluded(body, x, np.broadcast_to(D, x.shape)))


def test_reach_ends_the_search(rng):
    # from one side of a hole to the other: the ray meets the tube at a known distance
    body = sc.Torus()
    x, d = project(body, spread(1500, rng) * 1.3), spread(1500, rng)
    d = np.where(np.sum(normal(body, x) * d, axis=1, keepdims=True) > 0, -d, d)
    t = np.linspace(4e-3, 4, 1000)
    inside = body.level(x[:, None] - t[:, None] * d[:, None]) < 0
    met = np.where(inside.any(axis=1), t[np.argmax(inside, axis=1)], np.inf)
    steep = np.abs(np.sum(normal(body, x) * d, axis=1)) > 0.1
    hit = np.isfinite(met) & steep & (met > 0.2)
    assert hit.sum() > 10
    some, before, after = x[hit], 0.9 * met[hit], 1.3 * met[hit]
    assert not np.any(occluded(body, some, d[hit], before))
    # the ray stays in the tube for a while
    deep = body.level(some - after[:, None] * d[hit]) < 0
    assert np.all(occluded(body, some, d[hit], after)[deep])
    assert np.all(occluded(body, some, d[hit]))
    assert not np.any(occluded(body, x[np.isinf(met) & steep], d[np.isinf(met) & steep]))


def test_reach_for_all_points_at_once(rng):
    body = sc.Sphere()
    x = np.array([[0.0, 0, 1.0], [0.0, 0, -1.0]])
    up = np.array([0.0, 0, 1.0])
    # backward from the top runs down through the body
    np.testing.assert_array_equal(occluded(body, x, up, 1.0), [True, False])
    np.testing.assert_array_equal(occluded(body, x, up), [True, False])


def test_a_ray_that_touches_from_a_convex_side_is_free():
    body = sc.Sphere()
    alpha = np.linspace(0, 6, 40)
    x = np.stack([np.cos(alpha), np.sin(alpha), 0 * alpha], axis=-1)
    assert not np.any(occluded(body, x, np.array([0.0, 0, 1.0])))
    assert not np.any(occluded(body, x, np.array([0.0, 0, -1.0])))


@pytest.mark.parametrize("depth, hidden", [(1e-5, True), (-1e-5, False)])
def test_a_thin_hit_between_samples_is_found(depth, hidden):
    # a line over the ring that cuts the far side of the tube by 1e-5, or passes over it
    body = sc.Torus()
    axis = int(np.argmin(np.ptp(np.asarray(body.bounds), axis=0)))
    up, side = np.eye(3)[axis], np.eye(3)[(axis + 1) % 3]
    outer = project(body, 10 * side[None])[0] @ side
    inner = project(body, 0.05 * side[None])[0] @ side
    tube = (outer - inner) / 2
    # from the centre's height, tangent to the circle of the tube's section
    middle = (outer + inner) / 2
    start = -2.0 * middle * side + (tube - depth) * up
    assert occluded(body, start[None], -side)[0] == hidden


def test_no_points():
    assert occluded(sc.Sphere(), np.zeros((0, 3)), D).shape == (0,)


@pytest.mark.parametrize("axis", range(3))
def test_a_direction_along_an_axis_gives_no_nan(axis):
    d = np.eye(3)[axis]
    assert occluded(sc.Sphere(), np.array([d, -d]), d).tolist() == [True, False]
