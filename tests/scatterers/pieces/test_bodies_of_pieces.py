"""Meshes with edges as bodies of pieces: sign, pieces, normals and curvatures against closed forms; what is stored."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from body_checks import rms, shape_operator, unit

import scatterers as sc
from creeping.geometry.surface import project
from scatterers.fits.spline_pieces import SplinePieces, packed, unpacked

R, TUBE = 1.0, 0.4


def angle_piece():
    """An L of two beams, 1 thick: five convex edges along z, one concave."""
    corners = np.array([[0.0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]])
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]])
    return trimesh.creation.extrude_triangulation(corners, faces, 1.0)


SIDES = 40


def half_torus(n=48, m=SIDES):
    """The half x > 0 of a torus about z, its two ends flat discs, with vertices on the circles where they meet."""
    u, v = np.linspace(-np.pi / 2, np.pi / 2, n), np.linspace(0, 2 * np.pi, m, endpoint=False)
    out = R + TUBE * np.cos(v)
    points = np.stack(
        [np.outer(np.cos(u), out), np.outer(np.sin(u), out), np.broadcast_to(TUBE * np.sin(v), (n, m))], axis=-1
    ).reshape(-1, 3)
    points[:m, 0] = points[-m:, 0] = 0.0
    k = (np.arange(n - 1)[:, None] * m + np.arange(m)).ravel()
    after = (np.arange(n - 1)[:, None] * m + np.arange(1, m + 1) % m).ravel()
    ends = np.array([[0, -R, 0], [0, R, 0]])
    last = (n - 1) * m + np.arange(m)
    triangles = [np.stack([k, k + m, after], axis=1), np.stack([after, k + m, after + m], axis=1)]
    triangles += [np.stack([np.arange(m), (np.arange(m) + 1) % m, np.full(m, n * m)], axis=1)]
    triangles += [np.stack([np.roll(last, -1), last, np.full(m, n * m + 1)], axis=1)]
    return SimpleNamespace(vertices=np.concatenate([points, ends]), faces=np.concatenate(triangles))


SOURCES = {
    "L": angle_piece,
    "rod": lambda: trimesh.creation.cylinder(radius=0.5, height=2.0, sections=64),
    "rod of few triangles": lambda: trimesh.creation.cylinder(radius=0.5, height=2.0, sections=24),
    "half torus": half_torus,
}


@cache
def opened(name):
    return sc.Mesh(SOURCES[name](), cache=False)


def outside(name, x):
    """Whether points are outside, by the closed form; those within 0.001 of the surface are not asked."""
    if name == "L":
        long, short = (
            np.maximum(np.abs(x - c), 0) - h
            for c, h in (([1, 0.5, 0.5], [1, 0.5, 0.5]), ([0.5, 1, 0.5], [0.5, 1, 0.5]))
        )
        return np.minimum(long.max(axis=1), short.max(axis=1))
    if name == "rod":
        return np.maximum(np.hypot(x[:, 0], x[:, 1]) - 0.5, np.abs(x[:, 2]) - 1)
    return np.maximum(np.hypot(np.hypot(x[:, 0], x[:, 1]) - R, x[:, 2]) - TUBE, -x[:, 0])


@pytest.mark.parametrize("name", ["L", *(pytest.param(k, marks=pytest.mark.slow) for k in ("rod", "half torus"))])
def test_the_level_has_the_sign_of_the_body(name):
    body = opened(name)
    rng = np.random.default_rng(3)
    low, high = body.bounds
    far = rng.uniform(low - 0.3, high + 0.3, size=(4000, 3))
    # and close to the surface
    corners, normals, _ = body.tiles(0.2)
    near = corners.mean(axis=1) + rng.uniform(-0.05, 0.05, size=(len(corners), 1)) * normals.mean(axis=1)
    points = np.concatenate([far, near])
    expected = outside(name, points)
    # chords of 64 sides are off by 0.5 (1 - cos(pi/64)); the fit takes the vertices
    asked = np.abs(expected) > 1e-3
    assert np.array_equal(body.level(points)[asked] > 0, expected[asked] > 0)


def test_the_piece_is_that_of_the_face():
    body = opened("L")
    assert len(body.pieces) == 8
    corners, normals, number = body.tiles(0.2)
    middles = corners.mean(axis=1)
    assert np.array_equal(body.piece(middles), number)
    assert np.array_equal(np.unique(number), np.arange(len(body.pieces)))
    np.testing.assert_allclose(body.level(middles), 0, atol=1e-12)
    np.testing.assert_allclose(body.gradient(middles), normals.mean(axis=1), atol=1e-9)
    # faces are planes along the axes: nothing is uncertain of them
    flat = np.broadcast_to([0, 0, 1], (len(corners), 3))
    np.testing.assert_allclose(np.sort(np.abs(normals.mean(axis=1)), axis=1), flat, atol=1e-9)
    assert not body.non_smooth(middles).any()
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    assert area == pytest.approx(2 * 3 + 8)


def curvatures(body, x):
    """Normals and mean curvatures."""
    return unit(body.gradient(x)), 0.5 * np.trace(shape_operator(body, x), axis1=1, axis2=2)


@pytest.mark.slow
def test_a_rod_is_a_cylinder_between_two_planes():
    body = opened("rod of few triangles")
    assert [(c.kind, c.closed) for c in body.creases] == [("edge", True)] * 2
    rng = np.random.default_rng(7)
    angle, z = rng.uniform(0, 2 * np.pi, 200), rng.uniform(-0.99, 0.99, 200)
    around = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    side = 0.5 * around + np.outer(z, [0, 0, 1])
    n, mean = curvatures(body, side)
    np.testing.assert_allclose(n, around, atol=1e-9)
    np.testing.assert_allclose(mean, 1.0, atol=1e-8)
    n, mean = curvatures(body, 0.98 * side * [1, 1, 0] + [0, 0, 1])
    np.testing.assert_allclose(n, np.broadcast_to([0, 0, 1], n.shape), atol=1e-12)
    np.testing.assert_allclose(mean, 0, atol=1e-9)


@pytest.mark.slow
def test_a_torus_cut_in_half_is_known_up_to_its_rims():
    body = opened("half torus")
    rims = [crease for crease in body.creases if crease.kind == "edge"]
    assert sum(c.length for c in rims) == pytest.approx(2 * SIDES * 2 * TUBE * np.sin(np.pi / SIDES))
    rng = np.random.default_rng(9)
    u, v = rng.uniform(-np.pi / 2, np.pi / 2, 1000), rng.uniform(0, 2 * np.pi, 1000)
    along = np.stack([np.cos(u), np.sin(u), 0 * u], axis=1)
    exact = np.cos(v)[:, None] * along + np.outer(np.sin(v), [0, 0, 1])
    points = R * along + TUBE * exact
    off = points[:, 0]
    edge = 2 * np.pi * TUBE / SIDES
    x = project(body, points[off > 3 * edge])
    assert np.linalg.norm(x - points[off > 3 * edge], axis=1).max() < 1e-4
    n, mean = curvatures(body, x)
    expected = 0.5 * (1 / TUBE + np.cos(v) / (R + TUBE * np.cos(v)))[off > 3 * edge]
    assert rms(np.linalg.norm(n - exact[off > 3 * edge], axis=1)) < 1e-4
    assert rms(mean - expected) < 1e-2 * rms(expected)
    # not trusted beside the rims, where the fit has points on one side only
    spacing = body._parts.reach[np.isfinite(body._parts.reach)].max()
    assert body.non_smooth(points[off < 0.5 * spacing]).all() and not body.non_smooth(points[off > 1.5 * spacing]).any()
    # a point alone is answered as among others
    assert bool(body.non_smooth(points[0])) == bool(body.non_smooth(points)[0])


def test_stored_pieces_are_the_same_to_the_bit(tmp_path):
    made, messages = sc.Mesh(SOURCES["L"](), cache=tmp_path), []
    again = sc.Mesh(SOURCES["L"](), cache=tmp_path, progress=messages.append)
    assert messages == [] and repr(again.creases) == repr(made.creases) and again.fingerprint == made.fingerprint
    x = np.random.default_rng(1).uniform(-1, 1, size=(500, 3))
    for name in ("level", "gradient", "hessian", "piece", "non_smooth"):
        np.testing.assert_array_equal(getattr(again, name)(x), getattr(made, name)(x))


DAMAGE = {
    "table": lambda a: a["table"][:20],
    "number": lambda a: a["number"] + 3,
    "corners": lambda a: np.full_like(a["corners"], np.nan),
    "normals": lambda a: a["normals"][1:],
    "creases": lambda a: a["creases"] + [0, 5, 0, 0, 0],
    "crease-points": lambda a: a["crease-points"][:-3],
    "fine-coefficients-0": lambda a: a["fine-coefficients-0"][:5],
}


@pytest.mark.parametrize("name", DAMAGE)
def test_damaged_pieces_are_refused(name):
    parts = opened("L")._parts
    arrays = parts.arrays() | packed(parts.space.splines, "fine")

    def restored(changed):
        return SplinePieces.restored(arrays | changed, unpacked(arrays | changed, "fine"))

    restored({})
    with pytest.raises(ValueError, match="damaged"):
        restored({name: DAMAGE[name](arrays)})
    for place, value in [(3, np.nan), (3, -1.0), (4, 0.0), (4, 1e9), (7, 3.0), (9, 1e12), (9, 0.0)]:
        table = arrays["table"].copy()
        table[place] = value
        with pytest.raises(ValueError, match="the table of the pieces is damaged"):
            restored({"table": table})
