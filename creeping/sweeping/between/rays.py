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

from creeping._typing import FloatArray, IntArray
from creeping.geodesics.states import ATTENUATION, P, X, pack, whole_lanes
from creeping.geometry.surface import size
from creeping.kernels.threads import CHUNK
from creeping.phaseflow.phase_map import PhaseMap
from creeping.rays.fan import ray_arrays
from creeping.rays.transport import Flow
from creeping.shadow.attachment import LaunchPoints
from creeping.shadow.panels import onto_line
from creeping.shadow.status import ATTACHED, FOLLOWED, OK
from creeping.sweeping.between.fans import ARCLENGTH, END, PHASE, POINTS, START, Fans, steps_of
from creeping.sweeping.between.levels import Between, by_cell
from creeping.sweeping.between.stencil import combined, corner_weights, corners, weights
from creeping.sweeping.request import CURVED, LINE, SHARES, SweepRequest
from creeping.sweeping.sweeper import Arrays

TESTS = (0.2, 0.5, 0.8)
"""Places in a cell at which its rays are judged."""
MOST_BYTES = 30_000_000
"""Lanes of fans that are kept from one call to the next."""
SOME = 0.5
"""Largest share of an incidence's rays that are carried by themselves."""


class RaysBetween(Between):
    """Rays of incidences; see `Between`."""

    def __init__(self, flow: Flow, request: SweepRequest) -> None:
        super().__init__(flow, request)
        self._fans = Fans(flow, request, self._lattice)
        # a cell is judged by itself, whatever incidences it holds
        tests = np.stack(np.meshgrid(*[TESTS] * self._lattice.dimensions, indexing="ij"), axis=-1)
        self._tests = weights(tests.reshape(-1, self._lattice.dimensions))

    def _begin(self) -> None:
        if self._fans.lanes.nbytes > MOST_BYTES:
            self._fans = Fans(self.flow, self.request, self._lattice)

    def _level(self, level: int, incidences: FloatArray, rows: IntArray, out: Arrays) -> IntArray:
        fans = self._fans
        own, _, members, places = by_cell(self._lattice, level, incidences[rows])
        six, near = weights(places)[0], corner_weights(places)
        # finer cells have about half as many such rays, and cost a fan each
        allowed = min(SOME, 2.0 / self._lattice.crowded(level))
        passed, again = np.zeros(len(rows), dtype=bool), []
        for stencil, mine in zip(fans.stencils(level, own), members, strict=True):
            if stencil is None:
                continue
            error = self._error(fans, stencil)
            there = fans.results["curve_index"][stencil[0]] >= 0
            unsure = there & ~((error <= self._accuracy) & fans.alike(stencil))
            if np.count_nonzero(unsure) > allowed * np.count_nonzero(there):
                continue
            passed[mine] = True
            lanes = combined(six[mine], fans.lanes[stencil])
            self._lines(fans, stencil, six[mine], near[mine], rows[mine], out)
            self._rays(fans, stencil, lanes, np.where(there & ~unsure, error, 0.0), rows[mine], out)
            ray = np.flatnonzero(unsure)
            again.append(
                (np.repeat(rows[mine], len(ray)), np.tile(ray, len(mine)), lanes[:, ray, START].reshape(-1, 3))
            )
        if again:
            row, ray, starts = (np.concatenate(kind) for kind in zip(*again, strict=True))
            self._carry(incidences, row, ray, starts, out)
        return rows[~passed]

    def _error(self, fans: Fans, stencil: IntArray) -> FloatArray:
        """Largest error of the lanes of each ray anywhere in a cell (rays,)."""
        six, errors = self._tests
        lanes = fans.lanes[stencil].reshape(len(stencil), -1)
        off = np.max([np.abs(w @ lanes) for w in errors], axis=0).reshape(len(six), *fans.lanes.shape[1:]) * fans.scales
        found = (six @ lanes).reshape(off.shape)[..., fans.relative]
        off[..., fans.relative] /= 1 + np.abs(found * fans.scales[fans.relative])
        return np.asarray(off.max(axis=(0, 2)))

    def _lines(
        self, fans: Fans, stencil: IntArray, six: FloatArray, near: FloatArray, rows: IntArray, out: Arrays
    ) -> None:
        """Results of the lines."""
        inside = stencil[corners(self._lattice.dimensions)]
        known = {name: fans.results[name][inside] for name in (*LINE, *CURVED)}
        out["incidence_status"][rows] = FOLLOWED if np.any(known["incidence_status"] == FOLLOWED) else OK
        out["curves"][rows], out["line_length"][rows] = (
            known["curves"][0],
            combined(six, fans.results["line_length"][stencil]),
        )
        out["line_error"][rows] = known["line_error"].max()
        out["singular_distance"][rows] = known["singular_distance"].min()
        for name in SHARES:
            out[name][rows] = combined(near, known[name])
        for name, worst in zip(CURVED, (np.min, np.max), strict=True):
            out[name][rows] = worst(known[name])
        out["interpolated"][rows] = True

    def _rays(
        self, fans: Fans, stencil: IntArray, lanes: FloatArray, error: FloatArray, rows: IntArray, out: Arrays
    ) -> None:
        """Results of interpolated rays."""
        for name in ("ray_status", "curve_index"):
            out[name][rows] = fans.results[name][stencil[0]]
        ends = fans.results["detachment"][stencil[0]]
        out["detachment"][rows] = np.where(np.isinf(ends), ends, lanes[..., END])
        out["arclength"][rows], out["launch_phase"][rows] = lanes[..., ARCLENGTH], lanes[..., PHASE]
        for name, values in zip(POINTS, steps_of(lanes, self.request.n_steps), strict=True):
            out[name][rows] = values
        out["interpolation_error"][rows] = error

    def _carry(self, incidences: FloatArray, rows: IntArray, ray: IntArray, starts: FloatArray, out: Arrays) -> None:
        """Results of rays (n,) that are carried from their interpolated launch points (n, 3)."""
        if not len(rows):
            return
        body, times, directions = self.body, self.request.travel_times, incidences[rows]
        points = onto_line(body, directions, starts, reach=0.1 * size(body), iterations=6)[:, None]
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
