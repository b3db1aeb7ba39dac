"""Compiled sums over currents J at nodes y of a conductor of what they send to points x of its surface.

    J(x) = 2 sum_y h n_x x (g x J_y),   g = (y - x)/R (1/R - ik) e^{ikR}/R,   R = |y - x|
    patch  S = sum_y chi w K_y,  T = sum_y chi w [(y - x) n_y + n_x.(y - x) 1]/R^3,   chi = e^{-(R/a)^2}

h is 1, or 1 - e^{-(kR)^2} for nodes that do not share the phase of x; a node that is x itself gives nothing. -T J_x is
the static part of what nodes next to x send there if the current is J_x all around, since n_x.J_y = -n_y.J_x to first
order: g (n_x.J_y) - J_y (n_x.g). K_y is the shape operator, which may
jump beside x.

Source: Derivations, F32.
"""

import math

import numpy as np
from numba import njit

from creeping.field.kernels.bounce import crossed_sum
from creeping.kernels.block import entry_options, options
from creeping.kernels.turns import cosine_sine

TOUCHING = 1e-6
"""Distance, over 1/k, below which a node is the point itself."""
PART = 256
"""Nodes whose gradients are held at a time."""
TOGETHER = 16
"""Points that are summed at while their nodes are at hand."""


@njit(**options)
def _gradients(at, y, alike, first, last, k, near, out):
    """Fill out (5, ...) with h g of nodes first..last: the direction from a point to each, then the complex factor."""
    per, close, least = k / (2 * math.pi), near * near, (TOUCHING / k) ** 2
    nearby = 0
    for i in range(first, last):
        dx, dy, dz = y[0, i] - at[0], y[1, i] - at[1], y[2, i] - at[2]
        square = dx * dx + dy * dy + dz * dz
        inverse = 1.0 / math.sqrt(max(square, least))
        nearby += 1 if square <= close else 0
        c, s = cosine_sine(per / inverse)
        j = i - first
        out[0, j], out[1, j], out[2, j] = dx * inverse, dy * inverse, dz * inverse
        out[3, j], out[4, j] = inverse * (c * inverse + s * k), inverse * (s * inverse - c * k)
    if nearby == 0:
        return
    for i in range(first, last):
        dx, dy, dz = y[0, i] - at[0], y[1, i] - at[1], y[2, i] - at[2]
        square = dx * dx + dy * dy + dz * dz
        if square > close:
            continue
        h = 1.0 if alike[i] else 1.0 - math.exp(-square * k * k)
        h = 0.0 if square <= least else h
        out[3, i - first] *= h
        out[4, i - first] *= h


@njit(**entry_options)
def vectors_from_nodes(x, normals, y, alike, currents, k, near, first, last, out):
    """Fill rows first..last of out (m, p, 6), real and imaginary part of J of p waves, at points x (3, m).

    ``normals`` (3, m) are those of the points, ``currents`` (p, 6, n) J dS/4 pi at the nodes y (3, n), real parts of
    its components first; ``alike`` (n,) matters up to the distances ``near`` (m,).
    """
    n, waves = y.shape[1], currents.shape[0]
    g, total = np.empty((5, PART)), np.empty((TOGETHER, waves, 6))
    for top in range(first, last, TOGETHER):
        bottom = min(top + TOGETHER, last)
        total[:] = 0.0
        for start in range(0, n, PART):
            end = min(start + PART, n)
            for j in range(top, bottom):
                _gradients((x[0, j], x[1, j], x[2, j]), y, alike, start, end, k, near[j], g)
                for q in range(waves):
                    part = crossed_sum(g, currents[q], start, end)
                    for c in range(6):
                        total[j - top, q, c] += part[c]
        for j in range(top, bottom):
            n0, n1, n2 = normals[0, j], normals[1, j], normals[2, j]
            for q in range(waves):
                for c in (0, 3):
                    h0, h1, h2 = total[j - top, q, c], total[j - top, q, c + 1], total[j - top, q, c + 2]
                    out[j, q, c] = 2.0 * (n1 * h2 - n2 * h1)
                    out[j, q, c + 1] = 2.0 * (n2 * h0 - n0 * h2)
                    out[j, q, c + 2] = 2.0 * (n0 * h1 - n1 * h0)


@njit(**entry_options)
def patches(x, normals, y, sides, weights, shapes, alike, reach, least, near, first, last, out):
    """Fill rows first..last of out (m, 15): S and T row by row, of nodes y (3, n) that are alike, normals ``sides``.

    S is xx, yy, zz, yz, xz, xy, as ``shapes`` (6, n) of the nodes. Those nearer than ``least`` are x itself; chi of
    width ``reach`` (m,) counts up to the distances ``near`` (m,).
    """
    touching = least * least
    for j in range(first, last):
        wide, close = 1.0 / reach[j] ** 2, near[j] ** 2
        x0, x1, x2 = x[0, j], x[1, j], x[2, j]
        out[j] = 0.0
        for i in range(y.shape[1]):
            dx, dy, dz = y[0, i] - x0, y[1, i] - x1, y[2, i] - x2
            square = dx * dx + dy * dy + dz * dz
            if square > close or not alike[i]:
                continue
            chi = math.exp(-square * wide) * weights[i]
            for c in range(6):
                out[j, c] += chi * shapes[c, i]
            if square <= touching:
                continue
            chi /= square * math.sqrt(square)
            lean = chi * (normals[0, j] * dx + normals[1, j] * dy + normals[2, j] * dz)
            for b in range(3):
                side = chi * sides[b, i]
                out[j, 6 + b] += dx * side
                out[j, 9 + b] += dy * side
                out[j, 12 + b] += dz * side
                out[j, 6 + 4 * b] += lean
