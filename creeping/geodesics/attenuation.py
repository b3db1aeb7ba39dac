"""The attenuation integral along a ray, and where the creeping ray ends.

    A(t) = int_0^t c max(kappa_n, 0)^(2/3) dt,  up to the first zero of kappa_n: there the ray detaches and A stays

kappa_n is smooth, its power is not. Over one leap of a map g = c^(3/2) kappa_n is known at NODES Chebyshev times, and
the power is taken of the polynomial through them, at Gauss times. Of a traced ray g is known at the Gauss times
themselves, from the polynomial of the ray (`hermite`), and at both ends of an interval: these are the nodes there. In
the interval that ends at a zero t1, t = t1 (1 - s^3) makes g^(2/3) dt smooth again, since g goes like t1 - t.

Sources: Derivations, R13.
"""

from collections.abc import Callable
from functools import cache

import numpy as np

from creeping._typing import FloatArray, IntArray
from creeping.errors import IntegrationError
from creeping.geodesics.equations import natural_horizon, vector_field
from creeping.geodesics.hermite import NEAREST, Sliding, sliding
from creeping.geodesics.integrator import MAX_STEPS, trace_states
from creeping.geometry.evaluators import evaluators, speed_of
from creeping.geometry.surface import Surface
from creeping.kernels.threads import CHUNK, in_slices, in_threads

NODES = 8
GAUSS = 12
SEARCH = 32
"""Intervals of a leap in which the first zero is looked for."""
FINE_GAUSS, FINE_SEARCH = NODES - 2, 16
"""Gauss points of an interval of a traced ray, and parts of it in which the first zero is looked for."""
DIP, REFINED = 0.2, 3
"""Least over greatest curvature of an interval below which each of its parts is integrated, at so many Gauss points."""
TOGETHER = 512
"""Most rays at a time: what lies between their knots takes some 20 MB then."""
WORKSPACE = 2**24
"""Numbers that the states at fine times may take."""


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
    from creeping.geodesics.kernels.attenuation import curvatures

    out = np.empty(len(states))
    states = np.ascontiguousarray(states)
    with evaluators(body) as parts:
        in_slices(lambda some: curvatures(*parts, states[some], out[some]), len(states))
    return out


def fine_spacing(body: Surface, rtol: float, step: float | None = None) -> float:
    """Longest time between two fine times of a ray traced with a relative tolerance.

    Measured on an ellipsoid, a torus and a twisted ellipsoid: half a natural horizon, taken for rtol = 1e-8, leaves an
    rms error of A after T = 8 of 2e-7 at most, about that of (x, p). The error is like the spacing's 12th power.
    """
    spacing = 0.5 * natural_horizon(body) * float(min(1.0, 1e8 * rtol) ** (1 / 12))
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
    limit: int = MAX_STEPS,
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
    limit : int
        Most steps between fine times, as for `trace_states`.
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
        _along(body, _traced(body, states[:, :lanes], part, fine.times, adapted, step, limit), fine, place, out[part])
    return out


def _traced(
    body: Surface, states: FloatArray, part: slice, times: FloatArray, rtol: float, step: float | None, limit: int
) -> FloatArray:
    """`trace_states` of a part of the rays, its errors in numbers of all."""
    try:
        return trace_states(body, states[part], times, rtol=rtol, step=step, limit=limit)
    except IntegrationError as error:
        if part.start == 0:
            raise
        failed = np.asarray(vars(error)["failed"]) + part.start
        raise IntegrationError(f"of the rays from {part.start} on, {error}", failed=failed) from None


def _along(body: Surface, states: FloatArray, fine: Sliding, place: IntArray, out: FloatArray) -> None:
    """Carry A and the time of detachment over all fine intervals, in place.

    Parameters
    ----------
    body : Surface
    states : (n, times, 6 or 10)
        At the fine times; ten components are copied to ``out``.
    fine : Sliding
        Their intervals, with the Gauss points of `fine_rules`.
    place : (m,)
        Numbers of the outputs among the fine times.
    out : (n, m, 12)
        The last two components are filled; out[:, 0] holds their values at the start.
    """
    from creeping.geodesics.kernels.attenuation import extend_along as kernel

    if states.shape[2] > 6:
        out[..., : states.shape[2]] = states[:, place]

    def run(part: slice) -> None:
        kernel(_bent(body, states[part, :, :6], fine), fine.times, (*fine_rules(), DIP), place, out[part])

    in_threads(run, len(states), most=TOGETHER)


def _bent(body: Surface, states: FloatArray, fine: Sliding) -> FloatArray:
    """c^(3/2) kappa_n at the ends of each fine interval and at the Gauss points between: (intervals, NODES, n)."""
    x, p = states[:, fine.knots, :3], states[:, fine.knots, 3:]
    along, turning = vector_field(body, x, p)
    speed = speed_of(body)
    if speed is not None:
        turning = speed.value(x)[..., None] * turning + np.sum(speed.gradient(x) * along, axis=-1, keepdims=True) * p
    # x, x', x'' at the knots around each interval, by rows
    jets = np.stack([x, along, turning], axis=2)
    around = jets[:, fine.first[:, None] + np.arange(NEAREST)].reshape(len(states), len(fine.first), 3 * NEAREST, 3)
    between = np.concatenate([fine.position @ around, fine.velocity @ around], axis=-1)
    bent = np.empty((len(fine.first), NODES, len(states)))
    ends = curvature_values(body, states.reshape(-1, 6)).reshape(states.shape[:2]).T
    bent[:, 0], bent[:, -1] = ends[:-1], ends[1:]
    inside = curvature_values(body, between.reshape(-1, 6)).reshape(between.shape[:3])
    bent[:, 1:-1] = np.moveaxis(inside, 0, 2)
    return bent
