"""Ellipsoids, bent or straight: F = x^2/a^2 + y'^2/b^2 + z^2/c^2 - 1 with y' = y - d cos(pi z).

The sphere map is psi(s) = (a s_1, b s_2 + d cos(pi c s_3), c s_3). The three bodies differ in their parameters only,
so they share one evaluator and one chart locator. A sphere has F = |x|^2/radius^2 - 1. The twisted ellipsoid is not
convex: near z = 0, y < 0 the profile has y'' = -pi^2 d + b/c^2 on the default body, negative, so kappa_n < 0 along z
there.

Also here: torus about z: F = ((sqrt(x^2 + y^2) - R)^2 + z^2)/r^2 - 1.

x = (R + r cos theta)(cos psi, sin psi), z = r sin theta; chart variables u = psi/2 pi, v = theta/2 pi. The coordinate
lines are orthogonal, so the polar frame is the pair of their unit tangents. The inner half is not convex.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from creeping._typing import FloatArray
from scatterers.body import Body, Levelled, SphereMapped, cached, polar_angles
from scatterers.charts.star import CubeSphereAtlas, FaceChart, PeriodicAtlas, PeriodicChart
from scatterers.kernels.charts import cos_pi, cube_tangents, fill_frame, sin_pi
from scatterers.kernels.compiled import Compiled, Kind


class BentEllipsoid(Levelled, SphereMapped, Body):
    """Base of Sphere, Ellipsoid and TwistedEllipsoid; ``_shape`` gives (a, b, c, d)."""

    def _shape(self) -> tuple[float, float, float, float]:
        raise NotImplementedError

    @cached
    def bounds(self) -> FloatArray:
        """Box (2, 3) that contains the body, L."""
        a, b, c, d = self._shape()
        half = np.array([a, b + abs(d), c])
        return np.stack([-half, half])

    def parameters(self, points: FloatArray) -> FloatArray:
        """Angles theta in [0, pi] and phi in (-pi, pi] of the unit vectors psi^-1(x), radians: (..., 3) to (..., 2)."""
        return polar_angles(self.inverse(points))

    def _compiled(self, source: Callable[..., None], kind: Kind) -> Compiled:
        return Compiled(source, kind, np.array(self._shape(), dtype=float))

    @property
    def mirrors(self) -> bool:
        """Whether the body and its sphere map psi are symmetric about all three coordinate planes."""
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
        """Compiled function that gives F, its gradient and its Hessian."""
        return self._compiled(_evaluate, "level")

    @cached_property
    def compiled_forward(self) -> Compiled:
        """Compiled function that gives psi, from the unit sphere to the body, and its derivative."""
        return self._compiled(_forward, "forward")

    @cached_property
    def compiled_inverse(self) -> Compiled:
        """Compiled inverse of psi, which gives unit vectors."""
        return self._compiled(_inverse, "inverse")

    @cached
    def atlas(self) -> CubeSphereAtlas:
        """Six charts that cover the body."""
        return CubeSphereAtlas(self, self._compiled(_locate, "locator"))

    @property
    def tiling(self) -> Sequence[FaceChart]:
        """The six charts of `atlas`, whose unit squares cover the body once."""
        return self.atlas.charts


@dataclass(frozen=True)
class Ellipsoid(BentEllipsoid):
    """Ellipsoid with semi-axes a, b, c along x, y, z.

    Parameters
    ----------
    a, b, c : float
        Semi-axes, L; positive.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.

    Raises
    ------
    ValueError
        If a semi-axis is not a positive finite number, or the speed is not usable.

    Examples
    --------
    >>> import scatterers as sc
    >>> body = sc.Ellipsoid(2.0, 1.0, 0.5)
    >>> body.bounds
    array([[-2. , -1. , -0.5],
           [ 2. ,  1. ,  0.5]])
    >>> body.gradient([2.0, 0.0, 0.0])
    array([1., 0., 0.])
    """

    a: float
    b: float
    c: float
    speed: Any = None

    def _shape(self) -> tuple[float, float, float, float]:
        return self.a, self.b, self.c, 0.0


@dataclass(frozen=True)
class Sphere(BentEllipsoid):
    """Sphere about the origin.

    Parameters
    ----------
    radius : float
        L; positive.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow; ``"1 + x"`` is an example of [YC06b]. On the unit sphere
        this speed vanishes at (-1, 0, 0), which no ray reaches in finite time; ds/c is then the metric of a plane.

    Raises
    ------
    ValueError
        If the radius is not a positive finite number, or the speed is not usable.

    Examples
    --------
    >>> import scatterers as sc
    >>> ball = sc.Sphere(radius=2.0)
    >>> ball.level([[4.0, 0.0, 0.0], [0.0, 0.0, 1.0]])          # outside, inside
    array([ 3.  , -0.75])
    >>> ball.parameters([0.0, 2.0, 0.0]).round(6)               # theta, phi
    array([1.570796, 1.570796])
    """

    radius: float = 1.0
    speed: Any = None

    def _shape(self) -> tuple[float, float, float, float]:
        return self.radius, self.radius, self.radius, 0.0


@dataclass(frozen=True)
class TwistedEllipsoid(BentEllipsoid):
    """Ellipsoid whose y is shifted by d cos(pi z); the body of the creeping rays in [YC06b].

    Parameters
    ----------
    a, b, c : float
        Semi-axes along x, y, z, L; positive.
    d : float
        Amplitude of the shift, L.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.

    Raises
    ------
    ValueError
        If a semi-axis is not a positive finite number, d is not finite, or the speed is not usable.

    Examples
    --------
    >>> import scatterers as sc
    >>> body = sc.TwistedEllipsoid()
    >>> body.bounds[1]
    array([0.5, 0.7, 1. ])
    >>> float(body.level([0.0, 0.2, 0.0]))                      # on the spine
    -1.0
    """

    a: float = 0.5
    b: float = 0.5
    c: float = 1.0
    d: float = 0.2
    speed: Any = None

    _free = ("d",)

    def _shape(self) -> tuple[float, float, float, float]:
        return self.a, self.b, self.c, self.d


def _evaluate(points, values, gradients, hessians, parameters):  # type: ignore[no-untyped-def]
    """F, grad F and Hessian of a block.

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
    """Chart, chart variables and polar frame of a block."""
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
    """Points and derivatives of psi for a block."""
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
    """psi^-1 of a block, of unit length."""
    a, b, c, d = 1 / parameters[0], 1 / parameters[1], 1 / parameters[2], parameters[3]
    for i in range(points.shape[1]):
        bent = d * cos_pi(points[2, i]) if d != 0.0 else 0.0
        x, y, z = a * points[0, i], b * (points[1, i] - bent), c * points[2, i]
        scale = 1.0 / math.sqrt(x * x + y * y + z * z)
        s[0, i], s[1, i], s[2, i] = scale * x, scale * y, scale * z


