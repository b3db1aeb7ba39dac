"""Body from a triangle mesh: checked, repaired where that is safe, and replaced by a smooth F.

Vertices are taken to lie on the body. Their normals are those of osculating jets (`scatterers.triangles.jets`), which
give points between them, too; to both a quintic tensor-product B-spline is fitted (`scatterers.spline.fitting`), twice,
on grids of different spacing: by their difference the curvatures' error is known.

Sources: [CP05]; Derivations, B5 and B6.
"""

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scatterers.base.fitted_body import FittedBody, PointCloud, checked_options
from scatterers.spline.cache import key_of
from scatterers.spline.fitting import spacing_of
from scatterers.triangles.files import TriangleMesh, mesh_bytes, read_mesh
from scatterers.triangles.jet_points import centroids, signed_distance
from scatterers.triangles.jets import Jets, angle_weighted_normals, osculating_jets
from scatterers.triangles.quality import MeshQuality, assess

FloatArray = NDArray[np.float64]
CLEAN, NOISY = 1.3, 4.0
"""Spacings of the grid in units of the mean edge: for vertices and the points between them, and for noisy vertices,"""
TURN = 0.5
"""but these no more than so much over the curvature."""
GRID, ENOUGH, SMALL = 1e6, 2.0, 0.2
"""Nodes of the largest grid wanted; the spacing, in edges, at which vertices alone do, and over the radius of curvature
at which nothing is lost."""
NOISE = 2e-4
"""Noise in units of the mean edge from which on vertices count as noisy: below, the fit's own error is larger."""


class Mesh(FittedBody):
    """Smooth body through the vertices of a closed triangle mesh, in metres.

    Parameters
    ----------
    source : path, or object with ``vertices`` and ``faces``
        STL, OBJ, PLY, OFF, GLB or 3MF file, or e.g. a trimesh.Trimesh.
    units : {"m", "mm", "cm", "um", "in", "ft", "km"}, optional
        Unit of the numbers; must be given for files that do not state it. An object's numbers are metres by default.
    allow_rough : bool
        Take a mesh that is not smooth everywhere; `non_smooth` says where, and rays that come there end.
    cache : bool or path
        True: keep the fit in the user's cache folder; a path: in that folder; False: not at all.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.
    progress : callable, optional
        Called with a line of text before each long step and for each repair.

    Attributes
    ----------
    quality : MeshQuality
    fit : FitReport
    coarse_fit : SplineBody
        The same body fitted on a coarser grid: what differs on it is uncertain.
    repairs : tuple of str
        What was changed in the mesh.

    Raises
    ------
    ValueError
        If the source is not one closed, smooth body that its triangles resolve; says what, how many and where.

    Examples
    --------
    >>> import numpy as np
    >>> import scatterers as sc
    >>> import trimesh
    >>> body = sc.Mesh(trimesh.creation.icosphere(subdivisions=3), cache=False)
    >>> body.quality.verdict
    'smooth'
    >>> bool(np.all(abs(body.level(trimesh.creation.icosphere(subdivisions=4).vertices)) < 1e-4))
    True
    """

    def __init__(
        self,
        source: Any,
        units: str | None = None,
        *,
        allow_rough: bool = False,
        cache: bool | str | Path = True,
        speed: Any = None,
        progress: Callable[[str], None] | None = None,
    ) -> None:
        report = checked_options(units, allow_rough, cache, progress)
        in_memory = hasattr(source, "vertices") and hasattr(source, "faces")
        if in_memory and units is None and getattr(source, "units", None) is None:
            self.unit = "L"
        key = key_of("mesh", _content(source), units=units, allow_rough=allow_rough)
        self._open(key, cache, speed, lambda: self._points(source, units, allow_rough, report), report)

    def _points(self, source: Any, units: str | None, allow_rough: bool, progress: Callable[[str], None]) -> PointCloud:
        mesh, jets, quality = _examined(source, units, progress)
        if quality.verdict not in ("smooth", "noisy") and not allow_rough:
            raise ValueError(f"the mesh is not smooth enough ({quality.verdict}): {quality.reasons}")
        if quality.bad.any() and quality.verdict != "noisy":
            # jets say nothing there, the triangles a little
            usual = angle_weighted_normals(mesh.vertices, mesh.triangles)
            normals = np.where(quality.bad[:, None], usual, jets.normals)
            jets = replace(jets, fitted=jets.fitted & ~quality.bad, normals=normals)
        # noise is everywhere, and smoothed away
        non_smooth = mesh.vertices[quality.bad & (quality.verdict != "noisy")]
        points, normals, edge = mesh.vertices, jets.normals, quality.edge_mean
        mean = np.where(jets.fitted, jets.mean, np.nan)
        noisy, wide = quality.noise >= NOISE, spacing_of(points, GRID)
        if noisy:
            spacing = float(np.clip(TURN / max(quality.curvature, 1e-9), CLEAN, NOISY)) * edge
        elif wide > ENOUGH * edge and quality.curvature * wide < SMALL * edge:
            # very fine meshes tell more than the fit can use
            spacing = wide
        else:
            spacing = CLEAN * edge
            more = centroids(mesh.vertices, mesh.triangles, jets)
            points, normals = np.concatenate([points, more[0]]), np.concatenate([normals, more[1]])
            mean = np.concatenate([mean, np.full(len(more[0]), np.nan)])
        return PointCloud(
            points,
            normals,
            edge=edge,
            spacing=spacing,
            noise=quality.noise * edge if noisy else 0.0,
            non_smooth=non_smooth,
            distance=partial(signed_distance, mesh.vertices, jets),
            mean_curvature=None if noisy else mean,
            quality=quality,
            notes={"repairs": list(mesh.repairs), "source": source_name(source)},
        )


