"""Meshes from files: what is read, what is repaired with a word, and every kind of bad file, named."""

import gzip
import json
import re
import struct
import zipfile

import numpy as np
import pytest
import trimesh
from body_checks import volume

from scatterers.triangles.files import TriangleMesh, read_mesh
from scatterers.triangles.quality import Choice
from scatterers.triangles.topology import crossings
from tests.fuzz import seeds

BALL = trimesh.creation.icosphere(2)
VERTICES, FACES = np.array(BALL.vertices), np.array(BALL.faces)


def mesh(vertices=VERTICES, faces=FACES):
    return trimesh.Trimesh(vertices, faces, process=False)


def read(source, units=None):
    messages = []
    found = read_mesh(source, units, progress=messages.append)
    assert found.repairs == tuple(messages)
    return found


MODEL = """<?xml version="1.0"?><model unit="{unit}" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">
<resources>{objects}</resources><build>{items}</build></model>"""
MESH = "<mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh>".format(
    vertices="".join(f'<vertex x="{x!r}" y="{y!r}" z="{z!r}"/>' for x, y, z in VERTICES.tolist()),
    triangles="".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in FACES.tolist()),
)
ITEM = '<item objectid="1" transform="1 0 0 0 1 0 0 0 -1 5 6 7"/>'


def packed(path, unit="millimeter", text=None, objects=f'<object id="1">{MESH}</object>', items=ITEM):
    text = text or MODEL.format(unit=unit, objects=objects, items=items)
    path.write_bytes(seeds.archive_3mf(text.encode()))
    return path


@pytest.mark.parametrize("kind", ["stl", "stl_ascii", "obj", "ply", "off", "glb"])
def test_formats(tmp_path, kind):
    path = tmp_path / f"ball.{kind[:3]}"
    mesh().export(path, file_type=kind)
    found = read(path, None if kind == "glb" else "m")
    assert isinstance(found, TriangleMesh) and found.repairs == ()
    assert (len(found.vertices), len(found.triangles)) == (162, 320)
    assert volume(found.vertices, found.triangles) == pytest.approx(BALL.volume, rel=1e-6)
    if kind != "glb":
        assert np.ptp(read(str(path), "mm").vertices, axis=0) == pytest.approx(np.full(3, 2e-3))


def test_3mf_states_its_unit_and_places_its_parts(tmp_path):
    found = read(packed(tmp_path / "ball.3mf"))
    # mirrored by its place, but facing outwards
    assert found.repairs == () and volume(found.vertices, found.triangles) == pytest.approx(BALL.volume * 1e-9)
    np.testing.assert_allclose(found.vertices.mean(0), [5e-3, 6e-3, 7e-3], atol=1e-9)
    assert np.ptp(read(packed(tmp_path / "b.3mf", "inch"), "in").vertices[:, 0]) == pytest.approx(0.0508)


def test_parts_of_3mf_have_the_names_of_their_objects(tmp_path):
    objects = (
        f'<object id="1" name="ball">{MESH}</object><object id="2">{MESH}</object>'
        '<object id="3" name="pair"><components><component objectid="1"/>'
        '<component objectid="2" transform="2 0 0 0 2 0 0 0 2 9 0 0"/></components></object>'
    )
    items = '<item objectid="3"/><item objectid="2" transform="3 0 0 0 3 0 0 0 3 -9 0 0"/>'
    path = packed(tmp_path / "three.3mf", objects=objects, items=items)
    # an object without a name has that of what it is a component of, if that has one
    for part, radius, centre in (("ball", 1e-3, 0.0), ("pair", 2e-3, 9e-3), ("object 2", 3e-3, -9e-3)):
        found = read_mesh(path, None, Choice(part=part), progress=str)
        assert np.ptp(found.vertices[:, 0]) == pytest.approx(2 * radius)
        assert found.vertices[:, 0].mean() == pytest.approx(centre, abs=1e-9)
    with pytest.raises(ValueError, match=r"three.3mf has no part 'cube'; it has .*ball"):
        read_mesh(path, None, Choice(part="cube"), progress=str)


def test_objects_placed_many_times_are_counted_before_they_are_made(tmp_path, monkeypatch):
    path = packed(tmp_path / "bomb.3mf", items=50 * '<item objectid="1"/>')
    monkeypatch.setattr("scatterers.triangles.files.MOST_TRIANGLES", 4000)
    with pytest.raises(ValueError, match="each where it is placed, have more than 4000 triangles"):
        read(path)


