"""Compiled composition of phase maps in the model coordinates of a body; the numpy twins are in `models`.

Two kinds of coordinates r (4, BLOCK): ROTATION, unit quaternions (`_rotations`), and ANGLES, turns (`_angles`). A map
is a table of their displacement; a ray enters the model once, is composed there, and leaves it for an output.
"""

import math

import numpy as np
from numba import njit

from creeping.phaseflow import _angles, _rotations
from creeping.phaseflow._integrator import BLOCK, aligned, options
from creeping.phaseflow._stencils import cells_and_fractions, interpolate, weights

ROTATION, ANGLES = 0, 1

_enter_rotation, _enter_angles = _rotations.enter, _angles.enter
_leave_rotation, _leave_angles = _rotations.leave, _angles.leave
_locate_rotation, _locate_angles = _rotations.locate, _angles.locate
_move_rotation, _move_angles = _rotations.move, _angles.move


@njit(**options)
def _enter(kind, there, there_par, back, back_par, x, p, work, r):
    if kind == ROTATION:
        _enter_rotation(there, there_par, back, back_par, x, p, work, r)
    else:
        _enter_angles(there, there_par, back, back_par, x, p, work, r)


@njit(**options)
def _leave(kind, there, there_par, r, work, x, p):
    if kind == ROTATION:
        _leave_rotation(there, there_par, r, work, x, p)
    else:
        _leave_angles(there, there_par, r, work, x, p)


@njit(**options)
def _stencils(kind, r, work, table, degree, scale, shift, uva, w, place, cell):
    """Number of the first coefficient and weights of a block's stencils.

    Grid coordinates are shift + scale times the coordinates of `locate`.
    """
    u, v, angle = uva[0], uva[1], uva[2]
    if kind == ROTATION:
        _locate_rotation(r, work, place, u, v, angle)
    else:
        _locate_angles(r, place, u, v, angle)
    for axis in range(3):
        t, a, b = uva[axis], scale[axis], shift[axis]
        for i in range(BLOCK):
            t[i] = b + a * t[i]
        cells_and_fractions(t, table.shape[axis + 1] - degree - 1, cell)
        weights(t, degree, w[6 * axis : 6 * axis + 6].reshape(-1))
        n = table.shape[axis + 1]
        for i in range(BLOCK):
            place[i] = place[i] * n + cell[i]


@njit(**options)
def _advance(kind, table, centre, jacobi, matrix, riding, degree, scale, shift, leaps, count, r, m, scratch):
    """Compose the map ``leaps`` times on r (4, BLOCK) and the Jacobi matrices m (4, BLOCK)."""
    work, uva, w, d, place = scratch
    first, cell = place[:BLOCK], place[BLOCK:]
    rf, df, mf = r.reshape(-1), d.reshape(-1), m.reshape(-1)
    wu, wv, wa = w[0:6].reshape(-1), w[6:12].reshape(-1), w[12:18].reshape(-1)
    for _ in range(leaps):
        _stencils(kind, rf, work, table, degree, scale, shift, uva, w, first, cell)
        interpolate(table, degree, first, wu, wv, wa, count, df)
        if kind == ROTATION:
            _move_rotation(rf, df, centre)
        else:
            _move_angles(rf, df, centre)
        if riding:
            interpolate(jacobi, degree, first, wu, wv, wa, count, df)
            _carry_jacobi(df, matrix, mf)


@njit(**options)
def _carry_jacobi(d, matrix, m):
    """Multiply the Jacobi matrices m (4, BLOCK), flat, from the left by matrix (4,) + d (BLOCK, 4), flat."""
    c11, c21, c12, c22 = matrix[0], matrix[1], matrix[2], matrix[3]
    for i in range(BLOCK):
        m11, m21, m12, m22 = c11 + d[4 * i], c21 + d[4 * i + 1], c12 + d[4 * i + 2], c22 + d[4 * i + 3]
        i1, j1, i2, j2 = m[i], m[BLOCK + i], m[2 * BLOCK + i], m[3 * BLOCK + i]
        m[i], m[BLOCK + i] = m11 * i1 + m12 * j1, m21 * i1 + m22 * j1
        m[2 * BLOCK + i], m[3 * BLOCK + i] = m11 * i2 + m12 * j2, m21 * i2 + m22 * j2


