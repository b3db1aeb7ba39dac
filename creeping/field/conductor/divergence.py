"""Surface divergence of a tangential field on a body, by its differences between points to either side.

    D(h) = Σ_t t.[v(x + h t) - v(x - h t)]/2h,   t two tangents at x,       div v = D(h), or (4 D(h) - D(2h))/3

Expansions are smooth to rounding, and h is 0.02/k. What a sum over nodes gives is so within its error alone, which is
as rough as the nodes are dense: there h is larger, and the second form leaves the order h^4.

Sources: Derivations, F26 and F32.
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import Any, ComplexArray, FloatArray
from creeping.field.currents.nodes import axes_of_incidence
from creeping.geometry.curvature import curvature_norms
from creeping.geometry.surface import Surface, normal, project

CLOSE, WIDE = 0.02, 0.3
"""h of expansions, over 1/k, and of sums over nodes, over that and the least radius of curvature."""


class Crosses(NamedTuple):
    """Points (n,) of a body and those to either side of them, in blocks of n: the points first.

    Attributes
    ----------
    points, normals : (m n, 3), L and 1
    apart : (s, 2, n, 3), L
        What the two points along each tangent are apart, of s distances.
    step : (n,), L
        h.
    """

    points: FloatArray
    normals: FloatArray
    apart: FloatArray
    step: FloatArray

    @property
    def blocks(self) -> int:
        """Their number m."""
        return 1 + 4 * len(self.apart)

    def divergence(self, values: ComplexArray) -> tuple[ComplexArray, FloatArray]:
        """Divergence, 1/L, of values (m n, 3, p), and what two distances tell of it: (n, p) each."""
        ends = values.reshape(self.blocks, len(self.step), *values.shape[1:])[1:]
        change, apart = ends[0::2] - ends[1::2], np.concatenate(self.apart)
        slopes = np.sum(apart[..., None] * change, axis=2) / np.sum(apart**2, axis=2)[..., None]
        near, *wide = slopes.reshape(len(self.apart), 2, *slopes.shape[1:]).sum(axis=1)
        if not wide:
            return np.asarray(near), np.zeros(near.shape)
        found = (4 * near - wide[0]) / 3
        return np.asarray(found), np.abs(found - near)


def crosses(body: Surface, direction: FloatArray, points: FloatArray, k: float, *, rough: bool) -> Crosses:
    """Crosses at points of a body (n, 3), L, for expansions, or for what is as ``rough`` as a sum over nodes."""
    n = normal(body, points)
    first = axes_of_incidence(n, direction)
    step = np.full(len(points), CLOSE / k)
    if rough:
        # next to a tip there is no radius, and no divergence either
        step = np.fmax(WIDE / np.maximum(k, curvature_norms(body, points)), 0.1 * step)
    sides: list[Any] = []
    for share in (1.0, 2.0) if rough else (1.0,):
        for t in (first, np.cross(n, first)):
            sides += [project(body, points + sign * share * step[:, None] * t) for sign in (1.0, -1.0)]
    apart = np.array([a - b for a, b in zip(sides[0::2], sides[1::2], strict=True)])
    around = np.concatenate([points, *sides])
    return Crosses(around, normal(body, around), apart.reshape(len(sides) // 4, 2, *points.shape), step)
