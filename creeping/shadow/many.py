"""Shadow lines of many incidences at once, with the points that launch their rays.

Each line is sought on the coarsest mesh, and again on the next where a step was not certain of it; what the finest does
not resolve is followed by itself. `creeping.shadow.line` gives one of them with its points.

Also here: points next to shadow lines, moved onto them: many points, each with its own wave.

Sources: Derivations, R7.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping.errors import SingularIncidenceError
from creeping.geometry.evaluators import evaluators
from creeping.geometry.incident import rows_of
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.surface import Surface
from creeping.kernels.threads import in_threads
from creeping.shadow.attachment import LaunchPoints
from creeping.shadow.following import followed
from creeping.shadow.line import ShadowLine, shadow_line
from creeping.shadow.meshes import LineMeshes
from creeping.shadow.nodes import FORBIDDEN, box_of, critical_distances, finished, judged, prepared
from creeping.shadow.piecewise import launched_from
from creeping.shadow.status import FOLLOWED, NO_RAY, OK, SINGULAR

LEAST = 8
"""Fewest incidences worth a thread."""

EACH = 2e-7
"""Seconds of a point, about."""


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
    from creeping.shadow.kernels.trace import LAUNCHED, SUMMARY, trace_lines

    if is_piecewise(body):
        return _one_by_one(body, np.asarray(directions, dtype=float), n_rays, every)
    directions = np.ascontiguousarray(directions, dtype=float)
    n, waves = len(directions), rows_of(directions)
    meshes, box, v = prepared(body), box_of(body), critical_distances(body, directions)
    summary, status = np.full((n, SUMMARY), np.nan), np.full(n, SINGULAR, np.int8)
    launched, places = np.full((n, n_rays, LAUNCHED), np.nan), np.full((n, n_rays), NO_RAY, np.int16)
    rows = np.flatnonzero(v >= FORBIDDEN)
    for tier in range(LineMeshes.count):
        if not len(rows):
            break
        mesh, some = meshes.packed(tier), waves[rows]
        out = (
            np.empty((len(rows), SUMMARY)),
            np.empty(len(rows), bool),
            np.empty((len(rows), n_rays, LAUNCHED)),
            np.empty((len(rows), n_rays), np.int16),
        )
        with evaluators(body) as parts:

            def run(part: slice, mesh: Any = mesh, some: FloatArray = some, out: Any = out, parts: Any = parts) -> None:
                trace_lines(*parts[:2], box, mesh, some[part], every, *(values[part] for values in out))

            in_threads(run, len(rows), least=LEAST, multiple=1, seconds=1e-3)
        summary[rows], certain, launched[rows], places[rows] = out
        onward, status[rows] = judged(v[rows], certain, meshes.turn(tier), tier)
        rows = rows[onward]
    for row in np.flatnonzero(status == FOLLOWED):
        status[row], v[row] = _follow(body, directions[row], every, summary[row], launched[row], places[row])
    curves, length, error, attached, occluded, concave = summary.T
    launch = LaunchPoints.unpacked(directions, launched, places)
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
    launched = LaunchPoints(
        directions,
        *(
            np.concatenate(
                [np.zeros((0, n_rays, 3) if one.name == "points" else (0, n_rays))]
                + [getattr(launch, one.name) for launch in launches]
            )
            for one in fields(LaunchPoints)[1:]
        ),
    )
    curves, length, error, attached, occluded, concave = numbers.T
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


def _follow(
    body: Surface, direction: FloatArray, every: bool, summary: FloatArray, launched: FloatArray, places: Any
) -> tuple[int, float]:
    """Fill the results of a line that the meshes do not resolve; returns its status and the singular distance."""
    summary[:], launched[:], places[:] = np.nan, np.nan, NO_RAY
    try:
        nodes, curves, distance = followed(body, direction)
    except SingularIncidenceError as error:
        return SINGULAR, float(getattr(error, "distance", 0.0))
    found = finished(body, direction, nodes, len(places), every=every)
    summary[:] = len(curves), nodes.length, nodes.error, *found.shares
    launched[:], places[:] = found.launched, found.places
    return FOLLOWED, distance


class Moved(NamedTuple):
    """Points on lines (n, 3), L, the lines' unit tangents (n, 3), and the sizes (n,) of the steps that would follow, L.

    Of points from which there is no step nothing is finite.
    """

    points: FloatArray
    tangents: FloatArray
    left: FloatArray


def moved_onto_lines(body: Surface, waves: FloatArray, points: FloatArray, *, reach: float, steps: int) -> Moved:
    """Points of {F = 0, grad F.q = 0} by Newton steps of least norm, the same in whatever company.

    Parameters
    ----------
    body : Surface
    waves : (n, 3) or (n, 4)
        d of plane waves, or (d, w).
    points : (n, 3), L
        Next to the lines of their waves.
    reach : float, L
        Longest step.
    steps : int
        At most so many; a point stays where its next one would be rounding.
    """
    from creeping.shadow.kernels.newton import move, work_space

    waves = rows_of(waves)
    found = np.array(points, dtype=float, order="C")
    tangents, left = np.empty_like(found), np.empty(len(found))
    with evaluators(body) as parts:

        def run(part: slice) -> None:
            move(*parts[:2], waves[part], found[part], reach, steps, work_space(), tangents[part], left[part])

        in_threads(run, len(found), seconds=EACH)
    return Moved(found, tangents, left)
