"""Compiled first steps of a shadow line: mixed triangles of a mesh, and the walk around them.

s = n.q at the vertices, q = d + w x (`creeping.geometry.incident`). A triangle with vertices of both signs has one edge
that goes from + to - counter-clockwise: leaving by it keeps the lit side on the left, and ends where it began, so
components come out closed and oriented.

Sources: Derivations, R6.
"""

from numba import njit

from creeping.kernels.block import strict_options as options

TOO_MANY = -1


@njit(**options)
def incidence_at(vertices, normals, wave, s):
    """Fill s (n,) with n.q from vertices (3, n) and normals (3, n), flat, and return nothing."""
    n = s.shape[0]
    dx, dy, dz, w = wave[0], wave[1], wave[2], wave[3]
    x, y, z = vertices[0], vertices[1], vertices[2]
    for i in range(n):
        s[i] = normals[i] * (dx + w * x[i]) + normals[n + i] * (dy + w * y[i]) + normals[2 * n + i] * (dz + w * z[i])


@njit(**options)
def mixed_triangles(s, triangles, lit, found):
    """List triangles with vertices of both signs in ``found``; returns their number. lit (n,) is work space."""
    for i in range(s.shape[0]):
        lit[i] = s[i] < 0.0
    count = 0
    for t in range(triangles.shape[0]):
        some = lit[triangles[t, 0]] + lit[triangles[t, 1]] + lit[triangles[t, 2]]
        found[count] = t
        # no branch: about one triangle in thirty is mixed, at places that cannot be predicted
        count += (some == 1) | (some == 2)
    return count


@njit(**options)
def walk(s, vertices, triangles, neighbours, found, count, stamp, number, nodes, starts):
    """Walk all components; nodes (3, cap) on the crossed edges, ``starts`` of the components and their end.

    ``stamp`` (triangles,) holds the number of the incidence that passed last. Returns the components, or TOO_MANY.
    """
    total, components, cap = 0, 0, nodes.shape[1]
    starts[0] = 0
    for k in range(count):
        first = found[k]
        if stamp[first] == number:
            continue
        if components + 1 == starts.shape[0]:
            return TOO_MANY
        t = first
        while stamp[t] != number:
            stamp[t] = number
            edge = 0
            for e in range(3):
                if s[triangles[t, e]] >= 0.0 and s[triangles[t, (e + 1) % 3]] < 0.0:
                    edge = e
            i, j = triangles[t, edge], triangles[t, (edge + 1) % 3]
            share = s[i] / (s[i] - s[j])
            if total == cap:
                return TOO_MANY
            for axis in range(3):
                nodes[axis, total] = vertices[axis, i] + share * (vertices[axis, j] - vertices[axis, i])
            total += 1
            t = neighbours[t, edge]
        components += 1
        starts[components] = total
    return components
