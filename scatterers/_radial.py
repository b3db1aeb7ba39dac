"""Sphere map of a star-shaped body: x = psi(s) = c + r(s) A s, A = diag(half axes), r > 0 the root of F(c + r A s) = 0.

With y = A s and g = grad F(x): d psi/ds = r (A - y (A g)^T/(g.y)), and psi^-1(x) = A^-1 (x - c)/|A^-1 (x - c)|. Every
ray meets the body once where g.(x - c) > 0 on all of it. The root is found by Newton steps from r = 1, halved into
the bracket [0, edge of the grid] when they leave it. `scatterers._radial_kernels` is the compiled twin.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from scatterers._compile import Compiled
from scatterers._spline_constants import ITERATIONS, SMALL
from scatterers._tensor_spline import TensorSpline

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class RadialMap:
    """The map for a body whose F is a spline; satisfies `scatterers._charts.SphereMap`.

    Attributes
    ----------
    spline : TensorSpline
    centre, half_axes : (3,), L
    """

    spline: TensorSpline
    centre: FloatArray
    half_axes: FloatArray

    def radius(self, s: FloatArray) -> FloatArray:
        """Root r of the rays along unit vectors: (..., 3) -> (...); NaN where none is found."""
        y = self.half_axes * np.asarray(s, dtype=float).reshape(-1, 3)
        box = self.spline.box - self.centre
        with np.errstate(divide="ignore", invalid="ignore"):
            high = np.min(np.where(y > 0, box[1] / y, np.where(y < 0, box[0] / y, np.inf)), axis=-1)
        low, r = np.zeros(len(y)), np.minimum(1.0, 0.5 * high)
        found = np.full(len(y), np.nan)
        active = np.flatnonzero(np.isfinite(high))
        for _ in range(ITERATIONS):
            if not len(active):
                break
            at, along = r[active], y[active]
            value, gradient = self.spline.value_and_gradient(self.centre + at[:, None] * along)
            high[active] = np.where(value > 0, np.minimum(high[active], at), high[active])
            low[active] = np.where(value > 0, low[active], np.maximum(low[active], at))
            with np.errstate(divide="ignore", invalid="ignore"):
                step = -value / np.sum(gradient * along, axis=-1)
            small = np.abs(step) <= SMALL * at
            inside = (at + step > low[active]) & (at + step < high[active])
            r[active] = np.where(small | inside, at + step, 0.5 * (low[active] + high[active]))
            found[active[small]] = r[active[small]]
            active = active[~small]
        return found.reshape(np.shape(s)[:-1])

    def forward(self, s: FloatArray) -> FloatArray:
        """psi(s): (..., 3) -> (..., 3)."""
        return np.asarray(self.centre + self.radius(s)[..., None] * self.half_axes * s)

    def derivative(self, s: FloatArray) -> FloatArray:
        """Derivative of psi: (..., 3) -> (..., 3, 3)."""
        r, y = self.radius(s), self.half_axes * s
        gradient = self.spline.gradient(self.centre + r[..., None] * y)
        slope = gradient * self.half_axes / np.sum(gradient * y, axis=-1, keepdims=True)
        return np.asarray(r[..., None, None] * (np.diag(self.half_axes) - y[..., :, None] * slope[..., None, :]))

    def inverse(self, points: FloatArray) -> FloatArray:
        """psi^-1(x), of unit length: (..., 3) -> (..., 3)."""
        s = (np.asarray(points, dtype=float) - self.centre) / self.half_axes
        return np.asarray(s / np.linalg.norm(s, axis=-1, keepdims=True))

    @cached_property
    def parameters(self) -> FloatArray:
        """Parameters that all compiled functions share."""
        return self.spline.flat(self.centre, self.half_axes)

    @cached_property
    def compiled_forward(self) -> Compiled:
        """Compiled psi and its derivative."""
        from scatterers._radial_kernels import forward

        return Compiled(forward, "forward", self.parameters)

    @cached_property
    def compiled_inverse(self) -> Compiled:
        """Compiled psi^-1."""
        from scatterers._radial_kernels import inverse

        return Compiled(inverse, "inverse", self.parameters)

    @cached_property
    def compiled_locator(self) -> Compiled:
        """Compiled locator of the six charts over psi."""
        from scatterers._radial_kernels import locate

        return Compiled(locate, "locator", self.parameters)
