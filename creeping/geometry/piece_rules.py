"""Which triangles a body of smooth pieces is tiled by and how many points they have: the cheapest that resolve a rate.

As `creeping.geometry.tile_rules` of smooth bodies: many points on few triangles cost least where the rate asks for
them, few points where triangles must be small for the body's sake. The integral of n, 0 over a closed surface, tells
how small: it is made less until it is CLOSED, or, where the pieces do not meet any better, until it does not get less.

Sources: [DR84, sec. 2.7]; Derivations, B11.
"""

from collections.abc import Callable

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping.geometry.creased import tiles_of
from creeping.geometry.surface import size
from creeping.geometry.tile_rules import points_for

POINTS = (3, 4, 5, 6)
"""Points of Gauss's rule along a side of a triangle."""
LONGEST = 0.2
"""Longest sides, in body sizes."""
SMALLER = 3.7
"""Triangles of bodies over the square of their longest sides."""
LADDER, RUNGS = 1.1, 4
"""Ratio of the sides that are taken: neighbouring rates have one rule; and by how many they are shorter where the
integral of n is too large."""
CLOSED, OPEN = 1e-4, 1e-3
"""Integral of n, as a share of the area, that is small enough, and beyond which pieces do not make a closed body."""
LESS = 0.5
"""Ratio by which it must become less with shorter sides to become less at all."""
NEARLY = 0.9
"""Share of triangles that were counted that there are at least with other sides."""
MOST_NODES = 3_000_000
"""Most nodes."""
KEPT = 4
"""Rules kept with a body."""


class PieceRules:
    """Rules of a body of pieces, those kept, and which of them close.

    ``make`` turns body, sides, L, and points into nodes (`creeping.geometry.quadrature.BodyNodes`).
    """

    def __init__(self, body: Any, make: Callable[[Any, float, int], Any]) -> None:
        self._make = make
        self._rules: dict[tuple[int, int], Any] = {}
        self._area = float(np.sum(tiles_of(body, LONGEST).areas)) / size(body) ** 2
        # of each number of points the longest sides that may close, those that do, and what longer ones left
        self._rung = dict.fromkeys(POINTS, _rung(LONGEST))
        self._counts: dict[tuple[int, int], int] = {}
        self._tiles: dict[int, int] = {}
        self._left = dict.fromkeys(POINTS, np.inf)

    def rule(self, body: Any, rate: float) -> tuple[int, int, int]:
        """Rung of the sides, points along a side, and the number of nodes, for a rate, 1/L.

        More than MOST_NODES if that takes as many, or nothing closes.
        """
        while self._rung:
            few = list(self._rung)
            rungs = np.array([min(self._rung[p], _rung(2 * _HALVES[p] / (rate * size(body)))) for p in few])
            least = self._least_tiles(rungs) * np.square(few)
            counts = [self._counts.get((int(r), p), int(n)) for r, p, n in zip(rungs, few, least, strict=True)]
            best = int(np.argmin(counts))
            rung, points, count = int(rungs[best]), few[best], counts[best]
            if count > MOST_NODES or (rung, points) in self._counts:
                return rung, points, count
            nodes = self.nodes(body, rung, points)
            self._tiles[rung] = len(nodes.points) // points**2
            error, same = nodes.error, nodes.error > LESS * self._left[points]
            if error <= CLOSED or (error <= OPEN and same):
                # more than their sides tell, where the body bends
                self._counts[rung, points] = len(nodes.points)
            elif same:
                del self._rung[points]
            else:
                self._rung[points], self._left[points] = rung - RUNGS, error
        return 0, 0, MOST_NODES + 1

    def _least_tiles(self, rungs: IntArray) -> FloatArray:
        """Triangles that there are at least: for the area, and where others were counted, by their number.

        A body of many small pieces has more than its area asks for. Of shorter sides there are as many, of longer ones
        fewer by the square, or nearly.
        """
        least = self._area / _sides(rungs) ** 2 * SMALLER
        for rung, count in self._tiles.items():
            least = np.maximum(least, NEARLY * count * np.minimum(1.0, (_sides(rung) / _sides(rungs)) ** 2))
        return np.asarray(least)

    def nodes(self, body: Any, rung: int, points: int) -> Any:
        """Nodes of a rule, kept; the last one used stands last."""
        key = rung, points
        side = float(_sides(rung)) * size(body)
        made = self._rules.pop(key) if key in self._rules else self._make(body, side, points)
        self._rules[key] = made
        while len(self._rules) > KEPT:
            self._rules.pop(next(iter(self._rules)))
        return made


def _rung(share: float) -> int:
    """That of the longest sides up to a share of the body's size, no longer than LONGEST."""
    return int(np.floor(np.log(min(share, LONGEST)) / np.log(LADDER)))


def _sides(rung: Any) -> FloatArray:
    """Sides, in body sizes."""
    return np.asarray(LADDER ** np.asarray(rung, dtype=float))


_HALVES = {p: float(max(half for half in np.arange(0.05, 20.0, 0.05) if points_for(half) <= p)) for p in POINTS}
"""Half the phase along a side up to which so many points do."""
