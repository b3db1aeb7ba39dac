"""Rays of incidences from those of the nodes of a lattice.

    y(d) = sum_j w_j(d) y(d_j),   y = x0 and x, p, J, J', A at the outputs, s1, of one ray

Rays of neighbouring incidences are told by their launch points. On an arc of the line with two ends they are those of
the same place on the arc. On a line that is one whole curve they are the points next to those of the reference, a node
for each block of cells, by steps of least norm onto the line of d: a smooth function of d on the block. A cell serves
its incidences if few of their rays err by more than asked for; these are launched from their interpolated points and
carried. What no level serves is computed.

Sources: Derivations, F23.
"""

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping.geodesics.states import ATTENUATION, P, X, pack, whole_lanes
from creeping.geometry.surface import size
from creeping.kernels.threads import CHUNK
from creeping.phaseflow.phase_map import PhaseMap
from creeping.rays.fan import ray_arrays
from creeping.rays.transport import Flow
from creeping.shadow.attachment import LaunchPoints
from creeping.shadow.moving import moved_onto_lines
from creeping.shadow.status import ATTACHED, FOLLOWED, NO_RAY, OK
from creeping.sweeping.between.fans import ARCLENGTH, END, PHASE, POINTS, START, Fans
from creeping.sweeping.between.levels import Between, by_cell
from creeping.sweeping.between.stencil import corner_weights, corners, totals, weights
from creeping.sweeping.request import CURVED, LINE, SHARES, SweepRequest
from creeping.sweeping.sweeper import Arrays

MOST_BYTES = 120_000_000
"""Fans that are kept from one call to the next."""
SOME, FINER_PAYS = 0.6, 3.0
"""Largest share of an incidence's rays that are carried by themselves, and that over incidences in a finer cell."""


