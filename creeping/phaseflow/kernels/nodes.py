"""Compiled work on the nodes of a map while it is built; the kinds of coordinates are those of `composition`."""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import BLOCK, aligned, entry_options
from creeping.phaseflow.kernels.composition import (
    ANGLES,
    INTERPOLATED,
    WORK,
    from_coordinates,
    leap_block,
    move,
    place_block,
    to_coordinates,
)


@njit(**entry_options)
def double(kind, leap, degree, scale, shift, nodes, displacement, matrices, curvatures):
    """Displacement (n, 4), Jacobi matrix (n or 0, 4) and curvatures (n or 0, 16) of two leaps from the nodes (n, 4).

    The leap is not packed.
    """
    r, m, d = aligned(4, BLOCK), aligned(6, BLOCK), np.zeros((INTERPOLATED, 4))
    work, uva, w = aligned(WORK, BLOCK), aligned(3, BLOCK), aligned(18, BLOCK)
    place, cell, mine = np.zeros(BLOCK, np.int64), np.zeros(BLOCK, np.int64), np.zeros(BLOCK, np.int64)
    # no ray detaches from a node
    m[5, :] = math.inf
    n = nodes.shape[0]
    extras = 0 if matrices.shape[0] == 0 else (1 if curvatures.shape[0] == 0 else 2)
    whole = np.empty((4, BLOCK))
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        for i in range(BLOCK):
            for k in range(4):
                r[k, i] = nodes[start + min(i, count - 1), k]
            m[0, i], m[1, i], m[2, i], m[3, i] = 1.0, 0.0, 0.0, 1.0
            # the displacement from the identity is what two moves make of it
            whole[0, i], whole[1, i], whole[2, i], whole[3, i] = 0.0 if kind == ANGLES else 1.0, 0.0, 0.0, 0.0
        for half in range(2):
            place_block(kind, r.reshape(-1), work, leap[0], degree, scale, shift, uva, place, cell)
            leap_block(kind, leap, extras, degree, uva, place, work[7], count, r, m, w, d, mine)
            move(kind, whole.reshape(-1), d[:BLOCK].reshape(-1), leap[1])
            if extras > 1:
                kappa = d[2 * BLOCK : 4 * BLOCK].reshape(BLOCK, 8)
                for i in range(count):
                    for k in range(8):
                        curvatures[start + i, 8 * half + k] = kappa[i, k]
        for i in range(count):
            for k in range(4):
                displacement[start + i, k] = whole[k, i]
                if extras > 0:
                    matrices[start + i, k] = m[k, i]


@njit(**entry_options)
def to_body(kind, surface_table, there, there_par, model, out):
    """States (n, 6) of model coordinates (n, 4)."""
    x, p, r, work = aligned(3, BLOCK), aligned(3, BLOCK), aligned(4, BLOCK), aligned(WORK, BLOCK)
    n = model.shape[0]
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        for i in range(BLOCK):
            for k in range(4):
                r[k, i] = model[start + min(i, count - 1), k]
        from_coordinates(kind, surface_table, there, there_par, r, work, x, p)
        for i in range(count):
            for k in range(3):
                out[start + i, k], out[start + i, 3 + k] = x[k, i], p[k, i]


@njit(**entry_options)
def displacements(kind, surface_table, there, there_par, back, back_par, nodes, traced, out):
    """Displacement (n, 4) from nodes (n, 4) along traced states (n, m, lanes), followed continuously.

    A rotation is that of two quaternions, an angle known up to turns: successive states must be near enough to tell
    which. Returns the least |cosine| (ROTATION) or 1 - 2 |turns| (ANGLES) between successive displacements.
    """
    x, p, r, work = aligned(3, BLOCK), aligned(3, BLOCK), aligned(4, BLOCK), aligned(WORK, BLOCK)
    n, steps = traced.shape[:2]
    surest = 1.0
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        for m in range(steps):
            for i in range(BLOCK):
                source = start + min(i, count - 1)
                for k in range(3):
                    x[k, i], p[k, i] = traced[source, m, k], traced[source, m, 3 + k]
            to_coordinates(kind, surface_table, there, there_par, back, back_par, x, p, work, r)
            for i in range(count):
                node, d = nodes[start + i], out[start + i]
                if kind != ANGLES:
                    w, a, b, c = node[0], -node[1], -node[2], -node[3]
                    rw, rx, ry, rz = r[0, i], r[1, i], r[2, i], r[3, i]
                    qw, qx = w * rw - a * rx - b * ry - c * rz, w * rx + a * rw + b * rz - c * ry
                    qy, qz = w * ry - a * rz + b * rw + c * rx, w * rz + a * ry - b * rx + c * rw
                    cosine = qw if m == 0 else qw * d[0] + qx * d[1] + qy * d[2] + qz * d[3]
                    sign = -1.0 if cosine < 0.0 else 1.0
                    surest = min(surest, abs(cosine))
                    d[0], d[1], d[2], d[3] = sign * qw, sign * qx, sign * qy, sign * qz
                else:
                    for k in range(3):
                        before = 0.0 if m == 0 else d[k]
                        step = r[k, i] - node[k] - before
                        step -= math.floor(step + 0.5)
                        surest = min(surest, 1.0 - 2.0 * abs(step))
                        d[k] = before + step
                    d[3] = 0.0
    return surest
