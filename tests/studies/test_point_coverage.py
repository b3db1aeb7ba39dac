"""What the studies of coverage at points share: shares of known numbers, cases and the table."""

from types import SimpleNamespace

import numpy as np
import pytest

from studies import _point_coverage as shared


def test_shares_of_known_errors():
    """True errors 1 to 10; stated 5.5 everywhere: half are covered, and one more by the reference's own error."""
    true = np.arange(1.0, 11.0)
    field = SimpleNamespace(ok=np.ones(10, dtype=bool), error=np.full(10, 5.5))
    asked = {"unit": 2.0, "quantile": 0.5}
    found = shared.coverage("lit", true, field, field.ok, residual=0.0, **asked)
    assert found["lit"] == 50 and found["lit error"] == pytest.approx(100 * 5.5 / 2)
    assert found["lit ratio"] == pytest.approx(0.5 * (5.5 / 5 + 5.5 / 6))
    assert shared.coverage("lit", true, field, field.ok, residual=1.0, **asked)["lit"] == 60
    # what is not OK has no share, and a part without points is not a number
    field.ok[:5] = False
    assert shared.coverage("lit", true, field, true > 0, residual=0.0, **asked)["lit"] == 0
    assert all(np.isnan(v) for v in shared.coverage("lit", true, field, true < 3, residual=0.0, **asked).values())


def test_parts_are_all_points_and_each_is_of_one():
    rng = np.random.default_rng(1)
    fan = shared.random_fan("sphere", rng)
    d = fan.line.direction
    points, on, normals, axis = shared.places("sphere", d, rng)
    close = np.linalg.norm(points, axis=1) < 1.1
    parts = shared.parts_off(fan, points, axis, close)
    assert np.all(sum(part.astype(int) for part in parts.values()) == 1)
    # behind the unit ball: within the cylinder of its outline
    along = points @ d
    dark = (along > 0) & (np.linalg.norm(points - along[:, None] * d, axis=1) < 1)
    np.testing.assert_array_equal(parts["shadow"] | parts["axis"], dark & ~close)
    np.testing.assert_array_equal(shared.bright(fan, on, normals), on @ d < 0)
    both = shared.parts_off(fan, points, axis, np.stack([close, close], axis=1))
    assert all(np.array_equal(both[name], np.stack([part, part], axis=1)) for name, part in parts.items())


def test_cases_have_seeds_of_their_own():
    every = list(shared.cases(("a", "b"), ("soft", "hard"), (10.0, 20.0), quick=False))
    assert len(every) == 8 and every[0] == (10, ("a", "soft", 10.0)) and every[-1] == (120, ("b", "hard", 20.0))
    assert [case for _, case in shared.cases(("a", "b"), ("soft", "hard"), (10.0, 20.0), quick=True)] == [
        ("a", "soft", 10.0),
        ("a", "hard", 10.0),
    ]
