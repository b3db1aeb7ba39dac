"""Creeping rays traced for what a field needs to know of them: of a fan, or near given points of a shadow line.

    F(x0) = 0,  grad F(x0).d = 0;   dσ⊥ = b0.dx0,  b0 = n0 x d;   J(0) = 1,  J'(0) = 1/R

Rays are known at equal steps, in which the most curved part of the body turns them by TURN. On a smooth body these are
the steps of the integration: what comes out of one ray does not depend on the others that are traced with it. On one
with creases, where curvatures grow like 1/r at a tip, steps are as short as RTOL demands.

R is the distance from a point source, inf of a plane wave.

Rays that leave towards given directions r are sought next to given points of a shadow line by Newton's method on
p(σ, s) = r, with p and b = n x p at the end,

    b.(r - p) = J' dσ⊥,   n.(r - p) = -κₙ (dt + d.T dσ) - τ J dσ⊥,   τ = b.Hp/|grad F|,

dσ along the line, whose tangent T need not be across d, and dσ⊥ = b0.T dσ. On a body with creases nothing but the ends
of rays is traced on the way.

Sources: Derivations, R4, R12 and R19.
"""

from dataclasses import dataclass

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.geodesics.equations import sharpest_curvature
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.pieces import trace_pieces, trace_to
from creeping.geodesics.states import M11, M12, M21, M22, P, X, pack
from creeping.geometry.curvature import bending, second_form
from creeping.geometry.evaluators import evaluators, speed_of
from creeping.geometry.patches import Rows
from creeping.geometry.piecewise import is_piecewise, piece_ahead, pieces_of
from creeping.geometry.surface import Surface, normal, size
from creeping.rays.ends import non_smooth_from
from creeping.rays.quantities import GAUSS, GUARD, LANES, START_LANES, STRAIGHT, RayPoints
from creeping.shadow.curves import moved_onto_lines

TURN = 0.12
"""Largest angle by which a ray turns in one step: polynomials of degree 9 then err by about 1e-9."""
RTOL = 1e-10
"""Relative tolerance of rays on bodies with creases."""
ACCEPTED = 1e-4
"""Residual of a ray towards r, on exact rays: its phase errs by half the square of it, in radii of curvature."""
STEP = 8.0
"""First step of Newton's method, in cells, from which on nothing is a cell away; 2 on bodies with creases."""


@dataclass(frozen=True, eq=False)
class SingleRays(Rows):
    """Rays (n,), each with its incidence.

    Attributes
    ----------
    directions : (n, 3)
    starts : (n, 3), L
        Launch points.
    tangents : (n, 3)
        Of the shadow line there.
    rays : RayPoints
        (n,) Where each ends.
    risen : (n,) of bool
        Whether n.r > 0 somewhere before, of rays traced for observers r.
    """

    directions: FloatArray
    starts: FloatArray
    tangents: FloatArray
    rays: RayPoints
    risen: BoolArray


