"""Compiled polynomials along closed curves of equally spaced nodes, in Lagrange's form.

    f(u) = sum_j f_j prod_(i != j) (u - i)/(j - i),    i, j = -5 ... 6 nodes from the place's own cell, 0 <= u < 1

Sources: Derivations, R6.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import strict_options as options

AROUND = 6
"""Nodes on either side of a place that its polynomial goes through."""
_INVERSE = 1 / np.array(
    [(-1) ** (11 - j) * math.factorial(j) * math.factorial(11 - j) for j in range(2 * AROUND)], float
)
"""1/prod_(i != j) (j - i)."""


@njit(**options)
def interpolate(rows, first, number, places, out):
    """Rows (m, c) of nodes at places (k,), into out (k, c).

    The curve of a place starts at node ``first`` (k,) and has so many, ``number`` (k,).
    """
    weights, nodes = np.empty(2 * AROUND), np.empty(2 * AROUND, np.int64)
    for i in range(places.shape[0]):
        whole = math.floor(places[i])
        u, node = places[i] - whole + (AROUND - 1), (np.int64(whole) - (AROUND - 1)) % number[i]
        before = after = 1.0
        for j in range(2 * AROUND):
            weights[j], nodes[j] = before * _INVERSE[j], first[i] + node
            before *= u - j
            node = node + 1 if node + 1 < number[i] else 0
        for j in range(2 * AROUND - 1, -1, -1):
            weights[j] *= after
            after *= u - j
        for c in range(rows.shape[1]):
            total = 0.0
            for j in range(2 * AROUND):
                total += weights[j] * rows[nodes[j], c]
            out[i, c] = total
