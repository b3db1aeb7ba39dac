"""Two fits to one cloud of points, checked: the body, and another by which its error is known.

The second is on a coarser grid, and tells how the fit depends on it. To points nearer to the source it is finer and
follows their normals: what the first leaves of a mesh that hardly resolves its body shows there.

Sources: Derivations, B6.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from creeping._typing import BoolArray, FloatArray
from scatterers.body import tangents
from scatterers.charts.samples import Samples
from scatterers.fits.cloud import (
    FitReport,
    Nearer,
    PointCloud,
    curvatures,
    differences,
    left_at,
    normal_curvatures,
    not_followed,
    rms,
)
from scatterers.fits.solver import COARSER, MAX_NODES, SLOPES, SMOOTHING, Fitted, fit, spacing_of
from scatterers.fits.spline_pieces import Fit, SplinePieces
from scatterers.triangles.subdivision import BLIND, Source, turns, unseen

Progress = Callable[[str], None]


class NoBodyError(ValueError):
    """F = 0 of a fit is not one body, or |grad F| is far from 1 on it; on a narrower grid it may be."""


def good_fit(cloud: PointCloud, progress: Progress) -> Fit:
    """Both fits at the first of the spacings at which they are bodies, and what is known of them.

    Raises
    ------
    ValueError
        If there is none, or curvatures are too uncertain: on a narrower grid both fits would follow the same noise.
    """
    if cloud.exact and len(cloud.non_smooth):
        try:
            return good_fit(replace(cloud, non_smooth=np.zeros((0, 3))), progress)
        except NoBodyError as error:
            progress(f"{error}; points at which it curves too much for their distance are left out")
    # else too few of the points are known for a fit to mean anything
    if len(cloud.non_smooth) and np.mean(cloud.smooth) < 0.1:
        raise ValueError(
            f"{np.sum(~cloud.smooth)} of {len(cloud.points)} points lie within {cloud.reach:.3g} m of places where the "
            "body is not smooth, and nothing is known there; refine the mesh"
        )
    spacings = (cloud.spacing, *cloud.narrower)
    for spacing in spacings[:-1]:
        try:
            return _checked_fit(replace(cloud, spacing=spacing), progress)
        except NoBodyError as error:
            progress(f"on a grid of {spacing:.3g} m {error}; a narrower one is tried")
    return _checked_fit(replace(cloud, spacing=spacings[-1]), progress)


def _checked_fit(cloud: PointCloud, progress: Progress) -> Fit:
    fine, coarse, smoothing = fits(cloud, progress)
    turn, blind = (np.zeros(0), np.zeros(0, bool)) if cloud.nearer is None else _blind(cloud.nearer.source, fine)
    seen = not len(turn) or np.mean(blind) <= 0.05
    # of a mesh that shows too little the fit is to be a body all the same, or a narrower grid is tried
    non_smooth = cloud.non_smooth if cloud.nearer is None or not seen else cloud.nearer.source.vertices[blind]
    if cloud.exact and not len(non_smooth):
        non_smooth = not_followed(fine.spline, cloud.points, cloud.normals)
    report, doubt = compared(replace(cloud, non_smooth=non_smooth), fine, coarse, smoothing)
    if not SLOPES[0] <= report.slope[0] <= report.slope[1] <= SLOPES[1] and not len(cloud.non_smooth):
        raise NoBodyError(
            f"the fit has failed: |grad F| is {report.slope[0]:.2g} to {report.slope[1]:.2g} on the body instead "
            f"of 1; it is too thin or too curved for the distance of its points: refine the mesh there" + _remedy(cloud)
        )
    if not seen:
        raise ValueError(
            f"the mesh is too coarse: at {np.sum(blind)} of {len(turn)} vertices it does not show how its body curves, "
            f"which turns by up to {np.degrees(turn.max()):.0f} degrees within an edge; give more vertices there"
        )
    if doubt > cloud.uncertain:
        raise ValueError(
            f"the mesh is too coarse: its curvatures are uncertain by {100 * doubt:.0f} %; "
            f"{cloud.quality.reasons}{_remedy(cloud)}"
        )
    parts, other = (SplinePieces.whole(one.spline, non_smooth, cloud.reach) for one in (fine, coarse))
    return Fit(parts, other, report)


def _turns(source: Source, fine: Fitted) -> FloatArray:
    return turns(source, partial(normal_curvatures, fine.spline))


def _blind(source: Source, fine: Fitted) -> tuple[FloatArray, BoolArray]:
    """By what the body turns within an edge at each vertex of a source, and where the fit is not to be trusted."""
    turn = _turns(source, fine)
    slope = curvatures(fine.spline, source.vertices)[2]
    return turn, (turn > BLIND) | (slope < SLOPES[0]) | (slope > SLOPES[1])


def fits(cloud: PointCloud, progress: Progress) -> tuple[Fitted, Fitted, float]:
    """The fit, one on another grid, and the smoothing: the least that leaves the points off by their noise."""
    # weight of the normals of noisy points: from jets they are noisier than these
    light = 0.1
    # tried in turn on noisy points, until the misfit exceeds the noise
    smoothings, most = (1e-6, 1e-5, 1e-4, 1e-3), 1.01 * cloud.noise
    # jets of a mesh that is judged by its fit are no good start, and its samples leave much free
    doubtful = bool(np.isfinite(cloud.uncertain))
    noisy, middle = bool(cloud.noise), mirror_planes(cloud)

    def fitted(
        of: PointCloud | Nearer,
        spacing: float,
        smoothing: float,
        weight: float,
        some: BoolArray | slice = slice(None),
    ) -> Fitted:
        return fit(
            of.points[some],
            of.normals[some],
            spacing,
            distance=of.distance,
            middle=middle,
            trusted=cloud.smooth[some] if len(cloud.non_smooth) else None,
            mean_curvature=None if cloud.mean_curvature is None else cloud.mean_curvature[some],
            smoothing=smoothing,
            normal_weight=weight,
            keep_start=not (noisy or doubtful),
            progress=progress,
        )

    plain = light if noisy else 1.0
    weight = plain if cloud.nearer is None else light
    smoothing = cloud.smoothing or (smoothings[0] if noisy or doubtful else SMOOTHING)
    fine = fitted(cloud, cloud.spacing, smoothing, weight)
    for more in smoothings[1:] if noisy else ():
        # what is smoother is off by more
        if fine.misfit > most:
            break
        smoother = fitted(cloud, cloud.spacing, more, weight)
        if smoother.misfit > most:
            break
        fine, smoothing = smoother, more
    _require_one_body(fine, cloud)
    if cloud.nearer is None:
        # to fewer points: fits to the same noise err alike
        fewer = np.random.default_rng(0).random(len(cloud.points)) < 0.4 if noisy else slice(None)
        other = fitted(cloud, COARSER * cloud.spacing, smoothing, plain, fewer)
    else:
        # on a finer grid
        finest = spacing_of(cloud.nearer.points, MAX_NODES)
        other = fitted(cloud.nearer, max(0.75 * cloud.spacing, finest), smoothing, plain)
        if not _one_body(_samples(other)):
            # between points that are too far apart for it
            other = fitted(cloud.nearer, COARSER * cloud.spacing, smoothing, plain)
    _require_one_body(other, cloud)
    return *mirrored(cloud, fine, other), smoothing


def mirror_planes(cloud: PointCloud) -> FloatArray:
    """Where a body would be cut by planes x_i = const that it is its own image in: (3,), L.

    Off such a plane by delta, images of points x are off the body by -2 delta n_i(x).
    """
    x, n = cloud.points, cloud.normals
    middle = 0.5 * (x.min(axis=0) + x.max(axis=0))
    for axis in range(3):
        for _ in range(3):
            image = x.copy()
            image[:, axis] = 2 * middle[axis] - x[:, axis]
            off = cloud.distance(image)
            # others are no images
            off = np.where(np.abs(off) < cloud.spacing, off, 0.0)
            middle[axis] += np.sum(off * n[:, axis]) / (2 * np.sum(n[:, axis] ** 2))
    return np.asarray(middle)


def mirrored(cloud: PointCloud, fine: Fitted, coarse: Fitted) -> tuple[Fitted, Fitted]:
    """Both fits, each the mean of itself and its image by the middle planes of the grid in which the body is its own.

    It is, as far as is known, where the image differs by no more than both fits do: rms over the points, and at most.
    Fields of a body that is symmetric to rounding take a half, a quarter or an eighth of the unknowns.
    """
    if len(cloud.non_smooth):
        return fine, coarse
    level = fine.spline.level(cloud.points)
    doubt = coarse.spline.level(cloud.points) - level
    for axis in range(3):
        off = replace(fine.spline, coefficients=np.flip(fine.spline.coefficients, axis)).level(cloud.points) - level
        if rms(off) <= rms(doubt) and np.max(np.abs(off)) <= np.max(np.abs(doubt)):
            fine, coarse = _symmetric(cloud, fine, axis), _symmetric(cloud, coarse, axis)
    return fine, coarse


def _symmetric(cloud: PointCloud, fitted: Fitted, axis: int) -> Fitted:
    """The mean of a fit and its image along an axis, and what it leaves at the points."""
    c = fitted.spline.coefficients
    spline = replace(fitted.spline, coefficients=0.5 * (c + np.flip(c, axis)))
    misfit, turn = left_at(spline, cloud.points, cloud.normals)
    return replace(fitted, spline=spline, misfit=misfit, turn=turn)


def compared(cloud: PointCloud, fine: Fitted, coarse: Fitted, smoothing: float) -> tuple[FitReport, float]:
    """Curvatures of both fits at the points, non-smooth places left out, and how far these are uncertain to their rms.

    What both grids have in common their difference does not show: see `_shared`. Where the second fit is to points
    nearer to the source, misfit and turn are those of these, and the misfit no less than that of the source.
    """
    points, normals = cloud.points, cloud.normals
    if len(cloud.non_smooth):
        points, normals = points[cloud.smooth], normals[cloud.smooth]
    found = differences([(fine.spline, coarse.spline, points, normals)])
    shared, shared_gauss = _shared(cloud, fine, found["normal_curvature"])
    misfit, turn = fine.misfit, fine.turn
    if cloud.nearer is not None:
        misfit, turn = left_at(fine.spline, cloud.nearer.points, cloud.nearer.normals)
        misfit = max(misfit, left_at(fine.spline, cloud.nearer.source.vertices)[0])
        kappa, gauss, _ = curvatures(fine.spline, points, tangents(normals)[0])
        # a body that is off by t has kappa off by kappa^2 t, and K by (kappa_1 + kappa_2) K t
        shared = float(np.hypot(shared, rms(kappa**2) * misfit))
        shared_gauss = float(np.hypot(shared_gauss, rms(kappa.reshape(2, -1).sum(axis=0) * gauss) * misfit))
    difference = found["normal_curvature_error"]
    found["normal_curvature_error"] = float(np.hypot(difference, shared))
    found["gaussian_curvature_error"] = float(np.hypot(found["gaussian_curvature_error"], shared_gauss))
    report = FitReport(
        points=len(cloud.points),
        spacing=fine.spacing,
        coarser_spacing=coarse.spacing,
        nodes=tuple(n - 4 for n in fine.spline.coefficients.shape),
        misfit=misfit,
        turn=turn,
        noise=cloud.noise,
        smoothing=smoothing,
        factor=found["normal_curvature_error"] / difference if cloud.nearer is not None and difference > 0 else 1.0,
        **found,
    )
    return report, report.normal_curvature_error / report.normal_curvature


def _shared(cloud: PointCloud, fine: Fitted, rms_kappa: float) -> tuple[float, float]:
    """Errors of kappa_n and of K, rms, that both fits have.

    The normals that the finer grid does not reach show them, as an angle over a cell. Those of noise, or of a mesh that
    is judged by its fit, no fit is to reach; of a subdivided mesh it is what the source does not show.
    """
    if cloud.nearer is not None:
        source = cloud.nearer.source
        # principal curvatures (n, 2) and K (n,) at points brought onto the spline
        kappa, gauss, _ = curvatures(fine.spline, source.vertices)
        mean = kappa.reshape(2, -1).mean(axis=0)
        half = np.sqrt(np.maximum(mean**2 - gauss, 0.0))
        return unseen(source, _turns(source, fine), np.stack([mean - half, mean + half], axis=1), gauss)
    if cloud.noise or np.isfinite(cloud.uncertain):
        return 0.0, 0.0
    shared = fine.turn / fine.spacing
    # K = k1 k2, both off by as much, kappa taken along two directions at right angles
    return shared, float(np.sqrt(2)) * rms_kappa * shared


def _samples(fitted: Fitted) -> Samples:
    return Samples(fitted.spline.at_nodes(), fitted.spline.origin, fitted.spline.spacing)


def _require_one_body(fitted: Fitted, cloud: PointCloud) -> None:
    require_one_body(_samples(fitted), _remedy(cloud))


def _one_body(samples: Samples) -> bool:
    """Whether F < 0 in one connected part, F > 0 around it in one."""
    return len(samples.middles()) == 1 and not samples.has_cavity() and bool(np.all(samples.on_faces() > 0))


def require_one_body(samples: Samples, remedy: str = "") -> None:
    """NoBodyError unless F = 0 is one body; with what helps beside the usual."""
    if _one_body(samples):
        return
    raise NoBodyError(
        f"the fit has failed: F = 0 falls into {len(samples.middles())} parts on a grid of spacing "
        f"{samples.spacing[0]:.3g} m"
        + (" with a cavity" if samples.has_cavity() else "")
        + f"; parts of the body are too thin for its mesh, or it has edges: refine it, round them off{remedy}"
    )


def _remedy(cloud: PointCloud) -> str:
    """What helps a mesh, not a CAD file nor one that is subdivided, that is too coarse for its fit."""
    if cloud.quality.verdict != "too coarse" or "edges" in cloud.notes or cloud.nearer is not None:
        return ""
    return '; or subdivide="auto", which takes a smooth surface by its vertices'
