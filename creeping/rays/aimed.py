"""Creeping rays that leave towards given directions r, sought next to given points of a shadow line.

They are found by Newton's method on p(σ, s) = r, with p and b = n x p at the end,

    b.(r - p) = J' dσ⊥,   n.(r - p) = -κₙ (dt + d.T dσ) - τ J dσ⊥,   τ = b.Hp/|grad F|,

dσ along the line, whose tangent T need not be across d, and dσ⊥ = b0.T dσ. On a body with creases nothing but the ends
of rays is traced on the way.

Sources: Derivations, R12.
"""

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.geodesics.states import P, X
from creeping.geometry.curvature import bending, second_form
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.surface import normal, size
from creeping.rays.quantities import STRAIGHT, RayPoints
from creeping.rays.tracer import RayTracer, SingleRays

CLOSE = 1e-6
"""Residual at which the search for a ray ends, radians: its phase is stationary there, and errs by the square."""
ACCEPTED = 1e-4
"""Residual of what was found, on exact rays: its phase errs by half the square of it, in radii of curvature."""
ALIKE = (1e-2, 1e-1)
"""Distances, in cells, between which lies the one below which two rays that searches found are one."""
ROUNDS = 10
FAR, FAR_ON_PIECES = 3.0, 1.5
"""Cells by which a search may move before it is given up, as most of those on bodies with creases are."""
STEP, STEP_ON_PIECES = 8.0, 2.0
"""First step of Newton's method, in cells, from which on nothing is a cell away."""
SLOW, LEAST_CELL = 0.95, 0.008
"""On bodies with creases, the residual's share to which each round has to bring it down, and the body sizes as cells of
which those of dense fans count: what is near does not hang on the number of rays."""
NEARLY = 2e-4
"""Residual from which a step is taken to end the search, which converges by squares; what it finds is looked at."""
MORE, HOPE = 3, 0.25
"""Rounds more on bodies with creases, and residuals up to which they are taken."""


def rays_towards(
    tracer: RayTracer,
    directions: FloatArray,
    observers: FloatArray,
    near: FloatArray,
    times: FloatArray,
    cell: FloatArray,
) -> tuple[SingleRays, IntArray, FloatArray]:
    """Rays with p = r next to given points and times.

    Parameters
    ----------
    tracer : RayTracer
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
    search = _Search(tracer, directions, observers, near, times, cell)
    rays, found = search.result()
    return rays, found, search.moved[found]


class _Search:
    """What `rays_towards` finds.

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
        self.wide = np.maximum(cell, LEAST_CELL * size(tracer.body)) if self.piecewise else cell
        self.far = FAR_ON_PIECES if self.piecewise else FAR
        idle, best = np.zeros(n, dtype=bool), np.full(n, np.inf)
        active, self.wanted = np.arange(n), np.zeros(n, dtype=bool)
        for number in range(ROUNDS):
            residual, crossed = self._off(active), self._crossed(active)
            self.wanted[active] = residual <= NEARLY
            # curvature jumps at a joint: the first step across it may go too far
            idle[active] = self.piecewise & (residual > SLOW * best[active]) & ~crossed
            best[active] = np.fmin(residual, best[active])
            last = active[(residual > CLOSE) & self._within(active) & ~idle[active]]
            if not len(last):
                break
            step = self._step(last)
            if number == 0:
                idle[last] = step > (STEP_ON_PIECES if self.piecewise else STEP)
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
        for _ in range(MORE):
            beside = np.flatnonzero((off >= ACCEPTED) & (off < HOPE))
            if not len(beside):
                break
            self._step(some[beside])
            now = self._off(some[beside])
            # those that come no nearer are given up
            off[beside] = np.where(now < SLOW * off[beside], now, np.inf)
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
    across the rays and of κₙ along them: far on a flat surface.
    """
    turn = np.stack([np.abs(rays.spreading_rate), np.abs(rays.curvature[1])], axis=1)
    with np.errstate(divide="ignore"):
        left = 2 * ACCEPTED / turn
    return np.asarray(np.clip(left, ALIKE[0] * cell, ALIKE[1] * cell))
