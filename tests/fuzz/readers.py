"""What a mesh file holds, read a second time by other code, as strictly as the formats are defined.

A reader returns the corners of all triangles (n, 3, 3), or raises `UnclearError` where the definition leaves no one
meaning. It judges whether a file that was accepted became the body that it describes; it imports nothing of the
readers judged.
"""

import io
import json
import struct
import xml.etree.ElementTree as ElementTree
import zipfile
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


class UnclearError(ValueError):
    """The file is none of its kind, or has no one meaning."""


def corners_of(kind: str, data: bytes) -> FloatArray:
    """Corners of the triangles of a file.

    Parameters
    ----------
    kind : str
        Suffix without a point.
    data : bytes

    Raises
    ------
    UnclearError
    """
    try:
        return np.asarray(_READERS[kind](data), dtype=float).reshape(-1, 3, 3)
    except UnclearError:
        raise
    except Exception as error:
        raise UnclearError(repr(error)[:200]) from error


def _stl(data: bytes) -> FloatArray:
    if len(data) >= 84 and len(data) == 84 + 50 * struct.unpack_from("<I", data, 80)[0]:
        rows = np.frombuffer(data, dtype=[("n", "<f4", 3), ("c", "<f4", (3, 3)), ("a", "<u2")], offset=84)
        return rows["c"].astype(float)
    words = _lines(data)
    if words[0][0] != "solid" or words[-1][0] != "endsolid" or (len(words) - 2) % 7:
        raise UnclearError("not facets between solid and endsolid")
    corners = []
    for k in range(1, len(words) - 1, 7):
        facet, loop, *points, end_loop, end_facet = words[k : k + 7]
        if facet[:2] != ["facet", "normal"] or loop != ["outer", "loop"]:
            raise UnclearError("no facet")
        if end_loop != ["endloop"] or end_facet != ["endfacet"] or any(p[0] != "vertex" or len(p) != 4 for p in points):
            raise UnclearError("no end of a facet")
        corners.append([list(map(_number, p[1:])) for p in points])
    return np.array(corners)


def _obj(data: bytes) -> FloatArray:
    points: list[list[float]] = []
    corners: list[tuple[int, ...]] = []
    for words in _lines(data, comment="#"):
        if words[0] == "v":
            # a weight or a colour may follow
            points.append(list(map(_number, words[1:4])))
        elif words[0] == "f":
            numbers = [int(word.split("/")[0]) for word in words[1:]]
            if 0 in numbers or len(numbers) < 3:
                raise UnclearError("vertex 0")
            polygon = [n - 1 if n > 0 else len(points) + n for n in numbers]
            corners += [(polygon[0], *pair) for pair in pairwise(polygon[1:])]
        elif words[0] not in ("o", "g", "s", "vn", "vt", "usemtl", "mtllib"):
            raise UnclearError(words[0])
    return _picked(points, corners)


def _off(data: bytes) -> FloatArray:
    lines = _lines(data, comment="#")
    if lines[0] != ["OFF"] or len(lines[1]) < 2:
        raise UnclearError("no head")
    n, m = int(lines[1][0]), int(lines[1][1])
    if n < 0 or m < 0 or len(lines) != 2 + n + m or any(len(line) != 3 for line in lines[2 : 2 + n]):
        raise UnclearError("another number of rows")
    points = [list(map(_number, line)) for line in lines[2 : 2 + n]]
    return _picked(points, [_triangle(line) for line in lines[2 + n :]])


def _ply(data: bytes) -> FloatArray:
    head, found, body = data.partition(b"end_header\n")
    lines = [line for line in _lines(head) if line[0] != "comment"]
    counts = {line[1]: int(line[2]) for line in lines if line[0] == "element"}
    expected = [["ply"], ["format", lines[1][1], "1.0"], ["element", "vertex", lines[2][2]]]
    expected += [["property", "float", axis] for axis in "xyz"] + [["element", "face", lines[6][2]]]
    expected += [["property", "list", "uchar", "int", "vertex_indices"]]
    if not found or lines != expected or min(counts.values()) < 0:
        raise UnclearError("another head")
    n, m = counts["vertex"], counts["face"]
    if lines[1][1] == "ascii":
        rows = _lines(body)
        if len(rows) != n + m or any(len(row) != 3 for row in rows[:n]):
            raise UnclearError("another number of rows")
        return _picked([list(map(_number, row)) for row in rows[:n]], [_triangle(row) for row in rows[n:]])
    kinds = {"binary_little_endian": "<", "binary_big_endian": ">"}
    order = kinds[lines[1][1]]
    if len(body) != 12 * n + 13 * m:
        raise UnclearError("another number of bytes")
    faces = np.frombuffer(body, dtype=[("k", "u1"), ("c", f"{order}i4", 3)], offset=12 * n)
    if np.any(faces["k"] != 3):
        raise UnclearError("polygons")
    return _picked(np.frombuffer(body, f"{order}f4", 3 * n).reshape(-1, 3).tolist(), faces["c"].tolist())


