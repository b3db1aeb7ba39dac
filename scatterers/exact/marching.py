"""Closed triangulation of F = 0 by tetrahedra: each cube of a grid is cut into six along its diagonal.

Where F changes its sign along an edge of a tetrahedron the place is found by halving, so that F needs to be continuous
only. A tetrahedron with one node of its own sign gives a triangle, one with two gives two.
"""

from collections.abc import Callable
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
MOST = 20_000_000
"""Nodes of the largest grid."""
HALVINGS = 50
# corners of the six tetrahedra of a cube, as steps from its first node
STEPS = np.array(
    [
        np.cumsum([np.zeros(3, dtype=np.int64), *(np.eye(3, dtype=np.int64)[list(p)])], axis=0)
        for p in permutations(range(3))
    ]
)


def march(level: Callable[[FloatArray], FloatArray], box: FloatArray, spacing: float) -> tuple[FloatArray, IntArray]:
    """Points (n, 3), L, on F = 0 inside a box (2, 3) and triangles (m, 3), counter-clockwise from outside.

    Raises
    ------
    ValueError
        If the grid is too large, or F has no sign change on it.
    """
    side = box[1] - box[0]
    if np.prod(side / spacing + 4) > MOST:
        raise ValueError(f"tiles of this size ask for a grid of more than {MOST} nodes; make them larger")
    # the shift keeps nodes off planes of symmetry, where F is often exactly 0
    origin = box[0] - (1 + 0.1 * np.sqrt([2.0, 3.0, 5.0])) * spacing
    axes = [origin[k] + spacing * np.arange(int(side[k] / spacing) + 4) for k in range(3)]
    planes = [level(np.stack(np.broadcast_arrays(x, axes[1][:, None], axes[2]), axis=-1)) for x in axes[0]]
    inside = np.stack(planes) < 0
    corners = [inside[i : i - 1 or None, j : j - 1 or None, k : k - 1 or None] for i, j, k in np.ndindex(2, 2, 2)]
    total = np.sum(corners, axis=0)
    cubes = np.argwhere((total > 0) & (total < 8))
    if not len(cubes):
        raise ValueError("F has no sign change in its box: no body, or tiles larger than it")
    nodes = (cubes[:, None, None] + STEPS).reshape(-1, 4, 3)
    number = np.asarray(np.ravel_multi_index(tuple(np.moveaxis(nodes, -1, 0)), inside.shape), dtype=np.int64)
    below = inside.ravel()[number]
    count = below.sum(axis=1)
    triangles = []
    for wanted in (1, 2, 3):
        mine = count == wanted
        # nodes inside first
        order = np.argsort(~below[mine], axis=1, kind="stable")
        sorted_nodes = np.take_along_axis(number[mine], order, axis=1)
        triangles.append(_cut(sorted_nodes, wanted))
    ends = np.concatenate(triangles)
    pairs, found = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    places = [np.stack(np.unravel_index(end, inside.shape), axis=-1) for end in pairs.T]
    points = _crossings(level, *(origin + spacing * place for place in places))
    corners_of = found.reshape(-1, 3)
    return points, _turned(points, corners_of, ends, origin, spacing, inside.shape)


def _cut(nodes: IntArray, inside: int) -> IntArray:
    """Triangles (m, 3, 2), each corner by the nodes inside and outside between which it lies."""
    a, b, c, d = nodes.T
    if inside == 1:
        corners = [[(a, b), (a, c), (a, d)]]
    elif inside == 3:
        corners = [[(a, d), (b, d), (c, d)]]
    else:
        corners = [[(a, c), (a, d), (b, d)], [(a, c), (b, d), (b, c)]]
    return np.concatenate([np.stack([np.stack(pair, axis=-1) for pair in three], axis=1) for three in corners])


def _crossings(level: Callable[[FloatArray], FloatArray], inner: FloatArray, outer: FloatArray) -> FloatArray:
    """Zeros of F between points inside and outside, by halving."""
    low, high = np.zeros(len(inner)), np.ones(len(inner))
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        inside = level(inner + middle[:, None] * (outer - inner)) < 0
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return np.asarray(inner + (0.5 * (low + high))[:, None] * (outer - inner))


def _turned(
    points: FloatArray, triangles: IntArray, ends: IntArray, origin: FloatArray, spacing: float, shape: tuple[int, ...]
) -> IntArray:
    """Triangles turned so that their normals point to the nodes outside."""
    inner, outer = (np.stack(np.unravel_index(ends[..., k], shape), axis=-1).mean(axis=1) for k in range(2))
    # by the middles of the grid's edges: a triangle may be a sliver, what it would be without interpolation is none
    middle = np.stack(np.unravel_index(ends, shape), axis=-1).mean(axis=2)
    normal = np.cross(middle[:, 1] - middle[:, 0], middle[:, 2] - middle[:, 0])
    back = np.sum(normal * (outer - inner), axis=-1) < 0
    return np.where(back[:, None], triangles[:, ::-1], triangles)
