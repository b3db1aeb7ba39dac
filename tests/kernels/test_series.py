"""Functions by polynomials against the library's."""

import numpy as np
from numba import njit

from creeping.kernels.exponential import LEAST, cube_root, exponential, wave


@njit
def _filled(x, y, exponentials, waves, roots):
    for i in range(len(x)):
        exponentials[i], roots[i] = exponential(x[i]), cube_root(x[i])
        waves[i, 0], waves[i, 1] = wave(x[i], y[i])


def filled(x, y):
    out = np.empty(len(x)), np.empty((len(x), 2)), np.empty(len(x))
    _filled(x, y, *out)
    return out


def test_they_are_good_to_rounding():
    rng = np.random.default_rng(5)
    x = np.concatenate([np.linspace(-690, 690, 20_001), np.linspace(-1, 1, 1001), [0.0]])
    found = filled(x, x)[0]
    np.testing.assert_allclose(found, np.exp(x), rtol=5e-16)
    assert found[-1] == 1.0
    x, y = rng.uniform(-30, 5, 5000), rng.uniform(-300, 300, 5000)
    found = filled(x, y)[1] @ [1, 1j]
    # a wave errs like its phase
    assert np.max(np.abs(found / np.exp(x + 1j * y) - 1)) < 4e-16 * 300
    x = np.concatenate([np.exp(np.linspace(-200, 200, 20_001)), np.linspace(0.9, 8.1, 5001)])
    np.testing.assert_allclose(filled(x, x)[2], np.cbrt(x), rtol=1e-15)


def test_they_are_numbers_of_anything():
    found = filled(np.array([-1e300, -np.inf, 1e300, np.inf]), np.zeros(4))[0]
    assert np.all(np.isfinite(found)) and np.all(found[:2] < 1e-300) and np.all(found[2:] > 1e300)
    np.testing.assert_array_equal(filled(np.array([0.0, -1.0, LEAST / 2]), np.zeros(3))[2], 0.0)