@njit(**options)
def flow(
    kind, there, there_par, back, back_par, table, centre, jacobi, matrix, degree, scale, shift, states, counts, out
):
    """Compose the map counts[0], then counts[1], ... times on states (n, 6 or 10) into out (n, m, the same).

    ``table`` (charts, nu, nv, na, 4) holds the displacement less its mean ``centre``, ``jacobi`` of the same shape the
    Jacobi matrix less its mean ``matrix`` (4,). ``there`` takes the model to the body, ``back`` the body to the model.
    """
    n, lanes = states.shape
    x, p, r, m = aligned(3, BLOCK), aligned(3, BLOCK), aligned(4, BLOCK), aligned(4, BLOCK)
    work, uva, w, d = aligned(27, BLOCK), aligned(3, BLOCK), aligned(18, BLOCK), np.zeros((BLOCK, 4))
    place = np.zeros(2 * BLOCK, np.int64)
    scratch = (work, uva, w, d, place)
    riding = lanes > 6
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        for i in range(BLOCK):
            source = start + min(i, count - 1)
            for k in range(3):
                x[k, i], p[k, i] = states[source, k], states[source, 3 + k]
            if riding:
                for k in range(4):
                    m[k, i] = states[source, 6 + k]
        _enter(kind, there, there_par, back, back_par, x, p, work, r)
        for output in range(counts.shape[0]):
            leaps = counts[output]
            _advance(kind, table, centre, jacobi, matrix, riding, degree, scale, shift, leaps, count, r, m, scratch)
            _leave(kind, there, there_par, r, work, x, p)
            for i in range(count):
                for k in range(3):
                    out[start + i, output, k], out[start + i, output, 3 + k] = x[k, i], p[k, i]
                if riding:
                    for k in range(4):
                        out[start + i, output, 6 + k] = m[k, i]


@njit(**options)
def double(kind, table, centre, jacobi, matrix, degree, scale, shift, nodes, displacement, matrices):
    """Displacement (n, 4) and Jacobi matrix less 1 (n, 4) of two leaps from the nodes (n, 4)."""
    r, m, d = aligned(4, BLOCK), aligned(4, BLOCK), np.zeros((BLOCK, 4))
    work, uva, w = aligned(27, BLOCK), aligned(3, BLOCK), aligned(18, BLOCK)
    place = np.zeros(2 * BLOCK, np.int64)
    n = nodes.shape[0]
    riding = matrices.shape[0] > 0
    whole = np.empty((4, BLOCK))
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        for i in range(BLOCK):
            for k in range(4):
                r[k, i] = nodes[start + min(i, count - 1), k]
            m[0, i], m[1, i], m[2, i], m[3, i] = 1.0, 0.0, 0.0, 1.0
            # the displacement from the identity is what two moves make of it
            whole[0, i], whole[1, i], whole[2, i], whole[3, i] = 1.0 if kind == ROTATION else 0.0, 0.0, 0.0, 0.0
        for _ in range(2):
            _stencils(kind, r.reshape(-1), work, table, degree, scale, shift, uva, w, place[:BLOCK], place[BLOCK:])
            wu, wv, wa = w[0:6].reshape(-1), w[6:12].reshape(-1), w[12:18].reshape(-1)
            interpolate(table, degree, place[:BLOCK], wu, wv, wa, count, d.reshape(-1))
            if kind == ROTATION:
                _move_rotation(r.reshape(-1), d.reshape(-1), centre)
                _move_rotation(whole.reshape(-1), d.reshape(-1), centre)
            else:
                _move_angles(r.reshape(-1), d.reshape(-1), centre)
                _move_angles(whole.reshape(-1), d.reshape(-1), centre)
            if riding:
                interpolate(jacobi, degree, place[:BLOCK], wu, wv, wa, count, d.reshape(-1))
                _carry_jacobi(d.reshape(-1), matrix, m.reshape(-1))
        for i in range(count):
            for k in range(4):
                displacement[start + i, k] = whole[k, i]
                if riding:
                    matrices[start + i, k] = m[k, i]


@njit(**options)
def to_body(kind, there, there_par, model, out):
    """States (n, 6) of model coordinates (n, 4)."""
    x, p, r, work = aligned(3, BLOCK), aligned(3, BLOCK), aligned(4, BLOCK), aligned(27, BLOCK)
    n = model.shape[0]
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        for i in range(BLOCK):
            for k in range(4):
                r[k, i] = model[start + min(i, count - 1), k]
        _leave(kind, there, there_par, r, work, x, p)
        for i in range(count):
            for k in range(3):
                out[start + i, k], out[start + i, 3 + k] = x[k, i], p[k, i]


@njit(**options)
def displacements(kind, there, there_par, back, back_par, nodes, traced, out):
    """Displacement (n, 4) from nodes (n, 4) along traced states (n, m, lanes), followed continuously.

    A rotation is that of two quaternions, an angle known up to turns: successive states must be near enough to tell
    which. Returns the least |cosine| (ROTATION) or 1 - 2 |turns| (ANGLES) between successive displacements.
    """
    x, p, r, work = aligned(3, BLOCK), aligned(3, BLOCK), aligned(4, BLOCK), aligned(27, BLOCK)
    n, steps = traced.shape[:2]
    surest = 1.0
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        for m in range(steps):
            for i in range(BLOCK):
                source = start + min(i, count - 1)
                for k in range(3):
                    x[k, i], p[k, i] = traced[source, m, k], traced[source, m, 3 + k]
            _enter(kind, there, there_par, back, back_par, x, p, work, r)
            for i in range(count):
                node, d = nodes[start + i], out[start + i]
                if kind == ROTATION:
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
