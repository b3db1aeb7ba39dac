"""Direct integration of the geodesic flow by the order-8 Runge-Kutta pair of Dormand and Prince [HNW93, sec. II.10].

Blocks of rays advance with one step for the block. Each accepted step is put back on T1Q, and so are outputs between
the ends of a step, of the step's polynomial of order 7.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from creeping._typing import ArrayLike, FloatArray
from creeping.errors import IntegrationError, InvalidInputError
from creeping.geodesics.states import bundle_states, unpack
from creeping.geodesics.tableaus import DORMAND_PRINCE_8, Method, dense_weights
from creeping.geometry.arguments import checked_body, number_between, real_array
from creeping.geometry.evaluators import evaluators
from creeping.geometry.piecewise import checked_smooth
from creeping.geometry.surface import Surface, size
from creeping.kernels.threads import BLOCK, in_slices, in_threads, pause
from creeping.storage.memory import within_budget

BUDGET = 4000
"""Steps of blocks after which the kernel comes up for signals: 0.01 s of a closed form, 0.2 s of a spline."""


@dataclass(frozen=True)
class ErrorEstimate:
    """Error of a flow against direct integration.

    Attributes
    ----------
    rms, max : float
        Of |(x, p) - (x, p)_traced|, the norm in R^6, over the samples.
    samples : int
        Number of samples (x, p): random points with random unit tangents, or rays of a fan.

    Examples
    --------
    >>> import creeping as cr
    >>> cr.ErrorEstimate(rms=1e-9, max=4e-9, samples=100).samples
    100
    """

    rms: float
    max: float
    samples: int


def as_times(times: ArrayLike) -> tuple[FloatArray, bool]:
    """Times as an ascending array (m,), and whether a scalar was given.

    Raises
    ------
    InvalidInputError
        If they are not finite, negative, or not in ascending order.
    """
    t = real_array(times, "times")
    if t.ndim > 1:
        raise InvalidInputError(f"times have shape {t.shape}; give a number or a list of numbers")
    values = np.atleast_1d(t)
    if values.size == 0 or not np.all((values >= 0) & (values < np.inf)):
        raise InvalidInputError("times must be finite numbers >= 0; reverse the direction to go back")
    if values.size > 1 and np.any(values[1:] < values[:-1]):
        raise InvalidInputError("times must ascend; sort them")
    return values, t.ndim == 0


def trace(
    body: Surface, points: ArrayLike, directions: ArrayLike, times: ArrayLike, *, rtol: float = 1e-10
) -> tuple[FloatArray, FloatArray]:
    """Trace geodesics directly, without a phase map.

    Parameters
    ----------
    body : Surface
    points : (..., 3), L
        Starting points on the body.
    directions : (..., 3)
        Starting directions; projected onto the tangent plane and normalised.
    times : scalar or (m,), L (travel time for a weighted body)
        Ascending, >= 0.
    rtol : float
        Relative tolerance per step, absolute in units of the body's size; from 1e-14 to 1e-2.

    Returns
    -------
    points, directions : (..., 3) for a scalar time, (..., m, 3) else

    Raises
    ------
    InvalidInputError
        On bad points, directions, times or tolerance.
    IntegrationError
        If a ray does not reach its end.

    Examples
    --------
    >>> import numpy as np
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> x, p = cr.trace(sc.Sphere(), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), np.pi)       # half a great circle
    >>> bool(np.allclose(x, [-1, 0, 0])), bool(np.allclose(p, [0, -1, 0]))
    (True, True)
    """
    rtol = number_between(rtol, "rtol", 1e-14, 1e-2)
    values, scalar = as_times(times)
    checked_smooth(body, "creeping.trace", "take creeping.DirectFlow(body).flow instead")
    checked_body(body)
    states, shape = bundle_states(body, points, directions)
    return unpack(trace_states(body, states, values, rtol=rtol), shape, scalar)


def trace_states(
    body: Surface,
    states: FloatArray,
    times: FloatArray,
    *,
    rtol: float = 1e-10,
    step: float | None = None,
    method: Method = DORMAND_PRINCE_8,
    limit: int = 100_000,
    taken: list[int] | None = None,
) -> FloatArray:
    """Trace states (n, 6, 10 or 11) to the ascending times (m,): (n, m, the same).

    ``rtol = 0`` takes equal steps of at most ``step`` between outputs, by any ``method``; else it is the first.
    Rays that need more than ``limit`` steps between outputs, and those of their block, fail. ``taken`` gets the steps
    of blocks of rays, refused ones too.
    Lanes 6 to 9 are the columns of the Jacobi matrix of the metric ds/c, lane 10 the attenuation integral; see
    `creeping.geodesics.kernels.integrator`.

    Raises
    ------
    InvalidInputError
        On more lanes, or on a tolerance for a method that estimates no errors.
    IntegrationError
        If a ray does not reach its end; ``failed`` lists the rays.
    """
    if states.shape[1] > 11:
        raise InvalidInputError(f"states of {states.shape[1]} lanes; at most 11 are traced, see `attenuation`")
    if rtol > 0 and method != DORMAND_PRINCE_8:
        raise InvalidInputError("only the order-8 pair estimates its error; take equal steps, rtol=0")
    if step is None:
        step = 0.05 * size(body)
    from creeping.geodesics.kernels.integrator import integrate

    # twice, for callers take points and directions out of the states
    count = len(states) * len(times)
    within_budget(16.0 * states.shape[1] * count, f"{count} points of rays", "ask for fewer", asked=count)
    out = np.empty((len(states), len(times), states.shape[1]))
    states = np.ascontiguousarray(states, dtype=float)
    scale = error_scale(body, states.shape[1])
    ends = np.ascontiguousarray(times, dtype=float)
    taken = [] if taken is None else taken
    controls = scale, float(rtol), float(step), int(limit), BUDGET
    with evaluators(body) as parts:

        def run(part: slice) -> None:
            at, kept = np.zeros(8), np.empty((2, states.shape[1] * BLOCK))
            while not integrate(*parts, states[part], ends, method, dense_weights(), *controls, at, kept, out[part]):
                pause()
            taken.append(int(at[7]))

        in_threads(run, len(states), even=True)
    failed = np.flatnonzero(~np.all(np.isfinite(out), axis=(1, 2)))
    if len(failed):
        raise IntegrationError(
            f"{len(failed)} of {len(states)} rays left the finite numbers or needed more than {limit} steps "
            f"(first: ray {failed[0]}); "
            + (f"shorten the step {step:.3g}, unless that many are needed" if rtol == 0 else "run check_surface"),
            failed=failed,
        )
    return out


def trace_each(body: Surface, states: FloatArray, times: FloatArray, *, rtol: float) -> FloatArray:
    """Trace states (n, 6, 10 or 11) each to its time (n,): (n, the same), NaN of a ray that does not come there.

    Each ray has steps of its own by the relative tolerance, so that it does not depend on its company.
    """
    from creeping.geodesics.kernels.integrator import integrate_own

    states, out = np.ascontiguousarray(states, dtype=float), np.empty(states.shape)
    times = np.ascontiguousarray(times, dtype=float)
    # an interval takes a few steps, next to a tip some tens: a ray that takes 500 is given up
    controls = error_scale(body, states.shape[1]), rtol, 0.05 * size(body), 500
    with evaluators(body) as parts, np.errstate(all="ignore"):
        in_slices(lambda some: integrate_own(*parts, states[some], times[some], *controls, out[some]), len(states))
    return out


def error_scale(body: Surface, lanes: int) -> FloatArray:
    """Magnitude below which a lane's error counts absolutely: lengths for x and M12, 1 for the others.

    No x of the body, nor a p, is larger. The attenuation does not steer the steps: where kappa_n passes 0 it has
    kinks, at which 64 rays would wait in turn.
    """
    length = size(body)
    reach = np.maximum(length, np.abs(body.bounds).max(axis=0))
    return np.array([*reach, 1.0, 1.0, 1.0, 1.0, 1 / length, length, 1.0, np.inf][:lanes])
