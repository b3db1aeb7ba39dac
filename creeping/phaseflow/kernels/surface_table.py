"""Compiled conversion of (x, p) to and from rotations by a table of x(u, v) instead of psi.

See `rotation`.

With T = [x_u, x_v] and G = T^T T, and the stereographic charts being conformal,

    p = T G^(-1/2) (along, across),   (along, across) = G^(-1/2) T^T p,   q = along e_u + across e_v.

Also here: compiled look-up of x(u, v) and its tangents on a chart, for bodies whose own map psi is expensive to
evaluate.

x, x_u and x_v are sums over one stencil of a quintic spline: for each row i, S = sum_j wv_j c_ij and
S' = sum_j wv'_j c_ij; then x = sum_i wu_i S, x_u = sum_i wu'_i S, x_v = sum_i wu_i S'.

Also here: where rotations lie on a table without azimuth, of a body of revolution x = psi(s); see `rotation`.

With S a turn about the axis a, psi(S s) = S psi(s) gives S R for R = [s, q, s x q], and the displacement R^-1 R' is one
for all turns: it is a function of

    R^T a = (s.a, q.a, (s x q).a) = (cos theta, -sin theta cos angle, sin theta sin angle),

theta the angle of s from the axis, angle that of q from the direction in which theta grows. At a pole, angle is any:
there the function does not depend on it. Beyond a pole theta goes on, so that its splines see a smooth function.

Sources: Derivations, R15, B7 and R18.
"""

import math

import numpy as np
from numba import njit, types
from numba.extending import intrinsic

from creeping.kernels.block import BLOCK, aligned, entry_options, options
from creeping.kernels.exponential import inverse_root, turns
from creeping.kernels.splines import cells_and_fractions, slopes, weights
from creeping.kernels.vectors import data_of, load_vector, multiply_add, spread_value, store_vector, whole
from creeping.phaseflow.kernels.rotation import REACH, face, quaternion, read_block, write_block
from creeping.phaseflow.kernels.rotation import columns as columns_of


@njit(**options)
def _look_up(table, chart, u, v, work, cell):
    """x, x_u, x_v (BLOCK, 12), flat, of a block; u and v are used up."""
    w, out = work[8:32].reshape(-1), work[32:44].reshape(-1)
    # two nodes lie beyond either edge of a chart
    cells = table.shape[1] - 9.0
    for axis in range(2):
        t = u if axis == 0 else v
        for i in range(BLOCK):
            t[i] = 2.0 + 0.5 * cells * (1.0 + t[i] * (1 / REACH))
        cells_and_fractions(t, table.shape[axis + 1] - 6, cell)
        for i in range(BLOCK):
            chart[i] = chart[i] * table.shape[axis + 1] + cell[i]
        weights(t, 5, w[12 * axis * BLOCK : (12 * axis + 6) * BLOCK])
        slopes(t, w[(12 * axis + 6) * BLOCK : (12 * axis + 12) * BLOCK])
    for i in range(BLOCK):
        _contract(table, 4 * chart[i], 4 * table.shape[2], w, i, out, 12 * i)
    return out


@njit(**options)
def _root(out, i):
    """Entries of G^(-1/2)."""
    k = 12 * i
    g11 = out[k + 4] * out[k + 4] + out[k + 5] * out[k + 5] + out[k + 6] * out[k + 6]
    g12 = out[k + 4] * out[k + 8] + out[k + 5] * out[k + 9] + out[k + 6] * out[k + 10]
    g22 = out[k + 8] * out[k + 8] + out[k + 9] * out[k + 9] + out[k + 10] * out[k + 10]
    return inverse_root(g11, g12, g22)


@njit(**entry_options)
def from_rotations(table, rows):
    """States rows[:, :6] of the rotations that stand in rows[:, :4]."""
    x, p, r, work = aligned(3, BLOCK), aligned(3, BLOCK), aligned(4, BLOCK), aligned(48, BLOCK)
    s, q, along, across, u, v = work[0:3], work[3:6], work[44], work[45], work[6], work[7]
    chart, cell = np.empty(BLOCK, np.int64), np.empty(BLOCK, np.int64)
    for start in range(0, rows.shape[0], BLOCK):
        count = read_block(rows, start, 0, r)
        columns_of(r.reshape(-1), s.reshape(-1), q.reshape(-1))
        face(s.reshape(-1), q.reshape(-1), chart, u, v, along, across)
        out = _look_up(table, chart, u, v, work, cell)
        for i in range(BLOCK):
            m11, m12, m22 = _root(out, i)
            norm = 1.0 / math.sqrt(along[i] * along[i] + across[i] * across[i])
            one = (m11 * along[i] + m12 * across[i]) * norm
            other = (m12 * along[i] + m22 * across[i]) * norm
            for k in range(3):
                x[k, i] = out[12 * i + k]
                p[k, i] = one * out[12 * i + 4 + k] + other * out[12 * i + 8 + k]
        write_block(x, count, start, 0, rows)
        write_block(p, count, start, 3, rows)


