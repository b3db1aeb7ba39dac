"""Geodesics of a body with creases, piece by piece: on each of them by the order-8 pair, up to where it ends.

A ray is traced on the smooth F_i of its piece, which goes on a little beyond its creases, in windows no longer than
WINDOW; where `piece` changes along the cubic through two of its states it has crossed a crease. The crossing is found
again between exact states, TIGHT around it, so that it is exact to rounding. At a joint the ray starts anew on the next
piece: J and J' are continuous there, J'' is not. At an edge it ends, and within REACH of a tip; a ray that has ended
stays where it is.

Sources: Derivations, R1 and R3.
"""

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.errors import IntegrationError
from creeping.geodesics.attenuation import with_attenuation
from creeping.geodesics.bundle import project_bundle
from creeping.geodesics.chords import cubic_at, cubics, nearest_on, windows
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.piece_trace import Passages, PieceTrace
from creeping.geodesics.states import BARE, DETACHMENT, WHOLE, P, X
from creeping.geometry.creased import SMOOTH, is_creased, nearest_crease, piece_ahead, pieces_of, tips_of
from creeping.geometry.surface import size

WINDOW = 0.1
"""Longest time, in body sizes, that a ray is traced beyond a crease before that is noticed."""
SAMPLE = 0.005
"""Spacing, in body sizes, at which a ray is asked which piece it is on."""
TIGHT = 1e-5
"""Half the time, in body sizes, between exact states around a crossing; the cubic there errs by its fourth power."""
REACH = 1e-3
"""Distance from a tip, in body sizes, at which a ray ends: no expansion serves nearer, where curvatures go like 1/r."""
TOGETHER = 32
"""Rays traced in one call to times of their own."""
CROSSINGS = 64
"""Creases that a ray may cross within a window; a ray along a joint would cross it at every step."""
NEXT = 0.02
"""Distance from a tip, in body sizes, at which a ray goes on in short steps."""
SHORT, SHORTEST = 0.01, 1e-7
"""Longest and shortest step, in body sizes, of a ray that has no states through a window."""


def passages(body: Any, states: FloatArray, length: float, *, rtol: float) -> Passages:
    """Where rays from states (n, 6) go on across joints, up to a length; nowhere on a smooth body."""
    if not (is_creased(body) and len(states)):
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
    strict: bool = True,
) -> PieceTrace:
    """Trace states (n, 6, 10 or 12) to the ascending times (m,).

    Parameters
    ----------
    body : CreasedSurface
    states, times
        As for `creeping.geodesics.integrator.trace_states`, which traces them on each piece.
    rtol, step
        As for `DirectFlow`.
    beyond : float, L
        How far a ray that has ended goes on, on its last piece as if it had no end, while that can be.
    strict : bool
        Whether a ray that cannot go on, far from any edge or tip, is an error; else it ends there without a crease.

    Raises
    ------
    IntegrationError
        If a ray does not reach its end, and no crease is near.
    """
    walk = _Walk(body, states, rtol, step, strict)
    times = np.asarray(times, dtype=float)
    out = np.empty((len(states), len(times), states.shape[1]))
    for stops, wanted in windows(times, WINDOW * walk.size):
        found = walk.window(stops, beyond)
        for place, column in wanted:
            out[:, column] = found[:, place]
    rays, moments, creases = (np.array(part) for part in zip(*walk.passed, strict=True)) if walk.passed else (
        np.zeros(0), np.zeros(0), np.zeros(0)
    )  # fmt: skip
    order = np.lexsort((moments, rays))
    passages = Passages(rays[order].astype(np.int64), moments[order].astype(float), creases[order].astype(np.int64))
    return PieceTrace(out, walk.end, walk.crease, passages)


