"""Where rays leave the pieces of a body: to others, or within REACH of a tip.

Between its states a ray is the cubic of both ends; SAMPLE by SAMPLE it is asked which piece it is on.
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.geodesics.chords import cubics, nearest_on
from creeping.geodesics.states import P, X
from creeping.geometry.creased import tips_of
from creeping.geometry.surface import size

SAMPLE = 0.005
"""Spacing, in body sizes, at which a ray is asked which piece it is on."""
REACH = 1e-3
"""Distance from a tip, in body sizes, at which a ray ends: no expansion serves nearer, where curvatures go like 1/r."""


class Exits(NamedTuple):
    """Where rays (n,) leave a piece.

    Attributes
    ----------
    gone : (n,) of bool
        Whether each does.
    low, high : (n,), L
        Bracket of the time; it is no time of a ray that does not leave.
    interval : (n,) of int
        Between which states it is.
    tip : (n,) of int
        Number of the crease of the tip that it comes to, -1 if it comes to another piece.
    """

    gone: BoolArray
    low: FloatArray
    high: FloatArray
    interval: IntArray
    tip: IntArray

    def some(self, index: IntArray) -> "Exits":
        """Those of part of the rays."""
        return Exits(self.gone[index], self.low[index], self.high[index], self.interval[index], self.tip[index])

    def since(self, begin: FloatArray) -> "Exits":
        """With times (n,) from others on."""
        return self._replace(low=self.low - begin, high=self.high - begin)


class PieceExits:
    """Where rays of a body with creases leave its pieces."""

    def __init__(self, body: Any) -> None:
        self.body, self.size = body, size(body)
        self.tip_numbers, self.tips = tips_of(body)

    def of(self, number: int, states: FloatArray, own: FloatArray) -> Exits:
        """Where rays with states (n, k, lanes) at own times (n, k) leave a piece."""
        n = len(own)
        parts = int(np.ceil(np.max(np.diff(own, axis=1), initial=0.0) / (SAMPLE * self.size))) or 1
        shares = np.arange(1, parts + 1) / parts
        points = cubics(states[:, :-1], states[:, 1:], np.diff(own, axis=1), shares).reshape(n, -1, 3)
        times = (own[:, :-1, None] + np.diff(own, axis=1)[..., None] * shares).reshape(n, -1)
        known = np.all(np.isfinite(points), axis=-1) & (times > 1e-9 * self.size)
        out = np.zeros(known.shape, dtype=bool)
        out[known] = np.asarray(self.body.piece(points[known])) != number
        before = np.concatenate([np.zeros((n, 1)), times[:, :-1]], axis=1)
        tip = np.full(n, -1)
        when = np.argmax(out, axis=1)
        low, high = before[np.arange(n), when], times[np.arange(n), when]
        gone: BoolArray = np.asarray(out.any(axis=1))
        reach, long = REACH * self.size, np.max(own, axis=1, initial=0.0)
        for place, v in enumerate(self.tips):
            # no ray comes farther than its length
            close = np.flatnonzero(np.linalg.norm(states[:, 0, X] - v, axis=1) < long + reach)
            path = np.concatenate([states[close, :1, X], points[close]], axis=1)
            share, gap = nearest_on(path, v)
            met = (gap < reach) & np.isfinite(gap)
            first = np.argmax(met, axis=1)
            sooner = np.flatnonzero(met.any(axis=1) & (~gone[close] | (first <= when[close])))
            rows, first = close[sooner], first[sooner]
            low[rows] = before[rows, first]
            high[rows] = low[rows] + share[sooner, first] * (times[rows, first] - low[rows])
            when[rows], tip[rows], gone[rows] = first, self.tip_numbers[place], True
        return Exits(gone, low, high, when // parts, tip)

    def outside(self, number: int, points: FloatArray, tip: IntArray) -> BoolArray:
        """Whether points (n, 3) are off the piece, or within reach of the tip they are to come to."""
        out = np.asarray(self.body.piece(points)) != number
        for place, one in enumerate(self.tip_numbers):
            near = np.linalg.norm(points - self.tips[place], axis=-1) <= REACH * self.size
            out = np.where(tip == one, near, out)
        return np.asarray(out)

    def near_tips(self, states: FloatArray, long: FloatArray, near: float) -> BoolArray:
        """Whether rays may come nearer to a tip than that within a time (n,), as far as their tangents tell."""
        away, p = self.tips - states[:, None, X], states[:, P]
        along = np.clip(np.einsum("ntk,nk->nt", away, p), 0.0, long[:, None])
        gap = np.linalg.norm(away - along[..., None] * p[:, None], axis=2)
        return np.asarray(np.any(gap < near, axis=1))

    def to_tips(self, states: FloatArray) -> FloatArray:
        """Distance of rays from the nearest tip (n,), L."""
        return np.asarray(np.min(np.linalg.norm(self.tips - states[:, None, X], axis=2), axis=1, initial=np.inf))
