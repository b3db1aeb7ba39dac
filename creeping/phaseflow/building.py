"""Building the phase map: the tower of Algorithm 1, and the direct build, doubled or not.

Tower [YC06a, Algorithm 1]: with B = (T0/tau)^(1/S) an integer, g_tau is one Runge-Kutta step of order 4 at every
node, and g_(B^k tau) = (g_(B^(k-1) tau))^(B) at the nodes is interpolated again, k = 1..S. Direct: every node is traced
to T0/2^d by the order-8 pair, and the map is composed with itself at the nodes d times; d > 0 pays where F is
expensive. The error is C (tau^4 + h^(p+1)) and C h^(p+1) respectively.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.errors import ToleranceError
from creeping.geodesics.attenuation import NODES, chebyshev_times, curvature_values
from creeping.geodesics.equations import natural_horizon
from creeping.geodesics.integrator import ErrorEstimate, trace_states
from creeping.geodesics.states import pack, random_bundle_points
from creeping.geodesics.tableaus import RUNGE_KUTTA_4
from creeping.geometry.checks import check_surface
from creeping.geometry.surface import Surface, fingerprint
from creeping.phaseflow.coordinates import AmbientModel, Model, nodes_of
from creeping.phaseflow.phase_map import ErrorGrowth, PhaseMap
from creeping.phaseflow.rotation import CompiledModel, packed_lanes, with_flags
from creeping.phaseflow.splines import Grid, Leap, prefilter

_checked: set[str] = set()


Progress = Callable[[str], None]


@dataclass(frozen=True)
class Plan:
    """What a direct build needs to know.

    Attributes
    ----------
    horizon : float
    grid : Grid
    single : bool
        Store float32.
    carry_jacobi : bool
    doublings : int
        d: nodes are traced to T0/2^d only.
    least_cells : int
        Along u and v, if the grid is refined or thinned.
    reach : float
        Longest horizon over which curvatures are carried, in natural ones; see `curvature_reach`.
    tolerance : float
        Of the attenuation over a leap; see `rotation`.
    """

    horizon: float
    grid: Grid
    single: bool = False
    carry_jacobi: bool = True
    doublings: int = 0
    least_cells: int = 1
    reach: float = 1.0
    tolerance: float = 1e-9


def curvature_reach(tolerance: float) -> float:
    """Natural horizons over which the Chebyshev times resolve the curvature well enough for a tolerance.

    Over one of them the attenuation errs by about 1e-7, and by its eighth power over more.
    """
    return float(max(1.0, (tolerance / 1e-7) ** (1 / 8)))


def build_direct(body: Surface, model: Model, plan: Plan, progress: Progress, *, rtol: float) -> PhaseMap:
    """Trace every node to T0/2^d, interpolate, and double d times."""
    nodes = nodes_of(model, plan.grid)
    doublings = plan.doublings if isinstance(model, CompiledModel) else 0
    now = plan.horizon / 2**doublings
    progress(f"tracing {len(nodes)} nodes to {now:g}")
    curved = isinstance(model, CompiledModel) and plan.horizon <= 1.01 * plan.reach * natural_horizon(body)
    values = _traced(body, model, nodes, now, plan.carry_jacobi, curved, rtol)
    leap = _leap(values, plan.grid, now, model, single=plan.single and doublings == 0, whole=doublings == 0)
    for k in range(doublings):
        assert isinstance(model, CompiledModel)
        progress(f"doubling to {2 * now:g}")
        values = model.doubled(plan.grid, leap, nodes)
        now *= 2
        last = k == doublings - 1
        leap = _leap(values, plan.grid, now, model, single=plan.single and last, whole=last)
    if leap.is_packed:
        assert isinstance(model, CompiledModel)
        progress("judging the attenuation of cells")
        leap = with_flags(model, plan.grid, leap, plan.tolerance)
    parameters = {"method": "direct", "doublings": doublings}
    return PhaseMap(body, model, plan.grid, (leap,), parameters=parameters)


def _traced(
    body: Surface, model: Model, nodes: FloatArray, time: float, carry_jacobi: bool, curved: bool, rtol: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Displacements (n, lanes), Jacobi matrices (n or 0, 4) and curvatures (n or 0, 8) at the nodes."""
    values = np.empty((len(nodes), model.lanes))
    matrices = np.empty((len(nodes) if carry_jacobi else 0, 4))
    curvatures = np.empty((len(nodes) if carry_jacobi and curved else 0, NODES))
    steps = 1
    for first in range(0, len(nodes), 65_536):
        part = slice(first, first + 65_536)
        states = model.states(nodes[part])
        if carry_jacobi:
            states = pack(states[:, :3], states[:, 3:], jacobi=True)
        while True:
            times = time * np.arange(1, steps + 1) / steps
            if len(curvatures):
                times = np.unique(np.concatenate([times, time * chebyshev_times()]))
            traced = trace_states(body, states, times, rtol=rtol, step=time)
            try:
                values[part] = model.displacement(nodes[part], traced, times)
            except ToleranceError:
                # states in between tell which of two rotations a long displacement is
                if steps >= 64:
                    raise
                steps *= 2
                continue
            break
        if carry_jacobi:
            matrices[part] = traced[:, -1, 6:]
        if len(curvatures):
            inside = traced[:, np.searchsorted(times, time * chebyshev_times())]
            curvatures[part] = curvature_values(body, inside.reshape(-1, 10)).reshape(-1, NODES)
    return values, matrices, curvatures


