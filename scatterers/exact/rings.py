"""Triangles between rings of points: the tiles of bodies of revolution and of their affine images.

A ring at the radius r has n points at equal parts of its length, (r cos phi, r sin phi/stretch). Between two rings the
fractions (i + 1/2)/n of both are put in order; where one passes, its ring advances by a point and a triangle is closed.
"""

from functools import cache

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
FEWEST = 6
"""Points on a ring, however short."""


@cache
def _ring_length(stretch: float) -> tuple[FloatArray, FloatArray]:
    """Angles in [0, 2 pi] and the length of the ring of radius 1 up to there."""
    angles = np.linspace(0, 2 * np.pi, 4097)
    middle = 0.5 * (angles[1:] + angles[:-1])
    steps = np.hypot(np.sin(middle), np.cos(middle) / stretch) * angles[1]
    return angles, np.concatenate([[0.0], np.cumsum(steps)])


def ring_angles(n: int, stretch: float) -> FloatArray:
    """Angles (n,), radians, that divide a ring into parts of equal length."""
    angles, lengths = _ring_length(stretch)
    return np.asarray(np.interp(np.arange(n) * (lengths[-1] / n), lengths, angles))


def ring_sizes(radii: FloatArray, edge: float, stretch: float) -> IntArray:
    """Points on rings of these radii (n,), L, for parts of at most ``edge``, L; one where the radius is 0."""
    length = radii * _ring_length(stretch)[1][-1]
    return np.where(radii > 0, np.maximum(FEWEST, np.ceil(length / edge)), 1).astype(np.int64)


def strip(lower: int, upper: int) -> tuple[IntArray, IntArray]:
    """Corners of the triangles between a ring and the next one along the profile, counter-clockwise from outside.

    Returns
    -------
    ring : (m, 3)
        0 of a corner on the lower ring, 1 of one on the upper.
    number : (m, 3)
        Of the point on its ring.
    """
    # a single point is the corner of all, and never advances
    below = (np.arange(lower) + 0.5) / lower if lower > 1 else np.zeros(0)
    above = (np.arange(upper) + 0.5) / upper if upper > 1 else np.zeros(0)
    of_upper = np.concatenate([np.zeros(len(below), dtype=np.int64), np.ones(len(above), dtype=np.int64)])
    of_upper = of_upper[np.argsort(np.concatenate([below, above]), kind="stable")]
    j = np.cumsum(of_upper) - of_upper
    i = np.arange(len(of_upper)) - j
    up = of_upper == 1
    number = np.where(
        up[:, None],
        np.stack([i % lower, (j + 1) % upper, j % upper], axis=-1),
        np.stack([i % lower, (i + 1) % lower, j % upper], axis=-1),
    )
    ring = np.where(up[:, None], [0, 1, 1], [0, 0, 1])
    return ring.astype(np.int64), number
