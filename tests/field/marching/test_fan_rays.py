"""Waves marched along the rays of a fan on the sphere: against its series, and against creeping modes."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.field.boundary import HARD, SOFT
from creeping.field.marching.fan_rays import fan_profiles
from creeping.field.marching.layer import march_rays
from creeping.field.marching.plan import MarchStatus
from tests.reference import sphere

BANDS = ((0.3, 0.6), (0.6, 0.9), (0.9, 1.2))


@pytest.fixture(scope="module")
def fan():
    ball = sc.Sphere()
    line = cr.shadow_line(ball, direction=(0, 0, 1))
    return cr.launch(cr.DirectFlow(ball, rtol=1e-10), line, length=3.0, n_rays=16)


def total(marched, ray, s):
    """Sum of the rays through a point, and of their sizes: the short way, and the long one through the axis."""
    k, width = marched.wavenumber, np.sqrt(np.cos(s))
    other = np.pi - s
    short = marched.at(ray, s) / width * np.exp(1j * k * s)
    long = np.where(other < 3, marched.at(ray, np.minimum(other, 3)), 0) / width * np.exp(1j * k * other - 0.5j * np.pi)
    return short + long, np.abs(short) + np.abs(long)


@pytest.mark.parametrize(
    ("k", "kind", "limits"),
    [
        (20.0, "soft", (2.0, 0.4, 0.6)),
        (20.0, "hard", (0.35, 0.8, 1.4)),
        pytest.param(40.0, "hard", (0.2, 0.5, 0.8), marks=pytest.mark.slow),
        pytest.param(100.0, "hard", (0.1, 0.25, 0.4), marks=pytest.mark.slow),
    ],
)
def test_sphere(fan, k, kind, limits):
    """Per cent of the sum of waves, medians over bands of s; modes of the second order differ by no more than both."""
    boundary = SOFT if kind == "soft" else HARD
    marched = march_rays(fan_profiles(fan, boundary), wavenumber=k, boundary=boundary)
    assert np.all(marched.status == MarchStatus.OK)
    s = np.linspace(0.3, 1.2, 271)
    found, size = total(marched, 3, s)
    function = sphere.surface_derivative if kind == "soft" else sphere.surface_field
    exact = function(k, 1.0, np.sin(s), kind)
    points = np.stack([np.cos(s), 0 * s, np.sin(s)], axis=-1)
    modes = np.asarray(cr.surface_field(fan, points, wavenumber=k, boundary=kind))
    for (low, high), limit in zip(BANDS, limits, strict=True):
        q = (s >= low) & (s <= high)
        error, of_modes = (100 * np.median((np.abs(v - exact) / size)[q]) for v in (found, modes))
        assert error < limit
        assert 100 * np.median((np.abs(found - modes) / size)[q]) < limit + of_modes


def test_profiles_of_the_sphere(fan):
    profiles = fan_profiles(fan, HARD)
    assert profiles.s[0, 0] == pytest.approx(-np.radians(80.0)) and profiles.s[0, -1] == pytest.approx(fan.length)
    np.testing.assert_allclose(profiles.curvature, 1, atol=1e-8)
    np.testing.assert_allclose(profiles.transverse, 1, atol=1e-8)
    np.testing.assert_allclose(profiles.spreading, np.cos(profiles.s), atol=1e-7)


def test_weighted_bodies_are_refused():
    ball = sc.Sphere(speed="1 + x/4")
    fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), cr.shadow_line(ball, direction=(0, 0, 1)), length=1.0, n_rays=4)
    with pytest.raises(cr.InvalidInputError, match="has a speed"):
        fan_profiles(fan, HARD)


def test_rays_of_a_body_that_they_leave():
    """On the twisted ellipsoid rays detach; marched waves go on there and are finite."""
    body = sc.TwistedEllipsoid()
    line = cr.shadow_line(body, direction=(1, 1, 1))
    fan = cr.launch(cr.DirectFlow(body, rtol=1e-8), line, length=1.5, n_rays=32)
    assert np.any(fan.status == cr.RayStatus.DETACHED)
    marched = march_rays(fan_profiles(fan, HARD), wavenumber=20.0, boundary=HARD)
    assert np.all(np.isfinite(marched.values))
    ended = np.flatnonzero(fan.status == cr.RayStatus.DETACHED)
    served = [ray for ray in ended if marched.status[ray] == MarchStatus.OK]
    assert served
    beyond = fan.detachment[served[0]] + 0.05
    assert np.abs(marched.at(served[0], [beyond]))[0] > 1e-3
