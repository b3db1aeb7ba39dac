"""Body from a triangle mesh: checked, repaired where that is safe, and replaced by a smooth F.

Vertices are taken to lie on the body. Their normals are those of osculating jets (`scatterers.triangles.jets`), which
give points between them, too; to both a quintic tensor-product B-spline is fitted (`scatterers.fits.solver`), twice,
on grids of different spacing: by their difference the curvatures' error is known.

Sources: [CP05]; Derivations, B5 and B6.
"""

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from scatterers.body import teller
from scatterers.fits.cache import key_of
from scatterers.fits.cloud import DISTRUSTED, Nearer, PieceCloud, PointCloud
from scatterers.fits.fitted_body import FittedBody
from scatterers.fits.joints import Jointed, jointed
from scatterers.fits.solver import spacing_of
from scatterers.triangles.files import TriangleMesh, mesh_bytes, read_mesh
from scatterers.triangles.jets import Jets, angle_weighted_normals, centroids, osculating_jets, signed_distance
from scatterers.triangles.quality import Choice, MeshQuality, assess, jumps_at, noise_at_most
from scatterers.triangles.regions import FEWEST, regions_of
from scatterers.triangles.subdivision import Subdivision, edges_where_curved, subdivided

GRID = 1e6
"""Nodes of the largest grid wanted."""
NOISE = 2e-4
"""Noise in units of the mean edge from which on vertices count as noisy: below, the fit's own error is larger."""


