"""Compiled integrals over tiles near to points x, with the polynomials l_j that are 1 at one node of a tile.

    mode 0   I_j = int l_j dG/dn_y dS              mode 1   as well int l_j G dS
    mode 2   I_j = int l_j grad_x G dS             G = e^{ikR}/R,   R = |x - y|

A tile is a square of 0 <= u, v <= 1 on which x, x_u and x_v are polynomials. It is halved until its parts are no larger
than their distance from x; each is integrated by Gauss's rule. Parts that have been halved up to twice along u and v
serve all points. About a node of its own, polar coordinates in the tangent plane take the singularity away, from the
node to each of the four sides.

Also here: those of mode 2 for a current that is tangent to the tile. With J_f = sum_j l_j(y_f) [q_j - n_f (n_f.q_j)] at
finer nodes f the entries p.[I_f (n.J_f) - J_f (n.I_f)] of p = a, b at x, where n is the normal, are

    (p.I_j) (n.q_j) - (p.q_j) (n.I_j) - sum_f l_j(y_f) [(p.I_f) (n.n_f) - (n.I_f) (p.n_f)] n_f.q_j,
    I_j = sum_f l_j(y_f) I_f

Sources: [DR84]; Derivations, F36.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import entry_options, options, strict_options
from creeping.kernels.exponential import cosine_sine


@njit(**strict_options)
def _cardinal(nodes, weights, at, out):
    """Fill the polynomials (n,) of nodes (n,), with barycentric weights, at a place."""
    total = 0.0
    for j in range(nodes.shape[0]):
        away = at - nodes[j]
        out[j] = weights[j] / (away if away != 0.0 else 1e-300)
        total += out[j]
    for j in range(nodes.shape[0]):
        out[j] /= total


@njit(**strict_options)
def _place(table, at_u, at_v, out):
    """Fill x, x_u, x_v (9,) where the polynomials of the grid are at_u and at_v (n,)."""
    out[:] = 0.0
    for i in range(at_u.shape[0]):
        for j in range(at_v.shape[0]):
            e = at_u[i] * at_v[j]
            for c in range(9):
                out[c] += e * table[i, j, c]


@njit(**options)
def _set(q, scale, at, by):
    """Put point number ``at`` and n dS there into places (6, ...), of x, x_u, x_v q and the weight of the rule."""
    for c in range(3):
        by[c, at] = q[c]
    by[3, at] = scale * (q[4] * q[8] - q[5] * q[7])
    by[4, at] = scale * (q[5] * q[6] - q[3] * q[8])
    by[5, at] = scale * (q[3] * q[7] - q[4] * q[6])


@njit(**strict_options)
def _terms(x, by, count, k, mode, out):
    """Fill out (6, count), real then imaginary parts of what a mode integrates at points and n dS ``by`` (6, count)."""
    per = k / (2 * math.pi)
    for i in range(count):
        d0, d1, d2 = x[0] - by[0, i], x[1] - by[1, i], x[2] - by[2, i]
        square = d0 * d0 + d1 * d1 + d2 * d2
        there = 1.0 if square > 0.0 else 0.0
        inverse = there / math.sqrt(square if square > 0.0 else 1.0)
        c, s = cosine_sine(per * square * inverse)
        c, s = c * inverse, s * inverse
        # grad_x G = (ik - 1/R) G (x - y)/R
        real, imaginary = (-c * inverse - k * s) * inverse, (k * c - s * inverse) * inverse
        n0, n1, n2 = by[3, i], by[4, i], by[5, i]
        if mode == 2:
            area = math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
            real, imaginary = real * area, imaginary * area
            out[0, i], out[1, i], out[2, i] = real * d0, real * d1, real * d2
            out[3, i], out[4, i], out[5, i] = imaginary * d0, imaginary * d1, imaginary * d2
        else:
            lean = -(n0 * d0 + n1 * d1 + n2 * d2)
            out[0, i], out[3, i] = real * lean, imaginary * lean
            if mode == 1:
                area = math.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
                out[1, i], out[4, i] = c * area, s * area


@njit(**strict_options)
def _part(
    table, grid, bary, nodes_u, weights_u, nodes_v, weights_v, rule, share, box, room, by, by_u, by_v, spot
):  # fmt: skip
    """Fill points and n dS (6, g g) of a part (u0, u1, v0, v1), the nodes' polynomials there, and its middle and sides.

    ``spot`` (5,) is the middle and the lengths along u and v.
    """
    at_u, at_v, q = room
    g = rule.shape[0]
    width, height = box[1] - box[0], box[3] - box[2]
    _cardinal(grid, bary, box[0] + 0.5 * width, at_u[0])
    _cardinal(grid, bary, box[2] + 0.5 * height, at_v[0])
    _place(table, at_u[0], at_v[0], q)
    spot[0], spot[1], spot[2] = q[0], q[1], q[2]
    spot[3] = width * math.sqrt(q[3] ** 2 + q[4] ** 2 + q[5] ** 2)
    spot[4] = height * math.sqrt(q[6] ** 2 + q[7] ** 2 + q[8] ** 2)
    for a in range(g):
        u, v = box[0] + width * rule[a], box[2] + height * rule[a]
        _cardinal(grid, bary, u, at_u[a])
        _cardinal(grid, bary, v, at_v[a])
        _cardinal(nodes_u, weights_u, u, by_u[a])
        _cardinal(nodes_v, weights_v, v, by_v[a])
    for a in range(g):
        for b in range(g):
            _place(table, at_u[a], at_v[b], q)
            _set(q, width * height * share[a] * share[b], a * g + b, by)


@njit(**strict_options)
def _add_part(terms, by_u, by_v, first, total):
    """Add the integrals over a part to total (6, p, p), of terms (6, g g) from ``first`` on by threes."""
    g, p = by_u.shape
    for c in range(6):
        if c % 3 >= first:
            continue
        for a in range(g):
            for j in range(p):
                row = 0.0
                for b in range(g):
                    row += terms[c, a * g + b] * by_v[b, j]
                for i in range(p):
                    total[c, i, j] += by_u[a, i] * row


@njit(**strict_options)
def _around(table, grid, bary, u0, v0, angles, share, radii, weight, room, by, at):
    """Fill points and n dS (6, ...) of the polar rules about (u0, v0), and their u and v ``at`` (2, ...)."""
    at_u, at_v, q = room
    _cardinal(grid, bary, u0, at_u[0])
    _cardinal(grid, bary, v0, at_v[0])
    _place(table, at_u[0], at_v[0], q)
    # [x_u, x_v] = Q B, B = [[along, lean], [0, across]]: places in the tangent plane are B (u - u0, v - v0)
    along = math.sqrt(q[3] ** 2 + q[4] ** 2 + q[5] ** 2)
    lean = (q[3] * q[6] + q[4] * q[7] + q[5] * q[8]) / along
    across = math.sqrt(max(q[6] ** 2 + q[7] ** 2 + q[8] ** 2 - lean * lean, 1e-300))
    count = 0
    for side in range(4):
        # corners at the ends of the side, counter-clockwise
        a0, b0 = (1.0 if side < 2 else 0.0) - u0, (1.0 if side == 1 or side == 2 else 0.0) - v0
        a1, b1 = (1.0 if side == 0 or side == 3 else 0.0) - u0, (1.0 if side < 2 else 0.0) - v0
        p0, q0 = along * a0 + lean * b0, across * b0
        p1, q1 = along * a1 + lean * b1, across * b1
        length = math.sqrt((p1 - p0) ** 2 + (q1 - q0) ** 2)
        t0, t1 = (p1 - p0) / length, (q1 - q0) / length
        low, high = p0 * t0 + q0 * t1, p1 * t0 + q1 * t1
        far = p0 * t1 - q0 * t0
        # next to a side the triangle between is so thin that rounding is all that would be integrated
        thin = 0.0 if far < 1e-7 * length else 1.0
        far = max(far, 1e-7 * length)
        # places along the side are far sinh(w): as many points next to the node's foot as far along a long side
        first, last = math.asinh(low / far), math.asinh(high / far)
        for a in range(angles.shape[0]):
            w = first + (last - first) * angles[a]
            c0, s0 = 1.0 / math.cosh(w), math.tanh(w)
            reach = far / c0
            dp, dq = c0 * t1 + s0 * t0, -c0 * t0 + s0 * t1
            dv = dq / across
            du = (dp - lean * dv) / along
            for b in range(radii.shape[0]):
                r = reach * radii[b]
                at[0, count], at[1, count] = u0 + r * du, v0 + r * dv
                _cardinal(grid, bary, at[0, count], at_u[0])
                _cardinal(grid, bary, at[1, count], at_v[0])
                _place(table, at_u[0], at_v[0], q)
                _set(q, thin * (last - first) * share[a] * c0 * reach * weight[b] * r / (along * across), count, by)
                count += 1


@njit(**entry_options)
def tile_rows(
    points, starts, targets, tables, grid, bary, nodes_u, weights_u, nodes_v, weights_v, rule, share, angles,
    angle_share, radii, radius_share, k, mode, apart, own, own_u, own_v, first, last, out,
):  # fmt: skip
    """Fill out (pairs, 6, p p) for the points that tiles first..last are near to.

    Parameters
    ----------
    points : (m, 3)
    starts : (t + 1,), targets : (pairs,)
        Points near tile number t: targets[starts[t]:starts[t + 1]].
    tables : (t, n, n, 9)
        x, x_u, x_v at the places of the grid (n,), with barycentric weights; nodes (p,) along u and v and theirs.
    rule, share : (g,)
        Gauss's rule; likewise of angles and radii.
    apart : float
        Least distance of the middle of a part that is not halved again, over its size.
    own : (m,)
        Number of the tile that a point is on, at ``own_u`` and ``own_v`` (m,); -1 if it is on none.
    """
    n, p, g = grid.shape[0], nodes_u.shape[0], rule.shape[0]
    polar = 4 * angles.shape[0] * radii.shape[0]
    room = (np.empty((max(g, 1), n)), np.empty((max(g, 1), n)), np.empty(9))
    # parts of up to two halvings along u and v, (2^3 - 1)^2 of them, and one of more
    slots = 49
    made = np.zeros(slots + 1, dtype=np.bool_)
    by, spots = np.empty((slots + 1, 6, g * g)), np.empty((slots + 1, 5))
    by_u, by_v = np.empty((slots + 1, g, p)), np.empty((slots + 1, g, p))
    terms, total = np.empty((6, max(polar, g * g))), np.empty((6, p, p))
    around, at, one_u, one_v = np.empty((6, polar)), np.empty((2, polar)), np.empty(p), np.empty(p)
    stack = np.empty((400, 4), dtype=np.int64)
    kinds = 3 if mode == 2 else mode + 1
    for t in range(first, last):
        table = tables[t]
        made[:] = False
        for pair in range(starts[t], starts[t + 1]):
            x = points[targets[pair]]
            total[:] = 0.0
            if own[targets[pair]] == t:
                u, v = own_u[targets[pair]], own_v[targets[pair]]
                _around(table, grid, bary, u, v, angles, angle_share, radii, radius_share, room, around, at)
                _terms(x, around, polar, k, mode, terms)
                for q in range(polar):
                    _cardinal(nodes_u, weights_u, at[0, q], one_u)
                    _cardinal(nodes_v, weights_v, at[1, q], one_v)
                    for c in range(6):
                        if c % 3 >= kinds:
                            continue
                        for i in range(p):
                            e = terms[c, q] * one_u[i]
                            for j in range(p):
                                total[c, i, j] += e * one_v[j]
            else:
                stack[0, :] = 0
                waiting = 1
                while waiting > 0:
                    waiting -= 1
                    # halvings along u and v, and which of the parts it is
                    lu, lv, iu, iv = stack[waiting, 0], stack[waiting, 1], stack[waiting, 2], stack[waiting, 3]
                    slot = slots
                    if lu <= 2 and lv <= 2:
                        slot = ((1 << lu) - 1 + iu) * 7 + (1 << lv) - 1 + iv
                    if slot == slots or not made[slot]:
                        width, height = 1.0 / (1 << lu), 1.0 / (1 << lv)
                        box = (iu * width, (iu + 1) * width, iv * height, (iv + 1) * height)
                        _part(
                            table, grid, bary, nodes_u, weights_u, nodes_v, weights_v, rule, share, box, room, by[slot],
                            by_u[slot], by_v[slot], spots[slot],
                        )  # fmt: skip
                        made[slot] = slot < slots
                    spot = spots[slot]
                    away = (x[0] - spot[0]) ** 2 + (x[1] - spot[1]) ** 2 + (x[2] - spot[2]) ** 2
                    size = max(spot[3], spot[4])
                    if away < (apart * size) ** 2 and max(lu, lv) < 12 and waiting < 396:
                        # of a long part only the longer side is halved
                        by_both = spot[3] <= 1.6 * spot[4] and spot[4] <= 1.6 * spot[3]
                        halve_u, halve_v = int(by_both or spot[3] > spot[4]), int(by_both or spot[4] > spot[3])
                        for a in range(1 + halve_u):
                            for b in range(1 + halve_v):
                                stack[waiting, 0], stack[waiting, 1] = lu + halve_u, lv + halve_v
                                stack[waiting, 2], stack[waiting, 3] = (iu << halve_u) + a, (iv << halve_v) + b
                                waiting += 1
                        continue
                    _terms(x, by[slot], g * g, k, mode, terms)
                    _add_part(terms, by_u[slot], by_v[slot], kinds, total)
            for c in range(6):
                for i in range(p):
                    for j in range(p):
                        out[pair, c, i * p + j] = total[c, i, j]


@njit(**entry_options)
def tangent_rows(found, tile, normals, a, b, finer, at_finer, q, first, last, out):
    """Fill out (pairs, 2, p p, 2) of currents that are tangent to their tiles, for pairs first..last.

    Parameters
    ----------
    found : (pairs, 3, f) complex
        I_f.
    tile : (pairs,)
    normals, a, b : (pairs, 3)
        n, and p.
    finer : (t, f, 3)
        n_f.
    at_finer : (f, p p)
        l_j(y_f).
    q : (t, p p, 2, 3)
        Both q_j.
    """
    count, nodes = at_finer.shape
    # I_f, n.I_f and what is along n_f of both p, real and imaginary parts
    terms, sums = np.empty((20, count)), np.empty((20, nodes))
    for i in range(first, last):
        t = tile[i]
        n0, n1, n2 = normals[i, 0], normals[i, 1], normals[i, 2]
        for f in range(count):
            m0, m1, m2 = finer[t, f, 0], finer[t, f, 1], finer[t, f, 2]
            across = n0 * m0 + n1 * m1 + n2 * m2
            i0, i1, i2 = found[i, 0, f], found[i, 1, f], found[i, 2, f]
            lean = n0 * i0 + n1 * i1 + n2 * i2
            terms[0, f], terms[1, f], terms[2, f], terms[3, f] = i0.real, i0.imag, i1.real, i1.imag
            terms[4, f], terms[5, f], terms[6, f], terms[7, f] = i2.real, i2.imag, lean.real, lean.imag
            for row in range(2):
                p = a if row == 0 else b
                p0, p1, p2 = p[i, 0], p[i, 1], p[i, 2]
                rest = (p0 * i0 + p1 * i1 + p2 * i2) * across - lean * (p0 * m0 + p1 * m1 + p2 * m2)
                at = 8 + 6 * row
                terms[at, f], terms[at + 1, f] = rest.real * m0, rest.imag * m0
                terms[at + 2, f], terms[at + 3, f] = rest.real * m1, rest.imag * m1
                terms[at + 4, f], terms[at + 5, f] = rest.real * m2, rest.imag * m2
        for row in range(20):
            for j in range(nodes):
                sums[row, j] = 0.0
            for f in range(count):
                value = terms[row, f]
                for j in range(nodes):
                    sums[row, j] += value * at_finer[f, j]
        for row in range(2):
            p = a if row == 0 else b
            p0, p1, p2 = p[i, 0], p[i, 1], p[i, 2]
            at = 8 + 6 * row
            for j in range(nodes):
                through = p0 * sums[0, j] + p1 * sums[2, j] + p2 * sums[4, j]
                turned = p0 * sums[1, j] + p1 * sums[3, j] + p2 * sums[5, j]
                for c in range(2):
                    q0, q1, q2 = q[t, j, c, 0], q[t, j, c, 1], q[t, j, c, 2]
                    nq, pq = n0 * q0 + n1 * q1 + n2 * q2, p0 * q0 + p1 * q1 + p2 * q2
                    real = sums[at, j] * q0 + sums[at + 2, j] * q1 + sums[at + 4, j] * q2
                    imaginary = sums[at + 1, j] * q0 + sums[at + 3, j] * q1 + sums[at + 5, j] * q2
                    out[i, row, j, c] = complex(
                        through * nq - pq * sums[6, j] - real, turned * nq - pq * sums[7, j] - imaginary
                    )
