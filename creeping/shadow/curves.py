"""The closed curves of shadow lines as equally spaced nodes, those of many lines together, and places between them.

A place is a number of nodes with a fraction, u; between nodes a quantity is the polynomial of degree 2 HALF - 1 through
the nodes around. What is done here for one curve does not depend on the others.

Sources: Derivations, R6 and R8.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from creeping._typing import FloatArray, IntArray

HALF = 6
"""Nodes on either side that a polynomial along a curve goes through."""
_OFFSETS = np.arange(1 - HALF, HALF + 1)
_SCALES = np.array([np.prod([j - i for i in _OFFSETS if i != j], dtype=float) for j in _OFFSETS])


@dataclass(frozen=True, eq=False)
class LineNodes:
    """Nodes of the closed curves of one line, the longest first.

    Attributes
    ----------
    points, tangents : (n, 3), L and 1
        One curve after the other.
    curvature : (n,), 1/L
        kappa_n(q).
    starts : (curves + 1,)
        First node of each curve, and their number.
    spacing : (curves,), L
    error : float
        Estimated relative error of the length.
    """

    points: FloatArray
    tangents: FloatArray
    curvature: FloatArray
    starts: IntArray
    spacing: FloatArray
    error: float

    @property
    def length(self) -> float:
        """Length of all curves, L."""
        return float(sum(self.spacing * np.diff(self.starts)))


@dataclass(frozen=True, eq=False)
class Curves:
    """Closed curves of the lines of several waves, one after the other.

    Attributes
    ----------
    waves : (n, 4)
        Rows (d, w) of `creeping.geometry.incident`.
    points, tangents : (m, 3), curvature : (m,)
        Of the nodes.
    line, first, number : (c,)
        Of each curve: the number of its line, its first node, and the number of its nodes.
    spacing : (c,), L
    """

    waves: FloatArray
    points: FloatArray
    tangents: FloatArray
    curvature: FloatArray
    line: IntArray
    first: IntArray
    number: IntArray
    spacing: FloatArray

    @classmethod
    def of(cls, waves: FloatArray, lines: Sequence[LineNodes]) -> "Curves":
        """Those of one line or more; waves (n, 4)."""
        number = np.concatenate([np.diff(one.starts) for one in lines])
        return cls(
            waves,
            points=np.concatenate([one.points for one in lines]),
            tangents=np.concatenate([one.tangents for one in lines]),
            curvature=np.concatenate([one.curvature for one in lines]),
            line=np.repeat(np.arange(len(lines)), [len(one.spacing) for one in lines]),
            first=np.cumsum(number) - number,
            number=number,
            spacing=np.concatenate([one.spacing for one in lines]),
        )

    @property
    def counts(self) -> IntArray:
        """Curves of each line: (n,)."""
        return np.asarray(np.bincount(self.line, minlength=len(self.waves)), dtype=np.int64)

    @property
    def lengths(self) -> FloatArray:
        """Length of each line (n,), L."""
        return np.asarray(np.bincount(self.line, self.spacing * self.number, minlength=len(self.waves)))

    @cached_property
    def own(self) -> IntArray:
        """Curve of each node: (m,)."""
        return np.repeat(np.arange(len(self.number)), self.number)

    @cached_property
    def after(self) -> IntArray:
        """The node that follows each: (m,)."""
        return self.nodes_at(self.own, np.arange(len(self.points)) - self.first[self.own] + 1)

    def nodes_at(self, curve: IntArray, places: IntArray) -> IntArray:
        """Nodes at whole places of curves, of any shape."""
        return np.asarray(self.first[curve] + places % self.number[curve])

    def values_at(self, rows: FloatArray, curve: IntArray, places: FloatArray) -> FloatArray:
        """Values at places (k,) of curves (k,) of what the nodes have, rows (m, c): (k, c)."""
        return interpolated(rows, self.first[curve], self.number[curve], places)


def interpolated(rows: FloatArray, first: IntArray | int, number: IntArray | int, places: FloatArray) -> FloatArray:
    """Rows (m, c) of a closed curve's nodes at places (k,), from the first of its nodes on: (k, c).

    Examples
    --------
    >>> turn = 2 * np.pi * np.arange(32) / 32
    >>> circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    >>> bool(np.allclose(interpolated(circle, 0, 32, np.array([4.0, 8.5])) ** 2 @ [1, 1], 1.0, atol=1e-10))
    True
    """
    whole = np.floor(places).astype(np.int64)
    u = (places - whole)[:, None] - _OFFSETS
    before, after = np.ones_like(u), np.ones_like(u)
    before[:, 1:] = np.cumprod(u[:, :-1], axis=1)
    after[:, :-1] = np.cumprod(u[:, :0:-1], axis=1)[:, ::-1]
    weights = before * after / _SCALES
    around = np.asarray(first)[..., None] + (whole[:, None] + _OFFSETS) % np.asarray(number)[..., None]
    # one after the other: sums of a library's own order differ with the number of rows
    total = weights[:, :1] * rows[around[:, 0]]
    for j in range(1, 2 * HALF):
        total += weights[:, j : j + 1] * rows[around[:, j]]
    return np.asarray(total)
