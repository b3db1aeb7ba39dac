"""The attenuation integral along a ray, and where the creeping ray ends.

    A(t) = int_0^t c max(kappa_n, 0)^(2/3) dt,  up to the first zero of kappa_n: there the ray detaches and A stays

kappa_n is smooth, its power is not. Over one leap g = c^(3/2) kappa_n is known at NODES Chebyshev times; the power is
taken of the polynomial through them, at Gauss times. In the leap that ends at a zero t1, t = t1 (1 - s^3) makes
g^(2/3) dt smooth again, since g goes like t1 - t.
"""

from collections.abc import Callable
from functools import cache

import numpy as np

from creeping._typing import FloatArray
from creeping.phaseflow.geodesic import natural_horizon, normal_curvature, speed_of, speed_values
from creeping.phaseflow.tracing import compiled_parts, trace_states
from creeping.surface import Surface

NODES = 8
GAUSS = 12
SEARCH = 32
"""Intervals of a leap in which the first zero is looked for."""


@cache
def chebyshev_times() -> FloatArray:
    """Chebyshev points of the unit interval, ascending: (NODES,)."""
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES))


@cache
def gauss_rule() -> tuple[FloatArray, FloatArray]:
    """Gauss points and weights of the unit interval: (GAUSS,), (GAUSS,)."""
    points, weights = np.polynomial.legendre.leggauss(GAUSS)
    return 0.5 * (points + 1), 0.5 * weights


def lagrange(at: FloatArray) -> FloatArray:
    """Values of the Lagrange polynomials of the Chebyshev points: (m,) -> (m, NODES)."""
    nodes = chebyshev_times()
    basis = np.ones((len(at), NODES))
    for j in range(NODES):
        for k in range(NODES):
            if j != k:
                basis[:, j] *= (at - nodes[k]) / (nodes[j] - nodes[k])
    return basis


@cache
def sampling() -> FloatArray:
    """From values at the Chebyshev points to those at the Gauss points and both ends: (GAUSS + 2, NODES)."""
    return lagrange(np.concatenate([gauss_rule()[0], [0.0, 1.0]]))


@cache
def searching() -> FloatArray:
    """From values at the Chebyshev points to equally spaced ones: (SEARCH + 1, NODES)."""
    return lagrange(np.linspace(0, 1, SEARCH + 1))


@cache
def halves() -> FloatArray:
    """From values at the Chebyshev points of two halves to those of the whole: (NODES, 2 NODES)."""
    times = chebyshev_times()
    first = times < 0.5
    out = np.zeros((NODES, 2 * NODES))
    out[first, :NODES] = lagrange(2 * times[first])
    out[~first, NODES:] = lagrange(2 * times[~first] - 1)
    return out


@cache
def kernel_rules() -> tuple[FloatArray, ...]:
    """What the kernels need to know of all this: see `_attenuation.extend`."""
    return (sampling(), searching(), *gauss_rule(), chebyshev_times())


def curvature_values(body: Surface, states: FloatArray) -> FloatArray:
    """c^(3/2) kappa_n at states (n, 6 or more): (n,)."""
    compiled = compiled_parts(body)
    if compiled is None:
        kappa = normal_curvature(body, states[:, :3], states[:, 3:6])
        return np.asarray(kappa * speed_values(body, states[:, :3]) ** 1.5) if speed_of(body) is not None else kappa
    from creeping.phaseflow._attenuation import curvatures

    out = np.empty(len(states))
    curvatures(*compiled, np.ascontiguousarray(states), out)
    return out


def extend(values: FloatArray, time: float, now: FloatArray, total: FloatArray, end: FloatArray) -> None:
    """Carry A (n,) and the times of detachment (n,) over one leap, in place; the numpy twin of the kernel.

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
        part = min(root, 1.0)
        s = lagrange(part * (1 - points**3)) @ values[row]
        total[row] += 3 * part * time * float(np.sum(weights * points**2 * np.maximum(s, 0.0) ** (2 / 3)))
        if root <= 1.0:
            end[row] = now[row] + root * time


def first_zero(values: FloatArray) -> float:
    """First zero in [0, 1] of the polynomial through the values at the Chebyshev points, inf without one."""
    fine = searching() @ values
    below = np.flatnonzero(fine <= 0)
    if not len(below):
        return np.inf
    if below[0] == 0:
        return 0.0
    low, high = (below[0] - 1) / SEARCH, below[0] / SEARCH
    for _ in range(50):
        middle = 0.5 * (low + high)
        if float((lagrange(np.array([middle])) @ values)[0]) > 0:
            low = middle
        else:
            high = middle
    return float(high)


def with_attenuation(
    body: Surface,
    states: FloatArray,
    times: FloatArray,
    transport: Callable[[FloatArray, FloatArray], FloatArray],
    *,
    rtol: float,
) -> FloatArray:
    """Advance states (n, 12) by a transport of ten lanes, tracing again between the times for the last two."""
    from creeping.phaseflow._attenuation import extend_all

    out = np.empty((len(states), len(times), 12))
    out[..., :10] = transport(states[:, :10], times)
    total, end = states[:, 10].copy(), states[:, 11].copy()
    longest = natural_horizon(body)
    before, now = states[:, :6], 0.0
    for k, time in enumerate(times):
        parts = int(np.ceil((float(time) - now) / longest - 1e-9))
        if parts > 0:
            step = (float(time) - now) / parts
            inside = step * (np.arange(parts)[:, None] + chebyshev_times()).ravel()
            traced = trace_states(body, before, inside, rtol=rtol, step=step)
            values = curvature_values(body, traced.reshape(-1, 6)).reshape(len(states), parts, NODES)
            for part in range(parts):
                one = np.ascontiguousarray(values[:, part])
                extend_all(one, kernel_rules(), step, now + part * step, total, end)
        out[:, k, 10], out[:, k, 11] = total, end
        before, now = out[:, k, :6], float(time)
    return out
