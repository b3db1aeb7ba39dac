"""Compiled sums over the pairs of points x and nodes y that are near to each other, found by cells of the nodes.

    value  D = E/R,   slope  -D',   G = e^{ikR}/R = S + D (`creeping.field.equation.smooth_kernel`)
    entries   w value,   w slope n.(x - y)/R;   vectors   w slope (y - x)/R x J

A node that is x itself has no D: its value takes S off but for ik, what (e^{ikR} - 1)/R is there.

Source: Derivations, F35.
"""

import math

from numba import njit

from creeping.kernels.block import entry_options, options, strict_inlined

TOUCHING = 1e-6
"""Distance, over 1/k, below which a node is the point itself."""


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
