"""The choice between a phase map and direct integration, by their cost on this machine and body.

Direct integration takes c_d seconds a ray, with the longest equal steps that meet the tolerance; a map takes b seconds
to build and c_m a ray. For N rays the map is chosen if b + N c_m < N c_d, with c_d measured, b and c_m estimated before
the build, and c_m measured after it.
"""

from pathlib import Path
from time import process_time as clock

import numpy as np

from creeping._errors import IntegrationError, InvalidInputError, ToleranceError
from creeping._typing import FloatArray
from creeping.phaseflow.building import Progress
from creeping.phaseflow.bundle import random_bundle_points
from creeping.phaseflow.caching import cached_phase_map, is_cached
from creeping.phaseflow.compiled_models import CompiledModel
from creeping.phaseflow.direct import DirectFlow
from creeping.phaseflow.models import model_of
from creeping.phaseflow.phase_map import PhaseMap
from creeping.phaseflow.request import Request
from creeping.phaseflow.tracing import MapError, pack, trace_states
from creeping.phaseflow.tuning import candidates, tracing_cost, tuned_map
from creeping.surface import Surface, check_surface, size

SAMPLES = 512
"""Rays on which direct integration is measured and both are timed, fewer where F is dear."""
BUDGET = 0.2
"""Seconds that one measurement may take."""


def choose_flow(
    body: Surface,
    *,
    rays: int,
    length: float,
    tolerance: float = 1e-6,
    outputs: int = 1,
    ride_along: bool = True,
    cache: bool | str | Path = True,
    progress: Progress | None = None,
) -> PhaseMap | DirectFlow:
    """Choose the flow that carries rays fastest, its preparation included.

    Parameters
    ----------
    body : Surface
    rays : int
        Rays of all incidences together.
    length : float, L (travel time for a weighted body)
    tolerance : float
        Rms error of (x, p) at the end of the rays, 1e-12 to 1e-1.
    outputs : int
        Equally spaced points wanted on each ray.
    ride_along : bool
        Whether the Jacobi matrix is wanted, as by fans.
    cache : bool or path
        As for `build_phase_map`; a map in the cache costs nothing to build.
    progress : callable, optional
        Called with a line of text before each long step, and with the reason of the choice.

    Returns
    -------
    PhaseMap or DirectFlow
        Its horizon is ``length/outputs`` or divides it.

    Raises
    ------
    InvalidInputError
        On a number out of range.
    ToleranceError
        If direct integration does not reach the tolerance.
    """
    if not (isinstance(rays, (int, np.integer)) and rays >= 1):
        raise InvalidInputError(f"rays = {rays!r} is not a whole number >= 1")
    if not 1e-12 <= tolerance <= 1e-1:
        raise InvalidInputError(f"tolerance = {tolerance!r} is not between 1e-12 and 1e-1")
    bounded = max(tolerance, 1e-9)
    request = Request(body, bounded, length, outputs, None, None, None, None, ride_along, "direct", None, None)
    say = progress or (lambda _: None)
    check_surface(body).require()
    direct, each = tuned_direct(body, length, outputs, tolerance, ride_along)
    request.rays = int(rays)
    if tolerance < 1e-9:
        say("direct integration: no map reaches such a tolerance")
        return direct
    stored = cache is not False and is_cached(body, request.key(), folder=cache)
    if not stored:
        # a map takes some hundredths of a second to probe, let alone to build
        if rays * each < 0.05 or not isinstance(model_of(body), CompiledModel):
            say(f"direct integration: {rays} rays take {rays * each:.2g} s")
            return direct
        try:
            best = candidates(request, model_of(body), tracing_cost(body))[0]
        except ToleranceError as error:
            say(f"direct integration: {error}")
            return direct
        expected = best.seconds(rays, length)
        if expected > rays * each:
            say(f"direct integration: {rays} rays take {rays * each:.2g} s, with a map about {expected:.2g} s")
            return direct
    try:
        found = (
            tuned_map(request, say)
            if cache is False
            else cached_phase_map(body, request.key(), lambda: tuned_map(request, say), folder=cache, progress=say)
        )
    except ToleranceError as error:
        say(f"direct integration: {error}")
        return direct
    composed = _seconds_per_ray(found, body, length, outputs, ride_along, each)
    if composed > each:
        say(f"direct integration: {1e6 * each:.2g} us a ray, with the map {1e6 * composed:.2g}")
        return direct
    say(f"phase map: {1e6 * composed:.2g} us a ray, direct integration {1e6 * each:.2g}")
    return found


def tuned_direct(
    body: Surface, length: float, outputs: int, tolerance: float, ride_along: bool
) -> tuple[DirectFlow, float]:
    """Direct flow with the longest equal steps that meet the tolerance, and its seconds a ray.

    Raises
    ------
    ToleranceError
        If it does not meet the tolerance with steps as short as 1e-3 body sizes.
    """
    horizon = length / outputs
    cost = tracing_cost(body)
    count = int(np.clip(BUDGET / (cost * length), 32, SAMPLES))
    states = pack(*random_bundle_points(body, count, rng=np.random.default_rng(2)))
    times = np.array([length])
    exact = trace_states(body, states, times, rtol=float(np.clip(1e-3 * tolerance, 1e-14, 1e-9)))[:, 0]
    # equal steps serve compiled bodies only: numpy's tracer adapts one step for all rays anyway
    steps = max(1, int(np.ceil(length / (0.3 * size(body)))))
    for _ in range(12):
        step = length / steps
        try:
            error = np.linalg.norm(trace_states(body, states, times, rtol=0.0, step=step)[:, 0] - exact, axis=1)
            reached = float(np.sqrt(np.mean(error**2)))
        except IntegrationError:
            reached = np.inf
        if reached <= 0.8 * tolerance:
            measured = MapError(reached, float(error.max()), count)
            flow = DirectFlow(body, float(np.clip(1e-2 * tolerance, 1e-13, 1e-8)), horizon, step, measured)
            return flow, _seconds_per_ray(flow, body, length, outputs, ride_along, cost * length)
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


def _seconds_per_ray(
    flow: PhaseMap | DirectFlow, body: Surface, length: float, outputs: int, ride_along: bool, guess: float
) -> float:
    """Measured time of one ray, on one thread."""
    # whole blocks, or their unused rays would count
    count = 64 * int(np.clip(BUDGET / (64 * guess), 1, 16))
    states = _random_states(body, count, ride_along)
    times = length * np.arange(1, outputs + 1) / outputs
    flow.transport(states[:64], times[:1])
    best = np.inf
    for _ in range(3):
        start = clock()
        flow.transport(states, times)
        best = min(best, clock() - start)
    return max(float(best), 1e-9) / count


def _random_states(body: Surface, count: int, ride_along: bool) -> FloatArray:
    return pack(*random_bundle_points(body, count, rng=np.random.default_rng(3)), jacobi=ride_along)
