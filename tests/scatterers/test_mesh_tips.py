"""Meshes of bodies with a tip: what is not known about it, and rays that come there."""

from types import SimpleNamespace

import numpy as np
import pytest
from body_checks import rms

import creeping as cr
import scatterers as sc
from creeping.geometry.surface import normal, project, size
from studies._meshes import almond, geodesic_sphere


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


@pytest.mark.slow
def test_almond():
    vertices, triangles = almond(40000)
    with pytest.raises(ValueError, match="not smooth enough"):
        sc.Mesh(as_mesh(vertices, triangles), strict=True, cache=False)
    # folded too sharply along its rim for one F
    body = sc.Mesh(as_mesh(vertices, triangles), cache=False)
    assert len(body.pieces) > 1 and {crease.kind for crease in body.creases} == {"edge", "seam"}
    assert all(crease.points[:, 0].min() > 0.45 for crease in body.creases if crease.angle > np.radians(40))
    assert body.non_smooth(vertices[-1]) and not body.non_smooth(vertices[0])
    x = vertices[:, 0]
    assert body.non_smooth(vertices[x > 0.57]).all()
    # the closed form of MESH.md, 1.3: y^2 + 9 z^2 = A(x)
    blunt = project(body, vertices[x < -0.05])
    across = (0.193333 * np.sqrt(np.maximum(1 - (blunt[:, 0] / 0.416667) ** 2, 0))) ** 2
    off = np.abs(blunt[:, 1] ** 2 + 9 * blunt[:, 2] ** 2 - across) / np.maximum(np.sqrt(across), 0.02)
    assert rms(off) < 1e-5
    assert not body.non_smooth(vertices[np.abs(x) < 0.2]).any()
    line = cr.shadow_line(body, (1.0, 0.2, 0.3))
    fan = cr.launch(cr.DirectFlow(body), line, length=size(body), n_rays=32, n_steps=50)
    assert not np.any(fan.status == cr.RayStatus.DETACHED)
    ended = np.isin(fan.status, (cr.RayStatus.NON_SMOOTH, cr.RayStatus.EDGE))
    furthest = fan.points[..., 0].max(axis=1)
    # the chains of the tip are edges since it is a body of pieces
    assert ended.any() and np.all(furthest[ended] > 0.4)
    # closer to it a ray goes on only where it is that of the almond in closed form
    exact = cr.DirectFlow(sc.Almond(1.0), rtol=1e-10)
    on = np.flatnonzero((fan.status == cr.RayStatus.OK) & (furthest > 0.5))
    assert len(on) < 0.2 * np.sum(furthest > 0.5)
    for ray in on:
        start = project(exact.body, fan.points[ray, :1])[0]
        n, p = normal(exact.body, start), fan.directions[ray, 0]
        p = (p - n * (n @ p)) / np.linalg.norm(p - n * (n @ p))
        end = exact.flow(start, p, float(fan.travel_time[-1]))[0]
        np.testing.assert_allclose(fan.points[ray, -1], end, atol=3e-3)
