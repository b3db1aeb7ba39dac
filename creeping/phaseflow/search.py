"""Choosing horizon, grid, degree and precision of a map from a tolerance on the end of rays of a given length.

Rows of points along one axis of the grid at a time are traced to every horizon in question. Splines through every 2nd,
3rd, ... of them give the error of each axis against its cells, e_u, e_v, e_a. Errors of leaps are carried to the end of
the ray by the Jacobi matrices: G(T0)^2 = sum_k |M(L) M(k T0)^-1|^2/2, geometric mean over rays. A map must reach

    e_u^2 + e_v^2 + e_a^2 <= (tolerance/G)^2,   all three equal where nodes are fewest.

Of all candidates the one that is cheapest for the rays to come, its build included, is built, measured at the end of
rays, and refined until it meets the tolerance; three at most in turn. Costs are counted work times nominal seconds of
a unit of it:

    evaluation   e, of F with its derivatives and of what a stage of a ray makes of them
    tracing      steps of 64 rays, counted, times 64 STAGES e
    build        nodes (tracing + 6e-7 s + DOUBLING d) and 0.1 s
    a ray        leaps times `leap_seconds`, and the conversion to the map's coordinates and back

No clock is read: what is chosen by these figures follows from body, tolerance, length and number of rays, the same on
every machine and however busy it is. All seconds were measured on one core of a 2.9 GHz x86-64 with AVX-512; on another
machine everything is faster or slower alike, and what is cheaper than what stays.

Sources: Derivations, R16.
"""

from dataclasses import dataclass, replace

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.errors import ToleranceError
from creeping.geodesics.attenuation import NODES, fine_spacing
from creeping.geodesics.direct_flow import DirectFlow
from creeping.geodesics.equations import natural_horizon
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.states import pack, random_bundle_points
from creeping.geometry.evaluators import speed_of
from creeping.geometry.surface import Surface, size
from creeping.kernels.threads import BLOCK
from creeping.phaseflow.building import Plan, Progress, Reference, build_direct, curvature_reach, with_errors
from creeping.phaseflow.coordinates import Model, model_of
from creeping.phaseflow.map_spec import MapSpec
from creeping.phaseflow.phase_map import PhaseMap
from creeping.phaseflow.splines import MARGIN, Grid, least_cells, thinning_operator

MAX_NODES = 4_000_000
"""Nodes of the largest grid that is built."""
SAFE = 0.5
"""Share of the tolerance that is aimed at."""
STAGES = 12
"""Evaluations of a step of the order-8 pair."""
DOUBLING = 4e-7
"""Seconds that a node takes of a doubling."""


@dataclass(frozen=True)
class Candidate:
    """A horizon with the grid it needs.

    Attributes
    ----------
    plan : Plan
    leap : float
        Nominal seconds of composition per ray and unit of length.
    build : float
        Nominal seconds of the build.
    target : float
        Error of one leap that is aimed at.
    """

    plan: Plan
    leap: float
    build: float
    target: float

    def seconds(self, rays: float, length: float) -> float:
        """Nominal seconds of the build and of ``rays`` rays."""
        return self.build + rays * length * self.leap


