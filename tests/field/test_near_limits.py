"""The near field far away and on the shadow boundary, and fields of bodies of any unit."""

import numpy as np
import pytest
import shared_bodies as sc

import creeping as cr
from creeping.errors import InvalidInputError
from creeping.field.airy import hard_modes
from creeping.field.fock import HIGH, height_gain, transition_rate

D = np.array([0.3, 0.2, 0.9]) / np.linalg.norm([0.3, 0.2, 0.9])


def fan_of(scale=1.0):
    body = sc.Ellipsoid(scale, 0.8 * scale, 0.6 * scale)
    line = cr.shadow_line(body, direction=D)
    return cr.launch(cr.DirectFlow(body, rtol=1e-10), line, length=4 * scale, n_rays=96)


@pytest.fixture(scope="module")
def fan():
    return fan_of()


def test_the_near_field_tends_to_the_far_field(fan):
    r = np.array([[1, 0, 0.3], [0, 1, -0.2], [0.5, 0.5, 0.1]])
    r /= np.linalg.norm(r, axis=1, keepdims=True)
    far = cr.far_field(fan, r, wavenumber=30.0, boundary="hard", method="rays").creeping
    gaps = []
    for R in (1e2, 1e3, 1e4, 1e6):
        u = R * cr.near_field(fan, R * r, wavenumber=30.0, boundary="hard", method="rays")
        gaps.append(np.max(np.abs(np.abs(u) / np.abs(far) - 1)))
    # like 1/R, until the ray's direction is known no better
    np.testing.assert_allclose(gaps[:3], gaps[0] * np.array([1, 0.1, 0.01]), rtol=0.2)
    assert gaps[3] < 3e-4


def test_height_gain_is_continuous_where_it_is_expanded():
    tau = hard_modes(10).tau
    below, above = (height_gain(tau, np.array([HIGH * (1 + side)])) for side in (-1e-9, 1e-9))
    np.testing.assert_allclose(below, above, rtol=1e-8)


def test_the_transition_function_without_its_root():
    assert np.isfinite(transition_rate(0.0))


def test_half_the_wave_on_the_shadow_boundary():
    ball = sc.Sphere()
    fan = cr.launch(cr.DirectFlow(ball), cr.shadow_line(ball, direction=(0, 0, 1)), length=2.5, n_rays=48)
    heights = np.geomspace(0.5, 60.0, 12)
    azimuth = np.linspace(0, 6, 12)
    points = np.stack([np.cos(azimuth), np.sin(azimuth), heights], axis=1)
    u = cr.near_field(fan, points, wavenumber=100.0, boundary="hard", method="rays")
    assert np.all(np.isfinite(u))
    # the ray of the other side of the rim comes too, weaker
    assert np.all((np.abs(u[4:]) > 0.3) & (np.abs(u[4:]) < 0.9))


def test_complex_numbers_are_refused(fan):
    with pytest.raises(InvalidInputError, match="complex"):
        cr.far_field(fan, [(0, 1, 0)], wavenumber=np.complex128(20 + 1j))
    with pytest.raises(InvalidInputError, match="complex"):
        cr.far_field(fan, np.array([(0, 1, 0.1j)]), wavenumber=20.0)
