"""Triangle meshes from files and objects, checked and in metres: what happens before a surface is fitted.

Nothing of a file is executed and nothing beside it is opened: only loaders of known formats are called, on bytes
read here, without a resolver of names; trimesh's own repairs are left out, as they drop what is wrong without a word.
"""

import io
import logging
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from creeping._typing import FloatArray, IntArray
from scatterers.triangles.decks import read_bdf, read_medit, read_msh, understood
from scatterers.triangles.form import Placed, assembled, check_whole, read_3mf, with_triangles
from scatterers.triangles.parts import every_part, silent, uncrossed
from scatterers.triangles.quality import Choice, whole_body
from scatterers.triangles.subdivision import Subdivision
from scatterers.triangles.topology import cleaned, crossings, oriented

UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "in": 0.0254, "ft": 0.3048, "km": 1e3}
"""Metres per unit."""
MOST_BYTES = 512 * 2**20
MOST_TRIANGLES = 4_000_000


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """Closed, oriented triangle mesh of one body.

    Attributes
    ----------
    vertices : (n, 3), m
    triangles : (m, 3)
        Vertex numbers, counter-clockwise seen from outside.
    repairs : tuple of str
        What was changed, one sentence each.
    loop : Subdivision or None
        What it comes of, if it is subdivided.
    """

    vertices: FloatArray
    triangles: IntArray
    repairs: tuple[str, ...] = ()
    loop: Subdivision | None = None

    def __repr__(self) -> str:
        size = " x ".join(f"{v:.4g}" for v in np.ptp(self.vertices, axis=0))
        return f"TriangleMesh({len(self.vertices)} vertices, {len(self.triangles)} triangles, {size} m)"


class _Raw(NamedTuple):
    """What a source holds, in its own unit."""

    name: str
    vertices: FloatArray
    triangles: IntArray
    stated: str | None
    indexed: bool
    names: tuple[tuple[str, int], ...] = ()


def read_mesh(
    source: Any, units: str | None = None, choice: Choice | None = None, *, progress: Callable[[str], None]
) -> TriangleMesh:
    """Read, check and repair the mesh of one body.

    Parameters
    ----------
    source : path, or object with ``vertices`` and ``faces``
        STL, OBJ, PLY, OFF, GLB, 3MF, MSH, BDF or MESH file, packed by gzip or not, or e.g. a trimesh.Trimesh.
    units : {"m", "mm", "cm", "um", "in", "ft", "km"}, optional
        Unit of the numbers; must be given for files that do not state it. An object's numbers are metres by default.
    choice : Choice, optional
        What of it is the body.
    progress : callable
        Is told each repair in a sentence.

    Returns
    -------
    TriangleMesh

    Raises
    ------
    ValueError
        If the source cannot be read, its unit is unknown, or it is not one closed body without self-intersections.
    """
    if units is not None and (not isinstance(units, str) or units not in UNITS):
        raise ValueError(f'units = {units!r} is none of {", ".join(UNITS)}; give e.g. units="mm"')
    in_memory = hasattr(source, "vertices") and hasattr(source, "faces")
    choice = choice or Choice()
    named = isinstance(choice.part, str) and choice.part != "largest"
    repairs: list[str] = []

    def note(message: str) -> None:
        repairs.append(message)
        progress(message)

    raw = _from_object(source) if in_memory else _from_file(source, named, note)
    _check_numbers(raw)
    scale = UNITS[_unit(raw, units, "m" if in_memory else None)]
    chosen = _named(raw, choice.part)
    try:
        # vertices and triangles of a closed surface, the middle of its box, and the vertices relative to that
        vertices, triangles = cleaned(raw.name, raw.vertices, chosen, note if raw.indexed else silent, note)
        size = float(np.ptp(vertices, axis=0).max()) * scale
        if not 1e-9 <= size <= 1e9:
            raise ValueError(f"{raw.name} is {size:.3g} m large; give the right units, or a body from 1e-09 to 1e+09 m")
        vertices, triangles = whole_body(
            raw.name, vertices, triangles, choice, scale, note, named=chosen is not raw.triangles
        )
        # digits are lost to the offset in any sum of products of coordinates, so it goes first
        offset = 0.5 * (vertices.min(0) + vertices.max(0))
        local = vertices - offset
        if choice.every and choice.part is None:
            local, triangles = every_part(raw.name, local, triangles, note)
            vertices = local + offset
        else:
            triangles = oriented(raw.name, local, triangles, note)
        _check_rounding(raw.name, vertices, triangles)
        if choice.cap is not None:
            local, triangles = uncrossed(raw.name, local, triangles, choice.cap, scale, note)
            vertices = local + offset
        _check_crossings(raw.name, local, triangles, offset * scale, scale, cut=choice.cap is not None)
    except ValueError:
        # rounding tears a surface and folds it
        _check_rounding(raw.name, raw.vertices, chosen, torn=True)
        raise
    # so far off, differences of coordinates lose digits
    if np.linalg.norm(offset) > 100.0 * np.linalg.norm(np.ptp(vertices, axis=0)):
        note(
            f"{raw.name} lies {np.linalg.norm(offset) * scale:.6g} m from the origin; "
            f"moved by {_where(-offset * scale)}"
        )
        vertices = local
    return TriangleMesh(vertices * scale, triangles, tuple(repairs))


