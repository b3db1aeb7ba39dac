"""Shadow lines of bodies with creases: the curves of each piece, and edges.

Each curve is that of a smooth F_i (`creeping.shadow.piece_curves`), in panels exact to rounding. Whether the wave comes
to a point is asked of the whole body, at points of the curve and, by bisection, where two neighbours differ.

Parts of a body's creases belong to the line, too, but launch no creeping ray. Seen along d, the outline runs along a
convex edge where it is lit on one side only,

    (n_i.d < 0) != (n_j.d < 0),

and a piece that lies edge-on, n.d = 0, counts as dark. Between the points of a crease the edge is the cubic with their
tangents e = n_i x n_j/|.|.

Sources: Derivations, R6 and R10.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.errors import SingularIncidenceError
from creeping.geodesics.attenuation import gauss_rule
from creeping.geometry.piecewise import pieces_of, tiles_of, tips_of
from creeping.geometry.surface import size
from creeping.shadow.arcs import shared_out
from creeping.shadow.attachment import Arc, LaunchPoints, occluded
from creeping.shadow.curve import ShadowCurve
from creeping.shadow.curves import moved_onto_lines
from creeping.shadow.panels import LENGTH_TOLERANCE, PanelCurve, fit_panels
from creeping.shadow.piece_curves import EDGE_ON, PieceCurve, curves_on, edge_on
from creeping.shadow.status import STATUSES, PointState

MEET = 1e-7
"""Least length of a curve, in body sizes."""


def piecewise_curves(
    body: Any, direction: FloatArray, n_points: int
) -> tuple[tuple[ShadowCurve, ...], tuple["EdgePart", ...], float, tuple[int, ...]]:
    """Curves of the line of a unit direction, the longest first.

    Returns
    -------
    curves : tuple of ShadowCurve
    on_edges : tuple of EdgePart
    at_tips : float, L
        Length between curves and the tips they come to, and of what cannot be followed.
    edge_on : tuple of int
        Pieces all over which n.d = 0.

    Raises
    ------
    SingularIncidenceError
        If a curve cannot be followed.
    """
    # corners of triangles with such sides, in body sizes, seed the curves
    pieces, tiles = pieces_of(body), tiles_of(body, 0.05)
    level = tuple(k for k in range(len(pieces)) if edge_on(tiles, k, direction))
    curves, gaps = [], 0.0
    for number in range(len(pieces)):
        if number in level:
            continue
        on_piece, missing = curves_on(body, pieces, number, direction, tiles)
        gaps += missing
        for found in on_piece:
            try:
                curve, found = _as_far_as_known(body, pieces[number], number, direction, found, n_points)
            except SingularIncidenceError:
                # it turns within rounding of a crossing somewhere: all of it is lost
                gaps += float(np.sum(np.linalg.norm(np.diff(found.nodes, axis=0), axis=1)))
                continue
            if curve.length > MEET * size(body):
                curves.append(curve)
                gaps += sum(found.gaps)
    curves.sort(key=lambda curve: -curve.length)
    return tuple(curves), parts_on_edges(body, pieces, direction), gaps, level


def _as_far_as_known(
    body: Any, piece: Any, number: int, direction: FloatArray, found: PieceCurve, n_points: int
) -> tuple[ShadowCurve, PieceCurve]:
    """The curve in panels; where these fail next to a tip, as the slope of F fades into rounding, ended farther off."""
    for _ in range(5):
        try:
            return _finished(body, piece, number, direction, found, n_points), found
        except SingularIncidenceError:
            shorter = _ended_earlier(body, found)
            if shorter is None:
                raise
            found = shorter
    return _finished(body, piece, number, direction, found, n_points), found


def _ended_earlier(body: Any, found: PieceCurve) -> PieceCurve | None:
    """A curve that ends at tips without its nodes within twice its gaps; None if it does not, or hardly one is left."""
    nodes, gaps = found.nodes, list(found.gaps)
    for side, way in ((0, 1), (1, -1)):
        if gaps[side] > 0:
            tips = tips_of(body)[1]
            tip = tips[np.argmin(np.linalg.norm(tips - nodes[-side], axis=1))]
            away = np.linalg.norm(nodes[::way] - tip, axis=1)
            first = int(np.argmax(away > 2 * gaps[side]))
            nodes, gaps[side] = nodes[::way][first:][::way], float(away[first])
    if gaps == list(found.gaps) or len(nodes) < 3:
        return None
    return found._replace(nodes=nodes, gaps=(gaps[0], gaps[1]))


def _finished(
    body: Any, piece: Any, number: int, direction: FloatArray, found: PieceCurve, n_points: int
) -> ShadowCurve:
    chords = np.linalg.norm(np.roll(found.nodes, -1, axis=0) - found.nodes, axis=1)
    # one that takes more, as along a generator that the wave goes along, is lost, and takes minutes
    panels = fit_panels(piece, direction, found.nodes, chords, closed=found.closed, most=1000)
    arclength = np.linspace(0.0, panels.length, n_points, endpoint=not found.closed)
    points, tangents, curvature, _ = moved_onto_lines(piece, direction, panels.at(arclength), reach=0.0, steps=0)
    arcs = _arcs(body, piece, direction, panels)
    curve = ShadowCurve(
        body=body,
        wave=direction,
        points=points,
        normals=unit_normals(piece, points),
        tangents=tangents,
        arclength=arclength,
        length=panels.length,
        error=LENGTH_TOLERANCE,
        status=np.full(n_points, STATUSES[PointState.ATTACHED]),
        curvature=curvature,
        arcs=arcs,
        nodes=points,
        closed=found.closed,
        piece=number,
        panels=panels,
    )
    curve.status[:] = np.array(STATUSES)[curve.state_at(arclength)]
    return curve


def _states(body: Any, piece: Any, direction: FloatArray, points: FloatArray) -> IntArray:
    """Codes of points of a curve (n,)."""
    convex = moved_onto_lines(piece, direction, points, reach=0.0, steps=0).curvature > 0
    # asked a little off the body: along a straight generator F is 0 up to rounding
    hidden = occluded(body, points + 1e-9 * size(body) * unit_normals(piece, points), direction)
    return np.where(convex, np.where(hidden, PointState.OCCLUDED, PointState.ATTACHED), PointState.CONCAVE)


def _arcs(body: Any, piece: Any, direction: FloatArray, panels: PanelCurve) -> tuple[tuple[float, float, str], ...]:
    """Arclengths between which the state is the same, and its name; the last may come round."""
    # points of a curve whose states are asked for
    count = 193
    length = panels.length
    s = (np.arange(count) + 0.5) * length / count
    codes = _states(body, piece, direction, panels.at(s))
    if panels.closed:
        s, codes = np.append(s, s[0] + length), np.append(codes, codes[0])
    at = np.flatnonzero(codes[1:] != codes[:-1])
    low, high, before = s[at], s[at + 1], codes[at]
    while len(at) and np.max(high - low) > 1e-13 * length:
        middle = 0.5 * (low + high)
        same = _states(body, piece, direction, panels.at(middle)) == before
        if np.array_equal(np.where(same, middle, low), low) and np.array_equal(np.where(same, high, middle), high):
            break
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    ends = 0.5 * (low + high)
    if not len(ends):
        return ((0.0, length, STATUSES[codes[0]]),)
    after = codes[at + 1]
    if panels.closed:
        starts, stops = ends, np.append(ends[1:], ends[0] + length)
    else:
        starts, stops = np.append(0.0, ends), np.append(ends, length)
        after = np.append(codes[0], after)
    starts, stops = starts - length * (starts >= length), stops - length * (starts >= length)
    order = np.argsort(starts)
    return tuple((float(starts[k]), float(stops[k]), STATUSES[after[k]]) for k in order)


def launched_from(curves: tuple[ShadowCurve, ...], arcs: list[Arc], direction: FloatArray, n_rays: int) -> LaunchPoints:
    """``n_rays`` launch points, evenly spaced, `shared_out` over the arcs: n is 1.

    Half a spacing from the ends of an arc, where kappa_n, the illumination or the piece ends.
    """
    launch, first = LaunchPoints.blank(direction[None], n_rays), 0
    long = np.array([arc.end - arc.start for arc in arcs])
    for number, count in enumerate(shared_out(long, n_rays)):
        arc, rows = arcs[number], (0, slice(first, first + count))
        curve = curves[arc.curve]
        place = arc.start + long[number] * (np.arange(count) + (0.0 if arc.closed else 0.5)) / max(count, 1)
        place = np.mod(place, curve.length)
        launch.points[rows], launch.arclength[rows], launch.curve_index[rows] = curve.at(place), place, arc.curve
        launch.arc_index[rows], launch.spacing[rows] = number, long[number] / max(count, 1)
        launch.closed[rows], launch.state[rows] = arc.closed, curve.state_at(place)
        first += count
    return launch


class EdgePart(NamedTuple):
    """Part of an edge that the shadow line runs along.

    Attributes
    ----------
    crease : int
        Number of the crease.
    points : (n, 3), L
    length : float, L
    """

    crease: int
    points: FloatArray
    length: float


def parts_on_edges(body: Any, pieces: tuple[Any, ...], direction: FloatArray) -> tuple[EdgePart, ...]:
    """Parts of convex edges that are lit on one side only, of all edges in turn."""
    found: list[EdgePart] = []
    for number, crease in enumerate(body.creases):
        if crease.kind != "edge":
            continue
        x = np.asarray(crease.points, dtype=float)
        sides = [pieces[k] for k in crease.pieces]
        n = [unit_normals(side, x) for side in sides]
        runs = _runs(x, edge_tangents(x, *n), convex(body, x, *n), sides, direction)
        found += [
            EdgePart(number, np.concatenate([run[0][0][:1], *(p[0][1:] for p in run)]), float(sum(p[1] for p in run)))
            for run in runs
        ]
    return tuple(found)


def unit_normals(piece: Any, x: FloatArray) -> FloatArray:
    """Normals of a piece (n, 3)."""
    gradient = piece.gradient(x)
    return np.asarray(gradient / np.linalg.norm(gradient, axis=1, keepdims=True))


def edge_tangents(x: FloatArray, first: FloatArray, second: FloatArray) -> FloatArray:
    """Unit tangents e of an edge along its points (n, 3), from the normals on either side."""
    closed = len(x) > 3 and np.array_equal(x[0], x[-1])
    ahead, behind = np.roll(x, -1, axis=0), np.roll(x, 1, axis=0)
    if closed:
        ahead[-1], behind[0] = x[1], x[-2]
    else:
        ahead[-1], behind[0] = x[-1], x[0]
    chord = ahead - behind
    chord /= np.linalg.norm(chord, axis=1, keepdims=True)
    e = np.cross(first, second)
    sine = np.linalg.norm(e, axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        e = e / sine * np.sign(np.sum(e * chord, axis=1, keepdims=True))
    # where the normals nearly agree, or the polyline is too coarse to say which way, the chord must do
    return np.where((sine > 1e-6) & (np.sum(e * chord, axis=1, keepdims=True) > 0.5), e, chord)


def convex(body: Any, x: FloatArray, first: FloatArray, second: FloatArray) -> BoolArray:
    """Whether an edge is convex at its points (n,): F > 0 on both sides across the mean normal."""
    across = first - second
    # so near, F tells a convex edge from a concave one
    across = 1e-4 * size(body) * across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)
    return np.asarray((body.level(x + across) > 0) & (body.level(x - across) > 0))


def _runs(
    x: FloatArray, e: FloatArray, is_convex: BoolArray, sides: list[Any], direction: FloatArray
) -> list[list[tuple[FloatArray, float]]]:
    """Runs of the parts of one edge on the line, each the ends (2, 3) and the length of parts one after the other."""
    s = [unit_normals(side, x) @ direction + EDGE_ON for side in sides]
    long = np.linalg.norm(np.diff(x, axis=0), axis=1)
    # ascending even where two points are one
    t = np.append(0.0, np.cumsum(np.maximum(long, 1e-12 * long.sum())))
    curve, (points, weights) = CubicHermiteSpline(t, x, e), gauss_rule(5)
    runs: list[list[tuple[FloatArray, float]]] = []

    def off(at: float, side: Any) -> float:
        return float(unit_normals(side, curve([at]))[0] @ direction + EDGE_ON)

    for k in np.flatnonzero(is_convex[:-1] & is_convex[1:]):
        crossed = [side for side, v in zip(sides, s, strict=True) if (v[k] < 0) != (v[k + 1] < 0)]
        cuts = sorted(brentq(off, t[k], t[k + 1], args=(side,), xtol=1e-12 * (t[k + 1] - t[k])) for side in crossed)
        for low, high in pairwise([t[k], *cuts, t[k + 1]]):
            one, two = (off(0.5 * (low + high), side) < 0 for side in sides)
            if one == two or not high > low:
                continue
            slopes = np.linalg.norm(curve(low + (high - low) * points, 1), axis=1)
            part = curve([low, high]), float((high - low) * np.sum(weights * slopes))
            if runs and _meet(runs[-1][-1], part):
                runs[-1].append(part)
            else:
                runs.append([part])
    if len(runs) > 1 and _meet(runs[-1][-1], runs[0][0]):
        runs[0] = runs.pop() + runs[0]
    return runs


def _meet(before: tuple[FloatArray, float], after: tuple[FloatArray, float]) -> bool:
    return bool(np.linalg.norm(before[0][-1] - after[0][0]) <= 1e-9 * (before[1] + after[1]))
