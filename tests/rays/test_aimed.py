"""Rays sought towards directions on bodies of pieces: all that there are, wherever the rays of the fan lie."""

import numpy as np
import pytest
import shared_bodies as sc
from body_checks import unit

import creeping as cr
from creeping.field.waves.far_geometry import far_geometry
from creeping.geodesics.pieces import trace_to
from creeping.geodesics.states import P, pack
from creeping.rays import tracer

OGIVE = sc.Ogive(1.0, 10.0)
SEEN = cr.fibonacci_directions(10)


@pytest.fixture(scope="module")
def dense():
    """Shed rays of an ogive, of a dense fan, and the directions: to one side of the plane of symmetry, then images."""
    r = cr.fibonacci_directions(24)[::2]
    directions = np.concatenate([r, r * [1.0, -1.0, 1.0]])
    return shed(OGIVE, directions, 1000), directions


def shed(body, directions, n_rays, incidence=(-0.6, 0.0, -0.8)):
    flow, line = cr.DirectFlow(body, rtol=1e-8), cr.shadow_line(body, incidence)
    length = 1.2 * np.ptp(body.bounds[:, 2])
    return far_geometry(cr.launch(flow, line, length=length, n_rays=n_rays, measured=False), directions).shed


def without(found, others, observer, mirror):
    """Number of rays that are not among others, of the observers (n,), as images."""
    close = 1e-3 * np.ptp(OGIVE.bounds[:, 2])
    same = (observer[:, None] == others.observer) & (np.abs(found.rays.time[:, None] - others.rays.time) < close)
    same &= np.linalg.norm(found.rays.points[:, None] - others.rays.points * mirror, axis=2) < close
    return int(np.sum(~same.any(axis=1)))


def test_rays_have_mirror_images(dense):
    """Cells of the fan are no images of each other: a search that loses rays loses some of one side alone."""
    found, directions = dense
    half = len(directions) // 2
    assert len(found.observer) > 40
    assert without(found, found, (found.observer + half) % (2 * half), [1, -1, 1]) <= 2


def test_coarse_fan_finds_what_a_dense_one_does(dense):
    found, directions = dense
    coarse = shed(OGIVE, directions, 256)
    assert without(found, coarse, found.observer, [1, 1, 1]) <= 2
    assert without(coarse, found, coarse.observer, [1, 1, 1]) <= 2


@pytest.mark.parametrize("n_rays, angle", [(256, 0.0), (256, 0.5), (700, 1.5)])
def test_what_passes_by_a_tip_is_found_however_rays_lie(n_rays, angle):
    """The body turned about its axis, with incidence and direction, is the same, and cells of its fan are others."""
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    directions = cr.fibonacci_directions(40)[34:38]
    found = shed(OGIVE, directions @ turn.T, n_rays, turn @ [0.1, 0.2, -0.97])
    beside = found.observer == 2
    assert np.bincount(found.observer, minlength=4).tolist() == [1, 2, 1, 1]
    from_tip = np.linalg.norm(found.rays.points[beside] - [0, 0, -5.0], axis=1)
    assert np.all(from_tip < 0.02 * np.ptp(OGIVE.bounds[:, 2]))


def test_rays_that_are_found_go_back_to_the_wave():
    """Reversed from where it leaves along r, a ray comes to its launch along -d, by whatever tip it has passed."""
    body, d = sc.Ogive(0.5, 1.5), unit(np.array([0.1, 0.2, -0.97]))
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-8), cr.shadow_line(body, d), wavenumber=40.0, n_rays=256)
    directions = cr.fibonacci_directions(24)
    found = far_geometry(fan, directions).shed
    r, times = directions[found.observer], found.rays.time
    assert len(times) > 20
    np.testing.assert_allclose(found.rays.directions, r, atol=2 * tracer.ACCEPTED)
    back, end = trace_to(body, pack(found.rays.points, -found.rays.directions), times, rtol=1e-12)
    # one that comes within reach of a tip again ends there
    on = times < end
    assert np.mean(on) > 0.95
    np.testing.assert_allclose(back[on, P], np.broadcast_to(-d, (on.sum(), 3)), atol=1e-5)


@pytest.mark.slow
def test_rays_of_a_thin_body_do_not_hang_on_the_number_that_a_fan_has():
    """One search of a hundred comes no nearer for five rounds, and then does."""
    body, d = sc.Ellipsoid(1.0, 0.7, 0.2), np.array([0.2, -0.9, 0.3])
    line = cr.shadow_line(body, d / np.linalg.norm(d))
    counts = [
        len(far_geometry(cr.launch(cr.DirectFlow(body, rtol=1e-8), line, wavenumber=6.0, n_rays=n), SEEN).shed.observer)
        for n in (96, 384)
    ]
    assert counts[0] == counts[1] > 60


def test_searches_whose_first_step_is_long_lead_nowhere(monkeypatch):
    """Those that end there, against searches that all go on."""
    body, d = sc.TwistedEllipsoid(), np.array([0.3, 0.5, 0.812])
    line, found = cr.shadow_line(body, d / np.linalg.norm(d)), []
    for step in (tracer.STEP, np.inf):
        monkeypatch.setattr(tracer, "STEP", step)
        fan = cr.launch(cr.DirectFlow(body, rtol=1e-8), line, length=4.0, n_rays=256)
        found.append(len(far_geometry(fan, SEEN).shed.observer))
    assert found[0] == found[1] > 40
