"""Compiled composition of phase maps, in the model coordinates of a body or in space.

A map is a table of the displacement of coordinates r (4, BLOCK): rays are converted to the model once, are composed
there, and are converted back for their outputs, by kernels of `rotation` and `surface_table`. ROTATION are unit
quaternions, ANGLES turns, FOLDED rotations whose table covers the octant s >= 0 only, on bodies with three mirror
planes, MERIDIAN those of bodies of revolution (`surface_table.locate_meridian`). The table of a body of revolution has
one plane: no axis u.

Rays anywhere on the body read stencils anywhere in the table, and a table beyond the nearest cache makes each of its 16
to 36 rows wait. Where there are many rays, they are sorted by (chart, cell of u, cell of v) before each leap, by
counting: the rows of one ray's stencil are then those of the next. Only indices are sorted; a ray's own data is one
cache line.

Maps stored in space, for any atlas, are composed by `leap_in_space`: a body enters as the addresses of its block
evaluator and of its locator (see `creeping.geometry.surface.Compiled`), so that kernels compile once for all bodies.

Sources: [B78]; Derivations, B7.
"""

import math
from enum import IntEnum

import numpy as np
from numba import njit

from creeping.geodesics.kernels.attenuation import extend
from creeping.geodesics.kernels.flow_derivative import project_block
from creeping.kernels.block import BLOCK, aligned, entry_options, options, strict_inlined, strict_options
from creeping.kernels.splines import cells_and_fractions, stencil_sum, weights
from creeping.kernels.vectors import pointer
from creeping.phaseflow.kernels.rotation import (
    locate,
    locate_angles,
    move_angles,
    move_rotations,
    read_block,
    unfold,
    write_block,
)
from creeping.phaseflow.kernels.surface_table import locate_meridian


class Kind(IntEnum):
    """Kinds of coordinates, by the numbers that models have."""

    ROTATION, ANGLES, FOLDED, MERIDIAN = range(4)


@njit(**options)
def workspace():
    """What a block needs on its way: coordinates r and what is carried m, work space, and numbers of rays and cells.

    Of d, rows of four, are the displacements, matrices, curvatures (of 2 x 4) and packed lanes that are interpolated.
    """
    r, m, work, uva, w = aligned(4, BLOCK), aligned(6, BLOCK), aligned(9, BLOCK), aligned(3, BLOCK), aligned(18, BLOCK)
    d, a, sampled = np.zeros((6 * BLOCK, 4)), aligned(2, BLOCK), aligned(23, BLOCK)
    place, cell, mine = np.zeros(BLOCK, np.int64), np.zeros(BLOCK, np.int64), np.zeros(BLOCK, np.int64)
    return r, m, work, uva, w, d, place, cell, mine, a, sampled


@njit(**options)
def move(kind, r, d, centre):
    """Move coordinates r (4, BLOCK) by displacements d (BLOCK, 4), both flat."""
    if kind == Kind.ANGLES:
        move_angles(r, d, centre)
    else:
        move_rotations(r, d, centre)


@njit(**options)
def place_block(kind, r, work, table, degree, scale, shift, uva, place, cell):
    """Number of the first coefficient of a block's stencils and, in uva (3, BLOCK), the fractions of their cells.

    Grid coordinates are shift + scale times the coordinates of `locate`; ``shift`` goes on by the axis of revolution.
    """
    u, v, angle = uva[0], uva[1], uva[2]
    if kind == Kind.ANGLES or kind == Kind.MERIDIAN:
        if kind == Kind.ANGLES:
            locate_angles(r, place, u, v, angle)
        else:
            locate_meridian(r, shift, work, place, u, v, angle)
        # no mirrors
        for i in range(BLOCK):
            work[7, i] = 0.0
    else:
        locate(r, work, place, u, v, angle, kind == Kind.FOLDED)
    for axis in range(1 if table.shape[1] == 1 else 0, 3):
        t, a, b = uva[axis], scale[axis], shift[axis]
        for i in range(BLOCK):
            t[i] = b + a * t[i]
        cells_and_fractions(t, table.shape[axis + 1] - degree - 1, cell)
        n = table.shape[axis + 1]
        for i in range(BLOCK):
            place[i] = place[i] * n + cell[i]


