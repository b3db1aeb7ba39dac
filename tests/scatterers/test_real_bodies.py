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
