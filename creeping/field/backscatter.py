"""Geometry of the field in the direction the wave came from, r = -d, for many incidences at once.

What `creeping.field.far_geometry.FarGeometry` knows of one incidence and many observers, this knows of many incidences
with one observer each, so that both are assembled by the same formulas. The fan, carried in long steps, tells where to
look; rays that matter are traced again, exactly.
"""

from functools import cached_property

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.field.far_geometry import ALONG, EARLY, Geometry
from creeping.field.forward import TAPER
from creeping.geodesics.equations import natural_horizon
from creeping.geometry.surface import size
from creeping.rays.observer_contour import HorizonRays
from creeping.rays.quantities import TURN
from creeping.rays.shedding import ShedRays
from creeping.rays.single import SingleRayTracer
from creeping.rays.specular import SpecularPoints, specular_points
from creeping.rays.transport import Flow, carried
from creeping.shadow.many import ShadowLines, prepared

ALIKE = 1e-2
"""Distance, in cells, below which two rays found are one: searches end within 1e-4 or so of each other."""
APART = 2.0
"""Spacing of the nodes of a fan integral, in 1/k: a periodic integrand sampled so errs by less than 1e-6 of itself."""
LONGEST_TIE = 12
"""Solutions of one incidence that may end at equal times: mirror images of each other, and what was found twice."""


class BackscatterGeometry(Geometry):
    """Rays shed back, specular points, and nodes of the fan integral; see `creeping.field.far_geometry.Geometry`.

    Parameters
    ----------
    flow : PhaseMap or DirectFlow
        Of a plain body with a compiled level.
    lines : ShadowLines
        Incidences (n), none of them singular.
    tracer : SingleRayTracer
        Its length is that of the rays.
    highest : float, 1/L
        Wavenumber that nodes of the fan integral are to serve.
    """

    def __init__(self, flow: Flow, lines: ShadowLines, tracer: SingleRayTracer, highest: float) -> None:
        self.flow, self.body, self.lines, self.tracer = flow, flow.body, lines, tracer
        self.direction, self.directions = lines.directions, -lines.directions
        self.highest = highest
        self._nodes: HorizonRays | None = None
        self._seek()

    @property
    def angle(self) -> FloatArray:
        """Angle from d (n,)."""
        return np.full(len(self.directions), np.pi)

    def _seek(self) -> None:
        """Carry the fans, and find cells and crossings."""
        from creeping.rays.kernels.shed_search import PARTS, quintic_weights, seek_all

        lines, level = self.lines, self.body.compiled  # type: ignore[attr-defined]
        n, rays = lines.arc_index.shape
        times = coarse_times(self.flow, self.tracer.length)
        states = carried(self.flow, lines, times, lanes=10)
        self._summary = np.empty((n, 2))
        # a ray crosses about once in every half turn; at worst each sample is a cell and a crossing
        cells, crossings, most = 64, 2 + int(self.tracer.steps * TURN / np.pi), len(times) * PARTS
        while True:
            found, places = np.empty((cells * n, 4), np.int64), np.empty((cells * n, 2))
            crossed = np.empty((crossings * rays * n, 4))
            a, b = seek_all(
                level.function, level.parameters, times[1], quintic_weights(times[1]), states,
                lines.arc_index, lines.closed, self.directions, EARLY * size(self.body), ALONG,
                cells * n, crossings * rays, found, places, crossed, self._summary,
            )  # fmt: skip
            if a >= 0:
                break
            cells, crossings = min(8 * cells, most * rays), min(2 * crossings, most)
        self._found, self._places, self._crossed = found[:a], places[:a], crossed[:b]
        self._fine = times[:-1, None] + np.diff(times)[:, None] * (np.arange(PARTS) / PARTS)

    @property
    def mean_root_radius(self) -> FloatArray:
        """Mean of ρ^(1/3) over the launch points (n,)."""
        return self._summary[:, 1]

    @property
    def least_merging(self) -> FloatArray:
        """Least χ over horizon crossings with p.r > 0.9 (n,); 0 without any."""
        return self._summary[:, 0]

    @cached_property
    def shed(self) -> ShedRays:
        """Rays with p = -d."""
        row, ray, after, sample = self._found.T
        lines = self.lines
        across, along = self._places[:, :1], self._places[:, 1]
        near = (1 - across) * lines.launch_points[row, ray] + across * lines.launch_points[row, after]
        fine = np.append(self._fine.ravel(), self.tracer.length)
        long = fine[sample + 1] - fine[sample]
        cell = np.stack([lines.spacing[row, ray], long], axis=1)
        begin = fine[sample] + along * long
        one, found, moved = self.tracer.towards(self.direction[row], self.directions[row], near, begin, cell)
        row, ray, cell, across = row[found], ray[found], cell[found], across[found, 0]
        arc = lines.arc_index
        same = arc[row] == arc[row, ray][:, None]
        first, last = np.argmax(same, axis=1), same.shape[1] - 1 - np.argmax(same[:, ::-1], axis=1)
        place = ray + across + moved
        inside = (lines.closed[row, ray] == 1) | ((place >= first - 0.5) & (place <= last + 0.5))
        kept = np.flatnonzero(inside)
        kept = kept[_distinct(row[kept], one.starts[kept], one.rays.time[kept], cell[kept])]
        return ShedRays(row[kept], np.zeros_like(kept), place[kept], one.rays[kept], np.full(len(kept), np.inf))

    @property
    def long(self) -> BoolArray:
        """For the forward lobe only, which is not here."""
        return np.zeros(len(self.shed.observer), dtype=bool)

    @cached_property
    def specular(self) -> SpecularPoints:
        """Specular points, n = -d."""
        return specular_points(self.body, self.direction, self.directions, prepared(self.body).coarsest)

    def fan_nodes(self, wavenumber: float, wanted: BoolArray) -> HorizonRays:
        """Nodes of the fan integral for the wanted incidences, at most APART/k apart on the shadow line."""
        # those of the highest wavenumber serve all
        if self._nodes is None:
            self._nodes = self._fan_nodes(max(wavenumber, self.highest), wanted)
        return self._nodes

    def _fan_nodes(self, wavenumber: float, wanted: BoolArray) -> HorizonRays:
        row, ray = self._crossed[:, :2].astype(np.int64).T
        mine = np.flatnonzero(wanted[row] & (self._crossed[:, 3] > TAPER[0] - 0.1))
        row, ray, time = row[mine], ray[mine], self._crossed[mine, 2]
        spacing = self.lines.spacing[row, ray]
        parts = max(1, int(np.ceil(wavenumber * np.max(spacing, initial=0.0) / APART)))
        starts, tangents = self.tracer.onto_line(self.lines.launch_points[row, ray], self.direction[row], 1)
        offset = (np.arange(parts) + 0.5) / parts - 0.5
        guess = starts[:, None] + (offset * spacing[:, None])[..., None] * tangents[:, None]
        row, time, weight = (np.repeat(v, parts) for v in (row, time, spacing / parts))
        rays = self.tracer.crossing(self.direction[row], self.directions[row], guess.reshape(-1, 3), time).rays
        ahead = np.sum(rays.directions * self.directions[row], axis=1) > 0
        return HorizonRays(row[ahead], rays[ahead], (weight * rays.width)[ahead])


