"""The shadow line of an incident wave, and those of many: the curves n.q = 0, and what part of them launches rays.

    F(x) = 0,   grad F(x).q = 0,   T = grad F x Hq / |.|,   kappa_n = q.Hq/(|grad F| |q|^2)

q = d of a plane wave, x - x_s of a point source. Seen from outside, the lit side (n.q < 0) is on the left of T. Each
line is sought on the coarsest mesh, and again on the next where a step was not certain of it. What the finest does not
resolve, and a single line next to a singular direction, is followed by itself, with its topology proven
(`refinement`).

Sources: Derivations, R6, R7 and R19.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from creeping._presenting import DrawnOnBody, brief
from creeping._typing import Any, ArrayLike, BoolArray, FloatArray, IntArray
from creeping.errors import InvalidInputError, SingularIncidenceError
from creeping.geometry.arguments import checked_body, whole_number
from creeping.geometry.checks import unit_of
from creeping.geometry.evaluators import speed_of
from creeping.geometry.incident import Incident, PointSource, incident_of, plane_direction, rows_of
from creeping.geometry.patches import Rows
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.surface import Surface, normal, size
from creeping.kernels.threads import in_threads
from creeping.shadow.arcs import Arcs, Finished, finished
from creeping.shadow.attachment import Arc, LaunchPoints
from creeping.shadow.curve import ShadowCurve, counted, nodes_of, spelled
from creeping.shadow.curves import Curves, LineNodes, interpolated, polished
from creeping.shadow.meshes import LineMeshes, clearance, critical_distances, judged, prepared, traced
from creeping.shadow.panels import PanelCurve
from creeping.shadow.piecewise import EdgePart, launched_from, piecewise_curves
from creeping.shadow.refinement import FORBIDDEN, followed
from creeping.shadow.status import STATUSES, LineStatus
from creeping.storage.memory import within_budget


@dataclass(frozen=True, eq=False, repr=False)
class ShadowLine(DrawnOnBody):
    """Shadow line of one incidence.

    Attributes
    ----------
    body : Surface
    source : PlaneWave or PointSource
    curves : tuple of ShadowCurve
        Longest first.
    singular_distance : float
        Least |n.d| at critical points of n.d on the body other than n = +-d; inf if there are none. To first order
        it is the angle from d to the nearest direction whose shadow line crosses itself. For a point source d is the
        unit vector from the source; a source within one body size of the body also limits the value to its height
        above the body, in body sizes.
    nodes : LineNodes
        Points from which the curves are interpolated.
    on_edges : tuple of EdgePart
        Parts of the line that run along edges, which launch no creeping rays.
    at_tips : float, L
        Length of the parts that launch no rays because they lie next to tips or turn too sharply to be traced.
    edge_on : tuple of int
        Numbers of the pieces on which n.d = 0 everywhere. They have no shadow line and count as dark.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> line = cr.shadow_line(sc.Sphere(radius=0.5), direction=(1, 1, 1))
    >>> round(line.length, 6), len(line.curves), round(line.fractions["attached"], 6)
    (3.141593, 1, 1.0)
    """

    body: Surface
    source: Incident
    curves: tuple[ShadowCurve, ...]
    singular_distance: float
    nodes: LineNodes
    on_edges: tuple[EdgePart, ...] = ()
    at_tips: float = 0.0
    edge_on: tuple[int, ...] = ()

    @property
    def direction(self) -> FloatArray:
        """Unit vector (3,) along which the plane wave travels; an error for a point source."""
        return plane_direction(self.source, "this shadow line")

    @property
    def wave(self) -> FloatArray:
        """Homogeneous coordinates (d, w) of the source, see `creeping.geometry.incident`: (4,)."""
        return self.source.row(self.body)

    @property
    def _together(self) -> Curves:
        return Curves.of(rows_of(self.wave)[None], [self.nodes])

    @property
    def length(self) -> float:
        """Length of all curves, L, without the parts on edges and next to tips."""
        return self.nodes.length

    @property
    def edge_share(self) -> float:
        """Share of the whole line that lies on edges or next to tips; 0 for a smooth body."""
        lost = sum(part.length for part in self.on_edges) + self.at_tips
        return lost / (self.length + lost) if lost else 0.0

    @property
    def fractions(self) -> dict[str, float]:
        """Shares of the length of all curves that are attached, occluded and concave, by name."""
        length = sum(curve.length for curve in self.curves) or 1.0
        return {
            status: sum(curve.fractions[status] * curve.length for curve in self.curves) / length for status in STATUSES
        }

    def arcs(self, launch_from: str = "attached") -> list[Arc]:
        """Arcs that launch rays: the attached arcs or, with "all", every curve as a whole."""
        checked_launch_from(launch_from)
        if launch_from == "all":
            return [Arc(number, 0.0, curve.length, curve.closed) for number, curve in enumerate(self.curves)]
        return [
            Arc(number, start, end, curve.closed and len(curve.arcs) == 1)
            for number, curve in enumerate(self.curves)
            for start, end, status in curve.arcs
            if status == "attached"
        ]

    def launch_points(self, n_rays: int, launch_from: str = "attached") -> LaunchPoints:
        """Launch points, ``n_rays`` in total, on the arcs, as `shadow_lines` returns them for one incidence."""
        checked_launch_from(launch_from)
        n_rays = whole_number(n_rays, "n_rays", 0)
        within_budget(400.0 * n_rays, f"{n_rays} rays", "ask for fewer")
        if is_piecewise(self.body):
            return launched_from(self.curves, self.arcs(launch_from), self.direction, n_rays)
        return finished(self.body, self._together, n_rays, every=launch_from == "all").launch

    def __repr__(self) -> str:
        worst = max((float(np.max(np.abs(curve.grazing))) for curve in self.curves), default=0.0)
        points = sum(len(curve.points) for curve in self.curves)
        on_edges = f"; {self.edge_share:.4g} of it on edges and tips" if self.edge_share else ""
        return (
            f"ShadowLine({counted(len(self.curves), 'curve')}, {points} points, "
            f"length {self.length:.10g} {unit_of(self.body)}, "
            f"{wave_words(self.source)})\n"
            f"  {spelled(self.fractions)}{on_edges}; on {brief(self.body)}\n"
            f"  |n.d| at most {worst:.1e}; singular distance {self.singular_distance:.3g}"
        )


def checked_launch_from(launch_from: str) -> None:
    """Refuse what names no points of a line.

    Raises
    ------
    InvalidInputError
    """
    if not isinstance(launch_from, str) or launch_from not in ("attached", "all"):
        raise InvalidInputError(f"launch_from = {launch_from!r} is neither 'attached' nor 'all'")


def shadow_line(
    body: Surface, direction: ArrayLike | None = None, *, source: Incident | None = None, n_points: int = 512
) -> ShadowLine:
    """Find the shadow line of a plane wave or a point source and classify it.

    Parameters
    ----------
    body : Surface
        Only ``level``, ``gradient``, ``hessian`` and ``bounds`` are used.
    direction : (3,)
        Direction of travel of a plane wave; need not be unit.
    source : PointSource or PlaneWave
        Use in place of a direction. A point source must be outside a smooth body.
    n_points : int
        Points on each curve, at least 16; lengths and arcs do not depend on it.

    Returns
    -------
    ShadowLine

    Raises
    ------
    InvalidInputError
        If the direction, the source or n_points is not usable, e.g. a source inside the body or on it.
    SurfaceError
        If F = 0 has no closed triangulation in its bounds.
    SingularIncidenceError
        If the line crosses itself, or comes so close to it that its curves cannot be separated.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> line = cr.shadow_line(sc.Torus(), direction=(0, 0, 1))
    >>> [round(curve.length, 6) for curve in line.curves]          # outer and inner equator
    [9.424778, 3.141593]
    >>> line = cr.shadow_line(sc.Torus(), source=cr.PointSource((0, 0, 0)))        # in its hole
    >>> [round(float(abs(curve.points[:, 2]).max()), 6) for curve in line.curves]
    [0.433013, 0.433013]
    """
    checked_body(body, charts=False)
    incident = incident_of(direction, source)
    n_points = whole_number(n_points, "n_points", 16)
    within_budget(150.0 * n_points, f"{n_points} points of the shadow line", "ask for fewer")
    if is_piecewise(body):
        return _piecewise_line(body, incident, n_points)
    if isinstance(incident, PointSource):
        _checked_height(body, incident)
    d = incident.row(body)
    row, lines = rows_of(d)[None], list[tuple[LineNodes, Finished]]()

    def take(_: IntArray, nodes: Sequence[LineNodes]) -> BoolArray:
        lines.append((nodes[0], finished(body, Curves.of(row, nodes), 0)))
        return lines[-1][1].certain

    status, distances = _on_meshes(body, row, take)
    code, distance = int(status[0]), float(distances[0])
    panels: tuple[PanelCurve, ...] = ()
    if code != LineStatus.OK:
        exact, panels, distance = followed(body, d, prepared(body).coarsest)
        if code == LineStatus.NEAR_SINGULAR and len(lines[-1][0].spacing) == len(panels):
            # the meshes had the right number of curves: the line is theirs, as in a sweep
            panels = ()
        else:
            take(np.zeros(1, np.int64), [exact])
    nodes, arcs = lines[-1][0], lines[-1][1].arcs
    exact_curves = panels or (None,) * len(nodes.spacing)
    curves = [_curve(body, d, nodes, arcs, k, n_points, of) for k, of in enumerate(exact_curves)]
    return ShadowLine(body, incident, tuple(curves), distance, nodes)


def wave_words(source: Incident) -> str:
    """A wave in words: its direction, or where its source is."""
    name, numbers = ("source", source.position) if isinstance(source, PointSource) else ("direction", source.direction)
    return f"{name} ({', '.join(f'{x:.4g}' for x in numbers)})"


def _checked_height(body: Surface, source: PointSource) -> None:
    """Refuse a point source inside the body, on it, or so near or far that no line can be told."""
    # heights in body sizes
    nearest, farthest = 1e-5, 1e6
    height, unit = clearance(body, np.array(source.position)), size(body)
    if height > farthest * unit:
        raise InvalidInputError(
            f"{source!r} is {height / unit:.1e} body sizes away, more than {farthest:g}: give a PlaneWave"
        )
    if height <= nearest * unit:
        where = "inside the body or on it" if height <= 0 else f"{height / unit:.1e} body sizes above it"
        raise InvalidInputError(
            f"{source!r} is {where}, where it launches no creeping rays; put it {nearest:g} sizes above. "
            "creeping.source_pattern gives the far field of sources on the body, creeping.coupling fields between them"
        )


def _piecewise_line(body: Surface, source: Incident, n_points: int) -> ShadowLine:
    if isinstance(source, PointSource):
        raise InvalidInputError(
            f"{brief(body)} has creases: the shadow line of a point source is that of a smooth body; give a PlaneWave"
        )
    direction = np.array(source.direction)
    if speed_of(body) is not None:
        raise InvalidInputError(f"{brief(body)} has creases and a speed; give a body with one or the other")
    curves, on_edges, at_tips, edge_on = piecewise_curves(body, direction, n_points)
    return ShadowLine(body, source, curves, float("inf"), nodes_of(curves), on_edges, at_tips, edge_on)


def _curve(
    body: Surface, wave: FloatArray, nodes: LineNodes, arcs: Arcs, number: int, n_points: int, panels: PanelCurve | None
) -> ShadowCurve:
    first, last = nodes.starts[number : number + 2]
    own = nodes.points[first:last]
    spacing = float(nodes.spacing[number])
    length = spacing * len(own)
    arclength = np.linspace(0.0, length, n_points, endpoint=False, dtype=np.float64)
    points, tangents, curvature = polished(body, wave, interpolated(own, 0, len(own), arclength / spacing))
    mine = arcs.curve == number
    ends, codes = spacing * arcs.ends[mine], arcs.state[mine]
    ends -= length * np.floor(ends[:, :1] / length)
    order = np.argsort(ends[:, 0])
    ends, codes = ends[order], codes[order]
    # the arc before the first start is the last one, which comes round
    place = np.searchsorted(ends[:, 0], arclength, side="right") - 1
    return ShadowCurve(
        body=body,
        wave=wave,
        points=points,
        normals=normal(body, points),
        tangents=tangents,
        arclength=arclength,
        length=length,
        error=nodes.error,
        status=np.array(STATUSES)[codes[place]],
        curvature=curvature,
        arcs=tuple((start, end, STATUSES[code]) for (start, end), code in zip(ends.tolist(), codes, strict=True)),
        nodes=own,
        panels=panels,
    )


def shares_of(line: ShadowLine) -> dict[str, float]:
    """Shares of a line's length by state, as a sweep adds them."""
    shares = finished(line.body, line._together, 0).shares[0]
    return dict(zip(line.fractions, shares.tolist(), strict=True))


