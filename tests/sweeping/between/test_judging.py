"""The compiled sums over cells and their judging against the plain formulas, on a cut and on the sphere."""

import numpy as np
import pytest

from creeping.sweeping.between.stencil import LARGEST, corners, lines, offsets, weights
from creeping.sweeping.kernels.judging import FIFTH, FOURTH, KINK, cell_errors, cell_sums


@pytest.mark.parametrize("dimensions", [1, 2])
@pytest.mark.parametrize("relative", [False, True])
@pytest.mark.parametrize("rays, width", [(5, 1), (64, 3), (50, 4)])
def test_errors_are_the_largest_differences_along_lines(rays, width, relative, dimensions):
    rng = np.random.default_rng(rays)
    # some smooth along the nodes, so that differences fall
    numbers = rng.normal(size=(50, rays * width)) * rng.choice([1e-3, 1.0], rays * width)
    numbers += np.sin(0.3 * np.arange(50)[:, None] + np.arange(rays * width))
    stencils = np.stack([np.arange(6**dimensions) + k for k in range(3)])
    found = np.full((3, rays), 0.01)
    cell_errors(numbers, stencils, *lines(dimensions), corners(dimensions), 0.7, relative, found)
    for cell, stencil in enumerate(stencils):
        values = numbers[stencil].reshape((6,) * dimensions + (rays, width))
        across = [values] if dimensions == 1 else [*values, *values.swapaxes(0, 1)]
        counts = np.ones(1) if dimensions == 1 else np.tile(LARGEST, 2)
        off = 0.7 * np.max([w * plain_error(one) for w, one in zip(counts, across, strict=True)], axis=0)
        if relative:
            inside = values[(slice(2, 4),) * dimensions].reshape(-1, rays, width)
            off = off / (1 + 0.7 * np.abs(inside).min(axis=0))
        np.testing.assert_allclose(found[cell], np.maximum(off.max(axis=1), 0.01), rtol=1e-9)


def plain_error(values):
    """Error along a side, (6, ...) nodes first."""
    third, fourth, fifth = (np.abs(np.diff(values, n, axis=0)).max(axis=0) for n in (3, 4, 5))
    falls = (fourth <= third / 2) & (fifth <= third / 4)
    return np.maximum(FIFTH * fifth, FOURTH * fourth) * np.where(falls, 1, KINK)


def judged(function, dimensions):
    """Largest true error in a cell of a function of points (n, dimensions), and the stated one."""
    places = np.random.default_rng(0).random((500, dimensions))
    values = function(offsets(dimensions).astype(float))
    stated = np.zeros((1, 1))
    cell = np.arange(6**dimensions)[None]
    cell_errors(values[:, None].copy(), cell, *lines(dimensions), corners(dimensions), 1.0, False, stated)
    return np.abs(weights(places)[0] @ values - function(places)).max(), stated[0, 0]


@pytest.mark.parametrize("dimensions", [1, 2])
@pytest.mark.parametrize("turn", [0.1, 0.3, 0.6, 1.0])
def test_errors_of_smooth_functions_are_never_under_estimated(turn, dimensions):
    for phase in np.linspace(0, 3, 13):
        for angle in (0.0, 0.7, 2.0):
            along = turn * np.array([np.cos(angle), np.sin(angle)])[:dimensions]
            for function in (np.sin, lambda t: np.exp(t), lambda t: 1 / (4 + t)):
                true, stated = judged(lambda x, f=function, a=along, p=phase: f(x @ a + p), dimensions)
                assert true <= 1.02 * stated + 1e-15


@pytest.mark.parametrize("place", list(np.ndindex(6, 6)), ids=str)
def test_a_jump_at_any_node_is_seen(place):
    jump = np.array(place) - 2
    true, stated = judged(lambda x: np.all(x == jump, axis=1).astype(float), 2)
    assert true <= 2 * stated


@pytest.mark.parametrize("nodes", [6, 36])
@pytest.mark.parametrize("n", [5, 64, 200])
def test_sums_are_those_of_the_plain_formula_in_any_company(n, nodes):
    rng = np.random.default_rng(n)
    numbers, six = rng.normal(size=(50, n)), rng.normal(size=(7, nodes))
    stencils = np.stack([rng.permutation(50)[:nodes] for _ in range(3)])
    of, target = np.array([0, 0, 0, 0, 2, 2, 2]), np.array([8, 1, 4, 5, 0, 2, 7])
    found, alone = np.zeros((9, n)), np.empty((1, n))
    cell_sums(numbers, stencils, np.array([0, 4, 4, 7]), six, target, found)
    for row in range(7):
        np.testing.assert_allclose(found[target[row]], six[row] @ numbers[stencils[of[row]]], rtol=0, atol=1e-13)
        one, last = stencils[of[row]][None], np.array([0, 1])
        cell_sums(numbers, one, last, six[row : row + 1], np.array([0]), alone)
        np.testing.assert_array_equal(alone[0], found[target[row]])
    assert not found[[3, 6]].any()
