"""Asking for a flow: a phase map, its missing parameters chosen, or the quicker of a map and direct integration.

Direct integration takes c_d seconds a ray, with the longest equal steps that meet the tolerance; a map takes b seconds
to build and c_m a ray. For N rays the map is chosen if b + N c_m < N c_d. All three are counted work times nominal
seconds (`search`), c_m once more after the build: the choice follows from what was asked for and from the maps
in the cache, not from how busy the machine is.

Sources: Derivations, R16.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from creeping._typing import FloatArray
from creeping.errors import IntegrationError, ToleranceError
from creeping.geodesics.direct_flow import DirectFlow
from creeping.geodesics.equations import natural_horizon
from creeping.geodesics.integrator import ErrorEstimate, trace_states
from creeping.geodesics.states import pack, random_bundle_points
from creeping.geometry.arguments import checked_body, folder_path, number_between, positive_number, reporter
from creeping.geometry.piecewise import checked_smooth, is_piecewise
from creeping.geometry.surface import Surface, size
from creeping.phaseflow.building import (
    Plan,
    Progress,
    build_direct,
    build_tower,
    require_checked,
    sampled_errors,
    upper_bound,
    with_errors,
)
from creeping.phaseflow.cache import cached_phase_map, cached_place
from creeping.phaseflow.coordinates import model_of
from creeping.phaseflow.map_spec import RAYS, MapSpec
from creeping.phaseflow.phase_map import PhaseMap
from creeping.phaseflow.rotation import CompiledModel
from creeping.phaseflow.search import (
    Candidate,
    candidates,
    direct_seconds,
    map_seconds,
    tracing_cost,
    tuned_map,
)
from creeping.phaseflow.splines import Grid

WORTH = 0.85
"""Share of direct integration that a map must be expected to take less than, and its tuning too."""


def build_phase_map(
    body: Surface,
    *,
    tolerance: float | None = None,
    length: float | None = None,
    n_steps: int = 1,
    n_rays: int = RAYS,
    horizon: float | None = None,
    grid: tuple[int, int] | tuple[int, int, int] | None = None,
    degree: int | None = None,
    precision: str | None = None,
    carry_jacobi: bool = True,
    method: str = "direct",
    time_step: float | None = None,
    stages: int | None = None,
    cache: bool | str | Path = True,
    progress: Progress | bool | None = None,
) -> PhaseMap:
    """Build the phase map g_T0 of a body, or open it from the cache.

    Parameters
    ----------
    body : Surface
    tolerance : float, optional
        Rms error, 1e-9 to 1e-1, of one g_T0 or, with ``length``, of the state at the end of the rays. It determines
        those of horizon, grid, degree and precision that are not given. 1e-6 if neither tolerance nor grid is given.
    length : float, optional, L (travel time for a weighted body)
        Length of the rays that must meet the tolerance; the horizon is chosen for the least cost.
    n_steps : int
        Number of equally spaced points wanted on a ray of ``length``; the horizon divides their spacing.
    n_rays : int
        Total number of rays to be traced, which determines how costly the map may be.
    horizon : float, optional
        T0, L (travel time for a weighted body).
    grid : (nodes, angles) or (nodes_u, nodes_v, angles), optional
        Nodes per chart, including its margin, and angles of direction on the circle. For a body of revolution the chart
        is a meridian, from pole to pole if there are poles, and ``nodes_u``, for the azimuth, is not used.
    degree : int, optional
        Degree of the splines, 3 or 5.
    precision : {"single", "double"}, optional
        Precision of the stored coefficients; sums are in double. By default double or, with a tolerance, single where
        single is accurate enough.
    carry_jacobi : bool
        Whether to carry the Jacobi matrix, which fans need.
    method : {"direct", "tower"}
        "tower" is Algorithm 1 of [YC06a]. It needs ``time_step``, ``stages``, ``horizon`` and ``grid``, and stores
        (x, p) as Cartesian vectors, as in the paper.
    time_step : float, optional
        Time step tau of the initial map, for "tower".
    stages : int, optional
        S, the number of levels of the tower.
    cache : bool or path
        True uses the cache folder of the user, a path another folder; False disables the cache.
    progress : callable or bool, optional
        Called with a line of text before each long step; True shows them.

    Returns
    -------
    PhaseMap
        With its error measured against `trace`.

    Raises
    ------
    InvalidInputError
        On parameters that contradict each other.
    ToleranceError
        If no map within the limits reaches the tolerance. The message states the error reached and a remedy.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> pm = cr.build_phase_map(sc.Sphere(), horizon=0.5, grid=(16, 16), degree=3, cache=False)
    >>> pm.horizon, pm.error.rms < 1e-9
    (0.5, True)
    """
    checked_smooth(body, "a phase map", "carry the rays by creeping.DirectFlow, or leave the choice to choose_flow")
    checked_body(body)
    report = reporter(progress)
    if tolerance is None and grid is None:
        tolerance = 1e-6
    spec = MapSpec(
        body=body,
        tolerance=tolerance,
        length=length,
        n_steps=n_steps,
        n_rays=n_rays,
        horizon=horizon,
        grid=grid,
        degree=degree,
        precision=precision,
        carry_jacobi=carry_jacobi,
        method=method,
        time_step=time_step,
        stages=stages,
    )
    cache = cache if isinstance(cache, bool) else folder_path(cache, "cache")
    if cache is False:
        return build_from(spec, report)
    return cached_phase_map(body, spec.key(), lambda: build_from(spec, report), folder=cache, progress=report)


def build_from(spec: MapSpec, progress: Progress) -> PhaseMap:
    """Build with the parameters given, choosing the missing ones.

    Raises
    ------
    ToleranceError
        If the map that was built misses the tolerance.
    """
    require_checked(spec.body)
    if spec.nodes is None:
        return tuned_map(spec, progress)
    grid = Grid(spec.nodes, spec.degree or 5, spec.model.periodic)
    if spec.tower:
        result = build_tower(spec.body, grid, *spec.tower, progress)
    else:
        plan = Plan(spec.horizon or natural_horizon(spec.body), grid, spec.precision == "single", spec.carry_jacobi)
        result = build_direct(spec.body, spec.model, plan, progress, rtol=1e-11)
    result = with_errors(result, spec.length)
    reached = result.growth.rms[-1] if spec.length and result.growth else result.error.rms
    if spec.tolerance is not None and reached > spec.tolerance:
        factor = (reached / spec.tolerance) ** (1 / (grid.degree + 1))
        enough = tuple(int(np.ceil(1.1 * factor * n)) for n in spec.nodes)
        raise ToleranceError(
            f"grid {spec.nodes} with horizon {result.horizon:g} reaches rms {reached:.1e}, not "
            f"{spec.tolerance:.1e}; about {enough} should do, or leave grid out",
            rms=reached,
        )
    return result


def choose_flow(
    body: Surface,
    *,
    n_rays: int,
    length: float,
    tolerance: float = 1e-6,
    n_steps: int = 1,
    carry_jacobi: bool = True,
    cache: bool | str | Path = True,
    progress: Progress | bool | None = None,
) -> PhaseMap | DirectFlow:
    """Choose the flow that traces the rays fastest, including the time to prepare a map.

    Parameters
    ----------
    body : Surface
    n_rays : int
        Total number of rays of all incidences.
    length : float, L (travel time for a weighted body)
    tolerance : float
        Rms error of (x, p) at the end of the rays, 1e-12 to 1e-1.
    n_steps : int
        Number of equally spaced points wanted on each ray.
    carry_jacobi : bool
        Whether the flow must carry the Jacobi matrix, which fans need.
    cache : bool or path
        As for `build_phase_map`. A cached map counts as free.
    progress : callable or bool, optional
        Called with a line of text before each long step and with the reason for the choice; True shows them.

    Returns
    -------
    PhaseMap or DirectFlow
        Its horizon divides ``length/n_steps``. Bodies without compiled kernels always get a `DirectFlow`.

    Raises
    ------
    InvalidInputError
        On a number out of range.
    ToleranceError
        If direct integration does not reach the tolerance.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> flow = cr.choose_flow(sc.Sphere(), n_rays=10, length=1.0, tolerance=1e-6, cache=False)
    >>> type(flow).__name__, flow.error.rms < 1e-6             # few rays do not pay for a map
    ('DirectFlow', True)
    """
    checked_body(body, charts=not is_piecewise(body))
    tolerance = number_between(tolerance, "tolerance", 1e-12, 1e-1)
    length = positive_number(length, "length")
    cache = cache if isinstance(cache, bool) else folder_path(cache, "cache")
    spec = MapSpec(
        body=body,
        tolerance=max(tolerance, 1e-9),
        length=length,
        n_steps=n_steps,
        n_rays=n_rays,
        carry_jacobi=carry_jacobi,
    )
    report = reporter(progress)
    if is_piecewise(body):
        report("direct integration: a body with creases has no phase map")
        # errors of the steps add up and grow along the rays
        return DirectFlow(body, float(np.clip(1e-4 * tolerance, 1e-13, 1e-8)), length / n_steps)
    require_checked(body)
    if cache is False:
        return _chosen(spec, tolerance, False, False, report)
    stored = _stored(spec, tolerance, cache)
    return _chosen(stored or spec, tolerance, cache, stored is not None, report)


def _stored(spec: MapSpec, tolerance: float, cache: bool | str | Path) -> MapSpec | None:
    """The spec of a map in the cache that can be used: the one asked for, or one for the usual number of rays."""
    if tolerance < 1e-9:
        return None
    for one in (spec, replace(spec, n_rays=RAYS)):
        if cached_place(one.body, one.key(), cache).exists():
            return one
    return None


def _chosen(
    spec: MapSpec, tolerance: float, cache: bool | str | Path, stored: bool, progress: Progress
) -> PhaseMap | DirectFlow:
    """The flow that is cheaper; a map that is ``stored`` costs nothing but its rays."""
    body, n_rays, n_steps, carry_jacobi = spec.body, spec.n_rays, spec.n_steps, spec.carry_jacobi
    length = spec.length
    assert length is not None
    cost = tracing_cost(body)
    # below, nothing is tuned
    if n_rays * length * cost < 0.3 and not stored:
        progress(f"direct integration: carrying {n_rays} rays takes about {n_rays * length * cost:.1g} s, fields apart")
        return _untuned_direct(body, length, n_steps, tolerance)
    direct, each = tuned_direct(body, length, n_steps, tolerance, carry_jacobi)
    if not stored:
        found, reason = _worth_building(spec, n_rays * each, cost, tolerance)
        if reason:
            progress(f"direct integration: {reason}")
            return direct
        spec = replace(spec, seconds=WORTH * n_rays * each)
    else:
        found = None

    def build() -> PhaseMap:
        return tuned_map(spec, progress, found)

    try:
        flow = build() if cache is False else cached_phase_map(body, spec.key(), build, folder=cache, progress=progress)
    except ToleranceError as error:
        progress(f"direct integration: {error}")
        return direct
    composed = map_seconds(flow, length, carry_jacobi=carry_jacobi)
    if composed > each:
        progress(f"direct integration: about {1e6 * each:.2g} us a ray, with the map {1e6 * composed:.2g}")
        return direct
    progress(f"phase map: about {1e6 * composed:.2g} us a ray, direct integration {1e6 * each:.2g}")
    return flow


def _worth_building(spec: MapSpec, direct: float, cost: float, tolerance: float) -> tuple[list[Candidate], str]:
    """Candidates for a map, and the reason to build none of them, if there is one; ``direct`` in nominal seconds."""
    body = spec.body
    time = f"carrying {spec.n_rays} rays takes about {direct:.2g} s, fields apart"
    if tolerance < 1e-9:
        return [], f"no map reaches such a tolerance; {time}"
    # what the smallest map takes, of 60 000 nodes, so that probing is not begun in vain
    least = 0.3 + 60_000 * (1e-6 + cost * natural_horizon(body) / 8) * (2.5 if spec.carry_jacobi else 1.0)
    if not isinstance(model_of(body), CompiledModel):
        return [], f"{body!r} has no compiled sphere map nor a doubly periodic chart"
    if direct < least:
        return [], time
    try:
        found = candidates(spec, model_of(body), cost)
    except ToleranceError as error:
        return [], str(error)
    assert spec.length is not None
    expected = found[0].seconds(spec.n_rays, spec.length)
    # estimates err, and so do the gains that they promise
    return found, f"{time}, with a map {expected:.2g} s" if expected > WORTH * direct else ""


def _untuned_direct(body: Surface, length: float, n_steps: int, tolerance: float) -> DirectFlow:
    """Direct flow with adapted steps, measured on a few rays: for so little work that tuning would take longer."""
    states = pack(*random_bundle_points(body, 64, rng=np.random.default_rng(2)))
    times = np.array([length])
    exact = trace_states(body, states, times, rtol=float(np.clip(1e-4 * tolerance, 1e-14, 1e-10)))[:, 0]
    rtol = float(np.clip(0.1 * tolerance, 1e-14, 1e-3))
    while True:
        flow = DirectFlow(body, rtol, length / n_steps)
        error = np.linalg.norm(flow.transport(states, times)[:, 0] - exact, axis=1)
        rms = float(np.sqrt(np.mean(error**2)))
        if rms <= 0.3 * tolerance:
            return replace(flow, error=ErrorEstimate(rms, float(error.max()), len(states)))
        if rtol <= 1e-14:
            raise ToleranceError(
                f"direct integration reaches rms {rms:.1e} after {length:g}, not {tolerance:.1e}; "
                "rounding grows along such rays: shorten them or loosen the tolerance",
                rms=rms,
            )
        rtol = max(0.1 * rtol, 1e-14)


def tuned_direct(
    body: Surface, length: float, n_steps: int, tolerance: float, carry_jacobi: bool
) -> tuple[DirectFlow, float]:
    """Direct flow with the longest equal steps that meet the tolerance, and its nominal seconds a ray.

    Raises
    ------
    ToleranceError
        If it does not meet the tolerance with steps as short as 1e-3 body sizes.
    """
    horizon = length / n_steps
    cost = tracing_cost(body)
    # nominal seconds that one measurement may take
    budget = 0.2
    count = int(np.clip(budget / (cost * length), 32, 512))
    times = np.array([length])
    reference = float(np.clip(1e-3 * tolerance, 1e-14, 1e-9))
    rng = np.random.default_rng(2)

    def errors(number: int) -> FloatArray:
        states = pack(*random_bundle_points(body, number, rng=rng))
        exact = trace_states(body, states, times, rtol=reference)
        found = trace_states(body, states, times, rtol=0.0, step=length / steps)
        return np.asarray(np.linalg.norm(found - exact, axis=2))

    steps = max(1, int(np.ceil(length / (0.3 * size(body)))))
    reached = np.inf
    for _ in range(12):
        try:
            error = sampled_errors(errors, count, 1 if 4 * cost * length * count > budget else 16)[:, 0]
            reached = upper_bound(error)
        except IntegrationError:
            reached = np.inf
        if reached <= tolerance:
            error_estimate = ErrorEstimate(float(np.sqrt(np.mean(error**2))), float(error.max()), len(error))
            flow = DirectFlow(
                body, float(np.clip(1e-2 * tolerance, 1e-13, 1e-8)), horizon, length / steps, error_estimate
            )
            return flow, direct_seconds(flow, length, n_steps, carry_jacobi=carry_jacobi)
        # an order below the method's own while it has not set in
        factor = (reached / (0.5 * tolerance)) ** (1 / 7.5) if np.isfinite(reached) else 2.0
        steps = int(np.ceil(steps * np.clip(factor, 1.1, 2.0)))
        if length / steps < 1e-3 * size(body):
            break
    raise ToleranceError(
        f"direct integration with steps of {length / steps:.2g} reaches rms {reached:.1e} after {length:g}, not "
        f"{tolerance:.1e}; rounding grows along such rays: shorten them or loosen the tolerance",
        rms=reached,
    )