TOGETHER = 64
"""Most incidences at a time."""


@dataclass(frozen=True, eq=False)
class ShadowLines(Rows):
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


def shadow_lines(body: Surface, directions: FloatArray, n_rays: int) -> ShadowLines:
    """Shadow lines of unit directions.

    Parameters
    ----------
    body : Surface
    directions : (n, 3)
    n_rays : int
        Launch points of each, shared among the attached arcs by length and evenly spaced on each.

    Returns
    -------
    ShadowLines

    Raises
    ------
    SurfaceError
        If F = 0 has no closed triangulation in its bounds.
    """
    if is_piecewise(body):
        lines: list[ShadowLine | None] = []
        for direction in directions:
            try:
                lines.append(shadow_line(body, direction, n_points=16))
            except SingularIncidenceError:
                lines.append(None)
        return lines_together(np.asarray(directions, dtype=float), lines, n_rays)
    directions = np.ascontiguousarray(directions, dtype=float)
    waves, numbers = rows_of(directions), np.full((len(directions), 6), np.nan)
    launch = LaunchPoints.blank(directions, n_rays)

    def take(rows: IntArray, nodes: Sequence[LineNodes]) -> BoolArray:
        """Fill in what is known of some lines; whether it is certain (rows,)."""
        curves = Curves.of(waves[rows], nodes)
        found = finished(body, curves, n_rays)
        numbers[rows, 0], numbers[rows, 1], numbers[rows, 3:] = curves.counts, curves.lengths, found.shares
        numbers[rows, 2] = [one.error for one in nodes]
        launch.put(rows, found.launch)
        return found.certain

    status, v = _on_meshes(body, waves, take)
    for row in np.flatnonzero(status == LineStatus.FOLLOWED):
        numbers[row] = np.nan
        launch.put(np.array([row]), LaunchPoints.blank(directions[[row]], n_rays))
        try:
            nodes, _, v[row] = followed(body, directions[row], prepared(body).coarsest)
        except SingularIncidenceError as refused:
            status[row], v[row] = LineStatus.SINGULAR, float(getattr(refused, "distance", 0.0))
            continue
        take(np.array([row]), [nodes])
    curves, length, error, attached, occluded, concave = numbers.T
    return ShadowLines(directions, status, curves, length, error, attached, occluded, concave, v, launch)


