"""Vectors in kernels against arrays."""

import numpy as np
import pytest
from numba import njit

from creeping.kernels.vectors import LANES, larger, load, loads, magnitude, pointer, root, spread, store
from creeping.kernels.weighted_sum import stage_sum, stage_sums


@njit
def arithmetic(a, b, out):
    x, y = load(a, 0), load(b, 3)
    store(out, 0, x + y)
    store(out, LANES, x - y)
    store(out, 2 * LANES, x * y)
    store(out, 3 * LANES, x / y)
    store(out, 4 * LANES, root(x) * spread(2.5))
    x += y
    x *= y
    x -= spread(1.0)
    store(out, 5 * LANES, x)
    store(out, 6 * LANES, -y)
    store(out, 7 * LANES, magnitude(-y))
    store(out, 8 * LANES, larger(load(a, 0), y))


def test_lanes_are_those_of_numpy():
    rng = np.random.default_rng(3)
    a, b, out = rng.uniform(1, 2, 20), rng.uniform(1, 2, 20), np.zeros(9 * LANES)
    a[0], b[4] = np.nan, np.nan
    arithmetic(a, b, out)
    x, y = a[:LANES], b[3 : 3 + LANES]
    expected = [x + y, x - y, x * y, x / y, 2.5 * np.sqrt(x), (x + y) * y - 1, -y, np.abs(y), np.where(x > y, x, y)]
    np.testing.assert_allclose(out.reshape(9, LANES), expected, rtol=1e-15, atol=0)


@njit
def recurrence(a, steps):
    """A vector as the state of a loop, and passed on to a function."""
    x = load(a, 0)
    for _ in range(steps):
        x = _half(x)
    store(a, 0, x)


@njit
def _half(x):
    return x * spread(0.5)


_pair = loads(2, 11)


@njit
def by_address(a, out):
    """The second of two vectors behind the third number, written one number on; two vectors a stride apart."""
    store(pointer(out, 1), 0, load(pointer(pointer(a, 1), 2), LANES))
    x, y = _pair(pointer(a, 1), 2)
    store(out, LANES + 1, x - y)


def test_addresses_count_elements_and_vectors_live_through_loops_and_calls():
    a, out = np.random.default_rng(7).normal(size=30), np.zeros(2 * LANES + 1)
    by_address(a, out)
    apart = a[3 : 3 + LANES] - a[14 : 14 + LANES]
    np.testing.assert_array_equal(out, np.concatenate([[0.0], a[LANES + 3 : 2 * LANES + 3], apart]))
    before = a[:LANES].copy()
    recurrence(a, 3)
    np.testing.assert_array_equal(a[:LANES], before / 8)


_WEIGHTS = np.array([[0.0, 0, 0], [0.5, 0, -2], [0, 0, 0], [1, 2, 3]])
_sums, _third_row = stage_sums(lambda: _WEIGHTS), stage_sum(lambda: _WEIGHTS, 3)


@njit
def summed(row, h, k, y, z, one):
    _sums(row, h, pointer(k, 0), y.shape[0], pointer(y, 0), pointer(z, 0))
    store(one, 0, _third_row(pointer(k, 0), y.shape[0], LANES))


def test_sums_over_stages_are_those_of_numpy():
    rng = np.random.default_rng(6)
    k, y = rng.normal(size=(3, 64)), rng.normal(size=64)
    for row in range(5):
        z, one = np.full(64, 7.0), np.zeros(LANES)
        summed(row, 0.3, k.reshape(-1), y, z, one)
        # rows without weights, and those that are not there, leave z alone
        expected = y + 0.3 * _WEIGHTS[row] @ k if row in (1, 3) else np.full(64, 7.0)
        np.testing.assert_allclose(z, expected, rtol=1e-14, atol=1e-15)
        np.testing.assert_allclose(one, (_WEIGHTS[3] @ k)[LANES : 2 * LANES], rtol=1e-14, atol=1e-15)


def test_numbers_are_no_vectors():
    @njit
    def mixed(a):
        return load(a, 0) + 1.0

    with pytest.raises(Exception, match="float64x8"):
        mixed(np.ones(LANES))
