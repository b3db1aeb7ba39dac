"""Compiled sums over the nodes of cells, and their judging: the largest errors of each ray's numbers.

The numbers of one kind, w of each ray, are rows (nodes, rays w). Sums are those of `creeping.sweeping.between.stencil`.
A cell is judged along the lines of its stencil, whose six nodes have the differences D3 (three), D4 (two) and D5:

    error = max(FIFTH |D5|, FOURTH |D4|), KINK times that unless |D4| <= |D3|/2 and |D5| <= |D3|/4, the largest of each

What five of the nodes give differs from the six by at most 0.0118 |D5| on the cell, the inner four by 0.0234 |D4|. Of a
smooth function differences fall as their order grows, and six err by less than five; those of a kink do not fall. On
lines that are no sides of the cell errors count by their largest weights in it: a jump at a corner counts, too.

Compiled sums over the sheets of a cell: the waves of incidences in it, and their errors.

    a = sum_j w_j a_j,   L = sum_j w_j L_j,   f = sum over sheets of a e^{ikL}
    e = max over errors' weights v of |sum_j v_j a_j| + k |a| |sum_j v_j L_j|

Sources: Derivations, F23.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import entry_options, options
from creeping.kernels.exponential import wave

FIFTH, FOURTH = 1.5 * 0.0118, 0.0234 / 4
KINK = 4.0
"""With it the error of a kink is under-estimated by 2 at most nine times in ten, that of a smooth function never."""
WIDE = 64
"""Numbers at a time, whose sums stay in the caches."""

REAL, IMAGINARY, ERROR, SQUARE, SIZE, SUMS = range(6)
"""Of an incidence, of all sheets of a kind: f, sum e, sum e^2 and sum |a|^2."""


@njit(**options)
def _gather(numbers, stencil, begin, wide, rows):
    """Numbers of nodes from ``begin`` on to rows (nodes, WIDE); the last block is filled up with any of them."""
    for node in range(stencil.shape[0]):
        at = stencil[node]
        if wide == WIDE:
            for i in range(WIDE):
                rows[node, i] = numbers[at, begin + i]
        else:
            for i in range(WIDE):
                rows[node, i] = numbers[at, begin + min(i, wide - 1)]


@njit(**entry_options)
def cell_sums(numbers, stencils, first, weights, target, out):
    """Fill rows of out (.., n) with sums over the nodes of cells.

    Parameters
    ----------
    numbers : (nodes, n)
    stencils : (cells, m) of int
        Nodes of each cell; they are taken six by six in their order.
    first : (cells + 1,) of int
        First sum of each cell, and their number.
    weights : (sums, m)
    target : (sums,) of int
        Row of each sum in out.
    """
    n, m = numbers.shape[1], stencils.shape[1]
    rows, total = np.empty((m, WIDE)), np.empty(WIDE)
    for cell in range(stencils.shape[0]):
        for begin in range(0, n, WIDE):
            wide = min(WIDE, n - begin)
            _gather(numbers, stencils[cell], begin, wide, rows)
            for row in range(first[cell], first[cell + 1]):
                for i in range(WIDE):
                    total[i] = 0.0
                for o in range(0, m, 6):
                    a, b, c = weights[row, o], weights[row, o + 1], weights[row, o + 2]
                    d, e, f = weights[row, o + 3], weights[row, o + 4], weights[row, o + 5]
                    for i in range(WIDE):
                        half = a * rows[o, i] + b * rows[o + 1, i] + c * rows[o + 2, i]
                        total[i] += half + d * rows[o + 3, i] + e * rows[o + 4, i] + f * rows[o + 5, i]
                at = target[row]
                for i in range(wide):
                    out[at, begin + i] = total[i]


@njit(**options)
def _error(u, v, w, x, y, z):
    """Error of what six nodes of a line give between the third and the fourth."""
    a, b, c = x - 3.0 * (w - v) - u, y - 3.0 * (x - w) - v, z - 3.0 * (y - x) - w
    third = max(abs(a), abs(b), abs(c))
    d, e = b - a, c - b
    fourth, fifth = max(abs(d), abs(e)), abs(e - d)
    found = max(FIFTH * fifth, FOURTH * fourth)
    return found * (KINK if fourth > 0.5 * third or fifth > 0.25 * third else 1.0)


@njit(**entry_options)
def cell_errors(numbers, stencils, lines, largest, corners, scale, relative, out):
    """Raise out (cells, rays) to the largest errors of each ray's numbers in cells, times their scale.

    Parameters
    ----------
    numbers : (nodes, rays w)
    stencils : (cells, m) of int
    lines, largest : (k, 6) of int, (k,)
        Places in a stencil of the nodes along each of its lines, and what their errors count.
    corners : (c,) of int
    scale : float
    relative : bool
        Whether an error is one of 1 + the least size of the number at the corners.
    """
    n, rays = numbers.shape[1], out.shape[1]
    width = n // rays
    off, least = np.empty(n), np.empty(n)
    for cell in range(stencils.shape[0]):
        for i in range(n):
            off[i] = 0.0
        for line in range(lines.shape[0]):
            own, at, weight = stencils[cell], lines[line], largest[line]
            u, v, w = numbers[own[at[0]]], numbers[own[at[1]]], numbers[own[at[2]]]
            x, y, z = numbers[own[at[3]]], numbers[own[at[4]]], numbers[own[at[5]]]
            for i in range(n):
                off[i] = max(off[i], weight * _error(u[i], v[i], w[i], x[i], y[i], z[i]))
        if relative:
            for i in range(n):
                least[i] = abs(numbers[stencils[cell, corners[0]], i])
            for k in range(1, corners.shape[0]):
                u = numbers[stencils[cell, corners[k]]]
                for i in range(n):
                    least[i] = min(least[i], abs(u[i]))
            for i in range(n):
                off[i] /= 1.0 + scale * least[i]
        for ray in range(rays):
            for i in range(ray * width, (ray + 1) * width):
                out[cell, ray] = max(out[cell, ray], scale * off[i])


@njit(**options)
def _summed(amplitudes, paths, weights, real, imaginary):
    """Fill the parts (columns,) of a sum over nodes; returns that of the paths."""
    path = 0.0
    for k in range(len(real)):
        real[k] = 0.0
        imaginary[k] = 0.0
    for j in range(len(weights)):
        w = weights[j]
        path += w * paths[j]
        for k in range(len(real)):
            real[k] += w * amplitudes[j, 0, k]
            imaginary[k] += w * amplitudes[j, 1, k]
    return path


@njit(**entry_options)
def sheet_sums(amplitudes, paths, label, weights, errors, wavenumbers, out):
    """Add the sums of incidences to out (n, kinds, SUMS, columns).

    Parameters
    ----------
    amplitudes : (sheets, nodes, 2, columns)
        Real and imaginary part of a_j.
    paths : (sheets, nodes)
    label : (sheets,) of int
        Kind of each sheet; sheets are added one after the other.
    weights, errors : (n, nodes), (several, n, nodes)
    wavenumbers : (columns,)
    """
    columns = len(wavenumbers)
    a, b, size = np.empty(columns), np.empty(columns), np.empty(columns)
    c, d, off = np.empty(columns), np.empty(columns), np.empty(columns)
    for i in range(weights.shape[0]):
        for sheet in range(paths.shape[0]):
            path = _summed(amplitudes[sheet], paths[sheet], weights[i], a, b)
            for k in range(columns):
                size[k] = math.sqrt(a[k] * a[k] + b[k] * b[k])
                off[k] = 0.0
            for error in range(errors.shape[0]):
                turn = abs(_summed(amplitudes[sheet], paths[sheet], errors[error, i], c, d))
                for k in range(columns):
                    change = math.sqrt(c[k] * c[k] + d[k] * d[k]) + size[k] * wavenumbers[k] * turn
                    off[k] = max(off[k], change)
            total = out[i, label[sheet]]
            for k in range(columns):
                real, imaginary = wave(0.0, wavenumbers[k] * path)
                total[REAL, k] += a[k] * real - b[k] * imaginary
                total[IMAGINARY, k] += a[k] * imaginary + b[k] * real
                total[ERROR, k] += off[k]
                total[SQUARE, k] += off[k] * off[k]
                total[SIZE, k] += size[k] * size[k]
