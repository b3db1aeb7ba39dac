r"""Triangles of a mesh of finite elements: Gmsh's MSH (text, 2 and 4.1), Medit's text, the bulk data of NASTRAN.

Quadrangles are two triangles each. Points, lines and volumes are no surface, and left out.

Also here: what a file holds, whatever its name says: packed, in another encoding, of another kind, or no mesh at all.

Texts get UTF-8, "\n" at the ends of lines and numbers with E for the D of Fortran, as loaders take them.
"""

import gzip
import io
import re
import zlib
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path

import numpy as np

from creeping._typing import FloatArray, IntArray

SUFFIXES = (".stl", ".obj", ".ply", ".off", ".glb", ".3mf", ".msh", ".bdf", ".mesh")
"""Endings of names of files that are read, beside .nas, which is .bdf, and .gz."""
MESHES = {
    ".ply": rb"ply[ \t]*[\r\n]",
    ".glb": rb"glTF",
    ".off": rb"\s*(ST)?C?N?4?OFF\b",
    ".stl": rb"\s*(?i:solid)\b(?s:.*?)\bfacet\b",
    ".msh": rb"\s*\$(MeshFormat|Comments)\b",
    ".mesh": rb"\s*(#.*\s*)*MeshVersionFormatted\b",
    ".obj": rb"(?s:.*[\r\n])??[ \t]*v[ \t]+[-+.\d]",
    ".bdf": rb"(?s:.*[\r\n])??(BEGIN BULK|GRID\b)",
}
OTHERS = {
    rb"version https://git-lfs": "a pointer of Git LFS, which stands for the file; run `git lfs pull`",
    rb"\s*(<!--(?s:.*?)-->\s*)?<(!doctype html|html|head|body)\b": "a web page; download the mesh itself",
    rb"\s*ISO-10303-21": "a STEP file; name it .step, unpacked",
    rb"\s*(DBRep_DrawableShape|CASCADE Topology)": "a BREP file; name it .brep, unpacked",
    rb".{72}S {6}1": "an IGES file; name it .iges, unpacked",
    rb"\s*\w*OFF BINARY": "a binary OFF file; export it as text",
    rb"PK\x03\x04": "a ZIP archive; unpack it, and give the mesh in it",
    rb"(\x1f\x8b|7z\xbc\xaf|Rar!|BZh|\xfd7zXZ|\x28\xb5\x2f\xfd)": "packed; unpack it, and give the mesh in it",
    rb"%PDF": "a PDF document; export the body as a mesh",
    rb"(\x89PNG|\xff\xd8\xff|GIF8|II\*\0|MM\0\*)": "a picture; export the body as a mesh",
    rb"\x89HDF": "an HDF5 file; export the body as a mesh",
    rb"(# vtk DataFile|\s*(<\?xml[^>]*>\s*)?<VTKFile)": "a VTK file; save its surface as STL",
    rb"\s*<(\?xml|COLLADA)": "an XML file; export the body as a mesh",
    rb"\s*\{": "a JSON file, such as glTF in parts; export the body as .glb",
}
"""Beginnings of files that are no meshes that are read, what they are, and what to do."""
HEAD = 4096
"""Bytes that tell what a file is."""


Read = tuple[FloatArray, IntArray]

Note = Callable[[str], None]


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
    # nodes of triangles and quadrangles by their kinds, and the kinds of those with nodes along their edges
    flat, curved = {2: 3, 3: 4}, (9, 10, 16, 20, 21, 23, 25)
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
            if kind in curved:
                raise ValueError("it has curved elements, where those of order 1 alone are read")
            faces += _split([int(word) for word in row[-flat[kind] :]]) if kind in flat else []
    return _numbered(numbers, places, faces)


def read_medit(data: bytes) -> Read:
    r"""Vertices (n, 3) and triangles (m, 3) of a text of Medit, a .mesh file.

    Raises
    ------
    ValueError
        If it is not of three dimensions, has curved elements, or is broken.

    Examples
    --------
    >>> points = b"Vertices 3\n0 0 0 1\n1 0 0 1\n0 1 0 1\n"
    >>> read_medit(b"MeshVersionFormatted 2 Dimension 3\n" + points + b"Triangles 1\n1 2 3 0\nEnd\n")[1]
    array([[0, 1, 2]])
    """
    parts = dict(re.findall(rb"([A-Z]\w*)((?:\s+[-+.\d][-+.\deE]*)*)", re.sub(rb"#.*", b"", data)))
    if parts.get(b"Dimension", b"").split() != [b"3"]:
        raise ValueError("it does not state three dimensions")
    if any(name.startswith((b"TrianglesP", b"QuadrilateralsQ")) for name in parts):
        raise ValueError("it has curved elements, where those of order 1 alone are read")

    def table(name: bytes, width: int) -> list[list[bytes]]:
        count, *words = parts.get(name, b"").split() or [b"0"]
        if len(words) != int(count) * (width + 1):
            raise ValueError(f"it states {int(count)} {name.decode()} where it has {len(words) / (width + 1):g}")
        return [words[row : row + width] for row in range(0, len(words), width + 1)]

    places = [[float(word) for word in row] for row in table(b"Vertices", 3)]
    sides = [row for name, width in ((b"Triangles", 3), (b"Quadrilaterals", 4)) for row in table(name, width)]
    faces = [face for row in sides for face in _split([int(word) for word in row])]
    return _numbered([*range(1, len(places) + 1)], places, faces)


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
    corners = {"CTRIA3": 3, "CTRIAR": 3, "CQUAD4": 4, "CQUADR": 4}
    numbers: list[int] = []
    places: list[list[float]] = []
    faces: list[list[int]] = []
    for name, *fields in _cards(data.decode("latin-1")):
        if name == "INCLUDE" or name in ("CTRIA6", "CQUAD8", "CQUAD"):
            raise ValueError(f"it has the card {name}, which is not read")
        if name == "GRID" and fields[1] not in ("", "0"):
            raise ValueError(f"node {fields[0]} is in the coordinates {fields[1]}, not in the basic ones")
        try:
            if name == "GRID":
                numbers.append(int(fields[0]))
                places.append([_number(field) for field in fields[2:5]])
            elif name in corners:
                faces += _split([int(field) for field in fields[2 : 2 + corners[name]]])
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


