"""Whether a mesh file is whole and of the form it states: what loaders pass over would become another body.

They drop bytes that are no characters, from within numbers too, and numbers beyond those that a row should have.

Also here: small crossings of a mesh cut out: triangles that cross others go with their neighbours, and the holes are
closed.

Lids go from the border of a hole to its middle (`scatterers.triangles.parts`), and may cross something themselves: then
they are cut out again with what is around them, so that the hole grows, for a few rounds. What was cut stays a small
share of the area; else the mesh is left as it is.
"""

import re
from collections.abc import Callable

import numpy as np

from creeping._typing import FloatArray, IntArray
from scatterers.triangles.parts import areas, capped, compact, parts_of, taken_apart
from scatterers.triangles.quality import silent
from scatterers.triangles.topology import KEPT, crossings, edges_of, oriented

PLY_BYTES = {
    name: size
    for size, names in (
        (1, b"char uchar int8 uint8"),
        (2, b"short ushort int16 uint16"),
        (4, b"int uint float int32 uint32 float32"),
        (8, b"double float64 int64 uint64"),
    )
    for name in names.split()
}
"""Sizes of the numbers of a binary PLY."""
ROUNDS = 6
MOST_CUT = 0.1
"""Share of the area that may be cut out."""


Note = Callable[[str], None]


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
    at = 0
    for _, count, properties in elements:
        kinds = [line.split()[1:-1] for line in properties.strip().splitlines() if line.split()[:1] == [b"property"]]
        if any(len(kind) != (3 if kind[:1] == [b"list"] else 1) for kind in kinds):
            raise ValueError(f"the header of {name} has a property that is none; export it again")
        lists = [kind for kind in kinds if kind[0] == b"list"]
        if len(lists) > 1 or any(word not in PLY_BYTES for kind in kinds for word in kind if word != b"list"):
            return
        fixed = sum(PLY_BYTES[kind[0]] for kind in kinds if kind[0] != b"list")
        if int(count) > len(body):
            raise ValueError(f"{cut}: its header states {int(count):.3g} rows, it has {len(body)} bytes")
        if not lists:
            at += fixed * int(count)
            continue
        place = sum(PLY_BYTES[kind[0]] for kind in kinds[: kinds.index(lists[0])])
        wide, item = PLY_BYTES[lists[0][1]], PLY_BYTES[lists[0][2]]
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


def uncrossed(
    name: str, vertices: FloatArray, triangles: IntArray, largest: float, scale: float, note: Note
) -> tuple[FloatArray, IntArray]:
    """Vertices (n, 3) and triangles (m, 3) of the mesh without its crossings, as given where that cannot be done.

    ``largest`` is the size of the largest hole that is closed, m; lengths times ``scale`` are metres.
    """
    x, t, cut, share = vertices, triangles, 0, 0.0
    whole = float(areas(x, t).sum())
    for _ in range(ROUNDS):
        count, pairs = crossings(x, t)
        if not count:
            if cut:
                note(
                    f"{cut} triangles of {name} that crossed others, or next to them, {100 * share:.2g} % of its area, "
                    "cut out and their holes closed"
                )
            return x, t
        if count >= KEPT:
            break
        near = np.zeros(len(x), dtype=bool)
        near[t[pairs.ravel()]] = True
        gone = near[t].any(axis=1)
        cut += int(gone.sum())
        share += float(areas(x, t[gone]).sum()) / whole
        if share > MOST_CUT or gone.all():
            break
        closed = _closed(name, *compact(x, t[~gone]), largest, scale)
        if closed is None:
            break
        x, t = closed
    return vertices, triangles


def _closed(
    name: str, vertices: FloatArray, triangles: IntArray, largest: float, scale: float
) -> tuple[FloatArray, IntArray] | None:
    """The largest part with its holes closed, None if it is not closed then."""
    x, t = taken_apart(name, vertices, triangles, silent)
    part = parts_of(x, t)
    size = areas(x, t)
    if float(size[part > 0].sum()) > MOST_CUT * float(size.sum()):
        return None
    x, t = compact(x, t[part == 0])
    x, t = capped(name, x, t, largest, scale, silent)
    if np.any(edges_of(t).faces != 2):
        return None
    try:
        return x, oriented(name, x, t, silent)
    except ValueError:
        return None
