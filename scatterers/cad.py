"""Body from a CAD file: points and exact normals of its faces by gmsh, and the fit of `scatterers.base.fitted_body`.

gmsh is an optional library under the GPL: ``pip install 'creeping[cad]'``.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scatterers.base.fitted_body import FittedBody, PointCloud, checked_options
from scatterers.cad_file.files import kind_of, read_cad
from scatterers.spline.cache import key_of
from scatterers.triangles.jet_points import signed_distance
from scatterers.triangles.jets import osculating_jets
from scatterers.triangles.quality import assess

FloatArray = NDArray[np.float64]
POINTS = 10_000
"""Points of the body that are asked for."""
SPACING = 2.0
"""Spacing of the grid in units of the mean distance of neighbouring points."""


class Cad(FittedBody):
    """Smooth body of a STEP, IGES or BREP file, in metres.

    Parameters
    ----------
    path : path
        A closed body whose faces join smoothly.
    units : {"m", "mm", "cm", "um", "in", "ft", "km"}, optional
        Unit of the numbers. STEP and IGES files state theirs, and another one is an error; BREP files do not.
    points : int
        Points of the body that are fitted; more for bodies with fine detail.
    allow_rough : bool
        Take a body that is not smooth everywhere; `non_smooth` says where, and rays that come there end.
    cache : bool or path
        True: keep the fit in the user's cache folder; a path: in that folder; False: not at all.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.
    progress : callable, optional
        Called with a line of text before each long step.

    Attributes
    ----------
    quality : MeshQuality
        Of the points.
    fit : FitReport
    coarse_fit : SplineBody
        The same body fitted on a coarser grid: what differs on it is uncertain.
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

    def __init__(
        self,
        path: str | Path,
        units: str | None = None,
        *,
        points: int = POINTS,
        allow_rough: bool = False,
        cache: bool | str | Path = True,
        speed: Any = None,
        progress: Callable[[str], None] | None = None,
    ) -> None:
        if isinstance(points, bool) or not isinstance(points, (int, np.integer)) or not 500 <= points <= 200_000:
            raise ValueError(f"points = {points!r}; give a whole number from 500 to 200000")
        points = int(points)
        report = checked_options(units, allow_rough, cache, progress)
        try:
            # before all of it is read
            kind_of(Path(path))
            content = Path(path).suffix.lower().encode() + b"\0" + Path(path).read_bytes()
        except (TypeError, OSError) as error:
            raise ValueError(f"{path} cannot be read: {error}") from None
        key = key_of("cad", content, units=units, points=points, allow_rough=allow_rough)
        self._open(key, cache, speed, lambda: self._points(Path(path), units, points, allow_rough, report), report)
        self.edges = tuple(self._text["edges"])

    def _points(
        self, path: Path, units: str | None, points: int, allow_rough: bool, progress: Callable[[str], None]
    ) -> PointCloud:
        progress("reading the CAD file")
        found = read_cad(path, units, points, progress=progress)
        jets = osculating_jets(found.mesh.vertices, found.mesh.triangles)
        quality = assess(found.mesh, jets)
        if found.edges and not allow_rough:
            raise ValueError(f"{path.name} is not smooth: {'; '.join(found.edges[:6])}; round its edges off")
        if quality.verdict != "smooth" and not allow_rough:
            raise ValueError(f"{path.name} is not smooth enough ({quality.verdict}): {quality.reasons}")
        non_smooth = np.concatenate([found.mesh.vertices[quality.bad], found.non_smooth])
        return PointCloud(
            found.mesh.vertices,
            np.where(np.isfinite(found.normals), found.normals, jets.normals),
            edge=quality.edge_mean,
            spacing=SPACING * quality.edge_mean,
            noise=0.0,
            non_smooth=non_smooth,
            distance=partial(signed_distance, found.mesh.vertices, jets),
            mean_curvature=np.where(jets.fitted & ~quality.bad, jets.mean, np.nan),
            quality=quality,
            notes={"source": path.name, "repairs": list(found.mesh.repairs), "edges": list(found.edges)},
        )
