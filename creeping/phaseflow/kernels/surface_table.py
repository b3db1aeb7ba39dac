"""Compiled conversion of (x, p) to and from rotations by a table of x(u, v) instead of psi.

See `rotation` and `surface_spline`.

With T = [x_u, x_v] and G = T^T T, and the stereographic charts being conformal,

    p = T G^(-1/2) (along, across),   (along, across) = G^(-1/2) T^T p,   q = along e_u + across e_v.

Sources: Derivations, R15.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import BLOCK, options
from creeping.kernels.curvature import inverse_root
from creeping.kernels.splines import cells_and_fractions, slopes, weights
from creeping.phaseflow.kernels.rotation import REACH, face, quaternion
from creeping.phaseflow.kernels.rotation import columns as columns_of
from creeping.phaseflow.kernels.surface_spline import DEGREE, tangents

MARGIN = 2.0


@njit(**options)
def _look_up(table, chart, u, v, work, cell, count):
    """x, x_u, x_v (BLOCK, 12), flat, of a block; u and v are used up."""
    w, out = work[8:32].reshape(-1), work[32:44].reshape(-1)
    cells = table.shape[1] - DEGREE - 2.0 * MARGIN
    for axis in range(2):
        t = u if axis == 0 else v
        for i in range(BLOCK):
            t[i] = MARGIN + 0.5 * cells * (1.0 + t[i] * (1 / REACH))
        cells_and_fractions(t, table.shape[axis + 1] - DEGREE - 1, cell)
        for i in range(BLOCK):
            chart[i] = chart[i] * table.shape[axis + 1] + cell[i]
        weights(t, DEGREE, w[12 * axis * BLOCK : (12 * axis + 6) * BLOCK])
        slopes(t, w[(12 * axis + 6) * BLOCK : (12 * axis + 12) * BLOCK])
    tangents(table, chart, w, count, out)
    return out


@njit(**options)
def _root(out, i):
    """Entries of G^(-1/2)."""
    k = 12 * i
    g11 = out[k + 4] * out[k + 4] + out[k + 5] * out[k + 5] + out[k + 6] * out[k + 6]
    g12 = out[k + 4] * out[k + 8] + out[k + 5] * out[k + 9] + out[k + 6] * out[k + 10]
    g22 = out[k + 8] * out[k + 8] + out[k + 9] * out[k + 9] + out[k + 10] * out[k + 10]
    return inverse_root(g11, g12, g22)


@njit(**options)
def from_coordinates(table, r, work, x, p):
    """Points x and directions p (3, BLOCK) of rotations r (4, BLOCK)."""
    s, q, along, across, u, v = work[0:3], work[3:6], work[44], work[45], work[6], work[7]
    chart, cell = np.empty(BLOCK, np.int64), np.empty(BLOCK, np.int64)
    columns_of(r.reshape(-1), s.reshape(-1), q.reshape(-1))
    face(s.reshape(-1), q.reshape(-1), chart, u, v, along, across)
    out = _look_up(table, chart, u, v, work, cell, BLOCK)
    for i in range(BLOCK):
        m11, m12, m22 = _root(out, i)
        norm = 1.0 / math.sqrt(along[i] * along[i] + across[i] * across[i])
        one = (m11 * along[i] + m12 * across[i]) * norm
        other = (m12 * along[i] + m22 * across[i]) * norm
        for k in range(3):
            x[k, i] = out[12 * i + k]
            p[k, i] = one * out[12 * i + 4 + k] + other * out[12 * i + 8 + k]


@njit(**options)
def to_coordinates(table, inverse, inverse_par, x, p, work, r):
    """Rotations r (4, BLOCK) of points x and directions p (3, BLOCK)."""
    s, u, v = work[0:3], work[6], work[7]
    chart, cell = np.empty(BLOCK, np.int64), np.empty(BLOCK, np.int64)
    faces = np.empty(BLOCK, np.int64)
    inverse(x, s, inverse_par)
    # of q only the tangents of the chart are wanted: along and across are not used
    face(s.reshape(-1), s.reshape(-1), chart, u, v, work[44], work[45])
    for i in range(BLOCK):
        faces[i], work[46, i], work[47, i] = chart[i], u[i], v[i]
    out = _look_up(table, chart, u, v, work, cell, BLOCK)
    for i in range(BLOCK):
        m11, m12, m22 = _root(out, i)
        one, other = 0.0, 0.0
        for k in range(3):
            one += out[12 * i + 4 + k] * p[k, i]
            other += out[12 * i + 8 + k] * p[k, i]
        along, across = m11 * one + m12 * other, m12 * one + m22 * other
        norm = 1.0 / math.sqrt(along * along + across * across)
        along, across = along * norm, across * norm
        axis = faces[i] // 2
        sign = 1.0 - 2.0 * (faces[i] % 2)
        sb, sc = sign * s[(axis + 1) % 3, i], s[(axis + 2) % 3, i]
        un, vn = work[46, i], work[47, i]
        qa = sign * (-along * sb - across * sc)
        qb = sign * (along * (1.0 - un * sb) - across * un * sc)
        qc = -along * vn * sb + across * (1.0 - vn * sc)
        if axis == 0:
            qx, qy, qz = qa, qb, qc
        elif axis == 1:
            qx, qy, qz = qc, qa, qb
        else:
            qx, qy, qz = qb, qc, qa
        quaternion(s[0, i], s[1, i], s[2, i], qx, qy, qz, r, i)
