"""Rational steps against the exponential, by values and by Taylor coefficients."""

import numpy as np
import pytest

from creeping.field.marching.layer import ORDER, rational_step, tabulated_step


def step_of(delta, X):
    b, c = rational_step(np.array([delta]))
    return np.sum(c / (1 + b * X[:, None]), axis=1)


@pytest.mark.parametrize("delta", [0.02, 0.7, 3.1, 40.0])
def test_nothing_grows(delta):
    assert np.max(np.abs(step_of(delta, np.linspace(-30, 500, 20001)))) < 1 + 1e-6


@pytest.mark.parametrize("delta", [0.3, 1.1, 2.9])
def test_series_agrees_to_its_order(delta):
    """What is left goes like X^(2 ORDER): halving X takes 2^8."""
    X = np.array([0.2, 0.1])
    error = np.abs(step_of(delta, X) - np.exp(1j * delta * (np.sqrt(1 + X) - 1)))
    between = 1e-8 if delta > 1 else 1e-9
    assert error[0] < 2e-5 * delta
    assert error[1] < max(error[0] / 2 ** (2 * ORDER - 1), between)


def test_tabulated_steps_are_exact_at_their_poles():
    """The approximant's Taylor series is that of the exponential, by another route: Cauchy's integral."""
    b, c = tabulated_step(8)
    X = 0.05 * np.exp(2j * np.pi * np.arange(64) / 64)
    found = np.sum(c / (1 + b * X[:, None]), axis=1) - np.exp(2j * (np.sqrt(1 + X) - 1))
    taylor = np.fft.fft(found) / 64
    assert np.max(np.abs(taylor[: 2 * ORDER])) < 1e-14
    assert np.abs(taylor[2 * ORDER]) > 1e-15
