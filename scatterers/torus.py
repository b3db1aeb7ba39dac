"""Torus about z: F = ((sqrt(x^2 + y^2) - R)^2 + z^2)/r^2 - 1.

x = (R + r cos theta)(cos psi, sin psi), z = r sin theta; chart variables u = psi/2 pi, v = theta/2 pi. The coordinate
lines are orthogonal, so the polar frame is the pair of their unit tangents. The inner half is not convex.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from creeping._typing import FloatArray
from scatterers.body import Body, Levelled, positive
from scatterers.cached import cached
from scatterers.charts.star import PeriodicAtlas, PeriodicChart
from scatterers.kernels.compiled import Compiled
from scatterers.kernels.sphere_maps import cos_pi, sin_pi, turns


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
        positive(R=self.R, r=self.r)
        if self.r >= self.R:
            raise ValueError(f"r = {self.r!r} >= R = {self.R!r}: the torus meets itself; give r < R")
        self._set_speed()

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
        """Angles (theta, psi), radians, both in (-pi, pi]: points (..., 3), L, to (..., 2)."""
        x, y, z = np.moveaxis(np.asarray(points, dtype=float), -1, 0)
        return np.stack([np.arctan2(z, np.hypot(x, y) - self.R), np.arctan2(y, x)], axis=-1)

    @cached_property
    def compiled(self) -> Compiled:
        """Compiled level evaluator."""
        return Compiled(_evaluate, "level", np.array([self.R, self.r]))

    @cached
    def atlas(self) -> PeriodicAtlas:
        """One doubly periodic chart."""
        radii = np.array([self.R, self.r])
        there, back = Compiled(_forward, "forward", radii), Compiled(_inverse, "inverse", radii)
        return PeriodicAtlas(Compiled(_locate, "locator", radii), there, back)

    @property
    def tiling(self) -> Sequence[PeriodicChart]:
        """The one chart."""
        return self.atlas.charts


def _evaluate(points, values, gradients, hessians, parameters):  # type: ignore[no-untyped-def]
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


def _locate(points, gradients, chart, uv, frame, parameters):  # type: ignore[no-untyped-def]
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


def _forward(chart, points, derivatives, parameters):  # type: ignore[no-untyped-def]
    """Points and tangents of a block."""
    major, minor = parameters[0], parameters[1]
    turn = 2 * math.pi
    n = chart.shape[1]
    # while they are not yet wanted, rows of the derivative hold cosines and sines; the period of the chart variables is
    # 1, that of cos_pi is 2. Few rows a loop, as in `_evaluate`
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


def _inverse(points, chart, parameters):  # type: ignore[no-untyped-def]
    """Chart variables of a block, in turns."""
    major = parameters[0]
    n = points.shape[1]
    for i in range(n):
        chart[0, i] = turns(points[1, i], points[0, i])
    for i in range(n):
        x, y = points[0, i], points[1, i]
        chart[2, i] = math.sqrt(x * x + y * y) - major
    for i in range(n):
        chart[1, i] = turns(points[2, i], chart[2, i])
    for i in range(n):
        chart[2, i] = 0.0
