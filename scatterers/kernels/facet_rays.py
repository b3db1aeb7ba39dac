"""Compiled count of the triangles that rays along z cross. Importing this module imports numba.

A triangle is crossed where its projection holds (x, y). On which side of a line through two corners a place is, is
asked of the corners in the order of their numbers, so that two triangles that share a side agree: a ray through a
side crosses one of them.

Compiled sweep and triangle test of `scatterers.triangles.topology`. Importing this module imports numba.

Sources: Derivations, B10.
"""

from pathlib import Path

from numba import njit

from creeping.kernels.cache import discard_stale

discard_stale(Path(__file__).parents[1], every=True)


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


@njit(cache=True, error_model="numpy")
def _volume(p, a, b, c):  # type: ignore[no-untyped-def]
    """Six times the volume of the tetrahedron, positive where p sees a, b, c clockwise."""
    x0, x1, x2 = a[0] - p[0], a[1] - p[1], a[2] - p[2]
    y0, y1, y2 = b[0] - p[0], b[1] - p[1], b[2] - p[2]
    z0, z1, z2 = c[0] - p[0], c[1] - p[1], c[2] - p[2]
    return x0 * (y1 * z2 - y2 * z1) + x1 * (y2 * z0 - y0 * z2) + x2 * (y0 * z1 - y1 * z0)


@njit(cache=True, error_model="numpy")
def _pierces(p, q, a, b, c, noise):  # type: ignore[no-untyped-def]
    """Whether the segment pq passes through the inside of abc."""
    above, below = _volume(p, a, b, c), _volume(q, a, b, c)
    if not ((above > noise and below < -noise) or (above < -noise and below > noise)):
        return False
    u, v, w = _volume(p, q, a, b), _volume(p, q, b, c), _volume(p, q, c, a)
    return (u > noise and v > noise and w > noise) or (u < -noise and v < -noise and w < -noise)


@njit(cache=True, error_model="numpy")
def _folded(a, b, c, d):  # type: ignore[no-untyped-def]
    """Whether the triangles abc and abd lie on the same side of ab, in one plane."""
    e0, e1, e2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    ee = e0 * e0 + e1 * e1 + e2 * e2
    c0, c1, c2 = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    d0, d1, d2 = d[0] - a[0], d[1] - a[1], d[2] - a[2]
    s, t = (c0 * e0 + c1 * e1 + c2 * e2) / ee, (d0 * e0 + d1 * e1 + d2 * e2) / ee
    # heights of c and d over the edge, as vectors
    c0, c1, c2 = c0 - s * e0, c1 - s * e1, c2 - s * e2
    d0, d1, d2 = d0 - t * e0, d1 - t * e1, d2 - t * e2
    cc, dd, cd = c0 * c0 + c1 * c1 + c2 * c2, d0 * d0 + d1 * d1 + d2 * d2, c0 * d0 + c1 * d1 + c2 * d2
    if not (cd > 0.0 and cc > 1e-20 * ee and dd > 1e-20 * ee):
        return False
    x0, x1, x2 = c1 * d2 - c2 * d1, c2 * d0 - c0 * d2, c0 * d1 - c1 * d0
    # at an angle below 1e-6 they lie on each other
    return x0 * x0 + x1 * x1 + x2 * x2 < 1e-12 * cc * dd


@njit(cache=True, error_model="numpy")
def _meet(vertices, s, t, noise):  # type: ignore[no-untyped-def]
    """Whether the triangles s and t cross."""
    shared, at_s, at_t, sum_s, sum_t = 0, 0, 0, 0, 0
    for i in range(3):
        for j in range(3):
            if s[i] == t[j]:
                shared, at_s, at_t = shared + 1, i, j
                sum_s, sum_t = sum_s + i, sum_t + j
    if shared >= 2:
        c, d = 3 - sum_s, 3 - sum_t
        return _folded(vertices[s[(c + 1) % 3]], vertices[s[(c + 2) % 3]], vertices[s[c]], vertices[t[d]])
    a, b, c = vertices[s[0]], vertices[s[1]], vertices[s[2]]
    d, e, f = vertices[t[0]], vertices[t[1]], vertices[t[2]]
    if shared == 1:
        p, q = vertices[s[(at_s + 1) % 3]], vertices[s[(at_s + 2) % 3]]
        u, v = vertices[t[(at_t + 1) % 3]], vertices[t[(at_t + 2) % 3]]
        return _pierces(p, q, d, e, f, noise) or _pierces(u, v, a, b, c, noise)
    if _pierces(a, b, d, e, f, noise) or _pierces(b, c, d, e, f, noise) or _pierces(c, a, d, e, f, noise):
        return True
    return _pierces(d, e, a, b, c, noise) or _pierces(e, f, a, b, c, noise) or _pierces(f, d, a, b, c, noise)


@njit(cache=True, error_model="numpy")
def sweep(vertices, triangles, low, high, pairs):  # type: ignore[no-untyped-def]
    """Count crossing pairs of triangles, sorted by low[:, 0], and keep the first of them."""
    found, n = 0, len(triangles)
    for i in range(n):
        top = high[i, 0]
        y0, y1, z0, z1 = low[i, 1], high[i, 1], low[i, 2], high[i, 2]
        for j in range(i + 1, n):
            if low[j, 0] > top:
                break
            if low[j, 1] > y1 or high[j, 1] < y0 or low[j, 2] > z1 or high[j, 2] < z0:
                continue
            size = max(top - low[i, 0], y1 - y0, z1 - z0, high[j, 0] - low[j, 0])
            size = max(size, high[j, 1] - low[j, 1], high[j, 2] - low[j, 2])
            # smaller volumes, in cubes of the pair's size, are rounding, and count as touching
            if _meet(vertices, triangles[i], triangles[j], 1e-13 * size * size * size):
                if found < len(pairs):
                    pairs[found, 0], pairs[found, 1] = i, j
                found += 1
    return found
