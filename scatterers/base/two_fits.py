"""Two fits to one cloud of points, checked: the body, and another by which its error is known.

The second is on a coarser grid, and tells how the fit depends on it. To points nearer to the source it is finer and
follows their normals: what the first leaves of a mesh that hardly resolves its body shows there.

Sources: Derivations, B6.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scatterers.base.clouds import PointCloud
from scatterers.spline.compared import curvatures, left_at, tangents
from scatterers.spline.fitting import SMOOTHING, Fitted, fit
from scatterers.spline.report import FitReport
from scatterers.spline.samples import Samples

FloatArray = NDArray[np.float64]
Progress = Callable[[str], None]
COARSENING, FINER = 1.35, 0.75
"""Spacing of the second fit, in units of the first, and to points nearer to the source."""
SMOOTHINGS = (1e-6, 1e-5, 1e-4, 1e-3)
"""Tried in turn on noisy points, until the misfit exceeds the noise,"""
EXCESS = 1.01
"""by this factor."""
NORMAL_WEIGHT = 0.1
"""Of the normals of noisy points: from jets they are noisier than the points."""
SECOND = 0.4
"""Share of noisy points that the second fit sees."""
SLOPES = (0.5, 1.6)
"""|grad F| on the body: F is near a signed distance, or the fit has failed."""


def good_fit(cloud: PointCloud, progress: Progress) -> tuple[Fitted, Fitted, FitReport]:
    """Both fits on the first of the spacings that serves, and what is known of them; ValueError if none does."""
    for number, spacing in enumerate(cloud.finer, 1):
        try:
            return _checked_fit(replace(cloud, spacing=spacing, finer=()), progress)
        except ValueError as error:
            if number == len(cloud.finer):
                raise
            progress(f"on a grid of {spacing:.3g} m {error}")
    return _checked_fit(cloud, progress)


def _checked_fit(cloud: PointCloud, progress: Progress) -> tuple[Fitted, Fitted, FitReport]:
    fine, coarse, smoothing = fits(cloud, progress)
    report, doubt = compared(cloud, fine, coarse, smoothing)
    if not SLOPES[0] <= report.slope[0] <= report.slope[1] <= SLOPES[1] and not len(cloud.non_smooth):
        raise ValueError(
            f"the fit has failed: |grad F| is {report.slope[0]:.2g} to {report.slope[1]:.2g} on the body instead "
            f"of 1; it is too thin or too curved for the distance of its points: refine the mesh there" + _finer(cloud)
        )
    if doubt > cloud.uncertain:
        raise ValueError(
            f"the mesh is too coarse: its curvatures are uncertain by {100 * doubt:.0f} %; "
            f"{cloud.quality.reasons}{_finer(cloud)}"
        )
    return fine, coarse, report


def fits(cloud: PointCloud, progress: Progress) -> tuple[Fitted, Fitted, float]:
    """The fit, one on another grid, and the smoothing: the least that leaves the points off by their noise."""
    # where most jets are bad, so is the distance that they give, and samples leave much free
    coarse = bool(np.isfinite(cloud.uncertain))

    def fitted(of: PointCloud, spacing: float, smoothing: float, some: NDArray[np.bool_] | slice) -> Fitted:
        return fit(
            of.points[some],
            of.normals[some],
            spacing,
            distance=of.distance,
            trusted=of.smooth[some] if len(of.non_smooth) else None,
            mean_curvature=None if of.mean_curvature is None else of.mean_curvature[some],
            smoothing=smoothing,
            normal_weight=NORMAL_WEIGHT if of.noise or of.nearer else 1.0,
            keep_start=not (of.noise or coarse),
            progress=progress,
        )

    every = slice(None)
    smoothing = cloud.smoothing or (SMOOTHINGS[0] if cloud.noise or coarse else SMOOTHING)
    fine = fitted(cloud, cloud.spacing, smoothing, every)
    require_one_body(_samples(fine), _finer(cloud))
    for more in SMOOTHINGS[1:] if cloud.noise else ():
        # what is smoother is off by more
        if fine.misfit > EXCESS * cloud.noise:
            break
        smoother = fitted(cloud, cloud.spacing, more, every)
        if smoother.misfit > EXCESS * cloud.noise:
            break
        fine, smoothing = smoother, more
    # fits to the same noise err alike
    fewer = np.random.default_rng(0).random(len(cloud.points)) < SECOND if cloud.noise else every
    other = fitted(cloud.nearer or cloud, (FINER if cloud.nearer else COARSENING) * cloud.spacing, smoothing, fewer)
    if cloud.nearer and not _one_body(_samples(other)):
        # between points that are too far apart for it
        other = fitted(cloud.nearer, COARSENING * cloud.spacing, smoothing, fewer)
    require_one_body(_samples(other), _finer(cloud))
    return fine, other, smoothing


def compared(cloud: PointCloud, fine: Fitted, coarse: Fitted, smoothing: float) -> tuple[FitReport, float]:
    """Curvatures of both fits at the points, non-smooth places left out, and how far these are uncertain to their rms.

    What both grids have in common their difference does not show: the normals that the finer one does not reach do, as
    an angle over a cell, unless it is the points' noise that it does not follow. Where the second fit is to points
    nearer to the source, misfit and turn are those of these.
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
    misfit, turn = fine.misfit, fine.turn
    if cloud.nearer is not None:
        misfit, turn = left_at(fine.spline, cloud.nearer.points, cloud.nearer.normals)
    report = FitReport(
        points=len(cloud.points),
        spacing=fine.spacing,
        coarser_spacing=coarse.spacing,
        nodes=tuple(n - 4 for n in fine.spline.coefficients.shape),
        misfit=misfit,
        turn=turn,
        slope=(float(slope.min()), float(slope.max())),
        normal_curvature=rms(kappa),
        normal_curvature_error=error,
        gaussian_curvature=rms(gauss),
        gaussian_curvature_error=gauss_error,
        noise=cloud.noise,
        smoothing=smoothing,
    )
    return report, error / report.normal_curvature


def _samples(fitted: Fitted) -> Samples:
    return Samples(fitted.spline.at_nodes(), fitted.spline.origin, fitted.spline.spacing)


def _one_body(samples: Samples) -> bool:
    """Whether F < 0 in one connected part, F > 0 around it in one."""
    return len(samples.middles()) == 1 and not samples.has_cavity() and bool(np.all(samples.on_faces() > 0))


def require_one_body(samples: Samples, remedy: str = "") -> None:
    """ValueError unless F = 0 is one body; with what helps beside the usual."""
    if _one_body(samples):
        return
    raise ValueError(
        f"the fit has failed: F = 0 falls into {len(samples.middles())} parts on a grid of spacing "
        f"{samples.spacing[0]:.3g} m"
        + (" with a cavity" if samples.has_cavity() else "")
        + f"; parts of the body are too thin for its mesh, or it has edges: refine it, round them off{remedy}"
    )


def _finer(cloud: PointCloud) -> str:
    """What helps a mesh, not a CAD file, that is too coarse for its fit."""
    if cloud.quality.verdict != "too coarse" or "edges" in cloud.notes:
        return ""
    return '; or subdivide="auto", which takes a smooth surface near its vertices'
