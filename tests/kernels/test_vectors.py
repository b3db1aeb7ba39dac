"""Vectors in kernels against arrays."""

import numpy as np
import pytest
from numba import njit

from creeping.kernels.vectors import LANES, load, root, spread, store


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


def test_lanes_are_those_of_numpy():
    rng = np.random.default_rng(3)
    a, b, out = rng.uniform(1, 2, 20), rng.uniform(1, 2, 20), np.zeros(7 * LANES)
    arithmetic(a, b, out)
    x, y = a[:LANES], b[3 : 3 + LANES]
    expected = [x + y, x - y, x * y, x / y, 2.5 * np.sqrt(x), (x + y) * y - 1, 0 * x]
    np.testing.assert_allclose(out.reshape(7, LANES), expected, rtol=1e-15, atol=0)


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


def test_vectors_live_through_loops_and_calls():
    a = np.arange(1.0, LANES + 1)
    recurrence(a, 3)
    np.testing.assert_array_equal(a, np.arange(1, LANES + 1) / 8)


def test_numbers_are_no_vectors():
    @njit
    def mixed(a):
        return load(a, 0) + 1.0

    with pytest.raises(Exception, match="float64x8"):
        mixed(np.ones(LANES))
