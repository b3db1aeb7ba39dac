"""States of shadow lines: arcs between breaks, whether the wave reaches them, and the launch points on them.

The state is constant between breaks, so one point decides an arc: kappa_n(q) <= 0 is concave; the outermost points of
the line projected along q are lit; of the rest the backward ray says whether the body stands before it. Two more rays
of the arc must agree, or the line counts as uncertain. A line is the same to the last bit whatever is computed beside
it.

Sources: Derivations, R10.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.geometry.incident import headings
from creeping.geometry.surface import Surface, size
from creeping.shadow.attachment import SAMPLES, LaunchPoints, occluded
from creeping.shadow.breaks import breaks_of
from creeping.shadow.curves import Curves, moved_onto_lines
from creeping.shadow.status import ATTACHED, CONCAVE, OCCLUDED, STATUSES

PROBES = (0.5, 0.2, 0.8)
"""Parts of an arc at which its state is asked for; the first one decides."""
BESIDE = 2
"""Nodes from a break within which an outermost node does not say that its arc is lit: of two curves that nearly touch
in the picture the hidden one may have it (directions within 0.4 degrees of the axis of two congruent lobes)."""
NEAR = 1e-2
"""Longest step, in body sizes, that brings an interpolated point onto the line; kept nodes are much closer."""


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
    """Arcs of lines, and so many launch points of each: on attached arcs, or with ``every`` on the whole of it."""
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
    long = ends[:, 1] - ends[:, 0]
    places = ends[:, :1] + np.array(PROBES) * long[:, None]
    probed, waves = np.repeat(curve, len(PROBES)), curves.waves[curves.line[curve]]
    x = curves.values_at(curves.points, probed, places.ravel())
    there = moved_onto_lines(body, np.repeat(waves, len(PROBES), axis=0), x, reach=NEAR * size(body), steps=1)
    concave = ~(there.curvature[:: len(PROBES)] > 0)
    # next to a break an outermost node may lie on either side of it
    outermost = extreme[curves.line[curve]]
    own = (outermost >= 0) & (curves.own[outermost] == curve[:, None])
    away = (outermost - curves.first[curve][:, None] - ends[:, :1]) % curves.number[curve][:, None]
    inside = own & (away > BESIDE) & (away < long[:, None] - BESIDE)
    asked = np.flatnonzero(~concave & ~np.any(inside, axis=1))
    state, agree = np.where(concave, CONCAVE, ATTACHED), np.ones(len(curve), dtype=bool)
    if len(asked):
        probes = there.points.reshape(-1, len(PROBES), 3)[asked]
        q = waves[asked, None, :3] + waves[asked, None, 3:] * probes
        w = waves[asked, None, 3]
        # of a point source the last sample stands at it
        before = np.where(w > 0, np.linalg.norm(q, axis=-1) / np.where(w > 0, w, 1) * SAMPLES / (SAMPLES + 1), np.inf)
        toward = np.broadcast_to(headings(waves[asked, None], probes), probes.shape)
        hidden = occluded(body, probes.reshape(-1, 3), toward.reshape(-1, 3), before.ravel()).reshape(-1, len(PROBES))
        state[asked] = np.where(hidden[:, 0], OCCLUDED, ATTACHED)
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
        all_ = np.arange(len(curves.number))
        on = Arcs(all_, np.full(len(all_), ATTACHED), np.stack([0.0 * all_, curves.number.astype(float)], axis=1))
    launch = LaunchPoints.blank(curves.waves, n_rays)
    line, long = curves.line[on.curve], on.ends[:, 1] - on.ends[:, 0]
    counts = np.zeros(len(line), np.int64)
    for row in range(n if n_rays else 0):
        # arcs of one line stand together
        own = np.arange(*np.searchsorted(line, (row, row + 1)))
        own = own[on.state[own] == ATTACHED]
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
    launch.state.reshape(-1)[at] = _state_at(curves, arcs, curve, place) if every else ATTACHED
    return launch


def shared_out(lengths: FloatArray, wanted: int) -> IntArray:
    """Rays of arcs in proportion to their lengths, one each at least, as long as there are so many.

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
    state = np.full(len(place), CONCAVE)
    begin, end = (np.searchsorted(arcs.curve, curve, side) for side in ("left", "right"))
    for step in range(int(np.max(end - begin))):
        arc = np.minimum(begin + step, end - 1)
        low, high = arcs.ends[arc].T
        state = np.where((place - low) % curves.number[curve] < high - low, arcs.state[arc], state)
    return state
