"""Triangles of a 3MF file: a ZIP archive whose XML part `3D/3dmodel.model` lists objects, components and build items.

A build item or component places an object by x' = x A + t, twelve numbers by rows [3MF Core Specification, 3.3];
the unit is an attribute of the model, millimetre if left out. trimesh reads 3MF only with two further packages, hence
this reader. Document types, and with them all entities, are refused, and so are parts beyond the limit of bytes.

Also here: faces of OFF files as triangles: trimesh reads those of three and four corners alone.

A face of n corners becomes n - 2 triangles about one of them from which all of it is seen.
"""

import io
import zipfile
from collections import defaultdict
from collections.abc import Iterable, Iterator
from typing import Any
from xml.parsers import expat

import numpy as np

from creeping._typing import FloatArray, IntArray

PART = "3d/3dmodel.model"
DEEPEST = 16
MOST_PARTS = 1000
MOST_CORNERS = 4


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
            found = [info for info in archive.infolist() if info.filename.lower().lstrip("/") == PART]
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
                placed = (attributes["objectid"], _matrix(attributes.get("transform")))
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
            if depth > DEEPEST or parts + len(waiting) + len(inside) > MOST_PARTS:
                raise ValueError(f"its components are nested deeper than {DEEPEST} or more than {MOST_PARTS}")
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


def _matrix(text: str | None) -> FloatArray:
    """Row-vector transform (4, 4)."""
    matrix = np.eye(4)
    if text is not None:
        numbers = [float(number) for number in text.split()]
        if len(numbers) != 12:
            raise ValueError(f"a transform of {len(numbers)} numbers instead of 12")
        matrix[:, :3] = np.reshape(numbers, (4, 3))
    return matrix


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
    if max(corners, default=0) <= MOST_CORNERS:
        return data
    whole = sum(max(n - 2, 0) for n in corners)
    if whole > most:
        raise ValueError(f"its faces are {whole} triangles, more than {most}")
    points = np.array([row[:3] for row in lines[begin : begin + vertices]], dtype=float)
    split: list[list[bytes]] = []
    for number, (row, n) in enumerate(zip(rows, corners, strict=True)):
        face = row[1 : n + 1]
        if n > MOST_CORNERS:
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
