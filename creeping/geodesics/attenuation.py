"""The attenuation integral along a ray, and where the creeping ray ends.

    A(t) = int_0^t c max(kappa_n, 0)^(2/3) dt,  up to the first zero of kappa_n: there the ray detaches and A stays

kappa_n is smooth, its power is not. Over one leap of a map g = c^(3/2) kappa_n is known at NODES Chebyshev times, and
the power is taken of the polynomial through them, at Gauss times. Of a traced ray g is known at the Gauss times
themselves, from the polynomial of the ray (`hermite`), and at both ends of an interval: these are the nodes there. In
the interval that ends at a zero t1, t = t1 (1 - s^3) makes g^(2/3) dt smooth again, since g goes like t1 - t.

Sources: Derivations, R13.
"""

from collections.abc import Callable
from contextlib import suppress
from functools import cache
from weakref import WeakKeyDictionary

import numpy as np

from creeping._typing import FloatArray, IntArray
from creeping.errors import IntegrationError
from creeping.geodesics.equations import natural_horizon, speed_of, speed_values, vector_field
from creeping.geodesics.hermite import NEAREST, Sliding, sliding
from creeping.geodesics.integrator import compiled_parts, trace_states
from creeping.geometry.curvature import normal_curvature
from creeping.geometry.surface import Surface
from creeping.kernels.threads import CHUNK, in_threads

NODES = 8
GAUSS = 12
SEARCH = 32
"""Intervals of a leap in which the first zero is looked for."""
FINE_GAUSS, FINE_SEARCH = NODES - 2, 16
"""Gauss points of an interval of a traced ray, and parts of it in which the first zero is looked for."""
DIP, REFINED = 0.2, 3
"""Least over greatest curvature of an interval below which each of its parts is integrated, at so many Gauss points."""
WORKSPACE = 2**24
"""Numbers that the states at fine times may take."""

_horizons: WeakKeyDictionary[Surface, float] = WeakKeyDictionary()


@cache
def chebyshev_times() -> FloatArray:
    """Chebyshev points of the unit interval, ascending: (NODES,)."""
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES))


@cache
def gauss_rule(count: int = GAUSS) -> tuple[FloatArray, FloatArray]:
    """Gauss points and weights of the unit interval: (count,), (count,)."""
    points, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * (points + 1), 0.5 * weights


def lagrange(at: FloatArray, nodes: FloatArray | None = None) -> FloatArray:
    """Values of the Lagrange polynomials of NODES points, of the Chebyshev points unless given: (m,) -> (m, NODES)."""
    nodes = chebyshev_times() if nodes is None else nodes
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
    """What the kernels need to know of all this: see `geodesics.kernels.attenuation.extend`."""
    return (sampling(), searching(), *gauss_rule(), chebyshev_times())


@cache
def fine_rules() -> tuple[FloatArray, ...]:
    """Rules of the unit interval for a traced ray, of the polynomial through both ends and the Gauss points.

    Returns
    -------
    points, weights : (FINE_GAUSS,)
        Of Gauss.
    nodes : (NODES,)
    searching : (FINE_SEARCH + 1, NODES)
        From values at the nodes to equally spaced ones.
    refined, refined_weights : (FINE_SEARCH REFINED, NODES), (FINE_SEARCH REFINED,)
        To the Gauss points of each part, and their weights.
    """
    points, weights = gauss_rule(FINE_GAUSS)
    nodes = np.concatenate([[0.0], points, [1.0]])
    inside, part_weights = gauss_rule(REFINED)
    parts = np.arange(FINE_SEARCH)[:, None]
    refined = lagrange(((parts + inside) / FINE_SEARCH).ravel(), nodes)
    searching = lagrange(np.linspace(0, 1, FINE_SEARCH + 1), nodes)
    return points, weights, nodes, searching, refined, np.tile(part_weights / FINE_SEARCH, FINE_SEARCH)


def curvature_values(body: Surface, states: FloatArray) -> FloatArray:
    """c^(3/2) kappa_n at states (n, 6 or more): (n,)."""
    compiled = compiled_parts(body)
    if compiled is None:
        kappa = normal_curvature(body, states[:, :3], states[:, 3:6])
        return np.asarray(kappa * speed_values(body, states[:, :3]) ** 1.5) if speed_of(body) is not None else kappa
    from creeping.geodesics.kernels.attenuation import curvatures

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
        total[row] += time * _until(min(root, 1.0), values[row], points, weights)
        if root <= 1.0:
            end[row] = now[row] + root * time


def _until(
    zero: float, values: FloatArray, points: FloatArray, weights: FloatArray, nodes: FloatArray | None = None
) -> float:
    """Integral of max(g, 0)^(2/3) up to the zero, of the polynomial g through values at the nodes."""
    g = lagrange(zero * (1 - points**3), nodes) @ values
    return 3 * zero * float(np.sum(weights * points**2 * np.maximum(g, 0.0) ** (2 / 3)))