def _glb(data: bytes) -> FloatArray:
    magic, version, length = struct.unpack_from("<4sII", data)
    size, kind = struct.unpack_from("<II", data, 12)
    text, rest = data[20 : 20 + size], data[20 + size :]
    if magic != b"glTF" or version != 2 or length != len(data) or kind != 0x4E4F534A:
        raise UnclearError("another head")
    tree = json.loads(text)
    binary = rest[8:]
    if struct.unpack_from("<II", rest) != (len(binary), 0x004E4942):
        raise UnclearError("another second part")
    (node,) = tree["nodes"]
    (mesh,) = tree["meshes"]
    (part,) = mesh["primitives"]
    if node != {"mesh": 0, "name": node.get("name")} or tree["scenes"] != [{"nodes": [0]}] or tree["scene"] != 0:
        raise UnclearError("another scene")
    if part != {"attributes": {"POSITION": 0}, "indices": 1, "mode": 4}:
        raise UnclearError("another mesh")
    if [set(buffer) for buffer in tree["buffers"]] != [{"byteLength"}] or tree["asset"] != {"version": "2.0"}:
        raise UnclearError("another buffer")
    arrays = []
    for accessor, code, shape in zip(tree["accessors"], (5126, 5125), ("VEC3", "SCALAR"), strict=True):
        view = tree["bufferViews"][accessor["bufferView"]]
        named = {"bufferView": accessor["bufferView"], "componentType": code, "count": accessor["count"], "type": shape}
        if accessor != named or set(view) != {"buffer", "byteOffset", "byteLength"} or view["buffer"] != 0:
            raise UnclearError("another array")
        count = accessor["count"] * (3 if shape == "VEC3" else 1)
        if not (isinstance(count, int) and count >= 0 and view["byteOffset"] >= 0 and 4 * count <= view["byteLength"]):
            raise UnclearError("an array beyond its bytes")
        arrays.append(np.frombuffer(binary, "<f4" if code == 5126 else "<u4", count, view["byteOffset"]))
    return _picked(arrays[0].reshape(-1, 3).tolist(), arrays[1].reshape(-1, 3).tolist())


def _3mf(data: bytes) -> FloatArray:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        root = ElementTree.fromstring(archive.read("3D/3dmodel.model"))
    space = root.tag.rpartition("}")[0] + "}"
    if root.tag != f"{space}model" or root.get("unit") != "meter":
        raise UnclearError("another unit")
    if [[e.tag.removeprefix(space) for e in part] for part in root] != [["object"], ["item"]]:
        raise UnclearError("other objects")
    thing, item = root[0][0], root[1][0]
    if dict(item.attrib) != {"objectid": thing.get("id")} or [e.tag for e in thing] != [f"{space}mesh"]:
        raise UnclearError("another placement")
    points, corners = thing[0]
    if points.tag != f"{space}vertices" or corners.tag != f"{space}triangles":
        raise UnclearError("another mesh")
    return _picked(
        [[_number(e.attrib[axis]) for axis in "xyz"] for e in points.iter(f"{space}vertex")],
        [[int(e.attrib[name]) for name in ("v1", "v2", "v3")] for e in corners.iter(f"{space}triangle")],
    )


def _lines(data: bytes, comment: str = "") -> list[list[str]]:
    lines = data.decode("ascii").splitlines()
    parts = (line.partition(comment)[0].split() if comment else line.split() for line in lines)
    return [words for words in parts if words]


def _number(word: str) -> float:
    if "_" in word:
        raise UnclearError(word)
    return float(word)


def _triangle(words: list[str]) -> list[int]:
    # a colour may follow
    if words[0] != "3" or len(words) < 4:
        raise UnclearError("no triangle")
    return [int(word) for word in words[1:4]]


def _picked(points: list[list[float]], corners: Sequence[Sequence[int]]) -> FloatArray:
    numbers = np.asarray(corners, dtype=np.int64).reshape(-1, 3)
    if numbers.size and not 0 <= numbers.min() <= numbers.max() < len(points):
        raise UnclearError("a vertex that is not there")
    return np.asarray(points, dtype=float).reshape(-1, 3)[numbers]


_READERS: dict[str, Callable[[bytes], FloatArray]] = {
    "stl": _stl, "obj": _obj, "off": _off, "ply": _ply, "glb": _glb, "3mf": _3mf,
}  # fmt: skip