def test_objects_in_memory():
    found = read(mesh())
    np.testing.assert_array_equal(found.vertices, VERTICES)
    np.testing.assert_array_equal(found.triangles, FACES)
    assert read(mesh(), "mm").vertices.max() == pytest.approx(1e-3)
    stated = mesh()
    stated.units = "millimeters"
    assert read(stated).vertices.max() == pytest.approx(1e-3)


def test_a_part_is_placed_where_the_scene_says(tmp_path):
    parts = trimesh.Scene()
    parts.add_geometry(mesh(), transform=trimesh.transformations.translation_matrix([3, 0, 0]))
    parts.export(tmp_path / "a.glb")
    assert read(tmp_path / "a.glb").vertices.mean(0) == pytest.approx([3, 0, 0], abs=1e-6)


def test_materials_are_not_opened_and_do_not_cut_a_body(tmp_path):
    lines = ["mtllib /etc/passwd", *(f"v {x} {y} {z}" for x, y, z in VERTICES)]
    for k, (a, b, c) in enumerate(FACES + 1):
        lines += [f"usemtl m{k // 160}"] * (k % 160 == 0) + [f"f {a} {b} {c}"]
    path = tmp_path / "two.obj"
    path.write_text("\n".join(lines))
    assert len(read(path, "m").vertices) == 162


def doubled():
    return mesh(np.concatenate([VERTICES, VERTICES]), np.concatenate([FACES[:100], FACES[100:] + 162]))


def rounded():
    # each triangle with corners of its own, off by some 1e-8
    rng = np.random.default_rng(1)
    points = VERTICES[FACES].reshape(-1, 3)
    return mesh(points + 1e-8 * rng.normal(size=points.shape), np.arange(960).reshape(-1, 3))


def some_turned():
    faces = FACES.copy()
    faces[10:30] = faces[10:30, ::-1]
    return mesh(faces=faces)


REPAIRS = {
    "doubled": (doubled, r"of \d+ vertices of the mesh were doubles"),
    "rounded": (rounded, r"798 of 960 vertices of the mesh were within .* of others; merged"),
    "degenerate": (lambda: mesh(faces=np.concatenate([FACES, [[1, 1, 2]]])), "1 of 321 triangles .* degenerate"),
    "repeated": (lambda: mesh(faces=np.concatenate([FACES, FACES[:4, [1, 2, 0]]])), "4 of 324 triangles .* doubles"),
    "unused": (lambda: mesh(np.concatenate([VERTICES, [[9, 9, 9]]])), None),
    "some turned": (some_turned, "20 of 320 triangles .* turned"),
    "inside out": (lambda: mesh(faces=FACES[:, ::-1]), "all 320 triangles .* inwards"),
    "far away": (
        lambda: mesh(VERTICES + np.array([0, 1e4, 0])),
        r"10000 m from the origin; moved by \(-?0, -10000, -?0\) m",
    ),
}


@pytest.mark.parametrize("name", REPAIRS)
def test_repairs_are_told(name):
    make, message = REPAIRS[name]
    found = read(make())
    assert (len(found.vertices), len(found.triangles)) == (162, 320)
    assert volume(found.vertices, found.triangles) == pytest.approx(BALL.volume, rel=1e-6)
    assert len(found.repairs) == (message is not None)
    assert message is None or re.search(message, found.repairs[0])
    if name == "far away":
        assert np.abs(found.vertices).max() <= 1 + 1e-9


def written(name, data):
    def write(folder):
        path = folder / name
        path.write_bytes(data if isinstance(data, bytes) else data.encode())
        return path

    return write


def plain(kind, **options):
    data = mesh().export(file_type=kind, **options)
    return data if isinstance(data, bytes) else data.encode()


def fortran(data):
    return re.sub(rb"-?\d+\.\d+(e[-+]\d+)?", lambda number: b"%.9E" % float(number[0]), data).replace(b"E", b"D")


