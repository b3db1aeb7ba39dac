"""Fans at the nodes of a lattice, whose rays are told by their launch points.

On a line that is one whole curve launch points are those next to the reference's, the line at the middle of a block of
cells; else those that the line has by itself, if all of its arcs have ends. From the reference's wave to the node's the
points go by way of WAYS - 1 waves between, each as near to the one before as the next.
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.geometry.surface import size
from creeping.rays.transport import Flow
from creeping.shadow.attachment import LaunchPoints
from creeping.shadow.many import ShadowLines, shadow_lines
from creeping.shadow.moving import moved_onto_lines
from creeping.shadow.status import OK
from creeping.sweeping.between.rows import Rows
from creeping.sweeping.between.stencil import around, corners, lines
from creeping.sweeping.lattice import FINER, Lattice
from creeping.sweeping.request import CURVED, LINE, SweepRequest
from creeping.sweeping.sweeper import fill_lines, fill_rays

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