def tuned_map(spec: MapSpec, progress: Progress, found: list[Candidate] | None = None) -> PhaseMap:
    """Build the fastest map that meets the tolerance of the spec, of the candidates if these are known already.

    Raises
    ------
    ToleranceError
        If no map within the limits meets the tolerance; with the best that was reached.
    """
    body, tolerance = spec.body, spec.tolerance
    assert tolerance is not None
    model = model_of(body)
    cost = tracing_cost(body)
    if found is None:
        progress("probing horizons and grids")
        found = candidates(spec, model, cost)
    best: tuple[float, PhaseMap] | None = None
    spent, known = 0.0, dict[Any, Reference]()
    for candidate in found[:3]:
        plan, before = candidate.plan, np.inf
        # a coarser one is built first, to measure how errors grow
        if model.charts * int(np.prod(plan.grid.nodes)) > 1_500_000:
            plan = _scaled(plan, 0.6)
        for _ in range(6):
            progress(f"T0 = {plan.horizon:g}, {model.charts} x {' x '.join(map(str, plan.grid.nodes))} nodes")
            built = build_direct(body, model, plan, progress, rtol=float(np.clip(0.02 * candidate.target, 1e-12, 1e-7)))
            result, measuring = _measured(built, spec, cost, known)
            spent += build_seconds(plan, model, cost) + measuring
            assert result.growth is not None
            reached = result.growth.bound if spec.length else result.error.rms
            if best is None or reached < best[0]:
                best = reached, result
            if reached <= tolerance:
                result.parameters.update(tolerance=tolerance, length=spec.length)
                return result
            # rounding of float32 coefficients makes about 1e-8 of one leap: they go at the first failure near that
            limited = candidate.target < 1.2e-8 * np.hypot(1, size(body)) or reached > 0.5 * before
            if plan.single and spec.precision is None and limited:
                # the grid is no longer what limits it
                plan, before = replace(plan, single=False), np.inf
            else:
                full = model.charts * int(np.prod(plan.grid.nodes)) > 0.9 * MAX_NODES
                # every axis, so that its error falls by the excess, at least by a tenth of its cells
                excess = (reached / (SAFE * tolerance)) ** (1 / (plan.grid.degree + 1))
                plan, before = _scaled(plan, float(np.clip(1.02 * excess, 1.06, 2.0))), reached
                most = MAX_NODES / (model.charts * int(np.prod(plan.grid.nodes)))
                if full:
                    break
                if most < 1.0:
                    plan = _scaled(plan, 0.97 * most ** (1 / 3))
            # what was spent is spent: it is the next map and its rays that must pay, and no map is tuned for ever
            ahead = measuring + build_seconds(plan, model, cost) + spec.n_rays * (spec.length or 0.0) * candidate.leap
            if max(ahead, spent) > spec.seconds:
                raise ToleranceError(
                    f"tuning took about {spent:.2g} s, and {ahead:.2g} s are ahead: direct integration is near"
                )
    assert best is not None
    reached, result = best
    what = f"rays of length {spec.length:g}" if spec.length else "one g_T0"
    raise ToleranceError(
        f"no map of at most {MAX_NODES} nodes reached rms {tolerance:.1e} after {what}: the best is {reached:.1e}"
        f" with horizon {result.horizon:g} and grid {result.grid.nodes}"
        + f"; give a shorter horizon or length, a tolerance of {2 * reached:.0e}, or integrate with DirectFlow",
        rms=reached,
    )


def _measured(built: PhaseMap, spec: MapSpec, cost: float, known: dict[Any, Reference]) -> tuple[PhaseMap, float]:
    """The map with its errors, and nominal seconds of measuring them.

    Where F is expensive it is done on fewer rays, and against a reference only so much better.
    """
    length = spec.length or built.horizon
    assert spec.tolerance is not None
    budget = _budget(spec, cost)
    samples = int(np.clip(budget / (cost * length), 400, 2000))
    expensive = 4 * cost * length * samples > budget
    rtol = 1e-3 * spec.tolerance if expensive else 1e-12
    result = with_errors(built, spec.length, samples=samples, rtol=rtol, most=1 if expensive else 16, known=known)
    # steps of order 8 shorten like rtol^(1/8)
    return result, cost * length * result.error.samples * float((1e-9 / rtol) ** (1 / 8))


def _budget(spec: MapSpec, cost: float) -> float:
    """Nominal seconds that one probe or measurement may take: a share of direct integration of all rays."""
    return float(np.clip(0.02 * spec.magnitude * cost * (spec.length or natural_horizon(spec.body)), 0.02, 0.4))


def candidates(spec: MapSpec, model: Model, cost: float) -> list[Candidate]:
    """Horizons with their grids, the fastest first.

    Raises
    ------
    ToleranceError
        If none needs fewer than MAX_NODES.
    """
    body, tolerance = spec.body, spec.tolerance
    assert tolerance is not None
    natural = natural_horizon(body)
    horizons = _horizons(spec, natural, cost)
    probe = _Probe(body, model, horizons)
    degrees = (spec.degree,) if spec.degree else (3, 5)
    rays = int(np.clip(_budget(spec, cost) / (2 * cost * (spec.length or natural)), 48, 512))
    stretch = amplification(body, spec.length or natural, rays)
    found = []
    fewest = (np.inf, 0.0)
    for k, horizon in enumerate(horizons):
        gain = growth_factor(*stretch, horizon) if spec.length else 1.0
        target = SAFE * tolerance / gain
        single = spec.precision == "single" or (spec.precision is None and target > 4e-9 * np.hypot(1, size(body)))
        for degree in degrees:
            grid = probe.grid(k, degree, target)
            nodes = model.charts * int(np.prod(grid.nodes))
            nbytes = float(nodes * model.lanes * (4 if single else 8))
            fewest = min(fewest, (nodes, horizon))
            # larger tables do not compose at a useful speed: beyond the cache every stencil is 36 reads from memory
            if nodes > MAX_NODES or nbytes > 150e6:
                continue
            doublings, reach = doublings_of(horizon, natural, cost), curvature_reach(tolerance)
            plan = Plan(horizon, grid, single, spec.carry_jacobi, doublings, least_cells(body), reach, tolerance)
            leap = leap_seconds(degree, nbytes, carry_jacobi=spec.carry_jacobi, flat=model.is_flat)
            build = build_seconds(plan, model, cost) + 2 * _budget(spec, cost)
            found.append(Candidate(plan, leap / horizon, build, target))
    if not found:
        raise ToleranceError(
            f"no map of at most {MAX_NODES} nodes is expected to reach rms {tolerance:.1e}"
            + (f" after rays of length {spec.length:g}" if spec.length else "")
            + f": the best, with horizon {fewest[1]:g}, needs about {fewest[0]:.0e}; loosen the tolerance, "
            "or integrate with DirectFlow",
        )
    length = spec.length or natural
    return sorted(found, key=lambda one: one.seconds(spec.magnitude, length))