@njit(**options)
def leap_block(kind, leap, extras, degree, uva, place, odd, count, r, m, w, d, mine):
    """Move r (4, BLOCK), Jacobi matrices and attenuation, m (6, BLOCK), by one leap, their stencils being placed.

    ``leap`` is (table, centre, jacobi, matrix, curvature, flagged). d (D, 4) keeps what is interpolated: displacements,
    matrices, and for extras = 2 the curvatures of rays that have not detached, row 5 of m, and whose attenuation the
    leap does not have: mine[:n] of them, n is returned; ``odd`` says what was reflected.
    """
    table, centre, jacobi, matrix, curvature, flagged = leap
    rf, df, ef = r.reshape(-1), d[:BLOCK].reshape(-1), d[BLOCK : 2 * BLOCK].reshape(-1)
    wu, wv, wa = w[0:6].reshape(-1), w[6:12].reshape(-1), w[12:18].reshape(-1)
    if table.shape[1] > 1:
        weights(uva[0], degree, wu)
    weights(uva[1], degree, wv)
    weights(uva[2], degree, wa)
    for i in range(count):
        mine[i] = i
    packed = extras > 0 and jacobi.shape[4] == 8
    pf = d[4 * BLOCK :].reshape(-1)
    if packed:
        interpolate(jacobi, degree, place, wu, wv, wa, mine, count, pf)
        _unpack(kind, pf, matrix, centre, df, ef)
    else:
        interpolate(table, degree, place, wu, wv, wa, mine, count, df)
        if extras:
            interpolate(jacobi, degree, place, wu, wv, wa, mine, count, ef)
    if kind == Kind.FOLDED:
        unfold(df, odd)
    move(kind, rf, df, centre)
    if extras:
        _carry_jacobi(ef, matrix[3:7] if packed else matrix, m.reshape(-1))
    some = 0
    if extras > 1:
        flags = flagged.reshape(-1)
        for i in range(count):
            if m[5, i] == math.inf:
                if packed and flags[place[i]] == 0:
                    m[4, i] += matrix[7] + pf[8 * i + 7]
                else:
                    mine[some] = i
                    some += 1
        interpolate(curvature, degree, place, wu, wv, wa, mine, some, d[2 * BLOCK : 4 * BLOCK].reshape(-1))
    return some


@njit(**options)
def extend_some(values, rules, time, now, m, mine, some, a, sampled):
    """Carry A and the time of detachment, rows 4 and 5 of m, of the rays mine[:some]; a (2, BLOCK) is work space."""
    for j in range(some):
        a[0, j], a[1, j] = m[4, mine[j]], m[5, mine[j]]
    for j in range(some, BLOCK):
        a[1, j] = 0.0
    extend(values, rules, time, now, a, sampled, some)
    for j in range(some):
        m[4, mine[j]], m[5, mine[j]] = a[0, j], a[1, j]


@njit(**strict_inlined)
def _unpack(kind, packed, mean, centre, d, e):
    """Displacements less ``centre``, d (BLOCK, 4), and matrices, e (BLOCK, 4), of packed lanes (BLOCK, 8); all flat."""
    for i in range(BLOCK):
        x, y, z = packed[8 * i] + mean[0], packed[8 * i + 1] + mean[1], packed[8 * i + 2] + mean[2]
        if kind == Kind.ANGLES:
            d[4 * i], d[4 * i + 1], d[4 * i + 2], d[4 * i + 3] = x - centre[0], y - centre[1], z - centre[2], -centre[3]
        else:
            w = math.sqrt(max(1.0 - x * x - y * y - z * z, 0.0))
            d[4 * i], d[4 * i + 1] = w - centre[0], x - centre[1]
            d[4 * i + 2], d[4 * i + 3] = y - centre[2], z - centre[3]
        e[4 * i], e[4 * i + 1] = packed[8 * i + 3], packed[8 * i + 4]
        e[4 * i + 2], e[4 * i + 3] = packed[8 * i + 5], packed[8 * i + 6]