def examined_mesh(source: Any, units: str | None = None) -> tuple[TriangleMesh, MeshQuality]:
    """Read a mesh as `Mesh` does, and judge it; also one that `Mesh` refuses as not smooth.

    Parameters
    ----------
    source : path, or object with ``vertices`` and ``faces``
        As of `Mesh`.
    units : {"m", "mm", "cm", "um", "in", "ft", "km"}, optional
        As of `Mesh`.

    Returns
    -------
    mesh : TriangleMesh
        Vertices in metres.
    quality : MeshQuality
        Its verdict is "smooth" if `Mesh` takes the mesh.

    Raises
    ------
    ValueError
        If the source is not one closed body.

    Examples
    --------
    >>> import scatterers as sc
    >>> import trimesh
    >>> mesh, quality = sc.examined_mesh(trimesh.creation.box())
    >>> quality.verdict
    'sharp'
    """
    mesh, _, quality = _examined(source, units, lambda _: None)
    return mesh, quality


def _examined(
    source: Any, units: str | None, progress: Callable[[str], None]
) -> tuple[TriangleMesh, Jets, MeshQuality]:
    progress("reading the mesh")
    mesh = read_mesh(source, units, progress=progress)
    progress(f"normals of {len(mesh.vertices)} vertices")
    jets = osculating_jets(mesh.vertices, mesh.triangles)
    return mesh, jets, assess(mesh, jets)


def _content(source: Any) -> bytes:
    """What the fit depends on: the file's bytes, or the object's arrays."""
    if hasattr(source, "vertices") and hasattr(source, "faces"):
        try:
            arrays = [np.ascontiguousarray(values) for values in (source.vertices, source.faces)]
            if any(array.dtype.hasobject for array in arrays):
                return b""
        except (TypeError, ValueError):
            # what is wrong with it is said when it is read
            return b""
        stated = [str(getattr(source, "units", None)), *((array.shape, str(array.dtype)) for array in arrays)]
        return json.dumps(stated).encode() + b"".join(array.tobytes() for array in arrays)
    path, data = mesh_bytes(source)
    return path.suffix.lower().encode() + b"\0" + data


def source_name(source: Any) -> str:
    """Name of a file without its folder; nothing of a mesh in memory."""
    return Path(source).name if isinstance(source, (str, Path)) else ""
