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
        "tower" is Algorithm 1 of the paper. It needs ``time_step``, ``stages``, ``horizon`` and ``grid``, and stores
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