def _horizons(spec: MapSpec, natural: float, cost: float) -> list[float]:
    """Horizons to try, ascending: they divide the distance of outputs; from 0.4 times the natural one to 16 times."""
    if spec.horizon:
        return [spec.horizon]
    if not spec.length:
        return [natural]
    # probing a horizon traces 13 824 rays that far
    # over longer leaps the curvatures are not carried
    reach = natural * (curvature_reach(spec.tolerance or 0.0) if spec.carry_jacobi else 16)
    longest = max(natural, min(reach, 4 * _budget(spec, cost) / (cost * 13_824)))
    distance = spec.length / spec.n_steps
    leaps = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384, 512, 768, 1024)
    found = [distance / m for m in leaps if 0.4 * natural <= distance / m <= longest]
    if not found:
        found = [distance / max(1, np.ceil(distance / longest))]
    return sorted(found)


def amplification(body: Surface, length: float, rays: int) -> tuple[FloatArray, FloatArray]:
    """Times t along rays, and how much an error made at t is stretched on the way to their end: (m,), (m,)."""
    times = length * np.arange(1, 65) / 64
    x, p = random_bundle_points(body, rays, rng=np.random.default_rng(1))
    m = trace_states(body, pack(x, p, jacobi=True), times, rtol=1e-6, step=0.05 * size(body))[:, :, 6:]
    # columns (m11, m21), (m12, m22); the inverse needs no division since det M = 1
    scale = size(body)
    a, c, b, d = m[:, -1:, 0], scale * m[:, -1:, 1], m[:, -1:, 2] / scale, m[:, -1:, 3]
    e, g, f, h = m[:, :, 0], scale * m[:, :, 1], m[:, :, 2] / scale, m[:, :, 3]
    square = (a * h - b * g) ** 2 + (b * e - a * f) ** 2 + (c * h - d * g) ** 2 + (d * e - c * f) ** 2
    # the geometric mean: a few rays of a chaotic flow would swamp any other
    return times, np.asarray(np.exp(0.5 * np.mean(np.log(0.5 * square), axis=0)))


def growth_factor(times: FloatArray, stretch: FloatArray, horizon: float) -> float:
    """G: what errors of the leaps add up to at the end of a ray, in units of one leap's error."""
    count = max(1, round(times[-1] / horizon))
    at = times[-1] * np.arange(1, count + 1) / count
    return float(np.sqrt(np.sum(np.exp(2 * np.interp(at, times, np.log(stretch))))))


