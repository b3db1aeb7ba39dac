"""What bodies are fitted to: points and normals of a smooth body, or a mesh with its smooth regions."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from scatterers.pieces.regions import Regions
from scatterers.triangles.quality import MeshQuality
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
