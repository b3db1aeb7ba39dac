"""Cones of meshes: one exact piece up to the tip, however much triangles turn there."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

import creeping as cr
import scatterers as sc
from scatterers.triangles.topology import cleaned

RADIUS, HEIGHT = 0.7, 1.5
SLANT = np.hypot(RADIUS, HEIGHT)


@cache
def cone():
    """Rings with about as many vertices as their radii ask for, by the convex hull; a base of few triangles."""
    step, points = 0.1, [[0.0, 0.0, HEIGHT]]
    for k, up in enumerate(np.arange(0, SLANT - 0.5 * step, step)):
        r = RADIUS * (1 - up / SLANT)
        count = max(3, round(2 * np.pi * r / step))
        angle = 2 * np.pi * (np.arange(count) + 0.3 * k) / count
        points += np.stack([r * np.cos(angle), r * np.sin(angle), 0 * angle + HEIGHT * up / SLANT], axis=1).tolist()
    hull = trimesh.Trimesh(np.array(points), process=False).convex_hull
    return sc.Mesh(SimpleNamespace(vertices=hull.vertices, faces=hull.faces), cache=False)


def test_a_cone_is_one_piece_with_its_tip():
    body = cone()
    assert len(body.pieces) == 2 and sorted(crease.kind for crease in body.creases) == ["edge", "tip"]
    tip = next(crease for crease in body.creases if crease.kind == "tip")
    np.testing.assert_allclose(tip.points, [[0, 0, HEIGHT]], atol=1e-6)
    assert not body.non_smooth(np.array([[0.0, 0.5 * RADIUS, 0.5 * HEIGHT]])).any()


@pytest.mark.parametrize("direction", [(1, 0, 0), (1, -0.4, 0.3)])
def test_rays_on_the_cone_of_a_mesh_are_those_of_the_plane(direction):
    """It unrolls: straight lines, J = 1, up to the rim."""
    line = cr.shadow_line(cone(), direction)
    # two generators; the base's rim is no part of it
    assert line.length + line.at_tips == pytest.approx(2 * SLANT, rel=1e-6)
    fan = cr.launch(cr.DirectFlow(cone(), rtol=1e-10), line, length=2.0, n_rays=24, max_gap=np.inf)
    away = fan.points[:, 0] - [0, 0, HEIGHT]
    rho, p, k = np.linalg.norm(away, axis=1), fan.directions[:, 0], RADIUS / SLANT
    along = np.sum(away * p, axis=1) / rho
    begin = np.arctan2(away[:, 1], away[:, 0])
    across = p[:, 1] * np.cos(begin) - p[:, 0] * np.sin(begin)
    x, y = rho[:, None] + along[:, None] * fan.travel_time, across[:, None] * fan.travel_time
    r, angle = np.hypot(x, y), begin[:, None] + np.arctan2(y, x) / k
    plane = np.stack([k * r * np.cos(angle), k * r * np.sin(angle), HEIGHT * (1 - r / SLANT)], axis=-1)
    end = -rho * along + np.sqrt(SLANT**2 - rho**2 * (1 - along**2))
    met = fan.status == cr.RayStatus.EDGE
    assert met.sum() > 5
    np.testing.assert_allclose(fan.detachment[met], end[met], atol=1e-5)
    before = fan.travel_time < np.minimum(end, fan.detachment)[:, None] - 1e-2
    np.testing.assert_allclose(fan.points[before], plane[before], atol=1e-5)
    np.testing.assert_allclose(fan.spreading[before], 1, atol=1e-4)


def test_a_flap_of_two_triangles_is_dropped():
    """Back to back on one edge of a tetrahedron, as some meshers leave at a tip."""
    x = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0]])
    closed = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    flap = np.array([[1, 2, 4], [2, 1, 4]])
    told = []
    vertices, triangles = cleaned("body", x, np.concatenate([closed, flap]), told.append, told.append)
    assert len(vertices) == 4 and len(triangles) == 4
    assert any("1 flaps of two triangles" in line for line in told)
    # a body whose triangles all stand twice keeps each once
    assert len(cleaned("body", x[:4], np.concatenate([closed, closed]), told.append, told.append)[1]) == 4