def msh(version):
    n, m = len(VERTICES), len(FACES)
    numbers = [f"{k + 1}" for k in range(n)]
    places = [f"{x!r} {y!r} {z!r}" for x, y, z in VERTICES.tolist()]
    faces = [f"{a} {b} {c}" for a, b, c in (FACES + 1).tolist()]
    if version == 2.2:
        nodes = [n, *(f"{k} {place}" for k, place in zip(numbers, places, strict=True))]
        elements = [m + 1, "9 15 2 0 1 4", *(f"{k + 10} 2 2 0 1 {face}" for k, face in enumerate(faces))]
    else:
        nodes = [f"1 {n} 1 {n}", f"2 1 0 {n}", *numbers, *places]
        elements = [f"2 {m + 1} 1 {m + 1}", "0 1 15 1", "1 4", f"2 1 2 {m}"]
        elements += [f"{k + 10} {face}" for k, face in enumerate(faces)]
    head = ["$MeshFormat", f"{version} 0 8", "$EndMeshFormat"]
    return "\n".join(
        map(str, [*head, "$Nodes", *nodes, "$EndNodes", "$Elements", *elements, "$EndElements", ""])
    ).encode()


def bdf(form):
    """Bulk data in fields of 8 or 16, or divided by commas."""
    nodes = {
        "commas": "GRID,{0},,{1:.6f},{2:.6f},{3:.6f}",
        "small": "GRID    {0:8d}        {1:8.5f}{2:8.5f}{3:8.5f}",
        "large": "GRID*   {0:16d}                {1:16.9f}{2:16.9f}*N{0}\n*N{0:<6d}{3:16.9f}",
    }[form]
    rows = ["$ a ball", "BEGIN BULK", *(nodes.format(k, *place) for k, place in enumerate(VERTICES.tolist(), 1))]
    rows += [f"CTRIA3  {k:8d}       1{a:8d}{b:8d}{c:8d}" for k, (a, b, c) in enumerate((FACES + 1).tolist(), 1)]
    return "\n".join([*rows, "ENDDATA"]).encode()


def medit():
    """A text of Medit with a comment, and a volume's tetrahedra, which are no surface."""
    head = ["MeshVersionFormatted 2 # a ball", "Dimension", "3", f"Vertices {len(VERTICES)}"]
    rows = [*(f"{x} {y} {z} 0" for x, y, z in VERTICES.tolist()), f"Triangles\n{len(FACES)}"]
    rows += [f"{a} {b} {c} 7" for a, b, c in (FACES + 1).tolist()]
    return "\n".join([*head, *rows, "Tetrahedra", "1", "1 2 3 4 0", "End", ""]).encode()


STL, ASCII, PLY, OFF, GLB, OBJ = (plain(kind) for kind in ("stl", "stl_ascii", "ply", "off", "glb", "obj"))
TEXTS = {"stl": ASCII, "obj": OBJ, "off": OFF, "ply": plain("ply", encoding="ascii")}
ENCODED = {
    "mark and CRLF": lambda data: b"\xef\xbb\xbf" + data.replace(b"\n", b"\r\n"),
    "CR": lambda data: data.replace(b"\n", b"\r"),
    "UTF-16": lambda data: data.decode().encode("utf-16"),
    "UTF-16 without a mark": lambda data: data.decode().encode("utf-16-be"),
    "Fortran": fortran,
    "zeros behind it": lambda data: data + b"\n\0\0",
}
ODD_FILES = {
    "bytes behind it": ("a.stl", STL + bytes(200), "200 bytes of a.stl behind the last of its 320 triangles left out"),
    "no count": ("a.stl", STL[:80] + bytes(4) + STL[84:], "states 0 triangles, its bytes are those of 320"),
    "count too low": ("a.stl", STL[:80] + b"\x30\1\0\0" + STL[84:], "states 304 triangles, its bytes are those of 320"),
    "a PLY": ("a.stl", PLY, "a.stl is of the kind .ply by what it holds"),
    "an OBJ": ("a.stl", OBJ, "a.stl is of the kind .obj"),
    "no ending": ("a", STL, "a is of the kind .stl"),
    "another ending": ("a.txt", OFF, "a.txt is of the kind .off"),
    "zipped 3MF": ("a.zip", None, "a.zip is of the kind .3mf"),
    "lines that go on": ("a.obj", OBJ.replace(b"f ", b"f \\\n"), None),
    "packed": ("a.stl.gz", gzip.compress(ASCII[:9000]) + gzip.compress(ASCII[9000:]), None),
    **{f"Gmsh {version}": ("a.msh", msh(version), None) for version in (2.2, 4.1)},
    "Medit": ("a.mesh", medit(), None),
    "Medit, packed": ("a.mesh.gz", gzip.compress(medit()), None),
    **{f"NASTRAN {form}": ("a.bdf", bdf(form), None) for form in ("commas", "small", "large")},
}


