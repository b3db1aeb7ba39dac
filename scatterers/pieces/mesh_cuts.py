"""A mesh cut at points of its edges: triangles with such edges fall into two, three or four.

Sources: Derivations, B13.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scatterers.triangles.topology import edges_of

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Cuts:
    """Where edges are cut.

    Attributes
    ----------
    edge : (k,)
        In the order of `scatterers.triangles.topology.edges_of`.
    points : (k, 3), L
    held : (k, p) bool
        Which sheets hold the points.
    """

    edge: IntArray
    points: FloatArray
    held: BoolArray


def cut(
    vertices: FloatArray, triangles: IntArray, held: BoolArray, cuts: Cuts
) -> tuple[FloatArray, IntArray, BoolArray]:
    """Vertices, triangles, and which sheets hold each vertex, of the mesh with more vertices on its edges.

    Parameters
    ----------
    vertices, triangles : (n, 3), L, and (m, 3)
    held : (n, p) bool
    cuts : Cuts

    Examples
    --------
    >>> corners, triangles = np.eye(3), np.array([[0, 1, 2]])
    >>> cuts = Cuts(np.array([0, 1]), np.array([[0.5, 0.5, 0], [0.5, 0, 0.5]]), np.zeros((2, 1), dtype=bool))
    >>> cut(corners, triangles, np.zeros((3, 1), dtype=bool), cuts)[1].tolist()
    [[0, 3, 4], [3, 1, 4], [1, 2, 4]]
    """
    edges = edges_of(triangles)
    new = np.full(len(edges.ends), -1)
    new[cuts.edge] = len(vertices) + np.arange(len(cuts.edge))
    # on the edges that follow the corners
    between = new[edges.number].reshape(-1, 3)
    count = (between >= 0).sum(axis=1)
    parts = [triangles[count == 0]]
    for number in (1, 2, 3):
        t, m = triangles[count == number].copy(), between[count == number].copy()
        for _ in range(2):
            # turned until the first edge is cut, of two cuts the last as well
            wrong = (m[:, 0] < 0) | ((m[:, 2] < 0) & (number == 2))
            t[wrong], m[wrong] = np.roll(t[wrong], -1, axis=1), np.roll(m[wrong], -1, axis=1)
        (a, b, c), (ab, bc, ca) = t.T, m.T
        split = {
            1: [(a, ab, c), (ab, b, c)],
            2: [(a, ab, ca), (ab, b, ca), (b, c, ca)],
            3: [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)],
        }[number]
        parts += [np.stack(part, axis=1) for part in split]
    return np.concatenate([vertices, cuts.points]), np.concatenate(parts), np.concatenate([held, cuts.held])
