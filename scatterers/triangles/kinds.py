r"""What a file holds, whatever its name says: packed, in another encoding, of another kind, or no mesh at all.

Texts get UTF-8, "\n" at the ends of lines and numbers with E for the D of Fortran, as loaders take them.
"""

import gzip
import io
import re
import zlib
from collections.abc import Callable

import numpy as np

Note = Callable[[str], None]
SUFFIXES = (".stl", ".obj", ".ply", ".off", ".glb", ".3mf", ".msh", ".bdf")
KNOWN = (*SUFFIXES, ".nas", ".gz")
"""Endings of names of files that are read; .nas is .bdf, .gz is packed."""
MESHES = {
    ".ply": rb"ply[ \t]*[\r\n]",
    ".glb": rb"glTF",
    ".off": rb"\s*(ST)?C?N?4?OFF\b",
    ".stl": rb"\s*(?i:solid)\b(?s:.*?)\bfacet\b",
    ".msh": rb"\s*\$(MeshFormat|Comments)\b",
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
    rb"# vtk DataFile": "a VTK file; export the body as a mesh",
    rb"\s*<(\?xml|COLLADA|VTKFile)": "an XML file; export the body as a mesh",
    rb"\s*\{": "a JSON file, such as glTF in parts; export the body as .glb",
}
"""Beginnings of files that are no meshes that are read, what they are, and what to do."""
UTF16 = {
    rb"\xff\xfe|\xfe\xff": "utf-16",
    rb"([\t\n\r -~]\0){16}": "utf-16-le",
    rb"(\0[\t\n\r -~]){16}": "utf-16-be",
}
"""Beginnings of texts in UTF-16, with a byte order mark or without."""
TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
"""Of a binary STL."""
HEAD = 4096
"""Bytes that tell what a file is."""
COMMA = re.compile(
    rb"^[ \t]*(?:(?:vn?|vertex|facet[ \t]+normal)[ \t]+)?(?:[-+.\deE]+[ \t]+)*[-+]?\d+,\d[^\r\n]*", re.MULTILINE
)
EXPONENT = re.compile(rb"(?<!\S)([-+]?(?:\d+\.?\d*|\.\d+))[dD]([-+]?\d+)(?!\S)")


def understood(name: str, suffix: str, data: bytes, limit: int, note: Note) -> tuple[str, bytes]:
    """Ending that belongs to what a file holds, and that as loaders take it.

    Raises
    ------
    ValueError
        If it is no mesh of a kind that is read; says what it is.
    """
    if data.startswith(b"\x1f\x8b"):
        data, suffix = _unpacked(name, data, limit), _ending(name.lower().removesuffix(".gz"))
    if encoding := next((code for sign, code in UTF16.items() if re.match(sign, data)), None):
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


def _ending(name: str) -> str:
    return f".{name.rpartition('.')[2]}" if "." in name else ""


def _unpacked(name: str, data: bytes, limit: int) -> bytes:
    try:
        with gzip.open(io.BytesIO(data)) as stream:
            found = stream.read(limit + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise ValueError(f"{name} cannot be unpacked: {error}; pack it again") from None
    if len(found) > limit:
        raise ValueError(f"{name} unpacks to more than {limit / 2**20:.0f} MB; thin it out")
    return found


def _whole_stl(name: str, data: bytes, note: Note) -> bytes:
    """A binary STL as long as its header states, where what it holds leaves no doubt."""
    count, held = int.from_bytes(data[80:84], "little"), len(data) - 84
    if held > 50 * count and held % 50 == 0:
        corners = np.frombuffer(data, TRIANGLE, offset=84 + 50 * count)["corners"]
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
    data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if kind == ".obj":
        # lines that go on
        data = data.replace(b"\\\n", b" ")
    # looked for in vain these take seconds
    if b"," in data and (found := COMMA.search(data)):
        count, line = len(COMMA.findall(data)), data.count(b"\n", 0, found.start()) + 1
        raise ValueError(
            f"{count} lines of {name} have decimal commas, the first is line {line}, "
            f"{found[0].strip()[:60].decode('latin-1')!r}; export it with decimal points"
        )
    return EXPONENT.sub(rb"\1e\2", data) if re.search(rb"[dD][-+]?\d", data) else data
