"""Rays that end on non-smooth regions, their fields, and what the uncertainty of a body does to rays."""

from functools import cache

import numpy as np
import pytest
import shared_bodies as sc
from body_checks import normal_curvature, rms, unit

import creeping as cr
from creeping.field import on_body
from creeping.geodesics.integrator import trace_states
from creeping.geometry.surface import normal, project, size
from creeping.rays import tracer
from creeping.rays.ends import NON_SMOOTH_SPACING
from creeping.rays.strips import ray_points
from creeping.rays.uncertain_body import body_uncertainty

EXACT = sc.Ellipsoid(1.0, 0.8, 0.6)
INCIDENCE = (0.3, 0.5, 0.81)
LENGTH = 2.0
SPOT, REACH = project(EXACT, np.array([0.3, 0.7, -0.1])), 0.15


class Wrapped:
    """An ellipsoid that says of itself what it does not know: ``non_smooth`` or ``coarse_fit``."""

    def __init__(self, body=EXACT, **members):
        for name in ("level", "gradient", "hessian", "bounds", "atlas", "parameters", "compiled"):
            setattr(self, name, getattr(body, name))
        for name, member in members.items():
            setattr(self, name, member)


def near(points):
    return np.linalg.norm(points - SPOT, axis=-1) < REACH


@cache
def fan_of(body, direction=INCIDENCE, n_rays=96):
    line = cr.shadow_line(body, direction)
    return cr.launch(cr.DirectFlow(body), line, length=LENGTH, n_rays=n_rays, n_steps=50, max_gap=np.inf)


NON_SMOOTH, PLAIN = Wrapped(non_smooth=near), Wrapped()


@cache
def entries():
    """First time of each ray in the ball, traced at steps of 1e-3; inf if it does not come there."""
    fan = fan_of(PLAIN)
    times = np.linspace(0, LENGTH, 2001)
    points, _ = cr.trace(EXACT, fan.points[:, 0], fan.directions[:, 0], times)
    inside = near(points)
    return np.where(inside.any(axis=1), times[np.argmax(inside, axis=1)], np.inf)


def test_rays_end_just_before_non_smooth_regions():
    fan, met = fan_of(NON_SMOOTH), np.isfinite(entries())
    assert 4 < met.sum() < len(met) / 2
    np.testing.assert_array_equal(fan.status == cr.RayStatus.NON_SMOOTH, met)
    before = entries()[met] - fan.detachment[met]
    # the look-out's step, and that of the reference
    step = NON_SMOOTH_SPACING * size(EXACT)
    assert np.all(before > -1e-9) and np.all(before < 2 * step + 1e-3)
    # other rays and all geometry are unchanged
    plain = fan_of(PLAIN)
    np.testing.assert_array_equal(fan.status[~met], plain.status[~met])
    np.testing.assert_array_equal(fan.detachment[~met], plain.detachment[~met])
    for name in ("points", "directions", "spreading", "curvature", "attenuation", "eikonal"):
        np.testing.assert_array_equal(getattr(fan, name), getattr(plain, name))
    assert f"{int(met.sum())} NON_SMOOTH" in repr(fan)


def test_points_of_a_ray_end_where_it_does_and_are_traced_once(monkeypatch):
    fan, asked = fan_of(NON_SMOOTH), []

    def counted(body, states, times, **options):
        asked.append(len(states) * len(times))
        return trace_states(body, states, times, **options)

    monkeypatch.setattr(tracer, "trace_states", counted)
    times, rays = ray_points(fan)
    # some steps more before and after, and no ray for each of its points
    assert sum(asked) < 1.5 * rays.alive.size
    ends = np.where(fan.status == cr.RayStatus.NON_SMOOTH, fan.detachment, np.inf)
    met = np.isfinite(ends)
    step = NON_SMOOTH_SPACING * size(EXACT)
    assert np.all(np.abs(times[np.sum(rays.alive[met], axis=1)] - ends[met]) < times[1] + 2 * step)
    plain = ray_points(fan_of(PLAIN))[1]
    np.testing.assert_array_equal(rays.alive[~met], plain.alive[~met])
    np.testing.assert_array_equal(rays.lanes, plain.lanes)


