"""Rays that end while their waves still matter: what they lose is said, and nothing is said of rays that do not."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.field.boundary import HARD, scalar_boundaries
from creeping.field.waves.far_geometry import far_geometry
from tests.reference import sphere

ANGLES = np.radians(np.arange(0.0, 181.0, 2.0))
ALONG = np.stack([np.sin(ANGLES), 0 * ANGLES, np.cos(ANGLES)], axis=1)
SHARE = 0.03


def far_of(length, wavenumber, boundary="hard"):
    ball = sc.Sphere()
    line = cr.shadow_line(ball, (0, 0, 1))
    fan = cr.launch(cr.DirectFlow(ball), line, length=length, wavenumber=wavenumber, n_rays=48, measured=False)
    return fan, cr.far_field(fan, ALONG, wavenumber=wavenumber, boundary=boundary, method="rays")


@pytest.mark.slow
@pytest.mark.parametrize("boundary", ["hard", "soft"])
@pytest.mark.parametrize("wavenumber", [10.0, 30.0])
@pytest.mark.parametrize("length", [0.1, 0.2, 0.5, 1.0, 2.0, "auto"])
def test_what_short_rays_lose_is_said(length, wavenumber, boundary):
    exact = sphere.far_field(wavenumber, 1.0, np.cos(ANGLES), boundary)
    _, far = far_of(length, wavenumber, boundary)
    off, largest = np.abs(far.total - exact), np.max(np.abs(exact))
    unsaid = (off > SHARE * largest) & (off > far.error) & ~far.unresolved
    assert not np.any(unsaid)
    # and of the field there, not of its largest value alone
    assert not np.any((off > 0.1 * np.abs(exact)) & (off > 2 * far.error) & ~far.unresolved)


@pytest.mark.parametrize("boundary", ["hard", "soft", "pec"])
def test_long_rays_lose_nothing(boundary):
    fan, far = far_of("auto", 30.0, boundary)
    assert not np.any(far.unresolved)
    geometry = far_geometry(fan, ALONG)
    for kind in scalar_boundaries(boundary):
        assert not np.any(geometry.ends.lost(geometry.directions, geometry.incidence, 30.0, kind))


def test_short_rays_are_flagged_where_they_would_leave():
    _, far = far_of(1.5, 30.0)
    lit = ANGLES > 3.0
    beyond = (ANGLES > 1.6) & (ANGLES < 1.8)
    before = (ANGLES > 0.5) & (ANGLES < 1.1)
    assert np.all(far.unresolved[beyond])
    assert not np.any(far.unresolved[before | lit])


def test_the_bound_falls_like_the_first_mode():
    # from ray length 1 to 2 by e^-(Im tau xi), at the observers that the ends just miss
    k = 30.0
    at_end = []
    for length in (1.0, 2.0):
        fan, _ = far_of(length, k)
        at_end.append(np.max(fan_lost(fan, k)[ANGLES > 0.5] * np.sqrt(np.sin(length))))
    assert at_end[1] / at_end[0] == pytest.approx(np.exp(-0.8823 * np.cbrt(k / 2)), rel=0.35)


def fan_lost(fan, k):
    geometry = far_geometry(fan, ALONG)
    return geometry.ends.lost(geometry.directions, geometry.incidence, k, HARD)


def test_a_conductor_loses_what_its_worse_polarisation_does():
    _, far = far_of(0.5, 30.0, "pec")
    _, hard = far_of(0.5, 30.0, "hard")
    assert far.error.shape == (len(ANGLES), 2, 2)
    assert np.array_equal(far.unresolved[ANGLES > 1.0].any(), hard.unresolved[ANGLES > 1.0].any())


def test_a_fan_without_rays_loses_nothing(dark_fan):
    assert not np.any(fan_lost(dark_fan, 20.0))
