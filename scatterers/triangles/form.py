"""Whether a mesh file is whole and of the form it states: what loaders pass over would become another body.

They drop bytes that are no characters, from within numbers too, and numbers beyond those that a row should have.

Also here: triangles of a 3MF file: a ZIP archive whose XML part `3D/3dmodel.model` lists objects, components and build
items.

A build item or component places an object by x' = x A + t, twelve numbers by rows [3MF Core Specification, 3.3];
the unit is an attribute of the model, millimetre if left out. trimesh reads 3MF only with two further packages, hence
this reader. Document types, and with them all entities, are refused, and so are parts beyond the limit of bytes.

Also here: faces of OFF files as triangles: trimesh reads those of three and four corners alone.

A face of n corners becomes n - 2 triangles about one of them from which all of it is seen.
"""

import io
import re
import zipfile
from collections import defaultdict
from collections.abc import Iterable, Iterator
from typing import Any
from xml.parsers import expat

import numpy as np

from creeping._typing import FloatArray, IntArray


def check_whole(name: str, suffix: str, data: bytes) -> None:
    """Refuse a file that is shorter than it says, or whose rows are none of its format.

    Raises
    ------
    ValueError
    """
    check = {".stl": _stl, ".glb": _glb, ".ply": _ply, ".off": _off, ".obj": _obj}.get(suffix)
    if check is not None:
        check(name, f"{name} is cut short or no {suffix[1:].upper()}", data)


def _stl(name: str, cut: str, data: bytes) -> None:
    count = int.from_bytes(data[80:84], "little")
    if len(data) >= 84 and len(data) == 84 + 50 * count:
        return
    if b"\0" not in data and not data.lstrip().lower().startswith(b"solid"):
        raise ValueError(f"{cut}: it is a text that does not begin with 'solid'")
    if b"\0" in data:
        raise ValueError(f"{cut}: {count} triangles take {84 + 50 * count} bytes, it has {len(data)}")
    text = data.lower()
    if b"endsolid" not in text or len(re.findall(rb"\bfacet\b", text)) != text.count(b"endfacet"):
        begun, ended = len(re.findall(rb"\bfacet\b", text)), text.count(b"endfacet")
        raise ValueError(f"{cut}: {begun} facets are begun, {ended} ended, and 'endsolid' has to follow")
    _plain(name, [line for line in text.splitlines() if line.split()[:1] not in ([b"solid"], [b"endsolid"])])


def _glb(name: str, cut: str, data: bytes) -> None:
    length = int.from_bytes(data[8:12], "little")
    if data[:4] != b"glTF" or length != len(data):
        raise ValueError(f"{cut}: its header states {length} bytes, it has {len(data)}")


def _ply(name: str, cut: str, data: bytes) -> None:
    head, _, body = data.partition(b"end_header")
    elements = re.findall(rb"^\s*element\s+(\w+)\s+(\d+)\s*$((?:\s*(?:property|comment)\b.*$)*)", head, re.MULTILINE)
    if not body:
        raise ValueError(f"{cut}: its header has no end")
    if strips := next((int(count) for kind, count, _ in elements if kind == b"tristrips"), 0):
        raise ValueError(f"{name} has its triangles in {strips} tristrips, which are not read; export single triangles")
    for what, names in [
        ("element", [kind for kind, _, _ in elements]),
        *(("property", re.findall(rb"(\w+)[ \t\r]*$", properties, re.MULTILINE)) for _, _, properties in elements),
    ]:
        if len(set(names)) < len(names):
            raise ValueError(f"the header of {name} names one {what} twice; export it again")
    kind = re.search(rb"^\s*format\s+(\w+)", head, re.MULTILINE)
    if kind is None or kind[1] != b"ascii":
        _ply_bytes(name, cut, kind is not None and b"big_endian" in kind[1], elements, body[body.find(b"\n") + 1 :])
        return
    lines = [line for line in body.splitlines() if line.strip()]
    rows = sum(int(count) for _, count, _ in elements)
    if len(lines) != rows:
        raise ValueError(f"{cut}: its header states {rows} rows, it has {len(lines)}")
    _plain(name, lines)
    at = 0
    for kind, count, properties in elements:
        mine = lines[at : at + int(count)]
        at += int(count)
        # the length of a list stands before it
        plain = len(re.findall(rb"^\s*property\s+(?!list\b)", properties, re.MULTILINE))
        if b"list" not in properties:
            _columns(name, mine, plain, kind.decode("latin-1"))
        elif plain == 0 and len(re.findall(rb"\blist\b", properties)) == 1:
            _lists(name, mine)


