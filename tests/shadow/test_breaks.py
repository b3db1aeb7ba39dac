"""Crossings of plane curves and rays of arcs: the kernel against all pairs of segments, shares against a plain rule."""

import numpy as np
import pytest
from scipy.interpolate import BarycentricInterpolator

from creeping.shadow.arcs import breaks_of, shared_out
from creeping.shadow.curves import Curves, LineNodes, interpolated
from creeping.shadow.kernels.crossings import crossings


def curve(rng, nodes, waves=4):
    """A smooth closed curve that may cross itself: (nodes, 2)."""
    t = 2 * np.pi * np.arange(nodes) / nodes
    z = sum(rng.normal() * np.exp(1j * (k * t + rng.uniform(0, 6))) / k for k in range(1, waves + 1))
    return np.stack([z.real, z.imag], axis=1)


def all_pairs(seen, first, number):
    """Pairs of segments that cross, each by its first node."""
    after = np.concatenate([f + (np.arange(n) + 1) % n for f, n in zip(first, number, strict=True)])
    i, m = np.nonzero(np.tri(len(seen), k=-1))
    j, n = after[i], after[m]

    def left(a, b, c):
        u, v = seen[b] - seen[a], seen[c] - seen[a]
        return u[:, 0] * v[:, 1] > u[:, 1] * v[:, 0]

    hit = (left(i, j, m) != left(i, j, n)) & (left(m, n, i) != left(m, n, j))
    hit &= (i != m) & (i != n) & (j != m) & (j != n)
    return {(int(a), int(b)) for a, b in zip(m[hit], i[hit], strict=True)}


def test_crossings_are_those_of_all_pairs(rng):
    lines = [[curve(rng, int(n)) for n in rng.integers(8, 60, size=rng.integers(1, 4))] for _ in range(40)]
    curves = [one for line in lines for one in line]
    number = np.array([len(one) for one in curves])
    first = np.cumsum(number) - number
    line = np.repeat(np.arange(len(lines)), [len(one) for one in lines])
    seen, found, hits = np.concatenate(curves), np.empty((len(lines), 500, 2), np.int64), np.empty(len(lines), np.int64)
    crossings(seen, first, number, line, found, hits)
    for row in range(len(lines)):
        own = line == row
        got = {tuple(sorted(pair)) for pair in found[row, : hits[row]].tolist()}
        assert len(got) == hits[row]
        start, end = first[own][0], first[own][-1] + number[own][-1]
        alone = all_pairs(seen[start:end], first[own] - start, number[own])
        assert got == {(a + start, b + start) for a, b in alone}
    assert hits.sum() > 100


def test_more_crossings_than_there_is_room_for_are_counted(rng):
    seen = rng.normal(size=(64, 2))
    found, hits = np.full((1, 3, 2), -1), np.empty(1, np.int64)
    crossings(seen, np.array([0]), np.array([64]), np.array([0]), found, hits)
    assert hits[0] == len(all_pairs(seen, [0], [64])) > 3
    assert np.all(found >= 0)


@pytest.mark.parametrize("wanted", [1, 2, 7, 100])
def test_rays_of_arcs_add_up_and_none_goes_without(wanted, rng):
    for count in (1, 2, 5, 9):
        lengths = rng.exponential(size=count)
        rays = shared_out(lengths, wanted)
        assert rays.sum() == wanted
        assert np.all(rays >= 1) or count > wanted
        if count <= wanted:
            assert np.all(np.abs(rays - np.maximum(lengths / lengths.sum() * wanted, 1)) < count)


def test_a_place_between_nodes_is_that_of_the_polynomial_and_alone_or_not(rng):
    t = 2 * np.pi * np.arange(48) / 48
    rows = np.stack([np.cos(t), np.sin(3 * t)], axis=1)
    places = rng.uniform(-50, 100, 200)
    found = interpolated(rows, 0, 48, places)
    at = 2 * np.pi * places / 48
    np.testing.assert_allclose(found, np.stack([np.cos(at), np.sin(3 * at)], axis=1), atol=3e-6)
    np.testing.assert_array_equal(found[17:18], interpolated(rows, 0, 48, places[17:18]))


def test_a_cusp_at_a_node_is_there():
    n = 64
    turn = 2 * np.pi * np.arange(n) / n
    circle = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    tangents = np.stack([-np.sin(turn), np.cos(turn), 0 * turn], axis=1)
    kappa = np.cos(turn)
    kappa[[16, 48]] = 0.0
    nodes = LineNodes(circle, tangents, kappa, np.array([0, n]), np.array([2 * np.pi / n]), 0.0)
    found = breaks_of(Curves.of(np.array([[0.0, 0.0, 1.0, 0.0]]), [nodes]), np.array([[-1.0] * 3, [1.0] * 3]))
    np.testing.assert_allclose(found.place, [16, 48], atol=1e-9)


@pytest.mark.parametrize("place", [0.3, 4.0, 5.99, 12.5, -3.7, 27.2])
def test_between_nodes_is_the_polynomial_through_the_twelve_around(place, rng):
    rows, first, number = rng.normal(size=(40, 3)), 7, 13
    nodes = np.floor(place) + np.arange(-5, 7)
    wanted = BarycentricInterpolator(nodes, rows[first + nodes.astype(int) % number])(place)
    assert np.allclose(interpolated(rows, first, number, np.array([place]))[0], wanted, rtol=0, atol=1e-12)
