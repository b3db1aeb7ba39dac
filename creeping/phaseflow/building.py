"""Building the phase map: the tower of Algorithm 1, the direct build, and the choice of grid from a tolerance.

Tower [YC06a, Algorithm 1]: with B = (T0/tau)^(1/S) an integer, g_tau is one Runge-Kutta step of order 4 at every
node, and g_(B^k tau) = (g_(B^(k-1) tau))^(B) at the nodes is interpolated again, k = 1..S. Direct: every node is traced
straight to T0 by the order-8 pair. The error is C (tau^4 + h^(p+1)) and C h^(p+1) respectively.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from creeping._errors import InvalidInputError, SurfaceError, ToleranceError
from creeping._typing import Any, FloatArray
from creeping.phaseflow.bundle import random_bundle_points
from creeping.phaseflow.caching import cached_phase_map
from creeping.phaseflow.geodesic import principal_curvature_bound, speed_values
from creeping.phaseflow.phase_map import Grid, Leap, MapError, PhaseMap
from creeping.phaseflow.splines import interpolation_operator, prefilter, uniform_weights
from creeping.phaseflow.tracing import pack, runge_kutta_4, trace_states
from creeping.surface import Surface, check_surface, polar_frame

Progress = Callable[[str], None]
MAX_NODES = 4_000_000
"""Nodes of the largest grid that the choice from a tolerance will build; 12 float64 each."""
SAMPLES = 500
"""Random points of T1Q at which a finished map is measured."""


def build_phase_map(
    body: Surface,
    *,
    tolerance: float | None = None,
    horizon: float | None = None,
    grid: tuple[int, int] | tuple[int, int, int] | None = None,
    order: int | None = None,
    method: str = "direct",
    time_step: float | None = None,
    stages: int | None = None,
    cache: bool | str | Path = True,
    progress: Progress | None = None,
) -> PhaseMap:
    """Build the phase map g_T0 of a body, or open it from the cache.

    Parameters
    ----------
    body : Surface
    tolerance : float, optional
        Rms error of one g_T0, 1e-9 to 1e-1; chooses whatever of horizon, grid and order is not given. 1e-6 if
        neither tolerance nor grid is given.
    horizon : float, optional
        T0, L (travel time for a weighted body).
    grid : (nodes, angles) or (nodes_u, nodes_v, angles), optional
        Nodes per chart, margin included, and on the circle.
    order : int, optional
        Degree of the splines, 3 or 5.
    method : {"direct", "tower"}
        "tower" is Algorithm 1 and needs ``time_step``, ``stages``, ``horizon`` and ``grid``.
    time_step : float, optional
        tau of the burn-in.
    stages : int, optional
        S, the number of levels of the tower.
    cache : bool or path
        True: the user's cache folder; a path: that folder; False: no cache.
    progress : callable, optional
        Called with a line of text before each long step.

    Returns
    -------
    PhaseMap
        With its error measured against `trace`.

    Raises
    ------
    InvalidInputError
        On parameters that contradict each other.
    ToleranceError
        If no map within the limits reaches the tolerance; says what was reached and how to go on.
    """
    if tolerance is None and grid is None:
        tolerance = 1e-6
    request = _Request(body, tolerance, horizon, grid, order, method, time_step, stages)
    say = progress or (lambda _: None)
    if cache is False:
        return request.build(say)
    return cached_phase_map(body, request.key(), lambda: request.build(say), folder=cache, progress=say)


class _Request:
    """Checked parameters of one build."""

    def __init__(
        self,
        body: Surface,
        tolerance: float | None,
        horizon: float | None,
        grid: tuple[int, ...] | None,
        order: int | None,
        method: str,
        time_step: float | None,
        stages: int | None,
    ) -> None:
        if tolerance is not None and not 1e-9 <= tolerance <= 1e-1:
            raise InvalidInputError(f"tolerance = {tolerance!r} is not between 1e-9 and 1e-1")
        if horizon is not None and not (np.isfinite(horizon) and horizon > 0):
            raise InvalidInputError(f"horizon = {horizon!r} is not a positive finite number")
        if order not in (None, 3, 5):
            raise InvalidInputError(f"order = {order!r}: splines of degree 3 and 5 are built")
        if method not in ("direct", "tower"):
            raise InvalidInputError(f"method = {method!r} is neither 'direct' nor 'tower'")
        self.body, self.tolerance, self.horizon, self.order, self.method = body, tolerance, horizon, order or 5, method
        self.periodic = _common_periodicity(body)
        self.nodes = None if grid is None else _nodes(grid, self.order, self.periodic)
        self.burn_in, self.base, self.stages = time_step, 0, stages or 0
        if method == "tower":
            if None in (horizon, grid, time_step, stages):
                raise InvalidInputError("method='tower' needs horizon, grid, time_step and stages")
            self.burn_in, self.base, self.stages = _tower_base(horizon, time_step, stages)
        elif time_step is not None or stages is not None:
            raise InvalidInputError("time_step and stages belong to method='tower'")

    def key(self) -> dict[str, Any]:
        """Parameters that decide the result, for the cache."""
        return {
            "tolerance": self.tolerance,
            "horizon": self.horizon,
            "nodes": self.nodes and list(self.nodes),
            "degree": self.order,
            "method": self.method,
            "time_step": self.burn_in,
            "stages": self.stages,
        }

    def build(self, say: Progress) -> PhaseMap:
        """Build with the parameters given, choosing the missing ones."""
        check_surface(self.body).require()
        horizon = self.horizon or _natural_horizon(self.body)
        if self.nodes is not None:
            result = self._build_one(Grid(self.nodes, self.order, self.periodic), horizon, say)
            if self.tolerance is not None and result.error.rms > self.tolerance:
                factor = (result.error.rms / self.tolerance) ** (1 / (self.order + 1))
                enough = tuple(int(np.ceil(1.1 * factor * n)) for n in self.nodes)
                raise ToleranceError(
                    f"grid {self.nodes} with horizon {horizon:g} reaches rms {result.error.rms:.1e}, not "
                    f"{self.tolerance:.1e}; about {enough} should do, or leave grid out",
                    rms=result.error.rms,
                )
            return result
        return self._choose(horizon, say)

    def _build_one(self, grid: Grid, horizon: float, say: Progress) -> PhaseMap:
        if self.method == "tower":
            assert self.burn_in is not None
            return build_tower(self.body, grid, self.burn_in, self.base, self.stages, say)
        return build_direct(self.body, grid, horizon, say)

    def _choose(self, horizon: float, say: Progress) -> PhaseMap:
        """Refine each axis by its own interpolation error until the measured error meets the tolerance."""
        assert self.tolerance is not None
        first = (32, 32, 32) if any(self.periodic) else (20, 20, 32)
        nodes, charts = first, len(self.body.atlas.charts)
        best: PhaseMap | None = None
        for _ in range(10):
            grid = Grid(nodes, self.order, self.periodic)
            values = direct_values(self.body, grid, horizon, say)
            result = _finish(self.body, grid, (_leap(values, grid, horizon),), {"method": "direct"})
            if best is None or result.error.rms < best.error.rms:
                best = result
            if result.error.rms <= 0.8 * self.tolerance:
                return result
            nodes = _finer(nodes, _refinement(values, grid, result.error.rms, 0.5 * self.tolerance))
            if charts * int(np.prod(nodes)) > MAX_NODES:
                if self.horizon is not None:
                    break
                horizon, nodes = horizon / 2, first
                say(f"the grid would grow too large: shortening the horizon to {horizon:g}")
        assert best is not None
        raise ToleranceError(
            f"no map of at most {MAX_NODES} nodes reached rms {self.tolerance:.1e}: the best is {best.error.rms:.1e} "
            f"with horizon {best.horizon:g} and grid {best.grid.nodes}; "
            f"give a shorter horizon or a tolerance of {2 * best.error.rms:.0e}",
            rms=best.error.rms,
        )


def build_direct(body: Surface, grid: Grid, horizon: float, say: Progress) -> PhaseMap:
    """Trace every node straight to the horizon and interpolate."""
    values = direct_values(body, grid, horizon, say)
    return _finish(body, grid, (_leap(values, grid, horizon),), {"method": "direct"})


def direct_values(body: Surface, grid: Grid, horizon: float, say: Progress) -> FloatArray:
    """Stored quantities at the nodes, by the order-8 pair: (charts, nu, nv, na, 10)."""
    states = node_states(body, grid)
    say(f"tracing {len(states)} nodes to T0 = {horizon:g}")
    traced = trace_states(body, states, np.array([horizon]), rtol=1e-11, step=horizon / 4)[:, 0]
    return _stored(states, traced, horizon, grid)


def build_tower(body: Surface, grid: Grid, time_step: float, base: int, stages: int, say: Progress) -> PhaseMap:
    """Algorithm 1: burn-in by one Runge-Kutta step, then B compositions a level."""
    states = node_states(body, grid)
    say(f"burn-in of {len(states)} nodes by tau = {time_step:g}")
    reached = trace_states(body, states, np.array([time_step]), rtol=0.0, step=time_step, tableau=runge_kutta_4())[:, 0]
    leaps = [_leap(_stored(states, reached, time_step, grid), grid, time_step)]
    unmeasured = MapError(np.nan, np.nan, 0)
    for level in range(1, stages + 1):
        say(f"level {level} of {stages}")
        flow = PhaseMap(body, grid, tuple(leaps), unmeasured)
        time = time_step * base**level
        leaps.append(_leap(_stored(states, flow.leap(states, base), time, grid), grid, time))
    return _finish(
        body, grid, tuple(leaps), {"method": "tower", "time_step": time_step, "stages": stages, "base": base}
    )


def node_states(body: Surface, grid: Grid) -> FloatArray:
    """States (charts * nu * nv * na, 10) at the nodes, the Jacobi matrix being the identity."""
    u, v, angle = grid.axes()
    uv = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    states = []
    for chart in body.atlas.charts:
        points = np.broadcast_to(chart.point(uv)[:, :, None], (*uv.shape[:2], len(angle), 3))
        directions = np.moveaxis(polar_frame(chart.tangents(uv)) @ circle, -2, -1)
        states.append(pack(points, np.ascontiguousarray(directions), jacobi=True))
    return np.concatenate(states)


def measure(flow: PhaseMap, *, samples: int = SAMPLES, rng: np.random.Generator | None = None) -> MapError:
    """Error of one g_T0 against `trace` at 1e-12, over random points of T1Q (seed 0 without ``rng``)."""
    x, p = random_bundle_points(flow.body, samples, rng=rng or np.random.default_rng(0))
    exact = trace_states(flow.body, pack(x, p), np.array([flow.horizon]), rtol=1e-12, step=flow.horizon / 8)[:, 0]
    error = np.linalg.norm(flow.leap(pack(x, p), 1) - exact, axis=1)
    return MapError(float(np.sqrt(np.mean(error**2))), float(error.max()), samples)


def _finish(body: Surface, grid: Grid, leaps: tuple[Leap, ...], parameters: dict[str, Any]) -> PhaseMap:
    unmeasured = PhaseMap(body, grid, leaps, MapError(np.nan, np.nan, 0), parameters)
    return PhaseMap(body, grid, leaps, measure(unmeasured), parameters)


def _stored(states: FloatArray, reached: FloatArray, time: float, grid: Grid) -> FloatArray:
    """Displacements D, E and M - [[1, t], [0, 1]] on the grid: (charts, nu, nv, na, 10)."""
    values = reached - states
    values[:, :3] -= time * states[:, 3:6]
    values[:, 8] -= time
    return values.reshape(-1, *grid.nodes, 10)


def _leap(values: FloatArray, grid: Grid, time: float) -> Leap:
    """Spline coefficients of the stored quantities; the state lanes padded to eight."""
    table = prefilter(values, grid.degree, grid.periodic)
    state = np.zeros((*table.shape[:-1], 8))
    state[..., :6] = table[..., :6]
    return Leap(time, state, np.ascontiguousarray(table[..., 6:]))


def _refinement(values: FloatArray, grid: Grid, rms: float, target: float) -> FloatArray:
    """Factor on the nodes of each axis, from the error of dropping every other node along it.

    The three errors at half resolution show the shares of the axes in the measured error.
    """
    shares = []
    for axis, wraps in ((1, grid.periodic[0]), (2, grid.periodic[1]), (3, True)):
        data = np.moveaxis(values[..., :6], axis, 0)
        n = data.shape[0] if wraps else data.shape[0] - (1 - data.shape[0] % 2)
        even, odd = data[0:n:2], data[1:n:2]
        middle = _midpoints(even, grid.degree, wraps)[: len(odd)]
        inner = slice(None) if wraps else slice(2, -2)
        difference = (middle - odd)[inner]
        shares.append(float(np.sqrt(np.mean(np.sum(difference**2, axis=-1)))) + 1e-300)
    share = np.array(shares) / np.sqrt(np.sum(np.square(shares)))
    # axes of equal share grow alike; an axis of small share may stay
    return np.asarray(np.maximum(share * rms / (target / np.sqrt(3)), 1e-3) ** (1 / (grid.degree + 1)))


def _midpoints(values: FloatArray, degree: int, wraps: bool) -> FloatArray:
    """Interpolate nodes (n, ...) to the midpoints of their cells."""
    n = len(values)
    coefficients = np.tensordot(interpolation_operator(n, degree, wraps), values, 1)
    w = uniform_weights(np.array(0.5), degree)
    cells = n if wraps else n - 1
    return np.asarray(sum(w[j] * coefficients[j : j + cells] for j in range(degree + 1)))


def _finer(nodes: tuple[int, ...], factors: FloatArray) -> tuple[int, int, int]:
    """Finer grid: u and v alike, each axis grown by its factor, the whole by at least a tenth."""
    chart, circle = max(factors[0], factors[1], 1.0), max(factors[2], 1.0)
    if max(chart, circle) < 1.05:
        chart, circle = 1.1, 1.1
    # far from convergence the factors overshoot, but factors beyond 4 say that this horizon is hopeless
    if max(chart, circle) <= 4:
        chart, circle = min(chart, 2.0), min(circle, 2.0)
    side = 2 * int(np.ceil(nodes[0] * chart / 2))
    return side, side, 4 * int(np.ceil(nodes[2] * circle / 4))


def _natural_horizon(body: Surface) -> float:
    """Power of two next to the time a ray takes over the smallest radius of curvature."""
    points = _sample_points(body)
    fastest = float(np.max(speed_values(body, points)))
    return float(2.0 ** np.round(np.log2(1 / (principal_curvature_bound(body, points) * fastest))))


def _sample_points(body: Surface) -> FloatArray:
    """Points of all charts on a coarse grid: (n, 3)."""
    uv = np.stack(np.meshgrid(*[np.linspace(0, 1, 33)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.concatenate([chart.point(uv) for chart in body.atlas.charts])


def _common_periodicity(body: Surface) -> tuple[bool, bool]:
    kinds = {tuple(chart.periodic) for chart in body.atlas.charts}
    if len(kinds) != 1:
        raise SurfaceError(f"the charts of the atlas differ in periodicity ({sorted(kinds)}); use charts of one kind")
    first, second = kinds.pop()
    return first, second


def _nodes(grid: tuple[int, ...], degree: int, periodic: tuple[bool, bool]) -> tuple[int, int, int]:
    try:
        nodes = tuple(int(n) for n in grid)
        whole = all(n == g for n, g in zip(nodes, grid, strict=True))
    except (TypeError, ValueError):
        nodes, whole = (), False
    if len(nodes) == 2:
        nodes = (nodes[0], *nodes)
    least = [degree + 1 if wraps else degree + 5 for wraps in periodic] + [degree + 1]
    if len(nodes) != 3 or not whole or any(n < m for n, m in zip(nodes, least, strict=True)):
        raise InvalidInputError(
            f"grid = {grid!r}: give two or three whole numbers of at least {least} for order {degree}"
        )
    return nodes


def _tower_base(horizon: Any, time_step: Any, stages: Any) -> tuple[float, int, int]:
    """Check that B = (T0/tau)^(1/S) is a whole number >= 2."""
    if not (isinstance(stages, int) and stages >= 1 and np.isfinite(time_step) and 0 < time_step < horizon):
        raise InvalidInputError(
            f"time_step = {time_step!r} and stages = {stages!r} do not make a tower below {horizon:g}"
        )
    base = (horizon / time_step) ** (1 / stages)
    if abs(base - round(base)) > 1e-9 * base or round(base) < 2:
        raise InvalidInputError(f"(horizon/time_step)^(1/stages) = {base:.6g} is not a whole number >= 2")
    return horizon / round(base) ** stages, round(base), stages
