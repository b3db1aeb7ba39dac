"""Creeping rays traced for what a field needs to know of them: of a fan, or near given points of a shadow line.

    F(x0) = 0,  grad F(x0).d = 0;   dσ⊥ = b0.dx0,  b0 = n0 x d;   J(0) = 1,  J'(0) = 1/R

Rays are known at equal steps, in which the most curved part of the body turns them by TURN. On a smooth body these are
the steps of the integration: what comes out of one ray does not depend on the others that are traced with it. On one
with creases, where curvatures grow like 1/r at a tip, steps are as short as RTOL demands.

R is the distance from a point source, inf of a plane wave.

Sources: Derivations, R4, R12 and R19.
"""

from dataclasses import dataclass

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.geodesics.equations import sharpest_curvature
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.pieces import trace_pieces, trace_to
from creeping.geodesics.states import M11, M12, M21, M22, P, X, pack
from creeping.geometry.evaluators import evaluators, speed_of
from creeping.geometry.patches import Rows
from creeping.geometry.piecewise import is_piecewise, piece_ahead, pieces_of
from creeping.geometry.surface import Surface, size
from creeping.rays.ends import non_smooth_from
from creeping.rays.quantities import GAUSS, GUARD, LANES, START_LANES, RayPoints
from creeping.shadow.curves import moved_onto_lines

TURN = 0.12
"""Largest angle by which a ray turns in one step: polynomials of degree 9 then err by about 1e-9."""
RTOL = 1e-10
"""Relative tolerance of rays on bodies with creases."""
TOGETHER, TOGETHER_ON_PIECES = 192, 2048
"""Rays traced in one call, and on a body with creases, where a call has more to do beside them."""


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
        together = TOGETHER_ON_PIECES if is_piecewise(self.body) else TOGETHER
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

    def _traced(self, states: FloatArray, times: FloatArray, step: float) -> tuple[FloatArray, FloatArray]:
        """Rays at equal steps, beyond an edge or tip as if their piece went on, for the polynomials' sake; and ends."""
        if is_piecewise(self.body):
            found = trace_pieces(self.body, states, times, rtol=RTOL, beyond=(GUARD + 2) * step)
            return found.states, found.end
        return trace_states(self.body, states, times, rtol=0.0, step=step), np.full(len(states), np.inf)

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
