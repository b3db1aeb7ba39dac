"""Compiled sums over the pairs of points x and nodes y that are near to each other, found by cells of the nodes.

    value  D = E/R,   slope  -D',   G = e^{ikR}/R = S + D (`creeping.field.equation.split_sums`)
    entries   w value,   w slope n.(x - y)/R;   vectors   w slope (y - x)/R x J

A node that is x itself has no D: its value takes S off but for ik, what (e^{ikR} - 1)/R is there.

Also here: compiled matrices of the sums over nodes y at points x, by all pairs.

f_x g_y times one of

    dG/dn_y + s_y G,    dG/dn_x,    s_y G,    p.[grad_x G (n_x.q) - q (n_x.grad_x G)]

G = e^{ikR}/R, R = |x - y|; p is one of two tangents at x, q one of two at y. A node that is x itself gives nothing.

Also here: compiled sums over currents at nodes x_n of a body: phases of distant observers, and point sources.

    distant   S_c(r) = sum_n w_cn e^{-ik r.x_n}
    near      u(y) = sum_n [a_n + b_n n_n.(y - x_n) (1/R - ik)/R] e^{ikR}/R,   R = |y - x_n|
    curl      H(y) = sum_n (ik - 1/R) e^{ikR}/R^2 (y - x_n) x J_n
    electric  E(y) = sum_n (ik - 1/R + w) e^{ikR}/R J_n - (ik - 3/R + 3w) e^{ikR}/R^3 (y - x_n) (y - x_n).J_n
              w = 1/(ik R^2) = -i/(k R^2)

Phases are taken in turns, for polynomials vectorise (`creeping.kernels.exponential`).

Sources: [CK13, sec. 3.1 and 6.2]; [CK13, sec. 2.2 and 6.2]; Derivations, F35, F36 and F16.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import entry_options, options, strict_inlined
from creeping.kernels.exponential import cosine_sine

TOUCHING = 1e-6
"""Distance, over 1/k, below which a node is the point itself."""

PART = 1024
"""Nodes whose phases are held at a time."""


@njit(**options)
def _span(place, origin, side, cells, reach):
    """First and last cell along an axis that may be within reach of a place."""
    first = math.floor((place - reach - origin) / side)
    last = math.floor((place + reach - origin) / side)
    # a place that is far off all cells has the next one, whose nodes are too far
    return min(max(first, 0), cells - 1), min(max(last, 0), cells - 1)


@njit(**options)
def _spans(x, j, origin, side, cells, reach):
    """`_span` along all axes, of point number j."""
    a0, b0 = _span(x[0, j], origin[0], side, cells[0], reach)
    a1, b1 = _span(x[1, j], origin[1], side, cells[1], reach)
    a2, b2 = _span(x[2, j], origin[2], side, cells[2], reach)
    return a0, b0, a1, b1, a2, b2


@njit(**strict_inlined)
def _squared(dx, dy, dz):
    """R^2, the same in whatever kernel: those that are counted as near are those that are filled in."""
    return dx * dx + dy * dy + dz * dz


@njit(**entry_options)
def count_near(x, y, origin, side, cells, begins, reach, first, last, out):
    """Fill out[first:last] (m,) with how many nodes are within reach of points x (3, m).

    Nodes y (3, n) are ordered by cells of a ``side`` from an ``origin`` (3,), ``cells`` (3,) of them along each axis,
    last axis fastest; those of cell number c are from begins[c] to begins[c + 1].
    """
    close = reach * reach
    for j in range(first, last):
        x0, x1, x2 = x[0, j], x[1, j], x[2, j]
        a0, b0, a1, b1, a2, b2 = _spans(x, j, origin, side, cells, reach)
        count = 0
        for c0 in range(a0, b0 + 1):
            for c1 in range(a1, b1 + 1):
                row = (c0 * cells[1] + c1) * cells[2]
                for i in range(begins[row + a2], begins[row + b2 + 1]):
                    dx, dy, dz = x0 - y[0, i], x1 - y[1, i], x2 - y[2, i]
                    count += 1 if _squared(dx, dy, dz) < close else 0
        out[j] = count


@njit(**options)
def _pair(square, k, table, step, at_zero):
    """Value and slope of a pair."""
    if square < (TOUCHING / k) ** 2:
        return -at_zero, 0.0
    R = math.sqrt(square)
    inverse = 1.0 / R
    place = R / step
    row = min(int(place), table.shape[0] - 2)
    u = place - row
    v = 1.0 - u
    # Hermite's cubics: the second derivative is known, too
    keep, take, rise, fall = v * v * (1 + 2 * u), u * u * (3 - 2 * u), u * v * v * step, -u * u * v * step
    E = keep * table[row, 0] + take * table[row + 1, 0] + rise * table[row, 1] + fall * table[row + 1, 1]
    dE = keep * table[row, 1] + take * table[row + 1, 1] + rise * table[row, 2] + fall * table[row + 1, 2]
    return E * inverse, (E * inverse - dE) * inverse


@njit(**entry_options)
def fill_near(
    x, normals, y, sides, weights, origin, side, cells, begins, order, reach, k, table, at_zero, tilted, tilt_of_x,
    starts, first, last, columns, entries,
):  # fmt: skip
    """Fill rows first..last of a sparse matrix: columns and entries.

    As for `count_near`; ``order`` (n,) has the numbers of the nodes as ordered, ``starts`` (m + 1,) where rows begin.
    Entries are values, or ``tilted`` by the ``normals`` (3, m) of x or the ``sides`` (3, n) of y.
    """
    close, step = reach * reach, reach / (table.shape[0] - 1)
    for j in range(first, last):
        x0, x1, x2 = x[0, j], x[1, j], x[2, j]
        n0, n1, n2 = normals[0, j], normals[1, j], normals[2, j]
        a0, b0, a1, b1, a2, b2 = _spans(x, j, origin, side, cells, reach)
        place = starts[j]
        for c0 in range(a0, b0 + 1):
            for c1 in range(a1, b1 + 1):
                row = (c0 * cells[1] + c1) * cells[2]
                for i in range(begins[row + a2], begins[row + b2 + 1]):
                    dx, dy, dz = x0 - y[0, i], x1 - y[1, i], x2 - y[2, i]
                    square = _squared(dx, dy, dz)
                    if not square < close:
                        continue
                    value, slope = _pair(square, k, table, step, at_zero)
                    if tilted:
                        lean = n0 * dx + n1 * dy + n2 * dz
                        if not tilt_of_x:
                            lean = sides[0, i] * dx + sides[1, i] * dy + sides[2, i] * dz
                        lean /= math.sqrt(max(square, (TOUCHING / k) ** 2))
                        value = slope * lean
                    columns[place] = order[i]
                    entries[place] = weights[i] * value
                    place += 1


@njit(**entry_options)
def near_vectors(
    x, y, currents, origin, side, cells, begins, reach, k, table, at_zero, first, last, out
):  # fmt: skip
    """Fill rows first..last of out (m, p, 6) with w slope (y - x)/R x J of p waves, real and imaginary parts.

    As for `fill_near`; ``currents`` (n, p, 6) are w J at the nodes as ordered, real parts of its components first.
    """
    close, step = reach * reach, reach / (table.shape[0] - 1)
    for j in range(first, last):
        x0, x1, x2 = x[0, j], x[1, j], x[2, j]
        a0, b0, a1, b1, a2, b2 = _spans(x, j, origin, side, cells, reach)
        out[j] = 0.0
        for c0 in range(a0, b0 + 1):
            for c1 in range(a1, b1 + 1):
                row = (c0 * cells[1] + c1) * cells[2]
                for i in range(begins[row + a2], begins[row + b2 + 1]):
                    dx, dy, dz = y[0, i] - x0, y[1, i] - x1, y[2, i] - x2
                    square = _squared(dx, dy, dz)
                    if not square < close or square < (TOUCHING / k) ** 2:
                        continue
                    slope = _pair(square, k, table, step, at_zero)[1] / math.sqrt(square)
                    for q in range(currents.shape[1]):
                        J = currents[i, q]
                        r0, r1, r2 = dy * J[2] - dz * J[1], dz * J[0] - dx * J[2], dx * J[1] - dy * J[0]
                        i0, i1, i2 = dy * J[5] - dz * J[4], dz * J[3] - dx * J[5], dx * J[4] - dy * J[3]
                        out[j, q, 0] += slope * r0
                        out[j, q, 1] += slope * r1
                        out[j, q, 2] += slope * r2
                        out[j, q, 3] += slope * i0
                        out[j, q, 4] += slope * i1
                        out[j, q, 5] += slope * i2


@njit(**entry_options)
def scalar_pairs(x, n, f, y, sides, g, single, k, tilt, first, last, out):
    """Fill rows first..last of out (m, nodes, 2): real and imaginary parts.

    Points x and normals n (3, m), nodes y and theirs ``sides`` (3, nodes). ``tilt`` is 0 for G alone, 1 for dG/dn_y, 2
    for dG/dn_x; ``single`` (2, nodes) is s, or has no column.
    """
    per, count, layer = k / (2 * math.pi), y.shape[1], single.shape[1] > 0
    # real and imaginary parts side by side would keep the loop from vectors
    room = np.empty((2, count))
    for i in range(first, last):
        x0, x1, x2 = x[0, i], x[1, i], x[2, i]
        n0, n1, n2 = n[0, i], n[1, i], n[2, i]
        for j in range(count):
            d0, d1, d2 = x0 - y[0, j], x1 - y[1, j], x2 - y[2, j]
            square = d0 * d0 + d1 * d1 + d2 * d2
            there = 1.0 if square > 0.0 else 0.0
            inverse = there / math.sqrt(square if square > 0.0 else 1.0)
            c, s = cosine_sine(per * square * inverse)
            c, s = c * inverse, s * inverse
            # grad_x G = (ik - 1/R) G (x - y)/R
            lean = 0.0
            if tilt == 1:
                lean = -(sides[0, j] * d0 + sides[1, j] * d1 + sides[2, j] * d2) * inverse
            elif tilt == 2:
                lean = (n0 * d0 + n1 * d1 + n2 * d2) * inverse
            real, imaginary = lean * (-c * inverse - k * s), lean * (k * c - s * inverse)
            if layer:
                real += single[0, j] * c - single[1, j] * s
                imaginary += single[0, j] * s + single[1, j] * c
            scale = f[i] * g[j]
            room[0, j], room[1, j] = scale * real, scale * imaginary
        for j in range(count):
            out[i, j, 0], out[i, j, 1] = room[0, j], room[1, j]


@njit(**entry_options)
def vector_pairs(x, n, a, b, f, y, c, e, g, k, first, last, out):
    """Fill rows first..last of out (m, 2, nodes, 2, 2): p = a, b (3, m) and q = c, e (3, nodes), and both parts."""
    per, count = k / (2 * math.pi), y.shape[1]
    # few arrays, and no parts side by side: else the loop is not one of vectors
    of, room = np.empty((10, count)), np.empty((8, count))
    for row in range(3):
        for j in range(count):
            of[row, j], of[3 + row, j], of[6 + row, j], of[9, j] = y[row, j], c[row, j], e[row, j], g[j]
    for i in range(first, last):
        x0, x1, x2, n0, n1, n2 = x[0, i], x[1, i], x[2, i], n[0, i], n[1, i], n[2, i]
        a0, a1, a2, b0, b1, b2, share = a[0, i], a[1, i], a[2, i], b[0, i], b[1, i], b[2, i], f[i]
        for j in range(count):
            d0, d1, d2 = x0 - of[0, j], x1 - of[1, j], x2 - of[2, j]
            square = d0 * d0 + d1 * d1 + d2 * d2
            there = 1.0 if square > 0.0 else 0.0
            inverse = there / math.sqrt(square if square > 0.0 else 1.0)
            cosine, sine = cosine_sine(per * square * inverse)
            scale = share * of[9, j] * inverse * inverse
            real, imaginary = scale * (-cosine * inverse - k * sine), scale * (k * cosine - sine * inverse)
            lean, ad, bd = n0 * d0 + n1 * d1 + n2 * d2, a0 * d0 + a1 * d1 + a2 * d2, b0 * d0 + b1 * d1 + b2 * d2
            c0, c1, c2, e0, e1, e2 = of[3, j], of[4, j], of[5, j], of[6, j], of[7, j], of[8, j]
            nc, ne = n0 * c0 + n1 * c1 + n2 * c2, n0 * e0 + n1 * e1 + n2 * e2
            h0 = ad * nc - (a0 * c0 + a1 * c1 + a2 * c2) * lean
            h1 = ad * ne - (a0 * e0 + a1 * e1 + a2 * e2) * lean
            h2 = bd * nc - (b0 * c0 + b1 * c1 + b2 * c2) * lean
            h3 = bd * ne - (b0 * e0 + b1 * e1 + b2 * e2) * lean
            room[0, j], room[1, j], room[2, j], room[3, j] = real * h0, imaginary * h0, real * h1, imaginary * h1
            room[4, j], room[5, j], room[6, j], room[7, j] = real * h2, imaginary * h2, real * h3, imaginary * h3
        for row in range(2):
            for j in range(count):
                for column in range(2):
                    at = 4 * row + 2 * column
                    out[i, row, j, column, 0], out[i, row, j, column, 1] = room[at, j], room[at + 1, j]


@njit(**entry_options)
def distant(turns, real, imaginary, r, out):
    """Fill out (m, 2 C), real parts of the C sums before their imaginary parts.

    turns (3, n) are k x/2 pi, real and imaginary (C, n) the weights, r (m, 3) unit directions.
    """
    n, columns = turns.shape[1], real.shape[0]
    cosines, sines = np.empty(PART), np.empty(PART)
    out[:] = 0.0
    for first in range(0, n, PART):
        count = min(PART, n - first)
        x, y, z = turns[0, first : first + count], turns[1, first : first + count], turns[2, first : first + count]
        for j in range(r.shape[0]):
            rx, ry, rz = -r[j, 0], -r[j, 1], -r[j, 2]
            for i in range(count):
                cosines[i], sines[i] = cosine_sine(rx * x[i] + ry * y[i] + rz * z[i])
            for column in range(columns):
                a, b = real[column, first : first + count], imaginary[column, first : first + count]
                p, q = 0.0, 0.0
                for i in range(count):
                    p += a[i] * cosines[i] - b[i] * sines[i]
                    q += a[i] * sines[i] + b[i] * cosines[i]
                out[j, column] += p
                out[j, columns + column] += q


@njit(**entry_options)
def near(x, normals, single, double, k, y, out):
    """Fill out (m, 2 C), real parts of u at points y (m, 3) for each of C columns before their imaginary parts.

    x and normals (3, n), single and double (2, C, n) the weights a and b, real before imaginary parts.
    """
    n, columns = x.shape[1], single.shape[1]
    per = k / (2 * math.pi)
    cosines, sines, close, far = np.empty(PART), np.empty(PART), np.empty(PART), np.empty(PART)
    out[:] = 0.0
    for first in range(0, n, PART):
        count = min(PART, n - first)
        last = first + count
        x0, x1, x2 = x[0, first:last], x[1, first:last], x[2, first:last]
        n0, n1, n2 = normals[0, first:last], normals[1, first:last], normals[2, first:last]
        for j in range(y.shape[0]):
            y0, y1, y2 = y[j, 0], y[j, 1], y[j, 2]
            for i in range(count):
                dx, dy, dz = y0 - x0[i], y1 - x1[i], y2 - x2[i]
                inverse = 1.0 / math.sqrt(dx * dx + dy * dy + dz * dz)
                c, s = cosine_sine(per / inverse)
                lean = (n0[i] * dx + n1[i] * dy + n2[i] * dz) * inverse
                # b n.R (1/R - ik), over R
                cosines[i], sines[i], close[i], far[i] = c * inverse, s * inverse, lean * inverse, lean * k
            for column in range(columns):
                a, b = single[0, column, first:last], single[1, column, first:last]
                d, e = double[0, column, first:last], double[1, column, first:last]
                p, q = 0.0, 0.0
                for i in range(count):
                    u = a[i] + d[i] * close[i] + e[i] * far[i]
                    v = b[i] + e[i] * close[i] - d[i] * far[i]
                    p += u * cosines[i] - v * sines[i]
                    q += u * sines[i] + v * cosines[i]
                out[j, column] += p
                out[j, columns + column] += q


@njit(**entry_options)
def curl(x, real, imaginary, k, y, out):
    """Fill out (m, 6), real and imaginary parts of H at points y (m, 3); real and imaginary (3, n) are those of J."""
    n = x.shape[1]
    per = k / (2 * math.pi)
    for j in range(y.shape[0]):
        hx, hy, hz, gx, gy, gz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(n):
            dx, dy, dz = y[j, 0] - x[0, i], y[j, 1] - x[1, i], y[j, 2] - x[2, i]
            inverse = 1.0 / math.sqrt(dx * dx + dy * dy + dz * dz)
            c, s = cosine_sine(per / inverse)
            # (ik - 1/R) e^{ikR}/R^2
            square = inverse * inverse
            u, v = -(k * s + inverse * c) * square, (k * c - inverse * s) * square
            ax, ay, az = real[0, i], real[1, i], real[2, i]
            bx, by, bz = imaginary[0, i], imaginary[1, i], imaginary[2, i]
            px, py, pz = u * ax - v * bx, u * ay - v * by, u * az - v * bz
            qx, qy, qz = u * bx + v * ax, u * by + v * ay, u * bz + v * az
            hx, hy, hz = hx + dy * pz - dz * py, hy + dz * px - dx * pz, hz + dx * py - dy * px
            gx, gy, gz = gx + dy * qz - dz * qy, gy + dz * qx - dx * qz, gz + dx * qy - dy * qx
        out[j, 0], out[j, 1], out[j, 2], out[j, 3], out[j, 4], out[j, 5] = hx, hy, hz, gx, gy, gz


@njit(**entry_options)
def electric(x, real, imaginary, k, y, out):
    """Fill out (m, 6), real and imaginary parts of E at points y (m, 3); real and imaginary (3, n) are those of J."""
    n = x.shape[1]
    per = k / (2 * math.pi)
    for j in range(y.shape[0]):
        ex, ey, ez, fx, fy, fz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(n):
            dx, dy, dz = y[j, 0] - x[0, i], y[j, 1] - x[1, i], y[j, 2] - x[2, i]
            inverse = 1.0 / math.sqrt(dx * dx + dy * dy + dz * dz)
            c, s = cosine_sine(per / inverse)
            c, s = c * inverse, s * inverse
            turn = k - inverse * inverse / k
            lean = (k - 3.0 * inverse * inverse / k) * inverse * inverse
            square = inverse * inverse * inverse
            # (ik - 1/R + w) e^{ikR}/R and -(ik - 3/R + 3w) e^{ikR}/R^3
            u, v = -turn * s - inverse * c, turn * c - inverse * s
            p, q = lean * s + 3.0 * square * c, 3.0 * square * s - lean * c
            ax, ay, az = real[0, i], real[1, i], real[2, i]
            bx, by, bz = imaginary[0, i], imaginary[1, i], imaginary[2, i]
            a, b = dx * ax + dy * ay + dz * az, dx * bx + dy * by + dz * bz
            g, h = p * a - q * b, p * b + q * a
            ex, ey, ez = ex + u * ax - v * bx + g * dx, ey + u * ay - v * by + g * dy, ez + u * az - v * bz + g * dz
            fx, fy, fz = fx + u * bx + v * ax + h * dx, fy + u * by + v * ay + h * dy, fz + u * bz + v * az + h * dz
        out[j, 0], out[j, 1], out[j, 2], out[j, 3], out[j, 4], out[j, 5] = ex, ey, ez, fx, fy, fz
