"""Compiled work on the nodes of a map while it is built; the kinds of coordinates are those of `composition`.

Also here: compiled composition of many rays in the order of their cells.

Rays anywhere on the body read stencils anywhere in the table, and a table beyond the nearest cache makes each of its 16
to 36 rows wait. Where there are many rays, they are sorted by (chart, cell of u, cell of v) before each leap, by
counting: the rows of one ray's stencil are then those of the next. Only indices are sorted; a ray's own data is one
cache line.
"""

import math

import numpy as np
from numba import njit

from creeping.geodesics.kernels.attenuation import SAMPLES
from creeping.kernels.block import BLOCK, aligned, entry_options, options
from creeping.phaseflow.kernels.composition import (
    ANGLES,
    INTERPOLATED,
    WORK,
    extend_some,
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


@njit(**entry_options)
def flow_ordered(
    kind, surface_table, there, there_par, back, back_par, leap, time, rules, degree, scale, shift, states, counts,
    budget, reached, ray, carried, bucket, ends, out
):  # fmt: skip
    """Do what `composition.flow` does, for many rays; after a leap of all of them the budget may be spent.

    Between two calls ``ray`` (n, 8), rows aligned, ``carried`` (n, lanes - 6), ``bucket`` (n,) and ``ends`` (cells of
    (u, v) + 1,), zeros at first, keep the rays: coordinates, fractions of the cell, number of the stencil's first
    coefficient plus 1/2 where an odd number of mirrors has folded the ray: one cache line.
    """
    n, lanes = states.shape
    table, more = leap[0], lanes - 6
    extras = 0 if lanes == 6 else (1 if lanes == 10 else 2)
    x, p, r = aligned(3, BLOCK), aligned(3, BLOCK), aligned(4, BLOCK)
    m, sampled = aligned(6, BLOCK), aligned(SAMPLES, BLOCK)
    work, uva, w, d = aligned(WORK, BLOCK), aligned(3, BLOCK), aligned(18, BLOCK), np.zeros((INTERPOLATED, 4))
    place, cell, bent = np.zeros(BLOCK, np.int64), np.zeros(BLOCK, np.int64), np.zeros(BLOCK, np.int64)
    a = aligned(2, BLOCK)
    odd = np.zeros(BLOCK)
    flat, order = ray.reshape(-1), np.empty(n, np.int64)
    # a whole number times the next number above 1/na never falls below the quotient, and division is slow
    inverse = (1.0 + 1e-15) / table.shape[3]
    spent, again = 0, reached[4] > 0.0
    for start in range(0, 0 if again else n, BLOCK):
        count = min(BLOCK, n - start)
        for i in range(BLOCK):
            source = start + min(i, count - 1)
            for k in range(3):
                x[k, i], p[k, i] = states[source, k], states[source, 3 + k]
        to_coordinates(kind, surface_table, there, there_par, back, back_par, x, p, work, r)
        place_block(kind, r.reshape(-1), work, table, degree, scale, shift, uva, place, cell)
        for i in range(count):
            order[start + i] = start + i
            for k in range(more):
                carried[start + i, k] = states[start + i, 6 + k]
        _put(flat, order[start : start + count], r, uva, place, work[7], inverse, bucket, ends)
    now = reached[3]
    for output in range(int(reached[1]), counts.shape[0]):
        done = 0
        if again:
            done, again = int(reached[2]), False
        for number in range(done, counts[output]):
            if spent >= budget:
                reached[1], reached[2], reached[3], reached[4] = output, number, now, 1.0
                return False
            spent += (n + BLOCK - 1) // BLOCK
            _sort(bucket, ends, order)
            ends[:] = 0
            for start in range(0, n, BLOCK):
                count = min(BLOCK, n - start)
                mine = order[start : start + count]
                for i in range(BLOCK):
                    at = 8 * mine[min(i, count - 1)]
                    r[0, i], r[1, i], r[2, i], r[3, i] = flat[at], flat[at + 1], flat[at + 2], flat[at + 3]
                    uva[0, i], uva[1, i], uva[2, i] = flat[at + 4], flat[at + 5], flat[at + 6]
                    place[i] = np.int64(flat[at + 7])
                    odd[i] = 2.0 * (flat[at + 7] - place[i])
                for i in range(BLOCK):
                    at = mine[min(i, count - 1)]
                    for k in range(more):
                        m[k, i] = carried[at, k]
                some = leap_block(kind, leap, extras, degree, uva, place, odd, count, r, m, w, d, bent)
                if some > 0:
                    values = d[2 * BLOCK : 4 * BLOCK].reshape(-1)
                    extend_some(values, rules, time, now, m, bent, some, a, sampled)
                place_block(kind, r.reshape(-1), work, table, degree, scale, shift, uva, place, cell)
                _put(flat, mine, r, uva, place, work[7], inverse, bucket, ends)
                for i in range(count):
                    for k in range(more):
                        carried[mine[i], k] = m[k, i]
            now += time
        for start in range(0, n, BLOCK):
            count = min(BLOCK, n - start)
            for i in range(BLOCK):
                for k in range(4):
                    r[k, i] = ray[start + min(i, count - 1), k]
            from_coordinates(kind, surface_table, there, there_par, r, work, x, p)
            for i in range(count):
                for k in range(3):
                    out[start + i, output, k], out[start + i, output, 3 + k] = x[k, i], p[k, i]
                for k in range(more):
                    out[start + i, output, 6 + k] = carried[start + i, k]
    return True


@njit(**options)
def _put(flat, mine, r, uva, place, odd, inverse, bucket, ends):
    """Keep a block's rays, and count them into ends[1:] by bucket."""
    for i in range(mine.shape[0]):
        at = 8 * mine[i]
        flat[at], flat[at + 1], flat[at + 2], flat[at + 3] = r[0, i], r[1, i], r[2, i], r[3, i]
        flat[at + 4], flat[at + 5], flat[at + 6], flat[at + 7] = (
            uva[0, i],
            uva[1, i],
            uva[2, i],
            place[i] + 0.5 * odd[i],
        )
    for i in range(mine.shape[0]):
        number = np.int32(place[i] * inverse)
        bucket[mine[i]] = number
        ends[number + 1] += 1


@njit(**options)
def _sort(bucket, ends, order):
    """Order of the rays by bucket, from the numbers of rays in ends[1:]."""
    for number in range(1, ends.shape[0]):
        ends[number] += ends[number - 1]
    for i in range(bucket.shape[0]):
        number = bucket[i]
        order[ends[number]] = i
        ends[number] += 1
