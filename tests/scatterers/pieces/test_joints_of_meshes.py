"""Meshes of capsules and cone-spheres are cut along their joints; smooth bodies, however meshed or noisy, are not."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from body_checks import rms, volume
from scipy.spatial.transform import Rotation

import creeping as cr
import scatterers as sc
from creeping.geodesics.states import pack
from creeping.geometry.surface import normal, size
from scatterers.fits.joints import jointed
from scatterers.triangles.jets import osculating_jets
from scatterers.triangles.quality import assess, jumps_at, noise_at_most
from scatterers.triangles.topology import cut, edges_of
from tests.exact_meshes import capsule, geodesic_sphere, slivers, torus_grid

PILL, CONE = sc.Capsule(0.8, 3.1), sc.ConeSphere(1.0, 3.3)
MESHES = {
    # rings beside the joints, a cylinder of long triangles, triangles of all shapes
    "even": (lambda: capsule(2000, 1.5, 0.8), PILL),
    "long": (lambda: long_triangles(), PILL),
    "cone": (lambda: slivers(CONE, 24), CONE),
}


def long_triangles():
    found = trimesh.creation.capsule(height=1.5, radius=0.8, count=[40, 40])
    points = np.asarray(found.vertices)
    return points - 0.5 * (points.min(axis=0) + points.max(axis=0)), np.asarray(found.faces)


@cache
def opened(name):
    """Body of a mesh that is turned in space, the exact one, and the turn."""
    (points, triangles), exact = MESHES[name][0](), MESHES[name][1]
    turn = Rotation.random(random_state=7).as_matrix()
    return sc.Mesh(SimpleNamespace(vertices=points @ turn.T, faces=triangles), cache=False), exact, turn


@pytest.mark.parametrize("name", ["cone", *(pytest.param(name, marks=pytest.mark.slow) for name in ("even", "long"))])
def test_joints_are_those_of_the_exact_body(name):
    body, exact, turn = opened(name)
    assert body.quality.verdict == "curvature jumps" and "on joints of planes and quadrics" in body.quality.reasons
    assert sorted(c.kind for c in body.creases) == sorted(c.kind for c in exact.creases)
    assert len(body.pieces) == len(exact.pieces)
    for kind in ("joint", "tip"):
        mine, theirs = (
            np.concatenate([c.points for c in b.creases if c.kind == kind] or [np.zeros((0, 3))]) for b in (body, exact)
        )
        if len(mine):
            height = np.unique(theirs[:, 2].round(9))
            off = np.abs((mine @ turn)[:, 2:] - height).min(axis=1)
            np.testing.assert_allclose(off, 0, atol=2e-6)
    # next to the body, on either side of the joints too
    rng = np.random.default_rng(3)
    points = exact.tiles(0.1)[0].reshape(-1, 3)[rng.integers(0, 3000, 1000)]
    points = points + rng.uniform(-1e-3, 1e-3, size=(1000, 1)) * normal(exact, points)
    near = np.linalg.norm(points - [0, 0, points[:, 2].max()], axis=1) > 0.05
    assert near.sum() > 500
    points = points[near]
    np.testing.assert_allclose(distance(body, points @ turn.T), distance(exact, points), atol=3e-6)


def distance(body, points):
    return body.level(points) / np.linalg.norm(body.gradient(points), axis=1)


@pytest.mark.parametrize(
    "name, direction", [pytest.param("even", (0.3, 0.5, 0.8), marks=pytest.mark.slow), ("cone", (0.2, 0.9, -0.5))]
)
def test_shadow_line_and_rays_are_those_of_the_exact_body(name, direction):
    body, exact, turn = opened(name)
    d = np.array(direction) / np.linalg.norm(direction)
    line, wanted = cr.shadow_line(body, turn @ d), cr.shadow_line(exact, d)
    assert len(line.curves) == len(wanted.curves)
    points = np.concatenate([curve.points for curve in line.curves]) @ turn
    assert np.max(np.abs(distance(exact, points))) < 1e-7 * size(exact)
    # n.d over the curvature there is the distance from the exact line
    curvature = np.concatenate([curve.curvature for curve in line.curves])
    assert np.max(np.abs(normal(exact, points) @ d) / np.abs(curvature)) < 1e-6
    fan = cr.launch(cr.DirectFlow(body), line, length=2.5, n_rays=24, n_steps=16, max_gap=np.inf, measured=False)
    assert len(fan.crossings.ray) >= 8
    own, theirs = cr.DirectFlow(body), cr.DirectFlow(exact)
    times = fan.travel_time
    start, ahead = fan.points[:, 0], fan.directions[:, 0]
    a = own.transport(pack(start, ahead, lanes=14), times)
    b = theirs.transport(pack(start @ turn, ahead @ turn, lanes=14), times)
    np.testing.assert_allclose(a[:, :, :3] @ turn, b[:, :, :3], atol=1e-5 * size(exact))
    # M, M', m and m' of a ray, by which it spreads
    np.testing.assert_allclose(a[:, :, 6:10], b[:, :, 6:10], atol=1e-3 * np.nanmax(np.abs(b[:, :, 6:10])))


@pytest.mark.parametrize("name, amount", [("even", 1e-5), pytest.param("cone", 1e-6, marks=pytest.mark.slow)])
def test_joints_are_found_within_the_noise_of_the_vertices(name, amount):
    (points, triangles), exact = MESHES[name][0](), MESHES[name][1]
    noise, rng = amount * 0.5 * np.linalg.norm(np.ptp(points, axis=0)), np.random.default_rng(23)
    moved = points + noise * rng.normal(size=points.shape)
    body = sc.Mesh(SimpleNamespace(vertices=moved, faces=triangles), cache=False)
    assert body.quality.verdict == "curvature jumps" and len(body.pieces) == len(exact.pieces)
    assert [c.kind for c in body.creases].count("joint") == [c.kind for c in exact.creases].count("joint")
    # quadrics through many vertices are off by less than each of these
    there = exact.tiles(0.1)[0].reshape(-1, 3)[rng.integers(0, 3000, 1000)]
    there = there[np.linalg.norm(there - [0, 0, points[:, 2].max()], axis=1) > 0.05]
    assert rms(distance(body, there)) < noise


SMOOTH = {
    "ellipsoid": lambda n: (geodesic_sphere(n)[0] * [3, 1, 1], geodesic_sphere(n)[1]),
    "torus": lambda n: torus_grid(n),
    "twisted, slivers": lambda n: slivers(sc.TwistedEllipsoid(), round(0.57 * np.sqrt(n))),
    "bumpy": lambda n: slivers(
        sc.Implicit("x**2+y**2+z**2-1+0.15*sin(3*x)*sin(3*y)*cos(2*z)"), round(0.57 * np.sqrt(n))
    ),
}
CASES = [("ellipsoid", 0.0), ("torus", 1e-5), ("twisted, slivers", 1e-5), ("bumpy", 1e-7)]
SLOW = [(*CASES[3], 800), *((*case, 10_000) for case in CASES)]


@pytest.mark.parametrize(
    "name, noise, count",
    [*((*case, 800) for case in CASES[:3]), *(pytest.param(*case, marks=pytest.mark.slow) for case in SLOW)],
)
def test_smooth_bodies_have_no_joints(name, noise, count):
    """Whatever jets say of the curvature there."""
    points, triangles = SMOOTH[name](count)
    rng = np.random.default_rng(11)
    points = points + noise * 0.5 * np.linalg.norm(np.ptp(points, axis=0)) * rng.normal(size=points.shape)
    jets = osculating_jets(points, triangles)
    quality = assess(points, triangles, jets)
    clean = jets.fitted & ~quality.bad & ~jumps_at(jets, quality.edge_mean)
    assert jointed(points, triangles, jets.normals, clean) is None
    # nor within all that jets leave, taken for noise
    assert jointed(points, triangles, jets.normals, clean, noise_at_most(jets)) is None
    assert jointed(points, triangles, jets.normals, clean & (points[:, 2] > 0.1), noise_at_most(jets)) is None
    # not even where half of the vertices are taken for a jump
    assert jointed(points, triangles, jets.normals, clean & (points[:, 2] > 0.1)) is None


def test_a_cut_mesh_is_the_same_surface():
    points, triangles = geodesic_sphere(600)
    edges = edges_of(triangles)
    some = np.flatnonzero(np.random.default_rng(0).random(len(edges.ends)) < 0.4)
    middles = points[edges.ends[some]].mean(axis=1)
    x, t = cut(points, triangles, some, middles)
    assert len(x) == len(points) + len(some) and np.all(edges_of(t).faces == 2)
    assert volume(x, t) == pytest.approx(volume(points, triangles), rel=1e-13)
