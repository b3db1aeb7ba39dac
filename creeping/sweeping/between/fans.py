"""Fans at the nodes of a lattice, whose rays are told by their launch points.

On a line that is one whole curve launch points are those next to the reference's, the line at the middle of a block of
cells; else those that the line has by itself, if all of its arcs have ends. From the reference's wave to the node's the
points go by way of WAYS - 1 waves between, each as near to the one before as the next.

Arrays that grow row by row.

Rays of incidences from those of the nodes of a lattice.

    y(d) = sum_j w_j(d) y(d_j),   y = x0 and x, p, J, J', A at the outputs, s1, of one ray

Rays of neighbouring incidences are told by their launch points. On an arc of the line with two ends they are those of
the same place on the arc. On a line that is one whole curve they are the points next to those of the reference, a node
for each block of cells, by steps of least norm onto the line of d: a smooth function of d on the block. A cell serves
its incidences if few of their rays err by more than asked for; these are launched from their interpolated points and
carried. What no level serves is computed.

Sources: Derivations, F23.
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.geodesics.states import ATTENUATION, P, X, pack, whole_lanes
from creeping.geometry.surface import size
from creeping.kernels.threads import CHUNK
from creeping.phaseflow.phase_map import PhaseMap
from creeping.rays.fan import ray_arrays
from creeping.rays.transport import Flow
from creeping.shadow.attachment import LaunchPoints
from creeping.shadow.many import ShadowLines, moved_onto_lines, shadow_lines
from creeping.shadow.status import ATTACHED, FOLLOWED, NO_RAY, OK
from creeping.sweeping.between.stencil import Between, around, by_cell, corner_weights, corners, lines, totals, weights
from creeping.sweeping.lattice import FINER, Lattice
from creeping.sweeping.request import CURVED, LINE, SHARES, SweepRequest
from creeping.sweeping.sweeper import Arrays, fill_lines, fill_rays

SPANS = (16, 4, 1)
"""Cells of the coarsest level along a block, the first a radian: the first whose reference serves, or the first."""
WAYS, STEPS = 3, 6
"""Waves on the way from the reference to a node, and Newton steps onto the line of each."""
FAR, SETTLED = 1.0, 1e-10
"""Distance, in body sizes, that launch points may be moved from the reference, and of the next step where they are."""
START, ARCLENGTH, PHASE, END = "start", "arclength", "launch_phase", "detachment"
POINTS = ("points", "directions", "spreading", "spreading_rate", "attenuation")
NUMBERS = (START, ARCLENGTH, PHASE, END, *POINTS)
"""What is interpolated of a ray: x0, s1, d.x0, the time of detachment, 0 if there is none, and x, p, J, J', A."""
RELATIVE = ("spreading", "spreading_rate")
"""Numbers whose errors are of 1 + their own size."""
WHOLE, UNTOLD = -1, -2
"""How rays are told on lines that are one whole curve, and where they are not."""
KNOWN = ("ray_status", "curve_index", "has_end", *LINE, *CURVED)
"""What is kept of a node beside."""

MOST_BYTES = 120_000_000
"""Fans that are kept from one call to the next."""
SOME, FINER_PAYS = 0.6, 3.0
"""Largest share of an incidence's rays that are carried by themselves, and that over incidences in a finer cell."""


class Judged(NamedTuple):
    """Cells of a level: the nodes of their stencils (n, m), and the largest errors of their rays (n, rays).

    An error is infinite where the ray is not of one status at all nodes, all of them where rays cannot be told.
    """

    stencils: IntArray
    errors: FloatArray


