"""What must hold on every body: properties of flow and symmetries of field, on the same random cases each time."""

import pytest

from tests.fuzz import invariants


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(n, marks=pytest.mark.slow if n in ("rays stay unit tangents", "maps are flows") else ())
        for n in invariants.PROPERTIES
    ],
)
def test_it_holds(name):
    invariants.checked(name, 1 if "field" in name else 3)


def test_a_field_that_misses_its_error_is_seen(monkeypatch):
    real = invariants.field

    def wrong(body, d, r, k, boundary):
        value, error = real(body, d, r, k, boundary)
        return value + 3 * (1 + d[0]) * error, 0.5 * error

    monkeypatch.setattr(invariants, "field", wrong)
    with pytest.raises(AssertionError):
        invariants.checked("fields are reciprocal", 2)


def test_a_flow_that_drifts_is_seen(monkeypatch):
    monkeypatch.setattr(invariants, "RTOL", 1e-4)
    with pytest.raises(AssertionError):
        invariants.checked("flows compose", 8)