class _Walk:
    """Rays as they go: their states, pieces and ends."""

    def __init__(self, body: Any, states: FloatArray, rtol: float, step: float | None, strict: bool) -> None:
        self.strict = strict
        self.body, self.pieces, self.size = body, pieces_of(body), size(body)
        self.rtol, self.step = rtol, step
        self.states = np.array(states, dtype=float)
        self.lanes = states.shape[1]
        self.on = piece_ahead(body, states[:, X], states[:, P])
        self.end = np.full(len(states), np.inf)
        self.crease = np.full(len(states), -1, dtype=np.int64)
        self.stuck = np.zeros(len(states), dtype=bool)
        self.passed: list[tuple[int, float, int]] = []
        self.tip_numbers, self.tips = tips_of(body)

    def window(self, stops: FloatArray, beyond: float) -> FloatArray:
        """Advance all rays from the first of the stops (k,) to the last: (n, k, lanes)."""
        out = np.repeat(self.states[:, None], len(stops), axis=1)
        if len(stops) == 1:
            return out
        rows = np.flatnonzero(np.isinf(self.end))
        self._through(rows, np.full(len(rows), stops[0]), stops, out, 0)
        if beyond > 0:
            loose = np.flatnonzero((self.end <= stops[0]) & (self.end + beyond > stops[0]) & ~self.stuck)
            for number in np.unique(self.on[loose]):
                mine = loose[self.on[loose] == number]
                found = self._later(self._safely(number, self.states[mine], stops[1:] - stops[0]), mine, stops[0])
                good = np.all(np.isfinite(found), axis=(1, 2))
                self.stuck[mine[~good]] = True
                out[mine[good], 1:] = found[good]
        self.states = out[:, -1].copy()
        return out

    def _through(self, rows: IntArray, start: FloatArray, stops: FloatArray, out: FloatArray, crossed: int) -> None:
        """Advance rays, each from its own start within the window, filling what comes after into ``out``."""
        for k in np.flatnonzero(self._near_tips(rows, stops[-1] - start)):
            place = int(np.searchsorted(stops, start[k], side="right")) - 1
            self._march(int(self.on[rows[k]]), int(rows[k]), float(start[k]), place, stops, out, crossed)
            start[k] = np.inf
        rows, start = rows[np.isfinite(start)], start[np.isfinite(start)]
        # those that cross change their piece on the way
        on = self.on[rows].copy()
        for number in np.unique(on):
            at = np.flatnonzero(on == number)
            mine, begin = rows[at], start[at]
            own = np.maximum(stops[None] - begin[:, None], 0.0)
            first = self.states[mine]
            found = self._later(self._to_own(number, first, own[:, 1:]), mine, begin[:, None])
            states = np.concatenate([first[:, None], found], axis=1)
            left = self._left(number, states, own)
            after = stops[None] > begin[:, None]
            for row, ray in enumerate(mine):
                out[ray, after[row]] = states[row, after[row]]
            gone = np.flatnonzero(np.isfinite(left[0]))
            if len(gone) and crossed < CROSSINGS:
                parts = begin[gone], states[gone], own[gone], [v[gone] for v in left]
                self._cross(number, mine[gone], *parts, stops, out, crossed)
            for one in mine[np.isinf(self.end[mine]) & (self.on[mine] == number)].tolist():
                lost = ~np.all(np.isfinite(out[one, :, :BARE]), axis=1)
                if lost.any():
                    last = int(np.argmax(lost)) - 1
                    self.states[one] = out[one, last]
                    self._march(number, one, float(stops[last]), last, stops, out, crossed)

    def _near_tips(self, rows: IntArray, long: FloatArray) -> BoolArray:
        """Whether rays may come next to a tip within a time (n,), as far as their tangents tell."""
        away, p = self.tips - self.states[rows, None, X], self.states[rows, P]
        along = np.clip(np.einsum("ntk,nk->nt", away, p), 0.0, long[:, None])
        gap = np.linalg.norm(away - along[..., None] * p[:, None], axis=2)
        return np.asarray(np.any(gap < NEXT * self.size, axis=1))

    def _later(self, found: FloatArray, rows: IntArray, begin: FloatArray | float) -> FloatArray:
        """States (n, k, lanes) with times of detachment from the launch on; they come as from where a trace began."""
        if self.lanes == WHOLE:
            new = np.isinf(self.states[rows, DETACHMENT])[:, None]
            found[..., DETACHMENT] += np.where(new, begin, 0.0)
        return found

    def _march(
        self, number: int, ray: int, now: float, known: int, stops: FloatArray, out: FloatArray, crossed: int
    ) -> None:
        """Go on with one ray from its time, past a number of stops, in steps that do not reach through a tip.

        There, and far beyond an edge, a piece need not have any geodesics.
        """
        last, longest = self.states[ray], SHORT * self.size
        while known + 1 < len(stops):
            tip = float(np.min(np.linalg.norm(self.tips - last[X], axis=1), initial=np.inf))
            step = min(longest, max(0.5 * tip, 0.5 * REACH * self.size), float(stops[known + 1]) - now)
            found = self._later(self._safely(number, last[None], np.array([step])), np.array([ray]), now)[0, 0]
            if not np.all(np.isfinite(found[:BARE])):
                longest = 0.5 * step
                if longest < SHORTEST * self.size:
                    self._stop(ray, last, now)
                    out[ray, known + 1 :] = last
                    return
                continue
            path, own = np.stack([last, found])[None], np.array([[0.0, step]])
            left = self._left(number, path, own)
            if np.isfinite(left[0][0]) and crossed < CROSSINGS:
                self._cross(number, np.array([ray]), np.array([now]), path, own, list(left), stops, out, crossed)
                return
            self.states[ray] = last = found
            now += step
            if now >= stops[known + 1] - 1e-14 * self.size:
                known += 1
                out[ray, known], now = last, float(stops[known])

    def _stop(self, ray: int, state: FloatArray, now: float) -> None:
        """End a ray where its piece does, at the nearest edge or tip."""
        crease, distance = nearest_crease(self.body, state[None, X], kinds=("edge", "tip"))
        if not distance[0] < WINDOW * self.size:
            if not self.strict:
                self.end[ray] = now
                return
            raise IntegrationError(
                f"ray {ray} left the finite numbers at travel time {now:.3g}, far from any edge or tip; "
                "check the body's pieces",
                failed=np.array([ray]),
            )
        self.end[ray], self.crease[ray] = now, crease[0]

    def _safely(self, number: int, states: FloatArray, times: FloatArray) -> FloatArray:
        """Trace rays on a piece, (n, k, lanes); what reaches no end is NaN."""
        try:
            return self._traced(number, states, times)
        except IntegrationError:
            out = np.full((len(states), len(times), self.lanes), np.nan)
            # a block of rays fails as a whole
            for k in range(len(states)):
                try:
                    out[k] = self._traced(number, states[k : k + 1], times)[0]
                except IntegrationError:
                    continue
            return out

    def _traced(self, number: int, states: FloatArray, times: FloatArray) -> FloatArray:
        piece = self.pieces[number]
        with np.errstate(all="ignore"):
            if self.lanes == WHOLE:
                return with_attenuation(piece, states, times, rtol=self.rtol, step=self.step)
            rtol = self.rtol if self.step is None else 0.0
            return trace_states(piece, states, times, rtol=rtol, step=self.step)

    def _to_own(self, number: int, states: FloatArray, times: FloatArray) -> FloatArray:
        """Trace rays on a piece to times of their own (n, k): (n, k, lanes)."""
        if len(states) and np.all(times == times[0]) and np.all(np.diff(times[0]) > 0) and times[0, 0] > 0:
            out = self._safely(number, states, times[0])
        else:
            out = np.empty((*times.shape, self.lanes))
            for first in range(0, len(states), TOGETHER):
                some = slice(first, first + TOGETHER)
                every = np.unique(times[some])
                found = self._safely(number, states[some], every)
                place = np.searchsorted(every, times[some])
                out[some] = np.take_along_axis(found, place[..., None], axis=1)
        return out

    def _left(
        self, number: int, states: FloatArray, own: FloatArray
    ) -> tuple[FloatArray, FloatArray, IntArray, IntArray]:
        """Brackets (low, high) of own times in which rays leave a piece, inf where they do not.

        And the interval of each, and the tip it comes to, -1 if it comes to another piece.
        """
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
        path = np.concatenate([states[:, :1, X], points], axis=1)
        for place, v in enumerate(self.tips):
            share, gap = nearest_on(path, v)
            met = (gap < REACH * self.size) & np.isfinite(gap)
            first = np.argmax(met, axis=1)
            sooner = np.asarray(met.any(axis=1) & (~gone | (first <= when)))
            rows = np.flatnonzero(sooner)
            low[rows] = before[rows, first[rows]]
            high[rows] = low[rows] + share[rows, first[rows]] * (times[rows, first[rows]] - low[rows])
            when[rows], tip[rows], gone[rows] = first[rows], self.tip_numbers[place], True
        low[~gone], high[~gone] = np.inf, np.inf
        return low, high, when // parts, tip

    def _cross(
        self,
        number: int,
        rows: IntArray,
        begin: FloatArray,
        states: FloatArray,
        own: FloatArray,
        left: list[Any],
        stops: FloatArray,
        out: FloatArray,
        crossed: int,
    ) -> None:
        """Find where rays leave a piece, and end them or send them on."""
        low, high, interval, tip = left
        n = np.arange(len(rows))
        base, since = states[n, interval], own[n, interval]
        far = states[n, np.minimum(interval + 1, states.shape[1] - 1)]
        long = own[n, np.minimum(interval + 1, own.shape[1] - 1)] - since
        low, high = self._bisected(number, base, far, long, low - since, high - since, tip, 0.01 * TIGHT)
        tight = np.minimum(TIGHT * self.size, 0.5 * long)
        for _ in range(4):
            near = np.stack([np.maximum(low - tight, 0.0), np.minimum(high + tight, long)], axis=1)
            found = self._to_own(number, base, near)
            inside = ~self._outside(number, found[:, 0, X], tip) | (near[:, 0] == 0)
            good = inside & self._outside(number, found[:, 1, X], tip)
            if good.all():
                break
            tight = np.where(good, tight, np.minimum(30 * tight, long))
        short = near[:, 1] - near[:, 0]
        u, v = self._bisected(number, found[:, 0], found[:, 1], short, 0 * short, short, tip, 1e-15)
        at = near[:, 0] + 0.5 * (u + v)
        state = self._to_own(number, base, at[:, None])[:, 0]
        moment = begin + since + at
        beyond = cubics(found[:, :1], found[:, 1:], near[:, 1:] - near[:, :1], np.array([1.0]))[:, 0, 0]
        other = np.where(tip >= 0, number, np.asarray(self.body.piece(beyond)))
        crease, _ = nearest_crease(self.body, state[:, X], np.stack([np.full(len(n), number), other], axis=1))
        crease = np.where(tip >= 0, tip, crease)
        kinds = np.array([one.kind for one in self.body.creases])[crease]
        if self.lanes == WHOLE:
            state[:, DETACHMENT] += np.where(np.isinf(base[:, DETACHMENT]), begin + since, 0.0)
        on = np.isin(kinds, SMOOTH)
        ended = np.flatnonzero(~on)
        for k in ended:
            ray = rows[k]
            self.end[ray], self.crease[ray] = moment[k], crease[k]
            out[ray, stops > moment[k]] = state[k]
        joint = np.flatnonzero(on)
        for k in joint:
            # a seam is an event of how the body is known, not of the ray
            if kinds[k] == "joint":
                self.passed.append((int(rows[k]), float(moment[k]), int(crease[k])))
            x, p = project_bundle(self.pieces[other[k]], state[k, X], state[k, P])
            state[k, X], state[k, P] = x, p
        self.on[rows[joint]] = other[joint]
        self.states[rows[joint]] = state[joint]
        if len(joint):
            self._through(rows[joint], moment[joint], stops, out, crossed + 1)

    def _outside(self, number: int, points: FloatArray, tip: IntArray) -> BoolArray:
        """Whether points (n, 3) are off the piece, or within reach of the tip they are to come to."""
        out = np.asarray(self.body.piece(points)) != number
        for place, one in enumerate(self.tip_numbers):
            near = np.linalg.norm(points - self.tips[place], axis=-1) <= REACH * self.size
            out = np.where(tip == one, near, out)
        return np.asarray(out)

    def _bisected(
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
        for _ in range(50):
            middle = 0.5 * (low + high)
            if np.all(high - low <= close * self.size):
                break
            share = np.divide(middle, long, out=np.zeros_like(middle), where=long > 0)
            points = cubic_at(a, b, long, share)
            out = self._outside(number, points, tip)
            low, high = np.where(out, low, middle), np.where(out, middle, high)
        return low, high