def _ply_bytes(name: str, cut: str, big: bool, elements: list[tuple[bytes, bytes, bytes]], body: bytes) -> None:
    """Refuse a binary PLY whose rows do not fill it; loaders take the length of its first list for that of all."""
    sizes = {
        name: size
        for size, names in (
            (1, b"char uchar int8 uint8"),
            (2, b"short ushort int16 uint16"),
            (4, b"int uint float int32 uint32 float32"),
            (8, b"double float64 int64 uint64"),
        )
        for name in names.split()
    }
    at = 0
    for _, count, properties in elements:
        kinds = [line.split()[1:-1] for line in properties.strip().splitlines() if line.split()[:1] == [b"property"]]
        if any(len(kind) != (3 if kind[:1] == [b"list"] else 1) for kind in kinds):
            raise ValueError(f"the header of {name} has a property that is none; export it again")
        lists = [kind for kind in kinds if kind[0] == b"list"]
        if len(lists) > 1 or any(word not in sizes for kind in kinds for word in kind if word != b"list"):
            return
        fixed = sum(sizes[kind[0]] for kind in kinds if kind[0] != b"list")
        if int(count) > len(body):
            raise ValueError(f"{cut}: its header states {int(count):.3g} rows, it has {len(body)} bytes")
        if not lists:
            at += fixed * int(count)
            continue
        place = sum(sizes[kind[0]] for kind in kinds[: kinds.index(lists[0])])
        wide, item = sizes[lists[0][1]], sizes[lists[0][2]]
        # all as long as the first, in most files
        length = int.from_bytes(body[at + place : at + place + wide], "big" if big else "little")
        step = fixed + wide + item * length
        first = body[at + place : at + place + wide]
        if all(
            body[at + place + k : at + step * int(count) : step] == first[k : k + 1] * int(count) for k in range(wide)
        ):
            at += step * int(count)
            continue
        for _ in range(int(count)):
            length = int.from_bytes(body[at + place : at + place + wide], "big" if big else "little")
            at += fixed + wide + item * length
            if at > len(body):
                break
    if at != len(body):
        raise ValueError(f"{cut}: its rows take {at} bytes, it has {len(body)}")


def _off(name: str, cut: str, data: bytes) -> None:
    lines = [line for line in (raw.partition(b"#")[0].split() for raw in data.splitlines()) if line]
    joined = bool(lines) and len(lines[0]) > 1
    numbers = [word for line in lines[:2] for word in line if word.isdigit()]
    held = len(lines) - (1 if joined else 2)
    if len(numbers) < 2:
        return
    vertices, faces = int(numbers[0]), int(numbers[1])
    if held != vertices + faces:
        raise ValueError(f"{cut}: its header states {vertices + faces} rows, it has {held}")
    rows = [b" ".join(line) for line in lines[1 if joined else 2 :]]
    _plain(name, rows)
    # COFF and its like have colours and normals besides
    if lines[0][0].upper() == b"OFF":
        _columns(name, rows[:vertices], 3, "vertex")
    _lists(name, rows[vertices:], exact=False)


def _obj(name: str, cut: str, data: bytes) -> None:
    rows = [line.split() for line in data.splitlines()]
    geometry = [row for row in rows if row[:1] in ([b"v"], [b"f"])]
    _plain(name, [b" ".join(row) for row in geometry])
    torn = sum(bool(row) and re.match(rb"[-+.]?\d", row[0]) is not None for row in rows)
    if torn:
        raise ValueError(f"{_of(torn, 'text', name)} a number where a word should be; export it again")
    if re.search(rb"^\s*f\s(?:.*\s)?0+(?:/|\s|$)", data, re.MULTILINE):
        raise ValueError(f"{name} has a face with vertex 0, where the first is 1; export it again")
    # x y z, with a weight or a colour
    wrong = [row for row in geometry if row[0] == b"v" and _length(row) - 1 not in (3, 4, 6, 7)]
    few = sum(row[0] == b"f" and _length(row) < 4 for row in geometry)
    if few:
        raise ValueError(f"{_of(few, 'face', name)} less than 3 corners; export it again")
    if wrong:
        raise ValueError(f"{_of(len(wrong), 'vertex', name)} not 3, 4, 6 or 7 numbers; export it again")


def _length(row: list[bytes]) -> int:
    """Words before a comment."""
    return next((k for k, word in enumerate(row) if word.startswith(b"#")), len(row))


def _plain(name: str, rows: list[bytes]) -> None:
    """Refuse rows with bytes that loaders leave out of numbers: what is no ASCII, and underlines, as in Python."""
    wrong = sum(not row.isascii() or b"_" in row for row in rows)
    if wrong:
        raise ValueError(f"{_of(wrong, 'text', name)} bytes that are no characters of numbers; export it again")


