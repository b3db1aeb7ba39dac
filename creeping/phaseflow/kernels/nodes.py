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

from creeping.kernels.block import BLOCK, entry_options, options
from creeping.phaseflow.kernels.composition import Kind, extend_some, leap_block, move, place_block, workspace
from creeping.phaseflow.kernels.rotation import read_block


@njit(**entry_options)
def double(kind, leap, degree, scale, shift, nodes, displacement, matrices, curvatures):
    """Displacement (n, 4), Jacobi matrix (n or 0, 4) and curvatures (n or 0, 16) of two leaps from the nodes (n, 4).

    The leap is not packed.
    """
    r, m, work, uva, w, d, place, cell, mine, _, _ = workspace()
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
            whole[0, i], whole[1, i], whole[2, i], whole[3, i] = 0.0 if kind == Kind.ANGLES else 1.0, 0.0, 0.0, 0.0
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
def flow_ordered(
    kind, leap, time, rules, degree, scale, shift, rays, counts, budget, reached, ray, carried, bucket, ends, out
):
    """Do what `composition.flow` does, for many rays; after a leap of all of them the budget may be spent.

    Between two calls ``ray`` (n, 8), rows aligned, ``carried`` (n, lanes - 6), ``bucket`` (n,) and ``ends`` (cells of
    (u, v) + 1,), zeros at first, keep the rays: coordinates, fractions of the cell, number of the stencil's first
    coefficient plus 1/2 where an odd number of mirrors has folded the ray: one cache line.
    """
    n, more = rays.shape[0], rays.shape[1] - 4
    table, extras = leap[0], (rays.shape[1] - 2) // 4
    r, m, work, uva, w, d, place, cell, bent, a, sampled = workspace()
    odd = np.zeros(BLOCK)
    flat, order = ray.reshape(-1), np.empty(n, np.int64)
    # a whole number times the next number above 1/na never falls below the quotient, and division is slow
    inverse = (1.0 + 1e-15) / table.shape[3]
    spent, again = 0, reached[0] > 0.0
    for start in range(0, 0 if again else n, BLOCK):
        count = read_block(rays, start, 0, r)
        place_block(kind, r.reshape(-1), work, table, degree, scale, shift, uva, place, cell)
        for i in range(count):
            order[start + i] = start + i
            for k in range(more):
                carried[start + i, k] = rays[start + i, 4 + k]
        _put(flat, order[start : start + count], r, uva, place, work[7], inverse, bucket, ends)
    now = reached[3]
    for output in range(int(reached[1]), counts.shape[0]):
        done = 0
        if again:
            done, again = int(reached[2]), False
        for number in range(done, counts[output]):
            if spent >= budget:
                reached[0], reached[1], reached[2], reached[3] = 1.0, output, number, now
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
        for i in range(n):
            for k in range(4):
                out[i, output, k] = ray[i, k]
            for k in range(more):
                out[i, output, 6 + k] = carried[i, k]
    return True


@njit(**options)
def _put(flat, mine, r, uva, place, odd, inverse, bucket, ends):
    """Keep a block's rays, and count them into ends[1:] by bucket."""
    for i in range(mine.shape[0]):
        at = 8 * mine[i]
        flat[at], flat[at + 1], flat[at + 2], flat[at + 3] = r[0, i], r[1, i], r[2, i], r[3, i]
        flat[at + 4], flat[at + 5], flat[at + 6] = uva[0, i], uva[1, i], uva[2, i]
        flat[at + 7] = place[i] + 0.5 * odd[i]
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