def coarse_times(flow: Flow, length: float) -> FloatArray:
    """Times of the fan, from 0: steps that the flow takes at once, about those that resolve the body."""
    natural = natural_horizon(flow.body)
    count = max(1, int(np.ceil(length / natural - 1e-9)))
    if flow.error is not None and flow.horizon < length:
        leaps = max(1, round(natural / flow.horizon))
        if abs(length / flow.horizon - round(length / flow.horizon)) < 1e-9:
            whole = round(length / flow.horizon)
            while whole % leaps:
                leaps -= 1
            count = whole // leaps
    return np.asarray(np.linspace(0.0, length, count + 1))


def _distinct(row: IntArray, starts: FloatArray, times: FloatArray, cell: FloatArray) -> IntArray:
    """Numbers of the solutions that no other one of the same incidence equals, but for the first of those that do."""
    order = np.lexsort((times, row))
    kept = np.ones(len(row), dtype=bool)
    # times of equal solutions follow each other
    for shift in range(1, min(len(row), LONGEST_TIE)):
        one, two = order[shift:], order[:-shift]
        alike = (row[one] == row[two]) & (np.abs(times[one] - times[two]) < ALIKE * cell[one, 1])
        alike &= np.linalg.norm(starts[one] - starts[two], axis=1) < ALIKE * cell[one, 0]
        kept[one[alike]] = False
    return np.flatnonzero(kept)
