"""The attenuation integral along a ray, and where the creeping ray ends.

    A(t) = int_0^t c max(kappa_n, 0)^(2/3) dt,  up to the first zero of kappa_n: there the ray detaches and A stays

kappa_n is smooth, its power is not. Over one leap of a map g = c^(3/2) kappa_n is known at NODES Chebyshev times, and
the power is taken of the polynomial through them, at Gauss times. Of a traced ray g is known at the Gauss times
themselves and at both ends of an interval: these are the nodes there. In the interval that ends at a zero t1,
t = t1 (1 - s^3) makes g^(2/3) dt smooth again, since g goes like t1 - t.

Between two of the fine times to which it is traced, the ray is the polynomial of degree 11 that agrees with x, x' and
x'' at the four knots t_j around,

    x(t) = sum_j sum_d H_jd(t) x^(d)(t_j),    H_jd(t) = tau^d/d! l_j(t)^3 sum_(i <= 2-d) c_ji tau^i,    tau = t - t_j,

l_j the Lagrange polynomials and c_ji the Taylor coefficients of l_j^-3 at t_j:

    c_j0 = 1,  c_j1 = -3 s_1,  c_j2 = (9 s_1^2 + 3 s_2)/2,    s_m = sum_(k != j) (t_j - t_k)^-m.

Fine times are 0, the outputs and, where these lie further apart than a spacing, times between them; knots are fine
times not too close to each other. H_jd depends on the times only, not on the ray.

Sources: Derivations, R3, R13 and R14.
"""

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from creeping._typing import FloatArray, IntArray
from creeping.errors import IntegrationError
from creeping.geodesics.equations import natural_horizon, vector_field
from creeping.geodesics.integrator import trace_each, trace_states
from creeping.geodesics.states import ATTENUATION, DETACHMENT, WHOLE
from creeping.geometry.evaluators import evaluators, speed_of
from creeping.geometry.patches import interpolation
from creeping.geometry.surface import Surface
from creeping.kernels.threads import BLOCK, in_slices, in_threads

NODES = 8
DIP = 0.2
"""Least over greatest curvature of an interval below which each of its parts is integrated."""
WORKSPACE = 2**24
"""Numbers that the states at fine times may take."""


@cache
def chebyshev_times() -> FloatArray:
    """Chebyshev points of the unit interval, ascending: (NODES,)."""
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES))


@cache
def gauss_rule(count: int = 12) -> tuple[FloatArray, FloatArray]:
    """Gauss points and weights of the unit interval: (count,), (count,)."""
    points, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * (points + 1), 0.5 * weights


@cache
def halves() -> FloatArray:
    """From values at the Chebyshev points of two halves to those of the whole: (NODES, 2 NODES)."""
    times = chebyshev_times()
    first = times < 0.5
    out = np.zeros((NODES, 2 * NODES))
    out[first, :NODES] = interpolation(times, 2 * times[first])
    out[~first, NODES:] = interpolation(times, 2 * times[~first] - 1)
    return out


@cache
def kernel_rules() -> tuple[FloatArray, ...]:
    """What the kernels need to know of all this: see `geodesics.kernels.attenuation.extend`.

    Matrices from values at the Chebyshev points to those at the Gauss points and both ends, (14, NODES), and to equally
    spaced ones, between which the first zero is looked for, (33, NODES); Gauss points and weights; Chebyshev points.
    """
    places = np.concatenate([gauss_rule()[0], [0.0, 1.0]]), np.linspace(0, 1, 33)
    return *(interpolation(chebyshev_times(), at) for at in places), *gauss_rule(), chebyshev_times()