def understood(name: str, suffix: str, data: bytes, limit: int, note: Note) -> tuple[str, bytes]:
    """Ending that belongs to what a file holds, and that as loaders take it.

    Raises
    ------
    ValueError
        If it is no mesh of a kind that is read; says what it is.
    """
    # beginnings with a byte order mark or without
    utf16 = {
        rb"\xff\xfe|\xfe\xff": "utf-16",
        rb"([\t\n\r -~]\0){16}": "utf-16-le",
        rb"(\0[\t\n\r -~]){16}": "utf-16-be",
    }
    if data.startswith(b"\x1f\x8b"):
        try:
            with gzip.open(io.BytesIO(data)) as stream:
                found = stream.read(limit + 1)
        except (OSError, EOFError, zlib.error) as error:
            raise ValueError(f"{name} cannot be unpacked: {error}; pack it again") from None
        if len(found) > limit:
            raise ValueError(f"{name} unpacks to more than {limit / 2**20:.0f} MB; thin it out")
        data, suffix = found, Path(name.lower().removesuffix(".gz")).suffix
    if encoding := next((code for sign, code in utf16.items() if re.match(sign, data)), None):
        data = data.decode(encoding, "replace").encode()
    data = data.removeprefix(b"\xef\xbb\xbf")
    # what editors and copies leave behind a text
    text = data.rstrip(b"\0\x1a")
    if b"\0" not in text and b"\n" in text:
        data = text
    if not data.strip():
        raise ValueError(f"{name} is empty; export it again")
    suffix = {".nas": ".bdf"}.get(suffix, suffix)
    kind = what_kind(name, suffix, data)
    if kind != suffix:
        note(f"{name} is of the kind {kind} by what it holds, and read as such")
    if kind == ".stl" and b"\0" in data:
        return kind, _whole_stl(name, data, note)
    return kind, data if b"\0" in data else _text(name, kind, data)


def what_kind(name: str, suffix: str, data: bytes) -> str:
    """Ending of the name of a mesh file that belongs to what it holds; ValueError if it is none that is read."""
    head, count = data[:HEAD], int.from_bytes(data[80:84], "little")
    if count and len(data) == 84 + 50 * count:
        return ".stl"
    if data.startswith(b"PK\3\4") and (suffix == ".3mf" or b"3dmodel.model" in data):
        return ".3mf"
    if what := what_else(data):
        raise ValueError(f"{name} is {what}")
    if kind := next((kind for kind, sign in MESHES.items() if re.match(sign, head)), None):
        return kind
    if suffix not in SUFFIXES:
        raise ValueError(f"{name} is of a kind that is not read; give one of {', '.join(SUFFIXES)}")
    return suffix


def what_else(data: bytes) -> str | None:
    """What a file is that is no mesh, and what to do about it; None if it is not known."""
    return next((what for sign, what in OTHERS.items() if re.match(sign, data[:HEAD], re.IGNORECASE)), None)


def _whole_stl(name: str, data: bytes, note: Note) -> bytes:
    """A binary STL as long as its header states, where what it holds leaves no doubt."""
    triangle = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    count, held = int.from_bytes(data[80:84], "little"), len(data) - 84
    if held > 50 * count and held % 50 == 0:
        corners = np.frombuffer(data, triangle, offset=84 + 50 * count)["corners"]
        if np.all(np.isfinite(corners)) and np.all(np.any(corners != np.roll(corners, 1, axis=1), axis=2)):
            note(f"the header of {name} states {count} triangles, its bytes are those of {held // 50}; all taken")
            return data[:80] + (held // 50).to_bytes(4, "little") + data[84:]
    behind = held - 50 * count
    # else what is left out would be most of it
    if 0 < behind < 50 * count:
        note(f"{behind} bytes of {name} behind the last of its {count} triangles left out")
        return data[: len(data) - behind]
    return data


def _text(name: str, kind: str, data: bytes) -> bytes:
    comma = re.compile(
        rb"^[ \t]*(?:(?:vn?|vertex|facet[ \t]+normal)[ \t]+)?(?:[-+.\deE]+[ \t]+)*[-+]?\d+,\d[^\r\n]*", re.MULTILINE
    )
    data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if kind == ".obj":
        # lines that go on
        data = data.replace(b"\\\n", b" ")
    # looked for in vain these take seconds
    if b"," in data and (found := comma.search(data)):
        count, line = len(comma.findall(data)), data.count(b"\n", 0, found.start()) + 1
        raise ValueError(
            f"{count} lines of {name} have decimal commas, the first is line {line}, "
            f"{found[0].strip()[:60].decode('latin-1')!r}; export it with decimal points"
        )
    if not re.search(rb"[dD][-+]?\d", data):
        return data
    return re.sub(rb"(?<!\S)([-+]?(?:\d+\.?\d*|\.\d+))[dD]([-+]?\d+)(?!\S)", rb"\1e\2", data)
