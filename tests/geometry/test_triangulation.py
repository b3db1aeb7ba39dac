"""Triangulations of F = 0: grids that are tried in turn."""

import numpy as np
import pytest
import shared_bodies as sc

from creeping.errors import SurfaceError
from creeping.geometry import triangulation
from creeping.geometry.triangulation import triangulate


def test_other_grids_are_tried_where_finer_ones_would_be_too_many(monkeypatch):
    ball, tried, unclosed = sc.Sphere(), [], triangulation._unclosed
    monkeypatch.setattr(triangulation, "MAX_POINTS", 50_000)

    def second_of_others(tiles):
        tried.append(len(tiles))
        return unclosed(tiles) if len(tried) == 3 else np.array([0])

    monkeypatch.setattr(triangulation, "_unclosed", second_of_others)
    mesh = triangulate(ball, cells=40)
    assert mesh.euler_characteristic == 2 and tried[0] > tried[1] > tried[2]
    monkeypatch.setattr(triangulation, "_unclosed", lambda tiles: np.array([0, 7]))
    with pytest.raises(SurfaceError, match=r"grid points do not resolve the surface at 2 places, the first near \("):
        triangulate(ball, cells=40)


def test_places_where_a_surface_does_not_close_are_told():
    """Of two cubes that touch along an edge: its ends."""
    cube = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
    assert len(triangulation._unclosed(cube)) == 0
    assert triangulation._unclosed(cube[1:]).tolist() == [0, 1, 2]
    other = np.where(cube == 0, 2, np.where(cube == 4, 6, cube + 8))
    assert triangulation._unclosed(np.concatenate([cube, other])).tolist() == [2]
