"""Splines against scipy's own evaluation."""

import numpy as np
import pytest
from oracles.leaps import evaluate
from scipy.interpolate import make_interp_spline

from creeping.phaseflow.splines import interpolation_operator, prefilter, uniform_weights


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


@pytest.mark.parametrize("degree", [3, 5])
def test_tensor_product_is_exact_at_nodes_and_for_cubics(degree, rng):
    nu, nv, na = 12, 11, 16
    u, v = np.arange(nu), np.arange(nv)
    angle = 2 * np.pi * np.arange(na) / na
    poly = (0.1 * u**3 - u)[:, None] * (v**2 + 1)[None, :]
    values = (poly[:, :, None] * np.cos(angle))[None, ..., None]
    table = prefilter(np.repeat(values, 2, axis=-1), degree, (False, False))
    grid = np.stack([rng.uniform(0, nu - 1, 50), rng.uniform(0, nv - 1, 50), rng.integers(0, na, 50)], axis=-1).astype(
        float
    )
    got = evaluate(table, np.zeros(50, dtype=int), grid, degree)
    expected = (0.1 * grid[:, 0] ** 3 - grid[:, 0]) * (grid[:, 1] ** 2 + 1) * np.cos(2 * np.pi * grid[:, 2] / na)
    np.testing.assert_allclose(got[:, 0], expected, atol=1e-9)
    np.testing.assert_allclose(got[:, 1], got[:, 0])