def first_zero(values: FloatArray, matrix: FloatArray | None = None, nodes: FloatArray | None = None) -> float:
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


def jets(body: Surface, states: FloatArray) -> FloatArray:
    """(x, x', x'') of rays: states (..., 6 or more) -> (..., 3, 3); x'' = c u' + (grad c.x') u with a weight."""
    x, u = states[..., :3], states[..., 3:6]
    first, turning = vector_field(body, x, u)
    speed = speed_of(body)
    if speed is not None:
        faster = np.sum(speed.gradient(x) * first, axis=-1, keepdims=True)
        turning = speed_values(body, x)[..., None] * turning + faster * u
    return np.stack([x, first, turning], axis=-2)


def extend_along(body: Surface, states: FloatArray, fine: Sliding, place: IntArray, out: FloatArray) -> None:
    """Carry A and the time of detachment over all fine intervals, in place; the numpy twin of the kernel.

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


def fine_spacing(body: Surface, rtol: float, step: float | None = None) -> float:
    """Longest time between two fine times of a ray traced with a relative tolerance.

    Measured on an ellipsoid, a torus and a twisted ellipsoid: half a natural horizon, taken for rtol = 1e-8, leaves an
    rms error of A after T = 8 of 2e-7 at most, about that of (x, p). The error is like the spacing's 12th power.
    """
    try:
        horizon = _horizons[body]
    except (KeyError, TypeError):
        horizon = natural_horizon(body)
        # finding it takes as long as tracing a fan; a body of the user's may offer neither a hash nor weak references
        with suppress(TypeError):
            _horizons[body] = horizon
    spacing = 0.5 * horizon * float(min(1.0, 1e8 * rtol) ** (1 / 12))
    # whole steps, or the trace would take more of them
    return spacing if step is None or step > spacing else step * float(np.floor(spacing / step))


def with_attenuation(
    body: Surface,
    states: FloatArray,
    times: FloatArray,
    *,
    rtol: float,
    step: float | None = None,
    transport: Callable[[FloatArray, FloatArray], FloatArray] | None = None,
) -> FloatArray:
    """Advance states (n, 12) to the ascending times (m,) by one trace: (n, m, 12).

    Parameters
    ----------
    body, states, times
        As for `trace_states`.
    rtol : float
        Relative tolerance per step, which sets the spacing of the fine times as well.
    step : float, optional
        Longest of equal steps, taken instead of adapted ones.
    transport : callable, optional
        Gives the first ten lanes of the result instead of the trace.
    """
    times = np.asarray(times, dtype=float)
    out = np.empty((len(states), len(times), 12))
    if transport is not None:
        out[..., :10] = transport(states[:, :10], times)
    spacing = fine_spacing(body, rtol, step)
    # differences of times next to the smallest number would underflow
    ends = np.unique(times[times > 1e-100 * spacing])
    if not len(ends):
        out[...] = states[:, None]
        return out
    fine = sliding(ends, spacing, fine_rules()[0])
    place = np.searchsorted(fine.times, np.where(times >= ends[0], times, 0.0))
    lanes = 10 if transport is None else 6
    adapted = rtol if step is None else 0.0
    rays = max(1, WORKSPACE // (lanes * len(fine.times) * CHUNK)) * CHUNK
    for start in range(0, len(states), rays):
        part = slice(start, start + rays)
        out[part, 0, 10:] = states[part, 10:]
        # the traced states bear no name here, or two slices would be in memory at once
        _along(body, _traced(body, states[:, :lanes], part, fine.times, adapted, step), fine, place, out[part])
    return out


def _traced(
    body: Surface, states: FloatArray, part: slice, times: FloatArray, rtol: float, step: float | None
) -> FloatArray:
    """`trace_states` of a part of the rays, its errors in numbers of all."""
    try:
        return trace_states(body, states[part], times, rtol=rtol, step=step)
    except IntegrationError as error:
        if part.start == 0:
            raise
        failed = np.asarray(vars(error)["failed"]) + part.start
        raise IntegrationError(f"of the rays from {part.start} on, {error}", failed=failed) from None


def _along(body: Surface, states: FloatArray, fine: Sliding, place: IntArray, out: FloatArray) -> None:
    """What `extend_along` does, by the kernel where the body has one."""
    compiled = compiled_parts(body)
    if compiled is None:
        extend_along(body, states, fine, place, out)
        return
    from creeping.geodesics.kernels.attenuation import extend_along as kernel

    def run(part: slice) -> None:
        kernel(*compiled, states[part], *fine, (*fine_rules(), DIP), place, out[part])

    in_threads(run, len(states))
