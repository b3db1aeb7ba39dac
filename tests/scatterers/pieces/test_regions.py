"""Smooth regions of meshes: as many as the body has faces, with creases of known lengths and angles."""

import numpy as np
import pytest
import trimesh

from scatterers.triangles.regions import regions_of
from tests.exact_meshes import geodesic_sphere, torus_grid


def wedge(sections=24):
    """A wing of thickness 0.2 and chord 1 between two parabolas, of span 2, with edges at nose and tail."""
    x = np.linspace(0, 1, sections + 1)
    outline = np.concatenate(
        [np.column_stack([x, 0.4 * x * (1 - x)]), np.column_stack([x, -0.4 * x * (1 - x)])[-2:0:-1]]
    )
    n = len(outline)
    points = np.concatenate([np.column_stack([outline, np.full(n, z)]) for z in (0.0, 2.0)])
    k, after = np.arange(n), (np.arange(n) + 1) % n
    # the outline runs clockwise seen from +z
    sides = [np.column_stack([k, k + n, after]), np.column_stack([after, k + n, after + n])]
    fan = np.column_stack([np.zeros(n - 2, int), np.arange(1, n - 1), np.arange(2, n)])
    return points, np.concatenate([*sides, fan, fan[:, ::-1] + n])


def cases():
    rod = trimesh.creation.cylinder(radius=1.0, height=3.0, sections=48)
    box = trimesh.creation.box(extents=(1.0, 2.0, 3.0)).subdivide()
    points, triangles = wedge()
    chord = float(np.sum(np.linalg.norm(np.diff(points[:25, :2], axis=0), axis=1)))
    ring = 48 * 2 * np.sin(np.pi / 48)
    return {
        "cylinder": (rod.vertices, rod.faces, 3, [ring, ring]),
        "box": (box.vertices, box.faces, 6, [1.0] * 4 + [2.0] * 4 + [3.0] * 4),
        "wing": (points, triangles, 4, [chord] * 4 + [2.0] * 2),
        "ball": (*geodesic_sphere(600), 1, []),
        "torus": (*torus_grid(900), 1, []),
    }


CASES = cases()


@pytest.mark.parametrize("name", CASES)
def test_regions_are_the_faces_and_creases_their_edges(name):
    vertices, triangles, count, lengths = CASES[name]
    found = regions_of(np.asarray(vertices), np.asarray(triangles))
    assert found.count == count
    creases = found.creases(np.asarray(vertices), found.number)
    assert {crease.kind for crease in creases} <= {"edge"}
    np.testing.assert_allclose(sorted(crease.length for crease in creases), sorted(lengths), rtol=1e-9)


def test_a_concave_edge_turns_the_other_way():
    box = trimesh.creation.box()
    found = regions_of(np.asarray(box.vertices), np.asarray(box.faces))
    assert np.all(found.turn[found.crease] == pytest.approx(90))
    hollow = regions_of(np.asarray(box.vertices), np.asarray(box.faces)[:, ::-1])
    assert np.all(hollow.turn[hollow.crease] == pytest.approx(-90))


def test_known_creases_are_taken_and_short_chains_left_out():
    points, triangles = geodesic_sphere(600)
    whole = regions_of(points, triangles)
    edges = whole.ends
    equator = np.zeros(len(edges), dtype=bool)
    equator[:3] = True
    # three edges, hardly turned, are no crease
    assert regions_of(points, triangles, sharp=equator).count == 1
    upper = points[triangles].mean(axis=1)[:, 2] > 0
    between = upper[whole.sides[:, 0]] != upper[whole.sides[:, 1]]
    for known in ({"sharp": between}, {"sharp": np.zeros_like(between), "level": between}):
        halves = regions_of(points, triangles, **known)
        assert halves.count == 2 and np.array_equal(halves.number == halves.number[np.argmax(upper)], upper)
        (crease,) = halves.creases(points, halves.number)
        assert crease.closed and crease.kind == ("joint" if "level" in known else "edge")
