"""Compiled count of the triangles that rays along z cross. Importing this module imports numba.

A triangle is crossed where its projection holds (x, y). On which side of a line through two corners a place is, is
asked of the corners in the order of their numbers, so that two triangles that share a side agree: a ray through a
side crosses one of them.
"""

from pathlib import Path

from numba import njit

from scatterers.kernels.cache import discard_stale

discard_stale(Path(__file__).parents[1])


@njit(cache=True, error_model="numpy")
def _left_of(vertices, a, b, x, y):  # type: ignore[no-untyped-def]
    """Whether (x, y) is to the left of the line from corner a to corner b."""
    turn = a > b
    i, j = (b, a) if turn else (a, b)
    across = (vertices[j, 0] - vertices[i, 0]) * (y - vertices[i, 1])
    across -= (vertices[j, 1] - vertices[i, 1]) * (x - vertices[i, 0])
    return (across > 0.0) != turn


@njit(cache=True, error_model="numpy")
def crossed(points, vertices, triangles, starts, members, low, step, counts, least, most):  # type: ignore[no-untyped-def]
    """Fill counts (m,) of triangles above points (m, 3), up to ``most`` of each, at least ``least`` above it.

    Parameters
    ----------
    vertices : (n, 3)
    triangles : (t, 3)
    starts : (g g + 1,), members : (pairs,)
        Triangles whose box meets each of g x g cells of the plane: members[starts[c]:starts[c + 1]].
    low, step : (2,)
        Corner and sides of the cells.
    """
    g = int((starts.shape[0] - 1) ** 0.5 + 0.5)
    for i in range(points.shape[0]):
        x, y, z = points[i]
        column, row = int((x - low[0]) / step[0]), int((y - low[1]) / step[1])
        counts[i] = 0
        if x < low[0] or y < low[1] or column >= g or row >= g:
            continue
        cell = column * g + row
        for at in range(starts[cell], starts[cell + 1]):
            a, b, c = triangles[members[at]]
            left = _left_of(vertices, a, b, x, y)
            if _left_of(vertices, b, c, x, y) != left or _left_of(vertices, c, a, x, y) != left:
                continue
            u0, u1 = vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1]
            v0, v1 = vertices[c, 0] - vertices[a, 0], vertices[c, 1] - vertices[a, 1]
            area = u0 * v1 - u1 * v0
            if area == 0.0:
                continue
            p, q = x - vertices[a, 0], y - vertices[a, 1]
            s, t = (p * v1 - q * v0) / area, (u0 * q - u1 * p) / area
            top = vertices[a, 2] + s * (vertices[b, 2] - vertices[a, 2]) + t * (vertices[c, 2] - vertices[a, 2])
            if top > z + least:
                counts[i] += 1
                if counts[i] >= most:
                    break