@dataclass(frozen=True)
class Torus(Levelled, Body):
    """Torus about the z axis.

    Parameters
    ----------
    R : float
        Radius of the centre circle, L.
    r : float
        Radius of the tube, L; 0 < r < R.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.

    Raises
    ------
    ValueError
        If a radius is not a positive finite number, r >= R, or the speed is not usable.

    Examples
    --------
    >>> import scatterers as sc
    >>> ring = sc.Torus(R=1.0, r=0.5)
    >>> abs(ring.level([[1.5, 0.0, 0.0], [1.0, 0.0, 0.0]])).round(12)          # on the body, on the centre circle
    array([0., 1.])
    >>> ring.parameters([0.0, 1.5, 0.0]).round(6)               # theta, psi
    array([0.      , 1.570796])
    """

    R: float = 1.0
    r: float = 0.5
    speed: Any = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.r >= self.R:
            raise ValueError(f"r = {self.r!r} >= R = {self.R!r}: the torus meets itself; give r < R")

    @cached
    def bounds(self) -> FloatArray:
        """Box (2, 3) that contains the body, L."""
        half = np.array([self.R + self.r, self.R + self.r, self.r])
        return np.stack([-half, half])

    @property
    def axis_of_revolution(self) -> tuple[float, float, float]:
        """Unit vector along the axis."""
        return 0.0, 0.0, 1.0

    def parameters(self, points: FloatArray) -> FloatArray:
        """Angle theta around the tube and azimuth psi, radians, both in (-pi, pi]: points (..., 3), L, to (..., 2)."""
        x, y, z = np.moveaxis(np.asarray(points, dtype=float), -1, 0)
        return np.stack([np.arctan2(z, np.hypot(x, y) - self.R), np.arctan2(y, x)], axis=-1)

    @cached_property
    def compiled(self) -> Compiled:
        """Compiled function that gives F, its gradient and its Hessian."""
        return Compiled(_torus_evaluate, "level", np.array([self.R, self.r]))

    @cached
    def atlas(self) -> PeriodicAtlas:
        """One chart that covers the torus, periodic in both coordinates."""
        radii = np.array([self.R, self.r])
        there, back = Compiled(_torus_forward, "forward", radii), Compiled(_torus_inverse, "inverse", radii)
        return PeriodicAtlas(Compiled(_torus_locate, "locator", radii), there, back)

    @property
    def tiling(self) -> Sequence[PeriodicChart]:
        """The one chart of `atlas`, whose unit square covers the torus once."""
        return self.atlas.charts