@cache
def fine_rules() -> tuple[FloatArray, ...]:
    """Rules of the unit interval for a traced ray, of the polynomial through both ends and the Gauss points.

    Returns
    -------
    points, weights : (6,)
        Of Gauss.
    nodes : (NODES,)
    searching : (17, NODES)
        From values at the nodes to equally spaced ones, the ends of 16 parts.
    refined, refined_weights : (48, NODES), (48,)
        To three Gauss points of each part, and their weights.
    """
    points, weights = gauss_rule(NODES - 2)
    nodes = np.concatenate([[0.0], points, [1.0]])
    inside, part_weights = gauss_rule(3)
    refined = interpolation(nodes, ((np.arange(16)[:, None] + inside) / 16).ravel())
    return points, weights, nodes, interpolation(nodes, np.linspace(0, 1, 17)), refined, np.tile(part_weights / 16, 16)


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
    weights : (intervals, points, 2, 4, 3)
        Of x, x', x'' at each of the four knots in x and in x' at the points.
    """

    times: FloatArray
    knots: IntArray
    first: IntArray
    weights: FloatArray


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
    limit: int = 100_000,
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
    limit : int
        Most steps between fine times, as for `trace_states`.
    """
    times = np.asarray(times, dtype=float)
    out = np.empty((len(states), len(times), 12))
    spacing = fine_spacing(body, rtol, step)
    # differences of times next to the smallest number would underflow
    ends = np.unique(times[times > 1e-100 * spacing])
    if not len(ends):
        out[...] = states[:, None]
        return out
    fine = sliding(ends, spacing, fine_rules()[0])
    place = np.searchsorted(fine.times, np.where(times >= ends[0], times, 0.0))
    adapted = rtol if step is None else 0.0
    rays = max(1, WORKSPACE // (10 * len(fine.times) * BLOCK)) * BLOCK
    for start in range(0, len(states), rays):
        part = slice(start, start + rays)
        out[part, 0, 10:] = states[part, 10:]
        # the traced states bear no name here, or two slices would be in memory at once
        _along(body, _traced(body, states[:, :10], part, fine.times, adapted, step, limit), fine, place, out[part])
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
    states : (n, times, 10)
        At the fine times; they are copied to ``out``.
    fine : Sliding
        Their intervals, with the Gauss points of `fine_rules`.
    place : (m,)
        Numbers of the outputs among the fine times.
    out : (n, m, 12)
        The last two components are filled; out[:, 0] holds their values at the start.
    """
    from creeping.geodesics.kernels.attenuation import extend_along as kernel

    out[..., :10] = states[:, place]

    def run(part: slice) -> None:
        kernel(_bent(body, states[part, :, :6], fine), fine.times, (*fine_rules(), DIP), place, out[part])

    # what lies between the knots of 512 rays takes some 20 MB
    in_threads(run, len(states), most=512)


def _bent(body: Surface, states: FloatArray, fine: Sliding) -> FloatArray:
    """c^(3/2) kappa_n at the ends of each fine interval and at the Gauss points between: (intervals, NODES, n)."""
    from creeping.geodesics.kernels.attenuation import curvatures_between

    bent = np.empty((len(fine.first), NODES, len(states)))
    ends = curvature_values(body, states.reshape(-1, 6)).reshape(states.shape[:2])
    bent[:, 0], bent[:, -1] = ends.T[:-1], ends.T[1:]
    x, p, kappa = states[:, fine.knots, :3], states[:, fine.knots, 3:], ends[:, fine.knots]
    speed = speed_of(body)
    if speed is None:
        along, turning = vector_field(body, x, p, kappa)
    else:
        c = speed.value(x)
        along, turning = vector_field(body, x, p, kappa / c**1.5)
        turning = c[..., None] * turning + np.sum(speed.gradient(x) * along, axis=-1, keepdims=True) * p
    jets = np.concatenate([x, along, turning], axis=2)
    with evaluators(body) as parts:
        curvatures_between(*parts, jets, fine.first, fine.weights, bent)
    return bent


def trace_own(body: Any, states: FloatArray, times: FloatArray, *, rtol: float) -> FloatArray:
    """Trace states (n, 6, 10 or 12) of an unweighted body, each to its time (n,): (n, the same), NaN where it fails.

    Attenuation is a lane of the trace where kappa_n stays well above 0; elsewhere `with_attenuation` finds where rays
    detach. Where kappa_n <= 0 at the start, the ray detaches there.
    """
    if states.shape[1] < WHOLE:
        return trace_each(body, states, times, rtol=rtol)
    out = np.empty(states.shape)
    lanes = ATTENUATION + 1
    out[:, :lanes] = trace_each(body, states[:, :lanes], times, rtol=rtol)
    out[:, DETACHMENT] = states[:, DETACHMENT]
    creeping = np.isinf(states[:, DETACHMENT]) & np.all(np.isfinite(out[:, :lanes]), axis=1)
    first, last = curvature_values(body, states), curvature_values(body, np.nan_to_num(out))
    parted = creeping & ~(first > 0)
    out[parted, DETACHMENT] = 0.0
    stays = parted | np.isfinite(states[:, DETACHMENT])
    out[stays, ATTENUATION] = states[stays, ATTENUATION]
    low = creeping & (first > 0) & (np.minimum(first, last) < DIP * np.maximum(first, last))
    for time in np.unique(times[low]):
        rows = np.flatnonzero(low & (times == time))
        try:
            found = with_attenuation(body, states[rows], np.array([time]), rtol=rtol, step=None)[:, 0]
            out[rows, ATTENUATION:] = found[:, ATTENUATION:]
        except IntegrationError:
            out[rows] = np.nan
    return out


def sliding(outputs: FloatArray, spacing: float, points: FloatArray) -> Sliding:
    """Fine intervals for distinct ascending output times > 0; points (points,) of the open unit interval."""
    # so short a ray is its Taylor polynomial at 0: the Hermite polynomial would be rounding
    short = outputs[-1] < 1e-4 * spacing
    # gaps are at most 1.5 spacings: four knots at least
    spacing = min(spacing, float(outputs[-1]) / 4)
    fine = _divided(outputs, spacing)
    # at closer knots the polynomial magnifies the error of the trace
    kept = _apart(fine, 0.25 * spacing)
    knots = fine[kept]
    gap = np.searchsorted(knots, fine[:-1], side="right") - 1
    first = np.clip(gap - 1, 0, len(knots) - 4)
    nodes = knots[first[:, None] + np.arange(4)]
    # differences first: a point of an interval next to a knot must not fall onto it
    tau = (fine[:-1, None] - nodes)[:, None, :] + (np.diff(fine)[:, None] * points)[:, :, None]
    return Sliding(fine, kept, first, np.stack(_taylor(tau) if short else _hermite(tau, nodes), axis=2))


def _hermite(tau: FloatArray, nodes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """H_jd and its derivative at tau = t - t_j (n, points, k), t no knot; knots (n, k): (n, points, k, 3) each."""
    others = (np.arange(4)[:, None] + np.arange(1, 4)) % 4
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
