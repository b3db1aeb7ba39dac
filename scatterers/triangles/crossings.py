"""Pairs of triangles of a mesh that cross each other.

A segment pq crosses the triangle abc where the volumes [a b c p] and [a b c q] differ in sign and [p q a b],
[p q b c], [p q c a] do not; triangles cross if an edge of one crosses the other. Pairs that share a vertex are tried
with the edges opposite to it, pairs that share an edge only for being folded onto each other. Candidates come from a
sweep along one axis. Touching is no crossing, and overlapping parts of one plane are seen only by the edges around.

Sources: Derivations, B10.
"""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
KEPT = 1000
"""Pairs that are returned at most."""


def crossings(vertices: FloatArray, triangles: IntArray) -> tuple[int, IntArray]:
    """Number of pairs of triangles that cross, and the first of them, (k, 2).

    Parameters
    ----------
    vertices : (n, 3), near the origin
    triangles : (m, 3)

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [0.5, 0.5, -1], [0.5, 0.5, 1], [3, 3, 0]])
    >>> crossings(corners, np.array([[0, 1, 2], [3, 4, 5]]))[0]
    1
    """
    from scatterers.kernels.crossings import sweep

    corners = vertices[triangles]
    low, high = corners.min(axis=1), corners.max(axis=1)
    # along the axis on which the triangles are shortest, compared with the whole
    axis = int(np.argmin(np.mean(high - low, axis=0) / np.maximum(np.ptp(vertices, axis=0), 1e-300)))
    order = np.argsort(low[:, axis], kind="stable")
    turn = [axis, (axis + 1) % 3, (axis + 2) % 3]
    pairs = np.empty((KEPT, 2), np.int64)
    low, high, points = (np.ascontiguousarray(v[..., turn]) for v in (low[order], high[order], vertices))
    count = int(sweep(points, np.ascontiguousarray(triangles[order]), low, high, pairs))
    return count, order[pairs[: min(count, KEPT)]]
