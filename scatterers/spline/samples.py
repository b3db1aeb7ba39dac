"""F at the nodes of a Cartesian grid: where the body lies, and that it is one closed body."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Samples:
    """F at the nodes of a grid.

    Attributes
    ----------
    values : (n0, n1, n2)
    origin, spacing : (3,), L
    """

    values: FloatArray
    origin: FloatArray
    spacing: FloatArray

    @property
    def far_corner(self) -> FloatArray:
        """The last node (3,), L."""
        return np.asarray(self.origin + (np.array(self.values.shape) - 1) * self.spacing)

    @property
    def inside(self) -> FloatArray:
        """Box (2, 3) of the nodes with F < 0, L."""
        index = np.nonzero(self.values < 0)
        corners = np.stack([np.array(index).min(1), np.array(index).max(1)])
        return np.asarray(self.origin + corners * self.spacing)

    def on_faces(self) -> FloatArray:
        """F at the nodes of the grid's faces: (n,)."""
        edge = np.ones(self.values.shape, dtype=bool)
        edge[1:-1, 1:-1, 1:-1] = False
        return np.asarray(self.values[edge])

    def middles(self) -> list[tuple[int, FloatArray]]:
        """Nodes with F < 0, and their middle, of each connected part, the largest first."""
        from scipy.ndimage import label

        parts, count = label(self.values < 0)
        where = [np.argwhere(parts == k + 1) for k in range(count)]
        found = [(len(w), self.origin + w.mean(0) * self.spacing) for w in where]
        return sorted(found, key=lambda pair: -pair[0])

    def has_cavity(self) -> bool:
        """Whether the nodes with F >= 0 are not connected."""
        from scipy.ndimage import label

        return int(label(self.values >= 0)[1]) > 1

    def crossings(self) -> FloatArray:
        """Points (n, 3), L, where edges of the grid cross the body, by linear interpolation."""
        return np.asarray(self.origin + edge_crossings(self.values) * self.spacing)


def edge_crossings(values: FloatArray) -> FloatArray:
    """Places (n, 3) in cells where values on a grid (n0, n1, n2) change sign along its edges, by linear interpolation.

    Nodes where they are not numbers take no part.
    """
    found = []
    for axis in range(3):
        last = values.shape[axis] - 1
        f, g = np.take(values, range(last), axis), np.take(values, range(1, last + 1), axis)
        crossed = ((f < 0) & (g >= 0)) | ((f >= 0) & (g < 0))
        index = np.argwhere(crossed).astype(float)
        index[:, axis] += f[crossed] / (f[crossed] - g[crossed])
        found.append(index)
    return np.concatenate(found)