def _named(raw: _Raw, part: str | int | None) -> IntArray:
    """Triangles of the part of that name, all if there is none."""
    if not isinstance(part, str) or part == "largest" or not raw.names:
        return raw.triangles
    begin = 0
    for name, count in raw.names:
        if name == part:
            return raw.triangles[begin : begin + count]
        begin += count
    known = ", ".join(name for name, _ in raw.names[:20])
    raise ValueError(f"{raw.name} has no part {part!r}; it has {known}")


def _where(point: FloatArray) -> str:
    return "(" + ", ".join(f"{v:.5g}" for v in point) + ") m"


def _from_object(source: Any) -> _Raw:
    name = "the mesh"
    try:
        vertices, faces = np.array(source.vertices, dtype=float), np.asarray(source.faces)
        triangles = faces.astype(np.int64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"the vertices or faces of the mesh are not numbers ({error})") from None
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise ValueError(f"the vertices of the mesh have shape {vertices.shape}; give (n, 3)")
    if triangles.size and (triangles.ndim != 2 or triangles.shape[1] != 3):
        raise ValueError(f"the faces of the mesh have shape {triangles.shape}; give triangles (m, 3)")
    if not np.array_equal(triangles, faces):
        raise ValueError("the faces of the mesh are not whole numbers; give vertex numbers")
    return _Raw(name, vertices, triangles.reshape(-1, 3), getattr(source, "units", None), True)


def _from_file(source: Any, named: bool, note: Callable[[str], None]) -> _Raw:
    path, data = mesh_bytes(source)
    name = path.name
    suffix, data = understood(name, path.suffix.lower(), data, MOST_BYTES, note)
    check_whole(name, suffix, data)
    try:
        vertices, triangles, stated, names = _loaded(data, suffix, named)
    except Exception as error:  # the loaders raise whatever their parsing runs into
        text = str(error) or type(error).__name__
        raise ValueError(f"{name} cannot be read as {suffix[1:].upper()}: {text}; export it again") from None
    return _Raw(name, vertices, triangles, stated, suffix != ".stl", names)


def mesh_bytes(source: Any) -> tuple[Path, bytes]:
    """Path of a mesh file and what it holds, read only if it is a file that is not too large.

    Raises
    ------
    ValueError
        If it is not.
    """
    try:
        path = Path(source)
    except TypeError:
        raise ValueError(
            f"a {type(source).__name__} is no mesh; give a path or an object with vertices and faces"
        ) from None
    name = path.name
    if len(name) > 255 or "\0" in str(path):
        raise ValueError(f"{name[:40]}... is no name of a file; give the path of a mesh file")
    if path.is_dir():
        raise ValueError(f"{path} is a directory; give the path of a mesh file")
    if not path.is_file():
        raise ValueError(f"{path} is no file on this machine; give the path of a mesh file (addresses are not fetched)")
    try:
        size = path.stat().st_size
        if size > MOST_BYTES:
            raise ValueError(f"{name} has {size / 2**20:.0f} MB, more than {MOST_BYTES / 2**20:.0f}; thin it out")
        data = path.read_bytes()
    except OSError as error:
        raise ValueError(f"{name} cannot be opened: {error.strerror}") from None
    if not data:
        raise ValueError(f"{name} is empty; export it again")
    return path, data


@contextmanager
def _quiet(name: str) -> Iterator[None]:
    """No messages of a logger: what matters here is raised."""
    logger = logging.getLogger(name)
    level = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(level)


class _Nothing:
    """Resolver of names in a file, to which there are no other files."""

    def get(self, name: str) -> bytes:
        raise ValueError(f"it refers to {name!r}, which is not opened; export it as one file")

    __getitem__ = get


def _loaded(
    data: bytes, suffix: str, named: bool
) -> tuple[FloatArray, IntArray, str | None, tuple[tuple[str, int], ...]]:
    """Vertices and triangles of everything in the file, the unit it states, and its parts: name, triangles."""
    decks = {".msh": read_msh, ".bdf": read_bdf, ".mesh": read_medit}
    if suffix == ".3mf":
        return read_3mf(data, MOST_BYTES, MOST_TRIANGLES)
    if suffix in decks:
        return *decks[suffix](data), None, ()
    import trimesh

    # else all objects of an OBJ file are one part, by the name of the first
    split = {"split_objects": True} if named and suffix == ".obj" else {}
    with warnings.catch_warnings(), _quiet("trimesh"):
        # older numpy only warns where it stops reading a text in the middle
        warnings.filterwarnings("error", category=DeprecationWarning, message=".*could not be read to its end")
        scene = trimesh.load(
            io.BytesIO(with_triangles(data, MOST_TRIANGLES) if suffix == ".off" else data),
            file_type=suffix[1:],
            force="scene",
            process=False,
            skip_materials=True,
            resolver=_Nothing(),
            **split,
        )
    stated = {getattr(geometry, "units", None) for geometry in scene.geometry.values()}
    unit = stated.pop() if len(stated) == 1 and suffix == ".glb" else None

    def placed() -> Iterator[Placed]:
        for node in scene.graph.nodes_geometry:
            matrix, key = scene.graph[node]
            geometry = scene.geometry[key]
            yield str(key), getattr(geometry, "vertices", ()), getattr(geometry, "faces", ()), matrix

    vertices, triangles, names = assembled(placed(), MOST_TRIANGLES)
    return vertices, triangles, unit or ("m" if suffix == ".glb" else None), names


