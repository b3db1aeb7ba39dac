"""Bodies without creeping rays: the triangles of a mesh as they are, nothing fitted; and several bodies at once.

There are no creeping rays on flat triangles, nor where bodies throw rays on each other; the field is that of the
integral equation between tiles of them.
"""

import hashlib
from collections.abc import Callable, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from creeping._typing import ArrayLike, BoolArray, FloatArray, IntArray
from scatterers.body import Shown, teller
from scatterers.triangles.cad_file import POINTS, SUFFIXES, CadReading, cad_triangles
from scatterers.triangles.files import read_mesh
from scatterers.triangles.quality import Choice


class Facets(Shown):
    """Body bounded by the flat triangles of a closed mesh, in metres.

    Parameters
    ----------
    source : path, or object with ``vertices`` and ``faces``
        STL, OBJ, PLY, OFF, GLB, 3MF, MSH, BDF or MESH file, or e.g. a trimesh.Trimesh; each of its parts is closed. Or
        a STEP, IGES or BREP file, meshed with corners on its faces.
    units : {"m", "mm", "cm", "um", "in", "ft", "km"}, optional
        Unit of the coordinates; required for files that do not state it. Objects in memory are in metres by default.
    part : str or int, optional
        One of several parts: "largest", a number from 1 in the order of their areas, or a name; all by default. Parts
        inside others, which no wave reaches, are left out.
    cap : float, optional
        Largest hole to close, m; inf closes all.
    union : bool
        Take the outer surface of all parts together; parts may cross each other. Needs the library manifold3d.
    progress : callable or bool, optional
        Called with a line of text for each repair; True shows them.

    Attributes
    ----------
    vertices : (n, 3), m
    triangles : (t, 3)
        Vertex numbers, counter-clockwise seen from outside.
    bounds : (2, 3), m
    repairs : tuple of str
        Changes made to the mesh.
    tessellated : bool
        Whether the triangles approximate curved faces, as from a CAD file; the error of a field then includes it.

    Raises
    ------
    ValueError
        If the source is not closed, crosses itself or is not finite; the message says how often and where.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> import trimesh
    >>> box = sc.Facets(trimesh.creation.box())
    >>> far = cr.solve(box, (0, 0, 1), wavenumber=3.0, boundary="hard").far_field([(0, 0, 1), (0, 0, -1)])
    >>> bool(far.error.max() < 0.01 * abs(far.total).max())
    True
    """

    without_rays = "the body is taken on its facets"
    """Why there are no creeping rays on it."""

    def __init__(
        self,
        source: Any,
        units: str | None = None,
        *,
        part: str | int | None = None,
        cap: float | None = None,
        union: bool = False,
        progress: Callable[[str], None] | bool | None = None,
    ) -> None:
        in_memory = hasattr(source, "vertices") and hasattr(source, "faces")
        choice, tell = Choice(part, cap, union, every=True), teller(progress)
        self.tessellated = not in_memory and Path(str(source)).suffix.lower() in SUFFIXES
        if self.tessellated:
            mesh = cad_triangles(Path(source), CadReading(units, POINTS, choice), progress=tell)
        else:
            mesh = read_mesh(source, units, choice, progress=tell)
        self.vertices, self.triangles, self.repairs = mesh.vertices, mesh.triangles, mesh.repairs
        self.unit = "L" if in_memory and units is None and getattr(source, "units", None) is None else "m"
        self.bounds = np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    def __repr__(self) -> str:
        size = " x ".join(f"{v:.4g}" for v in np.ptp(self.bounds, axis=0))
        return f"Facets({len(self.triangles)} triangles, {size} {self.unit})"

    @cached_property
    def fingerprint(self) -> str:
        """Text that identifies the triangles, with their size and position."""
        digest = hashlib.blake2b(self.vertices.tobytes(), digest_size=16)
        digest.update(self.triangles.tobytes())
        return f"Facets:{digest.hexdigest()}"

    def inside(self, points: FloatArray) -> BoolArray:
        """Whether points (m, 3), L, are inside the body: (m,)."""
        # along no axis or plane of symmetry
        along = np.array([0.3602, 0.5413, 0.7597])
        along /= np.linalg.norm(along)
        return np.asarray(self._crossed(points, along, 0.0, len(self.triangles)) % 2 == 1)

    def hidden(self, points: FloatArray, direction: FloatArray) -> BoolArray:
        """Whether the body blocks a plane wave along a unit direction before it reaches points (m, 3), L: (m,)."""
        least = 1e-9 * float(np.linalg.norm(np.ptp(self.bounds, axis=0)))
        return np.asarray(self._crossed(points, -direction, least, 1) > 0)

    def _crossed(self, points: FloatArray, along: FloatArray, least: float, most: int) -> IntArray:
        """Triangles that rays from points (m, 3) along a unit vector cross, farther than ``least`` from them (m,)."""
        from scatterers.kernels.facet_rays import crossed

        across = np.linalg.svd(along[None])[2][1:]
        frame = np.stack([*across, along])
        x, y = self.vertices @ frame.T, np.asarray(points, dtype=float) @ frame.T
        low = x[:, :2].min(axis=0)
        starts, members, step = _in_cells(x[self.triangles][..., :2] - low)
        counts = np.zeros(len(y), dtype=np.int64)
        crossed(y, x, self.triangles, starts, members, low, step, counts, least, most)
        return counts


