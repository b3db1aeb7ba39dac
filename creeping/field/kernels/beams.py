"""Compiled sums of Gaussian beams at points of the body.

A point belongs to a ray's beam at each foot of it: there g = (y - x).p falls through 0. The foot is found between two
steps, n = (y - x).b with the arc for its chord, and

    (V + M n V') exp{log B + ik [S + (M/2) n^2]}

is added to each component, log B, S, M, V and V' linear between the steps. Points are reached from blocks of SPAN
steps only if those are near.
"""

import math

import numpy as np
from numba import njit

from creeping.kernels.block import strict_options

STEEPEST = 0.6
"""Height of a point above the tangent plane at a foot, over its distance: beyond, it is on another side of a body."""
SPAN = 16


@njit(**strict_options)
def spans_of(points, centres, radii):
    """Centres (rays, spans, 3) and radii (rays, spans) of balls around blocks of steps of points (rays, steps, 3)."""
    steps = points.shape[1]
    for ray in range(points.shape[0]):
        for span in range(centres.shape[1]):
            first, last = span * SPAN, min((span + 1) * SPAN, steps - 1)
            middle = points[ray, (first + last) // 2]
            far = 0.0
            for i in range(first, last + 1):
                square = 0.0
                for c in range(3):
                    square += (points[ray, i, c] - middle[c]) ** 2
                far = max(far, square)
            centres[ray, span] = middle
            radii[ray, span] = math.sqrt(far)


@njit(**strict_options)
def add_beams(
    at, points, tangents, sides, bend, S, amplitude, phase, M, k, cut, reach, centres, radii, V, lean, early, late
):
    """Add beams at the points ``at`` (n, 3) to ``early`` and ``late`` (n, c), by their feet before and behind ``cut``.

    points, tangents p and sides b (rays, steps, 3); bend = kappa_t, S, amplitude and phase of B (rays, steps) and the
    complex M with them; V and lean = V' (rays, steps, c) or (1, 1, c) if all are the same; ``cut`` is a step. Beams
    reach as far as ``reach``.
    """
    rays, steps = S.shape
    same = V.shape[0] == 1 and V.shape[1] == 1
    for j in range(at.shape[0]):
        x, y, z = at[j, 0], at[j, 1], at[j, 2]
        for ray in range(rays):
            for span in range(centres.shape[1]):
                a, b, c = x - centres[ray, span, 0], y - centres[ray, span, 1], z - centres[ray, span, 2]
                if a * a + b * b + c * c > (reach + radii[ray, span]) ** 2:
                    continue
                begin, end = span * SPAN, min((span + 1) * SPAN, steps - 1)
                before = 0.0
                for i in range(begin, end + 1):
                    a, b, c = x - points[ray, i, 0], y - points[ray, i, 1], z - points[ray, i, 2]
                    g = a * tangents[ray, i, 0] + b * tangents[ray, i, 1] + c * tangents[ray, i, 2]
                    square = a * a + b * b + c * c
                    # along n = p x b: a foot that the point stands high above or deep below is on another side
                    up = a * (tangents[ray, i, 1] * sides[ray, i, 2] - tangents[ray, i, 2] * sides[ray, i, 1])
                    up += b * (tangents[ray, i, 2] * sides[ray, i, 0] - tangents[ray, i, 0] * sides[ray, i, 2])
                    up += c * (tangents[ray, i, 0] * sides[ray, i, 1] - tangents[ray, i, 1] * sides[ray, i, 0])
                    beside = square < reach * reach and up * up <= STEEPEST * STEEPEST * square
                    if i > begin and before > 0.0 and g <= 0.0 and beside:
                        o, t = i - 1, before / (before - g)
                        n = 0.0
                        for e in range(3):
                            foot = points[ray, o, e] + t * (points[ray, i, e] - points[ray, o, e])
                            side = sides[ray, o, e] + t * (sides[ray, i, e] - sides[ray, o, e])
                            n += (at[j, e] - foot) * side
                        n *= 1.0 + (bend[ray, o] * n) ** 2 / 6.0
                        curve = M[ray, o] + t * (M[ray, i] - M[ray, o])
                        size = amplitude[ray, o] + t * (amplitude[ray, i] - amplitude[ray, o])
                        turn = phase[ray, o] + t * (phase[ray, i] - phase[ray, o])
                        way = S[ray, o] + t * (S[ray, i] - S[ray, o])
                        beam = np.exp(size + 1j * turn + 1j * k * (way + 0.5 * curve * n * n))
                        first, row, then = ray, o, i
                        if same:
                            first, row, then = 0, 0, 0
                        for e in range(V.shape[2]):
                            value = V[first, row, e] + t * (V[first, then, e] - V[first, row, e])
                            aside = lean[first, row, e] + t * (lean[first, then, e] - lean[first, row, e])
                            part = beam * (value + curve * n * aside)
                            if o < cut:
                                early[j, e] += part
                            else:
                                late[j, e] += part
                    before = g
