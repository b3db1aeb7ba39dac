"""Rays traced each to a time of its own, against closed forms and in the company of rays that fail; parted rays."""

import numpy as np
import shared_bodies as sc
from piecewise_bodies import Ball

import creeping as cr
from creeping.field.waves.likely_cells import parted
from creeping.geodesics.attenuation import trace_own
from creeping.geodesics.pieces import trace_pieces, trace_to
from creeping.geodesics.states import ATTENUATION, DETACHMENT, M11, M12, P, X, pack
from creeping.rays.tracer import RayTracer

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


HALF = np.hypot(0.25, 0.5)


def test_rays_of_pieces_come_each_to_a_length_of_its_own(rng):
    """Past the apex of a cone, or up to its rim or to the apex, with others that begin at the same time or later."""
    aside, lengths = np.geomspace(1e-2, 2.0, 60), rng.uniform(0.0, 2.0, 60)
    aside[0] = 0.0
    # half-way up, at angles from the way to the apex
    slope = np.array([-0.5, 0.0, 1.0]) / np.hypot(0.5, 1.0)
    p = np.cos(aside)[:, None] * slope + np.sin(aside)[:, None] * np.array([0.0, 1.0, 0.0])
    first = pack(np.broadcast_to([0.25, 0.0, 0.5], p.shape), p, jacobi=True)
    found, end = trace_to(sc.Cone(0.5, 1.0), first, lengths, rtol=1e-10)
    rim = HALF * np.cos(aside) + np.sqrt((2 * HALF) ** 2 - (HALF * np.sin(aside)) ** 2)
    on = lengths < rim
    on[0] = lengths[0] < HALF
    assert 30 < on.sum() < 58
    # it unrolls: distances from the apex, and p along the way from it
    away = np.sqrt(HALF**2 + lengths**2 - 2 * HALF * lengths * np.cos(aside))
    along = (lengths - HALF * np.cos(aside)) / away
    radial = found[:, X] - [0.0, 0.0, 1.0]
    np.testing.assert_allclose(np.linalg.norm(radial, axis=1)[on], away[on], atol=1e-8)
    np.testing.assert_allclose(np.sum(radial * found[:, P], axis=1)[on], (along * away)[on], atol=1e-8)
    np.testing.assert_allclose(found[on, M11], 1.0, atol=1e-6)
    assert np.all(np.isinf(end[on]))
    late = ~on & (aside > 0)
    np.testing.assert_allclose(end[late], rim[late], atol=1e-8)
    np.testing.assert_allclose(np.linalg.norm(radial, axis=1)[late], 2 * HALF, atol=1e-8)
    # alone it is the same
    alone = trace_to(sc.Cone(0.5, 1.0), first[7:8], lengths[7:8], rtol=1e-10)[0]
    np.testing.assert_allclose(alone[0], found[7], atol=1e-8)


def test_lengths_of_their_own_change_no_ray_across_joints(rng):
    body = sc.Capsule(0.5, 3.0)
    angle = rng.uniform(0, 2 * np.pi, 40)
    x = np.stack([0.5 * np.cos(angle), 0.5 * np.sin(angle), rng.uniform(-0.9, 0.9, 40)], axis=1)
    around = np.stack([-np.sin(angle), np.cos(angle), 0 * angle], axis=1)
    aside = rng.uniform(-0.3, 0.3, 40)[:, None]
    first = pack(x, np.cos(aside) * [0.0, 0.0, 1.0] + np.sin(aside) * around, jacobi=True)
    lengths = np.sort(rng.uniform(0.0, 4.0, 40))
    found, _ = trace_to(body, first, lengths, rtol=1e-11)
    alone = trace_pieces(body, first, lengths, rtol=1e-11)
    assert len(alone.passages.ray) > 30
    np.testing.assert_allclose(found, alone.states[np.arange(40), np.arange(40)], atol=1e-8)


def test_rays_that_pass_by_a_tip_keep_their_invariant():
    """Clairaut: r^2 dphi/ds, where curvatures grow like 1/r and steps that are equal all along a ray are too long."""
    body, d = sc.Ogive(0.5, 1.5), np.array([0.1, 0.2, -0.97])
    d /= np.linalg.norm(d)
    (curve,) = cr.shadow_line(body, d).curves
    tracer = RayTracer(body, 1.8)
    d = np.broadcast_to(d, curve.points.shape)
    x, tangents = tracer.onto_line(curve.points, d)
    found = tracer.at(d, x, tangents, np.full(len(x), 1.8)).rays
    clairaut, end = (v[:, 0] * p[:, 1] - v[:, 1] * p[:, 0] for v, p in ((x, d), (found.points, found.directions)))
    # at its turn a ray is so far from the axis
    assert np.sum((np.abs(clairaut) < 0.02) & found.alive) > 20
    np.testing.assert_allclose(end, clairaut, atol=1e-9)


def test_neighbours_are_parted_where_more_than_their_spreading_is_between_them():
    body, x = sc.Cone(0.5, 1.0), np.zeros((3, 3))
    other = x + np.array([[0.1, 0, 0], [1.0, 0, 0], [1.0, 0, 0]])
    assert parted(body, x, other, np.array([1.0, 1.0, 5.0]), np.full(3, 0.1)).tolist() == [False, True, False]
