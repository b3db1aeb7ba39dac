"""Cells, weights and slopes of uniform B-splines for a block of rays; the numpy home is `creeping.phaseflow.splines`.

Weights of the B-splines of degree p at fraction t of a cell, w_j = N_p(t + p - j), in closed form:

    p = 3   6 w = (1-t)^3, 4 - 6 t^2 + 3 t^3, mirror images
    p = 5   120 w = (1-t)^5, 26 - 50 t + 20 t^2 + 20 t^3 - 20 t^4 + 5 t^5, 66 - 60 t^2 + 30 t^4 - 10 t^5, mirror images

Loops run over a whole block on flat arrays, so that they vectorise.

Sources: [B78]; Derivations, B7.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import BLOCK, options


@njit(**options)
def cells_and_fractions(grid, last, cell):
    """Split grid coordinates (BLOCK,) into cells held in 0..last and, in place, fractions.

    A coordinate that is not a number gets cell 0: whatever the state, the stencil lies inside the table.
    """
    for i in range(BLOCK):
        t = grid[i]
        t = t if t > 0.0 else 0.0
        t = t if t < last else last
        c = math.floor(t)
        cell[i] = np.int64(c)
        grid[i] -= c


@njit(**options)
def weights(t, degree, w):
    """Fill w (degree + 1, BLOCK), flat, with the B-spline weights at fractions t (BLOCK,)."""
    if degree == 3:
        for i in range(BLOCK):
            a, b = t[i], 1.0 - t[i]
            w[i] = b * b * b * (1 / 6)
            w[BLOCK + i] = (4.0 - a * a * (6.0 - 3.0 * a)) * (1 / 6)
            w[2 * BLOCK + i] = (4.0 - b * b * (6.0 - 3.0 * b)) * (1 / 6)
            w[3 * BLOCK + i] = a * a * a * (1 / 6)
    else:
        for i in range(BLOCK):
            a, b = t[i], 1.0 - t[i]
            aa, bb = a * a, b * b
            w[i] = bb * bb * b * (1 / 120)
            w[BLOCK + i] = (26.0 + a * (-50.0 + a * (20.0 + a * (20.0 + a * (5.0 * a - 20.0))))) * (1 / 120)
            w[2 * BLOCK + i] = (66.0 + aa * (-60.0 + aa * (30.0 - 10.0 * a))) * (1 / 120)
            w[3 * BLOCK + i] = (66.0 + bb * (-60.0 + bb * (30.0 - 10.0 * b))) * (1 / 120)
            w[4 * BLOCK + i] = (26.0 + b * (-50.0 + b * (20.0 + b * (20.0 + b * (5.0 * b - 20.0))))) * (1 / 120)
            w[5 * BLOCK + i] = aa * aa * a * (1 / 120)


@njit(**options)
def slopes(t, w):
    """Derivatives of the quintic B-spline weights at fractions t (BLOCK,) into w (6, BLOCK), flat."""
    for i in range(BLOCK):
        a, b = t[i], 1.0 - t[i]
        aa, bb = a * a, b * b
        w[i] = -bb * bb * (1 / 24)
        w[BLOCK + i] = (-10.0 + a * (8.0 + a * (12.0 + a * (5.0 * a - 16.0)))) * (1 / 24)
        w[2 * BLOCK + i] = a * (-24.0 + aa * (24.0 - 10.0 * a)) * (1 / 24)
        w[3 * BLOCK + i] = -b * (-24.0 + bb * (24.0 - 10.0 * b)) * (1 / 24)
        w[4 * BLOCK + i] = -(-10.0 + b * (8.0 + b * (12.0 + b * (5.0 * b - 16.0)))) * (1 / 24)
        w[5 * BLOCK + i] = aa * aa * (1 / 24)
