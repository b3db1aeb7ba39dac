"""Few squares that cover a body of revolution: parts of its profile turned about the axis by parts of a turn.

    x(u, v) = (r cos phi, r sin phi, w),   (w, r) along the profile by u,   phi by v,   x_u x x_v out of the body

From the axis u goes outwards, and else upwards; where u goes up, phi goes back.

Sources: [C76, sec. 3-3]; Derivations, B14.
"""

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scatterers.exact.profile import Segment

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
STEEP = 1.1
"""Turn of the profile along a square, radians, at most."""
DENSE = 513
"""Points of a segment by which its turn is measured."""


class Squares(NamedTuple):
    """Squares 0 <= u, v <= 1 that cover a body.

    Attributes
    ----------
    vertices : (l, 3), L
    places : (m, n, n, 3), L
        Points of the body at u and v.
    corners : (m, 4)
        Numbers of the vertices at (0, 0), (1, 0), (1, 1), (0, 1). On the axis the whole side u = 0 is one of them.
    pieces : (m,)
    """

    vertices: FloatArray
    places: FloatArray
    corners: IntArray
    pieces: IntArray


def revolved_squares(profile: Sequence[Segment], sectors: int, at: FloatArray) -> Squares:
    """Squares of a profile about the axis w, ``sectors`` in a ring, and their points at u and v ``at`` (n,)."""
    parts = [
        (piece, segment, low, high)
        for piece, segment in enumerate(profile)
        for cuts in [_cuts(segment)]
        for low, high in itertools.pairwise(cuts)
    ]
    heights, radii = np.array(
        [parts[0][1].start, *(segment.point(np.array([high]))[0] for _, segment, _, high in parts)]
    ).T
    counts = np.where(radii > 0, sectors, 1)
    starts, number = np.concatenate([[0], np.cumsum(counts)]), np.arange(sectors)
    phi, after = 2 * np.pi * number / sectors, np.roll(number, -1)
    rings = [_turned(np.full(n, w), np.full(n, r), phi[:n]) for w, r, n in zip(heights, radii, counts, strict=True)]
    places, corners, pieces = [], [], []
    for k, (piece, segment, low, high) in enumerate(parts):
        below, above = (starts[ring] + number % counts[ring] for ring in (k, k + 1))
        one, two, v = after, number, 1 - at
        if radii[k + 1] == 0:
            low, high, below, above, one, two, v = high, low, above, below, number, after, at
        w, r = segment.point(low + at * (high - low)).T[:, None, :, None]
        places.append(_turned(w, r, phi[:, None, None] + 2 * np.pi / sectors * v))
        corners.append(np.stack([below[one], above[one], above[two], below[two]], axis=1))
        pieces.append(np.full(sectors, piece, dtype=np.int64))
    return Squares(*map(np.concatenate, (rings, places, corners, pieces)))


def _turned(w: FloatArray, r: FloatArray, phi: FloatArray) -> FloatArray:
    """Points (..., 3) at heights w and distances r from the axis."""
    return np.stack(np.broadcast_arrays(r * np.cos(phi), r * np.sin(phi), w), axis=-1)


def _cuts(segment: Segment) -> FloatArray:
    """Values of u from 0 to 1 between which a segment turns by no more than STEEP."""
    u = np.linspace(0, 1, DENSE)
    tangent = segment.tangent(u)
    sine = tangent[:-1, 0] * tangent[1:, 1] - tangent[:-1, 1] * tangent[1:, 0]
    turned = np.concatenate([[0.0], np.cumsum(np.abs(sine))])
    count = max(1, math.ceil(turned[-1] / STEEP))
    inner = np.interp(np.arange(1, count) / count * turned[-1], turned, u)
    return np.concatenate([[0.0], inner, [1.0]])
