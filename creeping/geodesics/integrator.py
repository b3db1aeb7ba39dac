"""Direct integration of the geodesic flow by the order-8 Runge-Kutta pair of Dormand and Prince [HNW93, sec. II.10].

The compiled path advances blocks of rays with one step for the block; the numpy path, its twin, advances all rays
together and serves bodies without a compiled level. Both put each accepted step back on T1Q.
"""

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from creeping._typing import Any, ArrayLike, FloatArray, IntArray
from creeping.errors import IntegrationError, InvalidInputError
from creeping.geodesics.bundle import bundle_points, project_bundle
from creeping.geodesics.equations import metric_curvature, speed_of, speed_values, vector_field
from creeping.geometry.curvature import normal_curvature
from creeping.geometry.surface import Surface, size
from creeping.kernels.threads import in_threads

MAX_STEPS = 100_000
"""Steps between two outputs after which a block of rays is given up."""


@dataclass(frozen=True)
class MapError:
    """Error of a flow against direct integration.

    Attributes
    ----------
    rms, max : float
        Of |(x, p) - (x, p)_traced|, the norm in R^6, over the samples.
    samples : int
        Random points of T1Q.
    """

    rms: float
    max: float
    samples: int


class Tableau(NamedTuple):
    """Explicit Runge-Kutta method: stage matrix a, weights b, error weights e3 and e5 (zero: no estimate)."""

    a: FloatArray
    b: FloatArray
    e3: FloatArray
    e5: FloatArray

    def packed(self) -> tuple[IntArray, IntArray, FloatArray]:
        """Nonzero weights row by row, for the compiled tracer: numbers of them, their places, themselves.

        Rows are those of a, then b, e3 and e5; a zero makes the number of each even and positive.
        """
        stages = len(self.b)
        rows = [*self.a, self.b, self.e3, self.e5]
        terms = np.array([max(2, 2 * ((np.count_nonzero(row) + 1) // 2)) for row in rows])
        index, weights = np.zeros((len(rows), stages + 2), dtype=np.int64), np.zeros((len(rows), stages + 2))
        for number, row in enumerate(rows):
            places = np.flatnonzero(row)
            index[number, : len(places)], weights[number, : len(places)] = places, row[places]
        return terms, index, weights


@cache
def dormand_prince_8() -> Tableau:
    """The order-8 pair with its error estimates of order 3 and 5, as scipy keeps it."""
    from scipy.integrate import DOP853

    return Tableau(*(np.ascontiguousarray(v, dtype=float) for v in (DOP853.A, DOP853.B, DOP853.E3, DOP853.E5)))


@cache
def runge_kutta_4() -> Tableau:
    """The classical method of order 4, the integrator of the burn-in."""
    a = np.array([[0.0, 0, 0, 0], [0.5, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, 1, 0]])
    return Tableau(a, np.array([1, 2, 2, 1]) / 6, np.zeros(5), np.zeros(5))


def as_times(times: ArrayLike) -> tuple[FloatArray, bool]:
    """Times as an ascending array (m,), and whether a scalar was given.

    Raises
    ------
    InvalidInputError
        If they are not finite, negative, or not in ascending order.
    """
    t = np.asarray(times, dtype=float)
    if t.ndim > 1:
        raise InvalidInputError(f"times have shape {t.shape}; give a number or a list of numbers")
    values = np.atleast_1d(t)
    if values.size == 0 or not np.all(np.isfinite(values)) or np.any(values < 0):
        raise InvalidInputError("times must be finite numbers >= 0; reverse the direction to go back")
    if np.any(np.diff(values) < 0):
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
    """
    if not 1e-14 <= rtol <= 1e-2:
        raise InvalidInputError(f"rtol = {rtol!r} is not between 1e-14 and 1e-2")
    values, scalar = as_times(times)
    x, p = bundle_points(body, points, directions)
    return unpack(trace_states(body, pack(x, p), values, rtol=rtol), x.shape, scalar)


def unpack(states: FloatArray, shape: tuple[int, ...], scalar: bool) -> tuple[FloatArray, FloatArray]:
    """Points and directions of states (n, m, 6), in the shape of the starting points; (..., 3) for a scalar time."""
    states = states.reshape(*shape[:-1], states.shape[1], 6)
    if scalar:
        states = states[..., 0, :]
    return states[..., :3].copy(), states[..., 3:].copy()


def pack(points: FloatArray, directions: FloatArray, *, jacobi: bool = False, lanes: int = 6) -> FloatArray:
    """States (n, lanes) from (..., 3) points and directions.

    6 lanes are (x, p); lanes 6 to 9 the identity as Jacobi matrix (``jacobi`` asks for 10), lane 10 the attenuation
    integral 0, lane 11 the time of detachment inf.
    """
    states = np.concatenate([points.reshape(-1, 3), directions.reshape(-1, 3)], axis=1)
    riding = [1.0, 0.0, 0.0, 1.0, 0.0, np.inf][: (10 if jacobi else lanes) - 6]
    return np.concatenate([states, np.tile(riding, (len(states), 1))], axis=1) if riding else states


def trace_states(
    body: Surface,
    states: FloatArray,
    times: FloatArray,
    *,
    rtol: float = 1e-10,
    step: float | None = None,
    tableau: Tableau | None = None,
) -> FloatArray:
    """Trace states (n, 6, 10 or 11) to the ascending times (m,): (n, m, the same).

    ``rtol = 0`` takes equal steps of at most ``step``. Lanes 6 to 9 are the columns of the Jacobi matrix of
    the metric ds/c, lane 10 the attenuation integral; see `creeping.geodesics.kernels.integrator`.

    Raises
    ------
    IntegrationError
        If a ray does not reach its end; ``failed`` lists the rays.
    """
    if states.shape[1] > 11:
        raise InvalidInputError(f"states of {states.shape[1]} lanes; at most 11 are traced, see `attenuation`")
    method = tableau or dormand_prince_8()
    if step is None:
        step = 0.05 * size(body)
    compiled = compiled_parts(body)
    if compiled is None:
        out = trace_numpy(body, states, times, method, rtol=rtol, step=step)
    else:
        from creeping.geodesics.kernels.integrator import integrate

        out = np.empty((len(states), len(times), states.shape[1]))
        states = np.ascontiguousarray(states, dtype=float)
        scale = _scale(body, states.shape[1])
        ends = np.asarray(times, dtype=float)
        tableau_parts = method.packed()

        def run(part: slice) -> None:
            integrate(
                *compiled, states[part], ends, *tableau_parts, scale, float(rtol), float(step), MAX_STEPS, out[part]
            )

        in_threads(run, len(states))
    failed = np.flatnonzero(~np.all(np.isfinite(out), axis=(1, 2)))
    if len(failed):
        raise IntegrationError(
            f"{len(failed)} of {len(states)} rays left the finite numbers or needed more than {MAX_STEPS} steps "
            f"(first: ray {failed[0]}); "
            + (
                f"shorten the step {step:.3g}, unless that many are needed"
                if rtol == 0
                else "check the body with check_surface"
            ),
            failed=failed,
        )
    return out


def compiled_parts(body: Surface) -> tuple[Any, FloatArray, Any, FloatArray, bool] | None:
    """Level and speed functions with their parameters for the kernels, or None if one of them is not compiled."""
    level = getattr(body, "compiled", None)
    speed = speed_of(body)
    if level is None or (speed is not None and getattr(speed, "compiled", None) is None):
        return None
    weight = level if speed is None else speed.compiled
    return level.function, level.parameters, weight.function, weight.parameters, speed is not None


def _scale(body: Surface, lanes: int) -> FloatArray:
    """Magnitude below which a lane's error counts absolutely: lengths for x and M12, 1 for the others.

    The attenuation does not steer the steps: where kappa_n passes 0 it has kinks, at which 64 rays would wait in turn.
    """
    length = size(body)
    return np.array([length] * 3 + [1.0] * 3 + [1.0, 1 / length, length, 1.0, np.inf][: lanes - 6])


def derivative_numpy(body: Surface, states: FloatArray) -> FloatArray:
    """Time derivative of states (n, 6, 10 or 11); the numpy twin of the compiled right-hand side."""
    k = np.empty_like(states)
    k[:, :3], k[:, 3:6] = vector_field(body, states[:, :3], states[:, 3:6])
    if states.shape[1] > 6:
        curvature = metric_curvature(body, states[:, :3])
        k[:, 6], k[:, 8] = states[:, 7], states[:, 9]
        k[:, 7], k[:, 9] = -curvature * states[:, 6], -curvature * states[:, 8]
    if states.shape[1] > 10:
        kappa = normal_curvature(body, states[:, :3], states[:, 3:6])
        k[:, 10] = speed_values(body, states[:, :3]) * np.maximum(kappa, 0.0) ** (2 / 3)
    return k


def trace_numpy(
    body: Surface, states: FloatArray, times: FloatArray, method: Tableau, *, rtol: float, step: float
) -> FloatArray:
    """Trace all states with one common step; the numpy twin of the compiled tracer, same arguments as trace_states."""
    y = np.array(states, dtype=float)
    out = np.full((len(y), len(times), y.shape[1]), np.nan)
    scale = _scale(body, y.shape[1])
    now, h = 0.0, step
    for m, end in enumerate(times):
        left = float(end) - now
        equal = max(1, int(np.ceil(left / step - 1e-9))) if rtol == 0 else 1
        used = 0
        while left > 0:
            trial = left / (equal - used) if rtol == 0 else min(h, left)
            with np.errstate(all="ignore"):
                new, error = _step_numpy(body, y, trial, method, rtol, scale)
            used += 1
            if (
                used > MAX_STEPS
                or (trial < 1e-12 * step and trial < left)
                or (rtol == 0 and not np.all(np.isfinite(new)))
            ):
                return out
            if rtol > 0 and not error < 1:
                h = trial * (max(0.2, 0.9 * error**-0.125) if np.isfinite(error) else 0.2)
                continue
            new[:, :3], new[:, 3:6] = project_bundle(body, new[:, :3], new[:, 3:6])
            left = 0.0 if trial >= left else left - trial
            y = new
            if rtol > 0:
                grow = min(5.0, 0.9 * max(error, 1e-8) ** -0.125)
                h = max(h, trial * grow) if trial < h else trial * grow
        now = float(end)
        out[:, m] = y
    return out


def _step_numpy(
    body: Surface, y: FloatArray, h: float, method: Tableau, rtol: float, scale: FloatArray
) -> tuple[FloatArray, float]:
    """One step, and its largest error in units of the tolerance."""
    stages = len(method.b)
    k = np.empty((stages + 1, *y.shape))
    k[0] = derivative_numpy(body, y)
    for s in range(1, stages):
        k[s] = derivative_numpy(body, y + h * np.tensordot(method.a[s, :s], k[:s], 1))
    new = y + h * np.tensordot(method.b, k[:stages], 1)
    if rtol == 0:
        return new, 0.0
    k[stages] = derivative_numpy(body, new)
    tolerance = rtol * np.maximum(scale, np.maximum(np.abs(y), np.abs(new)))
    sum3 = np.sum((np.tensordot(method.e3, k, 1) / tolerance) ** 2, axis=1)
    sum5 = np.sum((np.tensordot(method.e5, k, 1) / tolerance) ** 2, axis=1)
    denominator = np.sqrt((sum5 + 0.01 * sum3) * y.shape[1])
    error = np.divide(h * sum5, denominator, out=np.zeros_like(sum5), where=denominator != 0)
    return new, float(np.max(error))
