"""Ellipsoids, bent or straight: F = x^2/a^2 + y'^2/b^2 + z^2/c^2 - 1 with y' = y - d cos(pi z).

The sphere map is psi(s) = (a s_1, b s_2 + d cos(pi c s_3), c s_3); the bodies of the package that have it
differ in their parameters only, so they share one evaluator and one chart locator.

Also here: what bodies are fitted to: points and normals of a smooth body, or a mesh with its smooth regions.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scatterers.base.level_body import Body, finite, positive
from scatterers.cached import cached
from scatterers.kernels.compiled import Compiled, Kind
from scatterers.kernels.trigonometry import cos_pi, cube_tangents, fill_frame, sin_pi
from scatterers.pieces.regions import Regions
from scatterers.sphere_map.star import CubeSphereAtlas, FaceChart
from scatterers.triangles.quality import MeshQuality
from scatterers.triangles.subdivision import Source

DISTRUSTED = 2.0
"""Edges about a non-smooth point within which nothing is trusted."""


__all__ = ["BentEllipsoid", "finite", "positive"]
FloatArray = NDArray[np.float64]


class BentEllipsoid(Body):
    """Base of Sphere, Ellipsoid and TwistedEllipsoid; ``_shape`` gives (a, b, c, d)."""

    def _shape(self) -> tuple[float, float, float, float]:
        raise NotImplementedError

    @cached
    def bounds(self) -> FloatArray:
        """Box (2, 3) that contains the body, L."""
        a, b, c, d = self._shape()
        half = np.array([a, b + abs(d), c])
        return np.stack([-half, half])

    def level(self, points: FloatArray) -> FloatArray:
        """F, without unit, positive outside: points (..., 3), L, to (...)."""
        a, b, c, d = self._shape()
        x, y, z = np.moveaxis(np.asarray(points, dtype=float), -1, 0)
        return np.asarray((x / a) ** 2 + ((y - d * np.cos(np.pi * z)) / b) ** 2 + (z / c) ** 2 - 1)

    def gradient(self, points: FloatArray) -> FloatArray:
        """Gradient of F, 1/L: points (..., 3), L, to (..., 3)."""
        a, b, c, d = self._shape()
        x, y, z = np.moveaxis(np.asarray(points, dtype=float), -1, 0)
        bent = 2 * (y - d * np.cos(np.pi * z)) / b**2
        slope = np.pi * d * np.sin(np.pi * z)
        return np.stack([2 * x / a**2, bent, 2 * z / c**2 + bent * slope], axis=-1)

    def hessian(self, points: FloatArray) -> FloatArray:
        """Hessian of F, 1/L^2: points (..., 3), L, to (..., 3, 3)."""
        a, b, c, d = self._shape()
        _, y, z = np.moveaxis(np.asarray(points, dtype=float), -1, 0)
        bend = d * np.cos(np.pi * z)
        slope = np.pi * d * np.sin(np.pi * z)
        h = np.zeros((*y.shape, 3, 3))
        h[..., 0, 0] = 2 / a**2
        h[..., 1, 1] = 2 / b**2
        h[..., 1, 2] = h[..., 2, 1] = 2 * slope / b**2
        h[..., 2, 2] = 2 / c**2 + 2 * (slope**2 + (y - bend) * np.pi**2 * bend) / b**2
        return h

    def forward(self, s: FloatArray) -> FloatArray:
        """psi(s), L: unit vectors (..., 3) to (..., 3)."""
        a, b, c, d = self._shape()
        z = c * s[..., 2]
        return np.stack([a * s[..., 0], b * s[..., 1] + d * np.cos(np.pi * z), z], axis=-1)

    def derivative(self, s: FloatArray) -> FloatArray:
        """Derivative of psi, L: unit vectors (..., 3) to (..., 3, 3)."""
        a, b, c, d = self._shape()
        jacobian = np.zeros((*np.shape(s)[:-1], 3, 3))
        jacobian[..., 0, 0], jacobian[..., 1, 1], jacobian[..., 2, 2] = a, b, c
        jacobian[..., 1, 2] = -np.pi * c * d * np.sin(np.pi * c * s[..., 2])
        return jacobian

    def inverse(self, points: FloatArray) -> FloatArray:
        """psi^-1(x), of unit length on the body: points (..., 3), L, to (..., 3)."""
        a, b, c, d = self._shape()
        x, y, z = np.moveaxis(np.asarray(points, dtype=float), -1, 0)
        return np.stack([x / a, (y - d * np.cos(np.pi * z)) / b, z / c], axis=-1)

    def parameters(self, points: FloatArray) -> FloatArray:
        """Polar angle theta in [0, pi] and azimuth phi in (-pi, pi] of psi^-1(x), radians: (..., 3) -> (..., 2)."""
        s = self.inverse(points)
        theta = np.arctan2(np.hypot(s[..., 0], s[..., 1]), s[..., 2])
        return np.stack([theta, np.arctan2(s[..., 1], s[..., 0])], axis=-1)

    def _compiled(self, source: Callable[..., None], kind: Kind) -> Compiled:
        return Compiled(source, kind, np.array(self._shape(), dtype=float))

    @property
    def mirrors(self) -> bool:
        """Whether the three coordinate planes are mirrors of the body and of its sphere map."""
        return self._shape()[3] == 0.0

    @property
    def axis_of_revolution(self) -> tuple[float, float, float] | None:
        """Unit vector along the axis of a spheroid, z of a sphere; None for any other ellipsoid."""
        a, b, c, d = self._shape()
        if d != 0.0 or not (a == b or b == c or c == a):
            return None
        return (0.0, 0.0, 1.0) if a == b else (1.0, 0.0, 0.0) if b == c else (0.0, 1.0, 0.0)

    @cached_property
    def compiled(self) -> Compiled:
        """Compiled level evaluator."""
        return self._compiled(_evaluate, "level")

    @cached_property
    def compiled_forward(self) -> Compiled:
        """Compiled psi and its derivative."""
        return self._compiled(_forward, "forward")

    @cached_property
    def compiled_inverse(self) -> Compiled:
        """Compiled psi^-1, normalised."""
        return self._compiled(_inverse, "inverse")

    @cached
    def atlas(self) -> CubeSphereAtlas:
        """Six charts."""
        return CubeSphereAtlas(self, self._compiled(_locate, "locator"))

    @property
    def tiling(self) -> Sequence[FaceChart]:
        """The six charts."""
        return self.atlas.charts


def _evaluate(points, values, gradients, hessians, parameters):  # type: ignore[no-untyped-def]
    """F, grad F and Hessian of a block; the compiled twin of level, gradient and hessian.

    Each loop touches few rows: the compiler vectorises it only while it can check that they do not overlap.
    """
    xx, yy, zz, d = 1 / parameters[0] ** 2, 1 / parameters[1] ** 2, 1 / parameters[2] ** 2, parameters[3]
    quarter = 1 / (4 * yy)
    n = points.shape[1]
    if d != 0.0:
        # while they are not yet wanted for the Hessian, two of its rows hold d cos(pi z) and pi d sin(pi z)
        for i in range(n):
            hessians[3, i] = d * cos_pi(points[2, i])
            hessians[4, i] = math.pi * d * sin_pi(points[2, i])
        for i in range(n):
            gradients[0, i] = 2 * xx * points[0, i]
            gradients[1, i] = 2 * yy * (points[1, i] - hessians[3, i])
        for i in range(n):
            x, z, bent = points[0, i], points[2, i], gradients[1, i]
            values[i] = xx * x * x + quarter * bent * bent + (zz * z * z - 1.0)
        for i in range(n):
            gradients[2, i] = 2 * zz * points[2, i] + gradients[1, i] * hessians[4, i]
        for i in range(n):
            slope = hessians[4, i]
            hessians[2, i] = 2 * zz + 2 * yy * slope * slope + math.pi**2 * gradients[1, i] * hessians[3, i]
            hessians[3, i] = 2 * yy * slope
    else:
        for i in range(n):
            x, y, z = points[0, i], points[1, i], points[2, i]
            values[i] = xx * x * x + yy * y * y + (zz * z * z - 1.0)
            gradients[0, i] = 2 * xx * x
        for i in range(n):
            gradients[1, i] = 2 * yy * points[1, i]
            gradients[2, i] = 2 * zz * points[2, i]
        for i in range(n):
            hessians[2, i] = 2 * zz
            hessians[3, i] = 0.0
    for i in range(n):
        hessians[0, i] = 2 * xx
        hessians[1, i] = 2 * yy
        hessians[4, i] = 0.0
        hessians[5, i] = 0.0


def _locate(points, gradients, chart, uv, frame, parameters):  # type: ignore[no-untyped-def]
    """Chart, chart variables and polar frame of a block; the compiled twin of locate and polar_frame."""
    a, b, c, d = parameters[0], parameters[1], parameters[2], parameters[3]
    for i in range(points.shape[1]):
        z = points[2, i]
        bend, shear = 0.0, 0.0
        if d != 0.0:
            bend, shear = d * cos_pi(z), -math.pi * c * d * sin_pi(z)
        chart[i], uv[0, i], uv[1, i], tx, ty, tz, wx, wy, wz = cube_tangents(
            points[0, i] / a, (points[1, i] - bend) / b, z / c
        )
        fill_frame(frame, i, a * tx, b * ty + shear * tz, c * tz, a * wx, b * wy + shear * wz, c * wz)


def _forward(s, points, derivatives, parameters):  # type: ignore[no-untyped-def]
    """Points and derivatives of psi for a block; the compiled twin of forward and derivative."""
    a, b, c, d = parameters[0], parameters[1], parameters[2], parameters[3]
    n = s.shape[1]
    for i in range(n):
        points[0, i] = a * s[0, i]
        points[2, i] = c * s[2, i]
    for i in range(n):
        points[1, i] = b * s[1, i]
        derivatives[5, i] = 0.0
    if d != 0.0:
        for i in range(n):
            points[1, i] += d * cos_pi(c * s[2, i])
        for i in range(n):
            derivatives[5, i] = -math.pi * c * d * sin_pi(c * s[2, i])
    for i in range(n):
        derivatives[0, i], derivatives[1, i], derivatives[2, i] = a, 0.0, 0.0
        derivatives[3, i], derivatives[4, i] = 0.0, b
    for i in range(n):
        derivatives[6, i], derivatives[7, i], derivatives[8, i] = 0.0, 0.0, c


def _inverse(points, s, parameters):  # type: ignore[no-untyped-def]
    """psi^-1 of a block, of unit length; the compiled twin of inverse."""
    a, b, c, d = 1 / parameters[0], 1 / parameters[1], 1 / parameters[2], parameters[3]
    n = points.shape[1]
    for i in range(n):
        s[1, i] = points[1, i]
    if d != 0.0:
        for i in range(n):
            s[1, i] -= d * cos_pi(points[2, i])
    for i in range(n):
        x, y, z = a * points[0, i], b * s[1, i], c * points[2, i]
        scale = 1.0 / math.sqrt(x * x + y * y + z * z)
        s[0, i], s[1, i], s[2, i] = scale * x, scale * y, scale * z


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
    def smooth(self) -> NDArray[np.bool_]:
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
    triangles: NDArray[np.int64]
    regions: Regions
    normals: FloatArray | None
    quality: MeshQuality
    notes: dict[str, Any]
    noise: float = 0.0
