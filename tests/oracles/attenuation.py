"""The attenuation integral in plain numpy, ray by ray."""

import numpy as np

from creeping.geodesics.attenuation import (
    DIP,
    GAUSS,
    curvature_values,
    fine_rules,
    gauss_rule,
    lagrange,
    sampling,
    searching,
)
from creeping.geodesics.equations import vector_field
from creeping.geodesics.hermite import NEAREST
from creeping.geometry.speed import speed_of, speed_values


def extend(values, time, now, total, end):
    """Carry A (n,) and the times of detachment (n,) over one leap, in place.

    Parameters
    ----------
    values : (n, NODES)
        c^(3/2) kappa_n at the Chebyshev times of the leap.
    time : float
        Of the leap.
    now : (n,)
        Time at its start.
    """
    points, weights = gauss_rule()
    sampled = values @ sampling().T
    alive = np.isinf(end)
    whole = alive & np.all(sampled > 0, axis=1)
    total[whole] += time * (sampled[whole, :GAUSS] ** (2 / 3) @ weights)
    for row in np.flatnonzero(alive & ~whole):
        root = first_zero(values[row])
        # no zero after all: the dip lies beyond an end, by rounding
        total[row] += time * _until(min(root, 1.0), values[row], points, weights)
        if root <= 1.0:
            end[row] = now[row] + root * time


def _until(zero, values, points, weights, nodes=None):
    """Integral of max(g, 0)^(2/3) up to the zero, of the polynomial g through values at the nodes."""
    g = lagrange(zero * (1 - points**3), nodes) @ values
    return 3 * zero * float(np.sum(weights * points**2 * np.maximum(g, 0.0) ** (2 / 3)))


def first_zero(values, matrix=None, nodes=None):
    """First zero in [0, 1] of the polynomial through the values at the nodes, inf without one.

    The matrix gives its values at equally spaced points; both are those of a leap unless given.
    """
    matrix = searching() if matrix is None else matrix
    steps = len(matrix) - 1
    below = np.flatnonzero(matrix @ values <= 0)
    if not len(below):
        return np.inf
    if below[0] == 0:
        return 0.0
    low, high = (below[0] - 1) / steps, below[0] / steps
    for _ in range(50):
        middle = 0.5 * (low + high)
        if float((lagrange(np.array([middle]), nodes) @ values)[0]) > 0:
            low = middle
        else:
            high = middle
    return float(high)


def jets(body, states):
    """(x, x', x'') of rays: states (..., 6 or more) -> (..., 3, 3); x'' = c u' + (grad c.x') u with a weight."""
    x, u = states[..., :3], states[..., 3:6]
    first, turning = vector_field(body, x, u)
    speed = speed_of(body)
    if speed is not None:
        faster = np.sum(speed.gradient(x) * first, axis=-1, keepdims=True)
        turning = speed_values(body, x)[..., None] * turning + faster * u
    return np.stack([x, first, turning], axis=-2)


def extend_along(body, states, fine, place, out):
    """Carry A and the time of detachment over all fine intervals, in place.

    Parameters
    ----------
    body : Surface
    states : (n, times, 6 or 10)
        At the fine times; ten lanes are copied to ``out``.
    fine : Sliding
        Their intervals, with the Gauss points of `fine_rules`.
    place : (m,)
        Numbers of the outputs among the fine times.
    out : (n, m, 12)
        The last two lanes are filled; out[:, 0] holds their values at the start.
    """
    total, end = out[:, 0, 10].copy(), out[:, 0, 11].copy()
    if states.shape[2] == 10:
        out[..., :10] = states[:, place]
    points, weights, nodes, search, refined, refined_weights = fine_rules()
    known = jets(body, states[:, fine.knots])
    at_times = curvature_values(body, states.reshape(-1, states.shape[2])).reshape(states.shape[:2])
    for k, time in enumerate(fine.times):
        if k > 0:
            now, first = fine.times[k - 1], fine.first[k - 1]
            nearest = known[:, first : first + NEAREST].reshape(len(states), -1, 3)
            x, v = fine.position[k - 1] @ nearest, fine.velocity[k - 1] @ nearest
            inside = np.concatenate([x, v / np.linalg.norm(v, axis=-1, keepdims=True)], axis=-1)
            values = curvature_values(body, inside.reshape(-1, 6)).reshape(x.shape[:2])
            values = np.concatenate([at_times[:, [k - 1]], values, at_times[:, [k]]], axis=1)
            grown = (time - now) * (np.maximum(values[:, 1:-1], 0.0) ** (2 / 3) @ weights)
            dips = np.min(values, axis=1) <= DIP * np.max(values, axis=1)
            for row in np.flatnonzero(np.isinf(end) & dips):
                root = first_zero(values[row], search, nodes)
                if np.isinf(root):
                    grown[row] = (time - now) * (np.maximum(refined @ values[row], 0.0) ** (2 / 3) @ refined_weights)
                else:
                    grown[row] = (time - now) * _until(root, values[row], points, weights, nodes)
                    total[row] += grown[row]
                    end[row] = now + root * (time - now)
            total += np.where(np.isinf(end), grown, 0.0)
        out[:, place == k, 10], out[:, place == k, 11] = total[:, None], end[:, None]
