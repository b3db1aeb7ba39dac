"""Residues at the Regge poles, against the partial waves, which know nothing of poles."""

import numpy as np
import pytest
from scipy.special import ai_zeros, h1vp, hankel1

from studies.reference import sphere, watson

ANGLES = np.radians([30.0, 60.0, 90.0, 120.0, 150.0])


@pytest.mark.parametrize("ka", [10.0, pytest.param(100.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize("boundary", ["soft", "hard", 0.5 - 0.3j])
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


def test_pole_solves_the_characteristic_equation():
    # by another Hankel function, an integral, good to 1e-7 here, where its two saddles cancel
    x = 30.0
    t = np.linspace(-6.0, 6.0, 4001)
    path = t + 1j * np.pi * 0.5 * (1 + np.tanh(t))
    slope = 1 + 1j * np.pi * 0.5 / np.cosh(t) ** 2

    def hankel(order):
        # H = (1/πi) ∫ exp(x sinh z - order z) dz from -∞ to ∞ + iπ; the rim of the path is far below rounding
        return np.sum(np.exp(x * np.sinh(path) - order * path) * slope) * (t[1] - t[0]) / (1j * np.pi)

    assert hankel(31.0) == pytest.approx(hankel1(31.0, x), rel=1e-10)
    for boundary in ("soft", "hard", 1.0):
        for lam in watson.poles(x, 1.0, boundary, 3):
            h, dh = hankel(lam), hankel(lam - 1) - lam / x * hankel(lam)
            if boundary == "soft":
                assert abs(h) < 1e-6 * abs(dh)
            else:
                eta = 0.0 if boundary == "hard" else boundary
                assert abs((1j * eta - 1 / (2 * x)) * h + dh) < 1e-6 * abs(h)
    assert h1vp(31.0, x) == pytest.approx(hankel(30.0) - 31 / x * hankel(31.0), rel=1e-10)


@pytest.mark.slow
def test_poles_of_high_frequency():
    zeros, slopes = ai_zeros(3)[:2]
    turn, m = np.exp(1j * np.pi / 3), 250 ** (1 / 3)
    np.testing.assert_allclose(watson.poles(500.0, 1.0, "soft", 3), 500 - m * zeros * turn, rtol=3e-4)
    np.testing.assert_allclose(watson.poles(500.0, 1.0, "hard", 3), 500 - m * slopes * turn, rtol=3e-4)
    np.testing.assert_allclose(watson.poles(50.0, 1.0, 1e8, 3), watson.poles(50.0, 1.0, "soft", 3), rtol=1e-6)
    np.testing.assert_allclose(watson.poles(50.0, 1.0, 1e-8, 3), watson.poles(50.0, 1.0, "hard", 3), rtol=1e-6)


@pytest.mark.parametrize("boundary", ["soft", "hard"])
def test_two_rays_make_the_whole(boundary):
    short, long = watson.isolated_rays(20.0, 1.0, ANGLES, boundary, modes=5)
    np.testing.assert_allclose(short + long, watson.far_field(20.0, 1.0, ANGLES, boundary, modes=5), rtol=1e-12)
    # the long ray at θ has gone the way of a short one at 2π - θ: no angle is too long for the first mode alone
    lam = watson.poles(20.0, 1.0, boundary, 1)[0]
    short, long = watson.isolated_rays(20.0, 1.0, ANGLES, boundary, modes=1)
    np.testing.assert_allclose(np.abs(long / short), np.exp(-lam.imag * (2 * np.pi - 2 * ANGLES)), rtol=0.1)


@pytest.mark.parametrize(("ka", "least", "most"), [(10.0, 0.11, 0.17), (100.0, 0.023, 0.035)])
def test_first_order_differs_as_measured_before(ka, least, most):
    # FORMULAS.md, 5.3 and the first line of section 9
    zeros, _, _, slopes = ai_zeros(6)
    m, f = (ka / 2) ** (1 / 3), np.zeros(len(ANGLES), dtype=complex)
    for s, n in ((ANGLES, 1), (2 * np.pi - ANGLES, 2)):
        decay = np.exp(-1j * np.exp(1j * np.pi / 3) * m * np.multiply.outer(s, zeros)) / slopes**2
        pekeris = -np.exp(1j * np.pi / 12) / (2 * np.sqrt(np.pi)) * decay.sum(axis=-1)
        f -= m * np.sqrt(2 / ka) * pekeris / np.sqrt(np.sin(ANGLES)) * np.exp(1j * (ka * s - np.pi * n / 2))
    exact = watson.far_field(ka, 1.0, ANGLES, "soft", modes=6)
    error = np.abs(f - exact) / np.abs(exact)
    assert least < error.min() and error.max() < most


def test_axis_is_the_limit_and_windings_add_up():
    near, axis = watson.far_field(10.0, 1.0, [np.pi - 1e-5, np.pi], "hard")
    assert near == pytest.approx(axis, rel=1e-6)
    once, twice, often = (watson.far_field(3.0, 1.0, [2.0], "hard", windings=j)[0] for j in (0, 1, 20))
    turn = np.exp(2j * np.pi * (watson.poles(3.0, 1.0, "hard", 1)[0] - 0.5))
    assert twice / once == pytest.approx(1 + turn, rel=1e-3)
    assert often / once == pytest.approx(1 / (1 - turn), rel=1e-3)


def test_refusals():
    with pytest.raises(ValueError, match="outside"):
        watson.shadow_surface_field(10.0, 1.0, [2.0], "soft")
    with pytest.raises(ValueError, match="outside"):
        watson.far_field(10.0, 1.0, [0.0], "soft")
    with pytest.raises(ValueError, match="windings"):
        watson.far_field(10.0, 1.0, [1.0], "soft", windings=-1)
