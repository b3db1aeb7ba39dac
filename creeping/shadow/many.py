"""Shadow lines of many incidences at sweep speed, with the points that launch their rays.

The compiled route of `shadow.kernels.trace`; `creeping.shadow.line` follows one line by other means and to rounding.
"""

from dataclasses import dataclass, fields
from weakref import finalize

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping.errors import SingularIncidenceError
from creeping.geometry.surface import Surface
from creeping.kernels.threads import in_threads
from creeping.shadow.attachment import launch_positions, launching_arcs
from creeping.shadow.line import shadow_line
from creeping.shadow.meshes import LineMeshes, line_meshes
from creeping.shadow.status import FOLLOWED, NO_RAY, SINGULAR

LEAST = 8
"""Fewest incidences worth a thread."""
_PREPARED: dict[int, LineMeshes] = {}
"""By identity: bodies may be equal to others, or not be hashable."""


@dataclass(frozen=True, eq=False)
class ShadowLines:
    """Shadow lines of n incidences, with places for so many rays each.

    Attributes
    ----------
    directions : (n, 3)
    status : (n,) of int8
        Codes of `creeping.sweeping.request.INCIDENCE_STATUSES`.
    curves, length, error, attached, occluded, concave, singular_distance : (n,)
        Closed curves, their length, L, its estimated relative error, shares of the length, and least |n.d| at a
        critical point with K = 0.
    launch_points : (n, rays, 3), L
        NaN where there is no ray, as below.
    arclength, launch_phase : (n, rays), L
        Along the curve, and d.x0.
    curve_index : (n, rays)
        The longest curve is 0; -1 where there is no ray.
    arc_index, spacing, closed : (n, rays)
        Number of the attached arc, distance of neighbours on it, L, and 1 if it is a whole curve.
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
    launch_points: FloatArray
    arclength: FloatArray
    launch_phase: FloatArray
    curve_index: np.ndarray[Any, np.dtype[np.int16]]
    arc_index: FloatArray
    spacing: FloatArray
    closed: FloatArray

    def of(self, rows: IntArray) -> "ShadowLines":
        """Those of some incidences."""
        return ShadowLines(*(getattr(self, part.name)[rows] for part in fields(self)))


def prepared(body: Surface) -> LineMeshes:
    """Meshes of a body, made once."""
    key = id(body)
    if key not in _PREPARED:
        _PREPARED[key] = line_meshes(body)
        finalize(body, _PREPARED.pop, key, None)
    return _PREPARED[key]


def shadow_lines(body: Any, directions: FloatArray, n_rays: int) -> ShadowLines:
    """Shadow lines of the unit directions (n, 3) of a body with a compiled level.

    Rays are shared among the attached arcs by length and equally spaced on each, as by `creeping.rays.launch`.
    """
    from creeping.shadow.kernels.trace import trace_lines

    n = len(directions)
    summary, status = np.empty((n, 7)), np.empty(n, np.int8)
    launched, places = np.empty((n, n_rays, 8)), np.empty((n, n_rays), np.int16)
    lines, level = prepared(body), body.compiled
    box = np.ascontiguousarray(body.bounds, dtype=float)
    directions = np.ascontiguousarray(directions, dtype=float)

    def run(part: slice) -> None:
        out = summary[part], status[part], launched[part], places[part]
        trace_lines(level.function, level.parameters, box, lines.meshes, lines.critical, directions[part], *out)

    in_threads(run, n, least=LEAST, multiple=1)
    for row in np.flatnonzero(status == FOLLOWED):
        status[row] = _follow(body, directions[row], summary[row], launched[row], places[row])
    curves, length, error, attached, occluded, concave, distance = summary.T
    points, *rest = launched[..., :3], *(launched[..., k] for k in range(3, 8))
    arclength, phase, arc, spacing, closed = rest
    return ShadowLines(
        directions, status, curves, length, error, attached, occluded, concave, distance,
        points, arclength, phase, places, arc, spacing, closed,
    )  # fmt: skip


def _follow(body: Surface, direction: FloatArray, summary: FloatArray, launched: FloatArray, places: Any) -> int:
    """Fill the results of a line that the meshes do not resolve, by `shadow_line`; returns its status."""
    launched[:], places[:] = np.nan, NO_RAY
    try:
        line = shadow_line(body, direction, n_points=16)
    except SingularIncidenceError as error:
        summary[:6] = np.nan
        summary[6] = getattr(error, "distance", 0.0)
        return SINGULAR
    shares = line.fractions
    # panels are exact to rounding
    summary[:] = len(line.curves), line.length, 1e-12, *shares.values(), line.singular_distance
    arcs = launching_arcs(line, every=False)
    arc, s = launch_positions(line, arcs, len(places))
    n = min(len(arc), len(places))
    counts = np.bincount(arc, minlength=len(arcs))
    for number, one in enumerate(arcs):
        rows = np.flatnonzero(arc[:n] == number)
        curve = line.curves[one.curve]
        launched[rows, :3] = curve.at(s[rows])
        launched[rows, 3], launched[rows, 4] = s[rows] % curve.length, launched[rows, :3] @ line.direction
        launched[rows, 5:] = number, (one.end - one.start) / counts[number], one.closed
        places[rows] = one.curve
    return FOLLOWED
