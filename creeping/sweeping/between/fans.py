"""Fans at the nodes of a lattice, whose rays are told by their launch points.

On a line that is one whole curve launch points are those next to the reference's, the line at the middle of a block of
cells; else those that the line has by itself, if all of its arcs have ends.
"""

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.geometry.surface import size
from creeping.rays.transport import Flow
from creeping.shadow.attachment import LaunchPoints
from creeping.shadow.many import ShadowLines, shadow_lines
from creeping.shadow.panels import newton_step, onto_line
from creeping.shadow.status import OK
from creeping.sweeping.between.stencil import around
from creeping.sweeping.lattice import FINER, Lattice
from creeping.sweeping.request import SweepRequest
from creeping.sweeping.sweeper import Arrays, fill_lines, fill_rays

SPAN = 16
"""Cells of the coarsest level along a block: a radian."""
FAR, SETTLED = 1.0, 1e-10
"""Distance, in body sizes, that launch points may be moved from the reference, and of the next step where they are."""
START, ARCLENGTH, PHASE, END, STEPS = slice(0, 3), 3, 4, 5, 6
"""Lanes of a ray: x0, arclength, d.x0, time of detachment (0 if there is none), and for each output x, p, J, J', A."""
POINTS = ("points", "directions", "spreading", "spreading_rate", "attenuation")