def _columns(name: str, rows: list[bytes], count: int, kind: str) -> None:
    wrong = sum(len(row.split()) != count for row in rows)
    if wrong:
        raise ValueError(f"{_of(wrong, kind, name)} not {count} numbers; export it again")


def _lists(name: str, rows: list[bytes], *, exact: bool = True) -> None:
    """Refuse rows of lists whose number of members is not what stands first; colours may follow if not exact."""
    wrong = 0
    for row in rows:
        first, *members = row.split()
        count = int(first) if first.isdigit() and len(first) < 10 else -1
        fits = len(members) == count or (not exact and len(members) > count >= 3)
        fits &= all(word.isdigit() for word in members[: max(count, 0)])
        wrong += not fits
    if wrong:
        raise ValueError(f"{_of(wrong, 'face', name)} another number of corners than they state; export it again")


def _of(count: int, kind: str, name: str) -> str:
    return f"{count} {kind} row{'s' if count > 1 else ''} of {name} {'have' if count > 1 else 'has'}"


Names = tuple[tuple[str, int], ...]
Placed = tuple[str, Any, Any, FloatArray]


def read_3mf(data: bytes, limit: int, most_triangles: int) -> tuple[FloatArray, IntArray, str, Names]:
    """Vertices (n, 3) in the file's unit, triangles (m, 3), the unit's name, and the parts: name and triangles of each.

    A part has the name of its object, else that of the object that it is a component of, else "object" and its number.

    Raises
    ------
    ValueError
        If the archive or its model is broken, too large, or refers to parts that are not read.
    """
    model = _Model()
    parser = expat.ParserCreate(namespace_separator=" ")
    parser.StartElementHandler = model.start
    parser.StartDoctypeDeclHandler = model.refuse
    try:
        parser.Parse(_part(data, limit), True)
    except expat.ExpatError as error:
        raise ValueError(f"its model is broken XML ({error})") from None
    except KeyError as error:
        raise ValueError(f"an element of its model lacks the attribute {error}") from None
    vertices, triangles, names = assembled(model.placed(), most_triangles)
    return vertices, triangles, model.unit, names


def _part(data: bytes, limit: int) -> bytes:
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            found = [info for info in archive.infolist() if info.filename.lower().lstrip("/") == "3d/3dmodel.model"]
            if not found:
                raise ValueError("it holds no part 3D/3dmodel.model")
            if found[0].file_size > limit:
                raise ValueError(f"its model unpacks to {found[0].file_size} bytes, more than {limit}")
            with archive.open(found[0]) as stream:
                return stream.read(limit)
    except (zipfile.BadZipFile, EOFError, RuntimeError, NotImplementedError, OSError) as error:
        raise ValueError(f"it is not a whole ZIP archive ({error})") from None
    except Exception as error:  # zlib.error is no subclass of the above
        raise ValueError(str(error)) from None


class _Model:
    """What the elements of the XML part say."""

    def __init__(self) -> None:
        self.unit = "millimeter"
        self.vertices: dict[str, list[tuple[float, float, float]]] = defaultdict(list)
        self.triangles: dict[str, list[tuple[int, int, int]]] = defaultdict(list)
        self.components: dict[str, list[tuple[str, FloatArray]]] = defaultdict(list)
        self.items: list[tuple[str, FloatArray]] = []
        self.names: dict[str, str] = {}
        self.object = ""

    def refuse(self, *_: Any) -> None:
        raise ValueError("its model declares a document type, which is not read")

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        match tag.rpartition(" ")[2]:
            case "model":
                self.unit = attributes.get("unit", self.unit)
            case "object":
                self.object = attributes["id"]
                if attributes.get("name"):
                    self.names[self.object] = attributes["name"]
            case "vertex":
                self.vertices[self.object].append(
                    (float(attributes["x"]), float(attributes["y"]), float(attributes["z"]))
                )
            case "triangle":
                self.triangles[self.object].append(
                    (int(attributes["v1"]), int(attributes["v2"]), int(attributes["v3"]))
                )
            case "component" | "item" as kind:
                if any(name.endswith("path") for name in attributes):
                    raise ValueError("it refers to objects in other parts of the archive; export one body as one part")
                # row-vector transform (4, 4)
                text = attributes.get("transform")
                matrix = np.eye(4)
                if text is not None:
                    numbers = [float(number) for number in text.split()]
                    if len(numbers) != 12:
                        raise ValueError(f"a transform of {len(numbers)} numbers instead of 12")
                    matrix[:, :3] = np.reshape(numbers, (4, 3))
                placed = (attributes["objectid"], matrix)
                (self.items if kind == "item" else self.components[self.object]).append(placed)

    def placed(self) -> Iterator[Placed]:
        """All objects that are built: name, vertices, triangles, and the matrix by which they are put."""
        waiting = [(name, matrix, 0, "") for name, matrix in self.items]
        parts = 0
        while waiting:
            name, matrix, depth, above = waiting.pop()
            own = self.names.get(name, above)
            parts += 1
            inside = self.components.get(name, [])
            if depth > 16 or parts + len(waiting) + len(inside) > 1000:
                raise ValueError("its components are nested deeper than 16 or more than 1000")
            waiting += [(inner, np.asarray(m @ matrix), depth + 1, own) for inner, m in inside]
            yield own or f"object {name}", self.vertices.get(name, []), self.triangles.get(name, []), matrix.T