def _on_meshes(
    body: Surface, waves: FloatArray, take: Callable[[IntArray, Sequence[LineNodes]], BoolArray]
) -> tuple[np.ndarray[Any, np.dtype[np.int8]], FloatArray]:
    """Seek the lines of waves (n, 4), each on the coarsest mesh that is certain of it: their codes (n,), and v (n,).

    ``take`` is given the rows (m,) of lines and their nodes on each mesh, and says whether they are certain (m,).
    """
    n, meshes, v = len(waves), prepared(body), critical_distances(body, waves)
    status, certain = np.full(n, LineStatus.SINGULAR, np.int8), np.zeros(n, dtype=bool)
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

        # fewer incidences are not worth a thread
        in_threads(run, len(rows), least=8, multiple=1, most=TOGETHER)
        onward, status[rows] = judged(v[rows], certain[rows], meshes.turn(tier), tier)
        rows = rows[onward]
    return status, v


def lines_together(directions: FloatArray, lines: Sequence[ShadowLine | None], n_rays: int) -> ShadowLines:
    """Lines of unit directions (n, 3) that were found one by one, None where one crosses itself; as `shadow_lines`."""
    n = len(directions)
    numbers, status = np.full((n, 6), np.nan), np.full(n, LineStatus.SINGULAR, np.int8)
    near, launches = np.zeros(n), []
    for row, (direction, line) in enumerate(zip(directions, lines, strict=True)):
        if line is None:
            launches.append(launched_from((), [], direction, n_rays))
            continue
        shares = line.fractions.values()
        numbers[row], status[row] = (len(line.curves), line.length, line.nodes.error, *shares), LineStatus.OK
        near[row] = line.singular_distance
        launches.append(line.launch_points(n_rays))
    launched = LaunchPoints.joined([LaunchPoints.blank(directions[:0], n_rays), *launches])
    launched = replace(launched, waves=directions)
    curves, length, error, attached, occluded, concave = numbers.T
    return ShadowLines(directions, status, curves, length, error, attached, occluded, concave, near, launched)