def test_rays_launched_on_non_smooth_regions_end_at_once():
    start = fan_of(PLAIN).points[7, 0]
    fan = fan_of(Wrapped(non_smooth=lambda x: np.linalg.norm(x - start, axis=-1) < 0.1))
    launched = np.linalg.norm(fan.points[:, 0] - start, axis=-1) < 0.1
    assert launched.sum() > 1
    assert np.all(fan.status[launched] == cr.RayStatus.NON_SMOOTH)
    np.testing.assert_array_equal(fan.detachment[launched], 0)


def test_what_comes_first_ends_a_ray():
    """On the bent body rays detach; a non-smooth place that they come to later is not their end."""
    bent = sc.TwistedEllipsoid()
    plain = fan_of(bent, (1, 1, 1))
    detached = np.flatnonzero(plain.status == cr.RayStatus.DETACHED)
    ray = detached[np.argmin(plain.detachment[detached])]
    step = int(np.searchsorted(plain.travel_time, plain.detachment[ray]))

    def non_smooth_about(spot):
        return lambda x: np.linalg.norm(x - spot, axis=-1) < 0.02

    late, early = (
        fan_of(Wrapped(bent, non_smooth=non_smooth_about(plain.points[ray, k])), (1, 1, 1))
        for k in (step + 4, step // 2)
    )
    assert late.status[ray] == cr.RayStatus.DETACHED
    assert late.detachment[ray] == plain.detachment[ray]
    assert early.status[ray] == cr.RayStatus.NON_SMOOTH
    assert early.detachment[ray] < plain.detachment[ray]


def test_fields_of_a_fan_with_rays_that_end_early_are_finite_and_change_behind_it_only(monkeypatch):
    # fans with such rays are not marched
    monkeypatch.setattr(on_body, "marches", lambda *_: False)
    non_smooth, plain = fan_of(NON_SMOOTH), fan_of(PLAIN)
    k = 30.0
    # behind the ball, and where no ray that met it comes
    met = np.flatnonzero((non_smooth.status == cr.RayStatus.NON_SMOOTH) & (non_smooth.detachment < 0.5))
    behind = non_smooth.points[met[len(met) // 2], 30]
    away = np.flatnonzero(np.min(np.linalg.norm(plain.points[:, :, None] - SPOT, axis=-1), axis=(1, 2)) > 0.6)
    places = np.stack([behind, plain.points[away[len(away) // 2], 10], SPOT])
    near_by, asked = places + 0.1 * normal(EXACT, places), {"wavenumber": k, "boundary": "hard"}
    for field in (
        lambda fan: cr.surface_field(fan, places, **asked),
        lambda fan: cr.near_field(fan, near_by, method="rays", **asked),
    ):
        found, expected = field(non_smooth), field(plain)
        assert np.all(np.isfinite(found)) and np.all(np.isfinite(expected))
        assert found[1] == pytest.approx(expected[1], rel=1e-6)
        assert abs(found[0] - expected[0]) > 1e-3 * abs(expected[0])
    far = cr.far_field(non_smooth, [normal(EXACT, SPOT), non_smooth.line.direction], **asked)
    assert np.all(np.isfinite(far.total))


# the same body, known to a thousandth
COARSE_FIT = sc.Ellipsoid(1.001, 0.799, 0.6005)
UNSURE = Wrapped(coarse_fit=COARSE_FIT)


def by_hand(fan, ray):
    """End and attenuation of one ray on both bodies."""
    ends, d = [], fan.line.direction
    for body in (EXACT, COARSE_FIT):
        start = project(body, fan.points[ray, 0])
        n = normal(body, start)
        times = np.linspace(0, LENGTH, 401)
        x, q = cr.trace(body, start, unit(d - np.sum(d * n) * n), times, rtol=1e-12)
        rate = normal_curvature(body, x, q) ** (2 / 3)
        ends.append((x[-1], np.sum(0.5 * (rate[1:] + rate[:-1])) * times[1]))
    return ends


def test_error_is_the_difference_of_rays_traced_by_hand():
    fan = fan_of(UNSURE)
    found = body_uncertainty(fan, n_rays=5)
    chosen = np.unique(np.linspace(0, len(fan.points) - 1, 5).astype(int))
    assert found.rays == len(chosen) == 5
    pairs = [by_hand(fan, ray) for ray in chosen]
    assert found.points == pytest.approx(rms([np.linalg.norm(one[0] - other[0]) for one, other in pairs]), rel=1e-6)
    assert found.attenuation == pytest.approx(rms([one[1] - other[1] for one, other in pairs]), rel=1e-3)
    # launched from the same points: only along its own line does the fan of the other body agree, so to first order
    ours, theirs = fan_of(UNSURE, n_rays=12), fan_of(COARSE_FIT, n_rays=12)
    difference = rms(ours.spreading[:, -1] - theirs.spreading[:, -1])
    assert body_uncertainty(ours, n_rays=12).spreading == pytest.approx(difference, rel=0.5)


def test_error_goes_with_the_difference_of_the_bodies():
    axes, off = np.array([1.0, 0.8, 0.6]), np.array([1e-3, -1e-3, 5e-4])
    found = [
        body_uncertainty(fan_of(Wrapped(coarse_fit=sc.Ellipsoid(*(axes + f * off)))), n_rays=12) for f in (1.0, 0.1)
    ]
    for name in ("points", "spreading", "attenuation"):
        assert getattr(found[0], name) == pytest.approx(10 * getattr(found[1], name), rel=0.02)
    assert 1e-4 < found[0].points < 1e-2


@pytest.mark.slow
def test_a_body_says_by_how_much_it_errs_and_rays_that_end_are_left_out():
    one, two = (
        body_uncertainty(fan_of(Wrapped(coarse_fit=COARSE_FIT, coarse_factor=factor)), n_rays=6)
        for factor in (1.0, 2.5)
    )
    for name in ("points", "spreading", "attenuation"):
        assert getattr(two, name) == pytest.approx(2.5 * getattr(one, name)) and getattr(one, name) > 0
    same = body_uncertainty(fan_of(Wrapped(coarse_fit=EXACT)), n_rays=6)
    assert max(same.points, same.spreading, same.attenuation) < 1e-12
    # bodies known exactly have none
    assert body_uncertainty(fan_of(EXACT)) is None and body_uncertainty(fan_of(PLAIN)) is None
    nowhere = Wrapped(coarse_fit=COARSE_FIT, non_smooth=lambda x: np.ones(x.shape[:-1], dtype=bool))
    assert body_uncertainty(fan_of(nowhere)) is None
    some = fan_of(Wrapped(coarse_fit=COARSE_FIT, non_smooth=near))
    assert body_uncertainty(some, n_rays=1000).rays == np.sum(some.status == cr.RayStatus.OK)


@pytest.mark.parametrize("rays", [0, 2.5, "4", True, None])
def test_bad_numbers_of_rays(rays):
    with pytest.raises(cr.CreepingError, match=r"rays = .* is not a whole number >= 1"):
        body_uncertainty(fan_of(UNSURE), n_rays=rays)


class Rough(sc.Cylinder):
    """A cylinder whose lower half is not trusted, and on which nothing is known of curvatures."""

    height = 0.0

    def non_smooth(self, points):
        return np.asarray(points)[..., 2] < self.height


def test_rays_of_pieces_stop_where_the_ground_is_not_trusted():
    """They stay where they begin: going on took minutes on files with a piece whose fit has failed."""
    body = Rough(0.5, 4.0)
    line = cr.shadow_line(body, (1, 0.2, 0.3))
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-8), line, n_rays=24, wavenumber=20.0)
    below = fan.points[:, 0, 2] < 0
    assert 0.2 < below.mean() < 0.8
    assert set(fan.status[below]) <= {cr.RayStatus.NON_SMOOTH, cr.RayStatus.EDGE}
    np.testing.assert_array_equal(fan.detachment[below], 0)
    np.testing.assert_array_equal(fan.points[below], np.repeat(fan.points[below, :1], fan.points.shape[1], axis=1))
    ff = cr.far_field(fan, [(0, 0, 1), (0, 1, 0)], wavenumber=20.0, method="rays")
    assert np.all(np.isfinite(ff.error)) and np.all(ff.error > 0)
    # rays that all end at once have a length as well
    body = Rough(0.5, 4.0)
    body.height = 9.0
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-8), line, n_rays=8, wavenumber=20.0)
    assert fan.length > 0
    assert np.all(np.isfinite(cr.far_field(fan, [(0, 0, 1)], wavenumber=20.0, method="rays").error))
