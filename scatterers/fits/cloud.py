"""What bodies are fitted to: points and normals of a smooth body, or a mesh with its smooth regions.

Also here: what is known of a fitted body: how well it meets its points, and how its curvatures depend on the grid. Two
fits of one body differ in them by about the error of the worse.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from scatterers.body import tangents
from scatterers.charts.samples import towards
from scatterers.fits.tensor import TensorSpline
from scatterers.kernels.compiled import SYMMETRIC, evaluated
from scatterers.triangles.quality import MeshQuality
from scatterers.triangles.regions import Regions
from scatterers.triangles.subdivision import Source

DISTRUSTED = 2.0
"""Edges about a non-smooth point within which nothing is trusted."""


class Nearer(NamedTuple):
    """The points of a subdivided mesh where its surface passes nearer to the vertices of its source.

    Attributes
    ----------
    points, normals : (n, 3), L and 1
    distance : callable
        As of a `PointCloud`.
    source : Source
    """

    points: FloatArray
    normals: FloatArray
    distance: Callable[[FloatArray], FloatArray]
    source: Source


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
    uncertain : float
        Difference of the curvatures of two fits, relative to their rms, beyond which the body is refused.
    smoothing : float or None
        Weight of the fourth differences where it is known what is due; None: the least, or by the noise.
    narrower : tuple of float, L
        Spacings that are tried in turn where the fit at ``spacing`` is no body.
    nearer : Nearer or None
        What the second fit is made to, if not to the same; as many points.
    exact : bool
        Whether the normals are those of the source itself: then all points are fitted, and the body is not smooth where
        the fit does not follow them.
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
    uncertain: float = np.inf
    smoothing: float | None = None
    narrower: tuple[float, ...] = ()
    nearer: Nearer | None = None
    exact: bool = False

    @property
    def reach(self) -> float:
        """Distance from non-smooth points within which nothing is trusted, L."""
        return DISTRUSTED * self.edge

    @cached_property
    def smooth(self) -> BoolArray:
        """Points that are farther than that from non-smooth ones: (n,)."""
        from scipy.spatial import cKDTree

        return np.asarray(np.isinf(cKDTree(self.non_smooth).query(self.points, distance_upper_bound=self.reach)[0]))


@dataclass(frozen=True, eq=False)
class PieceCloud:
    """What a body with edges is fitted to.

    Attributes
    ----------
    vertices, triangles : (n, 3), L, and (m, 3)
    regions : Regions
    normals : (m, 3, 3), or None
        Outward at the corners of the triangles, where the source gives them.
    quality : MeshQuality
    notes : dict
        As of a `PointCloud`.
    noise : float
        Of vertices on planes and quadrics, L.
    """

    vertices: FloatArray
    triangles: IntArray
    regions: Regions
    normals: FloatArray | None
    quality: MeshQuality
    notes: dict[str, Any]
    noise: float = 0.0


@dataclass(frozen=True)
class FitReport:
    """Numbers of a fit; curvatures differ between it and a fit on another grid by about their error on the coarser.

    Attributes
    ----------
    points : int
        Points of the body that were fitted.
    spacing, coarser_spacing : float
        Of the grids, L; of a subdivided mesh the second is the finer one.
    nodes : tuple of int
        Of the grid of the fit.
    misfit : float
        Rms distance of the points from the body, L; of a subdivided mesh, of its vertices or of points nearer to them.
    turn : float
        Rms angle between the body's normals and those of these points, radians.
    slope : tuple of float
        Least and largest |grad F| on the body; 1 for a signed distance.
    normal_curvature, gaussian_curvature : float
        Rms of kappa_n over points and directions, 1/L, and of K, 1/L^2.
    normal_curvature_error, gaussian_curvature_error : float
        Rms difference between the two fits and, of points without noise, the angle of normals over the spacing, which
        is in both: the square root of the sum of their squares. The error of the finer fit is about a third of it
        where the grids resolve the body, since curvatures converge with order 4. Of a subdivided mesh it is all of it,
        and what the source cannot show stands for the normals (`scatterers.triangles.subdivision`).
    noise : float
        Rms distance of the points from a smooth body, estimated before the fit, L.
    smoothing : float
        Weight of the fourth differences that was taken.
    factor : float
        By how much the body errs more than it differs from the second fit; 1, of a subdivided mesh larger.
    """

    points: int
    spacing: float
    coarser_spacing: float
    nodes: tuple[int, ...]
    misfit: float
    turn: float
    slope: tuple[float, float]
    normal_curvature: float
    normal_curvature_error: float
    gaussian_curvature: float
    gaussian_curvature_error: float
    noise: float
    smoothing: float
    factor: float = 1.0

    def to_json(self) -> dict[str, Any]:
        """Plain numbers."""
        return asdict(self)

    @classmethod
    def from_json(cls, content: dict[str, Any]) -> "FitReport":
        """The report again."""
        return cls(**content | {"nodes": tuple(content["nodes"]), "slope": tuple(content["slope"])})

    def __str__(self) -> str:
        if not self.spacing:
            return f"fit: {self.points} points, all of planes and quadrics, which are exact"
        # a box has no curvature at all
        kappa = self.normal_curvature_error / (self.normal_curvature or 1.0)
        gauss = self.gaussian_curvature_error / (self.gaussian_curvature or 1.0)
        return "\n".join(
            [
                f"fit: {self.points} points, {' x '.join(map(str, self.nodes))} nodes, spacing {self.spacing:.3g} m",
                f"  points off the body by {self.misfit:.1e} m rms, normals by {self.turn:.1e} rad",
                f"  |grad F| {self.slope[0]:.3f} to {self.slope[1]:.3f} (1 for a distance)",
                f"  curvatures against a grid of spacing {self.coarser_spacing:.3g} m: kappa_n {kappa:.1e}, "
                f"K {gauss:.1e} of their rms" + ("" if self.factor == 1 else ", what the source cannot show included"),
            ]
        )


def differences(fits: Sequence[tuple[TensorSpline, TensorSpline, FloatArray, FloatArray]]) -> dict[str, Any]:
    """What a `FitReport` says of curvatures and |grad F|, by two fits, points (n, 3), L, and normals of each F."""
    found = []
    for fine, coarse, points, normals in fits:
        along = tangents(normals)[0]
        (kappa, gauss, slope), (other, other_gauss, _) = (curvatures(one, points, along) for one in (fine, coarse))
        found.append((kappa, kappa - other, gauss, gauss - other_gauss, slope))
    every = [np.concatenate(parts) for parts in zip(*found, strict=True)] or [np.zeros(1)] * 4 + [np.ones(1)]
    names = ("normal_curvature", "normal_curvature_error", "gaussian_curvature", "gaussian_curvature_error")
    measured: dict[str, Any] = {name: rms(values) for name, values in zip(names, every[:4], strict=True)}
    return measured | {"slope": (float(every[4].min()), float(every[4].max()))}


def rms(values: FloatArray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def curvatures(
    spline: TensorSpline, points: FloatArray, along: FloatArray | None = None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """kappa_n along tangents and across them (2 n,), K (n,) and |grad F| (n,) at points brought onto the spline.

    Along ``along`` (n, 3), or any tangents that depend on the normals alone.
    """
    _, gradient, entries = evaluated(spline.compiled, towards(spline.compiled, points, 2))
    slope = np.linalg.norm(gradient, axis=1)
    n = gradient / slope[:, None]
    along = tangents(n)[0] if along is None else along
    e = along - np.sum(along * n, axis=1, keepdims=True) * n
    e /= np.linalg.norm(e, axis=1, keepdims=True)
    t = np.stack([e, np.cross(n, e)])
    form = np.einsum("ani,nij,bnj->abn", t, entries[:, SYMMETRIC], t) / slope
    gauss = form[0, 0] * form[1, 1] - form[0, 1] ** 2
    return np.concatenate([form[0, 0], form[1, 1]]), gauss, slope


def normal_curvatures(spline: TensorSpline, points: FloatArray, along: FloatArray) -> FloatArray:
    """kappa_n (n,) at points brought onto the spline, along directions (n, 3) that lie nearly on it."""
    return curvatures(spline, points, along)[0][: len(points)]


def left_at(spline: TensorSpline, points: FloatArray, normals: FloatArray | None = None) -> tuple[float, float]:
    """Rms of F/|grad F| at points (n, 3), L, and rms angle between grad F and unit normals (n, 3) there, radians."""
    value, gradient, _ = evaluated(spline.compiled, points)
    slope = np.linalg.norm(gradient, axis=1)
    turn = 0.0 if normals is None else np.linalg.norm(gradient / slope[:, None] - normals, axis=1)
    return rms(value / slope), rms(np.asarray(turn))


def not_followed(spline: TensorSpline, points: FloatArray, normals: FloatArray) -> FloatArray:
    """Those of points (n, 3), L, at which a fit does not have about their unit normals (n, 3): (j, 3)."""
    gradient = spline.gradient(points)
    turn = np.linalg.norm(gradient / np.linalg.norm(gradient, axis=1, keepdims=True) - normals, axis=1)
    # more than 0.05 radians, or six times what is usual: coarse triangles err, too
    return np.asarray(points[~(turn <= max(0.05, 6.0 * float(np.median(turn))))])
