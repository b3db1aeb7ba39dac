"""Rays of a body of pieces as they go: together from stop to stop on their pieces, one by one where they leave them.

All rays on one piece are traced through a window of stops in one call, but no farther than the piece is wide: steps
are many beyond its borders. Where one of them has left its piece, the time is found again between exact states, TIGHT
around it, so that it is exact to rounding; from there it goes by itself to the next stop, and so do rays next to a tip,
in steps that do not reach through it.

What a ray does is bounded: after CROSSINGS it stays on its piece up to the end of the window, and after ROUNDS, or
where no step however short is left to it, it ends as data, at the nearest edge or tip, without a crease if none is
near; without one it ends, too, where a window begins on ground that the body does not trust.

Also here: where rays leave the pieces of a body: to others, or within REACH of a tip.

Between its states a ray is the cubic of both ends; SAMPLE by SAMPLE it is asked which piece it is on.

Sources: Derivations, R1 and R3.
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.errors import IntegrationError
from creeping.geodesics.attenuation import with_attenuation
from creeping.geodesics.bundle import project_bundle
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.own_times import trace_own
from creeping.geodesics.states import BARE, DETACHMENT, WHOLE, P, X, cubic_at, cubics, nearest_on
from creeping.geometry.piecewise import SMOOTH, nearest_crease, piece_ahead, pieces_across, pieces_of, tips_of
from creeping.geometry.surface import size

GAP, WINDOW = 0.1, 0.3
"""Longest time, in body sizes, between states, and that a ray is traced beyond a crease before that is noticed."""
NEAR = 0.1
"""Distance, in body sizes, within which a ray that cannot go on ends at an edge or tip."""
SECTIONS = 16
"""Parts of a bracket that are looked at together."""
TIGHT = 1e-5
"""Half the time, in body sizes, between exact states around a crossing; the cubic there errs by its fourth power."""
CROSSINGS = 64
"""Creases that a ray may cross within a window; a ray along a joint would cross it at every step."""
NEXT = 0.02
"""Distance from a tip, in body sizes, at which a ray goes on in short steps."""
SHORTEST = 1e-7
"""Shortest step, in body sizes, of a ray that has no states through a window."""
ROUNDS = 400
"""Rounds of a window: next to a tip a ray goes half of REACH in each, and a step is halved 20 times."""
STEPS = 1000
"""Between outputs, after which rays are given up that are traced together: where a piece is known some tens do, far
beyond its borders F may be anything."""
EVEN = 1e-12
"""Difference of gaps between stops, in body sizes, up to which they are alike."""
OWN = 1e-12
"""Relative tolerance of what rays do by themselves, where they go by equal steps else."""

SAMPLE = 0.005
"""Spacing, in body sizes, at which a ray is asked which piece it is on."""
REACH = 1e-3
"""Distance from a tip, in body sizes, at which a ray ends: no expansion serves nearer, where curvatures go like 1/r."""


class Exits(NamedTuple):
    """Where rays (n,) leave a piece.

    Attributes
    ----------
    gone : (n,) of bool
        Whether each does.
    low, high : (n,), L
        Bracket of the time; it is no time of a ray that does not leave.
    interval : (n,) of int
        Between which states it is.
    tip : (n,) of int
        Number of the crease of the tip that it comes to, -1 if it comes to another piece.
    """

    gone: BoolArray
    low: FloatArray
    high: FloatArray
    interval: IntArray
    tip: IntArray

    def some(self, index: IntArray) -> "Exits":
        """Those of part of the rays."""
        return Exits(self.gone[index], self.low[index], self.high[index], self.interval[index], self.tip[index])

    def since(self, begin: FloatArray) -> "Exits":
        """With times (n,) from others on."""
        return self._replace(low=self.low - begin, high=self.high - begin)


class PieceExits:
    """Where rays of a body with creases leave its pieces."""

    def __init__(self, body: Any) -> None:
        self.body, self.size = body, size(body)
        self.tip_numbers, self.tips = tips_of(body)

    def of(self, number: int, states: FloatArray, own: FloatArray) -> Exits:
        """Where rays with states (n, k, lanes) at own times (n, k) leave a piece."""
        n = len(own)
        parts = int(np.ceil(np.max(np.diff(own, axis=1), initial=0.0) / (SAMPLE * self.size))) or 1
        shares = np.arange(1, parts + 1) / parts
        points = cubics(states[:, :-1], states[:, 1:], np.diff(own, axis=1), shares).reshape(n, -1, 3)
        times = (own[:, :-1, None] + np.diff(own, axis=1)[..., None] * shares).reshape(n, -1)
        known = np.all(np.isfinite(points), axis=-1) & (times > 1e-9 * self.size)
        out = np.zeros(known.shape, dtype=bool)
        out[known] = np.asarray(self.body.piece(points[known])) != number
        before = np.concatenate([np.zeros((n, 1)), times[:, :-1]], axis=1)
        tip = np.full(n, -1)
        when = np.argmax(out, axis=1)
        low, high = before[np.arange(n), when], times[np.arange(n), when]
        gone: BoolArray = np.asarray(out.any(axis=1))
        reach, long = REACH * self.size, np.max(own, axis=1, initial=0.0)
        for place, v in enumerate(self.tips):
            # no ray comes farther than its length
            close = np.flatnonzero(np.linalg.norm(states[:, 0, X] - v, axis=1) < long + reach)
            path = np.concatenate([states[close, :1, X], points[close]], axis=1)
            share, gap = nearest_on(path, v)
            met = (gap < reach) & np.isfinite(gap)
            first = np.argmax(met, axis=1)
            sooner = np.flatnonzero(met.any(axis=1) & (~gone[close] | (first <= when[close])))
            rows, first = close[sooner], first[sooner]
            low[rows] = before[rows, first]
            high[rows] = low[rows] + share[sooner, first] * (times[rows, first] - low[rows])
            when[rows], tip[rows], gone[rows] = first, self.tip_numbers[place], True
        return Exits(gone, low, high, when // parts, tip)

    def outside(self, number: int, points: FloatArray, tip: IntArray) -> BoolArray:
        """Whether points (n, 3) are off the piece, or within reach of the tip they are to come to."""
        out = np.asarray(self.body.piece(points)) != number
        for place, one in enumerate(self.tip_numbers):
            near = np.linalg.norm(points - self.tips[place], axis=-1) <= REACH * self.size
            out = np.where(tip == one, near, out)
        return np.asarray(out)

    def near_tips(self, states: FloatArray, long: FloatArray, near: float) -> BoolArray:
        """Whether rays may come nearer to a tip than that within a time (n,), as far as their tangents tell."""
        away, p = self.tips - states[:, None, X], states[:, P]
        along = np.clip(np.einsum("ntk,nk->nt", away, p), 0.0, long[:, None])
        gap = np.linalg.norm(away - along[..., None] * p[:, None], axis=2)
        return np.asarray(np.any(gap < near, axis=1))

    def to_tips(self, states: FloatArray) -> FloatArray:
        """Distance of rays from the nearest tip (n,), L."""
        return np.asarray(np.min(np.linalg.norm(self.tips - states[:, None, X], axis=2), axis=1, initial=np.inf))


class Walk:
    """Rays (n, lanes) on their pieces: their states, ends and the joints they have passed. They begin at 0 or (n,)."""

    def __init__(
        self, body: Any, states: FloatArray, rtol: float, step: float | None, begin: FloatArray | None = None
    ) -> None:
        self.body, self.pieces, self.size = body, pieces_of(body), size(body)
        self.rtol, self.step = rtol, step
        self.exits, self.across = PieceExits(body), pieces_across(body)
        self.states = np.array(states, dtype=float)
        self.lanes, n = states.shape[1], len(states)
        self.on = piece_ahead(body, states[:, X], states[:, P])
        self.end = np.full(n, np.inf)
        self.crease = np.full(n, -1, dtype=np.int64)
        self.stuck = np.zeros(n, dtype=bool)
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
        for _ in range(ROUNDS):
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
        near = self.exits.near_tips(self.states[rows], stops[-1] - self.now[rows], NEXT * self.size)
        # between stops as far apart as all others, rays that are at different ones go together
        gaps = np.diff(stops)
        even = np.ptp(gaps) <= EVEN * self.size
        free = (self.exits.to_tips(self.states[rows]) - NEXT * self.size) / gaps[0]
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
            self._cross(number, mine[gone], far, own[k + 1] - since, exits.some(gone).since(since), stops, out)

    def _alone(self, number: int, mine: IntArray, stops: FloatArray, out: FloatArray) -> None:
        """Go on with each ray to its next stop, if a step that does not reach through a tip does.

        There, and far beyond an edge, a piece need not have any geodesics.
        """
        following, tip = stops[self.place[mine] + 1], self.exits.to_tips(self.states[mine])
        short = np.minimum(np.maximum(0.5 * tip, 0.5 * REACH * self.size), self.longest[mine])
        step = np.minimum(short, following - self.now[mine])
        found = self._later(self._own(number, self.states[mine], step), mine, self.now[mine])
        bad = ~np.all(np.isfinite(found[:, :BARE]), axis=1)
        self.longest[mine[bad]] = 0.5 * step[bad]
        none = bad & (0.5 * step < SHORTEST * self.size)
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
            self._cross(number, mine[gone], found[gone], step[gone], exits.some(gone), stops, out)

    def _exits(self, number: int, mine: IntArray, path: FloatArray, own: FloatArray) -> Exits:
        exits = self.exits.of(number, path, own)
        return exits._replace(gone=exits.gone & (self.crossed[mine] < CROSSINGS))

    def _cross(
        self,
        number: int,
        rows: IntArray,
        far: FloatArray,
        long: FloatArray,
        exits: Exits,
        stops: FloatArray,
        out: FloatArray,
    ) -> None:
        """Find where rays leave a piece on their way to the states ``far``, and end them or send them on."""
        base, tip = self.states[rows], exits.tip
        tight = np.minimum(TIGHT * self.size, 0.5 * long)
        low, high = self._bracketed(number, base, far, long, exits.low, exits.high, tip, 0.01 * TIGHT)
        for _ in range(4):
            first, last = np.maximum(low - tight, 0.0), np.minimum(high + tight, long)
            before = self._own(number, base, first)
            after = self._own(number, before, last - first)
            inside = ~self.exits.outside(number, before[:, X], tip) | (first == 0)
            good = inside & self.exits.outside(number, after[:, X], tip)
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
        self._ended(rows, np.where(distance < NEAR * self.size, crease, -1), stops, out)

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
        shares = np.arange(1, SECTIONS) / SECTIONS
        row = np.arange(len(a))
        for _ in range(20):
            if np.all(high - low <= close * self.size):
                break
            times = np.concatenate([low[:, None], low[:, None] + (high - low)[:, None] * shares, high[:, None]], axis=1)
            share = np.divide(
                times[:, 1:-1], long[:, None], out=np.zeros(times[:, 1:-1].shape), where=long[:, None] > 0
            )
            points = cubic_at(a, b, long, share)
            out = self.exits.outside(number, points.reshape(-1, 3), np.repeat(tip, SECTIONS - 1))
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
        rtol = self.rtol if self.step is None else OWN
        return trace_own(self.pieces[number], states, times, rtol=rtol)

    def _safely(self, number: int, states: FloatArray, times: FloatArray) -> FloatArray:
        """Trace rays on a piece, (n, k, lanes); what reaches no end is NaN."""
        try:
            return self._traced(number, states, times)
        except IntegrationError as error:
            # a block of rays fails as a whole
            out = np.full((len(states), len(times), self.lanes), np.nan)
            sound = np.setdiff1d(np.arange(len(states)), vars(error)["failed"])
        if len(sound):
            try:
                out[sound] = self._traced(number, states[sound], times)
            except IntegrationError:
                pass
        return out

    def _traced(self, number: int, states: FloatArray, times: FloatArray) -> FloatArray:
        piece = self.pieces[number]
        with np.errstate(all="ignore"):
            if self.lanes == WHOLE:
                return with_attenuation(piece, states, times, rtol=self.rtol, step=self.step, limit=STEPS)
            rtol = self.rtol if self.step is None else 0.0
            return trace_states(piece, states, times, rtol=rtol, step=self.step, limit=STEPS)
