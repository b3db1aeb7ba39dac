"""Creeping rays traced for what a field needs to know of them: of a fan, or near given points of a shadow line.

    F(x0) = 0,  grad F(x0).d = 0;   dσ⊥ = b0.dx0,  b0 = n0 x d;   J(0) = 1,  J'(0) = 1/R

Rays that leave towards r are found by Newton's method on p(σ, s) = r, with p and b = n x p at the end,

    b.(r - p) = J' dσ⊥,   n.(r - p) = -κₙ ds - τ J dσ⊥,   τ = b.Hp/|grad F|.

Rays go by equal steps, in which the most curved part of the body turns them by TURN: what comes out of one does not
depend on the others that are traced with it.

R is the distance from a point source, inf of a plane wave.

Sources: Derivations, R4, R12 and R19.
"""

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.geodesics.equations import sharpest_curvature
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.pieces import trace_pieces
from creeping.geodesics.states import M11, M12, M21, M22, P, X, pack
from creeping.geometry.creased import is_creased, piece_ahead, pieces_of
from creeping.geometry.evaluators import evaluators
from creeping.geometry.speed import speed_of
from creeping.geometry.surface import Surface, size
from creeping.rays.nonsmooth import non_smooth_from
from creeping.rays.quantities import GAUSS, GUARD, LANES, START_LANES, RayPoints
from creeping.rays.single_rays import SingleRays
from creeping.shadow.moving import moved_onto_lines