class Mesh(FittedBody):
    """Smooth body through the vertices of a closed triangle mesh, in metres.

    Parameters
    ----------
    source : path, or object with ``vertices`` and ``faces``
        STL, OBJ, PLY, OFF, GLB, 3MF, MSH (Gmsh) or BDF (NASTRAN) file, packed by gzip or not, or e.g. a
        trimesh.Trimesh.
    units : {"m", "mm", "cm", "um", "in", "ft", "km"}, optional
        Unit of the coordinates; required for files that do not state it. Objects in memory are in metres by default.
    strict : bool
        Refuse a mesh that is not smooth everywhere, or whose triangles hardly resolve it. Otherwise the body is
        split into smooth pieces that end at its `creases`. Rays end where `non_smooth` finds the body uncertain.
    part : str or int, optional
        Which of several parts of the file: "largest", a number from 1 in the order of their areas, or a name.
    cap : float, optional
        Largest hole to close, m; inf closes all. The borders of closed holes become edges.
    union : bool
        Take the outer surface of all parts together; parts may cross each other. Needs the library manifold3d.
    subdivide : {"auto", 1, 2, 3}, optional
        Number of Loop subdivisions of a coarse mesh of a smooth body; "auto" subdivides if the mesh is too coarse. The
        subdivided surface does not pass through the vertices; `repairs` states how far they moved. Meshes with edges
        or joints are not subdivided.
    surface : {"smooth", "facets", "auto"}
        "facets" returns `Facets` of the same source; "auto" does so if no smooth surface fits.
    cache : bool or path
        True stores the fit in the cache folder of the user; a path stores it in that folder; False does not store it.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.
    progress : callable or bool, optional
        Called with a line of text before each long step and for each repair; True shows them.

    Attributes
    ----------
    quality : MeshQuality
    fit : FitReport
    coarse_fit : SplineBody
        The same body fitted on a coarser grid; the difference shows the uncertainty of the shape. For a subdivided
        mesh the second fit uses a finer grid and follows the original mesh.
    repairs : tuple of str
        Changes made to the mesh.

    Raises
    ------
    ValueError
        If the source is not one closed, smooth body that its triangles resolve; the message says what is wrong and
        where.

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
        strict: bool = False,
        part: str | int | None = None,
        cap: float | None = None,
        union: bool = False,
        subdivide: str | int | None = None,
        surface: str = "smooth",
        cache: bool | str | Path = True,
        speed: Any = None,
        progress: Callable[[str], None] | bool | None = None,
    ) -> None:
        if surface == "auto":
            # made already
            return
        report = teller(progress)
        in_memory = hasattr(source, "vertices") and hasattr(source, "faces")
        if in_memory and units is None and getattr(source, "units", None) is None:
            self.unit = "L"
        choice = Choice(part, cap, union, subdivide)
        key = key_of("mesh", _content(source), units=units, strict=strict, choice=choice.text)
        self._open(key, cache, speed, lambda: self._points(source, units, strict, choice, report), report)

    def _points(
        self, source: Any, units: str | None, strict: bool, choice: Choice, progress: Callable[[str], None]
    ) -> PointCloud | PieceCloud:
        mesh, jets, quality, pieces = _examined(source, units, choice, progress)
        if strict and quality.verdict not in ("smooth", "noisy"):
            raise ValueError(f"the mesh is not smooth enough ({quality.verdict}): {quality.reasons}")
        if pieces is not None:
            return pieces
        if mesh.loop is not None:
            return _subdivided_cloud(mesh, mesh.loop, jets, quality, source_name(source))
        # more bad vertices than can be left out: a whole fit tells what it is worth
        coarse = quality.verdict == "too coarse" and quality.bad_share > 0.05
        bad = quality.bad & (quality.verdict != "noisy") & (not coarse)
        if bad.any():
            # jets say nothing there, the triangles a little
            usual = angle_weighted_normals(mesh.vertices, mesh.triangles)
            normals = np.where(bad[:, None], usual, jets.normals)
            jets = replace(jets, fitted=jets.fitted & ~bad, normals=normals)
        # noise is everywhere, and smoothed away
        non_smooth = mesh.vertices[bad]
        points, normals, edge = mesh.vertices, jets.normals, quality.edge_mean
        mean = np.where(jets.fitted, jets.mean, np.nan)
        noisy, wide = quality.noise >= NOISE, spacing_of(points, GRID)
        if noisy:
            # up to 4 edges, but no more than half the radius of curvature
            spacing = float(np.clip(0.5 / max(quality.curvature, 1e-9), 1.3, 4.0)) * edge
        elif wide > 2.0 * edge and quality.curvature * wide < 0.2 * edge:
            # very fine meshes tell more than the fit can use, and vertices alone do
            spacing = wide
        else:
            spacing = 1.3 * edge
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
            # by which curvatures may depend on the grid, relative to their rms
            uncertain=0.25 if coarse else np.inf,
            notes={"repairs": list(mesh.repairs), "source": source_name(source)},
        )


def _subdivided_cloud(mesh: TriangleMesh, loop: Subdivision, jets: Jets, quality: MeshQuality, name: str) -> PointCloud:
    """Points of a subdivided mesh, for grids and a smoothing that leave out what its source does not hold."""
    # spacings in edges of the source where it curves; finer grids and less smoothing leave ripples
    of_source = (1.3, 1.0, 0.65)
    curvature = np.abs(jets.principal).max(axis=1)
    edge = max(edges_where_curved(mesh.vertices, mesh.triangles, curvature), 0.45 * quality.edge_mean)
    grids = tuple(cells * edge * 2**loop.times for cells in of_source)
    others = osculating_jets(loop.nearer, mesh.triangles)
    return PointCloud(
        mesh.vertices,
        jets.normals,
        # what is said of a vertex of the source is of an edge about it
        edge=grids[0] / of_source[0] / DISTRUSTED,
        spacing=grids[0],
        noise=0.0,
        non_smooth=np.zeros((0, 3)),
        distance=partial(signed_distance, mesh.vertices, jets),
        mean_curvature=None,
        quality=quality,
        notes={"repairs": list(mesh.repairs), "source": name},
        # more than of other meshes, as more is counted
        uncertain=0.5,
        smoothing=1e-3,
        narrower=grids[1:],
        nearer=Nearer(loop.nearer, others.normals, partial(signed_distance, loop.nearer, others), loop.source),
    )


def examined_mesh(
    source: Any,
    units: str | None = None,
    *,
    part: str | int | None = None,
    cap: float | None = None,
    union: bool = False,
    subdivide: str | int | None = None,
) -> tuple[TriangleMesh, MeshQuality]:
    """Read a mesh as `Mesh` does and assess its quality, even if `Mesh` would refuse it as not smooth.

    Parameters
    ----------
    source : path, or object with ``vertices`` and ``faces``
        As for `Mesh`.
    units : {"m", "mm", "cm", "um", "in", "ft", "km"}, optional
        As for `Mesh`.
    part, cap, union, subdivide
        As for `Mesh`.

    Returns
    -------
    mesh : TriangleMesh
        Vertices in metres.
    quality : MeshQuality
        The verdict is "smooth" if `Mesh` accepts the mesh as one smooth body.

    Raises
    ------
    ValueError
        If the source is not one closed body, or if ``subdivide`` is a number and the mesh has edges or joints or
        would get more vertices than are allowed.

    Examples
    --------
    >>> import scatterers as sc
    >>> import trimesh
    >>> mesh, quality = sc.examined_mesh(trimesh.creation.box())
    >>> quality.verdict
    'sharp'
    """
    choice = Choice(part, cap, union, subdivide)
    found = _examined(source, units, choice, lambda _: None)
    return found.mesh, found.quality


class _Examined(NamedTuple):
    """A mesh, its vertices' jets, what these say of it, and its smooth pieces if it has edges or joints."""

    mesh: TriangleMesh
    jets: Jets
    quality: MeshQuality
    pieces: PieceCloud | None


