"""Meshes of bodies with a tip: what is not known about it, and rays that come there."""

from types import SimpleNamespace

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from tests.exact_meshes import geodesic_sphere


def as_mesh(vertices, triangles):
    return SimpleNamespace(vertices=vertices, faces=triangles)


def drop():
    """A body of revolution about x, round at one end, with a tip of 45 degrees at the other: t the angle from x."""
    s, triangles = geodesic_sphere(2000)
    t = np.arctan2(np.linalg.norm(s[:, 1:], axis=1, keepdims=True), s[:, :1])
    return np.concatenate([s[:, :1], s[:, 1:] * np.sin(t / 2)], axis=1), triangles


@pytest.mark.slow
def test_the_non_smooth_region_is_at_the_tip_only():
    body = sc.Mesh(as_mesh(*drop()), cache=False)
    points = drop()[0]
    non_smooth, x = body.non_smooth(points), points[:, 0]
    assert body.non_smooth(np.array([1.0, 0, 0])) and non_smooth[x > 0.98].all()
    assert not non_smooth[x < 0.5].any()
    assert non_smooth.mean() < 0.2
    # or an incidence on it would be compared with rays that go on
    np.testing.assert_array_equal(body.coarse_fit.non_smooth(points), non_smooth)
    line = cr.shadow_line(body, (1.0, 0.02, 0.01))
    fan = cr.launch(cr.DirectFlow(body), line, length=2.5, n_rays=32, n_steps=50, max_gap=np.inf)
    meets = np.array([body.non_smooth(ray).any() for ray in fan.points])
    # all of them go about the tip, and end where it begins
    assert meets.mean() > 0.5
    np.testing.assert_array_equal(fan.status == cr.RayStatus.NON_SMOOTH, meets)
    back = cr.launch(
        cr.DirectFlow(body), cr.shadow_line(body, (-1.0, 0.02, 0.01)), length=1.0, n_rays=32, n_steps=50, max_gap=np.inf
    )
    assert np.all(back.status == cr.RayStatus.OK)
