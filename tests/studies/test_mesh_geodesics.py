"""Geodesics on a mesh: the fitted body is far better than unfolded triangles."""

import pytest

from studies.accuracy import fitted_bodies


@pytest.mark.slow
def test_the_fitted_body_is_a_hundred_times_more_exact():
    (row,) = fitted_bodies.geodesics(("ellipsoid",), (2000,))
    assert row["fitted 95 %"] < 1e-5
    if "unfolded" in row:
        pytest.skip("potpourri3d is not installed")
    assert 1e-3 < row["unfolded median"] < 1e-2
    assert row["unfolded median"] > 100 * row["fitted median"]
