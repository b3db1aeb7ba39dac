"""Quadrature over whole bodies against closed forms and the divergence theorem."""

import numpy as np
import pytest
import shared_bodies as sc
from body_checks import directions, normal_curvature, unit

from creeping.errors import SurfaceError
from creeping.geometry import quadrature, tile_rules
from creeping.geometry.curvature import gaussian_curvature
from creeping.geometry.quadrature import body_nodes, inner_points, nearest_points, node_count
from creeping.geometry.triangulation import quadrilaterals
from studies.accuracy.bodies import bodies

BODIES = {
    "sphere": sc.Sphere(radius=2.0),
    "slender": sc.Ellipsoid(0.2, 0.3, 1.0),
    "torus": sc.Torus(R=1.0, r=0.4),
    "twisted": sc.TwistedEllipsoid(),
}
GENUS = {"torus": 1}


@pytest.mark.parametrize("name", BODIES)
def test_gauss_and_bonnet(name):
    # the integral of K is 2 pi times the Euler characteristic, whatever the shape
    nodes = body_nodes(BODIES[name], 20.0)
    total = np.sum(nodes.weights * gaussian_curvature(BODIES[name], nodes.points))
    assert total == pytest.approx(4 * np.pi * (1 - GENUS.get(name, 0)), abs=2e-4)
    area = {"sphere": 16 * np.pi, "torus": 4 * np.pi**2 * 0.4}.get(name)
    assert area is None or np.sum(body_nodes(BODIES[name], 5.0).weights) == pytest.approx(area, rel=1e-8)


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("rate", [8.0, 60.0])
def test_waves_through_a_closed_surface(name, rate, rng):
    # the flux of a field without sources, e^{iq.x} a with q.a = 0, is 0: as fast a phase as was asked for
    q = rate * unit(rng.normal(size=3))
    a = unit(np.cross(q, rng.normal(size=3)))
    nodes = body_nodes(BODIES[name], rate)
    flux = np.sum(nodes.weights * (nodes.normals @ a) * np.exp(1j * (nodes.points @ q)))
    assert abs(flux) < 1e-4 * np.sum(nodes.weights)


def fine_count(body, rate, monkeypatch):
    """Nodes where no mesh is coarser than 24 cells."""
    with monkeypatch.context() as patch:
        patch.setattr(tile_rules, "COARSE", {})
        return node_count(type(body)(), rate)


@pytest.mark.parametrize("make", [sc.TwistedEllipsoid, sc.Torus])
def test_slow_waves_take_few_nodes_and_fast_ones_no_more(make, monkeypatch):
    body = make()
    assert 3.0 * len(body_nodes(body, 16.0).points) < fine_count(body, 16.0, monkeypatch)
    for rate in (24.0, 40.0, 80.0, 160.0):
        assert node_count(body, rate) <= fine_count(body, rate, monkeypatch)
    nodes = body_nodes(body, 20.0)
    assert nodes.error < 1e-6 and 20.0 * nodes.spacing < 1.2 * tile_rules.NEAR


def test_coarse_meshes_that_do_not_close_are_passed_over(monkeypatch):
    """Of the peanut few points on large tiles miss the area by more than 1e-4; those that are taken do not."""
    body = bodies()["peanut"][0]
    rough = quadrature._nodes(body, quadrilaterals(body, cells=6, fewest=6), 3)
    sharp = body_nodes(body, 80.0).weights.sum()
    assert abs(rough.weights.sum() / sharp - 1) > 1e-4 and rough.error > tile_rules.CLOSED
    taken = body_nodes(body, 16.0)
    assert len(taken.points) < 16_000 and taken.weights.sum() == pytest.approx(sharp, rel=1e-5)


def test_nodes_are_on_the_body_and_curvatures_are_its():
    body = BODIES["twisted"]
    nodes = body_nodes(body, 10.0)
    assert np.max(np.abs(body.level(nodes.points))) < 1e-13
    np.testing.assert_allclose(nodes.normals, unit(body.gradient(nodes.points)), atol=1e-12)
    tangent = unit(np.cross(nodes.normals, [0.3, 0.5, 0.8]))
    np.testing.assert_allclose(nodes.curvature(tangent), normal_curvature(body, nodes.points, tangent), atol=1e-10)


