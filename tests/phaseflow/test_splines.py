"""Splines against scipy's own evaluation."""

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from creeping.phaseflow.splines import interpolation_operator, uniform_weights


@pytest.mark.parametrize("degree", [3, 5])
@pytest.mark.parametrize("periodic", [False, True])
def test_uniform_coefficients_give_scipys_spline(degree, periodic, rng):
    n = 14
    values = rng.normal(size=n)
    coefficients = interpolation_operator(n, degree, periodic) @ values
    if periodic:
        spline = make_interp_spline(np.arange(n + 1.0), np.append(values, values[0]), k=degree, bc_type="periodic")
    else:
        spline = make_interp_spline(np.arange(float(n)), values, k=degree)
    t = rng.uniform(0, n - 1, 100)
    cell = np.floor(t).astype(int)
    weights = uniform_weights(t - cell, degree)
    mine = sum(weights[:, j] * coefficients[cell + j] for j in range(degree + 1))
    np.testing.assert_allclose(mine, spline(t), atol=1e-12)


@pytest.mark.parametrize("degree", [3, 5])
def test_weights_sum_to_one_and_reproduce_moments(degree):
    t = np.linspace(0, 1, 11)
    w = uniform_weights(t, degree)
    np.testing.assert_allclose(w.sum(axis=-1), 1, atol=1e-14)
    # the first moment of uniform B-splines is linear
    np.testing.assert_allclose(w @ np.arange(degree + 1) - (degree - 1) / 2, t, atol=1e-14)
