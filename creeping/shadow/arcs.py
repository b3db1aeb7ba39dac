"""States of shadow lines: arcs between breaks, whether the wave reaches them, and the launch points on them.

Projected along the incident direction q a line is a plane curve: of a point source by the stereographic projection of
the sphere of directions, which takes curves that cross to curves that cross and that of a plane wave for its limit. It
has a cusp where kappa_n(q) = 0, since T is along q there, and visibility changes only at cusps and, where two of its
parts cross, on the one behind (the larger x.d, or R).

    plane wave      u = e.x,               v = f.x,               depth x.d
    point source    u = e.y/(1 + a.y),     v = f.y/(1 + a.y),     depth R,     y = q/|q|,  dy = w (T - (T.y) y)/|q|

with e, f across d, or across the axis a of the picture.

The state is constant between these breaks, so one point decides an arc: kappa_n(q) <= 0 is concave; the outermost
points of the picture are lit; of the rest the backward ray says whether the body stands before it. Two more rays of the
arc must agree, or the line counts as uncertain. A line is the same to the last bit whatever is computed beside it.

Sources: [K84]; Derivations, R10.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize.elementwise import find_root

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.geometry.incident import headings
from creeping.geometry.surface import Surface, size
from creeping.shadow.attachment import SAMPLES, LaunchPoints, occluded
from creeping.shadow.curves import NEAR, Curves, moved_onto_lines
from creeping.shadow.status import STATUSES, PointState


class Breaks(NamedTuple):
    """Breaks of lines.

    Attributes
    ----------
    curve, place : (k,)
        Of each break, in order.
    extreme : (n, 4)
        Outermost nodes of the picture of each line, which nothing hides; -1 where a point source stands among the
        body, so that no picture has all of it inside.
    certain : (n,)
        Whether no pair of breaks can lie hidden between neighbouring nodes, and no curves lie upon each other.
    """

    curve: IntArray
    place: FloatArray
    extreme: IntArray
    certain: BoolArray


def breaks_of(curves: Curves, box: FloatArray) -> Breaks:
    """Breaks of lines; ``box`` (2, 3), L, holds the body."""
    where, at, hidden = _cusps(curves)
    picture, extreme = _picture(curves, box)
    more, there, upon = _crossings(curves, picture)
    curve, place = np.concatenate([where, more]), np.concatenate([at, there])
    # a place may have come round
    place = np.where(place >= curves.number[curve], place - curves.number[curve], place)
    order = np.lexsort((place, curve))
    return Breaks(curve[order], place[order], extreme, ~(hidden | upon))


def _cusps(curves: Curves) -> tuple[IntArray, FloatArray, BoolArray]:
    """Zeros of kappa_n(q): curves (k,), places (k,), and lines (n,) with some that may be hidden.

    Hidden are pairs of zeros between neighbours: an extremum nearer to 0 than half its second difference, or two
    changes in neighbouring cells.
    """
    a, after = curves.curvature, curves.after
    b = a[after]
    before = np.empty_like(a)
    before[after] = a
    changes = (a > 0) != (b > 0)
    turns = ((before - a) * (b - a) > 0) & ((before > 0) == (a > 0)) & (np.abs(a) < 0.5 * np.abs(before - 2 * a + b))
    unsure = np.where(changes, changes[after], turns)
    hidden = np.zeros(len(curves.waves), dtype=bool)
    hidden[curves.line[curves.own[unsure]]] = True
    node = np.flatnonzero(changes)
    where = curves.own[node]
    cell = node - curves.first[where]

    def value(u: FloatArray, curve: IntArray, at: IntArray) -> FloatArray:
        return curves.values_at(a[:, None], curve, at + u)[:, 0]

    ends = np.zeros(len(node)), np.ones(len(node))
    found = find_root(value, ends, args=(where, cell), tolerances={"xatol": 1e-13}).x if len(node) else ends[0]
    return where, cell + found, hidden


class Picture(NamedTuple):
    """Lines seen along q: (u, v) (m, 2), their change along the line (m, 2), and the depth (m,) of the nodes."""

    seen: FloatArray
    slope: FloatArray
    depth: FloatArray


def _picture(curves: Curves, box: FloatArray) -> tuple[Picture, IntArray]:
    """Picture of lines, and the outermost nodes (n, 4) of each."""
    n, m = len(curves.waves), len(curves.points)
    firsts = [*curves.first[np.searchsorted(curves.line, np.arange(n))].tolist(), m]
    axes, apart = curves.waves[:, :3].copy(), np.ones(n, dtype=bool)
    for of in np.flatnonzero(curves.waves[:, 3]):
        axes[of], apart[of] = _axis_of(curves.points[firsts[of] : firsts[of + 1]], curves.waves[of], box)
    e = np.eye(3)[np.argmin(np.abs(axes), axis=1)]
    e -= np.sum(e * axes, axis=1, keepdims=True) * axes
    e /= np.linalg.norm(e, axis=1, keepdims=True)
    frames = np.stack([e, np.cross(axes, e)], axis=2)
    seen, slope, depth = np.empty((m, 2)), np.empty((m, 2)), np.empty(m)
    extreme = np.empty((n, 4), np.int64)
    # line by line: a product of matrices depends on the number of rows
    for row in range(n):
        own, axis, across, w = slice(firsts[row], firsts[row + 1]), axes[row], frames[row], curves.waves[row, 3]
        x, T = curves.points[own], curves.tangents[own]
        if w:
            q = curves.waves[row, :3] + w * x
            norm = np.linalg.norm(q, axis=1, keepdims=True)
            y = q / norm
            dy = w * (T - np.sum(T * y, axis=1, keepdims=True) * y) / norm
            share = 1 / (1 + y @ axis)[:, None]
            seen[own], depth[own] = share * (y @ across), norm[:, 0] / w
            slope[own] = share * (dy @ across - seen[own] * (dy @ axis)[:, None])
        else:
            seen[own], slope[own], depth[own] = x @ across, T @ across, x @ axis
        extreme[row, :2], extreme[row, 2:] = seen[own].argmin(axis=0), seen[own].argmax(axis=0)
    extreme += np.array(firsts[:-1])[:, None]
    extreme[~apart] = -1
    return Picture(seen, slope, depth), extreme


def _axis_of(x: FloatArray, wave: FloatArray, box: FloatArray) -> tuple[FloatArray, bool]:
    """Axis (3,) of the picture of a point source, and whether all of the body is on its side.

    It points to the middle of the body if all of its box is ahead; else, of that and the six along the coordinates, it
    is the one whose opposite, the point at infinity of the picture, is furthest from the line.
    """
    middle = wave[:3] + wave[3] * box.mean(axis=0)
    square = float(middle @ middle)
    tried = np.concatenate([middle[None] / np.sqrt(square + 1e-290), np.eye(3), -np.eye(3)])
    corners = np.array([[box[i, 0], box[j, 1], box[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    if square > 0 and np.all((wave[:3] + wave[3] * corners) @ tried[0] > 0):
        return tried[0], True
    q = wave[:3] + wave[3] * x
    nearest = np.min(1 + (q / np.linalg.norm(q, axis=1, keepdims=True)) @ tried.T, axis=0)
    # towards a middle next to the source there is no direction
    nearest[0] = nearest[0] if square > 0.5e-6 else -1.0
    return tried[np.argmax(nearest)], False


def _crossings(curves: Curves, picture: Picture) -> tuple[IntArray, FloatArray, BoolArray]:
    """Crossings of the pictures of lines: curves (k,), places (k,) of the parts behind, lines (n,) with too many."""
    from creeping.shadow.kernels.crossings import crossings

    # with more crossings two curves coincide in the picture, and crossings mean nothing
    most = 64
    pairs, count = np.empty((len(curves.waves), most, 2), np.int64), np.empty(len(curves.waves), np.int64)
    crossings(picture.seen, curves.first, curves.number, curves.line, pairs, count)
    i, m = pairs[(np.arange(most) < count[:, None]) & (count[:, None] <= most)].T
    upon = count > most
    if not len(i):
        return i, np.zeros(0), upon
    own, other = curves.own[i], curves.own[m]
    one, two = _solved(curves, picture, i, m)
    behind = picture.depth[i] > picture.depth[m]
    where = np.where(behind, own, other)
    return where, np.where(behind, one, two) % curves.number[where], upon


def _turn(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _solved(curves: Curves, picture: Picture, i: IntArray, m: IntArray) -> tuple[FloatArray, FloatArray]:
    """Places (k,), (k,) at which parts cross near the chords after nodes i and m; of the chords where that fails.

    Newton's method on the cubics between nodes, which do not leave their cell by much, and then on the polynomials.
    """
    curve = np.stack([curves.own[i], curves.own[m]])
    h, base = curves.spacing[curve][..., None], np.stack([i, m]) - curves.first[curve]
    rows = np.concatenate([picture.seen, picture.slope], axis=1)

    def newton(places: FloatArray, values: FloatArray, slopes: FloatArray) -> FloatArray:
        gap, determinant = values[1] - values[0], _turn(slopes[0], slopes[1])
        step = np.stack([_turn(gap, slopes[1]), _turn(gap, slopes[0])]) / np.where(
            determinant == 0, np.inf, determinant
        )
        return np.asarray(places + np.clip(step, -1, 1))

    def cubics(places: FloatArray) -> tuple[FloatArray, FloatArray]:
        cell = np.floor(places).astype(np.int64)
        p, q = rows[curves.nodes_at(curve, cell)], rows[curves.nodes_at(curve, cell + 1)]
        u = (places - cell)[..., None]
        v, s, t = 1 - u, h * p[..., 2:], h * q[..., 2:]
        p, q = p[..., :2], q[..., :2]
        value = v * v * (1 + 2 * u) * p + u * u * (3 - 2 * u) * q + u * v * (v * s - u * t)
        return value, 6 * u * v * (q - p) + v * (v - 2 * u) * s + u * (u - 2 * v) * t

    def polynomials(places: FloatArray) -> tuple[FloatArray, FloatArray]:
        found = curves.values_at(rows, curve.ravel(), places.ravel()).reshape(*places.shape, 4)
        return found[..., :2], h * found[..., 2:]

    at = rows[np.stack([i, m]), :2]
    chords = picture.seen[curves.after[np.stack([i, m])]] - at
    start = places = newton(base.astype(float), at, chords)
    for _ in range(8):
        places = newton(places, *cubics(places))
    # the crossing of the cubics may lie in a cell next to that of the chords
    near = np.all(np.abs(places - start) < 2, axis=0)
    best = np.where(near, places, start)
    for _ in range(3):
        best = newton(best, *polynomials(best))
    one, two = np.where(near, best, start)
    return one, two


class Arcs(NamedTuple):
    """Arcs of lines, in the order of their curves.

    Attributes
    ----------
    curve, state : (a,)
    ends : (a, 2)
        In nodes of the curve, the second beyond their number where an arc passes the curve's first node.
    """

    curve: IntArray
    state: IntArray
    ends: FloatArray


@dataclass(frozen=True, eq=False)
class Finished:
    """Arcs and launch points of lines.

    Attributes
    ----------
    arcs : Arcs
    shares : (n, 3)
        Of the length, by state.
    launch : LaunchPoints
    certain : (n,)
        Whether no break can be hidden and all probes of an arc agree.
    """

    arcs: Arcs
    shares: FloatArray
    launch: LaunchPoints
    certain: BoolArray


def finished(body: Surface, curves: Curves, n_rays: int, *, every: bool = False) -> Finished:
    """Arcs of lines, and ``n_rays`` launch points of each line: on attached arcs, or with ``every`` on all."""
    breaks = breaks_of(curves, np.asarray(body.bounds, dtype=float))
    curve, ends = _between(curves, breaks.curve, breaks.place)
    state, agree = _states(body, curves, curve, ends, breaks.extreme)
    certain = breaks.certain.copy()
    certain[curves.line[curve[~agree]]] = False
    arcs = _merged(curves, Arcs(curve, state, ends))
    lengths = np.diff(arcs.ends, axis=1)[:, 0] * curves.spacing[arcs.curve]
    line, n = curves.line[arcs.curve], len(curves.waves)
    whole = np.bincount(line, lengths, minlength=n)
    by_state = np.bincount(line * len(STATUSES) + arcs.state, lengths, minlength=n * len(STATUSES))
    shares = by_state.reshape(n, -1) / whole[:, None]
    return Finished(arcs, shares, _launched(body, curves, arcs, n_rays, every), certain)


def _between(curves: Curves, where: IntArray, at: FloatArray) -> tuple[IntArray, FloatArray]:
    """Curves (a,) and ends (a, 2) of the arcs between breaks, which are in order."""
    count = np.bincount(where, minlength=len(curves.number))
    first = np.cumsum(count) - count
    following = np.arange(len(where)) + 1
    last = following == (first + count)[where]
    end = np.where(last, at[first[where]] + curves.number[where], at[np.where(last, 0, following)])
    whole = np.flatnonzero(count == 0)
    curve = np.concatenate([where, whole])
    ends = np.concatenate([np.stack([at, end], axis=1), np.stack([0.0 * whole, curves.number[whole]], axis=1)])
    order = np.argsort(curve, kind="stable")
    return curve[order], ends[order]


def _states(
    body: Surface, curves: Curves, curve: IntArray, ends: FloatArray, extreme: IntArray
) -> tuple[IntArray, BoolArray]:
    """States (a,) of arcs, and whether all their probes agree."""
    # parts of an arc at which its state is asked for; the first one decides
    tried = (0.5, 0.2, 0.8)
    long = ends[:, 1] - ends[:, 0]
    places = ends[:, :1] + np.array(tried) * long[:, None]
    probed, waves = np.repeat(curve, len(tried)), curves.waves[curves.line[curve]]
    x = curves.values_at(curves.points, probed, places.ravel())
    there = moved_onto_lines(body, np.repeat(waves, len(tried), axis=0), x, reach=NEAR * size(body), steps=1)
    concave = ~(there.curvature[:: len(tried)] > 0)
    # next to a break, within two nodes, an outermost node does not say that its arc is lit: of two curves that nearly
    # touch in the picture the hidden one may have it (directions within 0.4 degrees of the axis of two congruent lobes)
    outermost = extreme[curves.line[curve]]
    own = (outermost >= 0) & (curves.own[outermost] == curve[:, None])
    away = (outermost - curves.first[curve][:, None] - ends[:, :1]) % curves.number[curve][:, None]
    inside = own & (away > 2) & (away < long[:, None] - 2)
    asked = np.flatnonzero(~concave & ~np.any(inside, axis=1))
    state, agree = np.where(concave, PointState.CONCAVE, PointState.ATTACHED), np.ones(len(curve), dtype=bool)
    if len(asked):
        probes = there.points.reshape(-1, len(tried), 3)[asked]
        q = waves[asked, None, :3] + waves[asked, None, 3:] * probes
        w = waves[asked, None, 3]
        # of a point source the last sample stands at it
        before = np.where(w > 0, np.linalg.norm(q, axis=-1) / np.where(w > 0, w, 1) * SAMPLES / (SAMPLES + 1), np.inf)
        toward = np.broadcast_to(headings(waves[asked, None], probes), probes.shape)
        hidden = occluded(body, probes.reshape(-1, 3), toward.reshape(-1, 3), before.ravel()).reshape(-1, len(tried))
        state[asked] = np.where(hidden[:, 0], PointState.OCCLUDED, PointState.ATTACHED)
        agree[asked] = np.all(hidden == hidden[:, :1], axis=1)
    return state, agree


def _merged(curves: Curves, arcs: Arcs) -> Arcs:
    """Join neighbouring arcs of one state: a break need not change it."""
    curve, state, ends = arcs
    starts = np.append(True, (curve[1:] != curve[:-1]) | (state[1:] != state[:-1]))
    first = np.flatnonzero(starts)
    last = np.append(first[1:], len(curve)) - 1
    curve, state, ends = curve[first], state[first], np.stack([ends[first, 0], ends[last, 1]], axis=1)
    # the last arc of a curve comes round to the first
    opening = np.flatnonzero(np.append(True, curve[1:] != curve[:-1]))
    closing = np.append(opening[1:], len(curve)) - 1
    round_ = (closing > opening) & (state[closing] == state[opening])
    opening, closing = opening[round_], closing[round_]
    ends[opening, 0] = ends[closing, 0] - curves.number[curve[closing]]
    kept = np.ones(len(curve), dtype=bool)
    kept[closing] = False
    curve, state, ends = curve[kept], state[kept], ends[kept]
    # to the last bit: what is a whole curve is closed
    whole = np.bincount(curve)[curve] == 1
    ends[whole] = np.stack([0.0 * curve, curves.number[curve]], axis=1)[whole]
    return Arcs(curve, state, ends)


def _launched(body: Surface, curves: Curves, arcs: Arcs, n_rays: int, every: bool) -> LaunchPoints:
    """Launch points, evenly spaced on each arc that launches."""
    n, on = len(curves.waves), arcs
    if every:
        all_, ends = np.arange(len(curves.number)), np.outer(curves.number, (0.0, 1.0))
        on = Arcs(all_, np.full(len(all_), PointState.ATTACHED), ends)
    launch = LaunchPoints.blank(curves.waves, n_rays)
    line, long = curves.line[on.curve], on.ends[:, 1] - on.ends[:, 0]
    counts = np.zeros(len(line), np.int64)
    for row in range(n if n_rays else 0):
        # arcs of one line stand together
        own = np.arange(*np.searchsorted(line, (row, row + 1)))
        own = own[on.state[own] == PointState.ATTACHED]
        counts[own] = shared_out(long[own] * curves.spacing[on.curve[own]], n_rays)
    arc = np.repeat(np.arange(len(line)), counts)
    if not len(arc):
        return launch
    given, curve = counts[arc], on.curve[arc]
    number, spacing = curves.number[curve], curves.spacing[curve]
    in_arc = np.arange(len(arc)) - (np.cumsum(counts) - counts)[arc]
    # half a spacing from the ends of an arc, where kappa_n or the illumination stops
    closed = long[arc] == number
    place = (on.ends[arc, 0] + long[arc] * (in_arc + np.where(closed, 0.0, 0.5)) / given) % number
    x = curves.values_at(curves.points, curve, place)
    x = moved_onto_lines(body, curves.waves[line[arc]], x, reach=NEAR * size(body), steps=1).points
    firsts = np.searchsorted(line, np.arange(n))
    before = np.append(0, np.cumsum(counts))
    of = line[arc]
    at = of * n_rays + np.arange(len(arc)) - before[firsts[of]]
    launch.points.reshape(-1, 3)[at], launch.arclength.reshape(-1)[at] = x, place * spacing
    launch.curve_index.reshape(-1)[at] = curve - np.searchsorted(curves.line, of)
    launch.arc_index.reshape(-1)[at] = arc - firsts[of]
    launch.spacing.reshape(-1)[at], launch.closed.reshape(-1)[at] = long[arc] * spacing / given, closed
    launch.state.reshape(-1)[at] = _state_at(curves, arcs, curve, place) if every else PointState.ATTACHED
    return launch


def shared_out(lengths: FloatArray, wanted: int) -> IntArray:
    """Rays of arcs in proportion to their lengths, ``wanted`` in all; at least one each if that suffices.

    Examples
    --------
    >>> shared_out(np.array([3.0, 1.0, 0.01]), 8)
    array([5, 2, 1])
    """
    if len(lengths) < 2:
        return np.full(len(lengths), wanted)
    exact = lengths / lengths.sum() * wanted
    counts = np.maximum(exact.astype(np.int64), 1)
    while (lack := wanted - int(counts.sum())) != 0:
        if lack < 0 and counts.max() == 1:
            # more arcs than rays
            return np.asarray((np.arange(len(lengths)) < wanted).astype(np.int64))
        gain = np.where((counts > 1) | (lack > 0), np.sign(lack) * (exact - counts), -np.inf)
        counts[np.argmax(gain)] += np.sign(lack)
    return np.asarray(counts)


def _state_at(curves: Curves, arcs: Arcs, curve: IntArray, place: FloatArray) -> Any:
    """State of places (k,) of curves; rounding may leave one between two arcs: concave, which launches nothing."""
    state = np.full(len(place), PointState.CONCAVE)
    begin, end = (np.searchsorted(arcs.curve, curve, side) for side in ("left", "right"))
    for step in range(int(np.max(end - begin))):
        arc = np.minimum(begin + step, end - 1)
        low, high = arcs.ends[arc].T
        state = np.where((place - low) % curves.number[curve] < high - low, arcs.state[arc], state)
    return state
