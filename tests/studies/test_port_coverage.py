"""The study of couplings: its table's headline numbers on the sphere, and a small run of its ellipsoids."""

import pytest

from studies.port_coverage import ellipsoid_rows, sphere_row


def test_sphere():
    row = sphere_row(30.0)
    assert row.worst < 0.006 and row.covered > 0.95


@pytest.mark.slow
def test_ellipsoid_is_covered():
    rows = ellipsoid_rows((0.9, 0.8, 1.0), 10.0, 0.25, 3, sources=2, points=40)
    assert {row.part for row in rows} <= {"rays", "beams"}
    assert sum(row.pairs * row.covered for row in rows) > 0.95 * sum(row.pairs for row in rows)
