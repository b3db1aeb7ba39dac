"""Triangles of a mesh of finite elements: Gmsh's MSH (text, 2 and 4.1) and the bulk data of NASTRAN.

Quadrangles are two triangles each. Points, lines and volumes are no surface, and left out.
"""

import re
from collections.abc import Iterator
from itertools import islice

import numpy as np
from numpy.typing import NDArray

Read = tuple[NDArray[np.float64], NDArray[np.int64]]
CORNERS = {2: 3, 3: 4}
"""Nodes of the triangles and quadrangles of MSH files, by their kinds."""
CURVED = (9, 10, 16, 20, 21, 23, 25)
"""Kinds of those with nodes along their edges."""
CARDS = {"CTRIA3": 3, "CTRIAR": 3, "CQUAD4": 4, "CQUADR": 4}
CURVED_CARDS = ("CTRIA6", "CQUAD8", "CQUAD")


def read_msh(data: bytes) -> Read:
    r"""Vertices (n, 3) and triangles (m, 3) of an MSH file.

    Raises
    ------
    ValueError
        If it is binary, of another version, has curved elements, or is broken.

    Examples
    --------
    >>> nodes = b"$Nodes\n3\n5 0 0 0\n6 1 0 0\n9 0 1 0\n$EndNodes\n"
    >>> elements = b"$Elements\n1\n1 2 2 0 1 5 6 9\n$EndElements\n"
    >>> read_msh(b"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" + nodes + elements)[1]
    array([[0, 1, 2]])
    """
    parts = dict(re.findall(rb"^\$(\w+)\s*\n(.*?)^\$End\1\b", data, re.MULTILINE | re.DOTALL))
    version, binary = [*parts.get(b"MeshFormat", b"").split(), b"", b""][:2]
    if binary != b"0" or version not in (b"2", b"2.1", b"2.2", b"4.1"):
        raise ValueError("it is no text of Gmsh's versions 2.2 or 4.1, which alone are read")
    if b"Nodes" not in parts or b"Elements" not in parts:
        raise ValueError("it lacks its nodes or elements, or the end of them")
    nodes, elements = _lines(parts[b"Nodes"]), _lines(parts[b"Elements"])
    numbers: list[int] = []
    places: list[list[float]] = []
    faces: list[list[int]] = []
    blocks, number = (1, -1) if version != b"4.1" else (int(_rows(nodes, 1)[0][0]), 3)
    for _ in range(blocks):
        count = int(_rows(nodes, 1)[0][number])
        rows = _rows(nodes, count)
        numbers += [int(row[0]) for row in rows]
        places += [[float(word) for word in row[-3:]] for row in (rows if number < 0 else _rows(nodes, count))]
    blocks = 1 if number < 0 else int(_rows(elements, 1)[0][0])
    for _ in range(blocks):
        head = _rows(elements, 1)[0]
        for row in _rows(elements, int(head[number])):
            kind = int(row[1] if number < 0 else head[2])
            if kind in CURVED:
                raise ValueError("it has curved elements, where those of order 1 alone are read")
            faces += _split([int(word) for word in row[-CORNERS[kind] :]]) if kind in CORNERS else []
    return _numbered(numbers, places, faces)


def _lines(data: bytes) -> Iterator[list[bytes]]:
    return (line.split() for line in data.splitlines() if line.strip())


def _rows(lines: Iterator[list[bytes]], count: int) -> list[list[bytes]]:
    found = list(islice(lines, max(count, 0)))
    if len(found) != count:
        raise ValueError(f"it states {count} rows where it has {len(found)}")
    return found


def read_bdf(data: bytes) -> Read:
    r"""Vertices (n, 3) and triangles (m, 3) of the bulk data of NASTRAN, in fields of 8, 16 or divided by commas.

    Raises
    ------
    ValueError
        If nodes are in other coordinates than the basic ones, elements are curved, or a card is broken.

    Examples
    --------
    >>> nodes = b"GRID,7,,0.,0.,0.\nGRID           8           1.5+1     0.0\nGRID,9,,0.,1.,0.\n"
    >>> vertices, triangles = read_bdf(nodes + b"CTRIA3,1,1,7,8,9\n")
    >>> vertices[1].tolist(), triangles.tolist()
    ([15.0, 0.0, 0.0], [[0, 1, 2]])
    """
    numbers: list[int] = []
    places: list[list[float]] = []
    faces: list[list[int]] = []
    for name, *fields in _cards(data.decode("latin-1")):
        if name == "INCLUDE" or name in CURVED_CARDS:
            raise ValueError(f"it has the card {name}, which is not read")
        if name == "GRID" and fields[1] not in ("", "0"):
            raise ValueError(f"node {fields[0]} is in the coordinates {fields[1]}, not in the basic ones")
        try:
            if name == "GRID":
                numbers.append(int(fields[0]))
                places.append([_number(field) for field in fields[2:5]])
            elif name in CARDS:
                faces += _split([int(field) for field in fields[2 : 2 + CARDS[name]]])
        except ValueError:
            raise ValueError(f"{name} {fields[0]} has a field that is no number") from None
    return _numbered(numbers, places, faces)


def _cards(text: str) -> Iterator[list[str]]:
    """Name and fields of each card."""
    card: list[str] = []
    for raw in text.splitlines():
        line = raw.partition("$")[0].rstrip()
        if not line:
            continue
        wide = "*" in line[:8].partition(",")[0]
        if "," in line:
            fields = [field.strip() for field in line.split(",")]
        else:
            line, width = line.expandtabs(8), 16 if wide else 8
            fields = [line[:8].strip(), *(line[k : k + width].strip() for k in range(8, 72, width))]
        fields += [""] * 9
        name, fields = fields[0].rstrip("*").upper(), fields[1 : 5 if wide else 9]
        # the name of a continuation is none
        if card and (not name or name[0] in "+*"):
            card += fields
            continue
        if card:
            yield card
        card = [name.split()[0] if name else "", *fields]
    if card:
        yield card


def _number(field: str) -> float:
    """A number, whose exponent may stand without its letter."""
    return float(re.sub(r"([\d.])([-+]\d+)$", r"\1E\2", field.upper().replace("D", "E") or "0"))


def _split(corners: list[int]) -> list[list[int]]:
    return [[corners[0], *corners[k : k + 2]] for k in range(1, len(corners) - 1)]


def _numbered(numbers: list[int], places: list[list[float]], faces: list[list[int]]) -> Read:
    rows = {number: row for row, number in enumerate(numbers)}
    if len(rows) < len(numbers):
        raise ValueError(f"{len(numbers) - len(rows)} of its {len(numbers)} nodes have the number of another")
    try:
        corners = [[rows[number] for number in face] for face in faces]
    except KeyError as error:
        raise ValueError(f"an element refers to node {error}, which it does not hold") from None
    return np.array(places, dtype=float).reshape(-1, 3), np.array(corners, dtype=np.int64).reshape(-1, 3)
