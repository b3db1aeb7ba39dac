"""Names of the parts of 3MF files."""

import zipfile

import numpy as np
import pytest
import trimesh

from scatterers.triangles.choice import Choice
from scatterers.triangles.files import read_mesh

BALL = trimesh.creation.icosphere(2)
VERTICES, FACES = np.array(BALL.vertices), np.array(BALL.faces)


def test_parts_of_3mf_have_the_names_of_their_objects(tmp_path):
    vertices = "".join(f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>' for x, y, z in VERTICES.tolist())
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in FACES.tolist())
    ball = f"<mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh>"
    text = (
        '<model unit="millimeter"><resources>'
        f'<object id="1" name="ball">{ball}</object><object id="2">{ball}</object>'
        '<object id="3" name="pair"><components><component objectid="1"/>'
        '<component objectid="2" transform="2 0 0 0 2 0 0 0 2 9 0 0"/></components></object></resources>'
        '<build><item objectid="3"/><item objectid="2" transform="3 0 0 0 3 0 0 0 3 -9 0 0"/></build></model>'
    )
    path = tmp_path / "three.3mf"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("3D/3dmodel.model", text)
    # an object without a name has that of what it is a component of, if that has one
    for part, radius, centre in (("ball", 1e-3, 0.0), ("pair", 2e-3, 9e-3), ("object 2", 3e-3, -9e-3)):
        found = read_mesh(path, None, Choice(part=part), progress=str)
        assert np.ptp(found.vertices[:, 0]) == pytest.approx(2 * radius)
        assert found.vertices[:, 0].mean() == pytest.approx(centre, abs=1e-9)
    with pytest.raises(ValueError, match=r"three.3mf has no part 'cube'; it has .*ball"):
        read_mesh(path, None, Choice(part="cube"), progress=str)