def test_nearest_points_of_a_sphere_and_of_an_ellipsoid(rng):
    s = directions(rng, 50)
    x, n, _, height = nearest_points(BODIES["sphere"], s * rng.uniform(1.8, 2.3, (50, 1)))
    np.testing.assert_allclose(x, 2 * s, atol=1e-12)
    np.testing.assert_allclose(n, s, atol=1e-12)
    body = BODIES["slender"]
    foot, normals, _, _ = nearest_points(body, s * [0.2, 0.3, 1.0])
    off = 0.02 * rng.uniform(-1, 1, 50)
    again, _, _, height = nearest_points(body, foot + off[:, None] * normals)
    np.testing.assert_allclose(again, foot, atol=1e-11)
    np.testing.assert_allclose(height, off, atol=1e-12)


def test_scale_changes_nothing_but_lengths():
    one, large = (body_nodes(sc.Ellipsoid(s, 0.8 * s, 0.6 * s), 20.0 / s) for s in (1.0, 1e6))
    np.testing.assert_allclose(large.weights, 1e12 * one.weights, rtol=1e-9)


def test_a_rate_beyond_every_mesh_is_refused():
    with pytest.raises(SurfaceError, match="asks for more than"):
        body_nodes(BODIES["sphere"], 1e6)


def test_inner_points_are_as_deep_as_told():
    body = BODIES["torus"]
    points = inner_points(body, 0.2, 60)
    ring = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 1.0, points[:, 2])
    assert len(points) == 60 and ring.max() < 0.2 + 1e-6
    assert len(inner_points(body, 0.5, 60)) == 0


def test_a_body_as_thin_as_a_sheet_is_refused_at_once_the_second_time():
    body = sc.Ellipsoid(1.0, 1.0, 0.003)
    for _ in range(2):
        with pytest.raises(SurfaceError, match="too thin or too sharp"):
            body_nodes(body, 5.0)


def test_distances_are_from_nodes_sorted_once(monkeypatch):
    body = sc.Sphere()
    points = np.array([[0.0, 0.0, 2.0], [0.3, 0.0, 0.0]])
    found = body_nodes(body, 20.0).distance(points)
    assert found == pytest.approx([1.0, 0.7], rel=0.01)
    monkeypatch.setattr("scipy.spatial.cKDTree", None)
    np.testing.assert_array_equal(body_nodes(body, 20.0).distance(points), found)


def test_bodies_of_pieces():
    """Area and volume of a capsule, area of a cone-sphere, and a wave through a closed surface."""
    pill, cone = sc.Capsule(1.0, 4.0), sc.ConeSphere(1.0, 4.0)
    alpha = cone.half_angle
    of_cone = np.pi / np.tan(alpha) * np.cos(alpha) + 2 * np.pi * (1 + np.sin(alpha))
    for body, area, close in ((pill, 8 * np.pi, 1e-10), (cone, of_cone, 3e-5)):
        nodes = body_nodes(body, 30.0)
        assert nodes.error < close
        assert nodes.weights.sum() == pytest.approx(area, rel=close)
        assert node_count(body, 30.0) == pytest.approx(len(nodes.points), rel=0.3)
    nodes = body_nodes(pill, 30.0)
    through = np.sum(nodes.weights * np.sum(nodes.points * nodes.normals, axis=1)) / 3
    assert through == pytest.approx(2 * np.pi + 4 / 3 * np.pi, rel=1e-9)
    # int n e^{ik q.x} dS is ik q times an integral over the volume: it has no component but along q
    q = np.array([0.36, 0.48, 0.8])
    flux = nodes.normals.T @ (nodes.weights * np.exp(15j * nodes.points @ q))
    assert np.linalg.norm(np.cross(flux, q)) < 2e-4