@njit(**entry_options)
def to_rotations(table, back, back_par, states, rays):
    """Rotations rays[:, :4] of states (n, 6 or more)."""
    x, p, r, work = aligned(3, BLOCK), aligned(3, BLOCK), aligned(4, BLOCK), aligned(48, BLOCK)
    s, u, v = work[0:3], work[6], work[7]
    chart, cell, faces = np.empty(BLOCK, np.int64), np.empty(BLOCK, np.int64), np.empty(BLOCK, np.int64)
    for start in range(0, states.shape[0], BLOCK):
        count = read_block(states, start, 0, x)
        read_block(states, start, 3, p)
        back(x, s, back_par)
        # of q only the tangents of the chart are wanted: along and across are not used
        face(s.reshape(-1), s.reshape(-1), chart, u, v, work[44], work[45])
        for i in range(BLOCK):
            faces[i], work[46, i], work[47, i] = chart[i], u[i], v[i]
        out = _look_up(table, chart, u, v, work, cell)
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
        write_block(r, count, start, 0, rays)


@intrinsic
def _contract(typing, table, offset, stride, weights, place, out, at):
    """Write x, x_u, x_v (12 values) to out[at:]; weights (4, 6, BLOCK), flat: wu, wu', wv, wv'."""

    def codegen(context, builder, sig, args):
        rows, weight, target = (data_of(context, builder, sig.args[k], args[k]) for k in (0, 3, 5))

        def spread(kind, j):
            at = builder.add(args[4], whole((kind * 6 + j) * BLOCK))
            return spread_value(builder, builder.load(builder.gep(weight, [at])), 4)

        along, slope = [spread(2, j) for j in range(6)], [spread(3, j) for j in range(6)]
        x = x_u = x_v = None
        for i in range(6):
            row = builder.add(args[1], builder.mul(args[2], whole(i)))
            value = changed = None
            for j in range(6):
                coefficient = load_vector(builder, rows, builder.add(row, whole(4 * j)), 4)
                value = multiply_add(builder, value, along[j], coefficient)
                changed = multiply_add(builder, changed, slope[j], coefficient)
            x = multiply_add(builder, x, spread(0, i), value)
            x_u = multiply_add(builder, x_u, spread(1, i), value)
            x_v = multiply_add(builder, x_v, spread(0, i), changed)
        for k, total in enumerate((x, x_u, x_v)):
            store_vector(builder, total, target, builder.add(args[6], whole(4 * k)))
        return context.get_dummy_value()

    return types.void(table, offset, stride, weights, place, out, at), codegen


@njit(**options)
def locate_meridian(r, shift, work, chart, u, v, angle):
    """Chart 0, u = 0, v = theta/pi in [0, 1] and angle in turns of a block; the axis is shift[3:6]."""
    ax, ay, az = shift[3], shift[4], shift[5]
    along, one, other, across = work[0], work[1], work[2], work[3]
    for i in range(BLOCK):
        w, x, y, z = r[i], r[BLOCK + i], r[2 * BLOCK + i], r[3 * BLOCK + i]
        along[i] = ax * (1.0 - 2.0 * (y * y + z * z)) + 2.0 * ay * (x * y + w * z) + 2.0 * az * (x * z - w * y)
        one[i] = -(2.0 * ax * (x * y - w * z) + ay * (1.0 - 2.0 * (x * x + z * z)) + 2.0 * az * (y * z + w * x))
        other[i] = 2.0 * ax * (x * z + w * y) + 2.0 * ay * (y * z - w * x) + az * (1.0 - 2.0 * (x * x + y * y))
    for i in range(BLOCK):
        across[i] = math.sqrt(one[i] * one[i] + other[i] * other[i])
        chart[i] = 0
        u[i] = 0.0
    for i in range(BLOCK):
        v[i] = 2.0 * turns(across[i], along[i])
    for i in range(BLOCK):
        angle[i] = turns(other[i], one[i])