@njit(**options)
def _carry_jacobi(d, matrix, m):
    """Multiply the Jacobi matrices m (4, BLOCK), flat, from the left by matrix (4,) + d (BLOCK, 4), flat."""
    c11, c21, c12, c22 = matrix[0], matrix[1], matrix[2], matrix[3]
    for i in range(BLOCK):
        m11, m21, m12, m22 = c11 + d[4 * i], c21 + d[4 * i + 1], c12 + d[4 * i + 2], c22 + d[4 * i + 3]
        i1, j1, i2, j2 = m[i], m[BLOCK + i], m[2 * BLOCK + i], m[3 * BLOCK + i]
        m[i], m[BLOCK + i] = m11 * i1 + m12 * j1, m21 * i1 + m22 * j1
        m[2 * BLOCK + i], m[3 * BLOCK + i] = m11 * i2 + m12 * j2, m21 * i2 + m22 * j2


@njit(**entry_options)
def flow(kind, leap, time, rules, degree, scale, shift, rays, counts, budget, reached, out):
    """Compose the map counts[0], then counts[1], ... times on rays (n, 4, 8 or 10) into out (n, m, 6, 10 or 12).

    Rays are coordinates r (4,), Jacobi matrix (4,), attenuation and time of detachment; they are used up. Of each
    output coordinates stand at [:4], the rest from 6 on.

    ``leap`` is (table, centre, jacobi, matrix, curvature, flagged), as of `phaseflow.splines.Leap`: table (charts, nu,
    nv, na, 4) holds the displacement less its mean ``centre``, jacobi (..., 4 or 8) the Jacobi matrix less its mean
    ``matrix``, or all three, curvature (..., 8) that of `geodesics.kernels.attenuation`, as are the ``rules``.

    Returns whether all is done. After ``budget`` leaps of a block it is not, and is to be called again with the same
    arguments: ``reached`` (4,), zeros at first, keeps ray, output and leap, and the time.
    """
    n, extras = rays.shape[0], (rays.shape[1] - 2) // 4
    r, m, work, uva, w, d, place, cell, mine, a, sampled = workspace()
    carried = rays.shape[1] - 4
    spent, first, done, now = 0, int(reached[1]), int(reached[2]), reached[3]
    for start in range(int(reached[0]), n, BLOCK):
        count = read_block(rays, start, 0, r)
        read_block(rays, start, 4, m[:carried])
        for output in range(first, counts.shape[0]):
            for number in range(done, counts[output]):
                if spent >= budget:
                    reached[0], reached[1], reached[2], reached[3] = start, output, number, now
                    write_block(r, count, start, 0, rays)
                    write_block(m[:carried], count, start, 4, rays)
                    return False
                spent += 1
                place_block(kind, r.reshape(-1), work, leap[0], degree, scale, shift, uva, place, cell)
                some = leap_block(kind, leap, extras, degree, uva, place, work[7], count, r, m, w, d, mine)
                if some > 0:
                    bent = d[2 * BLOCK : 4 * BLOCK].reshape(-1)
                    extend_some(bent, rules, time, now, m, mine, some, a, sampled)
                now += time
            done = 0
            for i in range(count):
                for k in range(4):
                    out[start + i, output, k] = r[k, i]
                for k in range(carried):
                    out[start + i, output, 6 + k] = m[k, i]
        first, now = 0, 0.0
    return True


@njit(**strict_options)
def interpolate(table, degree, first, wu, wv, wa, rays, count, out):
    """Stencil sums of the rays rays[:count] of a block, one after the other in out (BLOCK, lanes), flat.

    ``first`` holds the number of each stencil's first coefficient; for the weights see `creeping.kernels.splines`. A
    table with one plane has no axis u.
    """
    lanes, row = table.shape[4], table.shape[3]
    case = (4 if lanes == 8 else 0) + (2 if degree == 5 else 0) + (1 if table.shape[1] == 1 else 0)
    for j in range(count):
        i = rays[j]
        plane = lanes * row * table.shape[2]
        stencil_sum(table, case, lanes * first[i], plane, lanes * row, wu, wv, wa, i, out, lanes * j)


