"""Where the incidences lie whose results are interpolated: lattices on a cut, a circle of directions, or on the sphere.

    d = h a + sqrt(1 - h^2) (cos u e1 + sin u e2)                     a cut, u its angle about a
    d = (e_f + tan u e_g + tan v e_h)/|...|,  |u|, |v| <= pi/4        six faces f of the sphere

A lattice has levels, of ever finer steps; all of it follows from the whole set of incidences, so that an incidence has
the same nodes in whatever task it is computed.

Sources: Derivations, F23.
"""

import math
from dataclasses import dataclass

import numpy as np

from creeping._typing import Any, FloatArray, IntArray

TURN = 96
"""Steps of the coarsest level in a whole turn: 0.065 rad."""
FINER = 2
"""Steps of a level in one of the level before."""
CROWDED = 3.0
"""Incidences that a cell of a level has, on average, for the level to pay."""
MOST_LEVELS = 6
BITS = 14
"""Binary digits of the numbers of nodes on the sphere."""
FLAT = 1e-9
"""Largest distance of the directions of a cut from its plane."""
HIGHEST = 0.999
"""Largest height of a cut: a narrower one is no circle worth the name."""
FEWEST = 24
"""Incidences from which on a lattice pays at all."""


@dataclass(frozen=True)
class Lattice:
    """Nodes among incidences.

    Attributes
    ----------
    axes : tuple
        Unit vectors (a, e1, e2) of a cut, none of the sphere.
    height : float
        h.
    levels : int
    crowding : float
        Incidences in a cell of the coarsest level, the mean of cells that have any.
    first : int
        Level with which to begin.
    """

    axes: tuple[tuple[float, float, float], ...]
    height: float
    levels: int
    crowding: float
    first: int = 0

    @property
    def dimensions(self) -> int:
        """1 or 2."""
        return 1 if self.axes else 2

    def step(self, level: int) -> float:
        """Step of a level, radians of u."""
        return float(2 * np.pi / (TURN * FINER**level))

    def spacing(self, level: int) -> float:
        """Largest angle between neighbouring nodes of a level, radians."""
        return self.step(level) * (math.sqrt(1 - self.height**2) if self.axes else 1.0)

    def crowded(self, level: int) -> float:
        """Incidences in a cell of a level, about."""
        return self.crowding / float(FINER ** (level * self.dimensions))

    def located(self, directions: FloatArray, level: int) -> tuple[IntArray, FloatArray]:
        """Cells (n, 1 + dimensions), the face and the number of the first node, and the place in them in [0, 1)."""
        if self.axes:
            _, first, second = np.array(self.axes)
            face = np.zeros(len(directions), dtype=np.int64)
            u = np.arctan2(directions @ second, directions @ first)[:, None]
        else:
            face = 2 * np.argmax(np.abs(directions), axis=1)
            rows, axis = np.arange(len(directions)), face // 2
            main = directions[rows, axis]
            face = face + (main < 0)
            # e_g, e_h follow e_f in the cycle x, y, z
            other = np.stack([directions[rows, (axis + 1) % 3], directions[rows, (axis + 2) % 3]], axis=1)
            u = np.arctan(other / np.abs(main)[:, None])
        place = u / self.step(level)
        number = np.floor(place)
        return np.concatenate([face[:, None], number.astype(np.int64)], axis=1), place - number

    def directions(self, nodes: IntArray | FloatArray, level: int) -> FloatArray:
        """Unit directions of nodes (n, 1 + dimensions), the face and numbers, or of places between: (n, 3)."""
        u = nodes[:, 1:] * self.step(level)
        if self.axes:
            axis, first, second = np.array(self.axes)
            across = np.sqrt(1 - self.height**2)
            d = self.height * axis + across * (np.cos(u) * first + np.sin(u) * second)
        else:
            face = nodes[:, 0].astype(np.int64)
            rows, axis = np.arange(len(nodes)), face // 2
            d = np.empty((len(nodes), 3))
            d[rows, axis] = np.where(face % 2, -1.0, 1.0)
            d[rows, (axis + 1) % 3], d[rows, (axis + 2) % 3] = np.tan(u).T
        return np.asarray(d / np.linalg.norm(d, axis=1, keepdims=True))

    def order(self, directions: FloatArray) -> IntArray:
        """Order of unit directions (n, 3) in which those of one cell follow each other, at every level: (n,).

        A task has few cells then, and their nodes serve it alone. On a cut it is that of the directions, which
        follow each other as they are.
        """
        if self.axes:
            return np.arange(len(directions))
        cells, _ = self.located(directions, self.levels - 1)
        numbers, key = cells[:, 1:] + TURN * FINER**MOST_LEVELS, np.zeros(len(directions), dtype=np.int64)
        for bit in range(BITS):
            for axis in range(2):
                key |= ((numbers[:, axis] >> bit) & 1) << (2 * bit + axis)
        return np.lexsort((key, cells[:, 0]))

    def wrapped(self, nodes: IntArray, level: int) -> IntArray:
        """Nodes with those that are one numbered alike: a cut closes after a turn."""
        if not self.axes:
            return nodes
        return np.stack([nodes[:, 0], nodes[:, 1] % (TURN * FINER**level)], axis=1)


def lattice_of(directions: FloatArray) -> Lattice | None:
    """Lattice that pays for unit directions (n, 3), none if they are too few or too far apart.

    Examples
    --------
    >>> turn = np.radians(np.arange(0, 360, 0.1))
    >>> cut = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    >>> lattice_of(cut).levels, lattice_of(cut[::40])
    (4, None)
    """
    if len(directions) < FEWEST:
        return None
    for axes, height in (*_circle(directions), ((), 0.0)):
        found = Lattice(axes, height, MOST_LEVELS, 0.0)
        crowding = [
            len(directions) / len(np.unique(found.located(directions, level)[0], axis=0))
            for level in range(MOST_LEVELS)
        ]
        levels = next((level for level, mean in enumerate(crowding) if mean < CROWDED), MOST_LEVELS)
        if levels:
            return Lattice(axes, height, levels, round(crowding[0], 3))
    return None


def _circle(directions: FloatArray) -> list[tuple[Any, float]]:
    """Axes and height of the circle on which all directions lie, if there is one."""
    normal = np.linalg.svd(directions - directions.mean(axis=0), full_matrices=False)[2][2]
    # digits that another machine has too, and one of both signs
    normal = np.round(normal * np.sign(normal[np.argmax(np.abs(normal))]), 10)
    normal /= np.linalg.norm(normal)
    heights = directions @ normal
    height = float(np.round(heights.mean(), 12))
    if np.max(np.abs(heights - height)) > FLAT or abs(height) > HIGHEST:
        return []
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    first /= np.linalg.norm(first)
    axes = tuple((float(x), float(y), float(z)) for x, y, z in (normal, first, np.cross(normal, first)))
    return [(axes, height)]
