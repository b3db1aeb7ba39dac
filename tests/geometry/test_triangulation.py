"""Triangulations of F = 0: grids that are tried in turn."""

import pytest

import scatterers as sc
from creeping.errors import SurfaceError
from creeping.geometry import triangulation
from creeping.geometry.triangulation import triangulate


def test_other_grids_are_tried_where_finer_ones_would_be_too_many(monkeypatch):
    ball, tried, closed = sc.Sphere(), [], triangulation._closed
    monkeypatch.setattr(triangulation, "MAX_POINTS", 50_000)

    def second_of_others(tiles):
        tried.append(len(tiles))
        return len(tried) == 3 and closed(tiles)

    monkeypatch.setattr(triangulation, "_closed", second_of_others)
    mesh = triangulate(ball.level, ball.gradient, ball.bounds, cells=40)
    assert mesh.euler_characteristic == 2 and tried[0] > tried[1] > tried[2]
    monkeypatch.setattr(triangulation, "_closed", lambda tiles: False)
    with pytest.raises(SurfaceError, match="grid points do not resolve the surface"):
        triangulate(ball.level, ball.gradient, ball.bounds, cells=40)
