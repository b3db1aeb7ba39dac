"""Rays traced each to a time of its own, against closed forms and in the company of rays that fail; parted rays."""

import numpy as np
from creased_bodies import Ball, Capsule, cone

from creeping.field.likely_cells import parted
from creeping.geodesics.own_times import trace_own
from creeping.geodesics.pieces import trace_pieces
from creeping.geodesics.states import ATTENUATION, DETACHMENT, M11, M12, P, X, pack
from creeping.geometry.creased import pieces_of

TIMES = np.linspace(0.0, 3.0, 100)


def great_circles(lanes):
    angle = np.linspace(0.1, 2.0, len(TIMES))
    x = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    return pack(x, np.broadcast_to([0.0, 0.0, 1.0], x.shape), lanes=lanes)


def test_each_ray_comes_to_its_time():
    first = great_circles(12)
    found = trace_own(Ball(), first, TIMES, rtol=1e-12)
    c, s = np.cos(TIMES)[:, None], np.sin(TIMES)[:, None]
    np.testing.assert_allclose(found[:, X], c * first[:, X] + s * first[:, P], atol=1e-11)
    np.testing.assert_allclose(found[:, M11], c[:, 0], atol=1e-11)
    np.testing.assert_allclose(found[:, M12], s[:, 0], atol=1e-11)
    np.testing.assert_allclose(found[:, ATTENUATION], TIMES, atol=1e-11)
    assert np.all(np.isinf(found[:, DETACHMENT]))


def test_a_ray_that_fails_stops_no_other():
    first = great_circles(10)
    alone = trace_own(Ball(), first, TIMES, rtol=1e-10)
    first[7, X] = np.nan
    found = trace_own(Ball(), first, TIMES, rtol=1e-10)
    assert np.all(np.isnan(found[7]))
    others = np.arange(len(first)) != 7
    np.testing.assert_array_equal(found[others], alone[others])


def test_a_ray_detaches_where_it_starts_straight():
    side = pieces_of(Capsule(0.5, 1.0))[1]
    first = pack(np.array([[0.5, 0.0, 0.0]]), np.array([[0.0, 0.0, 1.0]]), lanes=12)
    found = trace_own(side, first, np.array([0.4]), rtol=1e-10)
    assert found[0, DETACHMENT] == 0 and found[0, ATTENUATION] == 0


def test_rays_do_not_depend_on_their_company_and_all_end_as_data():
    """On a cone unrolled a ray at a distance from the apex goes on straight; it ends at the rim or next to the apex."""
    body, slope = cone(0.5, 1.0), np.array([-0.5, 0.0, 1.0]) / np.hypot(0.5, 1.0)
    aside = np.concatenate([[0.0, 1e-9], np.geomspace(1e-4, 1.0, 30)])
    p = np.cos(aside)[:, None] * slope + np.sin(aside)[:, None] * np.array([0.0, 1.0, 0.0])
    first = pack(np.broadcast_to([0.25, 0.0, 0.5], p.shape), p, jacobi=True)
    found = trace_pieces(body, first, np.linspace(0, 2.0, 21), rtol=1e-10)
    assert np.all(np.isfinite(found.states)) and np.all(np.isfinite(found.end))
    half, whole = np.hypot(0.25, 0.5), np.hypot(0.5, 1.0)
    rim = half * np.cos(aside) + np.sqrt(whole**2 - (half * np.sin(aside)) ** 2)
    tip = found.crease == 1
    assert tip[:2].all() and not tip[-20:].any()
    np.testing.assert_allclose(found.end[~tip], rim[~tip], atol=1e-8)
    for ray in (0, 15, 31):
        alone = trace_pieces(body, first[ray : ray + 1], np.linspace(0, 2.0, 21), rtol=1e-10)
        np.testing.assert_allclose(alone.states[0], found.states[ray], atol=1e-8)
        assert abs(alone.end[0] - found.end[ray]) < 1e-8


def test_neighbours_are_parted_where_more_than_their_spreading_is_between_them():
    body, x = cone(0.5, 1.0), np.zeros((3, 3))
    other = x + np.array([[0.1, 0, 0], [1.0, 0, 0], [1.0, 0, 0]])
    assert parted(body, x, other, np.array([1.0, 1.0, 5.0]), np.full(3, 0.1)).tolist() == [False, True, False]
