"""Shadow lines of many incidences at once, with the points that launch their rays.

Each line is sought on the coarsest mesh, and again on the next where a step was not certain of it; what the finest does
not resolve is followed by itself. `creeping.shadow.line` gives one of them with its points.

Sources: Derivations, R7.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.errors import SingularIncidenceError
from creeping.geometry.incident import rows_of
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.surface import Surface
from creeping.kernels.threads import in_threads
from creeping.shadow.arcs import finished
from creeping.shadow.attachment import LaunchPoints
from creeping.shadow.curves import Curves, LineNodes
from creeping.shadow.line import ShadowLine, shadow_line
from creeping.shadow.meshes import LineMeshes
from creeping.shadow.nodes import FORBIDDEN, critical_distances, judged, prepared, traced
from creeping.shadow.piecewise import launched_from
from creeping.shadow.refinement import followed
from creeping.shadow.status import FOLLOWED, OK, SINGULAR

LEAST = 8
"""Fewest incidences worth a thread."""
TOGETHER = 64
"""Most incidences at a time."""


@dataclass(frozen=True, eq=False)
class ShadowLines:
    """Shadow lines of n incidences.

    Attributes
    ----------
    directions : (n, 3)
    status : (n,) of int8
        Codes of `creeping.shadow.status.INCIDENCE_STATUSES`.
    curves, length, error, attached, occluded, concave, singular_distance : (n,)
        Closed curves, their length, L, its estimated relative error, shares of the length, and least |n.d| at a
        critical point with K = 0.
    launch : LaunchPoints
    """

    directions: FloatArray
    status: np.ndarray[Any, np.dtype[np.int8]]
    curves: FloatArray
    length: FloatArray
    error: FloatArray
    attached: FloatArray
    occluded: FloatArray
    concave: FloatArray
    singular_distance: FloatArray
    launch: LaunchPoints

    def of(self, rows: IntArray) -> "ShadowLines":
        """Those of some incidences."""
        parts: dict[str, Any] = {one.name: getattr(self, one.name) for one in fields(self)}
        return ShadowLines(**{name: part.of(rows) if name == "launch" else part[rows] for name, part in parts.items()})


def shadow_lines(body: Surface, directions: FloatArray, n_rays: int, *, every: bool = False) -> ShadowLines:
    """Shadow lines of unit directions.

    Parameters
    ----------
    body : Surface
    directions : (n, 3)
    n_rays : int
        Launch points of each, shared among the attached arcs by length and evenly spaced on each.
    every : bool
        Launch points on the whole line instead.

    Returns
    -------
    ShadowLines

    Raises
    ------
    SurfaceError
        If F = 0 has no closed triangulation in its bounds.
    """
    if is_piecewise(body):
        return _one_by_one(body, np.asarray(directions, dtype=float), n_rays, every)
    directions = np.ascontiguousarray(directions, dtype=float)
    n, waves, meshes, v = len(directions), rows_of(directions), prepared(body), critical_distances(body, directions)
    numbers, status = np.full((n, 6), np.nan), np.full(n, SINGULAR, np.int8)
    launch, certain = LaunchPoints.blank(directions, n_rays), np.zeros(n, dtype=bool)

    def take(rows: IntArray, nodes: Sequence[LineNodes]) -> BoolArray:
        """Fill in what is known of some lines; whether it is certain (rows,)."""
        curves = Curves.of(waves[rows], nodes)
        found = finished(body, curves, n_rays, every=every)
        numbers[rows, 0], numbers[rows, 1], numbers[rows, 3:] = curves.counts, curves.lengths, found.shares
        numbers[rows, 2] = [one.error for one in nodes]
        launch.put(rows, found.launch)
        return found.certain

    rows = np.flatnonzero(v >= FORBIDDEN)
    for tier in range(LineMeshes.count):
        if not len(rows):
            break
        meshes.packed(tier)

        def run(part: slice, rows: IntArray = rows, tier: int = tier) -> None:
            nodes, sure = traced(body, waves[rows[part]], tier)
            there = np.flatnonzero([one is not None for one in nodes])
            certain[rows[part]] = False
            if len(there):
                mine = rows[part][there]
                certain[mine] = sure[there] & take(mine, [one for one in nodes if one is not None])

        in_threads(run, len(rows), least=LEAST, multiple=1, most=TOGETHER)
        onward, status[rows] = judged(v[rows], certain[rows], meshes.turn(tier), tier)
        rows = rows[onward]
    for row in np.flatnonzero(status == FOLLOWED):
        numbers[row] = np.nan
        launch.put(np.array([row]), LaunchPoints.blank(directions[[row]], n_rays))
        try:
            nodes, _, v[row] = followed(body, directions[row], meshes.coarsest)
        except SingularIncidenceError as refused:
            status[row], v[row] = SINGULAR, float(getattr(refused, "distance", 0.0))
            continue
        take(np.array([row]), [nodes])
    curves, length, error, attached, occluded, concave = numbers.T
    return ShadowLines(directions, status, curves, length, error, attached, occluded, concave, v, launch)


def lines_together(
    directions: FloatArray, lines: Sequence[ShadowLine | None], n_rays: int, *, every: bool = False
) -> ShadowLines:
    """Lines of unit directions (n, 3) that were found one by one, None where one crosses itself; as `shadow_lines`."""
    n = len(directions)
    numbers, status = np.full((n, 6), np.nan), np.full(n, SINGULAR, np.int8)
    near, launches = np.zeros(n), []
    for row, (direction, line) in enumerate(zip(directions, lines, strict=True)):
        if line is None:
            launches.append(launched_from((), [], direction, n_rays))
            continue
        shares = line.fractions.values()
        numbers[row], status[row] = (len(line.curves), line.length, line.nodes.error, *shares), OK
        near[row] = line.singular_distance
        launches.append(line.launch_points(n_rays, "all" if every else "attached"))
    launched = LaunchPoints.together([LaunchPoints.blank(directions[:0], n_rays), *launches])
    curves, length, error, attached, occluded, concave = numbers.T
    launched = replace(launched, waves=directions)
    return ShadowLines(directions, status, curves, length, error, attached, occluded, concave, near, launched)


def _one_by_one(body: Surface, directions: FloatArray, n_rays: int, every: bool) -> ShadowLines:
    """Lines of a body with creases, each by itself."""
    lines: list[ShadowLine | None] = []
    for direction in directions:
        try:
            lines.append(shadow_line(body, direction, n_points=16))
        except SingularIncidenceError:
            lines.append(None)
    return lines_together(directions, lines, n_rays, every=every)