def build_tower(body: Surface, grid: Grid, time_step: float, base: int, stages: int, progress: Progress) -> PhaseMap:
    """Algorithm 1: burn-in by one Runge-Kutta step, then B compositions a level."""
    model = AmbientModel(body)
    nodes = nodes_of(model, grid)
    states = pack(nodes[:, :3], nodes[:, 3:], jacobi=True)
    progress(f"burn-in of {len(nodes)} nodes by tau = {time_step:g}")
    reached = trace_states(body, states, np.array([time_step]), rtol=0.0, step=time_step, method=RUNGE_KUTTA_4)
    leaps: list[Leap] = []
    for level in range(stages + 1):
        if level:
            progress(f"level {level} of {stages}")
            reached = PhaseMap(body, model, grid, tuple(leaps)).leap(states, base)[:, None]
        now = time_step * base**level
        values = model.displacement(nodes, reached, np.array([now]))
        leaps.append(_leap((values, reached[:, 0, 6:], np.empty((0, NODES))), grid, now, model))
    parameters = {"method": "tower", "time_step": time_step, "stages": stages, "base": base}
    return PhaseMap(body, model, grid, tuple(leaps), parameters=parameters)


def _leap(
    quantities: tuple[FloatArray, FloatArray, FloatArray],
    grid: Grid,
    time: float,
    model: Model,
    *,
    single: bool = False,
    whole: bool = False,
) -> Leap:
    """Spline coefficients of displacements, Jacobi matrices and curvatures at the nodes; packed, if ``whole``."""
    values, matrices, curvatures = quantities
    kind = np.float32 if single else np.float64
    # means go out of what is stored in single precision, so that its rounding is relative to what varies
    apart = single and isinstance(model, CompiledModel)
    centre = values.mean(axis=0) if apart else np.zeros(model.lanes)
    matrix = matrices.mean(axis=0) if apart and len(matrices) else np.array([1.0, 0.0, time, 1.0])
    lanes = None
    if whole and len(curvatures) and isinstance(model, CompiledModel):
        lanes = packed_lanes(model, values, matrices, curvatures, time)
    if lanes is not None:
        matrices, matrix = lanes, lanes.mean(axis=0) if apart else np.zeros(lanes.shape[1])
    if model.name == "octant":
        # these change sign with the mirrors
        centre[1:3] = 0.0
        if lanes is not None:
            matrix[:2] = 0.0

    def fitted(quantity: FloatArray) -> Any:
        if not len(quantity):
            return np.zeros((0, *grid.sides, quantity.shape[1]), dtype=kind)
        nodes = quantity.reshape(model.charts, *grid.nodes, quantity.shape[1])
        return np.asarray(prefilter(nodes, grid.degree, grid.periodic), dtype=kind)

    # no cell is trusted before it is judged
    flagged = np.ones((model.charts if lanes is not None else 0, *grid.sides), dtype=np.uint8)
    state, jacobi = fitted(values - centre), fitted(matrices - matrix)
    return Leap(time, state, centre, jacobi, matrix, fitted(curvatures), flagged)


