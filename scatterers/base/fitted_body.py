"""Bodies fitted to points and normals: two fits, their difference, and the checks before anything is traced."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from scatterers.base.clouds import PieceCloud, PointCloud
from scatterers.base.level_body import LevelBody
from scatterers.pieces.crease import Crease
from scatterers.pieces.fitting import fitted_pieces
from scatterers.pieces.spline_body import SplinePiece, SplinePieces
from scatterers.sphere_map.star import star_map
from scatterers.spline import cache as _fit_cache
from scatterers.spline.compared import curvatures
from scatterers.spline.fitting import SMOOTHING, Fitted, fit, tangents
from scatterers.spline.report import FitReport
from scatterers.spline.samples import Samples
from scatterers.spline.tensor import TensorSpline
from scatterers.triangles.quality import MeshQuality

if TYPE_CHECKING:
    from scatterers.atlas.charts import CubeSphereAtlas
    from scatterers.atlas.monge.atlas import MongeAtlas

FloatArray = NDArray[np.float64]
Progress = Callable[[str], None]
Kept = tuple[Path, str, dict[str, FloatArray], dict[str, Any]]
COARSENING = 1.35
"""Spacing of the second fit, in units of the first."""
SMOOTHINGS = (1e-6, 1e-5, 1e-4, 1e-3)
"""Tried in turn on noisy points, until the misfit exceeds the noise,"""
EXCESS = 1.01
"""by this factor."""
NORMAL_WEIGHT = 0.1
"""Of the normals of noisy points: from jets they are noisier than the points."""
SECOND = 0.4
"""Share of noisy points that the second fit sees."""
CHARTS, NO_CHARTS, FITS = "charts-", "no_charts", ("fine", "coarse")
FEWEST = 0.1
"""Share of the points that has to be farther off, for a fit to mean anything."""
SLACK = 0.02
"""Of the box about a body of pieces, in its largest side."""
SLOPES = (0.5, 1.6)
"""|grad F| on the body: F is near a signed distance, or the fit has failed."""


class SplineBody(LevelBody):
    """Body F = 0 of a spline, or of one for each of its smooth pieces; the coarser fit is one.

    Attributes
    ----------
    creases : tuple of Crease
        Edges and seams of a body of pieces; empty if it is smooth.
    """

    _parts: SplinePieces | None = None

    def __init__(self, fitted: TensorSpline | SplinePieces, digest: str, speed: Any) -> None:
        self.speed = speed
        self._set_speed()
        self._digest = digest
        if isinstance(fitted, SplinePieces):
            self._parts, self._space, self._map = fitted, fitted.space, None
            corners = fitted.corners.reshape(-1, 3)
            slack = SLACK * np.ptp(corners, axis=0).max()
            self._bounds = np.stack([corners.min(axis=0) - slack, corners.max(axis=0) + slack])
            return
        samples = Samples(fitted.at_nodes(), fitted.origin, fitted.spacing)
        _require_one_body(samples)
        sphere_map, _ = star_map(fitted, samples, None)
        self._place(fitted, samples, sphere_map)

    def _identity(self) -> str:
        return self._digest

    def _shape_texts(self) -> list[str]:
        # what has creases has no charts
        return [self._digest] if self.creases else super()._shape_texts()

    @property
    def creases(self) -> tuple[Crease, ...]:
        """Where smooth pieces meet."""
        return () if self._parts is None else self._parts.creases

    @property
    def pieces(self) -> tuple[SplinePiece, ...]:
        """The smooth pieces, none of a body that is smooth as a whole."""
        return () if self._parts is None else self._parts.surfaces

    def piece(self, points: FloatArray) -> NDArray[np.int64]:
        """Number of the piece that bounds the body nearest to points (..., 3), L, near it: (...)."""
        if self._parts is None:
            return np.zeros(np.shape(points)[:-1], dtype=np.int64)
        return self._parts.space.numbers(points)

    def tiles(self, edge: float) -> tuple[FloatArray, FloatArray, NDArray[np.int64]]:
        """Triangles of the pieces with sides of at most ``edge``, L: corners, normals (m, 3, 3) and pieces (m,)."""
        if self._parts is None:
            raise ValueError("a body that is smooth as a whole has no pieces; its charts cover it")
        return self._parts.tiles(edge)

    def non_smooth(self, points: FloatArray) -> NDArray[np.bool_]:
        """Whether points (..., 3), L, lie where the body is not smooth enough, or not known well enough: (...)."""
        return super().non_smooth(points) if self._parts is None else self._parts.non_smooth(points)

    @property
    def quick_charts(self) -> bool:
        """Whether charts take no time; else only maps ask for them."""
        return self._map is not None

    def _covered(self) -> "CubeSphereAtlas | MongeAtlas":
        if self._parts is not None:
            raise ValueError("a body with edges has no charts; its rays go by direct integration")
        return super()._covered()

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._digest}, speed={self.speed!r})"


class FittedBody(SplineBody):
    """Base of Mesh and Cad.

    Attributes
    ----------
    fit : FitReport
    quality : MeshQuality
    coarse_fit : SplineBody
        The same body fitted on a coarser grid: what differs on it is uncertain.
    repairs : tuple of str
        What was changed in the source.
    unit : str
        "m": lengths are metres, whatever the unit in the file; "L" of a mesh in memory that states none.
    """

    unit = "m"

    def _open(
        self,
        key: str,
        cache: bool | str | Path,
        speed: Any,
        make: Callable[[], PointCloud | PieceCloud],
        progress: Progress,
    ) -> None:
        """Take the fit from the cache, or make the points and fit them."""
        self.speed = speed
        # before the fit: it may take minutes
        self._set_speed()
        folder = _fit_cache.cache_folder() if cache is True else Path(str(cache)) if cache else None
        found = None if folder is None else _fit_cache.load(folder, key)
        if found is not None:
            try:
                self._describe(*found)
                known = [_unpacked(found[0], name) for name in FITS]
            except (TypeError, ValueError, KeyError, AttributeError):
                # signed, and yet none of ours
                progress("the stored fit is damaged: fitting again")
                found = None
        arrays, text = found or self._fitted(make(), progress)
        if found is None:
            self._describe(arrays, text)
            known = [_unpacked(arrays, name) for name in FITS]
        self._charts = {name[len(CHARTS) :]: array for name, array in arrays.items() if name.startswith(CHARTS)}
        super().__init__(known[0], key, speed)
        self._no_charts = str(text.get(NO_CHARTS, ""))
        self.coarse_fit = SplineBody(known[1], f"{key}, coarser", speed)
        self.coarse_fit._non_smooth, self.coarse_fit._reach = self._non_smooth, self._reach
        self._kept: Kept | None = None
        if folder is not None:
            self._kept = folder, key, arrays, text
            if found is None and (trouble := _fit_cache.store(folder, key, arrays, text)):
                progress(trouble)

    def _covered(self) -> "CubeSphereAtlas | MongeAtlas":
        """Make the atlas; the charts, or that there are none, are kept with the fit: to find out takes as long."""
        known = bool(self._charts or self._no_charts)
        try:
            found = super()._covered()
        except ValueError:
            if self._no_charts and not known:
                self._keep({})
            raise
        if not (self.star_shaped or known):
            self._keep({CHARTS + name: array for name, array in cast("MongeAtlas", found).arrays().items()})
        return found

    def _keep(self, charts: dict[str, FloatArray]) -> None:
        if self._kept is not None:
            folder, key, arrays, text = self._kept
            _fit_cache.store(folder, key, arrays | charts, text | {NO_CHARTS: self._no_charts})

    def _describe(self, arrays: dict[str, FloatArray], text: dict[str, Any]) -> None:
        """Take over what is known of the fit."""
        self.fit = FitReport.from_json(text["fit"])
        self.quality = MeshQuality.from_json(text["quality"], arrays["badness"])
        self.repairs = tuple(text["repairs"])
        self._text = text
        self._non_smooth, self._reach = arrays["rough"], float(text["reach"])

    def _fitted(
        self, cloud: PointCloud | PieceCloud, progress: Progress
    ) -> tuple[dict[str, FloatArray], dict[str, Any]]:
        """Arrays and text of the fits, checked."""
        if isinstance(cloud, PieceCloud):
            return _fitted_pieces(cloud, progress)
        _require_smooth_points(cloud)
        fine, coarse, smoothing = fits(cloud, progress)
        try:
            for one in (fine, coarse):
                _require_one_body(Samples(one.spline.at_nodes(), one.spline.origin, one.spline.spacing))
        except ValueError as error:
            raise ValueError(f"{error}{_finer(cloud)}") from None
        report, doubt = compared(cloud, fine, coarse, smoothing)
        if not SLOPES[0] <= report.slope[0] <= report.slope[1] <= SLOPES[1] and not len(cloud.non_smooth):
            raise ValueError(
                f"the fit has failed: |grad F| is {report.slope[0]:.2g} to {report.slope[1]:.2g} on the body instead "
                f"of 1; it is too thin or too curved for the distance of its points: refine the mesh there"
                + _finer(cloud)
            )
        if doubt > cloud.uncertain:
            raise ValueError(
                f"the mesh is too coarse: its curvatures are uncertain by {100 * doubt:.0f} %; "
                f"{cloud.quality.reasons}{_finer(cloud)}"
            )
        arrays = (
            {"rough": cloud.non_smooth, "badness": cloud.quality.badness}
            | _packed(fine.spline, "fine")
            | _packed(coarse.spline, "coarse")
        )
        text = {"fit": report.to_json(), "quality": cloud.quality.to_json(), "reach": cloud.reach}
        return arrays, text | cloud.notes


def checked_options(units: Any, strict: Any, cache: Any, progress: Any) -> Progress:
    """What to call with progress; ValueError or TypeError on options that are none."""
    if units is not None and not isinstance(units, str):
        raise ValueError(f'units = {units!r} is no text; give e.g. units="mm"')
    if not isinstance(strict, bool):
        raise ValueError(f"strict = {strict!r} is neither True nor False")
    if not isinstance(cache, (bool, str, Path)):
        raise ValueError(f"cache = {cache!r} is neither True, False nor a folder")
    if progress is not None and not callable(progress):
        raise TypeError(f"progress = {progress!r} cannot be called; give a function of one text")
    return progress or (lambda _: None)


def fits(cloud: PointCloud, progress: Progress) -> tuple[Fitted, Fitted, float]:
    """The fit, one on a coarser grid, and the smoothing: the least that leaves the points off by their noise."""

    def fitted(spacing: float, smoothing: float, some: NDArray[np.bool_]) -> Fitted:
        weight = NORMAL_WEIGHT if cloud.noise else 1.0
        return fit(
            cloud.points[some],
            cloud.normals[some],
            spacing,
            distance=cloud.distance,
            trusted=cloud.smooth[some] if len(cloud.non_smooth) else None,
            mean_curvature=None if cloud.mean_curvature is None else cloud.mean_curvature[some],
            smoothing=smoothing,
            normal_weight=weight,
            keep_start=not (cloud.noise or coarse),
            progress=progress,
        )

    every = np.ones(len(cloud.points), dtype=bool)
    # where most jets are bad, so is the distance that they give, and samples leave much free
    coarse = bool(np.isfinite(cloud.uncertain))
    smoothing = SMOOTHINGS[0] if cloud.noise or coarse else SMOOTHING
    fine = fitted(cloud.spacing, smoothing, every)
    for more in SMOOTHINGS[1:] if cloud.noise else ():
        # what is smoother is off by more
        if fine.misfit > EXCESS * cloud.noise:
            break
        smoother = fitted(cloud.spacing, more, every)
        if smoother.misfit > EXCESS * cloud.noise:
            break
        fine, smoothing = smoother, more
    # fits to the same noise err alike
    fewer = np.random.default_rng(0).random(len(cloud.points)) < SECOND
    return fine, fitted(COARSENING * cloud.spacing, smoothing, fewer if cloud.noise else every), smoothing


def compared(cloud: PointCloud, fine: Fitted, coarse: Fitted, smoothing: float) -> tuple[FitReport, float]:
    """Curvatures of both fits at the points, non-smooth places left out, and how far these are uncertain to their rms.

    What both grids have in common their difference does not show: the normals that the finer one does not reach do, as
    an angle over a cell, unless it is the points' noise that it does not follow. Where a subdivision has moved the
    vertices by m the body is taken for a surface parallel to its own, as curved regions move most: kappa changes by
    m kappa^2, K by 2 H K m; and m changes over a radius of curvature, which turns normals by m kappa. None of that
    is uncertain in the fit.
    """
    points, normals = cloud.points, cloud.normals
    if len(cloud.non_smooth):
        points, normals = points[cloud.smooth], normals[cloud.smooth]
    along = tangents(normals)[0]
    found = [curvatures(one.spline, points, along) for one in (fine, coarse)]
    (kappa, gauss, slope), (other_kappa, other_gauss, _) = found

    def rms(values: FloatArray) -> float:
        return float(np.sqrt(np.mean(values**2)))

    scattered = bool(cloud.noise) or bool(np.isfinite(cloud.uncertain))
    shared = 0.0 if scattered else fine.turn / fine.spacing
    # K = k1 k2, both off by as much, kappa taken along two directions at right angles
    shared_gauss = np.sqrt(2) * rms(kappa) * shared
    error = float(np.hypot(rms(kappa - other_kappa), shared))
    gauss_error = float(np.hypot(rms(gauss - other_gauss), shared_gauss))
    m, twice_mean = cloud.moved, np.sum(kappa.reshape(2, -1), axis=0)
    report = FitReport(
        points=len(cloud.points),
        spacing=fine.spacing,
        coarser_spacing=coarse.spacing,
        nodes=tuple(n - 4 for n in fine.spline.coefficients.shape),
        misfit=float(np.hypot(fine.misfit, m)),
        turn=float(np.hypot(fine.turn, m * rms(kappa))),
        slope=(float(slope.min()), float(slope.max())),
        normal_curvature=rms(kappa),
        normal_curvature_error=float(np.hypot(error, m * rms(kappa**2))),
        gaussian_curvature=rms(gauss),
        gaussian_curvature_error=float(np.hypot(gauss_error, m * rms(twice_mean * gauss))),
        noise=cloud.noise,
        smoothing=smoothing,
    )
    return report, error / report.normal_curvature


def _fitted_pieces(cloud: PieceCloud, progress: Progress) -> tuple[dict[str, FloatArray], dict[str, Any]]:
    """Arrays and text of the fits of all pieces."""
    fitted = fitted_pieces(cloud.vertices, cloud.triangles, cloud.regions, progress, cloud.normals, cloud.noise)
    corners = cloud.vertices[cloud.triangles]
    arrays = {"rough": np.zeros((0, 3)), "badness": cloud.quality.badness}
    for name in FITS:
        arrays |= SplinePieces.of(fitted, corners, coarse=name == "coarse").arrays(name)
    text = {"fit": fitted.report().to_json(), "quality": cloud.quality.to_json(), "reach": 0.0}
    return arrays, text | cloud.notes


def _finer(cloud: PointCloud) -> str:
    """What helps a mesh, not a CAD file, that is too coarse for its fit."""
    if cloud.quality.verdict != "too coarse" or "edges" in cloud.notes:
        return ""
    return '; or subdivide="auto", which takes a smooth surface near its vertices'


def _require_smooth_points(cloud: PointCloud) -> None:
    """ValueError if hardly a point is left when those about non-smooth places are taken away."""
    if not len(cloud.non_smooth) or np.mean(cloud.smooth) >= FEWEST:
        return
    raise ValueError(
        f"{np.sum(~cloud.smooth)} of {len(cloud.points)} points lie within {cloud.reach:.3g} m of places where the "
        "body is not smooth, and nothing is known there; refine the mesh"
    )


def _require_one_body(samples: Samples) -> None:
    """ValueError unless F < 0 in one connected part, F > 0 around it in one."""
    bodies = samples.middles()
    if len(bodies) == 1 and not samples.has_cavity() and np.all(samples.on_faces() > 0):
        return
    raise ValueError(
        f"the fit has failed: F = 0 falls into {len(bodies)} parts on a grid of spacing {samples.spacing[0]:.3g} m"
        + (" with a cavity" if samples.has_cavity() else "")
        + "; parts of the body are too thin for its mesh, or it has edges: refine it, round them off"
    )


def _packed(spline: TensorSpline, name: str) -> dict[str, FloatArray]:
    return {
        f"{name}-coefficients": spline.coefficients,
        f"{name}-grid": np.stack([spline.origin, spline.spacing]),
    }


def _unpacked(arrays: dict[str, FloatArray], name: str) -> TensorSpline | SplinePieces:
    if f"{name}-table" in arrays:
        return SplinePieces.restored(arrays, name)
    origin, spacing = arrays[f"{name}-grid"]
    return TensorSpline(np.ascontiguousarray(arrays[f"{name}-coefficients"], dtype=float), origin, spacing)
