"""The tables of sweeps say what they claim: references beside costs, errors within what was asked; never how fast."""

import numpy as np
import pytest
from tolerances import FRACTION, LINE_LENGTH

from studies.cost import sweep_speed
from studies.figures import sweeps


def test_lines_agree_with_their_reference():
    (cost,), (panels,) = sweep_speed.lines(("peanut",), count=60), sweep_speed.panels(("peanut",), count=60, every=10)
    assert cost["ok"] + cost["near singular"] + cost["followed one by one"] == 60
    assert cost["curves seen"] == "1 3"
    assert panels["compared"] == 6 and panels["counts differ"] == 0
    # a sweep promises the length to 2e-6 at worst, and reaches what the tests ask elsewhere
    assert panels["length"] < 10 * LINE_LENGTH
    assert max(panels[share] for share in sweep_speed.STATUSES) < 10 * FRACTION


@pytest.mark.slow
def test_fans_carry_their_errors():
    rows = list(sweep_speed.fans(("ellipsoid",), count=8, checked=4))
    assert [row["flow"] for row in rows] == ["map", "map", "order 8", "order 8"]
    for row in rows:
        assert row["per s"] > 0 and row["line us"] > 0
        assert 0 < row["points"] < row["for"]
        assert max(row["J"], row["att."]) < 3 * row["for"]


def test_reciprocity_finds_what_is_not():
    n, m = 6, 18
    alpha, beta = (np.arange(n) + 0.5) * 2 * np.pi / n, (np.arange(m) + 0.5) * 2 * np.pi / m
    # f of d and r alike in (d, r) and (-r, -d)
    even = np.cos(alpha[:, None] - beta) + 2j + 0.3 * (np.cos(alpha)[:, None] - np.cos(beta))
    everywhere = np.ones(even.shape, dtype=bool)
    found = sweeps.reciprocity(even, everywhere)
    assert found["pairs"] == n * (n - 1) / 2 and found["unresolved"] == 0
    assert found["largest_over_largest"] < 1e-12
    odd = even + 0.1 * (np.cos(alpha)[:, None] + np.cos(beta))
    assert sweeps.reciprocity(odd, everywhere)["median_relative"] > 0.01
