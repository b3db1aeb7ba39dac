"""Geodesics of a body with creases, piece by piece: on each of them by the order-8 pair, up to where it ends.

A ray is traced on the smooth F_i of its piece, which goes on a little beyond its creases. Between its states it is the
cubic of both ends; where `piece` changes along it, it has crossed a crease. At a joint the ray starts anew on the next
piece: J and J' are continuous there, J'' is not. At an edge it ends, and within REACH of a tip; a ray that has ended
stays where it is, and so does one that cannot go on, far from any edge or tip: it ends without a crease.

All rays on one piece are traced through a window of stops in one call, but no farther than the piece is wide: steps
are many beyond its borders. Where one of them has left its piece, the time is found again between exact states close
around it, so that it is exact to rounding; from there it goes by itself to the next stop, and so do rays next to a tip,
in steps that do not reach through it.

What a ray does is bounded: after 64 crossings it stays on its piece up to the end of the window, and after 400 rounds,
or where no step however short is left to it, it ends as data, at the nearest edge or tip, without a crease if none is
near; without one it ends, too, where a window begins on ground that the body does not trust.

Sources: Derivations, R1 and R3.
"""

from contextlib import suppress
from typing import NamedTuple

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.errors import IntegrationError
from creeping.geodesics.attenuation import trace_own, with_attenuation
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.states import BARE, DETACHMENT, WHOLE, P, X, project_bundle
from creeping.geometry.piecewise import (
    SMOOTH,
    is_piecewise,
    nearest_crease,
    piece_ahead,
    pieces_across,
    pieces_of,
    tips_of,
)
from creeping.geometry.surface import size

REACH = 1e-3
"""Distance from a tip, in body sizes, at which a ray ends: no expansion serves nearer, where curvatures go like 1/r."""


class Passages(NamedTuple):
    """Where rays went on across joints: ray number, travel time and number of the crease, each (n,)."""

    ray: IntArray
    travel_time: FloatArray
    crease: IntArray


class PieceTrace(NamedTuple):
    """Rays of a body with creases: states (n, m, lanes) at the times, and joints passed.

    ``end`` (n,) is the travel time at which each ended, inf if it did not, and ``crease`` (n,) at which, -1 if none.
    """

    states: FloatArray
    end: FloatArray
    crease: IntArray
    passages: Passages


def passages(body: Any, states: FloatArray, length: float, *, rtol: float) -> Passages:
    """Where rays from states (n, 6) go on across joints, up to a length; nowhere on a smooth body."""
    if not (is_piecewise(body) and len(states)):
        return Passages(np.zeros(0, np.int64), np.zeros(0), np.zeros(0, np.int64))
    return trace_pieces(body, states, np.array([length]), rtol=rtol).passages


def with_ends(body: Any, states: FloatArray, times: FloatArray, *, rtol: float, step: float | None) -> FloatArray:
    """Advance states of any number of components to the ascending times (m,): (n, m, the same)."""
    found = trace_pieces(body, states[:, :WHOLE], times, rtol=rtol, step=step)
    if states.shape[1] <= WHOLE:
        return found.states
    late = found.end[:, None] > times
    ends = np.stack([np.where(late, np.inf, found.end[:, None]), np.where(late, -1, found.crease[:, None])], axis=-1)
    return np.concatenate([found.states, ends], axis=-1)


def trace_pieces(
    body: Any,
    states: FloatArray,
    times: FloatArray,
    *,
    rtol: float,
    step: float | None = None,
    beyond: float = 0.0,
) -> PieceTrace:
    """Trace states (n, 6, 10 or 12) to the ascending times (m,).

    Parameters
    ----------
    body : PiecewiseSurface
    states, times
        As for `creeping.geodesics.integrator.trace_states`, which traces them on each piece.
    rtol, step
        As for `DirectFlow`.
    beyond : float, L
        How far a ray that has ended goes on, on its last piece as if it had no end, while that can be.
    """
    walk = Walk(body, states, rtol, step)
    times = np.asarray(times, dtype=float)
    out = np.empty((len(states), len(times), states.shape[1]))
    for stops, wanted in windows(times, walk.size):
        found = walk.window(stops, beyond)
        for place, column in wanted:
            out[:, column] = found[:, place]
    none = np.zeros(0, np.int64), np.zeros(0), np.zeros(0, np.int64)
    rays, moments, creases = (np.concatenate(part) for part in zip(none, *walk.passed, strict=True))
    order = np.lexsort((moments, rays))
    passages = Passages(rays[order], moments[order], creases[order])
    return PieceTrace(out, walk.end, walk.crease, passages)


