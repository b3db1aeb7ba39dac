"""Maps stored in space, for any atlas: D = x' - x - t p and p' - p at (chart, u, v, angle).

p = E (cos angle, sin angle) with E(u, v) the polar frame of the chart (`creeping.geometry.evaluators.polar_frame`). A
leap ends off T1Q by the error of the map and is put back.

Sources: [YC06b]; Derivations, B2.
"""

from dataclasses import dataclass

import numpy as np

from creeping._typing import FloatArray, IntArray
from creeping.errors import SurfaceError
from creeping.geometry.evaluators import evaluators, locator, polar_frame
from creeping.geometry.surface import Surface, size
from creeping.kernels.threads import in_threads, pause
from creeping.phaseflow.splines import Grid, Leap

TOGETHER = 1000
"""Leaps between which the kernel comes up for signals, 0.1 s for a block."""
PROJECTION = 1e-13
"""Distance from the body, in units of its size, at which a composed ray counts as on it."""


@dataclass(frozen=True, eq=False)
class AmbientModel:
    """(x, p) in space, charts as the atlas gives them."""

    body: Surface
    name: str = "ambient"
    lanes: int = 8
    is_flat: bool = False
    unit: float = 1.0

    @property
    def charts(self) -> int:
        """Charts of the atlas."""
        return len(self.body.atlas.charts)

    @property
    def periodic(self) -> tuple[bool, bool]:
        """Whether u and v of the charts have period 1.

        Raises
        ------
        SurfaceError
            If they differ from chart to chart.
        """
        kinds = {tuple(chart.periodic) for chart in self.body.atlas.charts}
        if len(kinds) != 1:
            raise SurfaceError(
                f"the charts of the atlas differ in periodicity ({sorted(kinds)}); use charts of one kind"
            )
        first, second = kinds.pop()
        return first, second

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
        for k, count in enumerate(counts):
            self._compose(grid, leap, current, int(count))
            out[:, k] = current
        return out

    def _compose(self, grid: Grid, leap: Leap, states: FloatArray, count: int) -> None:
        from creeping.phaseflow.kernels.ambient import leap as kernel

        off = PROJECTION * size(self.body)
        tables = leap.state, leap.jacobi, grid.degree, grid.origin, grid.cells
        with evaluators(self.body) as parts, locator(self.body) as place:

            def run(part: slice) -> None:
                # a map composed with itself in place may be left in between
                for done in range(0, count, TOGETHER):
                    kernel(*place, *parts[:2], *tables, leap.time, min(TOGETHER, count - done), off, states[part])
                    pause()

            in_threads(run, len(states))