@njit(**entry_options)
def leap_in_space(
    locator, locator_par, level, level_par, table, jacobi, degree, origin, cells, horizon, leaps, tolerance, states
):
    """Compose the map ``leaps`` times on states (n, 6 or 10), in place.

    table (charts, nu, nv, na, 8) holds x' - x - T0 p and p' - p, jacobi (charts, nu, nv, na, 4) M - [[1, T0], [0, 1]];
    grid coordinates are origin + cells * (u, v, angle/2 pi). Afterwards x is brought back to |F| <= tolerance |grad F|,
    which leaves grad F for the locator of the next leap.
    """
    n, lanes = states.shape
    y, geometry = aligned(6, BLOCK), aligned(10, BLOCK)
    chart, uv, frame = np.empty(BLOCK, np.int64), np.empty((2, BLOCK)), np.empty((6, BLOCK))
    w, places, cell = aligned(3, 6 * BLOCK), aligned(3, BLOCK), np.empty((3, BLOCK), np.int64)
    d, e, rays = np.empty(8 * BLOCK), np.empty(4 * BLOCK), np.arange(BLOCK)
    last = table.shape[1] - degree - 1, table.shape[2] - degree - 1, int(cells[2]) - 1
    turns = cells[2] / (2 * math.pi)
    for start in range(0, n, BLOCK):
        count = min(BLOCK, n - start)
        for i in range(BLOCK):
            for lane in range(6):
                y[lane, i] = states[start + min(i, count - 1), lane]
        off = math.inf
        # y and geometry are in use until the end, as their addresses must be
        here, normals = pointer(y.reshape(-1), 0), pointer(geometry.reshape(-1), 0)
        for _ in range(leaps):
            # else the last evaluation was within the tolerance of where the rays are
            if not off <= tolerance:
                level(y[:3], geometry[0], geometry[1:4], geometry[4:], level_par)
            locator(y[:3], geometry[1:4], chart, uv, frame, locator_par)
            for i in range(BLOCK):
                px, py, pz = y[3, i], y[4, i], y[5, i]
                across = px * frame[3, i] + py * frame[4, i] + pz * frame[5, i]
                along = px * frame[0, i] + py * frame[1, i] + pz * frame[2, i]
                angle = math.atan2(across, along) * turns
                places[0, i], places[1, i] = origin[0] + cells[0] * uv[0, i], origin[1] + cells[1] * uv[1, i]
                places[2, i] = angle + cells[2] if angle < 0.0 else angle
            for axis in range(3):
                cells_and_fractions(places[axis], last[axis], cell[axis])
                weights(places[axis], degree, w[axis])
                for i in range(BLOCK):
                    chart[i] = chart[i] * table.shape[axis + 1] + cell[axis, i]
            interpolate(table, degree, chart, w[0], w[1], w[2], rays, count, d)
            if lanes > 6:
                interpolate(jacobi, degree, chart, w[0], w[1], w[2], rays, count, e)
            for i in range(count):
                for k in range(3):
                    y[k, i] += horizon * y[3 + k, i] + d[8 * i + k]
                    y[3 + k, i] += d[8 * i + 3 + k]
                if lanes > 6:
                    state = states[start + i]
                    m11, m21 = 1.0 + e[4 * i], e[4 * i + 1]
                    m12, m22 = horizon + e[4 * i + 2], 1.0 + e[4 * i + 3]
                    i1, j1, i2, j2 = state[6], state[7], state[8], state[9]
                    state[6], state[7] = m11 * i1 + m12 * j1, m21 * i1 + m22 * j1
                    state[8], state[9] = m11 * i2 + m12 * j2, m21 * i2 + m22 * j2
            for i in range(count, BLOCK):
                for lane in range(6):
                    y[lane, i] = y[lane, count - 1]
            for _newton in range(4):
                level(y[:3], geometry[0], geometry[1:4], geometry[4:], level_par)
                off = 0.0
                for i in range(BLOCK):
                    slope = math.sqrt(geometry[1, i] ** 2 + geometry[2, i] ** 2 + geometry[3, i] ** 2)
                    off = max(off, abs(geometry[0, i]) / slope)
                project_block(here, 6, normals, here)
                if off <= tolerance:
                    break
        for i in range(count):
            for lane in range(6):
                states[start + i, lane] = y[lane, i]


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
    """Do what `flow` does, for many rays; after a leap of all of them the budget may be spent.

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