class _Probe:
    """Interpolation errors of rows of points along each axis, for several horizons: 24 rows of 192 cells.

    That has divisors enough to try many grids.
    """

    def __init__(self, body: Surface, model: Model, horizons: list[float]) -> None:
        self.body, self.periodic = body, (*model.periodic, True)
        self.axes = (1, 2) if model.is_flat else (0, 1, 2)
        # errors in the units of (x, p) from those of the coordinates
        self.scale = model.unit * (1.0 if model.name == "ambient" else float(np.hypot(1, size(body))))
        # short steps tell which of two rotations a long displacement is
        step = horizons[0] / np.ceil(horizons[0] / (0.5 * min(size(body), natural_horizon(body))))
        times = step * np.arange(1, round(horizons[-1] / step) + 1)
        self.rows = {axis: self._row(body, model, axis, np.array(horizons), times) for axis in self.axes}

    def _row(self, body: Surface, model: Model, axis: int, horizons: FloatArray, times: FloatArray) -> FloatArray:
        """Displacements along one axis: (horizons, lines, points, lanes)."""
        rng = np.random.default_rng(axis)
        lines, cells = 24, 192
        count = cells if self.periodic[axis] else cells + 1
        at = [np.repeat(rng.random(lines), count) for _ in range(3)]
        at[axis] = np.tile(np.arange(count) / cells, lines)
        at[2] = 2 * np.pi * at[2]
        chart = np.repeat(rng.integers(model.charts, size=lines), count)
        coordinates = np.concatenate([model.at(c, *(v[chart == c] for v in at)) for c in range(model.charts)])
        # lines of one chart are consecutive, and stay whole
        times = np.unique(np.concatenate([times, horizons]))
        states = trace_states(body, model.states(coordinates), times, rtol=1e-9, step=float(times[0]))
        values = []
        for horizon in horizons:
            upto = int(np.searchsorted(times, horizon * (1 - 1e-12))) + 1
            values.append(model.displacement(coordinates, states[:, :upto], times[:upto]).reshape(lines, count, -1))
        return np.stack(values)

    def errors(self, k: int, axis: int, degree: int) -> tuple[FloatArray, FloatArray]:
        """Cells of an axis, ascending, and the rms error of splines with them."""
        data, wraps = self.rows[axis][k], self.periodic[axis]
        count = data.shape[1]
        cells, errors = [], []
        for stride in (24, 16, 12, 8, 6, 4, 3, 2):
            if 192 // stride < degree + 4:
                continue
            spline = np.tensordot(thinning_operator(count, stride, degree, wraps), data[:, ::stride], axes=(1, 1))
            # a chart's margin spares it the ends of the row
            inner = slice(None) if wraps else slice(MARGIN * stride, count - MARGIN * stride)
            difference = np.moveaxis(spline, 0, 1)[:, inner] - data[:, inner]
            cells.append(192 // stride)
            errors.append(self.scale * float(np.sqrt(np.mean(np.sum(difference**2, axis=-1)))) + 1e-300)
        return np.array(cells), np.array(errors)

    def grid(self, k: int, degree: int, target: float) -> Grid:
        """Fewest nodes whose errors along the axes together are the target."""
        cells = [1.0] * (3 - len(self.axes))
        for axis in self.axes:
            n, e = self.errors(k, axis, degree)
            # the error that rows of finer cells would have, where tracing itself is no longer exact enough
            e = np.maximum.accumulate(e[::-1])[::-1]
            wanted = target / np.sqrt(len(self.axes))
            if wanted >= e[0]:
                cells.append(float(n[0]) * max((e[0] / wanted) ** (1 / (degree + 1)), 0.5))
            elif wanted <= e[-1]:
                cells.append(float(n[-1]) * (e[-1] / wanted) ** (1 / (degree + 1)))
            else:
                cells.append(float(np.exp(np.interp(-np.log(wanted), -np.log(e), np.log(n)))))
        return _grid(cells, degree, self.periodic[:2], least_cells(self.body), 0 not in self.axes)


def _grid(cells: list[float], degree: int, periodic: tuple[bool, ...], least: int, flat: bool) -> Grid:
    sides = [
        max(int(np.ceil(c)) if wraps else max(int(np.ceil(c)), least) + 1 + 2 * MARGIN, degree + (1 if wraps else 5))
        for c, wraps in zip(cells, periodic, strict=False)
    ]
    return Grid(
        (1 if flat else sides[0], sides[1], max(4 * int(np.ceil(cells[2] / 4)), 8)), degree, (periodic[0], periodic[1])
    )


def _scaled(plan: Plan, factor: float) -> Plan:
    grid = plan.grid
    cells = [factor * c for c in grid.cells]
    return replace(plan, grid=_grid(cells, grid.degree, grid.periodic, plan.least_cells, grid.is_flat))


def evaluation_seconds(body: Surface) -> float:
    """Nominal seconds of F, its gradient and Hessian at one point, and of the speed if there is one.

    Examples
    --------
    >>> import scatterers as sc
    >>> round(1e9 * evaluation_seconds(sc.Sphere()), 3)
    2.0
    """
    seconds = 0.0
    for source in (body, speed_of(body)):
        if source is not None:
            compiled: Any = getattr(source, "compiled", None)
            # by numpy methods, in blocks of 64: a twisted ellipsoid, and 0.9 of it the calls; else 2 ns for a quadric,
            # 50 ns for a quintic spline, and a closed form of 50 operations if the level does not tell
            seconds += 1.1e-6 if compiled is None else 4e-11 * float(getattr(compiled, "operations", 50.0))
    return seconds


def stage_seconds(body: Surface, *, jacobi: bool = False) -> float:
    """Nominal seconds of one ray and stage: besides F those of (x, p), of the Jacobi matrix, more with a speed."""
    more = 1.8e-9 if speed_of(body) is not None else 0.0
    return evaluation_seconds(body) + (1.2e-9 + more) + (1.8e-9 + more if jacobi else 0.0)


def tracing_cost(body: Surface) -> float:
    """Nominal seconds of direct integration at 1e-9 per ray and unit of length, the steps of 256 rays being counted."""
    length, rays = natural_horizon(body), 256
    states = pack(*random_bundle_points(body, rays, rng=np.random.default_rng(0)))
    steps: list[int] = []
    trace_states(body, states, np.array([length]), rtol=1e-9, step=length / 4, taken=steps)
    # a stage takes longer where the step adapts
    return sum(steps) * BLOCK * STAGES * (stage_seconds(body) + 5e-10) / (rays * length)


def direct_seconds(flow: DirectFlow, length: float, n_steps: int, *, carry_jacobi: bool) -> float:
    """Nominal seconds of a ray by equal steps; with the Jacobi matrix the attenuation is carried too."""
    body, step = flow.body, flow.step
    assert step is not None
    if not carry_jacobi:
        return n_steps * _steps(length / n_steps, step) * STAGES * stage_seconds(body)
    spacing = fine_spacing(body, flow.rtol, step)
    fine = n_steps * _steps(length / n_steps, spacing)
    steps = fine * _steps(length / fine, step)
    samples = fine * NODES
    # of a point at which the attenuation is sampled, besides F, 1e-8
    return steps * STAGES * stage_seconds(body, jacobi=True) + samples * (evaluation_seconds(body) + 1e-8)


def _steps(length: float, step: float) -> int:
    return max(1, int(np.ceil(length / step - 1e-9)))


def map_seconds(flow: PhaseMap, length: float, *, carry_jacobi: bool) -> float:
    """Nominal seconds of a ray by a map."""
    leap = flow.leaps[-1]
    flat = flow.grid.is_flat
    each = leap_seconds(flow.grid.degree, float(leap.state.nbytes), carry_jacobi=carry_jacobi, flat=flat)
    # and the conversions to the coordinates of the map and back
    return float(length / flow.horizon * each + 5e-8)


def leap_seconds(degree: int, nbytes: float, *, carry_jacobi: bool = False, flat: bool = False) -> float:
    """Nominal seconds of one leap of a ray anywhere on the body, for a table of (x, p) of ``nbytes``.

    20 (cubic) and 40 ns in the nearest cache, more by the logarithm of the table beyond 1 MB, where a stencil's cache
    lines come from farther away. A table without azimuth has 4 or 6 rows where another has 16 or 36.
    """
    base, farther = (20.0, 16.0) if degree == 3 else (40.0, 27.0)
    if flat:
        base, farther = (10.0, 4.0) if degree == 3 else (16.0, 5.0)
    leap = 1e-9 * (base + farther * float(np.log2(max(nbytes / 1e6, 1.0))))
    # Jacobi matrix and curvatures are three times as much, but packed beside each other; the attenuation is summed
    return (4 if flat else 2) * leap + 20e-9 if carry_jacobi else leap


def build_seconds(plan: Plan, model: Model, cost: float) -> float:
    """Nominal seconds of a direct build, given the `tracing_cost` of the body."""
    nodes = model.charts * int(np.prod(plan.grid.nodes))
    # the curvatures are wanted at several times of each leap
    traced = cost * plan.horizon / 2**plan.doublings * (6.0 if plan.carry_jacobi else 1.0)
    each = (traced + 6e-7 + DOUBLING * plan.doublings) * (2.5 if plan.carry_jacobi else 1.0)
    return float(0.1 + nodes * each)


def doublings_of(horizon: float, natural: float, cost: float) -> int:
    """Doublings that make the build fastest: each halves the tracing and costs two leaps and a fit at every node."""
    d = 0
    while cost * horizon / 2 ** (d + 1) > DOUBLING and horizon / 2 ** (d + 1) >= natural / 8:
        d += 1
    return d
