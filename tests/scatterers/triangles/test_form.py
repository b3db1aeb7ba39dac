"""Files whose rows are none of their format: what a loader passes over would become another body."""

import pytest

import scatterers as sc
from tests.fuzz import seeds


def read(tmp_path, name, data):
    path = tmp_path / name
    path.write_bytes(data)
    return sc.examined_mesh(path, "m")


def replaced(name, by, line=None):
    """A file with one row changed, a vertex unless told otherwise."""
    rows = FILES[name].split(b"\n")
    line = VERTEX[name] if line is None else line
    rows[line] = by(rows[line])
    return name, b"\n".join(rows)


def faces_of(count, face):
    """The binary PLY with another number of corners of one face."""
    data = bytearray(BINARY)
    at = len(data) - 13 * (1280 - face)
    assert data[at] == 3
    data[at] = count
    return "a.ply", bytes(data)


def headed(old, new, data):
    return "a.ply", data.replace(old, new, 1)


BINARY = seeds.ply(binary=True)
FILES = {"a.obj": seeds.obj(), "a.off": seeds.off(), "a.ply": seeds.ply(binary=False), "a.stl": seeds.stl_text()}
VERTEX = {"a.obj": 40, "a.off": 40, "a.ply": 40, "a.stl": 10}
TWICE = [b"element face 1280\n", b"property float y\n"]


@pytest.mark.parametrize(
    "file, message",
    [
        *((replaced(n, lambda row: row.replace(b".", b".\xe9", 1)), "bytes that are no characters") for n in FILES),
        *((replaced(n, lambda row: row + b" 0.1 0.2"), "1 vertex row of .* has not 3") for n in FILES if n != "a.stl"),
        *((replaced(n, lambda row: b"9" + row[1:], -2), "1 face row of .* another") for n in ("a.off", "a.ply")),
        *(((n, FILES[n] + b"3 1 2 3\n"), "states 1922 rows, it has 1923") for n in ("a.off", "a.ply")),
        (replaced("a.off", lambda row: b"1_000 " + b" ".join(row.split()[1:])), r"1 text row of a.off"),
        (("a.obj", FILES["a.obj"] + b"f 466 613999988\n"), r"1 face row of a.obj has less than 3 corners"),
        (headed(TWICE[0], 2 * TWICE[0], BINARY), "names one element twice"),
        (headed(TWICE[1], 2 * TWICE[1], FILES["a.ply"]), "names one property twice"),
        (replaced("a.obj", lambda row: row[:-5] + b"\n" + row[-5:]), "has a number where a word should be"),
        *((faces_of(count, face), "cut short or no PLY") for count, face in ((2, 0), (255, 900), (4, 1279))),
        (headed(b"face 1280", b"face 10000000000000000000000000", BINARY), r"a\.ply"),
        (headed(b"property float x", b"property float", BINARY), r"a\.ply"),
        (headed(b"list uchar int vertex_indices", b"list uchar", BINARY), r"a\.ply"),
    ],
)
def test_rows_that_are_none_are_named(file, message, tmp_path):
    with pytest.raises(ValueError, match=message):
        read(tmp_path, *file)


@pytest.mark.parametrize(
    "file",
    [
        *FILES.items(),
        # names and comments may be in any script, points may have colours, and a comment makes no file text
        ("a.obj", FILES["a.obj"].replace(b"# an ellipsoid", "# Ellipsoïde, эллипсоид".encode())),
        replaced("a.obj", lambda row: row + b" 0.1 0.2 0.3"),
        headed(b"comment an ellipsoid", b"comment made from an ascii file", BINARY),
    ],
)
def test_files_as_they_should_be(file, tmp_path):
    mesh = read(tmp_path, *file)[0]
    assert (len(mesh.vertices), len(mesh.triangles)) == (642, 1280)
