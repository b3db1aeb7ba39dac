"""Bodies of smooth pieces: what they share, and the piece itself.

The level of the body is on each piece that of the piece; between pieces it jumps. Of a point near the body the piece
counts whose part of the body is nearest.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scatterers.base.level_body import Body
from scatterers.kernels.compiled import Compiled
from scatterers.pieces.patch import Crease
from scatterers.spline.tensor import SYMMETRIC, evaluated

SHARP = ("edge", "tip")
"""Kinds of creases that no smooth chart covers."""


FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class Levelled:
    """What a compiled level gives; a subclass has ``compiled`` and ``bounds``."""

    @property
    def compiled(self) -> Compiled:
        """Compiled level evaluator."""
        raise NotImplementedError

    @property
    def bounds(self) -> FloatArray:
        """Box (2, 3) that contains the body, L."""
        raise NotImplementedError

    def level(self, points: FloatArray) -> FloatArray:
        """F, positive outside: points (..., 3), L, to (...)."""
        return evaluated(self.compiled, points)[0]

    def gradient(self, points: FloatArray) -> FloatArray:
        """Gradient of F, unit of F over L: points (..., 3), L, to (..., 3).

        At a tip it is finite, and that of no side.
        """
        return evaluated(self.compiled, points)[1]

    def hessian(self, points: FloatArray) -> FloatArray:
        """Hessian of F, unit of F over L^2: points (..., 3), L, to (..., 3, 3)."""
        return evaluated(self.compiled, points)[2][..., SYMMETRIC]

    def jet(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """F, its gradient and its Hessian, by one evaluation: points (..., 3), L."""
        level, gradient, entries = evaluated(self.compiled, points)
        return level, gradient, entries[..., SYMMETRIC]

    def parameters(self, points: FloatArray) -> FloatArray:
        """Polar angle theta in [0, pi] and azimuth phi in (-pi, pi], radians: (..., 3) -> (..., 2).

        Of the point as seen from the middle of the box, the box drawn as a cube.
        """
        low, high = self.bounds
        s = (np.asarray(points, dtype=float) - 0.5 * (low + high)) / (0.5 * (high - low))
        theta = np.arctan2(np.hypot(s[..., 0], s[..., 1]), s[..., 2])
        return np.stack([theta, np.arctan2(s[..., 1], s[..., 0])], axis=-1)


@dataclass(frozen=True)
class NoCharts:
    """Stands for the atlas of what has none.

    The error comes with the question for charts, not for the atlas: whether a body has the members of a protocol is
    found out by asking for all of them.

    Attributes
    ----------
    reason : str
    """

    reason: str

    @property
    def charts(self) -> Any:
        """None.

        Raises
        ------
        ValueError
        """
        raise ValueError(self.reason)

    def locate(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """None of points (..., 3), L.

        Raises
        ------
        ValueError
        """
        raise ValueError(self.reason)


def no_charts(sharp: Sequence[Crease]) -> NoCharts:
    """No charts because of edges and tips."""
    found = f"{len(sharp)} edges and tips, first {sharp[0]!r}" if sharp else "several pieces"
    return NoCharts(f"the body has {found}: no smooth charts cover it; take its tiles")


class Piece(Levelled):
    """Smooth surface, part of which bounds a body.

    Parameters
    ----------
    compiled : Compiled
    bounds : (2, 3), L
        Of that part.
    """

    def __init__(self, compiled: Compiled, bounds: FloatArray) -> None:
        self._compiled, self._bounds = compiled, bounds

    @property
    def compiled(self) -> Compiled:
        """Compiled level evaluator."""
        return self._compiled

    @property
    def bounds(self) -> FloatArray:
        """Box (2, 3) that contains the part that bounds the body, L."""
        return self._bounds

    @property
    def atlas(self) -> "NoCharts":
        """None: asking it for charts raises an error."""
        return NoCharts("a piece of a body goes beyond its edge: no charts cover it; take the tiles of the body")


class PiecewiseBody(Levelled, Body):
    """Base of bodies of pieces; a subclass gives ``compiled``, ``bounds``, ``pieces``, ``creases``, ``tiles``."""

    @property
    def pieces(self) -> Sequence[Piece]:
        """Smooth surfaces that bound the body, in order."""
        raise NotImplementedError

    @property
    def creases(self) -> Sequence[Crease]:
        """Creases: edges, joints and tips at which pieces meet or end."""
        raise NotImplementedError

    @property
    def _compiled_numbers(self) -> Compiled:
        """Of kind "level", with the number of the piece in the place of F."""
        raise NotImplementedError

    def piece(self, points: FloatArray) -> IntArray:
        """Number of the piece nearest to points (..., 3), L, which lie near the body: (...)."""
        return evaluated(self._compiled_numbers, points)[0].astype(np.int64)

    def tiles(self, edge: float) -> tuple[FloatArray, FloatArray, IntArray]:
        """The body as triangles with sides of about ``edge``, L, at most.

        Returns
        -------
        corners, normals : (m, 3, 3), L and 1
            Corners are counter-clockwise seen from outside and lie on one piece; normals are those of that piece.
        pieces : (m,)
            Number of the piece of each triangle.
        """
        raise NotImplementedError

    @property
    def atlas(self) -> Any:
        """None, unless a subclass has one: asking it for charts raises an error that says why."""
        return no_charts([crease for crease in self.creases if crease.kind in SHARP])
