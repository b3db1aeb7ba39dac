"""Lattices follow from the incidences: what they lie on, how dense they are, and nothing else."""

import numpy as np
import pytest

import creeping as cr
from creeping.sweeping.between import NODES, weights
from creeping.sweeping.lattice import CROWDED, lattice_of
from tests.oracles.weighted import combined


def circle(count, height=0.0, axis=(0.3, 0.5, 0.81), turn=2 * np.pi):
    axis = np.array(axis) / np.linalg.norm(axis)
    first = np.cross(axis, (1.0, 0.0, 0.0))
    first /= np.linalg.norm(first)
    u = turn * np.arange(count)[:, None] / count
    return height * axis + np.sqrt(1 - height**2) * (np.cos(u) * first + np.sin(u) * np.cross(axis, first))


@pytest.mark.parametrize(("height", "turn"), [(0.0, 2 * np.pi), (-0.7, 1.0), (0.95, 0.05)])
def test_a_cut_is_found_whatever_its_axis_and_length(height, turn):
    found = lattice_of(circle(2000, height, turn=turn))
    assert abs(abs(found.height) - abs(height)) < 1e-6
    np.testing.assert_allclose(np.array(found.axes) @ np.array(found.axes).T, np.eye(3), atol=1e-9)


def test_what_is_no_cut_or_sparse_has_none():
    assert lattice_of(cr.fibonacci_directions(100_000)) is None
    assert lattice_of(cr.fibonacci_directions(500)) is None
    assert lattice_of(circle(60)) is None
    assert lattice_of(circle(12, turn=0.01)) is None


def test_levels_are_as_fine_as_the_incidences_are_dense():
    few, many = lattice_of(circle(720)), lattice_of(circle(14_400))
    assert many.levels > few.levels >= 1
    for found, count in ((few, 720), (many, 14_400)):
        spacing = 2 * np.pi / count
        assert found.step(found.levels - 1) >= 0.9 * CROWDED * spacing > found.step(found.levels - 1) / 4


@pytest.mark.parametrize("level", [0, 2])
def test_directions_are_those_of_their_places(level):
    given = circle(3000, 0.4)
    lattice = lattice_of(given)
    cells, places = lattice.located(given, level)
    assert np.all((places >= 0) & (places < 1))
    nodes = lattice.directions(cells, level)
    far = lattice.directions(cells + 1, level)
    np.testing.assert_allclose(np.linalg.norm(nodes, axis=1), 1, atol=1e-14)
    apart = np.linalg.norm(given - nodes, axis=1)
    assert np.all(apart <= np.linalg.norm(far - nodes, axis=1) + 1e-12)
    assert apart.max() < 1.5 * lattice.spacing(level)
    # an incidence on a node has it as its own
    on, at = lattice.located(nodes, level)
    on = on + np.round(at).astype(int)
    assert np.abs(at - np.round(at)).max() < 1e-9
    np.testing.assert_allclose(lattice.directions(on, level), nodes, atol=1e-9)


def test_a_cut_closes_after_a_turn():
    lattice = lattice_of(circle(3000))
    first, last = np.array([0]), np.array([96 * 2])
    np.testing.assert_allclose(lattice.directions(first, 1), lattice.directions(last, 1), atol=1e-12)
    assert np.array_equal(lattice.wrapped(last, 1), first)


def test_weights_give_polynomials_and_their_errors_none():
    places = np.random.default_rng(1).random(50)
    six, errors = weights(places)
    for power in range(6):
        values = NODES.astype(float) ** power
        np.testing.assert_allclose(combined(six, values), places**power, atol=1e-11)
        if power <= 3:
            assert max(np.abs(combined(one, values)).max() for one in errors) < 1e-11
