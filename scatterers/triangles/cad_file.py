"""Points and exact normals of a CAD file's faces, and where faces do not join smoothly.

Also here: solids of a CAD file taken apart: bodies that touch share points, edges or whole faces, and each is closed by
itself.

A face between two solids bounds both. Its triangles are taken twice, once with the other triangles of each solid, and
vertices are merged within a solid only; so parts are what they are in the file, and the outer surface of all is that of
their union. Faces of no solid stay together.

Also here: where faces of a CAD file join smoothly while the curvature jumps, from the normals that the faces have.

Across an edge of the mesh that lies on the joint of two faces, each face bends by

    kappa = (n_far - n_near).t / (x_far - x_near).t,

t across the edge in the face, near the middle of the edge and far the corner opposite to it; each errs by half an edge
times the change of kappa along t. The median of kappa_left - kappa_right over the joint of two faces tells a jump from
that: between a fillet and a plane it is all of the larger.

Sources: Derivations, B13.
"""

import importlib.util
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from scatterers.triangles.decks import what_else
from scatterers.triangles.files import MOST_BYTES, UNITS, TriangleMesh
from scatterers.triangles.jets import angle_weighted_normals
from scatterers.triangles.quality import Choice, whole_body
from scatterers.triangles.topology import Edges, cleaned, edges_of, flat_normals, next_corner

SUFFIXES = {".step": "STEP", ".stp": "STEP", ".iges": "IGES", ".igs": "IGES", ".brep": "BREP"}
POINTS = 10_000
"""Points of the body that are asked for."""
TIMEOUT = 600
"""Of gmsh, s."""
SHARP = 2.0
"""Degrees between the normals of two faces at a common point that make an edge."""


Note = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class CadPoints:
    """What a CAD file gives.

    Attributes
    ----------
    mesh : TriangleMesh
        Its vertices lie on the faces.
    normals : (n, 3)
        Outward; NaN where no face has one.
    corner_normals : (m, 3, 3)
        Outward at the corners of the triangles, each of its own face.
    creases, level : (e,) bool
        Edges, in the order of `scatterers.triangles.topology.edges_of`, at which faces do not join smoothly, and at
        which they do.
    jumps : (e,) bool
        Edges at which faces join smoothly while the curvature jumps, as where a fillet meets a plane.
    edges : tuple of str
        Where faces do not join smoothly.
    """

    mesh: TriangleMesh
    normals: FloatArray
    corner_normals: FloatArray
    creases: BoolArray
    level: BoolArray
    jumps: BoolArray
    edges: tuple[str, ...]


@dataclass(frozen=True)
class CadReading:
    """How a CAD file is read.

    Attributes
    ----------
    units : str or None
    points : int
        Points of the body that are asked for.
    choice : Choice
    sew : float or None
        Faces whose borders are at most so far apart are sewn together, m.
    """

    units: str | None
    points: int
    choice: Choice
    sew: float | None = None

    def __post_init__(self) -> None:
        sew = self.sew
        if sew is not None and (isinstance(sew, bool) or not isinstance(sew, (int, float)) or not 0 < sew < 1e9):
            raise ValueError(
                f"sew = {sew!r} is no distance in m; give the largest gap between faces that belong together"
            )


