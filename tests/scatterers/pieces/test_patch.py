"""Planes and quadrics through points against closed forms, and what is none; curved triangles on a ball."""

import numpy as np
import pytest
import trimesh

import scatterers as sc
from scatterers.fits.patch import Closeness, curved, divided, polynomial_patch
from scatterers.kernels.compiled import SYMMETRIC, evaluated

RNG = np.random.default_rng(11)
U, V = RNG.uniform(0, 1.5, 200), RNG.uniform(-1, 1, 200)
COS, SIN, NONE = np.cos(U), np.sin(U), 0 * U
ROUND = np.stack([COS, SIN, NONE], axis=1)
# points, normals and the larger principal curvature
SURFACES = {
    "plane": (np.stack([U, V, 0.3 * U - 0.2 * V], axis=1), np.broadcast_to([-0.3, 0.2, 1], (200, 3)), 0 * U),
    "cylinder": (2 * ROUND + np.outer(V, [0, 0, 1]), ROUND, 0.5 + 0 * U),
    "cone": (
        (2 - V)[:, None] * ROUND + np.outer(V, [0, 0, 1]),
        ROUND + np.array([0, 0, 1]),
        1 / (np.sqrt(2) * (2 - V)),
    ),
    "ball": (
        3 * np.stack([COS * np.cos(V), SIN * np.cos(V), np.sin(V)], axis=1),
        np.stack([COS * np.cos(V), SIN * np.cos(V), np.sin(V)], axis=1),
        1 / 3 + 0 * U,
    ),
}


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("turned", [1, -1])
def test_planes_and_quadrics_are_found(name, turned):
    points, normals, curvature = SURFACES[name]
    normals = turned * normals / np.linalg.norm(normals, axis=1, keepdims=True)
    patch = polynomial_patch(points, normals, Closeness(1e-9))
    assert patch.kind == ("plane" if name == "plane" else "quadric") and patch.misfit < 1e-12
    value, gradient, packed = evaluated(patch.fine.compiled, points)
    np.testing.assert_allclose(value, 0, atol=1e-11)
    slope = np.linalg.norm(gradient, axis=1, keepdims=True)
    np.testing.assert_allclose(gradient / slope, normals, atol=1e-10)
    # the trace of the Hessian across the normal is the sum of the principal curvatures
    hessian = packed[:, SYMMETRIC]
    total = (np.trace(hessian, axis1=1, axis2=2) - np.einsum("ni,nij,nj->n", normals, hessian, normals)) / slope[:, 0]
    expected = turned * curvature * (2 if name == "ball" else 1)
    np.testing.assert_allclose(total, expected, atol=1e-9)


def test_other_surfaces_are_no_quadrics():
    body = sc.Torus()
    s = RNG.normal(size=(300, 3))
    points = 1.0 * np.stack([np.cos(s[:, 0]), np.sin(s[:, 0]), 0 * s[:, 0]], axis=1)
    normals = points * np.cos(s[:, 1:2]) + np.outer(np.sin(s[:, 1]), [0, 0, 1])
    points = points + 0.5 * normals
    np.testing.assert_allclose(body.level(points), 0, atol=1e-12)
    close = Closeness(1e-6)
    assert polynomial_patch(points, normals, close) is None
    # two balls are none either, nor is a plane with normals along it
    balls = np.concatenate([ROUND, ROUND + np.array([4, 0, 1])])
    assert polynomial_patch(balls, np.tile(ROUND, (2, 1)), close) is None
    flat = np.stack([U, V, NONE], axis=1)
    assert polynomial_patch(flat, np.tile([1.0, 0, 0], (200, 1)), close) is None


@pytest.mark.parametrize("edge", [0.3, 0.1])
def test_divided_triangles_cover_the_area(edge):
    corners = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 2, 0]], [[0, 0, 1], [3, 0, 1], [0, 0.02, 1]]])
    origin, place = divided(corners, edge)
    np.testing.assert_allclose(place.sum(axis=-1), 1)
    x = place @ corners[origin]
    assert np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2).max() <= edge
    normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    for k, area in enumerate((1.0, 0.03)):
        assert 0.5 * normal[origin == k, 2].sum() == pytest.approx(area)
        # none is turned over
        assert np.all(normal[origin == k, 2] * normal[origin == k, 2].sum() > 0)


def test_too_many_triangles_are_refused(monkeypatch):
    monkeypatch.setattr("scatterers.fits.patch.MOST", 1000)
    with pytest.raises(ValueError, match=r"sides of at most 1e-06 L ask for more than \d+ triangles"):
        divided(np.eye(3)[None], 1e-6)


def test_curved_triangles_follow_a_ball_to_the_fourth_order():
    """Points between vertices of a ball are off by h^4, those of flat triangles by h^2."""
    off, normals_off, edges = [], [], []
    for times in (1, 2, 3):
        ball = trimesh.creation.icosphere(times)
        corners = np.asarray(ball.vertices)[ball.faces]
        place = RNG.dirichlet([1, 1, 1], size=(len(corners), 5))
        points, normals = curved(corners[:, None], corners[:, None], place)
        radius = np.linalg.norm(points, axis=-1)
        off.append(np.sqrt(np.mean((radius - 1) ** 2)))
        normals_off.append(np.sqrt(np.mean(np.sum((normals - points / radius[..., None]) ** 2, axis=-1))))
        edges.append(ball.edges_unique_length.mean())
    assert np.all(np.diff(np.log(off)) / np.diff(np.log(edges)) > 3.7) and off[-1] < 3e-5
    assert np.all(np.diff(np.log(normals_off)) / np.diff(np.log(edges)) > 2.7)
    # corners stay, and sides are shared
    corners = np.eye(3)[None]
    np.testing.assert_allclose(curved(corners, corners, np.eye(3))[0], np.eye(3), atol=1e-15)
