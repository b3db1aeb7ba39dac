"""Files of public repositories, where their folder lies beside the project: opened as far as a fan, or refused with the
option that helps."""

from pathlib import Path

import numpy as np
import pytest

import creeping as cr
import scatterers as sc

FOLDER = Path(__file__).parents[3] / "shared" / "bodies"
needs = pytest.mark.skipif(not FOLDER.is_dir(), reason="no folder of real bodies")


def opened(name, **options):
    """Body of a file; lengths of meshes are taken for metres."""
    path = FOLDER / name
    if path.suffix.lower() in (".step", ".stp", ".brep"):
        pytest.importorskip("gmsh")
        return sc.Cad(path, "m" if path.suffix == ".brep" else None, cache=False, **options)
    return sc.Mesh(path, "m", cache=False, **options)


@pytest.mark.slow
@needs
@pytest.mark.parametrize(
    ("name", "options", "pieces"),
    [
        ("gmsh_full_sphere.brep", {}, 0),
        ("oded_torus.obj", {}, 0),
        ("trimesh_round.stl", {}, 4),
        ("trimesh_multibody.stl", {"part": "largest"}, 6),
        ("trimesh_box_sides.STEP", {"part": "largest", "points": 1500}, 50),
    ],
)
def test_files_open_as_far_as_a_fan(name, options, pieces):
    """Edges are ends of rays, not of the file; the ends of all rays are told."""
    body = opened(name, **options)
    assert len(body.pieces) == pieces
    line = cr.shadow_line(body, (0.3, 0.5, 0.8))
    fan = cr.launch(cr.DirectFlow(body), line, n_rays=16)
    known = {"OK", "DETACHED", "EDGE", "TIP", "NON_SMOOTH"}
    assert set(fan.status_counts) <= known
    assert np.all(np.isfinite(fan.points))
    if pieces:
        assert 0 < line.edge_share <= 1
        assert np.all(np.isfinite(fan.losses()))


@needs
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("trimesh_multibody.stl", "part='largest'"),
        ("occore_bottle_ascii.stl", "part='largest'"),
        ("gmsh_cube_filet.stp", "cap="),
    ],
)
def test_refusals_name_the_option_that_helps(name, message):
    """Several bodies, and holes."""
    with pytest.raises(ValueError, match=message):
        opened(name)


@needs
def test_a_coarse_torus_lies_on_the_exact_one():
    """2304 vertices, kappa e = .31: refused before; the fit says what it is worth, and is as good as it says."""
    body = opened("oded_torus.obj")
    rng = np.random.default_rng(0)
    u, v = rng.uniform(0, 2 * np.pi, (2, 2000))
    vertices = sc.examined_mesh(FOLDER / "oded_torus.obj", "m")[0].vertices
    middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    # its axis is y, the radii 1 and 1/4
    ring = np.stack([np.cos(u), 0 * u, np.sin(u)], axis=1)
    normals = np.cos(v)[:, None] * ring + np.outer(np.sin(v), [0, 1, 0])
    points = middle + ring + 0.25 * normals
    gradient = body.gradient(points)
    off = np.abs(body.level(points)) / np.linalg.norm(gradient, axis=1)
    assert np.max(off) < 1e-3
    doubt = body.fit.normal_curvature_error / body.fit.normal_curvature
    assert 0 < doubt < 0.01