def _check_numbers(raw: _Raw) -> None:
    name, vertices, triangles = raw.name, raw.vertices, raw.triangles
    if not len(triangles):
        raise ValueError(f"{name} holds no triangles ({len(vertices)} vertices); export the surface as a mesh")
    if len(triangles) > MOST_TRIANGLES:
        raise ValueError(f"{name} has {len(triangles)} triangles, more than {MOST_TRIANGLES}; thin it out")
    outside = (triangles < 0) | (triangles >= len(vertices))
    if bad := int(np.sum(outside.any(axis=1))):
        worst = int(triangles[outside][0])
        raise ValueError(
            f"{bad} of {len(triangles)} triangles of {name} refer to vertices that do not exist "
            f"(vertex {worst} of {len(vertices)}); export it again"
        )
    finite = np.all(np.isfinite(vertices), axis=1)
    if bad := int(np.sum(~finite)):
        raise ValueError(
            f"{bad} of {len(vertices)} vertices of {name} are not finite (the first is vertex "
            f"{int(np.argmin(finite))}); repair or export it again"
        )


def _unit(raw: _Raw, given: str | None, otherwise: str | None) -> str:
    spelled = {
        "meter": "m", "metre": "m", "millimeter": "mm", "millimetre": "mm", "centimeter": "cm", "centimetre": "cm",
        "micron": "um", "micrometer": "um", "inch": "in", "inche": "in", "foot": "ft", "feet": "ft", "kilometer": "km",
    }  # fmt: skip
    stated = None
    if raw.stated is not None:
        word = str(raw.stated).strip().lower()
        stated = word if word in UNITS else spelled.get(word.removesuffix("s"), spelled.get(word))
        if stated is None:
            raise ValueError(f"{raw.name} states the unit {raw.stated!r}, none of {', '.join(UNITS)}; convert it")
    if stated is not None and given is not None and stated != given:
        raise ValueError(
            f"{raw.name} states its unit, {stated}, but units = {given!r}; leave units out, or convert the file"
        )
    unit = given or stated or otherwise
    if unit is None:
        used = raw.vertices[np.unique(raw.triangles)]
        size = np.ptp(used, axis=0)
        extents = " x ".join(f"{v:.5g}" for v in size)
        raise ValueError(
            f"{raw.name} does not state its unit; it extends over {extents} of it, {size.max() * 1e-3:.5g} m if "
            f'millimetres; give the unit, e.g. units="mm", or one of {", ".join(UNITS)}'
        )
    return unit


def _check_rounding(name: str, vertices: FloatArray, triangles: IntArray, *, torn: bool = False) -> None:
    # of what is torn the largest numbers tell enough
    column = np.abs(vertices).max(axis=0).argmax() if torn else slice(None)
    with np.errstate(over="ignore"):
        single = vertices[:, column].astype(np.float32)
    if not np.array_equal(single, vertices[:, column]):
        return
    quantum = float(np.spacing(np.abs(single).max()))
    edge = float(np.mean(np.linalg.norm(vertices[triangles] - vertices[np.roll(triangles, 1, axis=1)], axis=-1)))
    # then curvatures would be those of the rounding
    if quantum > 1e-3 * edge:
        raise ValueError(
            f"the numbers of {name} are rounded to {quantum:.2g}, where its mean edge is {edge:.2g}, as it lies far "
            "from the origin in single precision, or with few digits; move it to the origin before it is exported"
        )


def _check_crossings(
    name: str, local: FloatArray, triangles: IntArray, offset: FloatArray, scale: float, *, cut: bool
) -> None:
    count, pairs = crossings(local, triangles)
    if count:
        first = local[triangles[pairs[0, 0]]].mean(axis=0) * scale + offset
        spread = local[triangles[pairs.ravel()]].mean(axis=1)
        remedy = (
            "too much of it for being cut out: repair it"
            if cut
            else "repair it, or give cap= with a size, m: what crosses is cut out, and holes up to that size are closed"
        )
        raise ValueError(
            f"{name} crosses itself: {count} pairs of its {len(triangles)} triangles, the first near {_where(first)}, "
            f"within {np.ptp(spread, axis=0).max() * scale:.3g} m of each other; {remedy}"
        )