class Fans:
    """Fans at nodes, each computed once for each block, whatever levels it belongs to.

    Parameters
    ----------
    flow : PhaseMap or DirectFlow
    request : SweepRequest
    lattice : Lattice

    Attributes
    ----------
    numbers : Rows
        `NUMBERS` of nodes, (nodes, rays w) with w numbers of each ray.
    known : Rows
        `KNOWN` of nodes.
    """

    def __init__(self, flow: Flow, request: SweepRequest, lattice: Lattice) -> None:
        self._flow, self._request, self._lattice = flow, request, lattice
        self._places: dict[tuple[int, ...], int] = {}
        # of a block the reference's launch points (rays, 3), if its line is one whole curve, and its wave
        self._references: dict[tuple[int, ...], tuple[FloatArray, FloatArray] | None] = {}
        one, rays, steps = request.empty(1), request.n_rays, request.n_steps
        widths = dict.fromkeys(NUMBERS, 1) | dict.fromkeys(POINTS, steps) | {START: 3}
        widths |= {"points": 3 * steps, "directions": 3 * steps}
        self.numbers = Rows({name: np.empty((0, rays * width)) for name, width in widths.items()})
        one["has_end"] = np.zeros((1, rays), dtype=bool)
        self.known = Rows({name: one[name][:0] for name in KNOWN})
        # how rays are told: WHOLE, UNTOLD, or the number of an order of arcs; and what must be alike of a ray
        self._told, self._orders = Rows({"order": np.zeros(0, dtype=np.int64)}), dict[bytes, int]()
        self._codes = Rows({"code": np.zeros((0, rays), dtype=np.int32)})
        length = size(flow.body)
        self._scales = {START: 1 / length, END: 1 / length, "points": 1 / length, "directions": 1.0, "spreading": 1.0}
        self._scales |= {"spreading_rate": length, "attenuation": length ** (-1 / 3)}
        self._lines, self._corners = lines(lattice.dimensions), corners(lattice.dimensions)

    def __len__(self) -> int:
        return len(self._places)

    @property
    def nbytes(self) -> int:
        """Memory that the fans take."""
        return self.numbers.nbytes

    def judged(self, level: int, own: IntArray) -> Judged:
        """Cells of a level, (n, 1 + dimensions) the face and their own number."""
        from creeping.sweeping.kernels.judging import cell_errors

        stencils = self._stencils(level, own)
        errors = np.zeros((len(own), self._request.n_rays))
        orders = self._told["order"][stencils]
        told = np.flatnonzero((orders[:, 0] != UNTOLD) & np.all(orders == orders[:, :1], axis=1))
        some, found, codes = stencils[told], errors[told], self._codes["code"]
        for name, scale in self._scales.items():
            rule = *self._lines, self._corners, scale, name in RELATIVE
            cell_errors(self.numbers[name], some, *rule, found)
        for row, stencil in enumerate(some):
            alike = codes[stencil]
            found[row, np.any(alike != alike[0], axis=0)] = np.inf
        errors[:] = np.inf
        errors[told] = found
        return Judged(stencils, errors)

    def _stencils(self, level: int, own: IntArray) -> IntArray:
        """Nodes (n, m) of the stencils of cells (n, 1 + dimensions)."""
        lattice, finer = self._lattice, FINER ** (self._lattice.levels - 1 - level)
        nodes = around(own)
        numbers = lattice.wrapped(nodes.reshape(-1, own.shape[1]), level)
        blocks = np.repeat(self._blocks(level, own), nodes.shape[1], axis=0)
        keys = np.concatenate([blocks, numbers[:, 1:] * finer], axis=1)
        keys, first, place = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        listed = list(map(tuple, keys.tolist()))
        new = [n for n, key in enumerate(listed) if key not in self._places]
        if new:
            count = len(self._places)
            self._places |= {listed[n]: count + k for k, n in enumerate(new)}
            self._compute(lattice.directions(numbers[first[new]], level), blocks[first[new]])
        fans = np.array([self._places[key] for key in listed], dtype=np.int64)
        return np.asarray(fans[place.reshape(len(own), -1)])

    def _blocks(self, level: int, own: IntArray) -> IntArray:
        """Blocks (n, 2 + dimensions) of cells: their span, face and number."""
        found = np.zeros((len(own), 1 + own.shape[1]), dtype=np.int64)
        left = np.arange(len(own))
        for span in (*SPANS, SPANS[0]):
            number = own[left, 1:] // (span * FINER**level)
            found[left] = np.concatenate([np.full((len(left), 1), span), own[left, :1], number], axis=1)
            left = left[np.array([one is None for one in self._referred(found[left])], dtype=bool)]
        return found

    def _compute(self, directions: FloatArray, blocks: IntArray) -> None:
        """Add nodes of unit directions (n, 3) in blocks (n, 2 + dimensions)."""
        body, request = self._flow.body, self._request
        lines = shadow_lines(body, directions, request.n_rays)
        launch, whole = lines.launch, self._moved(lines, blocks)
        out = request.empty(len(directions))
        fill_lines(lines, out)
        fill_rays(self._flow, lines, request.travel_times, out)
        out["has_end"] = np.isfinite(out[END])
        passed = np.sum(out[END][..., None] > request.travel_times, axis=-1)
        self._codes.add({"code": out["ray_status"].astype(np.int32) * (request.n_steps + 1) + passed})
        has_ends = np.all(np.where(launch.there, launch.closed == 0, True), axis=1) & (lines.status == OK)
        arcs = np.where(launch.there, launch.arc_index, -1.0)
        orders = np.full(len(directions), UNTOLD)
        orders[whole] = WHOLE
        for row in np.flatnonzero(has_ends & ~whole):
            of = b"".join(np.ascontiguousarray(v[row]).tobytes() for v in (out["curves"], out["curve_index"], arcs))
            orders[row] = self._orders.setdefault(of, len(self._orders))
        self._told.add({"order": orders})
        self.known.add({name: out[name] for name in KNOWN})
        # what stands for no ray, or for no end, must not spoil the others
        numbers = {START: launch.points} | {name: out[name] for name in NUMBERS if name != START}
        numbers[END] = np.where(out["has_end"], out[END], 0.0)
        self.numbers.add({name: np.nan_to_num(v.reshape(len(directions), -1)) for name, v in numbers.items()})

    def _moved(self, lines: ShadowLines, blocks: IntArray) -> BoolArray:
        """Put launch points of lines next to those of the references of their blocks, and whether it was so (n,)."""
        body, length, done = self._flow.body, size(self._flow.body), np.zeros(len(blocks), dtype=bool)
        references = self._referred(blocks)
        rows = np.flatnonzero(_is_whole(lines) & np.array([one is not None for one in references], dtype=bool))
        pairs = [one for one in (references[row] for row in rows) if one is not None]
        if not pairs:
            return done
        points, waves = (np.stack(kind) for kind in zip(*pairs, strict=True))
        begun, rays = points.reshape(-1, 3), points.shape[1]
        found, left = begun, np.zeros(len(begun))
        for way in range(1, WAYS + 1):
            between = waves + way / WAYS * (lines.directions[rows] - waves)
            between /= np.linalg.norm(between, axis=1, keepdims=True)
            between = np.repeat(between, rays, axis=0)
            found, _, left = moved_onto_lines(body, between, found, reach=0.2 * length, steps=STEPS)
        near = (left < SETTLED * length) & (np.linalg.norm(found - begun, axis=1) < FAR * length)
        settled = np.all(near.reshape(-1, rays), axis=1)
        rows, points = rows[settled], found.reshape(points.shape)[settled]
        lines.launch.points[rows] = points
        lines.launch.arclength[rows] = _arclengths(points, lines.length[rows])
        done[rows] = True
        return done

    def _referred(self, blocks: IntArray) -> list[tuple[FloatArray, FloatArray] | None]:
        """References of blocks (n, 2 + dimensions)."""
        keys = list(map(tuple, blocks.tolist()))
        new = [key for key in dict.fromkeys(keys) if key not in self._references]
        if new:
            span, face, number = np.split(np.array(new), (1, 2), axis=1)
            waves = self._lattice.directions(np.concatenate([face, number * span + span / 2], axis=1), 0)
            lines = shadow_lines(self._flow.body, waves, self._request.n_rays)
            for key, whole, points, wave in zip(new, _is_whole(lines), lines.launch.points, waves, strict=True):
                self._references[key] = (points, wave) if whole else None
        return [self._references[key] for key in keys]


