"""The closed curves of shadow lines as equally spaced nodes, those of many lines together, and places between them.

Also here: points next to shadow lines moved onto them, each onto the line of its own wave.

A place is a number of nodes with a fraction, u; between nodes a quantity is the polynomial of degree 11 through
the nodes around. What is done here for one curve does not depend on the others.

Sources: Derivations, R6 and R8.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from creeping._typing import FloatArray, IntArray
from creeping.geometry.evaluators import evaluators
from creeping.geometry.incident import rows_of
from creeping.geometry.surface import Surface, size
from creeping.kernels.threads import in_threads

NEAR = 1e-2
"""Longest step, in body sizes, that brings an interpolated point onto the line; nodes are much closer."""


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
    from creeping.shadow.kernels.interpolation import interpolate

    out = np.empty((len(places), rows.shape[1]))
    # of arrays of another kind kernels would be compiled once more
    first, number = (np.array(np.broadcast_to(one, len(places)), dtype=np.int64) for one in (first, number))
    interpolate(np.ascontiguousarray(rows), first, number, np.ascontiguousarray(places), out)
    return out


class Moved(NamedTuple):
    """Points on lines (n, 3), L, with the lines' unit tangents (n, 3) and kappa_n(q) (n,), 1/L.

    ``left`` (n,) are the sizes of the steps that would follow, L. Of points without a step nothing is finite.
    """

    points: FloatArray
    tangents: FloatArray
    curvature: FloatArray
    left: FloatArray


def moved_onto_lines(body: Surface, waves: FloatArray, points: FloatArray, *, reach: float, steps: int) -> Moved:
    """Points of {F = 0, grad F.q = 0} by Newton steps of least norm, the same to the last bit alone or with others.

    Parameters
    ----------
    body : Surface
    waves : (n, 3) or (n, 4), or (3,) or (4,) of one for all
        d of plane waves, or (d, w).
    points : (n, 3), L
        Next to the lines of their waves.
    reach : float, L
        Longest step.
    steps : int
        At most so many; a point stays where its next one would be rounding.
    """
    from creeping.shadow.kernels.newton import move, work_space

    # of arrays of another kind kernels would be compiled once more
    waves = np.array(np.broadcast_to(rows_of(waves), (len(points), 4)), order="C")
    n, found = len(points), np.array(points, dtype=float, order="C")
    tangents, curvature, left = np.empty_like(found), np.empty(n), np.empty(n)
    with evaluators(body) as parts:

        def run(part: slice) -> None:
            out = tangents[part], curvature[part], left[part]
            move(*parts[:2], waves[part], found[part], reach, steps, work_space(), *out)

        in_threads(run, n)
    return Moved(found, tangents, curvature, left)


def tangents_at(body: Surface, wave: FloatArray, points: FloatArray) -> FloatArray:
    """T at points of a line: (n, 3) -> (n, 3)."""
    return moved_onto_lines(body, wave, points, reach=0.0, steps=0).tangents


def polished(body: Surface, wave: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points next to a line moved onto it, with T and kappa_n(q): (n, 3) -> (n, 3), (n, 3), (n,)."""
    return moved_onto_lines(body, wave, points, reach=NEAR * size(body), steps=2)[:3]
