"""A ray between the times to which it is traced: Hermite polynomials that slide along it.

At each knot, x, x' and x'' of the ray are known. Between two neighbouring fine times the ray is the polynomial of
degree 11 that agrees with all three at the NEAREST = 4 knots t_j around,

    x(t) = sum_j sum_d H_jd(t) x^(d)(t_j),    H_jd(t) = tau^d/d! l_j(t)^3 sum_(i <= 2-d) c_ji tau^i,    tau = t - t_j,

l_j the Lagrange polynomials and c_ji the Taylor coefficients of l_j^-3 at t_j:

    c_j0 = 1,  c_j1 = -3 s_1,  c_j2 = (9 s_1^2 + 3 s_2)/2,    s_m = sum_(k != j) (t_j - t_k)^-m.

Fine times are 0, the outputs and, where these lie further apart than a spacing, times between them; knots are fine
times not too close to each other. H_jd depends on the times only, not on the ray.

Sources: Derivations, R14.
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import FloatArray, IntArray

NEAREST = 4
"""Knots of a polynomial."""
CLOSEST = 0.25
"""Least gap between knots, in spacings: at closer ones the polynomial magnifies the error of the trace."""
SHORT = 1e-4
"""Length, in spacings, below which a ray is its Taylor polynomial at 0: the Hermite polynomial would be rounding."""


class Sliding(NamedTuple):
    """Fine intervals of the time axis, and the rays at Gauss times in them.

    Attributes
    ----------
    times : (intervals + 1,)
        Fine times, ascending, the first 0.
    knots : (knots,)
        Numbers of the knots among them.
    first : (intervals,)
        First of the knots of an interval's polynomial, by its number among the knots.
    position, velocity : (intervals, points, 3 NEAREST)
        From x, x', x'' at the first of the knots, at the second, and so on, to x and x' at the points.
    """

    times: FloatArray
    knots: IntArray
    first: IntArray
    position: FloatArray
    velocity: FloatArray


def sliding(outputs: FloatArray, spacing: float, points: FloatArray) -> Sliding:
    """Fine intervals for distinct ascending output times > 0; points (points,) of the open unit interval."""
    short = outputs[-1] < SHORT * spacing
    # gaps are at most 1.5 spacings: NEAREST knots at least
    spacing = min(spacing, float(outputs[-1]) / NEAREST)
    fine = _divided(outputs, spacing)
    kept = _apart(fine, CLOSEST * spacing)
    knots = fine[kept]
    gap = np.searchsorted(knots, fine[:-1], side="right") - 1
    first = np.clip(gap - (NEAREST // 2 - 1), 0, len(knots) - NEAREST)
    nodes = knots[first[:, None] + np.arange(NEAREST)]
    # differences first: a point of an interval next to a knot must not fall onto it
    tau = (fine[:-1, None] - nodes)[:, None, :] + (np.diff(fine)[:, None] * points)[:, :, None]
    position, velocity = _taylor(tau) if short else _hermite(tau, nodes)
    shape = len(first), len(points), 3 * NEAREST
    return Sliding(fine, kept, first, position.reshape(shape), velocity.reshape(shape))


def _hermite(tau: FloatArray, nodes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """H_jd and its derivative at tau = t - t_j (n, points, k), t no knot; knots (n, k): (n, points, k, 3) each."""
    others = (np.arange(NEAREST)[:, None] + np.arange(1, NEAREST)) % NEAREST
    inverse = 1 / (nodes[:, :, None] - nodes[:, others])
    s1, s2 = np.sum(inverse, axis=-1)[:, None], np.sum(inverse**2, axis=-1)[:, None]
    c1, c2 = -3 * s1, 4.5 * s1**2 + 1.5 * s2
    cube = np.prod(tau[..., others] * inverse[:, None], axis=-1) ** 3
    slope = 3 * cube * np.sum(1 / tau[..., others], axis=-1)
    value = np.stack([1 + c1 * tau + c2 * tau**2, tau + c1 * tau**2, 0.5 * tau**2], axis=-1)
    derivative = np.stack([c1 + 2 * c2 * tau, 1 + 2 * c1 * tau, tau], axis=-1)
    return cube[..., None] * value, cube[..., None] * derivative + slope[..., None] * value


def _taylor(tau: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What `_hermite` gives, of the first knot alone."""
    position, velocity = np.zeros((*tau.shape, 3)), np.zeros((*tau.shape, 3))
    t = tau[..., 0]
    position[..., 0, :] = np.stack([np.ones_like(t), t, 0.5 * t**2], axis=-1)
    velocity[..., 0, 1:] = np.stack([np.ones_like(t), t], axis=-1)
    return position, velocity


def _divided(outputs: FloatArray, spacing: float) -> FloatArray:
    """0, the outputs, and each interval between them in equal parts no longer than the spacing."""
    starts = np.concatenate([[0.0], outputs[:-1]])
    parts = np.maximum(np.ceil((outputs - starts) / spacing - 1e-9), 1).astype(int)
    last = np.cumsum(parts)
    number = np.arange(last[-1]) - np.repeat(last - parts, parts)
    inside = np.repeat(starts, parts) + np.repeat((outputs - starts) / parts, parts) * number
    return np.append(inside, outputs[-1])


def _apart(times: FloatArray, least: float) -> IntArray:
    """Numbers of times no two of which are closer than ``least``, the first and the last among them."""
    if np.all(np.diff(times) >= least):
        return np.arange(len(times))
    kept = [0]
    for number, time in enumerate(times):
        if time - times[kept[-1]] >= least:
            kept.append(number)
    # the last takes the place of a neighbour too close to it
    kept[-1] = len(times) - 1
    return np.array(kept)
