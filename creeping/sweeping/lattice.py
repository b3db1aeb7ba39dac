"""Where the incidences of a cut lie whose results are interpolated: nodes on its circle of directions.

    d = h a + sqrt(1 - h^2) (cos u e1 + sin u e2),   u the angle about the axis a of the cut

A lattice has levels, of ever finer steps of u; all of it follows from the whole set of incidences, so that an incidence
has the same nodes in whatever task it is computed.

Incidences all over the sphere are computed one by one: at 1e4 and 3e4 of them no cell of a lattice in two dimensions
served (ellipsoid, k = 20), at 1e5 it took a quarter longer than rays, and ten times what the T-matrix takes.

Sources: Derivations, F23.
"""

from dataclasses import dataclass

import numpy as np

from creeping._typing import FloatArray, IntArray

TURN = 96
"""Steps of the coarsest level in a whole turn: 0.065 rad."""
FINER = 2
"""Steps of a level in one of the level before."""
CROWDED = 3.0
"""Incidences for each node of a level for it to pay: a node costs 1.6 incidences, an interpolated one 0.15."""
MOST_LEVELS = 6
Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Lattice:
    """Nodes among the incidences of a cut.

    Attributes
    ----------
    axes : tuple
        Unit vectors (a, e1, e2).
    height : float
        h.
    levels : int
    """

    axes: tuple[Vector, Vector, Vector]
    height: float
    levels: int

    def step(self, level: int) -> float:
        """Step of a level, radians of u."""
        return float(2 * np.pi / (TURN * FINER**level))

    def spacing(self, level: int) -> float:
        """Angle between neighbouring nodes of a level, radians."""
        return self.step(level) * float(np.sqrt(1 - self.height**2))

    def located(self, directions: FloatArray, level: int) -> tuple[IntArray, FloatArray]:
        """Numbers of the cells that hold unit directions (n, 3), which are those of their first nodes, and places.

        Places are in [0, 1).
        """
        _, first, second = np.array(self.axes)
        place = np.arctan2(directions @ second, directions @ first) / self.step(level)
        number = np.floor(place)
        return number.astype(np.int64), place - number

    def directions(self, nodes: IntArray | FloatArray, level: int) -> FloatArray:
        """Unit directions of nodes (n,), or of places between: (n, 3)."""
        axis, first, second = np.array(self.axes)
        u = np.asarray(nodes)[:, None] * self.step(level)
        d = self.height * axis + np.sqrt(1 - self.height**2) * (np.cos(u) * first + np.sin(u) * second)
        return np.asarray(d / np.linalg.norm(d, axis=1, keepdims=True))

    def wrapped(self, nodes: IntArray, level: int) -> IntArray:
        """Nodes with those that are one numbered alike: a cut closes after a turn."""
        return np.asarray(nodes % (TURN * FINER**level))


def lattice_of(directions: FloatArray) -> Lattice | None:
    """Lattice that pays for unit directions (n, 3), none if they are no cut, too few, or too far apart.

    Examples
    --------
    >>> turn = np.radians(np.arange(0, 360, 0.1))
    >>> cut = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    >>> lattice_of(cut).levels, lattice_of(cut[::40])
    (4, None)
    """
    # nodes of a stencil beyond its cell's own
    ends = 5
    if len(directions) < CROWDED * (1 + ends):
        return None
    normal = np.linalg.svd(directions - directions.mean(axis=0), full_matrices=False)[2][2]
    # digits that another machine has too, and one of both signs
    normal = np.round(normal * np.sign(normal[np.argmax(np.abs(normal))]), 10)
    normal /= np.linalg.norm(normal)
    heights = directions @ normal
    height = float(np.round(heights.mean(), 12))
    # in a plane to rounding, and not so high that it is no circle worth the name
    if np.max(np.abs(heights - height)) > 1e-9 or abs(height) > 0.999:
        return None
    first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    first /= np.linalg.norm(first)
    axes = [(float(x), float(y), float(z)) for x, y, z in (normal, first, np.cross(normal, first))]
    whole = Lattice((axes[0], axes[1], axes[2]), height, MOST_LEVELS)
    cells = [len(np.unique(whole.located(directions, level)[0])) for level in range(MOST_LEVELS)]
    pays = [len(directions) >= CROWDED * (count + ends) for count in cells]
    levels = pays.index(False) if False in pays else MOST_LEVELS
    return Lattice(whole.axes, height, levels) if levels else None
