"""Single creeping rays of many incidences: launched near given points of the shadow line, known at one point each.

    F(x0) = 0,  grad F(x0).d = 0;   dσ⊥ = b0.dx0,  b0 = n0 x d

Rays that leave towards r are found by Newton's method on p(σ, s) = r, with p and b = n x p at the end,

    b.(r - p) = J' dσ⊥,   n.(r - p) = -κₙ ds - τ J dσ⊥,   τ = b.Hp/|grad F|.
"""

from dataclasses import dataclass

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping.geodesics.equations import points_of_charts
from creeping.geodesics.integrator import pack, trace_states
from creeping.geometry.curvature import principal_curvature_bound
from creeping.geometry.surface import size
from creeping.rays.quantities import GAUSS, GUARD, LANES, START_LANES, TURN, RayPoints
from creeping.shadow.panels import newton_step

CLOSE = 1e-6
"""Residual at which the search for a ray ends, radians: its phase is stationary there, and errs by the square."""
ROUNDS = 10
TOGETHER = 192
"""Rays traced in one call."""
LONG = 2
"""Steps of a search, in steps of what it finds: points err less than derivatives of curvature do."""
RTOL, SEARCH_RTOL = 1e-10, 1e-8
"""Tolerance of a step of the tracer, and while a ray is sought."""


