"""Directions of sweeps: unit norms, round trips, quadrature against known integrals, and bad input."""

import numpy as np
import pytest

from creeping import InvalidInputError
from creeping.geometry import directions as dirs


def harmonics(d):
    """Functions on the sphere whose integrals are known: 4 pi/3, 4 pi/5, 4 pi/105, 0 and 0."""
    x, y, z = d.T
    return [z**2, x**4, x**2 * y**2 * z**2, x * y, z**3]


INTEGRALS = np.pi * np.array([4 / 3, 4 / 5, 4 / 105, 0, 0])


@pytest.mark.parametrize("pair", ["angles", "azimuth_elevation"])
def test_angles_there_and_back(pair, rng):
    d = rng.normal(size=(500, 3))
    # a pole and its neighbourhood, where arccos would lose digits
    d[0], d[1] = (0, 0, 1), (1e-9, 0, -1)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    of = dirs.angles_of if pair == "angles" else dirs.azimuth_elevation_of
    back = getattr(dirs, f"directions_from_{pair}")(*of(7 * d))
    assert np.abs(back - d).max() < 1e-15
    # elevation is measured from the plane and theta from z
    d = dirs.directions_from_azimuth_elevation(0.3, 0.2)
    assert dirs.angles_of(d) == pytest.approx((np.pi / 2 - 0.2, 0.3), abs=1e-15)


@pytest.mark.parametrize("rule", [lambda: dirs.lebedev_directions(17), lambda: dirs.theta_phi_grid(9, 8)])
def test_weights_integrate_polynomials(rule):
    d, weights = rule()
    assert np.abs(np.linalg.norm(d, axis=1) - 1).max() < 1e-15
    assert weights.sum() == pytest.approx(4 * np.pi, rel=1e-14)
    assert np.array([weights @ f for f in harmonics(d)]) == pytest.approx(INTEGRALS, abs=1e-13)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_the_smallest_grids_integrate_what_they_can(n):
    _, weights = dirs.theta_phi_grid(n, 1)
    # Fejer's first rule of 1, 2 and 3 points
    known = {1: [2], 2: [1, 1], 3: [4 / 9, 10 / 9, 4 / 9]}[n]
    assert weights == pytest.approx(2 * np.pi * np.array(known), rel=1e-14)
    # a large one needs no memory but its own
    d, weights = dirs.theta_phi_grid(200_000, 1)
    assert len(d) == 200_000 and weights.sum() == pytest.approx(4 * np.pi, rel=1e-12)
    sizes = [len(dirs.lebedev_directions(order)[0]) for order in dirs.LEBEDEV_ORDERS]
    assert sizes[:4] == [6, 14, 26, 38] and sizes[-1] == 5810


def test_fibonacci_directions_are_even():
    d = dirs.fibonacci_directions(2000)
    assert np.abs(np.linalg.norm(d, axis=1) - 1).max() < 1e-15
    means = [4 * np.pi * f.mean() for f in harmonics(d)]
    assert np.array(means) == pytest.approx(INTEGRALS, abs=2e-3)
    nearest = np.sort(d @ d.T, axis=1)[:, -2]
    # the hexagonal lattice of this density has neighbours sqrt(8 pi/(sqrt(3) n)) apart; Fibonacci's come to 0.8 of it
    apart = np.arccos(nearest) / np.sqrt(8 * np.pi / (np.sqrt(3) * 2000))
    assert apart.min() > 0.7


def test_a_great_circle_stays_in_its_plane_at_equal_angles():
    first, through = np.array([1.0, 2.0, 3.0]), np.array([-1.0, 0.5, 0.2])
    d = dirs.great_circle(first, through, 12)
    assert np.abs(d @ np.cross(first, through)).max() < 1e-15
    assert np.einsum("ij,ij->i", d, np.roll(d, -1, axis=0)) == pytest.approx(np.cos(np.pi / 6), abs=1e-15)
    assert d[0] == pytest.approx(first / np.linalg.norm(first)) and d[1] @ through > d[-1] @ through
    half = dirs.great_circle((0, 0, 1), (1, 0, 0), 3, stop=np.pi, endpoint=True)
    assert half == pytest.approx(np.array([[0, 0, 1], [1, 0, 0], [0, 0, -1]]), abs=1e-15)


def test_unit_directions_keep_their_bits_and_scale_does_not_matter():
    d = dirs.fibonacci_directions(300)
    once = dirs.unit_directions(d)
    assert np.array_equal(dirs.unit_directions(once), once)
    assert np.abs(dirs.unit_directions(1e-200 * d) - d).max() < 1e-15
    assert np.abs(dirs.unit_directions(1e200 * d) - d).max() < 1e-15


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: dirs.unit_directions([[0, 0, 1], [0, 0, 0], [1, 0, 0]]), "1 of 3 directions is zero .rows 1"),
        (
            lambda: dirs.unit_directions([[np.nan, 0, 1]] * 7),
            "7 of 7 directions are not finite .rows 0, 1, 2, 3, 4",
        ),
        (lambda: dirs.unit_directions([1.0, 2.0]), r"shape \(2,\)"),
        (lambda: dirs.unit_directions("north"), "not an array of numbers"),
        (lambda: dirs.lebedev_directions(4), "none of Lebedev's: 3, 5"),
        (lambda: dirs.fibonacci_directions(0), "n = 0 is not a whole number"),
        (lambda: dirs.theta_phi_grid(10**6, 10**6), "n_theta n_phi = 1000000000000"),
        (lambda: dirs.great_circle((0, 0, 1), (0, 0, -2), 5), "parallel"),
        (lambda: dirs.directions_from_angles([0, np.inf], 0), "1 of 2 values of theta are not finite"),
        (lambda: dirs.directions_from_angles([0, 1], [0, 1, 2]), "theta .2,., phi .3,."),
    ],
)
def test_bad_input_is_named(call, words):
    with pytest.raises(InvalidInputError, match=words):
        call()
