"""Rays shed far away by the search of near fields, on the strips' splines: p(σ, s) = r, with v = r in n.v and b.v."""

import numpy as np

from creeping._typing import FloatArray
from creeping.geometry.surface import Surface
from creeping.rays.quantities import RayPoints
from creeping.rays.shedding import ShedRays, _Functions, _search
from creeping.rays.strips import Strip


def shed_far(strips: tuple[Strip, ...], body: Surface, directions: FloatArray) -> ShedRays:
    """Rays shed in the unit directions r (m, 3)."""

    def functions(some: FloatArray, x: FloatArray, n: FloatArray, b: FloatArray, p: FloatArray) -> _Functions:
        return some @ n, some @ b, lambda row, at: np.sum(some[row] * p[:, at].T, axis=1) > 0

    def step(at: RayPoints, slopes: tuple[FloatArray, FloatArray], target: FloatArray) -> tuple[FloatArray, FloatArray]:
        residual = target - at.directions
        # splines keep p of unit length to their own error only
        residual = residual - np.sum(residual * target, axis=-1, keepdims=True) * target
        return np.stack([slopes[0][:, 3:], slopes[1][:, 3:]], axis=-1), residual

    found = _search(strips, body, directions, functions, step)
    return ShedRays(*found, np.full(len(found[0]), np.inf))