class Fans:
    """Fans at nodes, each computed once for each block, whatever levels it belongs to.

    Parameters
    ----------
    flow : PhaseMap or DirectFlow
    request : SweepRequest
    lattice : Lattice

    Attributes
    ----------
    results : dict
        Arrays of results as of a sweep, the first axis the node.
    lanes : (nodes, rays, lanes)
    scales : (lanes,)
        Factors that make errors of lanes numbers without unit, 0 of what is not judged.
    relative : (lanes,) of bool
        Lanes whose errors are of 1 + their own size: J and J'.
    """

    def __init__(self, flow: Flow, request: SweepRequest, lattice: Lattice) -> None:
        self._flow, self._request, self._lattice = flow, request, lattice
        self._known: dict[tuple[int, ...], int] = {}
        self.results: Arrays = request.empty(0)
        lanes = STEPS + 9 * request.n_steps
        self.lanes = np.zeros((0, request.n_rays, lanes))
        # whether rays are told by their places on arcs, or next to a reference
        self._open, self._whole = np.zeros(0, dtype=bool), np.zeros(0, dtype=bool)
        self._arcs = np.zeros((0, request.n_rays))
        length = size(flow.body)
        step = [*[1 / length] * 3, 1, 1, 1, 1, length, length ** (-1 / 3)]
        self.scales = np.array([*[1 / length] * 3, 0, 0, 1 / length, *np.tile(step, request.n_steps)])
        judged = np.array([False] * 6 + [True, True, False])
        self.relative = np.concatenate([np.zeros(STEPS, dtype=bool), np.tile(judged, request.n_steps)])

    def __len__(self) -> int:
        return len(self._known)

    def stencils(self, level: int, own: IntArray) -> list[IntArray | None]:
        """Nodes of each cell, (n, 1 + dimensions) the face and its own number; None where rays cannot be told."""
        lattice, finer = self._lattice, FINER ** (self._lattice.levels - 1 - level)
        nodes = around(own)
        numbers = lattice.wrapped(nodes.reshape(-1, own.shape[1]), level)
        block = np.repeat(own[:, 1:] // (SPAN * FINER**level), nodes.shape[1], axis=0)
        keys = np.concatenate([block, numbers[:, :1], numbers[:, 1:] * finer], axis=1)
        keys, first, place = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        new = [n for n, key in enumerate(map(tuple, keys.tolist())) if key not in self._known]
        if new:
            count = len(self._known)
            self._known |= {tuple(keys[n].tolist()): count + k for k, n in enumerate(new)}
            self._compute(lattice.directions(numbers[first[new]], level), keys[new][:, : own.shape[1]])
        fans = np.array([self._known[tuple(key)] for key in keys.tolist()], dtype=np.int64)
        return [self._served(stencil) for stencil in fans[place.reshape(len(own), -1)]]

    def alike(self, stencil: IntArray) -> BoolArray:
        """Whether a ray is of one status at all nodes, and detached at the same outputs (rays,)."""
        status, ends = self.results["ray_status"][stencil], self.results["detachment"][stencil]
        before = ends[..., None] > self._request.travel_times
        return np.asarray(np.all(status == status[0], axis=0) & np.all(before == before[0], axis=(0, 2)))

    def _served(self, stencil: IntArray) -> IntArray | None:
        if self._whole[stencil].all():
            return stencil
        places = self.results["curve_index"][stencil], self._arcs[stencil], self.results["curves"][stencil]
        same = all(np.array_equal(one, np.broadcast_to(one[0], one.shape), equal_nan=True) for one in places)
        return stencil if same and self._open[stencil].all() else None

    def _compute(self, directions: FloatArray, blocks: IntArray) -> None:
        """Add nodes of unit directions (n, 3) in blocks (n, dimensions + face)."""
        body, request = self._flow.body, self._request
        lines = shadow_lines(body, directions, request.n_rays)
        own, of = np.unique(blocks, axis=0, return_inverse=True)
        middle = own[:, [own.shape[1] - 1, *range(own.shape[1] - 1)]]
        middle[:, 1:] = middle[:, 1:] * SPAN + SPAN // 2
        references = shadow_lines(body, self._lattice.directions(middle, 0), request.n_rays)
        moved = np.flatnonzero(_is_whole(lines) & _is_whole(references)[of.reshape(-1)])
        from_ = references.launch.points[of.reshape(-1)[moved]]
        points, settled = self._moved(from_, directions[moved])
        moved, points = moved[settled], points[settled]
        lines.launch.points[moved] = points
        lines.launch.arclength[moved] = _arclengths(points, lines.length[moved])
        out = request.empty(len(directions))
        fill_lines(lines, out)
        fill_rays(self._flow, lines, request.travel_times, out)
        whole, launch = np.zeros(len(directions), dtype=bool), lines.launch
        whole[moved] = True
        has_ends = np.all(np.where(launch.there, launch.closed == 0, True), axis=1) & (lines.status == OK)
        ends = np.where(np.isinf(out["detachment"]), 0.0, out["detachment"])
        each = [launch.points, *(v[..., None] for v in (out["arclength"], out["launch_phase"], ends))]
        steps = [v if v.ndim == 4 else v[..., None] for v in (out[name] for name in POINTS)]
        each.append(np.concatenate(steps, axis=-1).reshape(*launch.there.shape, -1))
        # what stands for no ray must not spoil the others
        self.lanes = np.concatenate([self.lanes, np.nan_to_num(np.concatenate(each, axis=-1))])
        self.results = {name: np.concatenate([values, out[name]]) for name, values in self.results.items()}
        self._open, self._whole = np.concatenate([self._open, has_ends]), np.concatenate([self._whole, whole])
        self._arcs = np.concatenate([self._arcs, np.where(launch.there, launch.arc_index, -1.0)])

    def _moved(self, points: FloatArray, directions: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Launch points (n, rays, 3) moved onto the lines of directions (n, 3), and whether all of a line are there."""
        body, length = self._flow.body, size(self._flow.body)
        d = np.repeat(directions, points.shape[1], axis=0)
        found = onto_line(body, d, points.reshape(-1, 3), reach=0.2 * length, iterations=6)
        step, _ = newton_step(body, d, found)
        found, far = found.reshape(points.shape), np.linalg.norm(found.reshape(points.shape) - points, axis=-1)
        near = (np.linalg.norm(step, axis=1).reshape(far.shape) < SETTLED * length) & (far < FAR * length)
        return found, np.all(near, axis=1)


def steps_of(lanes: FloatArray, n_steps: int) -> tuple[FloatArray, ...]:
    """x, p, J, J' and A of lanes (..., lanes) at each output, as `POINTS` names them."""
    path = lanes[..., STEPS:].reshape(*lanes.shape[:-1], n_steps, 9)
    return path[..., :3], path[..., 3:6], path[..., 6], path[..., 7], path[..., 8]


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
