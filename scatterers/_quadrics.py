"""Ellipsoids, bent or straight: F = x^2/a^2 + y'^2/b^2 + z^2/c^2 - 1 with y' = y - d cos(pi z).

The sphere map is psi(s) = (a s_1, b s_2 + d cos(pi c s_3), c s_3); the bodies of the package that have it
differ in their parameters only, so they share one evaluator and one chart locator.
"""

import math
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from scatterers._body import Body, finite, positive
from scatterers._charts import CubeSphereAtlas
from scatterers._compile import Compiled

__all__ = ["BentEllipsoid", "finite", "positive"]
FloatArray = NDArray[np.float64]


class BentEllipsoid(Body):
    """Base of Sphere, Ellipsoid and TwistedEllipsoid; ``_shape`` gives (a, b, c, d)."""

    def _shape(self) -> tuple[float, float, float, float]:
        raise NotImplementedError

    @cached_property
    def bounds(self) -> FloatArray:
        """Box (2, 3) that contains the body, L."""
        a, b, c, d = self._shape()
        half = np.array([a, b + abs(d), c])
        return np.stack([-half, half])

    def level(self, points: FloatArray) -> FloatArray:
        """F, positive outside: (..., 3) -> (...)."""
        a, b, c, d = self._shape()
        x, y, z = np.moveaxis(np.asarray(points, dtype=float), -1, 0)
        return np.asarray((x / a) ** 2 + ((y - d * np.cos(np.pi * z)) / b) ** 2 + (z / c) ** 2 - 1)

    def gradient(self, points: FloatArray) -> FloatArray:
        """Gradient of F: (..., 3) -> (..., 3)."""
        a, b, c, d = self._shape()
        x, y, z = np.moveaxis(np.asarray(points, dtype=float), -1, 0)
        bent = 2 * (y - d * np.cos(np.pi * z)) / b**2
        slope = np.pi * d * np.sin(np.pi * z)
        return np.stack([2 * x / a**2, bent, 2 * z / c**2 + bent * slope], axis=-1)

    def hessian(self, points: FloatArray) -> FloatArray:
        """Hessian of F: (..., 3) -> (..., 3, 3)."""
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
        """psi(s): (..., 3) -> (..., 3)."""
        a, b, c, d = self._shape()
        z = c * s[..., 2]
        return np.stack([a * s[..., 0], b * s[..., 1] + d * np.cos(np.pi * z), z], axis=-1)

    def derivative(self, s: FloatArray) -> FloatArray:
        """Derivative of psi: (..., 3) -> (..., 3, 3)."""
        a, b, c, d = self._shape()
        jacobian = np.zeros((*np.shape(s)[:-1], 3, 3))
        jacobian[..., 0, 0], jacobian[..., 1, 1], jacobian[..., 2, 2] = a, b, c
        jacobian[..., 1, 2] = -np.pi * c * d * np.sin(np.pi * c * s[..., 2])
        return jacobian

    def inverse(self, points: FloatArray) -> FloatArray:
        """psi^-1(x), of unit length on the body: (..., 3) -> (..., 3)."""
        a, b, c, d = self._shape()
        x, y, z = np.moveaxis(np.asarray(points, dtype=float), -1, 0)
        return np.stack([x / a, (y - d * np.cos(np.pi * z)) / b, z / c], axis=-1)

    def parameters(self, points: FloatArray) -> FloatArray:
        """Polar angle theta in [0, pi] and azimuth phi in (-pi, pi] of psi^-1(x): (..., 3) -> (..., 2)."""
        s = self.inverse(points)
        theta = np.arctan2(np.hypot(s[..., 0], s[..., 1]), s[..., 2])
        return np.stack([theta, np.arctan2(s[..., 1], s[..., 0])], axis=-1)

    @cached_property
    def compiled(self) -> Compiled:
        """Compiled level evaluator."""
        return Compiled(_evaluate, "level", np.array(self._shape(), dtype=float))

    @cached_property
    def atlas(self) -> CubeSphereAtlas:
        """Six charts."""
        return CubeSphereAtlas(self, Compiled(_locate, "locator", np.array(self._shape(), dtype=float)))


