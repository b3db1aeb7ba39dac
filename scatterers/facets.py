"""Body on its facets: the triangles of a mesh as they are, all closed parts of it, nothing fitted.

There are no creeping rays on flat triangles; the field is that of the integral equation between tiles of them.
"""

import hashlib
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from scatterers.body import Shown, teller
from scatterers.triangles.cad_file import SUFFIXES, CadReading, cad_triangles
from scatterers.triangles.files import read_mesh
from scatterers.triangles.quality import Choice

SOMEWHERE = np.array([0.3602, 0.5413, 0.7597])
"""Direction of the rays that tell inside from outside: along no axis or plane of symmetry."""
POINTS = 10_000
"""Of a CAD file."""
CELLS = 512
"""Cells along a side of the plane across rays, at most."""
MOST = 10_000_000
"""Pairs of a triangle and a cell, at most."""


class Facets(Shown):
    """Body bounded by the flat triangles of a closed mesh, in metres.

    Parameters
    ----------
    source : path, or object with ``vertices`` and ``faces``
        STL, OBJ, PLY, OFF, GLB, 3MF, MSH, BDF or MESH file, or e.g. a trimesh.Trimesh; each of its parts is closed. Or
        a STEP, IGES or BREP file, whose triangles have their corners on it.
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
        Whether the triangles approximate curved faces, as from a CAD file; errors then include the difference.

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
        """Text that tells bodies apart, their sizes and places too."""
        digest = hashlib.blake2b(self.vertices.tobytes(), digest_size=16)
        digest.update(self.triangles.tobytes())
        return f"Facets:{digest.hexdigest()}"

    def inside(self, points: FloatArray) -> BoolArray:
        """Whether points (m, 3), L, are inside the body: (m,)."""
        along = SOMEWHERE / np.linalg.norm(SOMEWHERE)
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
    cells = int(np.clip(np.sqrt(len(corners)), 1, CELLS))
    low, high = corners.min(axis=1), corners.max(axis=1)
    while True:
        step = np.maximum(high.max(axis=0), 1e-300) * (1 + 1e-9) / cells
        first, last = ((end / step).astype(np.int64) for end in (low, high))
        wide = last - first + 1
        each = wide.prod(axis=1)
        if each.sum() < MOST or cells == 1:
            break
        # long triangles across everything
        cells = max(1, cells // 2)
    triangle = np.repeat(np.arange(len(each)), each)
    place = np.arange(len(triangle)) - np.repeat(np.cumsum(each) - each, each)
    column, row = first[triangle].T + np.stack(np.divmod(place, wide[triangle, 1]))
    cell = column * cells + row
    starts = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=cells**2))])
    return starts, triangle[np.argsort(cell, kind="stable")], step