def read_cad(path: Path, reading: CadReading, *, curved: int = 0, progress: Callable[[str], None]) -> CadPoints:
    """Read a STEP, IGES or BREP file by gmsh.

    ``curved`` is the number of triangles per full turn of a curved face; 0 is an even mesh.

    Raises
    ------
    ValueError
        If the file is of another kind, its unit is unknown or contradicted, or it is not one closed body.
    ModuleNotFoundError
        If gmsh is not installed.
    """
    from scatterers.triangles.topology import oriented

    of_file = _chosen(path, reading, curved)
    found, number, used, before, vertices, triangles, scale, repairs = of_file
    triangles = oriented(path.name, vertices - vertices.mean(0), triangles, repairs.append)
    # an even mesh of a clean file needs no merging; if it was done, points are found again by their place
    place = {tuple(p): k for k, p in enumerate(vertices)}
    row = np.full(len(number), -1, dtype=np.int64)
    row[found["nodes"][used]] = [place.get(tuple(p), -1) for p in before]
    mesh = TriangleMesh(vertices * scale, triangles, tuple(repairs))
    of = _faces_of(triangles, row[found["triangles"].astype(np.int64)], found["of"].astype(np.int64))
    at = row[found["at"]]
    # faces of solids that are left out may touch the body
    known = (at >= 0) & np.isin(found["face"], of)
    for line in repairs:
        progress(line)
    corners, there = _corner_normals(mesh, of, at[known], found["face"][known], found["normals"][known])
    edges = edges_of(mesh.triangles)
    creases, level, turns = _creases(mesh, edges, of, corners)
    jumps = curvature_jumps(mesh.vertices, mesh.triangles, of, corners, level)
    # the creases in words, those with most points first
    at = np.flatnonzero(creases & (turns > SHARP))
    pairs, which = np.unique(np.sort(of[edges.sides[at] // 3], axis=1), axis=0, return_inverse=True)
    found = []
    for k, (first, second) in enumerate(pairs.tolist()):
        mine = at[which.ravel() == k]
        count = len(np.unique(edges.ends[mine]))
        angle = np.max(turns[mine])
        found.append((count, f"edge between faces {first} and {second}: {angle:.0f} deg at {count} points"))
    texts = tuple(text for _, text in sorted(found, key=lambda row: -row[0]))
    # mean of the faces' normals at each vertex (n, 3), NaN where no face has one that agrees with the triangles
    total = np.zeros((len(mesh.vertices), 3))
    np.add.at(total, mesh.triangles[there], corners[there])
    with np.errstate(invalid="ignore"):
        mean = total / np.linalg.norm(total, axis=1, keepdims=True)
    along = np.sum(mean * angle_weighted_normals(mesh.vertices, mesh.triangles), axis=1)
    # at a pole of its parameters a face has none
    mean[~(along > np.cos(np.radians(20.0)))] = np.nan
    normals = np.asarray(mean)
    return CadPoints(mesh, normals, corners, creases, level, jumps, texts)


def cad_triangles(path: Path, reading: CadReading, *, progress: Callable[[str], None]) -> TriangleMesh:
    """All closed parts of a CAD file as triangles between points of it, or the one that is chosen; see `read_cad`."""
    from scatterers.triangles.parts import every_part
    from scatterers.triangles.topology import oriented

    of_file = _chosen(path, reading, 0)
    repairs, vertices = of_file.repairs, of_file.vertices
    local = vertices - vertices.mean(axis=0)
    if reading.choice.every and reading.choice.part is None:
        local, triangles = every_part(path.name, local, of_file.triangles, repairs.append)
    else:
        triangles = oriented(path.name, local, of_file.triangles, repairs.append)
    for line in repairs:
        progress(line)
    return TriangleMesh((local + vertices.mean(axis=0)) * of_file.scale, triangles, tuple(repairs))


class _Chosen(NamedTuple):
    """Triangles of what is chosen of a file, in its unit, and what they come from."""

    found: Any
    number: IntArray
    used: IntArray
    before: FloatArray
    vertices: FloatArray
    triangles: IntArray
    scale: float
    repairs: list[str]


def _chosen(path: Path, reading: CadReading, curved: int) -> _Chosen:
    """Triangles of a file by gmsh, more where little of it is chosen."""
    kind = kind_of(path)
    if importlib.util.find_spec("gmsh") is None:
        raise ModuleNotFoundError(
            "CAD files need gmsh: pip install 'creeping[cad]' (gmsh is under the GPL)", name="gmsh"
        )
    found = _meshed(path, reading.points, reading.sew, curved)
    # a file cut short may have lost its unit: gmsh says more of it
    scale = _scale(path, kind, reading.units)
    for again in (reading.choice.part is not None, False):
        number = np.zeros(int(found["nodes"].max(initial=0)) + 1, dtype=np.int64)
        number[found["nodes"]] = np.arange(len(found["nodes"]))
        used, triangles = np.unique(number[found["triangles"]], return_inverse=True)
        triangles = triangles.reshape(-1, 3)
        repairs: list[str] = []
        before = found["points"][used]
        of, bounds = (found[key].astype(np.int64) for key in ("of", "bounds"))
        vertices, triangles = cleaned_apart(path.name, before, triangles, of, bounds, repairs.append)
        vertices, triangles = whole_body(path.name, vertices, triangles, reading.choice, scale, repairs.append)
        lacking = len(before) / max(len(vertices), 1)
        if not (again and lacking > 1.5):
            break
        # points were for all bodies of the file together; with 16 times as many at most
        found = _meshed(path, int(reading.points * min(lacking, 16.0)), reading.sew, curved)
    return _Chosen(found, number, used, before, vertices, triangles, scale, repairs)


def kind_of(path: Path) -> str:
    """STEP, IGES or BREP, by name and beginning, or ValueError; nothing else of the file is read."""
    beginnings = {
        "STEP": r"\s*ISO-10303-21",
        "IGES": r".{72}[SFG]",
        "BREP": r"\s*(DBRep_DrawableShape|CASCADE Topology)",
    }
    kind = SUFFIXES.get(path.suffix.lower())
    if kind is None:
        raise ValueError(f"{path.name} is none of {', '.join(SUFFIXES)}; export the body as STEP")
    if not path.is_file():
        raise ValueError(f"{path} is no file; give the path of a CAD file")
    size = path.stat().st_size
    if size == 0 or size > MOST_BYTES:
        raise ValueError(f"{path.name} has {size} bytes; give a CAD file of at most {MOST_BYTES}")
    with path.open("rb") as file:
        start = file.read(4096)
    if not re.match(beginnings[kind], start.decode("latin-1")):
        what = what_else(start)
        raise ValueError(
            f"{path.name} does not begin as {kind} files do" + (f": it is {what}" if what else "; export it again")
        )
    return kind


def _scale(path: Path, kind: str, units: str | None) -> float:
    """Metres to a unit of what gmsh gives."""
    if units is not None and units not in UNITS:
        raise ValueError(f'units = {units!r} is none of {", ".join(UNITS)}; give e.g. units="mm"')
    stated = _stated(path, kind)
    if kind == "BREP":
        if units is None:
            raise ValueError(f'{path.name} does not state its unit; give e.g. units="mm"')
        # nothing is converted where nothing is stated
        return UNITS[units]
    if stated is None:
        raise ValueError(
            f"{path.name} does not state its unit of length, or one that is none of {', '.join(UNITS)}; export it again"
        )
    if units is not None and stated != units:
        raise ValueError(f"{path.name} is in {stated}, not in {units}; leave units out")
    return UNITS["mm"]


def _stated(path: Path, kind: str) -> str | None:
    """Unit that a file states, as far as it is one of `UNITS`."""
    text = path.read_bytes().decode("latin-1")
    if kind == "STEP":
        compact = re.sub(r"\s+", "", text)
        for name, unit in (("'INCH'", "in"), ("'FOOT'", "ft")):
            if re.search(rf"CONVERSION_BASED_UNIT\({name}", compact, re.IGNORECASE):
                return unit
        found = re.search(r"SI_UNIT\((\$|\.[A-Z]+\.),\.METRE\.\)", compact)
        prefixes = {"$": "m", ".MILLI.": "mm", ".CENTI.": "cm", ".MICRO.": "um", ".KILO.": "km"}
        return prefixes.get(found[1]) if found else None
    if kind == "IGES":
        globals_ = "".join(line[:72] for line in text.splitlines() if line[72:73] == "G")
        # strings are nH...; their commas do not separate
        # global section of an IGES file with its Hollerith strings emptied
        out, k = "", 0
        for found in re.finditer(r"(\d+)H", globals_):
            if found.start() < k:
                continue
            out += globals_[k : found.start()]
            k = found.end() + int(found[1])
        fields = re.split(r"[,;]", out + globals_[k:])
        with_flag = fields[13].strip() if len(fields) > 13 else ""
        by_flag = {1: "in", 2: "mm", 4: "ft", 6: "m", 7: "km", 9: "um", 10: "cm"}
        return by_flag.get(int(with_flag)) if with_flag.isdigit() else None
    return None


def _meshed(path: Path, points: int, sew: float | None, curved: int) -> dict[str, Any]:
    """Run the worker and read what it wrote."""
    with tempfile.TemporaryDirectory(prefix="creeping-") as folder:
        out = Path(folder) / "points.npz"
        # -P: modules that happen to lie in the working folder are not imported
        worker = Path(__file__).with_name("cad_worker.py")
        command = [sys.executable, "-P", str(worker), str(path.resolve()), str(points), str(out)]
        command += [str(curved), repr(1e3 * float(sew or 0.0))]
        try:
            done = subprocess.run(command, capture_output=True, timeout=TIMEOUT, check=False, text=True)
        except subprocess.TimeoutExpired:
            raise ValueError(f"{path.name}: gmsh did not mesh it within {TIMEOUT} s; mend or simplify it") from None
        if done.returncode or not out.exists():
            lines = [line for line in (done.stderr or "").splitlines() if line.strip()]
            if "libGL" in done.stderr or "cannot open shared object" in done.stderr:
                raise ValueError(
                    f"gmsh does not start: {lines[-1].strip()}; on Debian: apt install libglu1-mesa libxcursor1 "
                    "libxft2 libxinerama1 libxrender1 libxfixes3"
                )
            reason = lines[-1].strip() if lines else f"it ended with code {done.returncode}"
            raise ValueError(f"{path.name}: gmsh cannot read or mesh it ({reason}); repair the body or export it anew")
        with np.load(out, allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}


def _faces_of(triangles: IntArray, before: IntArray, faces: IntArray) -> IntArray:
    """Face of each triangle (m,), from those that gmsh gave, by their corners; -1 where it is not known."""
    size = int(triangles.max()) + 1

    def code(corners: IntArray) -> IntArray:
        a, b, c = np.sort(corners, axis=1).T
        return np.asarray((a * size + b) * size + c)

    found, there = _looked_up(code(before), code(triangles))
    return np.where(there, faces[found], -1)


def _looked_up(known: IntArray, wanted: IntArray) -> tuple[IntArray, BoolArray]:
    """Places (...) of numbers among those that are known (k,), and whether they are there."""
    order = np.argsort(known, kind="stable")
    found = order[np.searchsorted(known[order], wanted).clip(0, len(order) - 1)]
    return found, known[found] == wanted


def _corner_normals(
    mesh: TriangleMesh, of: IntArray, at: IntArray, face: IntArray, normals: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Outward normals (m, 3, 3) of the triangles' own faces at their corners, and where these have one (m, 3).

    Else it is the triangle's.
    """
    corners = mesh.vertices[mesh.triangles]
    flat = flat_normals(corners)[0]
    size = len(mesh.vertices)
    found, there = _looked_up(face * size + at, of[:, None] * size + mesh.triangles)
    n = normals[found] / np.maximum(np.linalg.norm(normals[found], axis=2, keepdims=True), 1e-300)
    there &= np.all(np.isfinite(n), axis=2) & (np.linalg.norm(n, axis=2) > 0.5)
    # a face's orientation is that of its parameters
    for tag in np.unique(of):
        mine = of == tag
        if np.sum((n[mine] * flat[mine, None])[there[mine]]) < 0:
            n[mine] *= -1
    # a face that leans by more has none there
    there &= np.sum(n * flat[:, None], axis=2) > np.cos(np.radians(60.0))
    return np.where(there[..., None], n, flat[:, None]), there


def _creases(
    mesh: TriangleMesh, edges: Edges, of: IntArray, normals: FloatArray
) -> tuple[BoolArray, BoolArray, FloatArray]:
    """Edges between faces whose normals differ there, and between others; and by how much, degrees.

    Where no face is known they are those of a mesh.
    """
    from scatterers.triangles.regions import regions_of

    order = edges.sides
    between = of[order[:, 0] // 3] != of[order[:, 1] // 3]
    flat = normals.reshape(-1, 3)
    left, right = order[:, 0], order[:, 1]
    # the edge runs from corner k to the next in one triangle, the other way in the other
    apart = [np.linalg.norm(flat[a] - flat[next_corner(b)], axis=1) for a, b in ((left, right), (right, left))]
    turns = np.degrees(2 * np.arcsin(np.minimum(*apart) / 2))
    sharp = between & (turns > SHARP)
    # lids, and triangles that were cut as parts were united
    lost = (of[order[:, 0] // 3] < 0) | (of[order[:, 1] // 3] < 0)
    if lost.any():
        sharp = np.where(lost, regions_of(mesh.vertices, mesh.triangles).crease, sharp)
    return sharp, between & ~sharp & ~lost, turns


def cleaned_apart(
    name: str, points: FloatArray, triangles: IntArray, of: IntArray, bounds: IntArray, note: Note
) -> tuple[FloatArray, IntArray]:
    """Vertices and triangles of all solids, cleaned one by one.

    Parameters
    ----------
    points : (n, 3)
    triangles : (m, 3)
    of : (m,)
        Face of each triangle.
    bounds : (j, 2)
        Faces and the solids that they bound.
    """
    solids = np.unique(bounds[:, 1])
    groups = [np.isin(of, bounds[bounds[:, 1] == solid, 0]) for solid in solids]
    groups.append(~np.isin(of, bounds[:, 0]))
    groups = [mine for mine in groups if mine.any()]
    if len(groups) < 2:
        return cleaned(name, points, triangles, note, note)
    vertices, corners, count = [], [], 0
    notes: list[str] = []
    for mine in groups:
        used, own = np.unique(triangles[mine], return_inverse=True)
        x, t = cleaned(name, points[used], own.reshape(-1, 3).astype(np.int64), notes.append, notes.append)
        vertices.append(x)
        corners.append(t + count)
        count += len(x)
    if notes:
        note(notes[0] + (f"; {len(notes) - 1} more of that kind in other solids" if len(notes) > 1 else ""))
    return np.concatenate(vertices), np.concatenate(corners)


def curvature_jumps(
    vertices: FloatArray, triangles: IntArray, faces: IntArray, normals: FloatArray, level: BoolArray
) -> BoolArray:
    """Edges (e,) of the joints of two faces along which the curvature jumps.

    Parameters
    ----------
    vertices, triangles : (n, 3), L, and (m, 3)
    faces : (m,)
        Face of each triangle.
    normals : (m, 3, 3)
        Outward at the corners, each of the triangle's own face.
    level : (e,) bool
        Edges, in the order of `scatterers.triangles.topology.edges_of`, at which faces join smoothly.
    """
    jumps = np.zeros(len(level), dtype=bool)
    if not level.any():
        return jumps
    at = np.flatnonzero(level)
    order = edges_of(triangles).sides[level]
    bends = np.stack([_bend(vertices, triangles, normals, side) for side in order.T], axis=1)
    sides = np.sort(faces[order // 3], axis=1)
    _, joint = np.unique(sides, axis=0, return_inverse=True)
    # always minus the one of the lower face
    bends = np.where((faces[order[:, :1] // 3] == sides[:, :1]), bends, bends[:, ::-1])
    vertex, first = triangles.ravel(), order[:, 0]
    length = np.linalg.norm(vertices[vertex[first]] - vertices[vertex[next_corner(first)]], axis=1)
    for number in range(int(joint.max()) + 1):
        mine = joint.ravel() == number
        jump = abs(float(np.median(bends[mine, 0] - bends[mine, 1])))
        larger = float(np.median(np.abs(bends[mine]).max(axis=1)))
        # not both planes; where a resolved mesh's curvature only varies, two sides of an edge differ by less
        if larger * float(np.median(length[mine])) > 1e-3 and jump > 0.3 * larger:
            jumps[at[mine]] = True
    return jumps


def _bend(vertices: FloatArray, triangles: IntArray, normals: FloatArray, corner: IntArray) -> FloatArray:
    """Curvature (k,) of the faces of triangles across the edges that begin at these corners, 1/L."""
    row, first = corner // 3, corner % 3
    second, far = (first + 1) % 3, (first + 2) % 3
    a, b, c = (vertices[triangles[row, k]] for k in (first, second, far))
    n_near = 0.5 * (normals[row, first] + normals[row, second])
    across = c - 0.5 * (a + b)
    along = (b - a) / np.maximum(np.linalg.norm(b - a, axis=1, keepdims=True), 1e-300)
    t = across - np.sum(across * along, axis=1, keepdims=True) * along
    square = np.maximum(np.sum(t**2, axis=1), 1e-300)
    return np.asarray(np.sum((normals[row, far] - n_near) * t, axis=1) / square)
