"""Lattices follow from the incidences: what they lie on, how dense they are, and nothing else."""

import numpy as np
import pytest

import creeping as cr
from creeping.sweeping.between.stencil import offsets, weights
from creeping.sweeping.lattice import CROWDED, Lattice, lattice_of
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
    assert found.dimensions == 1
    assert abs(abs(found.height) - abs(height)) < 1e-6
    np.testing.assert_allclose(np.array(found.axes) @ np.array(found.axes).T, np.eye(3), atol=1e-9)


def test_what_is_no_cut_lies_on_the_sphere_and_what_is_sparse_on_nothing():
    assert lattice_of(cr.fibonacci_directions(100_000)).dimensions == 2
    assert lattice_of(cr.fibonacci_directions(500)) is None
    assert lattice_of(circle(60)) is None
    assert lattice_of(circle(12, turn=0.01)) is None


def test_levels_are_as_fine_as_the_incidences_are_dense():
    few, many = lattice_of(circle(720)), lattice_of(circle(14_400))
    assert many.levels > few.levels >= 1
    for found, count in ((few, 720), (many, 14_400)):
        spacing = 2 * np.pi / count
        assert found.step(found.levels - 1) >= 0.9 * CROWDED * spacing > found.step(found.levels - 1) / 4


@pytest.mark.parametrize("lattice", [lattice_of(circle(3000, 0.4)), Lattice((), 0.0, 3, 10.0)], ids=["cut", "sphere"])
@pytest.mark.parametrize("level", [0, 2])
def test_directions_are_those_of_their_places(lattice, level):
    given = circle(3000, 0.4) if lattice.axes else cr.fibonacci_directions(3000)
    cells, places = lattice.located(given, level)
    assert np.all((places >= 0) & (places < 1))
    nodes = lattice.directions(cells, level)
    after = cells.copy()
    after[:, 1:] += 1
    far = lattice.directions(after, level)
    np.testing.assert_allclose(np.linalg.norm(nodes, axis=1), 1, atol=1e-14)
    apart = np.linalg.norm(given - nodes, axis=1)
    assert np.all(apart <= np.linalg.norm(far - nodes, axis=1) + 1e-12)
    assert apart.max() < 1.5 * lattice.spacing(level)
    # an incidence on a node has it as its own
    on, at = lattice.located(nodes, level)
    on[:, 1:] += np.round(at).astype(int)
    assert np.abs(at - np.round(at)).max() < 1e-9
    np.testing.assert_allclose(lattice.directions(on, level), nodes, atol=1e-9)


def test_a_cut_closes_after_a_turn():
    lattice = lattice_of(circle(3000))
    first, last = np.array([[0, 0]]), np.array([[0, 96 * 2]])
    np.testing.assert_allclose(lattice.directions(first, 1), lattice.directions(last, 1), atol=1e-12)
    assert np.array_equal(lattice.wrapped(last, 1), first)


@pytest.mark.parametrize("dimensions", [1, 2])
def test_weights_give_polynomials_and_their_errors_none(dimensions):
    rng = np.random.default_rng(1)
    places, nodes = rng.random((50, dimensions)), offsets(dimensions)
    six, errors = weights(places)
    for powers in np.ndindex(*[6] * dimensions):
        values = np.prod(nodes.astype(float) ** powers, axis=1)
        np.testing.assert_allclose(combined(six, values), np.prod(places**powers, axis=1), atol=1e-11)
        if max(powers) <= 3:
            assert max(np.abs(combined(one, values)).max() for one in errors) < 1e-11


def test_incidences_of_a_cell_follow_each_other():
    directions = cr.fibonacci_directions(20_000)
    lattice = lattice_of(directions)
    order = lattice.order(directions)
    assert np.array_equal(np.sort(order), np.arange(20_000))
    for level in range(lattice.levels):
        cells = lattice.located(directions[order], level)[0]
        changes = np.count_nonzero(np.any(np.diff(cells, axis=0), axis=1))
        assert changes == len(np.unique(cells, axis=0)) - 1