def _evaluate(points, values, gradients, hessians, parameters):  # type: ignore[no-untyped-def]
    """F, grad F and Hessian of a block; the compiled twin of level, gradient and hessian.

    Each loop touches few rows: the compiler vectorises it only while it can check that they do not overlap.
    """
    xx, yy, zz = 1 / parameters[0] ** 2, 1 / parameters[1] ** 2, 1 / parameters[2] ** 2
    d = parameters[3]
    n = points.shape[1]
    x, y, z = points[0], points[1], points[2]
    straight, bend, slope = gradients[1], hessians[3], hessians[4]
    # while they are not yet wanted for the Hessian, two of its rows hold d cos(pi z) and pi d sin(pi z)
    if d != 0.0:
        for i in range(n):
            bend[i] = d * math.cos(math.pi * z[i])
            slope[i] = math.pi * d * math.sin(math.pi * z[i])
        for i in range(n):
            straight[i] = y[i] - bend[i]
    else:
        for i in range(n):
            bend[i] = slope[i] = 0.0
            straight[i] = y[i]
    for i in range(n):
        values[i] = xx * x[i] * x[i] + zz * z[i] * z[i] - 1.0
    for i in range(n):
        values[i] += yy * straight[i] * straight[i]
    for i in range(n):
        gradients[0, i] = 2 * xx * x[i]
    for i in range(n):
        gradients[2, i] = 2 * zz * z[i] + 2 * yy * straight[i] * slope[i]
    for i in range(n):
        hessians[2, i] = 2 * zz + 2 * yy * (slope[i] * slope[i] + straight[i] * math.pi * math.pi * bend[i])
    for i in range(n):
        gradients[1, i] *= 2 * yy
    for i in range(n):
        hessians[3, i] = 2 * yy * slope[i]
    hessians[0] = 2 * xx
    hessians[1] = 2 * yy
    hessians[4] = 0.0
    hessians[5] = 0.0


def _locate(points, chart, uv, frame, parameters):  # type: ignore[no-untyped-def]
    """Chart, chart variables and isometric frame of a block; the compiled twin of locate and polar_frame."""
    radii = parameters
    for i in range(points.shape[1]):
        z = points[2, i]
        s = (
            points[0, i] / radii[0],
            (points[1, i] - radii[3] * math.cos(math.pi * z)) / radii[1],
            z / radii[2],
        )
        size = (abs(s[0]), abs(s[1]), abs(s[2]))
        a = 0 if size[0] >= size[1] and size[0] >= size[2] else (1 if size[1] >= size[2] else 2)
        b, c = (a + 1) % 3, (a + 2) % 3
        sign = -1.0 if s[a] < 0 else 1.0
        tan_u, tan_v = s[b] / s[a], s[c] / size[a]
        chart[i] = 2 * a + (1 if s[a] < 0 else 0)
        uv[0, i] = math.atan(tan_u) / (math.pi / 2) + 0.5
        uv[1, i] = math.atan(tan_v) / (math.pi / 2) + 0.5
        # tangents of the cube-sphere: d cube = (0, sign (1 + tan_u^2), 0) and (0, 0, 1 + tan_v^2) in (a, b, c),
        # less their part along s; a common factor does not change the frame
        norm2 = 1.0 + tan_u * tan_u + tan_v * tan_v
        du, dv = 1.0 + tan_u * tan_u, 1.0 + tan_v * tan_v
        p = tan_u * du / norm2
        q = tan_v * dv / norm2
        ta, tb, tc = -sign * p, sign * (du - tan_u * p), -tan_v * p
        wa, wb, wc = -sign * q, -sign * tan_u * q, dv - tan_v * q
        if a == 0:
            tx, ty, tz, wx, wy, wz = ta, tb, tc, wa, wb, wc
        elif a == 1:
            tx, ty, tz, wx, wy, wz = tc, ta, tb, wc, wa, wb
        else:
            tx, ty, tz, wx, wy, wz = tb, tc, ta, wb, wc, wa
        shear = 0.0
        if radii[3] != 0.0:
            shear = -math.pi * radii[2] * radii[3] * math.sin(math.pi * z)
        tx, ty, tz = radii[0] * tx, radii[1] * ty + shear * tz, radii[2] * tz
        wx, wy, wz = radii[0] * wx, radii[1] * wy + shear * wz, radii[2] * wz
        g11 = tx * tx + ty * ty + tz * tz
        g12 = tx * wx + ty * wy + tz * wz
        g22 = wx * wx + wy * wy + wz * wz
        root = math.sqrt(g11 * g22 - g12 * g12)
        scale = 1.0 / (root * math.sqrt(g11 + g22 + 2 * root))
        m11, m12, m22 = (g22 + root) * scale, -g12 * scale, (g11 + root) * scale
        frame[0, i] = tx * m11 + wx * m12
        frame[1, i] = ty * m11 + wy * m12
        frame[2, i] = tz * m11 + wz * m12
        frame[3, i] = tx * m12 + wx * m22
        frame[4, i] = ty * m12 + wy * m22
        frame[5, i] = tz * m12 + wz * m22
