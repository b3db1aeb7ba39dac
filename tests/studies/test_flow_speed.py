"""The tables of costs say what they claim: rows, errors beside them, tolerances met; never how fast."""

import math

import pytest

from studies.cost import flow_speed

ELLIPSOID = ("ellipsoid",)


@pytest.mark.slow
def test_long_leaps_compare_equal_errors():
    (row,) = flow_speed.long_leaps(ELLIPSOID, count=64, samples=100)
    assert row["body"] == "ellipsoid"
    for flow in ("map", "order 8", "scipy"):
        assert row[flow] > 0 and 0 < row[f"{flow} error"] <= 1e-6
    assert row["pencils"] > 0
    assert row["T0"] > 0 and row["MB"] > 0 and row["grid"].startswith("1x1x")


def test_break_even_needs_a_map_that_is_faster():
    rows = list(flow_speed.break_even(ELLIPSOID, tuned=(1e6,), count=64))
    assert [row["tuned for"] for row in rows] == [1e6]
    for row in rows:
        assert 0 < row["map error"] <= 1e-6
        # equal steps that meet the error on other rays
        assert row["order 8 error"] <= 2 * row["map error"]
        assert row["build s"] > 0
        assert (row["rays"] == math.inf) == (row["order 8"] <= row["map"])