def trace_to(body: Any, states: FloatArray, lengths: FloatArray, *, rtol: float) -> tuple[FloatArray, FloatArray]:
    """Trace states (n, 6 or 10) to a length (n,) each: (n, the same), and the lengths (n,) at which rays ended, or inf.

    They begin one after the other and arrive together, so that windows and stops serve them all.
    """
    latest = np.array([np.max(lengths, initial=0.0)])
    walk = Walk(body, states, rtol, None, latest - lengths)
    for stops, _ in windows(latest, walk.size):
        walk.window(stops, 0.0)
    return walk.states, walk.end - walk.begin


class Exits(NamedTuple):
    """Where rays (n,) leave a piece: whether each does, and the bracket of the time, no time of one that does not.

    ``interval`` says between which states it is, ``tip`` is the crease of the tip that it comes to, or -1.
    """

    gone: BoolArray
    low: FloatArray
    high: FloatArray
    interval: IntArray
    tip: IntArray


class Walk:
    """Rays (n, lanes) on their pieces: their states, ends and the joints they have passed. They begin at 0 or (n,)."""

    def __init__(
        self, body: Any, states: FloatArray, rtol: float, step: float | None, begin: FloatArray | None = None
    ) -> None:
        self.body, self.pieces, self.size = body, pieces_of(body), size(body)
        self.rtol, self.step = rtol, step
        self.across, (self.tip_numbers, self.tips) = pieces_across(body), tips_of(body)
        self.states = np.array(states, dtype=float)
        self.lanes, n = states.shape[1], len(states)
        self.on = piece_ahead(body, states[:, X], states[:, P])
        # what begins nowhere has ended
        self.stuck = ~np.all(np.isfinite(self.states[:, :BARE]), axis=1)
        self.end = np.where(self.stuck, 0.0, np.inf)
        self.crease = np.full(n, -1, dtype=np.int64)
        self.begin = np.zeros(n) if begin is None else begin
        self.passed: list[tuple[IntArray, FloatArray, IntArray]] = []
        # within a window: time, last stop, longest step and crossings of each ray
        self.now, self.place = np.zeros(n), np.zeros(n, dtype=np.int64)
        self.longest, self.crossed = np.zeros(n), np.zeros(n, dtype=np.int64)

    def window(self, stops: FloatArray, beyond: float) -> FloatArray:
        """Advance all rays from the first of the stops (k,) to the last: (n, k, lanes)."""
        out = np.repeat(self.states[:, None], len(stops), axis=1)
        if len(stops) == 1:
            return out
        self.now[:], self.longest[:], self.crossed[:] = np.maximum(self.begin, stops[0]), np.inf, 0
        self.place[:] = np.searchsorted(stops, self.now, side="right") - 1
        self._untrusted(stops)
        loose = np.flatnonzero((self.end <= stops[0]) & (self.end + beyond > stops[0]) & ~self.stuck)
        # next to a tip a ray goes half of REACH in each, and a step is halved 20 times
        for _ in range(400):
            rows = np.flatnonzero(np.isinf(self.end) & (self.place < len(stops) - 1))
            if not len(rows):
                break
            self._round(rows, stops, out)
        else:
            self._stop(rows, stops, out)
        if beyond > 0 and len(loose):
            self._beyond(loose, stops, out)
        self.states = out[:, -1].copy()
        return out

    def _untrusted(self, stops: FloatArray) -> None:
        """End rays, without a crease, that begin a window where the body is not trusted: of them nothing is known."""
        if not hasattr(self.body, "non_smooth"):
            return
        rows = np.flatnonzero(np.isinf(self.end) & (self.begin < stops[-1]))
        lost = rows[np.asarray(self.body.non_smooth(self.states[rows, X]), dtype=bool)]
        self.end[lost] = self.now[lost]

    def _round(self, rows: IntArray, stops: FloatArray, out: FloatArray) -> None:
        """Take each ray on by one step of its own, or all the way to the last stop with the others."""
        alone = (self.now[rows] > stops[self.place[rows]]) | np.isfinite(self.longest[rows])
        # may rays come so near to a tip that they go on in short steps? as far as their tangents tell
        short = 0.02 * self.size
        away, p = self.tips - self.states[rows, None, X], self.states[rows, P]
        along = np.clip(np.einsum("ntk,nk->nt", away, p), 0.0, stops[-1] - self.now[rows, None])
        near = np.any(np.linalg.norm(away - along[..., None] * p[:, None], axis=2) < short, axis=1)
        # between stops as far apart as all others, rays that are at different ones go together
        gaps = np.diff(stops)
        even = np.ptp(gaps) <= 1e-12 * self.size
        free = (to_tips(self.tips, self.states[rows, X]) - short) / gaps[0]
        # rays on their way to a tip go as many stops as they are from it, to a power of two so that groups are few
        before = 2 ** np.floor(np.log2(np.clip(free, 1.0, len(stops)))) * (free >= 1) * even
        many = np.where(alone, 0, np.where(near, before, len(stops)))
        groups = np.stack([self.on[rows], many, np.where(even | (many == 0), 0, self.place[rows])], axis=1)
        for group in np.unique(groups.astype(np.int64), axis=0):
            mine, (number, count, _) = rows[np.all(groups == group, axis=1)], group.tolist()
            if count == 0:
                self._alone(number, mine, stops, out)
            else:
                self._together(number, mine, stops, out, count)

    def _together(self, number: int, mine: IntArray, stops: FloatArray, out: FloatArray, many: int) -> None:
        """Go on with rays on one piece through as many stops, as far as the window has them and it is wide."""
        begin = self.place[mine]
        own = stops[begin.min() :] - stops[begin.min()]
        own = own[: max(2, min(many + 1, int(np.searchsorted(own, self.across[number], side="right"))))]
        found = self._later(self._safely(number, self.states[mine], own[1:]), mine, stops[begin])
        path = np.concatenate([self.states[mine, None], found], axis=1)
        exits = self._exits(number, mine, path, np.broadcast_to(own, (len(mine), len(own))))
        known = np.cumprod(np.all(np.isfinite(path[..., :BARE]), axis=2), axis=1).sum(axis=1) - 1
        most = np.minimum(len(own) - 1, len(stops) - 1 - begin)
        off = exits.gone & (exits.interval < most)
        last = np.minimum(np.where(off, np.minimum(exits.interval, known), known), most)
        reached = np.arange(1, len(own)) <= last[:, None]
        ray, stop = np.nonzero(reached)
        out[mine[ray], begin[ray] + 1 + stop] = found[ray, stop]
        n = np.arange(len(mine))
        self.states[mine], self.place[mine], self.now[mine] = path[n, last], begin + last, stops[begin + last]
        lost = (last < most) & ~off
        self.longest[mine[lost]] = self.size
        gone = np.flatnonzero(off)
        if len(gone):
            k = exits.interval[gone]
            far, since = path[gone, np.minimum(k + 1, path.shape[1] - 1)], own[k]
            bracket = exits.low[gone] - since, exits.high[gone] - since, exits.tip[gone]
            self._cross(number, mine[gone], far, own[k + 1] - since, bracket, stops, out)

    def _alone(self, number: int, mine: IntArray, stops: FloatArray, out: FloatArray) -> None:
        """Go on with each ray to its next stop, if a step that does not reach through a tip does.

        There, and far beyond an edge, a piece need not have any geodesics.
        """
        following, tip = stops[self.place[mine] + 1], to_tips(self.tips, self.states[mine, X])
        short = np.minimum(np.maximum(0.5 * tip, 0.5 * REACH * self.size), self.longest[mine])
        step = np.minimum(short, following - self.now[mine])
        found = self._later(self._own(number, self.states[mine], step), mine, self.now[mine])
        bad = ~np.all(np.isfinite(found[:, :BARE]), axis=1)
        self.longest[mine[bad]] = 0.5 * step[bad]
        none = bad & (0.5 * step < 1e-7 * self.size)
        if none.any():
            self._stop(mine[none], stops, out)
        good = np.flatnonzero(~bad)
        if not len(good):
            return
        mine, found, step = mine[good], found[good], step[good]
        path = np.stack([self.states[mine], found], axis=1)
        exits = self._exits(number, mine, path, np.stack([np.zeros(len(mine)), step], axis=1))
        on = np.flatnonzero(~exits.gone)
        rays, gone = mine[on], np.flatnonzero(exits.gone)
        self.states[rays] = found[on]
        self.now[rays] += step[on]
        arrived = self.now[rays] >= stops[self.place[rays] + 1] - 1e-14 * self.size
        at = rays[arrived]
        self.place[at] += 1
        self.now[at] = stops[self.place[at]]
        out[at, self.place[at]] = self.states[at]
        if len(gone):
            bracket = exits.low[gone], exits.high[gone], exits.tip[gone]
            self._cross(number, mine[gone], found[gone], step[gone], bracket, stops, out)

    def _exits(self, number: int, mine: IntArray, states: FloatArray, own: FloatArray) -> Exits:
        """Where rays with states (n, k, lanes) at own times (n, k) leave a piece, asked every 0.005 body sizes."""
        n, long = len(own), np.diff(own, axis=1)
        parts = int(np.ceil(np.max(long, initial=0.0) / (0.005 * self.size))) or 1
        shares = np.arange(1, parts + 1) / parts
        a, b = (v.reshape(-1, self.lanes) for v in (states[:, :-1], states[:, 1:]))
        points = cubic_at(a, b, long.ravel(), np.broadcast_to(shares, (len(a), parts))).reshape(n, -1, 3)
        times = (own[:, :-1, None] + long[..., None] * shares).reshape(n, -1)
        known = np.all(np.isfinite(points), axis=-1) & (times > 1e-9 * self.size)
        out = np.zeros(known.shape, dtype=bool)
        out[known] = np.asarray(self.body.piece(points[known])) != number
        before = np.concatenate([np.zeros((n, 1)), times[:, :-1]], axis=1)
        tip = np.full(n, -1)
        when = np.argmax(out, axis=1)
        low, high = before[np.arange(n), when], times[np.arange(n), when]
        gone: BoolArray = np.asarray(out.any(axis=1))
        reach, latest = REACH * self.size, np.max(own, axis=1, initial=0.0)
        for place, v in enumerate(self.tips):
            # no ray comes farther than its length
            close = np.flatnonzero(np.linalg.norm(states[:, 0, X] - v, axis=1) < latest + reach)
            path = np.concatenate([states[close, :1, X], points[close]], axis=1)
            share, gap = nearest_on(path, v)
            met = (gap < reach) & np.isfinite(gap)
            first = np.argmax(met, axis=1)
            sooner = np.flatnonzero(met.any(axis=1) & (~gone[close] | (first <= when[close])))
            rows, first = close[sooner], first[sooner]
            low[rows] = before[rows, first]
            high[rows] = low[rows] + share[sooner, first] * (times[rows, first] - low[rows])
            when[rows], tip[rows], gone[rows] = first, self.tip_numbers[place], True
        # a ray along a joint would cross it at every step
        return Exits(gone & (self.crossed[mine] < 64), low, high, when // parts, tip)

    def _outside(self, number: int, points: FloatArray, tip: IntArray) -> BoolArray:
        """Whether points (n, 3) are off the piece, or within reach of the tip they are to come to."""
        out = np.asarray(self.body.piece(points)) != number
        for place, one in enumerate(self.tip_numbers):
            near = np.linalg.norm(points - self.tips[place], axis=-1) <= REACH * self.size
            out = np.where(tip == one, near, out)
        return np.asarray(out)

    def _cross(
        self,
        number: int,
        rows: IntArray,
        far: FloatArray,
        long: FloatArray,
        bracket: tuple[FloatArray, FloatArray, IntArray],
        stops: FloatArray,
        out: FloatArray,
    ) -> None:
        """Find where rays leave a piece on their way to the states ``far``, and end them or send them on.

        ``bracket`` is of the time, and the tip that they come to. Exact states are taken 1e-5 body sizes around it: the
        cubic between them errs by the fourth power.
        """
        base, tip = self.states[rows], bracket[2]
        tight = np.minimum(1e-5 * self.size, 0.5 * long)
        low, high = self._bracketed(number, base, far, long, *bracket, 1e-7)
        for _ in range(4):
            first, last = np.maximum(low - tight, 0.0), np.minimum(high + tight, long)
            before = self._own(number, base, first)
            after = self._own(number, before, last - first)
            inside = ~self._outside(number, before[:, X], tip) | (first == 0)
            good = inside & self._outside(number, after[:, X], tip)
            if good.all():
                break
            tight = np.where(good, tight, np.minimum(30 * tight, long))
        short = last - first
        u, v = self._bracketed(number, before, after, short, 0 * short, short, tip, 1e-15)
        at = 0.5 * (u + v)
        state = self._later(self._own(number, before, at), rows, self.now[rows] + first)
        lost = ~np.all(np.isfinite(state[:, :BARE]), axis=1)
        state[lost] = base[lost]
        moment = self.now[rows] + np.where(lost, 0.0, first + at)
        other = np.where(tip >= 0, number, np.asarray(self.body.piece(np.where(lost[:, None], far, after)[:, X])))
        crease, _ = nearest_crease(self.body, state[:, X], np.stack([np.full(len(rows), number), other], axis=1))
        crease = np.where(tip >= 0, tip, crease)
        kinds = np.array([one.kind for one in self.body.creases])[crease]
        self.states[rows], self.now[rows] = state, moment
        self.crossed[rows] += 1
        on = np.isin(kinds, SMOOTH)
        self._ended(rows[~on], crease[~on], stops, out)
        rows, other, crease, moment = rows[on], other[on], crease[on], moment[on]
        if not len(rows):
            return
        # a seam is an event of how the body is known, not of the ray
        jumps = kinds[on] == "joint"
        self.passed.append((rows[jumps], moment[jumps], crease[jumps]))
        for following in np.unique(other):
            mine = rows[other == following]
            x, p = project_bundle(self.pieces[following], self.states[mine, X], self.states[mine, P])
            self.states[mine, X], self.states[mine, P] = x, p
        self.on[rows] = other

    def _stop(self, rows: IntArray, stops: FloatArray, out: FloatArray) -> None:
        """End rays that cannot go on, at the nearest edge or tip."""
        crease, distance = nearest_crease(self.body, self.states[rows, X], kinds=("edge", "tip"))
        self._ended(rows, np.where(distance < 0.1 * self.size, crease, -1), stops, out)

    def _ended(self, rows: IntArray, crease: IntArray, stops: FloatArray, out: FloatArray) -> None:
        self.end[rows], self.crease[rows] = self.now[rows], crease
        ray, stop = np.nonzero(stops > self.now[rows, None])
        out[rows[ray], stop] = self.states[rows[ray]]

    def _beyond(self, loose: IntArray, stops: FloatArray, out: FloatArray) -> None:
        """Take rays that have ended on as if their pieces had no ends, while that can be."""
        for number in np.unique(self.on[loose]):
            mine = loose[self.on[loose] == number]
            first = self.states[mine]
            found = self._later(self._safely(number, first, stops[1:] - stops[0]), mine, stops[0])
            good = np.all(np.isfinite(found), axis=(1, 2)) if self.lanes < WHOLE else np.isfinite(found[:, -1, 0])
            self.stuck[mine[~good]] = True
            out[mine[good], 1:] = found[good]

    def _bracketed(
        self,
        number: int,
        a: FloatArray,
        b: FloatArray,
        long: FloatArray,
        low: FloatArray,
        high: FloatArray,
        tip: IntArray,
        close: float,
    ) -> tuple[FloatArray, FloatArray]:
        """Bracket, ``close`` sizes wide, of the time at which the cubics from a to b (n, lanes) leave the piece."""
        shares, row = np.arange(1, 16) / 16, np.arange(len(a))
        for _ in range(20):
            if np.all(high - low <= close * self.size):
                break
            times = np.concatenate([low[:, None], low[:, None] + (high - low)[:, None] * shares, high[:, None]], axis=1)
            inside, whole = times[:, 1:-1], long[:, None]
            points = cubic_at(a, b, long, np.divide(inside, whole, out=np.zeros(inside.shape), where=whole > 0))
            out = self._outside(number, points.reshape(-1, 3), np.repeat(tip, 15))
            first = np.argmax(np.concatenate([out.reshape(len(a), -1), np.ones((len(a), 1), bool)], axis=1), axis=1)
            low, high = times[row, first], times[row, first + 1]
        return low, high

    def _later(self, found: FloatArray, rows: IntArray, begin: FloatArray | float) -> FloatArray:
        """States (n, ..., lanes) with times of detachment from the launch on; they come as from where a trace began."""
        if self.lanes == WHOLE:
            new = np.where(np.isinf(self.states[rows, DETACHMENT]), begin, 0.0)
            found[..., DETACHMENT] += new.reshape(-1, *(1,) * (found.ndim - 2))
        return found

    def _own(self, number: int, states: FloatArray, times: FloatArray) -> FloatArray:
        # where others go by equal steps
        return trace_own(self.pieces[number], states, times, rtol=self.rtol if self.step is None else 1e-12)

    def _safely(self, number: int, states: FloatArray, times: FloatArray) -> FloatArray:
        """Trace rays on a piece, (n, k, lanes); what reaches no end is NaN."""
        try:
            return self._traced(number, states, times)
        except IntegrationError as error:
            # a block of rays fails as a whole
            out = np.full((len(states), len(times), self.lanes), np.nan)
            sound = np.setdiff1d(np.arange(len(states)), vars(error)["failed"])
        if len(sound):
            with suppress(IntegrationError):
                out[sound] = self._traced(number, states[sound], times)
        return out

    def _traced(self, number: int, states: FloatArray, times: FloatArray) -> FloatArray:
        # where a piece is known some tens of steps do, far beyond its borders F may be anything
        piece, limit = self.pieces[number], 1000
        with np.errstate(all="ignore"):
            if self.lanes == WHOLE:
                return with_attenuation(piece, states, times, rtol=self.rtol, step=self.step, limit=limit)
            rtol = self.rtol if self.step is None else 0.0
            return trace_states(piece, states, times, rtol=rtol, step=self.step, limit=limit)


def windows(times: FloatArray, scale: float) -> list[tuple[FloatArray, list[tuple[int, int]]]]:
    """Stops from 0 through ascending times, 0.1 body sizes apart at most, in runs no longer than 0.3 of them.

    So far a ray is traced beyond a crease before that is noticed. Of each run the stops, and which of them are which
    of the times.

    Examples
    --------
    >>> [(stops.tolist(), wanted) for stops, wanted in windows(np.array([0.0, 1.0, 4.0]), 20.0)]
    [([0.0, 1.0, 2.5, 4.0], [(0, 0), (1, 1), (3, 2)])]
    """
    gap, most = 0.1 * scale, 0.3 * scale
    stops, places = [0.0], []
    for time in times:
        parts = int(np.ceil((time - stops[-1]) / gap * (1 - 1e-9)))
        stops.extend(np.linspace(stops[-1], time, max(parts, 0) + 1)[1:].tolist())
        places.append(len(stops) - 1)
    every, runs, begin = np.array(stops), list[tuple[FloatArray, list[tuple[int, int]]]](), 0
    while True:
        end = int(np.searchsorted(every, every[begin] + most * (1 + 1e-9), side="right")) - 1
        end = min(max(end, begin + 1), len(every) - 1)
        wanted = [(at - begin, column) for column, at in enumerate(places) if begin < at <= end or at == begin == 0]
        runs.append((every[begin : end + 1], wanted))
        if end == len(every) - 1:
            return runs
        begin = end


def to_tips(tips: FloatArray, x: FloatArray) -> FloatArray:
    """Distance of points (n, 3) from the nearest of the tips (t, 3), inf if there are none: (n,)."""
    return np.asarray(np.min(np.linalg.norm(x[:, None] - tips, axis=2), axis=1, initial=np.inf))


def cubic_at(a: FloatArray, b: FloatArray, long: FloatArray, share: FloatArray) -> FloatArray:
    """Points at shares (n, m) of each cubic: (n, m, 3)."""
    u, h = share[..., None], long[:, None, None]
    ends = (1 - u) ** 2 * (1 + 2 * u) * a[:, None, X] + u**2 * (3 - 2 * u) * b[:, None, X]
    return np.asarray(ends + h * u * (1 - u) * ((1 - u) * a[:, None, P] - u * b[:, None, P]))


def nearest_on(path: FloatArray, point: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Share of each chord of paths (n, m + 1, 3) at which it is nearest to a point, and how near: (n, m), (n, m)."""
    along, away = np.diff(path, axis=1), point - path[:, :-1]
    with np.errstate(invalid="ignore"):
        share = np.clip(np.sum(away * along, axis=-1) / np.maximum(np.sum(along**2, axis=-1), 1e-300), 0.0, 1.0)
        return share, np.asarray(np.linalg.norm(away - share[..., None] * along, axis=-1))
