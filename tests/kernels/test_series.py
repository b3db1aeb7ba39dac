"""Functions by polynomials against the library's."""

import numpy as np
from numba import njit

from creeping.kernels.cube_root import LEAST, cube_root
from creeping.kernels.exponential import exponential, wave


@njit
def _exponentials(x, out):
    for i in range(len(x)):
        out[i] = exponential(x[i])


@njit
def _waves(a, b, out):
    for i in range(len(a)):
        out[i, 0], out[i, 1] = wave(a[i], b[i])


@njit
def _roots(x, out):
    for i in range(len(x)):
        out[i] = cube_root(x[i])


def test_exponential_is_good_to_rounding():
    x = np.concatenate([np.linspace(-690, 690, 20_001), np.linspace(-1, 1, 1001), [0.0]])
    out = np.empty_like(x)
    _exponentials(x, out)
    np.testing.assert_allclose(out, np.exp(x), rtol=5e-16)
    assert out[-1] == 1.0


def test_exponential_of_anything_is_a_number():
    x = np.array([-1e300, -np.inf, 1e300, np.inf])
    out = np.empty_like(x)
    _exponentials(x, out)
    assert np.all(np.isfinite(out)) and np.all(out[:2] < 1e-300) and np.all(out[2:] > 1e300)


def test_wave_errs_like_its_phase():
    rng = np.random.default_rng(5)
    a, b = rng.uniform(-30, 5, 5000), rng.uniform(-300, 300, 5000)
    out = np.empty((len(a), 2))
    _waves(a, b, out)
    exact = np.exp(a + 1j * b)
    assert np.max(np.abs(out[:, 0] + 1j * out[:, 1] - exact) / np.abs(exact)) < 4e-16 * 300


def test_cube_root_is_good_to_rounding():
    x = np.concatenate([np.exp(np.linspace(-200, 200, 20_001)), np.linspace(0.9, 8.1, 5001)])
    out = np.empty_like(x)
    _roots(x, out)
    np.testing.assert_allclose(out, np.cbrt(x), rtol=1e-15)


def test_cube_root_of_nothing_is_0():
    x = np.array([0.0, -1.0, LEAST / 2])
    out = np.empty_like(x)
    _roots(x, out)
    np.testing.assert_array_equal(out, 0.0)
