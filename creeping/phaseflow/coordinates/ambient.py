"""Maps stored in space, for any atlas: D = x' - x - t p and p' - p at (chart, u, v, angle).

p = E (cos angle, sin angle) with E(u, v) the isometric frame of the chart (`creeping.geometry.frames.polar_frame`). A
leap ends off T1Q by the error of the map and is put back.

Sources: [YC06b]; Derivations, B2.
"""

from dataclasses import dataclass

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping.geodesics.attenuation import extend
from creeping.geodesics.bundle import project_bundle
from creeping.geodesics.integrator import compiled_parts
from creeping.geometry.frames import polar_frame
from creeping.geometry.surface import Surface, size
from creeping.kernels.threads import in_threads
from creeping.phaseflow.grid import Grid, Leap
from creeping.phaseflow.splines import evaluate

PROJECTION = 1e-13
"""Distance from the body, in units of its size, at which a composed ray counts as on it."""


@dataclass(frozen=True, eq=False)
class AmbientModel:
    """(x, p) in space, charts as the atlas gives them."""

    body: Surface
    name: str = "ambient"
    lanes: int = 8

    @property
    def charts(self) -> int:
        """Charts of the atlas."""
        return len(self.body.atlas.charts)

    def at(self, chart: int, u: FloatArray, v: FloatArray, angle: FloatArray) -> FloatArray:
        """See `Model`; coordinates are states."""
        one = self.body.atlas.charts[chart]
        uv = np.stack([u, v], axis=-1)
        frame = polar_frame(one.tangents(uv))
        directions = np.cos(angle)[:, None] * frame[..., 0] + np.sin(angle)[:, None] * frame[..., 1]
        return np.concatenate([one.point(uv), directions], axis=1)

    def states(self, coordinates: FloatArray) -> FloatArray:
        """States are the coordinates themselves: (n, 6) -> (n, 6)."""
        return coordinates

    def displacement(self, nodes: FloatArray, traced: FloatArray, times: FloatArray) -> FloatArray:
        """x' - x - t p and p' - p, padded to eight lanes: (n, 8)."""
        values = np.zeros((len(nodes), 8))
        values[:, :6] = traced[:, -1, :6] - nodes
        values[:, :3] -= times[-1] * nodes[:, 3:]
        return values

    def flow(self, grid: Grid, leap: Leap, states: FloatArray, counts: IntArray) -> FloatArray:
        """See `Model`."""
        current = np.array(states, dtype=float, order="C")
        out = np.empty((len(states), len(counts), states.shape[1]))
        parts, locator = compiled_parts(self.body), getattr(self.body.atlas, "compiled", None)
        for k, count in enumerate(counts):
            if parts is None or locator is None:
                for _ in range(count):
                    current = self.leap_numpy(grid, leap, current)
            else:
                self._compose(grid, leap, current, int(count), parts, locator)
            out[:, k] = current
        return out

    def _compose(self, grid: Grid, leap: Leap, states: FloatArray, count: int, parts: Any, locator: Any) -> None:
        from creeping.phaseflow.kernels.ambient import leap as kernel

        off = PROJECTION * size(self.body)
        tables = leap.state, leap.jacobi, grid.degree, grid.origin, grid.cells

        def run(part: slice) -> None:
            body = locator.function, locator.parameters, parts[0], parts[1]
            kernel(*body, *tables, leap.time, count, off, states[part])

        in_threads(run, len(states))

    def leap_numpy(self, grid: Grid, leap: Leap, states: FloatArray) -> FloatArray:
        """See `Model`."""
        x, p = states[:, :3], states[:, 3:6]
        chart, uv = self.body.atlas.locate(x)
        angle = np.empty(len(x))
        for index, one in enumerate(self.body.atlas.charts):
            mine = chart == index
            along = np.einsum("ni,nik->nk", p[mine], polar_frame(one.tangents(uv[mine])))
            angle[mine] = np.arctan2(along[:, 1], along[:, 0])
        place = np.concatenate([uv, angle[:, None] / (2 * np.pi) % 1.0], axis=1) * grid.cells
        place[:, :2] += grid.origin
        d = evaluate(leap.state, chart, place, grid.degree)
        out = np.empty_like(states)
        out[:, :3], out[:, 3:6] = project_bundle(self.body, x + leap.time * p + d[:, :3], p + d[:, 3:6])
        carry_riding(grid, leap, chart, place, states, out)
        return out


def carry_riding(
    grid: Grid, leap: Leap, chart: IntArray, place: FloatArray, states: FloatArray, out: FloatArray
) -> None:
    """Fill lanes 6 to 9 of out with M times those of states, lanes 10 and 11 with attenuation and detachment.

    Times of detachment count from the start of the leap.
    """
    lanes = states.shape[1]
    if lanes > 6:
        m = evaluate(leap.jacobi, chart, place, grid.degree) + leap.matrix
        for first in (6, 8):
            i, j = states[:, first], states[:, first + 1]
            out[:, first] = m[:, 0] * i + m[:, 2] * j
            out[:, first + 1] = m[:, 1] * i + m[:, 3] * j
    if lanes > 10:
        out[:, 10:] = states[:, 10:]
        values = evaluate(leap.curvature, chart, place, grid.degree)
        extend(values, leap.time, np.zeros(len(states)), out[:, 10], out[:, 11])