def assembled(parts: Iterable[Placed], most: int) -> tuple[FloatArray, IntArray, Names]:
    """Vertices (n, 3) and triangles (m, 3) of parts, each where it is placed, with names and numbers of triangles.

    Raises
    ------
    ValueError
        If there are more than ``most`` triangles, before they are made, or one refers to a vertex that does not exist.
    """
    vertices, triangles, count, placed = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], 0, 0
    names = []
    for name, own, faces, matrix in parts:
        # each placement repeats its triangles
        placed += len(faces)
        if placed > most:
            raise ValueError(f"its parts, each where it is placed, have more than {most} triangles")
        if not len(faces):
            continue
        points, corners = np.array(own, dtype=float).reshape(-1, 3), np.array(faces, dtype=np.int64)
        if corners.min() < 0 or corners.max() >= len(points):
            raise ValueError(f"a triangle of {name} refers to vertex {corners.max()} of {len(points)}")
        if not np.array_equal(matrix, np.eye(4)):
            points = points @ matrix[:3, :3].T + matrix[:3, 3]
            # a placement that mirrors turns the triangles inside out
            corners = corners if np.linalg.det(matrix[:3, :3]) > 0 else corners[:, ::-1]
        vertices.append(points)
        triangles.append(corners + count)
        names.append((name, len(corners)))
        count += len(points)
    return np.concatenate(vertices), np.concatenate(triangles), tuple(names)


def with_triangles(data: bytes, most: int) -> bytes:
    r"""The same file with its larger faces as triangles; as it is if it has none, or is no OFF file.

    Its rows are those that its header states, as `scatterers.triangles.form.check_whole` has made sure.

    Raises
    ------
    ValueError
        If it has more than ``most`` triangles then, or a larger face that is no fan about a corner.

    Examples
    --------
    >>> pentagon = b"OFF\n5 1 0\n0 0 0\n2 0 0\n3 1 0\n2 2 0\n0 2 0\n5 0 1 2 3 4\n"
    >>> with_triangles(pentagon, 100).splitlines()[-3:]
    [b'3 0 1 2', b'3 0 2 3', b'3 0 3 4']
    """
    lines = [line for line in (raw.partition(b"#")[0].split() for raw in data.splitlines()) if line]
    begin = 1 if lines and len(lines[0]) > 1 else 2
    header = [word for line in lines[:begin] for word in line]
    if len(header) < 3 or not header[0].endswith(b"OFF") or not (header[1] + header[2]).isdigit():
        return data
    vertices, faces = int(header[1]), int(header[2])
    rows = lines[begin + vertices : begin + vertices + faces]
    corners = [int(row[0]) if row[0].isdigit() else 0 for row in rows]
    if max(corners, default=0) <= 4:
        return data
    whole = sum(max(n - 2, 0) for n in corners)
    if whole > most:
        raise ValueError(f"its faces are {whole} triangles, more than {most}")
    points = np.array([row[:3] for row in lines[begin : begin + vertices]], dtype=float)
    split: list[list[bytes]] = []
    for number, (row, n) in enumerate(zip(rows, corners, strict=True)):
        face = row[1 : n + 1]
        if n > 4:
            face = _turned(face, points, number)
        split += [[b"3", face[0], *face[k : k + 2]] for k in range(1, n - 1)]
    states = [[header[0]], [str(vertices).encode(), str(len(split)).encode(), b"0"]]
    return b"\n".join(b" ".join(row) for row in [*states, *lines[begin : begin + vertices], *split]) + b"\n"


def _turned(face: list[bytes], points: FloatArray, number: int) -> list[bytes]:
    """The corners of a face, begun with one about which no triangle is turned over."""
    places = np.array([int(word) for word in face])
    if places.max() >= len(points):
        raise ValueError(f"face {number} refers to vertex {places.max()} of {len(points)}")
    for first in range(len(face)):
        away = np.roll(points[places], -first, axis=0) - points[places[first]]
        areas = np.cross(away[1:-1], away[2:])
        if np.all(areas @ areas.sum(axis=0) >= 0):
            return face[first:] + face[:first]
    raise ValueError(f"face {number} of {len(face)} corners is no fan about any of them; triangulate the mesh")