class RayTracer:
    """Traces rays of a body, no longer than ``length``.

    Parameters
    ----------
    body : Surface
    length : float, L
    turn : float, radians
        Largest angle by which a ray turns in one step.

    Raises
    ------
    InvalidInputError
        If the body is weighted.
    """

    def __init__(self, body: Surface, length: float, *, turn: float = TURN) -> None:
        from creeping.rays.kernels.quantities import polynomial_matrix

        if speed_of(body) is not None:
            raise InvalidInputError(f"{body!r} has a speed; diffracted fields need a body without speed")
        self.body, self.length = body, length
        self.steps = max(16, int(np.ceil(length * sharpest_curvature(body) / turn)))
        self.step = length / self.steps
        nodes, weights = np.polynomial.legendre.leggauss(GAUSS)
        self._rule = polynomial_matrix(GUARD), 0.5 * (nodes + 1), 0.5 * weights

    def onto_line(self, points: FloatArray, directions: FloatArray, steps: int = 4) -> tuple[FloatArray, FloatArray]:
        """Points of the shadow lines next to the given ones, and T there: (n, 3), (n, 3)."""
        reach = 0.1 * size(self.body)
        if not is_piecewise(self.body):
            moved = moved_onto_lines(self.body, directions, points, reach=reach, steps=steps)
            return moved.points, moved.tangents
        points, tangents = points.copy(), np.zeros_like(points)
        # each on the piece that it is next to
        on, bodies = piece_ahead(self.body, points, directions), pieces_of(self.body)
        for number in np.unique(on):
            mine = on == number
            moved = moved_onto_lines(bodies[number], directions[mine], points[mine], reach=reach, steps=steps)
            points[mine], tangents[mine] = moved.points, moved.tangents
        return points, tangents

    def _states(
        self,
        directions: FloatArray,
        starts: FloatArray,
        openings: FloatArray,
        latest: float,
        before: bool,
    ) -> tuple[FloatArray, FloatArray]:
        """x, p, J, J' at equal steps, GUARD of them before the launch point and beyond a time: (n, K, 8).

        Those ``before`` are copies of the launch point unless they are wanted. And the times (n,) at which rays end at
        creases.
        """
        last = int(np.ceil(latest / self.step)) + GUARD + 1
        forward: FloatArray = self.step * np.arange(last + 1, dtype=np.float64)
        ahead, end = self._traced(pack(starts, directions, jacobi=True), forward)
        _open(ahead, openings)
        if not before:
            # never read, but polynomials of the first steps pass there
            return np.concatenate([np.repeat(ahead[:, :1, :8], GUARD, axis=1), ahead[..., :8]], axis=1), end
        some = forward[: GUARD + 1]
        back, _ = self._traced(pack(starts, -directions, jacobi=True), some)
        _open(back, -openings)
        states = np.empty((len(starts), last + 1 + GUARD, 8))
        states[:, GUARD:] = ahead[..., :8]
        behind = back[:, GUARD:0:-1]
        states[:, :GUARD, X], states[:, :GUARD, P] = behind[..., X], -behind[..., P]
        states[:, :GUARD, M11], states[:, :GUARD, M21] = behind[..., M11], -behind[..., M21]
        return states, end

    def at(
        self,
        directions: FloatArray,
        starts: FloatArray,
        tangents: FloatArray,
        times: FloatArray,
        owner: IntArray | None = None,
        *,
        whole: bool = True,
        openings: FloatArray | None = None,
        observers: FloatArray | None = None,
        cross: bool = False,
    ) -> SingleRays:
        """Points of rays.

        Parameters
        ----------
        directions, starts, tangents : (rays, 3)
            d, points of the shadow lines, and T there.
        times : (n,), L
        owner : (n,), optional
            Ray of each point; each has its own if not given.
        whole : bool
            Whether integrals along the ray are wanted.
        openings : (rays,), optional, 1/L
            1/R, of a point source.
        observers : (n, 3), optional
            r of each point.
        cross : bool
            Whether to move each point along its ray to n.r = 0 near it.

        Returns
        -------
        SingleRays
            (n,) points.
        """
        from creeping.rays.kernels.quantities import cross as to_crossing
        from creeping.rays.kernels.quantities import quantities_at

        n, rays = len(times), len(starts)
        owner = np.arange(n) if owner is None else owner
        opened = np.zeros(rays) if openings is None else openings
        lanes, first = np.zeros((n, LANES)), np.zeros((n, START_LANES))
        alive, risen = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
        times = np.array(times)
        step, scale = self.step, size(self.body)
        latest, ends_of = np.zeros(rays), np.full(rays, np.inf)
        np.maximum.at(latest, owner, times)
        # those of like length together: all rays of a call are traced to the latest time
        order = np.argsort(latest, kind="stable")
        rank = np.empty(rays, dtype=np.int64)
        rank[order] = np.arange(rays)
        place = np.argsort(rank[owner], kind="stable")
        # on a body with creases a call has more to do beside them
        together = 2048 if is_piecewise(self.body) else 192
        ends = np.searchsorted(rank[owner][place], np.arange(0, rays + together, together))
        with evaluators(self.body) as parts:
            evaluator = parts[:2]
            for k in range(0, rays, together):
                mine = order[k : k + together]
                rows = place[ends[k // together] : ends[k // together + 1]]
                if not len(rows):
                    continue
                now, which = times[rows], rank[owner[rows]] - k
                before = whole or float(np.min(now)) < GUARD * step
                states, ends_of[mine] = self._states(
                    directions[mine], starts[mine], opened[mine], float(np.max(latest[mine])) + 2 * step, before
                )
                if whole and hasattr(self.body, "non_smooth"):
                    ahead = states[:, GUARD:, X]
                    rough = non_smooth_from(self.body, ahead, step * np.arange(ahead.shape[1], dtype=float))
                    ends_of[mine] = np.minimum(ends_of[mine], rough)
                seen = np.zeros((0, 3)) if observers is None else observers[rows]
                if cross:
                    to_crossing(*evaluator, self._rule[0], states, step, which, seen, now)
                out = [values[rows] for values in (lanes, first, alive, risen)]
                joints = is_piecewise(self.body)
                quantities_at(*evaluator, *self._rule, scale, states, step, which, now, whole, joints, seen, *out)
                times[rows] = now
                lanes[rows], first[rows], alive[rows], risen[rows] = out
        directions, starts, tangents = directions[owner], starts[owner], tangents[owner]
        first[:, 0] = np.sum(starts * directions, axis=1)
        if np.any(opened):
            first[:, 0], first[:, 9] = 1 / opened[owner], opened[owner]
        first[:, 1] = np.abs(np.sum(np.cross(first[:, 6:9], directions) * tangents, axis=1))
        if whole and n:
            alive &= times < ends_of[owner]
        return SingleRays(directions, starts, tangents, RayPoints(lanes, first, times, alive, scale), risen)

    def ends(self, directions: FloatArray, starts: FloatArray, times: FloatArray) -> FloatArray:
        """x, p, J, J' (n, 8) of rays on a body with creases, each at its time (n,); where it ended, if before."""
        found, _ = trace_to(self.body, pack(starts, directions, jacobi=True), times, rtol=RTOL)
        return found[:, :8]

    def _traced(self, states: FloatArray, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Rays at equal steps, beyond an edge or tip as if their piece went on, for the polynomials' sake; and ends."""
        if is_piecewise(self.body):
            found = trace_pieces(self.body, states, times, rtol=RTOL, beyond=(GUARD + 2) * self.step)
            return found.states, found.end
        return trace_states(self.body, states, times, rtol=0.0, step=self.step), np.full(len(states), np.inf)

    def crossing(
        self,
        directions: FloatArray,
        starts: FloatArray,
        owner: IntArray,
        observers: FloatArray,
        times: FloatArray,
    ) -> SingleRays:
        """Points (n,) where rays (m, 3) x 2 from next to their lines cross n.r = 0 next to the times (n,)."""
        starts, tangents = self.onto_line(starts, directions)
        return self.at(directions, starts, tangents, times, owner, observers=observers, cross=True)


def _open(states: FloatArray, openings: FloatArray) -> None:
    """Give states (rays, steps, 10) the J and J' of rays that part by 1/R (rays,) at their start, in place."""
    if np.any(openings):
        states[..., M11] += openings[:, None] * states[..., M12]
        states[..., M21] += openings[:, None] * states[..., M22]


class RaySearch:
    """Rays with p = r next to given points and times.

    Parameters
    ----------
    tracer : RayTracer
    directions, observers, near : (n, 3)
        d, r, and points next to the shadow line.
    times : (n,)
    cell : (n, 2), L
        Distances of neighbouring rays and samples: a search that leaves its neighbourhood is given up.

    Attributes
    ----------
    moved : (n,)
        How far along the line each has come, in cells.
    """

    def __init__(
        self,
        tracer: RayTracer,
        directions: FloatArray,
        observers: FloatArray,
        near: FloatArray,
        times: FloatArray,
        cell: FloatArray,
    ) -> None:
        n = len(times)
        self.tracer, self.directions, self.observers, self.cell = tracer, directions, observers, cell
        self.starts, self.tangents = tracer.onto_line(near, directions)
        self.times, self.begin, self.moved = times.copy(), times, np.zeros(n)
        self.ends, self.on = np.empty((n, 8)), np.full(n, -1)
        self.piecewise = is_piecewise(tracer.body)
        # what is near does not hang on the number of rays: dense fans count as of such cells
        self.wide = np.maximum(cell, 0.008 * size(tracer.body)) if self.piecewise else cell
        # cells by which a search may move before it is given up, as most of those on bodies with creases are
        self.far = 1.5 if self.piecewise else 3.0
        idle, best = np.zeros(n, dtype=bool), np.full(n, np.inf)
        active, self.wanted = np.arange(n), np.zeros(n, dtype=bool)
        for number in range(10):
            residual, crossed = self._off(active), self._crossed(active)
            # the next step ends the search, which converges by squares; what it finds is looked at
            self.wanted[active] = residual <= 2e-4
            # curvature jumps at a joint: the first step across it may go too far
            idle[active] = self.piecewise & (residual > 0.95 * best[active]) & ~crossed
            best[active] = np.fmin(residual, best[active])
            # a phase is stationary there, and errs by the square
            last = active[(residual > 1e-6) & self._within(active) & ~idle[active]]
            if not len(last):
                break
            step = self._step(last)
            if number == 0:
                idle[last] = step > (2.0 if self.piecewise else STEP)
            active = last[~self.wanted[last] & ~idle[last]]
            if not len(active):
                break

    def result(self) -> tuple[SingleRays, IntArray]:
        """Exact rays that have been found, and their rows."""
        kept = np.flatnonzero(self.wanted & self._within())
        if self.piecewise:
            kept = self._close(kept)
        rows = self.directions[kept], self.starts[kept], self.tangents[kept], self.times[kept]
        found = self.tracer.at(*rows, observers=self.observers[kept])
        if self.piecewise:
            self._ended(kept, found.rays)
        good = (_apart(found.rays.directions, self.observers[kept]) < ACCEPTED) & self._within(kept)
        return found[good], kept[good]

    def _close(self, some: IntArray) -> IntArray:
        """Those of some searches whose last steps have brought them to p = r, with more such steps where they lack."""
        off = self._off(some)
        for _ in range(3):
            beside = np.flatnonzero((off >= ACCEPTED) & (off < 0.25))
            if not len(beside):
                break
            self._step(some[beside])
            now = self._off(some[beside])
            # those that come no nearer are given up
            off[beside] = np.where(now < 0.95 * off[beside], now, np.inf)
        return some[off < ACCEPTED]

    def _off(self, some: IntArray) -> FloatArray:
        """|r - p| (n,) where some searches are now."""
        rows = self.directions[some], self.starts[some], self.tangents[some], self.times[some]
        if self.piecewise:
            self.ends[some] = self.tracer.ends(rows[0], rows[1], rows[3])
        else:
            self.ends[some] = self.tracer.at(*rows, whole=False).rays.lanes[:, :8]
        return _apart(self.ends[some, P], self.observers[some])

    def _crossed(self, some: IntArray) -> BoolArray:
        """Which of some searches have come to another piece since they were asked last."""
        if not self.piecewise:
            return np.zeros(len(some), dtype=bool)
        body: Any = self.tracer.body
        before, self.on[some] = self.on[some], body.piece(self.ends[some, X])
        return np.asarray((self.on[some] != before) & (before >= 0))

    def _ended(self, some: IntArray, rays: RayPoints) -> None:
        """Put into rays (n,) what is known of their ends: next to a tip no polynomial through steps tells it."""
        lanes = rays.lanes
        lanes[:, :8] = self.ends[some]
        x, p, J, rate = lanes[:, X], lanes[:, P], lanes[:, 6], lanes[:, 7]
        n, hessian = bending(self.tracer.body, x)
        lanes[:, 9], lanes[:, 12] = (second_form(v, hessian) for v in (p, np.cross(n, p)))
        # the angle of these J and J', on the branch that the ray has come to
        angle = np.arctan2(-rays.scale * rate, J)
        lanes[:, 8] = angle + 2 * np.pi * np.round((lanes[:, 8] - angle) / (2 * np.pi))
        rays.alive[lanes[:, 9] <= STRAIGHT / rays.scale] = False

    def _within(self, some: IntArray | slice = slice(None)) -> BoolArray:
        """Which of some searches are in their neighbourhoods."""
        along, late = np.abs(self.moved[some] * self.cell[some, 0]), np.abs(self.times[some] - self.begin[some])
        return np.asarray((along <= self.far * self.wide[some, 0]) & (late <= self.far * self.wide[some, 1]))

    def _step(self, some: IntArray) -> FloatArray:
        """Move some starts along their lines and times along their rays, by no more than a cell; steps wanted (n,)."""
        x, p, J, rate = (self.ends[some, part] for part in (X, P, 6, 7))
        gap = self.observers[some] - p / np.linalg.norm(p, axis=1, keepdims=True)
        n, hessian = bending(self.tracer.body, x)
        b = np.cross(n, p)
        bend = np.einsum("nij,nj->ni", hessian, p)
        torsion, kappa = (np.sum(v * bend, axis=1) for v in (b, p))
        directions, cell = self.directions[some], self.cell[some]
        first = normal(self.tracer.body, self.starts[some])
        facing = np.sum(np.cross(first, directions) * self.tangents[some], axis=1)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            along_line = np.nan_to_num(np.sum(b * gap, axis=1) / rate / facing)
            wanted = np.abs(along_line) / self.wide[some, 0]
            along_line = np.clip(along_line, -cell[:, 0], cell[:, 0])
            later = -(np.sum(n * gap, axis=1) + torsion * J * along_line * facing) / kappa
            # a start farther along d is as good as a later end
            later = np.nan_to_num(later - along_line * np.sum(directions * self.tangents[some], axis=1))
            wanted = np.fmax(wanted, np.abs(later) / self.wide[some, 1])
        later = np.clip(later, -cell[:, 1], cell[:, 1])
        self.moved[some] += along_line / cell[:, 0]
        self.times[some] = np.clip(self.times[some] + later, 0.0, self.tracer.length)
        guess = self.starts[some] + along_line[:, None] * self.tangents[some]
        self.starts[some], self.tangents[some] = self.tracer.onto_line(guess, directions, 2)
        return np.asarray(wanted)


def _apart(p: FloatArray, observers: FloatArray) -> FloatArray:
    """|r - p| (n,), p (n, 3) made unit."""
    p = p / np.linalg.norm(p, axis=1, keepdims=True)
    return np.asarray(np.linalg.norm(observers - p, axis=1))


def same_within(rays: RayPoints, cell: FloatArray) -> FloatArray:
    """Distance of launch points, L, and difference of times below which two rays found (n,) are one: (n, 2).

    ``cell`` (n, 2) is that of the fan in which each was sought. What is left of r - p, up to ACCEPTED, is a step of J'
    across the rays and of κₙ along them: far on a flat surface, but no more than a tenth of a cell, nor less than 1e-2.
    """
    turn = np.stack([np.abs(rays.spreading_rate), np.abs(rays.curvature[1])], axis=1)
    with np.errstate(divide="ignore"):
        left = 2 * ACCEPTED / turn
    return np.asarray(np.clip(left, 1e-2 * cell, 1e-1 * cell))
