"""Block functions of maps on bodies with one doubly periodic chart (the torus).

The tangent frames of the chart cover the body, so (u, v, angle), all in turns and none of them cut, are coordinates of
the whole bundle, and a map stores their displacement. The frame is the orthogonal polar factor of (x_u, x_v).

Sources: Derivations, B2.
"""

import math

from numba import njit

from creeping.kernels.block import BLOCK, options
from creeping.kernels.curvature import inverse_root
from creeping.kernels.turns import cosine_sine, turns


@njit(**options)
def locate(r, chart, u, v, angle):
    """Chart 0 and u, v and angle in [0, 1) of a block."""
    for i in range(BLOCK):
        chart[i] = 0
    for i in range(BLOCK):
        u[i] = r[i] - math.floor(r[i])
    for i in range(BLOCK):
        v[i] = r[BLOCK + i] - math.floor(r[BLOCK + i])
    for i in range(BLOCK):
        angle[i] = r[2 * BLOCK + i] - math.floor(r[2 * BLOCK + i])


@njit(**options)
def move(r, d, centre):
    """Add displacements d (BLOCK, 4), flat, to the coordinates r (4, BLOCK), flat."""
    c0, c1, c2 = centre[0], centre[1], centre[2]
    for i in range(BLOCK):
        r[i] += d[4 * i] + c0
        r[BLOCK + i] += d[4 * i + 1] + c1
        r[2 * BLOCK + i] += d[4 * i + 2] + c2


@njit(**options)
def _frame(derivative, frame):
    """Isometric frame (6, BLOCK) of a block's tangents, rows 0, 3, 6 and 1, 4, 7 of the derivative (9, BLOCK)."""
    for i in range(BLOCK):
        ux, uy, uz = derivative[0, i], derivative[3, i], derivative[6, i]
        vx, vy, vz = derivative[1, i], derivative[4, i], derivative[7, i]
        g11 = ux * ux + uy * uy + uz * uz
        g12 = ux * vx + uy * vy + uz * vz
        g22 = vx * vx + vy * vy + vz * vz
        m11, m12, m22 = inverse_root(g11, g12, g22)
        frame[0, i], frame[1, i], frame[2, i] = m11 * ux + m12 * vx, m11 * uy + m12 * vy, m11 * uz + m12 * vz
        frame[3, i], frame[4, i], frame[5, i] = m12 * ux + m22 * vx, m12 * uy + m22 * vy, m12 * uz + m22 * vz


@njit(**options)
def to_coordinates(forward, forward_par, inverse, inverse_par, x, p, work, r):
    """Coordinates r (4, BLOCK) of points x and directions p (3, BLOCK)."""
    frame = work[18:24]
    inverse(x, r[0:3], inverse_par)
    forward(r[0:3], work[6:9], work[9:18], forward_par)
    _frame(work[9:18], frame)
    for i in range(BLOCK):
        along = p[0, i] * frame[0, i] + p[1, i] * frame[1, i] + p[2, i] * frame[2, i]
        across = p[0, i] * frame[3, i] + p[1, i] * frame[4, i] + p[2, i] * frame[5, i]
        r[2, i], r[3, i] = turns(across, along), 0.0


@njit(**options)
def from_coordinates(forward, forward_par, r, work, x, p):
    """Points x and directions p (3, BLOCK) of coordinates r (4, BLOCK)."""
    frame = work[18:24]
    forward(r[0:3], x, work[9:18], forward_par)
    _frame(work[9:18], frame)
    cosine, sine = work[24], work[25]
    for i in range(BLOCK):
        cosine[i], sine[i] = cosine_sine(r[2, i])
    for i in range(BLOCK):
        c, s = cosine[i], sine[i]
        p[0, i] = c * frame[0, i] + s * frame[3, i]
        p[1, i] = c * frame[1, i] + s * frame[4, i]
        p[2, i] = c * frame[2, i] + s * frame[5, i]
