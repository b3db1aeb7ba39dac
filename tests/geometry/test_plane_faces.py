"""Flat faces by fewer triangles: the same body, whatever its mesh and its holes, and nothing of what is curved."""

import numpy as np
import pytest
import trimesh

from creeping.geometry.patches import Triangles, sides_of
from creeping.geometry.plane_faces import with_whole_faces


def triangles_of(mesh):
    mesh = mesh.copy()
    mesh.merge_vertices()
    return Triangles(np.asarray(mesh.vertices), np.asarray(mesh.faces), False)


def turned(mesh, seed):
    mesh = mesh.copy()
    mesh.apply_transform(trimesh.transformations.random_rotation_matrix(np.random.default_rng(seed).random(3)))
    return mesh


def plate_with_holes():
    plate, corner = trimesh.creation.box((2, 2, 0.5)), trimesh.creation.box((0.3, 0.3, 1))
    slot = trimesh.creation.box((0.5, 0.6, 1)).apply_translation((0.4, 0.3, 0))
    pytest.importorskip("manifold3d")
    return trimesh.boolean.difference([plate, slot, corner.apply_translation((-0.5, -0.5, 0))])


@pytest.mark.parametrize(
    "make, faces",
    [
        (lambda: trimesh.creation.box((1, 2, 3)), 12),
        (lambda: trimesh.creation.annulus(0.3, 1, 0.5, sections=12), 96),
        # two faces with two holes of four corners: 2 (4 + 8 + 2) triangles, and 2 of each of 12 sides
        (plate_with_holes, 52),
    ],
)
@pytest.mark.parametrize("seed", [1, 2])
def test_a_fine_mesh_of_flat_faces_is_one_of_few_triangles(make, faces, seed):
    fine = turned(make().subdivide_to_size(0.25), seed)
    found = with_whole_faces(triangles_of(fine))
    assert len(found.triangles) == faces < len(fine.faces)
    whole = trimesh.Trimesh(found.vertices, found.triangles, process=False)
    assert whole.is_watertight and np.isclose(whole.volume, fine.volume) and np.isclose(whole.area, fine.area)
    np.testing.assert_allclose(whole.moment_inertia, fine.moment_inertia, rtol=1e-9, atol=1e-12)
    assert np.all(np.bincount(sides_of(found.triangles)[1].ravel()) == 2)


def test_what_is_curved_or_coarse_stays_as_it_is():
    assert with_whole_faces(triangles_of(trimesh.creation.icosphere(subdivisions=2))) is None
    assert with_whole_faces(triangles_of(trimesh.creation.box())) is None
    # a cylinder keeps its side; that outlines are long is told
    assert with_whole_faces(triangles_of(trimesh.creation.cylinder(1.0, 2.0, sections=600).subdivide())) is None


def test_plates_with_many_holes_are_cut():
    """Bridges that end where others do, and holes behind holes."""
    pytest.importorskip("manifold3d")
    rng, plate = np.random.default_rng(4), trimesh.creation.box((2, 2, 0.3))
    places = [(x, y) for x in (-0.6, 0.0, 0.6) for y in (-0.6, 0.0, 0.6)]
    holes = [
        trimesh.creation.cylinder(0.15 + 0.08 * rng.random(), 1.0, sections=int(rng.integers(3, 8))).apply_translation(
            (*place, 0)
        )
        for place in places
    ]
    fine = turned(trimesh.boolean.difference([plate, *holes]).subdivide_to_size(0.2), 3)
    found = with_whole_faces(triangles_of(fine))
    whole = trimesh.Trimesh(found.vertices, found.triangles, process=False)
    assert whole.is_watertight and np.isclose(whole.volume, fine.volume) and 3 * len(found.triangles) < len(fine.faces)


def test_a_bulge_is_no_plane():
    """A cap whose triangles each turn by less than what counts as flat."""
    box = trimesh.creation.box((2, 2, 1)).apply_translation((0, 0, -0.5)).subdivide_to_size(0.06)
    box.vertices[:, 2] += np.where(
        np.abs(box.vertices[:, 2]) < 1e-12, 4e-5 * (1 - box.vertices[:, 0] ** 2) * (1 - box.vertices[:, 1] ** 2), 0.0
    )
    found = with_whole_faces(triangles_of(box))
    assert found is None or np.isclose(
        trimesh.Trimesh(found.vertices, found.triangles, process=False).volume, box.volume, rtol=1e-7
    )
