"""OFF files: faces of many corners, which the loader does not read, and files that are none."""

import math

import numpy as np
import pytest

from scatterers.triangles.files import read_mesh
from scatterers.triangles.form import with_triangles


@pytest.mark.parametrize("header", ["OFF\n{} {} 0", "OFF {} {} 0", "# by hand\nOFF\n{} {} 0\n# corners"])
def test_faces_of_many_corners_in_off_files_are_triangles(tmp_path, header):
    angles = (2 * np.pi * np.arange(6) / 6).tolist()
    hexagon = [(math.cos(a), math.sin(a)) for a in angles]
    corners = [f"{x!r} {y!r} {z}" for z in (0, 2) for x, y in hexagon]
    sides = [f"4 {k} {(k + 1) % 6} {6 + (k + 1) % 6} {6 + k}  0 255 0" for k in range(6)]
    faces = ["6 5 4 3 2 1 0", "6 6 7 8 9 10 11", *sides]
    path = tmp_path / "prism.off"
    path.write_text("\n".join([header.format(12, len(faces)), *corners, *faces]) + "\n", encoding="ascii")
    mesh = read_mesh(path, "m", progress=str)
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    assert len(mesh.triangles) == 2 * 4 + 6 * 2
    assert np.sum(np.einsum("nc,nc->n", a, np.cross(b, c))) / 6 == pytest.approx(2 * 1.5 * np.sqrt(3))
    with pytest.raises(ValueError, match="its faces are 20 triangles, more than 19"):
        with_triangles(path.read_bytes(), 19)


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"OFF\n3 99999999999 0\n0 0 0",
        b"\x00OFF 1 1\n7",
        b"OFF\n1 1 0\n0 0 0\nx",
        b"5 1 0\n" + b"0 0 0\n" * 5 + b"5 0 1 2 3 4\n",
    ],
)
def test_what_is_no_such_file_is_left_as_it_is(data):
    assert with_triangles(data, 10) == data


def test_a_face_that_is_not_convex_is_no_fan_about_its_first_corner():
    """An arrow's: about two of its corners it is one, a U's about none."""
    arrow = [(0, 0), (3, 1), (0, 2), (1, 1.2), (1, 0.8)]
    letter = [(0, 0), (3, 0), (3, 2), (2, 2), (2, 1), (1, 1), (1, 2), (0, 2)]

    def file(corners):
        rows = [f"{x} {y} 0" for x, y in corners]
        return "\n".join(
            ["OFF", f"{len(rows)} 1 0", *rows, f"{len(rows)} " + " ".join(map(str, range(len(rows))))]
        ).encode()

    split = np.array([row.split()[1:] for row in with_triangles(file(arrow), 9).splitlines()[-3:]], dtype=int)
    a, b, c = np.array(arrow)[split].swapaxes(0, 1)
    areas = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    x, y = np.array(arrow).T
    assert np.all(areas >= 0) and areas.sum() == pytest.approx(0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
    with pytest.raises(ValueError, match=r"face 0 of 8 corners is no fan about any of them; triangulate the mesh"):
        with_triangles(file(letter), 99)
