"""Compiled sums over flat triangles of weights w times ∫ e^{ik q.x} dS, q one vector or another.

The phase is linear on a triangle: with u and v those of two corners relative to the third, φ0,

    ∫ e^{iφ} dS = 2A e^{iφ0} I,   I = (g(u) - g(v))/(i(u - v)),   g(x) = (e^{ix} - 1)/(ix) = e^{ix/2} sin(x/2)/(x/2)

φ0 is that of the corner opposite to the side whose phases differ most, so that only where all are alike,
|u - v| < NEAR, differences cancel: there, with h_j the sum of u^a v^b over a + b = j,

    I = Σ_j i^j h_j/(j + 2)!,   j < TERMS

Source: Derivations, F13.
"""

import math

from numba import njit

from creeping.kernels.block import entry_options, options
from creeping.kernels.turns import cosine_sine

NEAR, TERMS = 0.2, 8
"""Difference of phases below which the integral is its series, and terms of that: the next is below 1e-12."""


@njit(**options)
def _ramp(x):
    """Real and imaginary part of g."""
    c, s = cosine_sine(x / (4 * math.pi))
    ratio = 2 * s / x if x != 0.0 else 1.0
    return c * ratio, s * ratio


@njit(**options)
def _series(u, v):
    """Real and imaginary part of I where u - v is small."""
    real = imaginary = 0.0
    power, high, factor, turn = 1.0, 1.0, 0.5, 0
    for j in range(TERMS):
        term = factor * power
        real += term if turn == 0 else (-term if turn == 2 else 0.0)
        imaginary += term if turn == 1 else (-term if turn == 3 else 0.0)
        high *= v
        power = power * u + high
        factor /= j + 3
        turn = (turn + 1) % 4
    return real, imaginary


@njit(**entry_options)
def triangle_waves(corners, vectors, weights, out):
    """Fill out (m, 2, w), real and imaginary parts, for vectors k q (m, 3), 1/L.

    Parameters
    ----------
    corners : (t, 3, 3), L
    weights : (t, w)
        2A is a factor of them.
    """
    columns = weights.shape[1]
    for row in range(vectors.shape[0]):
        qx, qy, qz = vectors[row, 0], vectors[row, 1], vectors[row, 2]
        for part in range(2):
            for column in range(columns):
                out[row, part, column] = 0.0
        for t in range(corners.shape[0]):
            a = qx * corners[t, 0, 0] + qy * corners[t, 0, 1] + qz * corners[t, 0, 2]
            b = qx * corners[t, 1, 0] + qy * corners[t, 1, 1] + qz * corners[t, 1, 2]
            c = qx * corners[t, 2, 0] + qy * corners[t, 2, 1] + qz * corners[t, 2, 2]
            ab, bc, ca = abs(a - b), abs(b - c), abs(c - a)
            if ab >= bc and ab >= ca:
                base, u, v = c, a - c, b - c
            elif bc >= ca:
                base, u, v = a, b - a, c - a
            else:
                base, u, v = b, c - b, a - b
            if abs(u - v) < NEAR:
                real, imaginary = _series(u, v)
            else:
                fr, fi = _ramp(u)
                gr, gi = _ramp(v)
                real, imaginary = (fi - gi) / (u - v), (gr - fr) / (u - v)
            turned, sine = cosine_sine(base / (2 * math.pi))
            wave, across = real * turned - imaginary * sine, real * sine + imaginary * turned
            for column in range(columns):
                out[row, 0, column] += wave * weights[t, column]
                out[row, 1, column] += across * weights[t, column]
