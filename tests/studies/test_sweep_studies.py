"""The tables of sweeps say what they claim: references beside costs, errors within what was asked; never how fast."""

import numpy as np
import pytest
from tolerances import FRACTION, LINE_LENGTH

from creeping.geometry.directions import fibonacci_directions
from creeping.shadow.status import FOLLOWED
from studies import figure_bistatic_map as bistatic
from studies import sweep_between, sweep_lines, sweep_speed


def test_lines_agree_with_both_references():
    (cost,), (finest,), (panels,) = sweep_lines.tables(("peanut",), count=60, every=10).values()
    assert cost["ok"] + cost["near singular"] + cost["followed one by one"] == 60
    assert cost["need mesh 3"] <= cost["need mesh 2"] < 30
    assert cost["curves seen"] == "1 3"
    assert finest["compared"] + cost["followed one by one"] >= 60 and panels["compared"] == 6
    for row in (finest, panels):
        assert row["counts differ"] == 0
        # a sweep promises the length to 2e-6 at worst, and reaches what the tests ask elsewhere
        assert row["length"] < 10 * LINE_LENGTH
        assert max(row[share] for share in sweep_lines.SHARES) < 10 * FRACTION


def test_a_line_that_differs_is_counted():
    directions = fibonacci_directions(6)
    lines = sweep_lines.on_mesh(sweep_lines.BODIES["ellipsoid"], directions, 0)
    assert not np.any(lines.status == FOLLOWED)
    other = lines._replace(curves=lines.curves + 1, length=lines.length * 1.01)
    found = sweep_lines.differences(lines, other)
    assert found["counts differ, all"] == 6
    assert found["length, all"] == pytest.approx(0.01 / 1.01)


def test_fans_carry_their_errors():
    rows = sweep_speed.fans(("ellipsoid",), count=8, checked=4)
    assert [row["flow"] for row in rows] == ["map", "map", "order 8", "order 8"]
    for row in rows:
        assert row["per s"] > 0 and row["line us"] > 0
        assert 0 < row["points"] < row["for"]
        assert max(row["J"], row["att."]) < 3 * row["for"]


@pytest.mark.slow
def test_fields_are_compared_with_one_by_one():
    rows = sweep_speed.fields(("ellipsoid",), count=32, checked=2)
    assert [row["flow"] for row in rows] == ["order 8", "map"]
    for row in rows:
        # found 2026-11-21: a shed ray that two cells find is counted once
        assert row["off"] == 0
        assert row["checked"] == 2 and row["unresolved"] == 0 == row["status > 0"]
        assert row["creeping, median"] < 1e-3 and row["reflected, median"] < 1e-6


def test_scipy_errs_no_more_than_the_sweep():
    (row,) = sweep_speed.against_scipy(("ellipsoid",), count=8, lines=1, rays=2)
    assert 0 < row["scipy error"] <= row["error"] < 1e-4
    assert row["ratio"] > row["ratio of rays"] > 0


@pytest.mark.slow
@pytest.mark.parametrize(("quantity", "first", "last"), [("rays", 0, 300), ("fields", 90, 220)])
def test_interpolated_sweeps_are_compared_with_computed_ones(quantity, first, last):
    """Echoes of a spheroid from between its waist and its ends: there rays merge, and echoes are no sum of sheets."""
    found = sweep_between.row("ellipsoid", quantity, sweep_between.cut(1200, sweep_between.TILTED)[first:last], 16)
    assert found["interpolated"] == 1 and found["between per s"] > 0 and found["computed per s"] > 0
    assert max(value for name, value in found.items() if "%" in name) < 1e-2


def test_exponents_are_fitted():
    row = sweep_speed._power("size", (1, 10, 100, 1000), [2.0, 20.0, 200.0, 2000.0])
    assert row["exponent"] == pytest.approx(1) and row["of the upper half"] == pytest.approx(1)


def test_reciprocity_finds_what_is_not():
    n, m = 6, 18
    alpha, beta = (np.arange(n) + 0.5) * 2 * np.pi / n, (np.arange(m) + 0.5) * 2 * np.pi / m
    # f of d and r alike in (d, r) and (-r, -d)
    even = np.cos(alpha[:, None] - beta) + 2j + 0.3 * (np.cos(alpha)[:, None] - np.cos(beta))
    everywhere = np.ones(even.shape, dtype=bool)
    found = bistatic.reciprocity(even, everywhere)
    assert found["pairs"] == n * (n - 1) / 2 and found["unresolved"] == 0
    assert found["largest_over_largest"] < 1e-12
    odd = even + 0.1 * (np.cos(alpha)[:, None] + np.cos(beta))
    assert bistatic.reciprocity(odd, everywhere)["median_relative"] > 0.01


def test_backscatter_is_its_own_reciprocal():
    """Pairs that are their own partners are those with r = -d."""
    own = np.arange(64).reshape(8, 8)
    i, j = np.nonzero(bistatic.reciprocal(own) == own)
    np.testing.assert_array_equal((i + 4) % 8, j)