def _torus_evaluate(points, values, gradients, hessians, parameters):  # type: ignore[no-untyped-def]
    """F, grad F and Hessian of a block.

    Each loop touches few rows: the compiler vectorises it only while it can check that they do not overlap.
    """
    major, scale = parameters[0], 2 / parameters[1] ** 2
    n = points.shape[1]
    # while they are not yet wanted for the Hessian, two of its rows hold R/rho and 1/rho
    for i in range(n):
        x, y, z = points[0, i], points[1, i], points[2, i]
        square = x * x + y * y
        inverse = 1.0 / max(math.sqrt(square), 1e-300)
        beyond = square * inverse - major
        hessians[4, i] = inverse
        values[i] = 0.5 * scale * (beyond * beyond + z * z) - 1.0
    for i in range(n):
        hessians[3, i] = major * hessians[4, i]
        gradients[2, i] = scale * points[2, i]
    for i in range(n):
        radial = scale * (1 - hessians[3, i])
        gradients[0, i] = radial * points[0, i]
        gradients[1, i] = radial * points[1, i]
    for i in range(n):
        sine = points[1, i] * hessians[4, i]
        hessians[0, i] = scale * (1 - hessians[3, i] * sine * sine)
        hessians[5, i] = scale * hessians[3, i] * sine * (points[0, i] * hessians[4, i])
    for i in range(n):
        cosine = points[0, i] * hessians[4, i]
        hessians[1, i] = scale * (1 - hessians[3, i] * cosine * cosine)
    for i in range(n):
        hessians[2, i] = scale
        hessians[3, i] = 0.0
        hessians[4, i] = 0.0


def _torus_locate(points, gradients, chart, uv, frame, parameters):  # type: ignore[no-untyped-def]
    """Chart, chart variables and polar frame of a block."""
    turn = 1 / (2 * math.pi)
    for i in range(points.shape[1]):
        x, y, z = points[0, i], points[1, i], points[2, i]
        rho = math.sqrt(x * x + y * y)
        radial = rho - parameters[0]
        u, v = math.atan2(y, x) * turn, math.atan2(z, radial) * turn
        chart[i] = 0
        u, v = u - math.floor(u), v - math.floor(v)
        uv[0, i] = 0.0 if u >= 1.0 else u
        uv[1, i] = 0.0 if v >= 1.0 else v
        tube = math.sqrt(radial * radial + z * z)
        cos_psi, sin_psi = x / rho, y / rho
        cos_theta, sin_theta = radial / tube, z / tube
        frame[0, i], frame[1, i], frame[2, i] = -sin_psi, cos_psi, 0.0
        frame[3, i], frame[4, i], frame[5, i] = -sin_theta * cos_psi, -sin_theta * sin_psi, cos_theta


def _torus_forward(chart, points, derivatives, parameters):  # type: ignore[no-untyped-def]
    """Points and tangents of a block."""
    major, minor = parameters[0], parameters[1]
    turn = 2 * math.pi
    n = chart.shape[1]
    # while they are not yet wanted, rows of the derivative hold cosines and sines; the period of the chart variables is
    # 1, that of cos_pi is 2. Few rows a loop, as in `_torus_evaluate`
    for i in range(n):
        derivatives[2, i] = cos_pi(2 * chart[0, i])
        derivatives[5, i] = sin_pi(2 * chart[0, i])
    for i in range(n):
        derivatives[7, i] = cos_pi(2 * chart[1, i])
        points[2, i] = minor * sin_pi(2 * chart[1, i])
    for i in range(n):
        rho = major + minor * derivatives[7, i]
        points[0, i] = rho * derivatives[2, i]
        points[1, i] = rho * derivatives[5, i]
    for i in range(n):
        derivatives[0, i] = -turn * points[1, i]
        derivatives[3, i] = turn * points[0, i]
    for i in range(n):
        height = -turn * points[2, i]
        derivatives[1, i] = height * derivatives[2, i]
        derivatives[4, i] = height * derivatives[5, i]
    for i in range(n):
        derivatives[7, i] *= turn * minor
        derivatives[6, i] = 0.0
    for i in range(n):
        derivatives[2, i], derivatives[5, i], derivatives[8, i] = 0.0, 0.0, 0.0


def _torus_inverse(points, chart, parameters):  # type: ignore[no-untyped-def]
    """Chart variables of a block, in turns."""
    turn = 1 / (2 * math.pi)
    for i in range(points.shape[1]):
        x, y, z = points[0, i], points[1, i], points[2, i]
        chart[0, i] = math.atan2(y, x) * turn
        chart[1, i] = math.atan2(z, math.sqrt(x * x + y * y) - parameters[0]) * turn
        chart[2, i] = 0.0