def _examined(source: Any, units: str | None, choice: Choice, progress: Callable[[str], None]) -> _Examined:
    """The mesh of a source, subdivided where that is asked for and it is smooth."""
    progress("reading the mesh")
    mesh, times = read_mesh(source, units, choice, progress=progress), choice.subdivide
    progress(f"normals of {len(mesh.vertices)} vertices")
    jets = osculating_jets(mesh.vertices, mesh.triangles)
    quality, joints = _with_joints(assess(mesh.vertices, mesh.triangles, jets), mesh, jets)
    pieces = _pieces(mesh, quality, joints, source_name(source))
    if times is None or (times == "auto" and (quality.verdict != "too coarse" or pieces is not None)):
        return _Examined(mesh, jets, quality, pieces)
    if pieces is not None:
        raise ValueError(
            f"the mesh has edges or joints ({quality.verdict}), which subdivide = {times} would round off; leave it "
            "out: its smooth pieces are taken as they are; or give more vertices where it is to be smooth"
        )
    found = mesh
    # a coarse mesh once, as its vertices hold no more; again while they are few
    for count in range(1, 4) if times == "auto" else (int(times),):
        if times == "auto" and 4 * len(found.vertices) > 60_000:
            break
        notes: list[str] = []
        loop = subdivided(mesh.vertices, mesh.triangles, count, notes.append)
        found = TriangleMesh(loop.vertices, loop.triangles, (*mesh.repairs, *notes), loop)
        progress(f"normals of {len(found.vertices)} vertices")
        jets = osculating_jets(found.vertices, found.triangles)
        quality = assess(found.vertices, found.triangles, jets)
        if quality.verdict != "too coarse" or len(found.vertices) >= 300:
            break
    for line in found.repairs[len(mesh.repairs) :]:
        progress(line)
    return _Examined(found, jets, quality, None)


def _pieces(mesh: TriangleMesh, quality: MeshQuality, joints: Jointed | None, name: str) -> PieceCloud | None:
    """The smooth pieces of a mesh with edges or joints; None if it is one smooth piece."""
    if quality.verdict in ("smooth", "noisy"):
        return None
    notes = {"repairs": list(mesh.repairs), "source": name}
    if joints is not None:
        regions = regions_of(joints.vertices, joints.triangles, sharp=joints.sharp, level=joints.level)
        return PieceCloud(joints.vertices, joints.triangles, regions, None, quality, notes, joints.noise)
    regions = regions_of(mesh.vertices, mesh.triangles)
    # creases that end on smooth ground are folds of a coarse mesh, unless most sharp edges are in chains
    if regions.count > 1 or (regions.crease.any() and quality.verdict == "sharp"):
        return PieceCloud(mesh.vertices, mesh.triangles, regions, None, quality, notes)
    return None


def _with_joints(quality: MeshQuality, mesh: TriangleMesh, jets: Jets) -> tuple[MeshQuality, Jointed | None]:
    """What jets make of the vertices, corrected where the body is planes and quadrics that join; and these."""
    # between long triangles jets tell of no jumps, and noise drowns them
    told = quality.jumps >= FEWEST or quality.verdict == "too coarse"
    if not told and quality.noise < NOISE:
        return quality, None
    clean = jets.fitted & ~quality.bad & ~jumps_at(jets, quality.edge_mean)
    joints = jointed(mesh.vertices, mesh.triangles, jets.normals, clean) if told else None
    noise = noise_at_most(jets)
    # with more noise jets find no joints
    if joints is None and noise < 5e-3 * quality.edge_mean:
        joints = jointed(mesh.vertices, mesh.triangles, jets.normals, clean, noise)
    if joints is None or joints.sharp.any():
        return quality, joints
    return replace(
        quality,
        verdict="curvature jumps",
        jumps=joints.on_joints,
        reasons=f"the curvature jumps at {joints.on_joints} of {len(joints.vertices)} vertices, on joints of planes "
        "and quadrics, as where a cylinder meets a sphere; the body is taken in smooth pieces, and rays across their "
        "joints are of low order: blend the faces with continuous curvature for a smooth one",
    ), joints


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
