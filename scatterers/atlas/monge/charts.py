"""Monge charts of a body F = 0: graphs over squares in its tangent planes.

With x0 on the body, N = n(x0), E1 and E2 tangent, E1 x E2 = N, w the half width, and g = grad F,

    x(u, v) = x0 + q + h N,   q = w ((2u - 1) E1 + (2v - 1) E2),   F(x(u, v)) = 0,
    x_u = 2w (E1 - N (g.E1)/(g.N)),   x_v = 2w (E2 - N (g.E2)/(g.N)).

h is followed from the centre of the square: over s q, s in STEPS, Newton steps h <- h - F/(g.N) start from the Taylor
series of the place before, dh/ds = -(g.q)/(g.N).

Sources: Derivations, B3.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Field = Callable[[FloatArray], FloatArray]
STEPS = (0.3, 0.55, 0.75, 0.9, 1.0)
# n.N below which a graph over the tangent plane is not followed
STEEP = 0.05


@dataclass(frozen=True, eq=False)
class MongeCharts:
    """Charts by their squares, or one of them with (...) = ().

    Attributes
    ----------
    level, gradient : callable
        F and its gradient, (..., 3) -> (...) and (..., 3).
    centres : (..., 3), L
    axes : (..., 3, 3)
        Rows E1, E2, N.
    half : (...), L
        Half widths.
    bend : (..., 2, 2), 1/L
        Second derivatives of h at the centres.
    """

    level: Field
    gradient: Field
    centres: FloatArray
    axes: FloatArray
    half: FloatArray
    bend: FloatArray

    def __getitem__(self, index: int | NDArray[np.int64]) -> "MongeCharts":
        parts = (np.asarray(v[index]) for v in (self.centres, self.axes, self.half, self.bend))
        return MongeCharts(self.level, self.gradient, *parts)

    def points(self, uv: FloatArray) -> FloatArray:
        """Points of the body, L, over (u, v) (..., 2), broadcast against the charts: (..., 3)."""
        e1, e2, n = np.moveaxis(self.axes, -2, 0)
        s = 2 * uv - 1
        half = self.half[..., None]
        q = half * (s[..., :1] * e1 + s[..., 1:] * e2)
        # h, dh/ds and d2h/ds2 at the centre
        h, slope = np.zeros(q.shape[:-1]), np.zeros(q.shape[:-1])
        bend = self.half**2 * np.einsum("...i,...ij,...j->...", s, self.bend, s)
        last = 0.0
        for step in STEPS:
            ds = step - last
            h = h + ds * (slope + 0.5 * ds * bend)
            h, moved, g = self._newton(step * q, h, 2 if step < 1 else 12)
            along = -np.sum(g * q, axis=-1) / self._lean(g, n)
            bend, slope, last = (along - slope) / ds, along, step
        x = self.centres + q + h[..., None] * n
        lost = ~(moved <= 1e-9 * self.half)
        if lost.any():
            # beyond the reach of a chart there may be nothing over a point: any place on the body keeps rays finite
            x[lost] = _nearest(self.level, self.gradient, x[lost], np.broadcast_to(self.half, lost.shape)[lost])
        return np.asarray(x)

    def _newton(self, q: FloatArray, h: FloatArray, most: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Height over q, length of the last step, and the gradient before it."""
        n = self.axes[..., 2, :]
        for _ in range(most):
            x = self.centres + q + h[..., None] * n
            g = self.gradient(x)
            step = np.clip(-self.level(x) / self._lean(g, n), -0.25 * self.half, 0.25 * self.half)
            h = h + step
            moved = np.abs(step)
            if np.all(moved <= 1e-10 * self.half):
                break
        return h, moved, g

    @staticmethod
    def _lean(g: FloatArray, n: FloatArray) -> FloatArray:
        """g.N, kept away from zero."""
        return np.asarray(np.maximum(np.sum(g * n, axis=-1), STEEP * np.linalg.norm(g, axis=-1) + 1e-300))


def _nearest(level: Field, gradient: Field, x: FloatArray, reach: FloatArray) -> FloatArray:
    for _ in range(20):
        g = gradient(x)
        norm = np.linalg.norm(g, axis=-1) + 1e-300
        x = x - (np.clip(level(x) / norm, -0.25 * reach, 0.25 * reach) / norm)[:, None] * g
    return x


@dataclass(frozen=True, eq=False)
class MongeChart:
    """One chart of the atlas."""

    graph: MongeCharts
    periodic: tuple[bool, bool] = (False, False)

    def point(self, uv: FloatArray) -> FloatArray:
        """Point of the body: (..., 2) -> (..., 3), L."""
        uv = np.asarray(uv, dtype=float)
        flat = uv.reshape(-1, 2)
        # the nodes of a map repeat (u, v) for every angle
        single, where = np.unique(flat[:, 0] + 1j * flat[:, 1], return_inverse=True)
        points = self.graph.points(np.stack([single.real, single.imag], axis=-1))
        return points[where].reshape(*uv.shape[:-1], 3)

    def tangents(self, uv: FloatArray) -> FloatArray:
        """Columns x_u, x_v: (..., 2) -> (..., 3, 2), L."""
        e, n = self.graph.axes[:2], self.graph.axes[2]
        g = self.graph.gradient(self.point(uv))
        slope = (g @ e.T) / self.graph._lean(g, n)[..., None]
        return np.asarray(2 * self.graph.half * (e.T - n[:, None] * slope[..., None, :]))
