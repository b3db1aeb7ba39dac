"""Body from a CAD file: points and exact normals of its faces by gmsh, and the fit of `scatterers.fits.fitted_body`.

gmsh is an optional library under the GPL: ``pip install 'creeping[cad]'``.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from scatterers.body import teller
from scatterers.fits.cache import key_of
from scatterers.fits.cloud import PieceCloud, PointCloud
from scatterers.fits.fitted_body import FittedBody
from scatterers.triangles.cad_file import POINTS, CadPoints, CadReading, kind_of, read_cad
from scatterers.triangles.jets import osculating_jets, signed_distance
from scatterers.triangles.quality import Choice, MeshQuality, assess
from scatterers.triangles.regions import regions_of
from scatterers.triangles.topology import edges_of


class Cad(FittedBody):
    """Smooth body of a STEP, IGES or BREP file, in metres.

    Parameters
    ----------
    path : path
        A closed body whose faces join smoothly.
    units : {"m", "mm", "cm", "um", "in", "ft", "km"}, optional
        Unit of the coordinates. STEP and IGES files state their unit, and another one is an error; BREP files do not.
    points : int
        Number of surface points to fit; increase it for bodies with fine detail.
    strict : bool
        Refuse a body that is not smooth everywhere. Otherwise the body is split into smooth pieces that end at its
        `creases`. Rays end where `non_smooth` finds the body uncertain.
    part : str or int, optional
        Which of several bodies of the file: "largest", or a number from 1 in the order of their areas.
    cap : float, optional
        Largest hole to close, m; inf closes all. The borders of closed holes become edges.
    union : bool
        Take the outer surface of all bodies together; bodies may cross each other. Needs the library manifold3d.
    sew : float, optional
        Largest gap between faces to sew together first, m.
    surface : {"smooth", "facets", "auto"}
        "facets" returns `Facets` of the same source; "auto" does so if no smooth surface fits.
    cache : bool or path
        True stores the fit in the cache folder of the user; a path stores it in that folder; False does not store it.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.
    progress : callable or bool, optional
        Called with a line of text before each long step; True shows them.

    Attributes
    ----------
    quality : MeshQuality
        Quality of the surface points that were fitted.
    fit : FitReport
    coarse_fit : SplineBody
        The same body fitted on a coarser grid; the difference shows the uncertainty of the shape.
    edges : tuple of str
        Edges and tips at which the faces do not join smoothly.

    Raises
    ------
    ValueError
        If the file cannot be read, is not one closed body, or has edges or tips.
    ModuleNotFoundError
        If gmsh is not installed.

    Examples
    --------
    >>> import scatterers as sc
    >>> hull = sc.Cad("hull.step")                              # doctest: +SKIP
    """

    tessellated = True
    """Triangles approximate curved faces."""

    def __init__(
        self,
        path: str | Path,
        units: str | None = None,
        *,
        points: int = POINTS,
        strict: bool = False,
        part: str | int | None = None,
        cap: float | None = None,
        union: bool = False,
        sew: float | None = None,
        surface: str = "smooth",
        cache: bool | str | Path = True,
        speed: Any = None,
        progress: Callable[[str], None] | bool | None = None,
    ) -> None:
        if surface == "auto":
            # made already
            return
        if isinstance(points, bool) or not isinstance(points, (int, np.integer)) or not 500 <= points <= 200_000:
            raise ValueError(f"points = {points!r}; give a whole number from 500 to 200000")
        points = int(points)
        report = teller(progress)
        try:
            # before all of it is read
            kind_of(Path(path))
            content = Path(path).suffix.lower().encode() + b"\0" + Path(path).read_bytes()
        except (TypeError, OSError) as error:
            raise ValueError(f"{path} cannot be read: {error}") from None
        choice = Choice(part, cap, union)
        key = key_of("cad", content, units=units, points=points, strict=strict, choice=choice.text, sew=sew)
        reading = CadReading(units, points, choice, sew)
        self._open(key, cache, speed, lambda: self._points(Path(path), reading, strict, report), report)
        self.edges = tuple(self._text["edges"])

    def _points(
        self, path: Path, reading: CadReading, strict: bool, progress: Callable[[str], None]
    ) -> PointCloud | PieceCloud:
        progress("reading the CAD file")
        found = read_cad(path, reading, progress=progress)
        jets = osculating_jets(found.mesh.vertices, found.mesh.triangles)
        quality = _with_joints(assess(found.mesh.vertices, found.mesh.triangles, jets), found)
        if found.edges and strict:
            raise ValueError(f"{path.name} is not smooth: {'; '.join(found.edges[:6])}; round its edges off")
        notes = {"source": path.name, "edges": list(found.edges)}
        if quality.verdict != "smooth" and strict:
            raise ValueError(f"{path.name} is not smooth enough ({quality.verdict}): {quality.reasons}")
        if found.creases.any() or found.jumps.any() or (quality.verdict != "smooth" and found.level.any()):
            # fillets ask for more points than faces: so many triangles to a full turn
            found = read_cad(path, reading, curved=30, progress=progress)
            mesh, normals = found.mesh, found.corner_normals
            regions = regions_of(mesh.vertices, mesh.triangles, sharp=found.creases, level=found.level)
            return PieceCloud(
                mesh.vertices, mesh.triangles, regions, normals, quality, notes | {"repairs": list(mesh.repairs)}
            )
        return PointCloud(
            found.mesh.vertices,
            np.where(np.isfinite(found.normals), found.normals, jets.normals),
            edge=quality.edge_mean,
            spacing=2.0 * quality.edge_mean,
            noise=0.0,
            non_smooth=found.mesh.vertices[quality.bad],
            distance=partial(signed_distance, found.mesh.vertices, jets),
            mean_curvature=np.where(jets.fitted & ~quality.bad, jets.mean, np.nan),
            quality=quality,
            notes=notes | {"repairs": list(found.mesh.repairs)},
            # in mean edges; cells of one edge would hold too few points
            narrower=(1.5 * quality.edge_mean, 1.2 * quality.edge_mean),
            exact=bool(np.all(np.isfinite(found.normals[quality.bad]))),
        )


def _with_joints(quality: MeshQuality, found: CadPoints) -> MeshQuality:
    """What jets make of the points, corrected by the faces: joints all over a mesh are nothing odd to jets."""
    ends = edges_of(found.mesh.triangles).ends
    if found.creases.any():
        if quality.verdict != "smooth":
            return quality
        count = len(np.unique(ends[found.creases]))
        return replace(
            quality,
            verdict="sharp",
            reasons=f"{count} of {quality.vertices} vertices lie on edges, at which faces do not join smoothly; the "
            "body is taken in smooth pieces, where rays end; round the edges off for a smooth one",
        )
    if not found.jumps.any():
        return quality
    count = len(np.unique(ends[found.jumps]))
    return replace(
        quality,
        verdict="curvature jumps",
        jumps=count,
        reasons=f"the curvature jumps at {count} of {quality.vertices} vertices, on joints of faces, as where a fillet "
        "meets a plane; the body is taken in smooth pieces, and rays across their joints are of low order: blend the "
        "faces with continuous curvature for a smooth one",
    )