def check_ball(found):
    assert (len(found.vertices), len(found.triangles)) == (162, 320)
    # in half of single precision for the shortest numbers
    assert volume(found.vertices, found.triangles) == pytest.approx(BALL.volume, rel=1e-4)


@pytest.mark.parametrize("kind", TEXTS)
@pytest.mark.parametrize("how", ENCODED)
def test_texts_however_they_are_written(how, kind, tmp_path):
    found = read(written(f"a.{kind}", ENCODED[how](TEXTS[kind]))(tmp_path), "m")
    check_ball(found)
    assert found.repairs == ()


@pytest.mark.parametrize("name", ODD_FILES)
def test_files_are_taken_by_what_they_hold(name, tmp_path):
    file, data, message = ODD_FILES[name]
    path = packed(tmp_path / file, "meter") if data is None else written(file, data)(tmp_path)
    found = read(path, None if data is None else "m")
    check_ball(found)
    assert len(found.repairs) == (message is not None)
    assert message is None or message in found.repairs[0]


NAN_STL = STL[:96] + struct.pack("<f", float("nan")) + STL[100:]
XML = '<!DOCTYPE model [<!ENTITY a "aa">]><model><build/></model>'


def bomb(folder):
    raw = bytearray(seeds.archive_3mf(b" " * 2**20))
    # the directory claims 3 GB
    at = raw.rfind(b"PK\x01\x02") + 24
    raw[at : at + 4] = struct.pack("<I", 3 * 10**9)
    return written("bomb.3mf", bytes(raw))(folder)


def referring(path):
    tree = {"asset": {"version": "2.0"}, "buffers": [{"uri": "/etc/passwd", "byteLength": 9}]}
    path.write_bytes(seeds.glb(json.dumps(tree).encode(), b""))
    return path


def two_bodies(path):
    trimesh.Scene([mesh(), mesh(VERTICES + np.array([3, 0, 0]))]).export(path)
    return path


def without_model(path):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("other", "")
    return path


