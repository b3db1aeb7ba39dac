"""Bodies fitted to points and normals: two fits, their difference, and the checks before anything is traced."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from scatterers.base.level_body import LevelBody
from scatterers.sphere_map.star import star_map
from scatterers.spline import cache as _fit_cache
from scatterers.spline.fitting import SMOOTHING, Fitted, fit, tangents
from scatterers.spline.report import FitReport
from scatterers.spline.samples import Samples
from scatterers.spline.tensor import SYMMETRIC, TensorSpline, evaluated
from scatterers.triangles.quality import MeshQuality

if TYPE_CHECKING:
    from scatterers.atlas.monge.atlas import MongeAtlas

FloatArray = NDArray[np.float64]
Progress = Callable[[str], None]
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
CHARTS = "charts-"
DISTRUSTED = 2.0
"""Edges about a non-smooth point within which nothing is trusted."""
FEWEST = 0.1
"""Share of the points that has to be farther off, for a fit to mean anything."""
SLOPES = (0.5, 1.6)
"""|grad F| on the body: F is near a signed distance, or the fit has failed."""


@dataclass(frozen=True, eq=False)
class PointCloud:
    """What a body is fitted to.

    Attributes
    ----------
    points, normals : (n, 3), L and 1
        On the body, outward.
    edge : float
        Mean distance between neighbouring points of the source, L.
    spacing : float
        Of the grid that the points determine, L.
    noise : float
        Rms distance of the points from a smooth body, L; 0 if it is less than the error of a fit.
    non_smooth : (m, 3), L
        Points of the source where it is not smooth.
    distance : callable
        Signed distance from the body, (k, 3) -> (k,); NaN where it is not known.
    mean_curvature : (n,), 1/L, or None
        At the points, NaN where it is not known; None for noisy points.
    quality : MeshQuality
        Of the source.
    notes : dict
        Plain values that are kept beside the fit: ``repairs``, and what else a kind of body has to tell.
    """

    points: FloatArray
    normals: FloatArray
    edge: float
    spacing: float
    noise: float
    non_smooth: FloatArray
    distance: Callable[[FloatArray], FloatArray]
    mean_curvature: FloatArray | None
    quality: MeshQuality
    notes: dict[str, Any]

    @property
    def reach(self) -> float:
        """Distance from non-smooth points within which nothing is trusted, L."""
        return DISTRUSTED * self.edge

    @cached_property
    def smooth(self) -> NDArray[np.bool_]:
        """Points that are farther than that from non-smooth ones: (n,)."""
        from scipy.spatial import cKDTree

        return np.asarray(np.isinf(cKDTree(self.non_smooth).query(self.points, distance_upper_bound=self.reach)[0]))


class SplineBody(LevelBody):
    """Body F = 0 of a spline; the coarser fit is one."""

    def __init__(self, spline: TensorSpline, digest: str, speed: Any) -> None:
        self.speed = speed
        self._set_speed()
        self._digest = digest
        samples = Samples(spline.at_nodes(), spline.origin, spline.spacing)
        _require_one_body(samples)
        sphere_map, _ = star_map(spline, samples, None)
        self._place(spline, samples, sphere_map)

    def _identity(self) -> str:
        return self._digest

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
        self, key: str, cache: bool | str | Path, speed: Any, make: Callable[[], PointCloud], progress: Progress
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
            except (TypeError, ValueError, KeyError, AttributeError):
                # signed, and yet none of ours
                progress("the stored fit is damaged: fitting again")
                found = None
        arrays, text = found or self._fitted(make(), progress)
        self._describe(arrays, text)
        self._charts = {name[len(CHARTS) :]: array for name, array in arrays.items() if name.startswith(CHARTS)}
        super().__init__(_unpacked(arrays, "fine"), key, speed)
        self.coarse_fit = SplineBody(_unpacked(arrays, "coarse"), f"{key}, coarser", speed)
        self.coarse_fit._non_smooth, self.coarse_fit._reach = self._non_smooth, self._reach
        if found is None and folder is not None:
            if not self.star_shaped:
                progress("charts")
                # a body without them can still be looked at; who needs them is told
                with suppress(ValueError):
                    charts = cast("MongeAtlas", self.atlas).arrays()
                    arrays |= {CHARTS + name: array for name, array in charts.items()}
            if trouble := _fit_cache.store(folder, key, arrays, text):
                progress(trouble)

    def _describe(self, arrays: dict[str, FloatArray], text: dict[str, Any]) -> None:
        """Take over what is known of the fit."""
        self.fit = FitReport.from_json(text["fit"])
        self.quality = MeshQuality.from_json(text["quality"], arrays["badness"])
        self.repairs = tuple(text["repairs"])
        self._text = text
        self._non_smooth, self._reach = arrays["rough"], float(text["reach"])

    def _fitted(self, cloud: PointCloud, progress: Progress) -> tuple[dict[str, FloatArray], dict[str, Any]]:
        """Arrays and text of the fits, checked."""
        _require_smooth_points(cloud)
        fine, coarse, smoothing = fits(cloud, progress)
        report = compared(cloud, fine, coarse, smoothing)
        if not SLOPES[0] <= report.slope[0] <= report.slope[1] <= SLOPES[1] and not len(cloud.non_smooth):
            raise ValueError(
                f"the fit has failed: |grad F| is {report.slope[0]:.2g} to {report.slope[1]:.2g} on the body instead "
                "of 1; it is too thin or too curved for the distance of its points: refine the mesh there"
            )
        arrays = (
            {"rough": cloud.non_smooth, "badness": cloud.quality.badness}
            | _packed(fine.spline, "fine")
            | _packed(coarse.spline, "coarse")
        )
        text = {"fit": report.to_json(), "quality": cloud.quality.to_json(), "reach": cloud.reach}
        return arrays, text | cloud.notes


def checked_options(units: Any, allow_rough: Any, cache: Any, progress: Any) -> Progress:
    """What to call with progress; ValueError or TypeError on options that are none."""
    if units is not None and not isinstance(units, str):
        raise ValueError(f'units = {units!r} is no text; give e.g. units="mm"')
    if not isinstance(allow_rough, bool):
        raise ValueError(f"allow_rough = {allow_rough!r} is neither True nor False")
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
            progress=progress,
        )

    every = np.ones(len(cloud.points), dtype=bool)
    smoothing = SMOOTHINGS[0] if cloud.noise else SMOOTHING
    fine = fitted(cloud.spacing, smoothing, every)
    for more in SMOOTHINGS[1:] if cloud.noise else ():
        smoother = fitted(cloud.spacing, more, every)
        if smoother.misfit > EXCESS * cloud.noise:
            break
        fine, smoothing = smoother, more
    # fits to the same noise err alike
    fewer = np.random.default_rng(0).random(len(cloud.points)) < SECOND
    return fine, fitted(COARSENING * cloud.spacing, smoothing, fewer if cloud.noise else every), smoothing


def compared(cloud: PointCloud, fine: Fitted, coarse: Fitted, smoothing: float) -> FitReport:
    """Curvatures of both fits at the points, those of non-smooth places left out."""
    points, normals = cloud.points, cloud.normals
    if len(cloud.non_smooth):
        points, normals = points[cloud.smooth], normals[cloud.smooth]
    along = tangents(normals)[0]
    found = [_curvatures(one.spline, points, along) for one in (fine, coarse)]
    (kappa, gauss, slope), (other_kappa, other_gauss, _) = found

    def rms(values: FloatArray) -> float:
        return float(np.sqrt(np.mean(values**2)))

    return FitReport(
        points=len(cloud.points),
        spacing=fine.spacing,
        coarser_spacing=coarse.spacing,
        nodes=tuple(n - 4 for n in fine.spline.coefficients.shape),
        misfit=fine.misfit,
        turn=fine.turn,
        slope=(float(slope.min()), float(slope.max())),
        normal_curvature=rms(kappa),
        normal_curvature_error=rms(kappa - other_kappa),
        gaussian_curvature=rms(gauss),
        gaussian_curvature_error=rms(gauss - other_gauss),
        noise=cloud.noise,
        smoothing=smoothing,
    )


def _curvatures(
    spline: TensorSpline, points: FloatArray, along: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """kappa_n along tangents and across them (2 n,), K (n,) and |grad F| (n,) at points brought onto the spline."""
    for _ in range(2):
        value, gradient, _ = evaluated(spline.compiled, points)
        points = points - (value / np.sum(gradient**2, axis=1))[:, None] * gradient
    _, gradient, entries = evaluated(spline.compiled, points)
    slope = np.linalg.norm(gradient, axis=1)
    n = gradient / slope[:, None]
    e = along - np.sum(along * n, axis=1, keepdims=True) * n
    e /= np.linalg.norm(e, axis=1, keepdims=True)
    t = np.stack([e, np.cross(n, e)])
    form = np.einsum("ani,nij,bnj->abn", t, entries[:, SYMMETRIC], t) / slope
    gauss = form[0, 0] * form[1, 1] - form[0, 1] ** 2
    return np.concatenate([form[0, 0], form[1, 1]]), gauss, slope


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


def _unpacked(arrays: dict[str, FloatArray], name: str) -> TensorSpline:
    origin, spacing = arrays[f"{name}-grid"]
    return TensorSpline(np.ascontiguousarray(arrays[f"{name}-coefficients"], dtype=float), origin, spacing)