def measure(flow: PhaseMap, *, samples: int = 2000, rng: np.random.Generator | None = None) -> ErrorEstimate:
    """Error of one g_T0 against `trace` at 1e-12, over random points of T1Q (seed 0 without ``rng``).

    One ray in a hundred may carry most of the error.
    """
    rays = Reference(flow.body, np.array([flow.horizon]), flow.horizon / 8, 1e-12, rng)
    errors = rays.errors(flow, 0, samples)[:, 0]
    return ErrorEstimate(float(np.sqrt(np.mean(errors**2))), float(errors.max()), samples)


def with_errors(
    flow: PhaseMap,
    length: float | None = None,
    *,
    samples: int = 2000,
    rtol: float = 1e-12,
    most: int = 1,
    known: "dict[Any, Reference] | None" = None,
) -> PhaseMap:
    """The map with its error of one g_T0 and of rays up to ``length``, 8 horizons if not given.

    Where few of the rays carry most of the error, up to ``most`` times as many are taken. ``known`` keeps the traced
    rays for the next map of the body with the same horizon.
    """
    count = max(1, round(length / flow.horizon)) if length else 8
    leaps = [m for m in (1, 2, 4, 8, 16, 32, 64, 128, 256) if m < count] + [count]
    times = flow.horizon * np.array(leaps, dtype=float)
    if length:
        times[-1] = length
    fresh = Reference(flow.body, times, flow.horizon / 8, rtol)
    rays = fresh if known is None else known.setdefault((flow.horizon, *times.tolist(), rtol, samples), fresh)
    draws = itertools.count()
    # what the tolerance is asked for: the ends of rays, or one g_T0
    errors = sampled_errors(
        lambda number: rays.errors(flow, next(draws), number), samples, most, column=-1 if length else 0
    )
    rms, largest = np.sqrt(np.mean(errors**2, axis=0)), errors.max(axis=0)
    growth = ErrorGrowth(
        tuple(times.tolist()), tuple(rms.tolist()), tuple(largest.tolist()), upper_bound(errors[:, -1])
    )
    first = ErrorEstimate(float(rms[0]), float(largest[0]), len(errors))
    if times[0] != flow.horizon:
        first = measure(flow, samples=samples)
    return replace(flow, error=first, growth=growth)


def sampled_errors(sample: Callable[[int], FloatArray], count: int, most: int, *, column: int = -1) -> FloatArray:
    """Errors (n, m) of ``count`` random rays, doubled up to ``most`` times that while the rms of a column scatters."""
    errors = sample(count)
    limit = count * most
    while 2 * len(errors) <= limit and upper_bound(errors[:, column]) > 1.2 * np.sqrt(np.mean(errors[:, column] ** 2)):
        errors = np.concatenate([errors, sample(len(errors))])
    return errors


def upper_bound(errors: FloatArray) -> float:
    """Rms of errors (n,), of any unit, two standard errors of their squares above it."""
    # rays that a trial has thrown far away have errors whose fourth powers are no numbers; powers of two are exact
    exponent = int(np.frexp(np.max(errors, initial=0.0))[1])
    square = np.ldexp(errors, -exponent) ** 2
    return float(np.ldexp(np.sqrt(np.mean(square) + 2 * np.std(square) / np.sqrt(len(square))), exponent))


class Reference:
    """Random rays of a body and where they are at times (m,), L, traced once; seed 0 without ``rng``."""

    def __init__(
        self, body: Surface, times: FloatArray, step: float, rtol: float, rng: np.random.Generator | None = None
    ) -> None:
        self._body, self._times, self._step, self._rtol = body, times, step, rtol
        self._rng = rng or np.random.default_rng(0)
        self._drawn: list[tuple[FloatArray, FloatArray]] = []

    def errors(self, flow: PhaseMap, draw: int, samples: int) -> FloatArray:
        """|(x, p) - (x, p)_traced| of the rays of a draw, of which there are so many: (samples, m)."""
        if draw == len(self._drawn):
            states = pack(*random_bundle_points(self._body, samples, rng=self._rng))
            exact = trace_states(self._body, states, self._times, rtol=self._rtol, step=self._step)
            self._drawn.append((states, exact))
        states, exact = self._drawn[draw]
        return np.asarray(np.linalg.norm(flow.transport(states, self._times) - exact, axis=2))


def require_checked(body: Surface) -> None:
    """Raise what `check_surface` finds, once a body."""
    name = fingerprint(body)
    if name not in _checked:
        check_surface(body).require()
        _checked.add(name)
