"""Files whose rows are none of their format: what a loader passes over would become another body."""

import pytest

import scatterers as sc
from studies.fuzz import seeds


def read(tmp_path, name, data):
    path = tmp_path / name
    path.write_bytes(data)
    return sc.examined_mesh(path, "m")


def replaced(data, line, by):
    rows = data.split(b"\n")
    rows[line] = by(rows[line])
    return b"\n".join(rows)


FILES = {"a.obj": seeds.obj(), "a.off": seeds.off(), "a.ply": seeds.ply(binary=False), "a.stl": seeds.stl_text()}
VERTEX = {"a.obj": 40, "a.off": 40, "a.ply": 40, "a.stl": 10}


@pytest.mark.parametrize("name", FILES)
def test_files_as_they_should_be(name, tmp_path):
    assert len(read(tmp_path, name, FILES[name])[0].triangles) == 1280


@pytest.mark.parametrize("name", FILES)
def test_bytes_that_are_no_characters_are_not_left_out_of_numbers(name, tmp_path):
    damaged = replaced(FILES[name], VERTEX[name], lambda row: row.replace(b".", b".\xe9", 1))
    with pytest.raises(ValueError, match=r"1 text row of .* bytes that are no characters"):
        read(tmp_path, name, damaged)


@pytest.mark.parametrize("name", ["a.obj", "a.off", "a.ply"])
def test_numbers_beyond_those_of_a_point(name, tmp_path):
    damaged = replaced(FILES[name], VERTEX[name], lambda row: row + b" 0.1 0.2")
    with pytest.raises(ValueError, match=r"1 vertex row of .* has not 3"):
        read(tmp_path, name, damaged)


@pytest.mark.parametrize("name", ["a.off", "a.ply"])
def test_faces_of_another_number_of_corners(name, tmp_path):
    damaged = replaced(FILES[name], -2, lambda row: b"9" + row[1:])
    with pytest.raises(ValueError, match=r"1 face row of .* another number of corners"):
        read(tmp_path, name, damaged)


@pytest.mark.parametrize("name", ["a.off", "a.ply"])
def test_rows_beyond_those_that_are_stated(name, tmp_path):
    damaged = FILES[name] + FILES[name].split(b"\n")[-2] + b"\n"
    with pytest.raises(ValueError, match="states 1922 rows, it has 1923"):
        read(tmp_path, name, damaged)


def test_names_and_comments_may_be_in_any_script(tmp_path):
    named = FILES["a.obj"].replace(b"# an ellipsoid", "# Ellipsoïde, эллипсоид".encode())
    assert len(read(tmp_path, "a.obj", named)[0].vertices) == 642
    colours = replaced(FILES["a.obj"], 40, lambda row: row + b" 0.1 0.2 0.3")
    assert len(read(tmp_path, "a.obj", colours)[0].vertices) == 642


def test_underlines_are_no_part_of_numbers(tmp_path):
    damaged = replaced(FILES["a.off"], 40, lambda row: b"1_000 " + b" ".join(row.split()[1:]))
    with pytest.raises(ValueError, match=r"1 text row of a.off"):
        read(tmp_path, "a.off", damaged)


def test_faces_of_two_corners(tmp_path):
    with pytest.raises(ValueError, match=r"1 face row of a.obj has less than 3 corners"):
        read(tmp_path, "a.obj", FILES["a.obj"] + b"f 466 613999988\n")


@pytest.mark.parametrize("line, what", [(b"element face 1280", "element"), (b"property float y", "property")])
def test_a_header_that_names_something_twice(line, what, tmp_path):
    for data in (seeds.ply(binary=True), FILES["a.ply"]):
        with pytest.raises(ValueError, match=rf"names one {what} twice"):
            read(tmp_path, "a.ply", data.replace(line + b"\n", line + b"\n" + line + b"\n", 1))


def test_a_row_that_is_torn_in_two(tmp_path):
    damaged = replaced(FILES["a.obj"], 40, lambda row: row[:-5] + b"\n" + row[-5:])
    with pytest.raises(ValueError, match=r"1 text row of a.obj has a number where a word should be"):
        read(tmp_path, "a.obj", damaged)


@pytest.mark.parametrize("face", [0, 900, 1279])
@pytest.mark.parametrize("corners", [2, 4, 255])
def test_binary_faces_of_other_lengths(face, corners, tmp_path):
    data = bytearray(seeds.ply(binary=True))
    assert len(read(tmp_path, "a.ply", bytes(data))[0].triangles) == 1280
    at = len(data) - 13 * (1280 - face)
    assert data[at] == 3
    data[at] = corners
    with pytest.raises(ValueError, match="cut short or no PLY"):
        read(tmp_path, "a.ply", bytes(data))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"element face 1280", b"element face 10000000000000000000000000"),
        (b"property float x", b"property float"),
        (b"property list uchar int vertex_indices", b"property list uchar"),
    ],
)
def test_headers_of_binary_files_that_cannot_be(old, new, tmp_path):
    with pytest.raises(ValueError, match=r"a\.ply"):
        read(tmp_path, "a.ply", seeds.ply(binary=True).replace(old, new))


def test_a_comment_does_not_make_a_file_text(tmp_path):
    data = seeds.ply(binary=True).replace(b"comment an ellipsoid", b"comment made from an ascii file")
    assert len(read(tmp_path, "a.ply", data)[0].triangles) == 1280