class RaysBetween(Between):
    """Rays of incidences; see `Between`."""

    def __init__(self, flow: Flow, request: SweepRequest) -> None:
        super().__init__(flow, request)
        self._fans = Fans(flow, request, self._lattice)

    def _begin(self) -> None:
        if self._fans.nbytes > MOST_BYTES:
            self._fans = Fans(self.flow, self.request, self._lattice)

    def _level(self, level: int, incidences: FloatArray, rows: IntArray, out: Arrays) -> FloatArray:
        fans, lattice = self._fans, self._lattice
        own, _, members, places = by_cell(lattice, level, incidences[rows])
        cells = fans.judged(level, own)
        there = fans.known["curve_index"][cells.stencils[:, 0]] != NO_RAY
        unsure = there & ~(cells.errors <= self._accuracy)
        share = np.count_nonzero(unsure, axis=1) / np.maximum(np.count_nonzero(there, axis=1), 1)
        # finer cells have about half as many such rays, and cost fans of their own
        share[share > min(SOME, FINER_PAYS / lattice.crowded(level + 1))] = 1.0
        good = np.flatnonzero(share < 1)
        left = np.ones(len(rows))
        if not len(good):
            return left
        # the incidences that have passed, those of one cell after those of another
        some = np.concatenate([members[cell] for cell in good])
        first = np.cumsum([0, *(len(members[cell]) for cell in good)])
        of = np.repeat(good, np.diff(first))
        left[some] = share[of]
        target, six, stencils = rows[some], weights(places[some])[0], cells.stencils[good]

        def sums(name: str, found: np.ndarray[Any, Any]) -> None:
            from creeping.sweeping.kernels.judging import cell_sums

            numbers = fans.numbers[name]
            cell_sums(numbers, stencils, first, six, target, found.reshape(len(found), numbers.shape[1]))

        for name in (ARCLENGTH, PHASE, *POINTS):
            sums(name, out[name])
        if np.any(fans.known["has_end"][stencils[:, 0]]):
            sums(END, out[END])
        out["interpolation_error"][target] = np.where(there & ~unsure, cells.errors, 0.0)[of]
        self._rays(cells.stencils[of, 0], target, out)
        self._lines(cells.stencils[of], six, corner_weights(places[some]), target, out)
        row, ray = np.nonzero(unsure[of])
        if len(row):
            starts = np.empty((len(incidences), self.request.n_rays, 3))
            sums(START, starts)
            self._carry(incidences, target[row], ray, starts[target[row], ray], out)
        return left

    def _lines(self, stencils: IntArray, six: FloatArray, near: FloatArray, rows: IntArray, out: Arrays) -> None:
        """Results of the lines of incidences by the nodes of their stencils (n, m)."""
        inside = stencils[:, corners(self._lattice.dimensions)]
        known = {name: self._fans.known[name][inside] for name in (*LINE, *CURVED)}
        out["incidence_status"][rows] = np.where(np.any(known["incidence_status"] == FOLLOWED, axis=1), FOLLOWED, OK)
        out["curves"][rows] = known["curves"][:, 0]
        out["line_length"][rows] = totals(six.T * self._fans.known["line_length"][stencils].T)
        out["line_error"][rows] = known["line_error"].max(axis=1)
        out["singular_distance"][rows] = known["singular_distance"].min(axis=1)
        for name in SHARES:
            out[name][rows] = totals(near.T * known[name].T)
        for name, worst in zip(CURVED, (np.min, np.max), strict=True):
            out[name][rows] = worst(known[name], axis=1)
        out["interpolated"][rows] = True

    def _rays(self, nodes: IntArray, rows: IntArray, out: Arrays) -> None:
        """What rays have of one node of their stencil (n,): codes, and whether they are there and end."""
        known = self._fans.known
        for name in ("ray_status", "curve_index"):
            out[name][rows] = known[name][nodes]
        on = ~known["has_end"][nodes]
        if np.any(on):
            row, ray = np.nonzero(on)
            out[END][rows[row], ray] = np.inf
        none = known["curve_index"][nodes] == NO_RAY
        if np.any(none):
            row, ray = np.nonzero(none)
            for name in (ARCLENGTH, PHASE, END, *POINTS):
                out[name][rows[row], ray] = np.nan

    def _carry(self, incidences: FloatArray, rows: IntArray, ray: IntArray, starts: FloatArray, out: Arrays) -> None:
        """Results of rays (n,) that are carried from their interpolated launch points (n, 3)."""
        body, times, directions = self.body, self.request.travel_times, incidences[rows]
        points = moved_onto_lines(body, directions, starts, reach=0.1 * size(body), steps=6).points[:, None]
        states = self._alone(pack(points, directions, lanes=whole_lanes(body)), rows)[:, None]
        none = np.full((len(rows), 1), np.nan)
        begun = np.full((len(rows), 1), float(ATTACHED))
        launch = LaunchPoints(directions, points, none, np.zeros_like(none, dtype=int), none, none, none, begun)
        found = ray_arrays(body, launch, states, times)
        path = states[..., X], states[..., P], found.spreading, found.spreading_rate, states[..., ATTENUATION]
        for name, values in zip(POINTS, path, strict=True):
            out[name][rows, ray] = values[:, 0]
        out["ray_status"][rows, ray], out["detachment"][rows, ray] = found.status[:, 0], found.detachment[:, 0]
        out["launch_phase"][rows, ray] = launch.phase[:, 0]

    def _alone(self, states: FloatArray, rows: IntArray) -> FloatArray:
        """States (n, lanes) at the outputs (n, steps, lanes), the same in whatever company incidences ``rows`` are."""
        times = self.request.travel_times
        if isinstance(self.flow, PhaseMap) and self.flow.attenuates_at(times):
            return self.flow.transport(states, times)
        # steps of direct integration are those of CHUNK rays together: rays of one incidence, and copies of one of them
        _, first, count = np.unique(rows, return_index=True, return_counts=True)
        order = np.argsort(first)
        first, count = first[order], count[order]
        padded = -(-count // CHUNK) * CHUNK
        begin = np.cumsum(padded) - padded
        own = np.repeat(begin - first, count) + np.arange(len(rows))
        place = np.repeat(first, padded)
        place[own] = np.arange(len(rows))
        return self.flow.transport(states[place], times)[own]
