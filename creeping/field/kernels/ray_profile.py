"""Compiled plane curves with the curvature of a ray: cubics between nodes, their angle and position.

Beside a ray the layer sees its normal curvature only, so that waves are traced on the plane curve that has it. With
tangent (cos psi, sin psi), normal (sin psi, -cos psi) and the wave along the first axis,

    psi = int kappa ds,   d.x = int cos psi ds,   d.n = sin psi,   psi = 0, x = 0 at s = 0

Between two nodes kappa is the cubic through four nodes of the same piece; nodes that stand twice part the pieces.

Source: Derivations, F22.
"""

import numpy as np
from numba import njit

from creeping.kernels.block import strict_options

_x, _w = np.polynomial.legendre.leggauss(4)
NODES, WEIGHTS = tuple(float(x) for x in (_x + 1) / 2), tuple(float(w) for w in _w / 2)


@njit(**strict_options)
def cubics(s, values, out):
    """Coefficients out (m - 1, 4) of powers of s - s_i between nodes i and i + 1 of values (m,)."""
    m = len(s)
    begin = 0
    while begin < m:
        end = begin + 1
        while end < m and s[end] > s[end - 1]:
            end += 1
        for i in range(begin, end - 1):
            first = max(begin, min(i - 1, end - 4))
            # divided differences, then powers of s - s_i
            d = np.empty(4, values.dtype)
            for j in range(4):
                d[j] = values[first + j]
            for order in range(1, 4):
                for j in range(3, order - 1, -1):
                    d[j] = (d[j] - d[j - 1]) / (s[first + j] - s[first + j - order])
            p = np.zeros(4, values.dtype)
            p[0] = d[3]
            for j in range(2, -1, -1):
                shift = s[i] - s[first + j]
                for power in range(3, 0, -1):
                    p[power] = p[power] * shift + p[power - 1]
                p[0] = p[0] * shift + d[j]
            out[i] = p
        if end < m:
            out[end - 1] = 0.0
        begin = end


@njit(**strict_options)
def angle(c, psi, t):
    """Angle at t behind a node: psi + int of the cubic c."""
    return psi + t * (c[0] + t * (c[1] / 2 + t * (c[2] / 3 + t * c[3] / 4)))


@njit(**strict_options)
def displacement(c, psi, t):
    """Displacement (along, across) from a node to t behind it."""
    along, across = 0.0, 0.0
    for j in range(4):
        a = angle(c, psi, NODES[j] * t)
        along += WEIGHTS[j] * np.cos(a)
        across += WEIGHTS[j] * np.sin(a)
    return along * t, across * t


@njit(**strict_options)
def plane_curve(s, c, origin, curve):
    """Fill curve (m, 3) with psi and x at nodes; at the node ``origin`` they are 0."""
    m = len(s)
    curve[origin] = 0.0
    for i in range(origin, m - 1):
        t = s[i + 1] - s[i]
        along, across = displacement(c[i], curve[i, 0], t)
        curve[i + 1, 0] = angle(c[i], curve[i, 0], t)
        curve[i + 1, 1], curve[i + 1, 2] = curve[i, 1] + along, curve[i, 2] + across
    for i in range(origin - 1, -1, -1):
        t = s[i + 1] - s[i]
        # the cubic's angle at node i is that at i + 1 less its integral
        curve[i, 0] = curve[i + 1, 0] - angle(c[i], 0.0, t)
        along, across = displacement(c[i], curve[i, 0], t)
        curve[i, 1], curve[i, 2] = curve[i + 1, 1] - along, curve[i + 1, 2] - across


@njit(**strict_options)
def interval(s, at):
    """Interval that holds a place; at a joint the one ahead."""
    i = np.searchsorted(s, at, side="right") - 1
    i = max(0, min(i, len(s) - 2))
    # not between the two nodes of a joint
    while i > 0 and s[i + 1] <= s[i]:
        i -= 1
    return i


@njit(**strict_options)
def value(c, t):
    """Cubic at t."""
    return c[0] + t * (c[1] + t * (c[2] + t * c[3]))


@njit(**strict_options)
def sample(s, c, curve, at, out):
    """Fill out (n, 4) with kappa, psi and x at places (n,)."""
    for j in range(len(at)):
        i = interval(s, at[j])
        t = at[j] - s[i]
        out[j, 0] = value(c[i], t)
        out[j, 1] = angle(c[i], curve[i, 0], t)
        along, across = displacement(c[i], curve[i, 0], t)
        out[j, 2], out[j, 3] = curve[i, 1] + along, curve[i, 2] + across