def _in_cells(corners: FloatArray) -> tuple[IntArray, IntArray, FloatArray]:
    """Triangles (t, 3, 2) of the plane by the cells that their boxes meet: starts, members, and the cells' sides."""
    # along a side of the plane
    cells = int(np.clip(np.sqrt(len(corners)), 1, 512))
    low, high = corners.min(axis=1), corners.max(axis=1)
    while True:
        step = np.maximum(high.max(axis=0), 1e-300) * (1 + 1e-9) / cells
        first, last = ((end / step).astype(np.int64) for end in (low, high))
        wide = last - first + 1
        each = wide.prod(axis=1)
        if each.sum() < 10_000_000 or cells == 1:
            break
        # long triangles across everything
        cells = max(1, cells // 2)
    triangle = np.repeat(np.arange(len(each)), each)
    place = np.arange(len(triangle)) - np.repeat(np.cumsum(each) - each, each)
    column, row = first[triangle].T + np.stack(np.divmod(place, wide[triangle, 1]))
    cell = column * cells + row
    starts = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=cells**2))])
    return starts, triangle[np.argsort(cell, kind="stable")], step


class Bodies(Shown):
    """Several bodies that scatter together; no two may touch.

    Parameters
    ----------
    parts : sequence of bodies
        Of any kind: smooth, of pieces, on facets.
    at : (n, 3), L, optional
        Position of the origin of each body.
    turned : (n, 3, 3), optional
        Rotation of each body about its own origin, applied before the shift.

    Attributes
    ----------
    parts : tuple of bodies
        As they were given.
    shifts : (n, 3), L
    turns : (n, 3, 3)
    bounds : (2, 3), L

    Raises
    ------
    ValueError
        If no body is given, shapes do not match, a matrix is not a rotation, or units differ.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> two = sc.Bodies([sc.Sphere(1.0), sc.Sphere(0.5)], at=[(0, 0, 0), (0, 0, 2)])
    >>> solution = cr.solve(two, (1, 0, 0), wavenumber=2.0, boundary="soft")
    >>> solution.far_field([(1, 0, 0), (0, 0, 1)]).total.shape
    (2,)
    """

    without_rays = "it is of several bodies, which throw rays on each other"
    """Why there are no creeping rays on it."""

    def __init__(self, parts: Sequence[Any], *, at: ArrayLike | None = None, turned: ArrayLike | None = None) -> None:
        self.parts = tuple(parts)
        n = len(self.parts)
        if not n:
            raise ValueError("there are no bodies; give one at least")
        self.shifts = np.zeros((n, 3)) if at is None else np.array(at, dtype=float)
        self.turns = np.tile(np.eye(3), (n, 1, 1)) if turned is None else np.array(turned, dtype=float)
        if self.shifts.shape != (n, 3) or self.turns.shape != (n, 3, 3) or not np.all(np.isfinite(self.shifts)):
            raise ValueError(
                f"at has shape {self.shifts.shape} and turned {self.turns.shape}; give finite (n, 3) and (n, 3, 3) "
                f"of n = {n} bodies"
            )
        off = np.abs(self.turns @ np.swapaxes(self.turns, 1, 2) - np.eye(3)).max(axis=(1, 2))
        if np.any(bad := ~(off < 1e-9) | ~(np.linalg.det(self.turns) > 0)):
            raise ValueError(f"turned[{int(np.argmax(bad))}] is no rotation")
        units = {getattr(part, "unit", "L") for part in self.parts}
        if len(units) > 1:
            raise ValueError("some of the bodies are in metres and some are not; give units= to all that are files")
        self.unit = units.pop()
        corners = []
        for part, turn, shift in zip(self.parts, self.turns, self.shifts, strict=True):
            box = np.asarray(part.bounds, dtype=float)
            ends = np.stack(np.meshgrid(*box.T, indexing="ij"), axis=-1).reshape(-1, 3)
            corners.append(ends @ turn.T + shift)
        self.bounds = np.stack([np.min(corners, axis=(0, 1)), np.max(corners, axis=(0, 1))])

    def __repr__(self) -> str:
        return f"Bodies({len(self.parts)}: {', '.join(type(part).__name__ for part in self.parts[:6])})"

    def own(self, number: int, points: FloatArray) -> FloatArray:
        """Points (m, 3), L, converted to the coordinates of the body with the given number: (m, 3), L."""
        return np.asarray((points - self.shifts[number]) @ self.turns[number])

    def inside(self, points: FloatArray) -> BoolArray:
        """Whether points (m, 3), L, are inside any of the bodies: (m,)."""
        found = np.zeros(len(points), dtype=bool)
        for number, part in enumerate(self.parts):
            x = self.own(number, points)
            low, high = np.asarray(part.bounds, dtype=float)
            near = np.flatnonzero(np.all((x >= low) & (x <= high), axis=1))
            mine = x[near]
            found[near] |= part.inside(mine) if hasattr(part, "inside") else np.asarray(part.level(mine)) < 0
        return found
