"""Residues at the Regge poles, against the partial waves, which know nothing of poles."""

import numpy as np
import pytest

from tests.reference import sphere, watson

ANGLES = np.radians([30.0, 60.0, 90.0, 120.0, 150.0])


@pytest.mark.parametrize("ka", [10.0, pytest.param(100.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize("boundary", ["soft", 0.5 - 0.3j, pytest.param("hard", marks=pytest.mark.slow)])
def test_shadow_is_all_residues(ka, boundary):
    theta = np.radians([0.0, 20.0, 40.0, 55.0])
    exact = sphere.surface_derivative if boundary == "soft" else sphere.surface_field
    expected = exact(ka / 2, 2.0, np.cos(theta), boundary)
    found = watson.shadow_surface_field(ka / 2, 2.0, theta, boundary)
    # measured: 5e-11 at 55 degrees, where 30 modes leave off; 2e-11 at 0, where the partial waves cancel
    np.testing.assert_allclose(found, expected, rtol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("boundary", ["soft", "hard", 0.5 - 0.3j, "across", "within"])
def test_total_less_creeping_is_one_smooth_reflected_wave(boundary):
    wavenumbers, theta = np.linspace(8.0, 12.0, 13), np.radians([90.0])
    kinds = ("across", "within")
    total, creeping = [], []
    for k in wavenumbers:
        if boundary in kinds:
            total.append(sphere.pec_far_field(k, 1.0, np.cos(theta))[kinds.index(boundary)][0])
            creeping.append(watson.pec_far_field(k, 1.0, theta, modes=6, windings=1)[kinds.index(boundary)][0])
        else:
            total.append(sphere.far_field(k, 1.0, np.cos(theta), boundary)[0])
            creeping.append(watson.far_field(k, 1.0, theta, boundary, modes=6, windings=1)[0])
    rest = (np.array(total) - creeping) * np.exp(2j * wavenumbers * np.sin(theta / 2))
    # a polynomial in 1/k, the path taken out, fits to 1e-8; with the creeping waves left in, to 1e-3 - 5e-2
    powers = np.vander(10 / wavenumbers - 1, 6)
    misfit = powers @ np.linalg.lstsq(powers, rest, rcond=None)[0] - rest
    assert np.max(np.abs(misfit)) < 1e-7


@pytest.mark.parametrize("boundary", ["soft", "hard"])
def test_two_rays_make_the_whole(boundary):
    short, long = watson.isolated_rays(20.0, 1.0, ANGLES, boundary, modes=5)
    np.testing.assert_allclose(short + long, watson.far_field(20.0, 1.0, ANGLES, boundary, modes=5), rtol=1e-12)
    # the long ray at θ has gone the way of a short one at 2π - θ: no angle is too long for the first mode alone
    lam = watson.poles(20.0, 1.0, boundary, 1)[0]
    short, long = watson.isolated_rays(20.0, 1.0, ANGLES, boundary, modes=1)
    np.testing.assert_allclose(np.abs(long / short), np.exp(-lam.imag * (2 * np.pi - 2 * ANGLES)), rtol=0.1)


def test_axis_is_the_limit_and_windings_add_up():
    near, axis = watson.far_field(10.0, 1.0, [np.pi - 1e-5, np.pi], "hard")
    assert near == pytest.approx(axis, rel=1e-6)
    once, twice, often = (watson.far_field(3.0, 1.0, [2.0], "hard", windings=j)[0] for j in (0, 1, 20))
    turn = np.exp(2j * np.pi * (watson.poles(3.0, 1.0, "hard", 1)[0] - 0.5))
    assert twice / once == pytest.approx(1 + turn, rel=1e-3)
    assert often / once == pytest.approx(1 / (1 - turn), rel=1e-3)
