"""Asking for a phase map: parameters checked against each other, the missing ones chosen, the cache consulted."""

from pathlib import Path

import numpy as np

from creeping.errors import ToleranceError
from creeping.geodesics.equations import natural_horizon
from creeping.geometry.arguments import (
    checked_body,
    folder_path,
    reporter,
)
from creeping.geometry.piecewise import checked_smooth
from creeping.geometry.surface import Surface
from creeping.phaseflow.building import (
    Plan,
    Progress,
    build_direct,
    build_tower,
    require_checked,
    with_errors,
)
from creeping.phaseflow.cache import cached_phase_map
from creeping.phaseflow.phase_map import PhaseMap
from creeping.phaseflow.splines import Grid
from creeping.phaseflow.tuning.map_spec import RAYS, MapSpec
from creeping.phaseflow.tuning.search import tuned_map


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
    progress: Progress | None = None,
) -> PhaseMap:
    """Build the phase map g_T0 of a body, or open it from the cache.

    Parameters
    ----------
    body : Surface
    tolerance : float, optional
        Rms error, 1e-9 to 1e-1, of one g_T0, or with ``length`` of the final state; chooses whatever of horizon, grid,
        degree and precision is not given. 1e-6 if neither tolerance nor grid is given.
    length : float, optional, L (travel time for a weighted body)
        Length of the rays that shall meet the tolerance; the horizon is as long as pays.
    n_steps : int
        Equally spaced points of a ray that are wanted, with ``length``: the horizon divides their distance.
    n_rays : int
        Rays to come, in all: what a build may cost follows from it.
    horizon : float, optional
        T0, L (travel time for a weighted body).
    grid : (nodes, angles) or (nodes_u, nodes_v, angles), optional
        Nodes per chart, margin included, and on the circle. The chart of a body of revolution is a meridian, from pole
        to pole where it has poles: ``nodes_u``, of the azimuth, is not used.
    degree : int, optional
        Degree of the splines, 3 or 5.
    precision : {"single", "double"}, optional
        Of the stored coefficients; sums are in double. With a tolerance single where that is exact enough, else double.
    carry_jacobi : bool
        Whether to carry the Jacobi matrix, which fans need.
    method : {"direct", "tower"}
        "tower" is Algorithm 1 and needs ``time_step``, ``stages``, ``horizon`` and ``grid``; it stores (x, p) in space,
        as the paper does.
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
