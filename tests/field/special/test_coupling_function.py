"""The coupling function against sums of many modes and the differential equation of its integrand."""

import numpy as np
import pytest

from creeping.field.airy import DEEP, SERIES, coupling_function, hard_modes, soft_coupling_function, soft_modes


@pytest.mark.parametrize("power", [0, 1, 2])
def test_series_are_sums_of_two_hundred_modes(power):
    xi, hard, soft = np.linspace(0.5, SERIES, 9), hard_modes(200).tau, soft_modes(200).tau
    sums = np.exp(0.25j * np.pi) * np.sqrt(np.pi * xi) * (np.exp(1j * xi[:, None] * hard) @ hard ** (power - 1))
    assert np.allclose(coupling_function(xi, power), sums, rtol=1e-11)
    sums = 2 * np.exp(-0.25j * np.pi) * np.sqrt(np.pi) * xi**1.5 * (np.exp(1j * xi[:, None] * soft) @ soft**power)
    assert np.allclose(soft_coupling_function(xi, power), sums, rtol=1e-11)


@pytest.mark.parametrize("power", [0, 1, 2])
@pytest.mark.parametrize("seam", [SERIES, DEEP])
def test_no_jump_where_modes_take_over(power, seam):
    at = np.array([seam, np.nextafter(seam, 9)])
    below, above = coupling_function(at, power)
    assert abs(above - below) < 1e-8 * abs(below)
    below, above = soft_coupling_function(at, power)
    assert abs(above - below) < 1e-7 * abs(below)
    below, above = coupling_function(at, squared=True)
    assert abs(above - below) < 1e-8 * abs(below)


def test_plane_limit_and_first_term():
    """Of the soft one w1'/w1 = t^(1/2) - 1/(4t) + ..., by the expansion of Airy functions."""
    xi = np.array([1e-6, 1e-4])
    first = np.sqrt(np.pi) * np.exp(-0.25j * np.pi) * xi**1.5
    assert np.allclose(coupling_function(xi), 1 - first / 4, rtol=1e-12)
    assert np.allclose(soft_coupling_function(xi), 1 - first / 2, rtol=1e-12)


@pytest.mark.parametrize("xi", [0.3, 1.2, 2.2])
def test_squares_obey_riccati(xi):
    """R' = 1 - t R² under the integral: -iξ W0 = i d/dξ of that of R², of integrals without √ξ."""
    h = 1e-4
    at = xi + h * np.array([-2, -1, 1, 2])
    square = coupling_function(at, squared=True) / np.sqrt(at)
    slope = (square[0] - 8 * square[1] + 8 * square[2] - square[3]) / (12 * h)
    # t R² under the integral is -i times the slope; the integral of 1 is zero
    assert np.isclose(1j * xi * coupling_function(np.array(xi)) / np.sqrt(xi), -1j * slope, rtol=1e-8)


@pytest.mark.parametrize("xi", [0.3, 1.2, 2.2])
def test_powers_are_derivatives(xi):
    """(-i d/dxi) of the integral of S, which is U/xi^(3/2)."""
    h = 1e-4
    at = xi + h * np.array([-2, -1, 1, 2])
    plain = soft_coupling_function(at) / at**1.5
    slope = (plain[0] - 8 * plain[1] + 8 * plain[2] - plain[3]) / (12 * h)
    assert np.isclose(soft_coupling_function(np.array(xi), 1) / xi**1.5, -1j * slope, rtol=1e-8)
