"""Occlusion of rays: spheres by the distance of the line, one direction for all or one each, a reach."""

import numpy as np
import pytest
import shared_bodies as sc
from body_checks import directions, unit

from creeping.geometry.surface import normal, project
from creeping.shadow.attachment import occluded

D = unit(np.array([0.3, 0.5, 0.81]))


def test_lit_and_dark_side_of_a_convex_body(rng):
    body = sc.Ellipsoid(1.0, 0.8, 0.6)
    x = project(body, directions(rng, 300))
    facing = normal(body, x) @ D
    some = np.abs(facing) > 0.02
    np.testing.assert_array_equal(occluded(body, x, D)[some], (facing > 0)[some])


def test_a_direction_for_each_point_is_that_of_each_alone(rng):
    body = sc.Torus()
    x, d = project(body, directions(rng, 60) * 1.3), directions(rng, 60)
    together = occluded(body, x, d)
    alone = [occluded(body, x[k : k + 1], d[k])[0] for k in range(60)]
    np.testing.assert_array_equal(together, alone)
    assert 5 < together.sum() < 60
    np.testing.assert_array_equal(occluded(body, x, D), occluded(body, x, np.broadcast_to(D, x.shape)))
    np.testing.assert_array_equal(occluded(body, x, D, 0.7), occluded(body, x, D, np.full(60, 0.7)))


def test_reach_ends_the_search(rng):
    # from one side of a hole to the other: the ray meets the tube at a known distance
    body = sc.Torus()
    x, d = project(body, directions(rng, 1500) * 1.3), directions(rng, 1500)
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


@pytest.mark.parametrize("depth, hidden", [(1e-5, True), (-1e-5, False)])
def test_a_thin_hit_between_samples_is_found(depth, hidden):
    # a line over the ring that cuts the far side of the tube by 1e-5, or passes over it
    body, side, up = sc.Torus(), np.eye(3)[0], np.eye(3)[2]
    # from the centre's height, tangent to the circle of the tube's section
    start = -2.0 * side + (0.5 - depth) * up
    assert occluded(body, start[None], -side)[0] == hidden


@pytest.mark.parametrize("axis", range(3))
def test_a_direction_along_an_axis_gives_no_nan(axis):
    d = np.eye(3)[axis]
    assert occluded(sc.Sphere(), np.array([d, -d]), d).tolist() == [True, False]
    # one that touches is free
    alpha = np.linspace(0, 6, 40)[:, None]
    around = np.cos(alpha) * np.eye(3)[axis - 1] + np.sin(alpha) * np.eye(3)[axis - 2]
    assert not np.any(occluded(sc.Sphere(), around, d))
    assert occluded(sc.Sphere(), around[:0], d).shape == (0,)