TURN = 0.12
"""Largest angle by which a ray turns in one step: polynomials of degree 9 then err by about 1e-9."""
CLOSE = 1e-6
"""Residual at which the search for a ray ends, radians: its phase is stationary there, and errs by the square."""
ACCEPTED = 1e-4
"""Residual of what was found, on exact rays: its phase errs by half the square of it, in radii of curvature."""
ALIKE = (1e-2, 1e-1)
"""Distances, in cells, between which lies the one below which two rays that searches found are one."""
ROUNDS = 10
FAR, FAR_ON_PIECES = 3.0, 1.5
"""Cells by which a search may move before it is given up: most of those on bodies with creases go nowhere,"""
SLOW = 0.95
"""and are given up where a round does not bring the residual down to this share,"""
HOPE = 0.25
"""for good if it has never been less than this: others may have met the error of long steps next to a tip."""
TOGETHER, TOGETHER_ON_PIECES = 192, 2048
"""Rays traced in one call, and on a body with creases, where a call has more to do beside them."""
LONG, LONG_ON_PIECES = 2, (6, 2, 1)
"""Steps of a search, in steps of what it finds: points err less than derivatives of curvature do. On a body with
creases of both searches: sharp places next to tips and edges make steps short all over it."""
NEARLY = 2e-4
"""Residual from which a step is taken to end the search, which converges by squares; what it finds is looked at."""


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
            raise InvalidInputError(f"{body!r} has a speed; the diffracted field is that of a plain body")
        self.body, self.length = body, length
        self.steps = max(16, int(np.ceil(length * sharpest_curvature(body) / turn)))
        self.step = length / self.steps
        nodes, weights = np.polynomial.legendre.leggauss(GAUSS)
        self._rule = polynomial_matrix(), 0.5 * (nodes + 1), 0.5 * weights

    def onto_line(self, points: FloatArray, directions: FloatArray, steps: int = 4) -> tuple[FloatArray, FloatArray]:
        """Points of the shadow lines next to the given ones, and T there: (n, 3), (n, 3)."""
        reach = 0.1 * size(self.body)
        if not is_creased(self.body):
            points, tangents, _ = moved_onto_lines(self.body, directions, points, reach=reach, steps=steps)
            return points, tangents
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
        step: float,
        before: bool,
    ) -> tuple[FloatArray, FloatArray]:
        """x, p, J, J' at equal steps, GUARD of them before the launch point and beyond a time: (n, K, 8).

        Those ``before`` are copies of the launch point unless they are wanted. And the times (n,) at which rays end at
        creases.
        """
        last = int(np.ceil(latest / step)) + GUARD + 1
        forward: FloatArray = step * np.arange(last + 1, dtype=np.float64)
        ahead, end = self._traced(pack(starts, directions, jacobi=True), forward, step)
        _open(ahead, openings)
        if not before:
            # never read, but polynomials of the first steps pass there
            return np.concatenate([np.repeat(ahead[:, :1, :8], GUARD, axis=1), ahead[..., :8]], axis=1), end
        some = forward[: GUARD + 1]
        back, _ = self._traced(pack(starts, -directions, jacobi=True), some, step)
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
        long: int = 0,
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
        long : int
            0 for all quantities; else steps are so many times as long, and integrals along the ray are left out.
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
        whole, step = long == 0, max(1, long) * self.step
        scale = size(self.body)
        latest, ends_of = np.zeros(rays), np.full(rays, np.inf)
        np.maximum.at(latest, owner, times)
        # those of like length together: all rays of a call are traced to the latest time
        order = np.argsort(latest, kind="stable")
        rank = np.empty(rays, dtype=np.int64)
        rank[order] = np.arange(rays)
        place = np.argsort(rank[owner], kind="stable")
        together = TOGETHER_ON_PIECES if is_creased(self.body) else TOGETHER
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
                    directions[mine], starts[mine], opened[mine], float(np.max(latest[mine])) + 2 * step, step, before
                )
                if whole and hasattr(self.body, "non_smooth"):
                    ahead = states[:, GUARD:, X]
                    rough = non_smooth_from(self.body, ahead, step * np.arange(ahead.shape[1], dtype=float))
                    ends_of[mine] = np.minimum(ends_of[mine], rough)
                seen = np.zeros((0, 3)) if observers is None else observers[rows]
                if cross:
                    to_crossing(*evaluator, self._rule[0], states, step, which, seen, now)
                out = (
                    np.zeros((len(rows), LANES)),
                    np.zeros((len(rows), START_LANES)),
                    np.zeros(len(rows), dtype=bool),
                    np.zeros(len(rows), dtype=bool),
                )
                joints = is_creased(self.body)
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

    def _traced(self, states: FloatArray, times: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
        """Rays by equal steps, beyond an edge or tip as if their piece went on, for the polynomials' sake; and ends."""
        if is_creased(self.body):
            found = trace_pieces(self.body, states, times, rtol=0.0, step=step, beyond=(GUARD + 2) * step)
            return found.states, found.end
        return trace_states(self.body, states, times, rtol=0.0, step=step), np.full(len(states), np.inf)

    def towards(
        self, directions: FloatArray, observers: FloatArray, near: FloatArray, times: FloatArray, cell: FloatArray
    ) -> tuple[SingleRays, IntArray, FloatArray]:
        """Rays with p = r next to given points and times.

        Parameters
        ----------
        directions, observers, near : (n, 3)
            d, r, and points next to the shadow line.
        times : (n,)
        cell : (n, 2), L
            Distances of neighbouring rays and samples: a search that leaves its neighbourhood is given up.

        Returns
        -------
        SingleRays (m,)
            Those that were found.
        found, moved : (m,)
            Their rows, and how far along the line they start from where the search began, in cells.
        """
        quick, *slower = LONG_ON_PIECES if is_creased(self.body) else (LONG, 1)
        found, result, moved, hopeless = self._sought(directions, observers, near, times, cell, quick, NEARLY)
        missing = np.setdiff1d(np.flatnonzero(~hopeless), found)
        for long in slower:
            if not len(missing):
                break
            # those that the quick search gave up, or ended too early
            again, more, further, _ = self._sought(
                directions[missing], observers[missing], near[missing], times[missing], cell[missing], long, 0.0
            )
            result = SingleRays.joined([result, more])
            found, moved = np.concatenate([found, missing[again]]), np.concatenate([moved, further])
            order = np.argsort(found)
            found, moved, result = found[order], moved[order], result[order]
            missing = np.setdiff1d(missing, found)
        return result, found, moved

    def _sought(
        self,
        directions: FloatArray,
        observers: FloatArray,
        near: FloatArray,
        times: FloatArray,
        cell: FloatArray,
        long: int,
        nearly: float,
    ) -> tuple[IntArray, SingleRays, FloatArray, BoolArray]:
        """What `towards` finds with steps of so many, without another look after one from a residual of ``nearly``.

        And the searches (n,) on a body with creases that are not worth another with shorter steps.
        """
        starts, tangents = self.onto_line(near, directions)
        times, begin = times.copy(), times
        moved = np.zeros(len(times))
        lanes, first = np.empty((len(times), LANES)), np.empty((len(times), START_LANES))
        active, wanted = np.arange(len(times)), np.zeros(len(times), dtype=bool)
        far = FAR_ON_PIECES if is_creased(self.body) else FAR
        slow, before = np.zeros(len(times), dtype=bool), np.full(len(times), np.inf)
        for _ in range(ROUNDS):
            rows = directions[active], starts[active], tangents[active], times[active]
            now = self.at(*rows, long=long).rays
            lanes[active], first[active] = now.lanes, now.starts
            residual = _apart(now, observers[active])
            wanted[active] = residual <= max(CLOSE, nearly)
            if is_creased(self.body):
                slow[active] = ~(residual <= SLOW * before[active])
                before[active] = np.fmin(residual, before[active])
            missing = (np.abs(moved[active]) > far) | (np.abs(times[active] - begin[active]) > far * cell[active, 1])
            missing |= slow[active]
            last = active[(residual > CLOSE) & ~missing]
            if not len(last):
                break
            along_line, later = self._newton(directions, observers, tangents, lanes, first, cell, last)
            moved[last] += along_line / cell[last, 0]
            times[last] = np.clip(times[last] + later, 0.0, self.length)
            guess = starts[last] + along_line[:, None] * tangents[last]
            starts[last], tangents[last] = self.onto_line(guess, directions[last], 2)
            active = last[~wanted[last]]
            if not len(active):
                break
        within = (np.abs(moved) <= far) & (np.abs(times - begin) <= far * cell[:, 1])
        kept = np.flatnonzero(wanted & within)
        found = self.at(directions[kept], starts[kept], tangents[kept], times[kept], observers=observers[kept])
        good = _apart(found.rays, observers[kept]) < ACCEPTED
        hopeless = (slow | ~within) & (before > HOPE) & is_creased(self.body)
        return kept[good], found[good], moved[kept[good]], hopeless

    def _newton(
        self,
        directions: FloatArray,
        observers: FloatArray,
        tangents: FloatArray,
        lanes: FloatArray,
        first: FloatArray,
        cell: FloatArray,
        active: IntArray,
    ) -> tuple[FloatArray, FloatArray]:
        """Steps along the line and along the ray for the active rows, no longer than a cell."""
        x, p, J, rate, kappa = (lanes[active, part] for part in (slice(0, 3), slice(3, 6), 6, 7, 9))
        gap = observers[active] - p / np.linalg.norm(p, axis=1, keepdims=True)
        gradient = self.body.gradient(x)
        g = np.linalg.norm(gradient, axis=1)
        n = gradient / g[:, None]
        b = np.cross(n, p)
        torsion = np.einsum("ni,nij,nj->n", b, self.body.hessian(x), p) / g
        facing = np.sum(np.cross(first[active, 6:9], directions[active]) * tangents[active], axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            along_line = np.nan_to_num(np.sum(b * gap, axis=1) / rate / facing)
            along_line = np.clip(along_line, -cell[active, 0], cell[active, 0])
            later = -(np.sum(n * gap, axis=1) + torsion * J * along_line * facing) / kappa
        return along_line, np.clip(np.nan_to_num(later), -cell[active, 1], cell[active, 1])

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


def _apart(rays: RayPoints, observers: FloatArray) -> FloatArray:
    """|r - p| (n,)."""
    p = rays.directions / np.linalg.norm(rays.directions, axis=1, keepdims=True)
    return np.asarray(np.linalg.norm(observers - p, axis=1))


def same_within(rays: RayPoints, cell: FloatArray) -> FloatArray:
    """Distance of launch points, L, and difference of times below which two rays found (n,) are one: (n, 2).

    ``cell`` (n, 2) is that of the fan in which each was sought. What is left of r - p, up to ACCEPTED, is a step of J'
    across the rays and of κₙ along them: far on flat ground.
    """
    turn = np.stack([np.abs(rays.spreading_rate), np.abs(rays.curvature[1])], axis=1)
    with np.errstate(divide="ignore"):
        left = 2 * ACCEPTED / turn
    return np.asarray(np.clip(left, ALIKE[0] * cell, ALIKE[1] * cell))
