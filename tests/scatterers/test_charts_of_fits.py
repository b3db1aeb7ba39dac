"""Charts of fitted bodies that are not star-shaped: made when they are asked for, and kept with the fit."""

from types import SimpleNamespace

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.geodesics.equations import natural_horizon
from tests.exact_meshes import torus_grid


def torus(folder):
    points, triangles = torus_grid(1000)
    return sc.Mesh(SimpleNamespace(vertices=points, faces=triangles), cache=folder)


def stored(folder):
    (path,) = folder.iterdir()
    return path.stat().st_size


@pytest.mark.slow
def test_rays_make_no_charts(tmp_path):
    body = torus(tmp_path)
    without = stored(tmp_path)
    line = cr.shadow_line(body, (0.3, 0.5, 0.8))
    fan = cr.launch(cr.DirectFlow(body), line, length=1.0, n_rays=8, max_gap=np.inf)
    assert np.all(np.isfinite(fan.points)) and stored(tmp_path) == without


@pytest.mark.slow
def test_charts_are_made_and_kept_when_they_are_asked_for(tmp_path):
    body = torus(tmp_path)
    without = stored(tmp_path)
    charts = body.atlas.arrays()
    assert stored(tmp_path) > without
    again = torus(tmp_path)
    assert again.fit == body.fit
    for name, array in again.atlas.arrays().items():
        np.testing.assert_array_equal(array, charts[name])
    # rays do not depend on whether they are there
    assert natural_horizon(again) == natural_horizon(body)
