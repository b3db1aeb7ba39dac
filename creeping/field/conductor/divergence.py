"""Surface divergence of a tangential field on a body, by its differences between points to either side.

    div v = Σ_t t.[v(x + h t) - v(x - h t)]/2h,   t two tangents at x, kh = CLOSE

Sources: Derivations, F26.
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.currents.nodes import axes_of_incidence
from creeping.geometry.surface import Surface, normal, project

CLOSE = 0.02
"""kh: expansions are smooth to rounding."""


class Crosses(NamedTuple):
    """Points (n,) of a body and those to either side of them, in blocks of n: the points first.

    Attributes
    ----------
    points, normals : (5 n, 3), L and 1
    apart : (2, n, 3), L
        What the two points along each tangent are apart.
    """

    points: FloatArray
    normals: FloatArray
    apart: FloatArray

    def divergence(self, values: ComplexArray) -> ComplexArray:
        """Divergence, 1/L, of values (5 n, 3, p): (n, p)."""
        ends = values.reshape(5, -1, *values.shape[1:])[1:]
        slopes = np.sum(self.apart[..., None] * (ends[0::2] - ends[1::2]), axis=2)
        return np.asarray(np.sum(slopes / np.sum(self.apart**2, axis=2)[..., None], axis=0))


def crosses(body: Surface, direction: FloatArray, points: FloatArray, k: float) -> Crosses:
    """Crosses at points of a body (n, 3), L."""
    n = normal(body, points)
    first = axes_of_incidence(n, direction)
    sides = [project(body, points + sign * CLOSE / k * t) for t in (first, np.cross(n, first)) for sign in (1.0, -1.0)]
    apart = np.stack([a - b for a, b in zip(sides[0::2], sides[1::2], strict=True)])
    around = np.concatenate([points, *sides])
    return Crosses(around, normal(body, around), apart)