BAD_FILES = {
    "missing": (lambda f: f / "none.stl", "no file on this machine"),
    "address": (lambda f: "https://example.org/a.stl", "addresses are not fetched"),
    "directory": (lambda f: f, "is a directory"),
    "pickle": (written("a.pkl", b"cos\nsystem\n"), "a.pkl is of a kind that is not read"),
    "number": (lambda f: 7, "a int is no mesh"),
    "empty": (written("a.stl", b""), "a.stl is empty"),
    "cut binary": (written("a.stl", STL[:-60]), "a.stl is cut short .* 320 triangles take 16084 bytes, it has 16024"),
    "cut text": (written("a.stl", ASCII[: len(ASCII) // 2]), "a.stl is cut short .* 'endsolid'"),
    "garbage": (written("a.stl", bytes(range(256)) * 9), "a.stl is cut short or no STL"),
    "no triangles": (written("a.stl", STL[:80] + bytes(4)), "a.stl holds no triangles"),
    "cut ply": (written("a.ply", PLY[:-60]), "a.ply is cut short .* rows take 6052 bytes, it has"),
    "cut header": (written("a.ply", PLY[:60]), "a.ply is cut short .* header has no end"),
    "cut off": (written("a.off", OFF[: len(OFF) * 3 // 4]), "a.off is cut short .* 482 rows"),
    "cut glb": (written("a.glb", GLB[:-100]), "a.glb is cut short"),
    "outside buffer": (lambda f: referring(f / "a.glb"), "refers to '/etc/passwd', which is not opened"),
    "points": (written("a.obj", "v 0 0 0\nv 1 0 0\n"), "a.obj holds no triangles"),
    "no archive": (written("a.3mf", b"nothing"), "a.3mf cannot be read as 3MF: it is not a whole ZIP"),
    "no model": (lambda f: without_model(f / "a.3mf"), "no part 3D/3dmodel.model"),
    "entities": (lambda f: packed(f / "a.3mf", text=XML), "document type"),
    "broken xml": (lambda f: packed(f / "a.3mf", text="<model><build>"), "broken XML"),
    "bomb": (bomb, "unpacks to 3000000000 bytes"),
    "decimal commas": (
        written("a.stl", re.sub(rb"(\d)\.(\d)", rb"\1,\2", ASCII)),
        r"1280 lines of a.stl have decimal commas, the first is line 2, 'facet normal",
    ),
    "strips": (written("a.ply", TEXTS["ply"].replace(b"element face", b"element tristrips")), "320 tristrips, which"),
    "web page": (written("a.stl", "<!DOCTYPE html>\n<html>"), "a.stl is a web page; download the mesh itself"),
    "pointer": (
        written("a.stl", "version https://git-lfs.github.com/spec/v1\n"),
        "Git LFS, .*git lfs pull",
    ),
    "step": (written("a.stl", "ISO-10303-21;\n"), "a.stl is a STEP file; name it .step"),
    "zip": (lambda f: without_model(f / "a.zip"), "a.zip is a ZIP archive; unpack it"),
    "prose": (written("a.stl", "404: Not Found"), "a text that does not begin with 'solid'"),
    "blanks": (written("a.stl", " \n\n"), "a.stl is empty"),
    "cut pack": (written("a.stl.gz", gzip.compress(STL)[:-99]), "a.stl.gz cannot be unpacked"),
    "packed bomb": (written("a.stl.gz", gzip.compress(bytes(2**20))), "unpacks to more than 1 MB"),
    "vertex 0": (written("a.obj", OBJ + b"f 0 1 2\n"), "a.obj has a face with vertex 0"),
    "cut msh": (written("a.msh", msh(2.2)[:-99]), "a.msh cannot be read as MSH: it lacks its nodes or elements"),
    "short msh": (written("a.msh", msh(2.2).replace(b"\n162\n", b"\n99999999999\n")), "states 99999999999 rows"),
    "binary msh": (written("a.msh", b"$MeshFormat\n2.2 1 8\n"), "no text of Gmsh's versions 2.2 or 4.1"),
    "short mesh": (written("a.mesh", medit().replace(b"s 162", b"s 163")), "states 163 Vertices where it has 162"),
    "flat mesh": (written("a.mesh", "MeshVersionFormatted 2\nDimension 2\n"), "does not state three dimensions"),
    "vtk": (written("a.vtu", '<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid">'), "save its surface as STL"),
    "coordinates": (written("a.bdf", "GRID,1,3,0.,0.,0.\n"), "node 1 is in the coordinates 3"),
    "no node": (written("a.bdf", "GRID,1,,0.,0.,0.\nCTRIA3,1,1,1,1,7\n"), "node 7, which it does not hold"),
    "no number": (written("a.bdf", "GRID,1,,a,0.,0.\n"), "GRID 1 has a field that is no number"),
    "not finite": (written("a.stl", NAN_STL), "1 of 960 vertices of a.stl are not finite .the first is vertex 0"),
    "two bodies": (lambda f: two_bodies(f / "a.glb"), "a.glb holds 2 separate surfaces"),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_bad_files_are_named(tmp_path, name, monkeypatch):
    make, message = BAD_FILES[name]
    if name == "packed bomb":
        monkeypatch.setattr("scatterers.triangles.files.MOST_BYTES", 2**20 - 1)
    source = make(tmp_path)
    with pytest.raises(ValueError, match=message):
        read(source, None if str(source).endswith((".glb", ".3mf")) else "m")


@pytest.mark.parametrize("kind", ["stl", "obj", "ply", "off"])
def test_unit_has_to_be_given(tmp_path, kind):
    mesh(VERTICES * [1, 2, 3]).export(tmp_path / f"a.{kind}")
    with pytest.raises(ValueError, match=r'extends over 2 x 4 x 6 of it, .* e\.g\. units="mm"'):
        read(tmp_path / f"a.{kind}")


def test_unit_has_to_be_known_and_agree(tmp_path):
    with pytest.raises(ValueError, match="units = 'yard' is none of m, mm"):
        read(mesh(), "yard")
    path = packed(tmp_path / "a.3mf")
    with pytest.raises(ValueError, match="states its unit, mm, but units = 'm'"):
        read(path, "m")
    with pytest.raises(ValueError, match="states the unit 'furlong'"):
        read(packed(tmp_path / "b.3mf", "furlong"))


def placed(other):
    return mesh(np.concatenate([VERTICES, other]), np.concatenate([FACES, FACES + 162]))


def projective_plane():
    """Six corners, each two of which are joined."""
    after = [2, 3, 4, 5, 1]
    faces = [face for a, b in enumerate(after, 1) for face in ([0, a, b], [a, b, (a + 2) % 5 + 1])]
    return mesh(np.random.default_rng(4).normal(size=(6, 3)), np.array(faces))


class Bare:
    """What is asked of an object, without trimesh's own checks."""

    def __init__(self, vertices, faces):
        self.vertices, self.faces = vertices, faces


SPOILT = VERTICES.copy()
SPOILT[7, 1] = np.inf
SHEET = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.3, 0]])
BAD_MESHES = {
    "open": (lambda: mesh(faces=FACES[1:]), "3 of 480 edges of the mesh are open, the first near .* close them"),
    "three at an edge": (lambda: mesh(faces=np.concatenate([FACES, [[0, 1, 2]]])), "of the mesh"),
    "cavity": (lambda: placed(VERTICES / 2), "2 separate surfaces .1 of them within"),
    "two": (lambda: placed(VERTICES + 5), "2 separate surfaces, of 320, 320 triangles"),
    "torus through itself": (lambda: trimesh.creation.torus(1.0, 1.3, 24, 24), "crosses itself: .* pairs"),
    "projective plane": (projective_plane, "one side only"),
    "flat": (lambda: Bare(SHEET, [[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 2, 1]]), "encloses no volume"),
    "tiny": (lambda: Bare(VERTICES * 1e-30, FACES), "2e-30 m large"),
    "infinite": (lambda: Bare(SPOILT, FACES), "1 of 162 vertices of the mesh are not finite .* vertex 7"),
    "index": (lambda: Bare(VERTICES, FACES + 1), "refer to vertices that do not exist .vertex 162 of 162"),
    "quads": (lambda: Bare(VERTICES, FACES[:, [0, 1, 2, 2]]), "faces of the mesh have shape .320, 4."),
    "halves": (lambda: Bare(VERTICES, FACES + 0.5), "not whole numbers"),
    "rounded far away": (lambda: Bare((VERTICES + 1e5).astype(np.float32), FACES), "rounded to 0.0078, where its"),
    "torn far away": (lambda: Bare((VERTICES + 5.5e6).astype(np.float32), FACES), "rounded to 0.5, .* to the origin"),
}


@pytest.mark.parametrize("name", BAD_MESHES)
def test_bad_meshes_are_named(name):
    make, message = BAD_MESHES[name]
    with pytest.raises(ValueError, match=message):
        read(make())


def test_too_large_a_file_is_not_read(tmp_path, monkeypatch):
    monkeypatch.setattr("scatterers.triangles.files.MOST_BYTES", 1000)
    mesh().export(tmp_path / "a.stl")
    with pytest.raises(ValueError, match=r"a\.stl has 0 MB, more than"):
        read(tmp_path / "a.stl", "m")
    monkeypatch.setattr("scatterers.triangles.files.MOST_TRIANGLES", 10)
    with pytest.raises(ValueError, match="320 triangles, more than 10"):
        read(mesh())


def crossing_pairs(vertices, triangles):
    """Pairs of triangles without common vertices that cross: each edge is intersected with each plane."""
    found = set()
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    for i, corners in enumerate(triangles):
        for p, q in zip(vertices[corners], vertices[np.roll(corners, 1)], strict=True):
            # an edge of the triangle itself has no point of its own in it
            others = np.delete(np.arange(len(triangles)), i)
            matrix = np.stack([b - a, c - a, np.broadcast_to(p - q, a.shape)], axis=-1)
            s, t, u = np.linalg.solve(matrix[others], (p - a)[others, :, None])[..., 0].T
            inside = (s > 0) & (t > 0) & (s + t < 1) & (u > 0) & (u < 1)
            found |= {(min(i, j), max(i, j)) for j in others[inside].tolist()}
    return found


def test_crossings_are_those_of_brute_force():
    rng = np.random.default_rng(3)
    vertices = rng.uniform(size=(180, 3)) * 0.6 + np.repeat(rng.uniform(size=(60, 3)), 3, axis=0)
    triangles = np.arange(180).reshape(-1, 3)
    expected = crossing_pairs(vertices, triangles)
    count, pairs = crossings(vertices, triangles)
    assert len(expected) > 20 and count == len(expected)
    assert {(min(p), max(p)) for p in pairs.tolist()} == expected


def test_crossings_of_neighbours():
    # two triangles with one common vertex, and two folded onto each other at an edge
    points = np.array([[0, 0, 0], [2, -1, 0], [2, 1, 0], [1, 0, -1], [1, 0.1, 1], [2.0, 0.5, 0]], dtype=float)
    assert crossings(points, np.array([[0, 1, 2], [0, 3, 4]]))[0] == 1
    assert crossings(points, np.array([[0, 1, 2], [0, 1, 5]]))[0] == 1
    assert crossings(points, np.array([[0, 1, 2], [0, 1, 4]]))[0] == 0