def _is_whole(lines: ShadowLines) -> BoolArray:
    """Whether a line is one curve that launches rays all along (n,)."""
    launch: LaunchPoints = lines.launch
    closed = np.all(launch.there & (launch.closed == 1), axis=1)
    return np.asarray((lines.curves == 1) & closed & (lines.status == OK))


def _arclengths(points: FloatArray, length: FloatArray) -> FloatArray:
    """Arclengths from the first point of closed curves (n, rays, 3), by chords, of curves so long (n,): (n, rays)."""
    chords = np.linalg.norm(np.roll(points, -1, axis=1) - points, axis=-1)
    along = np.cumsum(chords, axis=1) - chords
    return np.asarray(along * (length / chords.sum(axis=1))[:, None])


class Rows:
    """Arrays of one length whose room doubles when it is spent, so that no row is copied many times.

    Parameters
    ----------
    empty : dict
        Arrays without rows, of the shapes and kinds of those to come.

    Examples
    --------
    >>> rows = Rows({"a": np.zeros((0, 2))})
    >>> for n in range(3):
    ...     rows.add({"a": np.full((1, 2), n)})
    >>> rows["a"][:, 0].tolist()
    [0.0, 1.0, 2.0]
    """

    def __init__(self, empty: Arrays) -> None:
        self._arrays, self._count, self._room = empty, 0, 0

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, name: str) -> np.ndarray[Any, Any]:
        return self._arrays[name][: self._count]

    @property
    def nbytes(self) -> int:
        """Bytes of the rows that there are."""
        return sum(self[name].nbytes for name in self._arrays)

    def add(self, rows: Arrays) -> None:
        """Rows to come after the others."""
        count = self._count + len(next(iter(rows.values())))
        if count > self._room:
            self._room = max(count, 2 * self._room)
            for name, old in self._arrays.items():
                new = np.empty((self._room, *old.shape[1:]), dtype=old.dtype)
                new[: self._count] = old[: self._count]
                self._arrays[name] = new
        for name, values in self._arrays.items():
            values[self._count : count] = rows[name]
        self._count = count


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
