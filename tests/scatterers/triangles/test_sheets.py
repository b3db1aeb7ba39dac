"""Sheets that touch are taken apart, and small crossings cut out: what files of real bodies have."""

import numpy as np
import pytest
import trimesh
from body_checks import volume

import scatterers as sc
from scatterers.triangles.parts import taken_apart
from scatterers.triangles.topology import edges_of


def boxes(*shifts):
    """Unit boxes, equal vertices merged."""
    parts = [trimesh.creation.box() for _ in shifts]
    for part, shift in zip(parts, shifts, strict=True):
        part.apply_translation(shift)
    whole = trimesh.util.concatenate(parts)
    whole.merge_vertices()
    return whole


def apart(mesh):
    notes = []
    return *taken_apart("the mesh", mesh.vertices, mesh.faces, notes.append), notes


@pytest.mark.parametrize(
    "shifts, note",
    [
        # an edge in common; one edge of four boxes; a corner in common
        ([[0, 0, 0], [1, 1, 0]], "1 edge and 2 vertices of the mesh"),
        ([[0, 0, 0], [1, 1, 0], [1, 0, 1], [0, 1, 1]], "edges and 7 vertices"),
        ([[0, 0, 0], [1, 1, 1]], "1 vertex of the mesh at which sheets touch taken apart"),
    ],
)
def test_boxes_that_touch_are_bodies_of_their_own(shifts, note):
    whole = boxes(*shifts)
    if len(shifts) > 2:
        # all inside out
        whole.faces = whole.faces[:, ::-1]
    vertices, triangles, notes = apart(whole)
    assert len(vertices) == 8 * len(shifts) and np.all(edges_of(triangles).faces == 2)
    assert len(notes) == 1 and note in notes[0]
    for number in range(1, len(shifts) + 1):
        mesh = sc.examined_mesh(whole, part=number)[0]
        assert volume(mesh) == pytest.approx(1) and len(mesh.triangles) == 12
    with pytest.raises(ValueError, match=f"{len(shifts)} separate surfaces.*part='largest'"):
        sc.examined_mesh(whole)


def test_a_body_pinched_to_a_point_is_whole():
    ball = trimesh.creation.icosphere(2)
    faces = ball.faces.copy()
    faces[faces == int(np.argmin(ball.vertices[:, 2]))] = int(np.argmax(ball.vertices[:, 2]))
    mesh = sc.examined_mesh(trimesh.Trimesh(ball.vertices, faces, process=False))[0]
    assert len(mesh.vertices) == len(ball.vertices) and "1 vertex" in mesh.repairs[0]


def test_a_fin_has_an_open_edge_and_the_body_none():
    """A triangle that stands on an edge of a ball: the flattest two of the three belong together."""
    ball = trimesh.creation.icosphere(2)
    a, b = ball.faces[0, :2]
    tip = 1.5 * (ball.vertices[a] + ball.vertices[b])
    finned = trimesh.Trimesh(np.vstack([ball.vertices, tip]), np.vstack([ball.faces, [b, a, 162]]), process=False)
    vertices, triangles, notes = apart(finned)
    assert len(vertices) == 165 and np.bincount(edges_of(triangles).faces).tolist() == [0, 3, 480]
    assert volume(sc.examined_mesh(finned, part="largest")[0]) == pytest.approx(ball.volume)
    assert notes == ["1 edge and 2 vertices of the mesh at which sheets touch taken apart"]


def test_borders_that_meet_in_a_vertex_are_closed():
    """Two holes with one vertex in common, which is doubled: one border; triangles face either way."""
    ball = trimesh.creation.icosphere(3)
    at = int(ball.faces[0, 0])
    around = np.flatnonzero(np.any(ball.faces == at, axis=1))
    # opposite ones of the umbrella
    ring = [around[0]]
    for _ in range(len(around) - 1):
        beside = [k for k in around if k not in ring and len(set(ball.faces[k]) & set(ball.faces[ring[-1]])) == 2]
        ring.append(beside[0])
    faces = np.delete(ball.faces, [ring[0], ring[2]], axis=0)
    faces[::7] = faces[::7, ::-1]
    mesh = sc.examined_mesh(trimesh.Trimesh(ball.vertices, faces, process=False), cap=np.inf)[0]
    assert volume(mesh) == pytest.approx(ball.volume, rel=1e-3)
    assert sum(text.startswith("a hole") for text in mesh.repairs) == 1


def test_a_small_crossing_is_cut_out_with_cap():
    """A ball with a vertex that is pushed out through the other side."""
    ball = trimesh.creation.icosphere(3)
    vertices = ball.vertices.copy()
    vertices[int(np.argmax(vertices[:, 2]))] = [-0.12, -0.06, -1.2]
    crossed = trimesh.Trimesh(vertices, ball.faces, process=False)
    with pytest.raises(ValueError, match=r"crosses itself: .* give cap= with a size, m: what crosses is cut out"):
        sc.examined_mesh(crossed)
    mesh = sc.examined_mesh(crossed, cap=np.inf)[0]
    assert "that crossed others, or next to them," in mesh.repairs[-1] and "cut out" in mesh.repairs[-1]
    assert volume(mesh) == pytest.approx(4.1, rel=0.05) and np.all(edges_of(mesh.triangles).faces == 2)
    # holes larger than what may be closed are none that can be left
    with pytest.raises(ValueError, match=r"crosses itself: .* too much of it for being cut out"):
        sc.examined_mesh(crossed, cap=1e-3)
