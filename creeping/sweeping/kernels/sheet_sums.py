"""Compiled sums over the sheets of a cell: the waves of incidences in it, and their errors.

    a = sum_j w_j a_j,   L = sum_j w_j L_j,   f = sum over sheets of a e^{ikL}
    e = max over errors' weights v of |sum_j v_j a_j| + k |a| |sum_j v_j L_j|

Sources: Derivations, F23.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import entry_options, options
from creeping.kernels.exponential import wave

REAL, IMAGINARY, ERROR, SQUARE, SIZE, SUMS = range(6)
"""Of an incidence, of all sheets of a kind: f, sum e, sum e^2 and sum |a|^2."""


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