@dataclass(frozen=True, eq=False)
class SingleRays:
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
    """

    directions: FloatArray
    starts: FloatArray
    tangents: FloatArray
    rays: RayPoints


class SingleRayTracer:
    """Traces single rays of a body with a compiled level, no longer than ``length``."""

    def __init__(self, body: Any, length: float) -> None:
        from creeping.rays.kernels.quantities import polynomial_matrix

        self.body, self.length = body, length
        curved = principal_curvature_bound(body, points_of_charts(body))
        self.steps = int(np.ceil(length * curved / TURN))
        self.step = length / self.steps
        nodes, weights = np.polynomial.legendre.leggauss(GAUSS)
        self._rule = polynomial_matrix(), 0.5 * (nodes + 1), 0.5 * weights

    def onto_line(self, points: FloatArray, directions: FloatArray, steps: int = 4) -> tuple[FloatArray, FloatArray]:
        """Points of the shadow lines next to the given ones, and T there: (n, 3), (n, 3)."""
        reach = 0.1 * size(self.body)
        tangents = np.zeros_like(points)
        for _ in range(steps):
            step, tangents = newton_step(self.body, directions, points)
            long = np.linalg.norm(step, axis=1, keepdims=True)
            points = points + step * np.minimum(1.0, reach / np.maximum(long, 1e-300))
        return points, tangents

    def _states(
        self, directions: FloatArray, starts: FloatArray, latest: float, step: float, rtol: float, before: bool
    ) -> FloatArray:
        """x, p, J, J' at equal steps, GUARD of them before the launch point and beyond a time: (n, K, 8).

        Those ``before`` are copies of the launch point unless they are wanted.
        """
        last = int(np.ceil(latest / step)) + GUARD + 1
        forward: FloatArray = step * np.arange(last + 1, dtype=np.float64)
        ahead = trace_states(self.body, pack(starts, directions, jacobi=True), forward, rtol=rtol)
        if not before:
            # never read, but polynomials of the first steps pass there
            return np.concatenate([np.repeat(ahead[:, :1, :8], GUARD, axis=1), ahead[..., :8]], axis=1)
        back = trace_states(self.body, pack(starts, -directions, jacobi=True), forward[: GUARD + 1], rtol=rtol)
        states = np.empty((len(starts), last + 1 + GUARD, 8))
        states[:, GUARD:] = ahead[..., :8]
        behind = back[:, GUARD:0:-1]
        states[:, :GUARD, :3], states[:, :GUARD, 3:6] = behind[..., :3], -behind[..., 3:6]
        states[:, :GUARD, 6], states[:, :GUARD, 7] = behind[..., 6], -behind[..., 7]
        return states

    def at(
        self,
        directions: FloatArray,
        starts: FloatArray,
        tangents: FloatArray,
        times: FloatArray,
        *,
        whole: bool = True,
        observers: FloatArray | None = None,
    ) -> SingleRays:
        """Rays from points of the lines to a time each, or with observers (n, 3) to n.r = 0 near it: (n, 3) x 3, (n,).

        Without ``whole`` integrals along the ray are left out.
        """
        from creeping.rays.kernels.quantities import cross, lanes_at

        n = len(starts)
        lanes, first, alive = np.zeros((n, LANES)), np.zeros((n, START_LANES)), np.zeros(n, dtype=bool)
        times = np.array(times)
        step, rtol = (self.step, RTOL) if whole else (LONG * self.step, SEARCH_RTOL)
        level, scale = self.body.compiled, size(self.body)
        evaluator = level.function, level.parameters
        # those of like length together: all rays of a call are traced to the latest time
        order = np.argsort(times, kind="stable")
        for k in range(0, n, TOGETHER):
            rows = order[k : k + TOGETHER]
            ends = times[rows]
            before = whole or float(np.min(ends)) < GUARD * step
            latest = float(np.max(ends)) + 2 * step
            states = self._states(directions[rows], starts[rows], latest, step, rtol, before)
            if observers is not None:
                cross(*evaluator, self._rule[0], states, step, observers[rows], ends)
            found = np.zeros((len(rows), LANES)), np.zeros((len(rows), START_LANES)), np.zeros(len(rows), dtype=bool)
            lanes_at(*evaluator, *self._rule, scale, states, step, ends, whole, *found)
            times[rows] = ends
            lanes[rows], first[rows], alive[rows] = found
        first[:, 0] = np.sum(starts * directions, axis=1)
        first[:, 1] = np.abs(np.sum(np.cross(first[:, 6:9], directions) * tangents, axis=1))
        return SingleRays(directions, starts, tangents, RayPoints(lanes, first, times, alive, size(self.body)))

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
        starts, tangents = self.onto_line(near, directions)
        times, begin = times.copy(), times
        moved, residual = np.zeros(len(times)), np.full(len(times), np.inf)
        lanes, first = np.empty((len(times), LANES)), np.empty((len(times), START_LANES))
        active = np.arange(len(times))
        for _ in range(ROUNDS):
            now = self.at(directions[active], starts[active], tangents[active], times[active], whole=False).rays
            lanes[active], first[active] = now.lanes, now.starts
            p = lanes[active, 3:6] / np.linalg.norm(lanes[active, 3:6], axis=1, keepdims=True)
            residual[active] = np.linalg.norm(observers[active] - p, axis=1)
            lost = (np.abs(moved) > 3) | (np.abs(times - begin) > 3 * cell[:, 1])
            active = np.flatnonzero((residual > CLOSE) & ~lost)
            if not len(active):
                break
            along_line, later = self._newton(directions, observers, tangents, lanes, first, cell, active)
            moved[active] += along_line / cell[active, 0]
            times[active] = np.clip(times[active] + later, 0.0, self.length)
            guess = starts[active] + along_line[:, None] * tangents[active]
            starts[active], tangents[active] = self.onto_line(guess, directions[active], 2)
        good = (residual < 10 * CLOSE) & (np.abs(moved) <= 3) & (np.abs(times - begin) <= 3 * cell[:, 1])
        found = np.flatnonzero(good)
        return self.at(directions[found], starts[found], tangents[found], times[found]), found, moved[found]

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
        self, directions: FloatArray, observers: FloatArray, starts: FloatArray, times: FloatArray
    ) -> SingleRays:
        """Rays from points of the lines to where they cross n.r = 0 next to the times: (n, 3) x 3, (n,)."""
        starts, tangents = self.onto_line(starts, directions)
        return self.at(directions, starts, tangents, times, observers=observers)
