"""The phase map g_T0 of a body's geodesic flow, and the composition of maps to any time.

A point (x, p) of T1Q has coordinates (chart, u, v, angle): x = X(u, v) and p = E(u, v) (cos angle, sin angle), E
the isometric frame of the chart (`creeping.surface.polar_frame`). A map stores, as splines in (u, v, angle), the
displacement

    D = x' - x - t p,   E = p' - p,   M - [[1, t], [0, 1]]

of the time-t flow and of its Jacobi matrix; g_(m T0) = g_T0 o ... o g_T0 [YC06a, Algorithm 2]. The remainder of a time
below T0 is covered by the shorter maps of the tower, if there is one, and below those by the order-8 integrator.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from creeping._errors import InvalidInputError
from creeping._typing import Any, ArrayLike, FloatArray
from creeping._version import __version__
from creeping.phaseflow.bundle import bundle_points, project_bundle
from creeping.phaseflow.splines import evaluate
from creeping.phaseflow.storing import fingerprint, write_folder
from creeping.phaseflow.tracing import as_times, compiled_parts, pack, trace_states
from creeping.surface import Surface, polar_frame, size

MARGIN = 2
"""Nodes of a chart beyond each edge of its unit square: every point finds a chart two grid points from the edge."""
PROJECTION = 1e-13
"""Distance from the body, in units of its size, at which a composed ray counts as on it."""


@dataclass(frozen=True)
class MapError:
    """Error of one g_T0 against direct integration.

    Attributes
    ----------
    rms, max : float
        Of |(x, p) - (x, p)_traced|, the norm in R^6, over the samples.
    samples : int
        Random points of T1Q.
    """

    rms: float
    max: float
    samples: int


@dataclass(frozen=True)
class Grid:
    """Nodes of a map along u, v and the angle; MARGIN of them lie outside the unit square on each side."""

    nodes: tuple[int, int, int]
    degree: int
    periodic: tuple[bool, bool]

    @property
    def origin(self) -> FloatArray:
        """Grid coordinates of u = v = 0."""
        return np.array([0.0 if wraps else float(MARGIN) for wraps in self.periodic])

    @property
    def cells(self) -> FloatArray:
        """Cells per unit of u, v and per turn of the angle."""
        sides = [n if wraps else n - 1 - 2 * MARGIN for n, wraps in zip(self.nodes[:2], self.periodic, strict=True)]
        return np.array([*sides, self.nodes[2]], dtype=float)

    def axes(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Node values of u, v and the angle (radians)."""
        u, v = ((np.arange(self.nodes[k]) - self.origin[k]) / self.cells[k] for k in (0, 1))
        return u, v, 2 * np.pi * np.arange(self.nodes[2]) / self.nodes[2]


@dataclass(frozen=True, eq=False)
class Leap:
    """The splines of one time: ``state`` (charts, nu, nv, na, 8) and ``jacobi`` (charts, nu, nv, na, 4)."""

    time: float
    state: FloatArray
    jacobi: FloatArray

    def __post_init__(self) -> None:
        # read-only like the arrays of a stored map: kernels are compiled for one kind of array
        for table in (self.state, self.jacobi):
            table.flags.writeable = False


@dataclass(frozen=True, eq=False, repr=False)
class PhaseMap:
    """Phase map of a body; make one with `build_phase_map`, or open a stored one with `load_phase_map`.

    Attributes
    ----------
    body : Surface
    grid : Grid
    leaps : tuple of Leap
        Maps by ascending time, the last is g_T0; more than one only for ``method="tower"``.
    error : MapError
        Measured when the map was built.
    parameters : dict
        How the map was built.
    """

    body: Surface
    grid: Grid
    leaps: tuple[Leap, ...]
    error: MapError
    parameters: dict[str, Any] = field(default_factory=dict)

    @property
    def horizon(self) -> float:
        """T0, L (travel time for a weighted body)."""
        return self.leaps[-1].time

    @property
    def nbytes(self) -> int:
        """Memory of the splines, bytes."""
        return sum(leap.state.nbytes + leap.jacobi.nbytes for leap in self.leaps)

    def __repr__(self) -> str:
        nu, nv, na = self.grid.nodes
        charts = len(self.leaps[-1].state)
        return (
            f"PhaseMap({self.body!r})\n"
            f"  T0 = {self.horizon:g}, {charts} x {nu} x {nv} x {na} nodes, degree {self.grid.degree}, "
            f"{self.nbytes / 1e6:.0f} MB\n"
            f"  error of one g_T0: rms {self.error.rms:.1e}, max {self.error.max:.1e} ({self.error.samples} samples)"
        )

    def apply(self, points: ArrayLike, directions: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Advance by one horizon.

        Parameters
        ----------
        points, directions : (..., 3)
            Points on the body, L, and directions, as for `trace`.

        Returns
        -------
        points, directions : (..., 3), (..., 3)
        """
        x, p = bundle_points(self.body, points, directions)
        states = self.leap(pack(x, p), 1)
        return states[:, :3].reshape(x.shape), states[:, 3:6].reshape(x.shape)

    def flow(self, points: ArrayLike, directions: ArrayLike, times: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Advance to any times >= 0.

        Parameters
        ----------
        points, directions : (..., 3)
        times : scalar or (m,), L (travel time for a weighted body)
            Ascending.

        Returns
        -------
        points, directions : (..., 3) for a scalar time, (..., m, 3) else
        """
        values, scalar = as_times(times)
        x, p = bundle_points(self.body, points, directions)
        states = self.transport(pack(x, p), values).reshape(*x.shape[:-1], len(values), 6)
        if scalar:
            states = states[..., 0, :]
        return states[..., :3].copy(), states[..., 3:].copy()

    def transport(self, states: FloatArray, times: FloatArray) -> FloatArray:
        """Advance states (n, 6 or 10) to the ascending times (m,): (n, m, 6 or 10).

        Lanes 6 to 9 are the columns of the Jacobi matrix of the metric ds/c.
        """
        states = np.array(states, dtype=float)
        out = np.empty((len(states), len(times), states.shape[1]))
        # a time that misses a multiple of the horizon by rounding is that multiple
        whole = np.floor(np.asarray(times) / self.horizon * (1 + 4e-16) + 1e-12).astype(int)
        done = 0
        for count in np.unique(whole):
            states = self.leap(states, int(count) - done)
            done = int(count)
            mine = np.flatnonzero(whole == count)
            rest = np.maximum(times[mine] - done * self.horizon, 0.0)
            out[:, mine] = self._remainder(states, rest)
        return out

    def _remainder(self, states: FloatArray, times: FloatArray) -> FloatArray:
        """Advance by times below the horizon: down the tower, then by direct integration."""
        if len(self.leaps) == 1:
            if not np.any(times > 0):
                return np.repeat(states[:, None], len(times), axis=1)
            return trace_states(self.body, states, times, rtol=self._rtol, step=self.horizon / 4)
        out = np.empty((len(states), len(times), states.shape[1]))
        for m, left in enumerate(times):
            current = states.copy()
            for level in self.leaps[-2::-1]:
                count = int(left / level.time + 1e-9)
                current = self.leap(current, count, level)
                left = max(left - count * level.time, 0.0)
            if left > 1e-15 * self.horizon:
                current = trace_states(self.body, current, np.array([left]), rtol=self._rtol, step=left)[:, 0]
            out[:, m] = current
        return out

    @property
    def _rtol(self) -> float:
        """Tolerance of the direct remainder, well below the map's own error."""
        return float(np.clip(1e-3 * self.error.rms, 1e-12, 1e-9)) if np.isfinite(self.error.rms) else 1e-12

    def leap(self, states: FloatArray, count: int, level: Leap | None = None) -> FloatArray:
        """Compose one map (g_T0 by default) ``count`` times on states (n, 6 or 10)."""
        if count < 0:
            raise InvalidInputError(f"cannot compose a map {count} times")
        level = level or self.leaps[-1]
        states = np.array(states, dtype=float, order="C")
        compiled, locator = compiled_parts(self.body), getattr(self.body.atlas, "compiled", None)
        if compiled is None or locator is None:
            for _ in range(count):
                states = self.leap_numpy(states, level)
            return states
        from creeping.phaseflow._kernels import leap

        off = PROJECTION * size(self.body)
        tables = level.state, level.jacobi, self.grid.degree, self.grid.origin, self.grid.cells
        leap(locator.function, locator.parameters, compiled[0], compiled[1], *tables, level.time, count, off, states)
        return states

    def leap_numpy(self, states: FloatArray, level: Leap | None = None) -> FloatArray:
        """Apply one map once; the numpy twin of the compiled composition."""
        level = level or self.leaps[-1]
        x, p = states[:, :3], states[:, 3:6]
        chart, grid = self.coordinates(x, p)
        d = evaluate(level.state, chart, grid, self.grid.degree)
        out = np.empty_like(states)
        out[:, :3], out[:, 3:6] = project_bundle(self.body, x + level.time * p + d[:, :3], p + d[:, 3:6])
        if states.shape[1] > 6:
            m = evaluate(level.jacobi, chart, grid, self.grid.degree) + np.array([1.0, 0.0, level.time, 1.0])
            for first in (6, 8):
                i, j = states[:, first], states[:, first + 1]
                out[:, first] = m[:, 0] * i + m[:, 2] * j
                out[:, first + 1] = m[:, 1] * i + m[:, 3] * j
        return out

    def coordinates(self, points: FloatArray, directions: FloatArray) -> tuple[Any, FloatArray]:
        """Charts (n,) and grid coordinates (n, 3) of points of T1Q."""
        chart, uv = self.body.atlas.locate(points)
        angle = np.empty(len(points))
        for index, one in enumerate(self.body.atlas.charts):
            mine = chart == index
            frame = polar_frame(one.tangents(uv[mine]))
            along = np.einsum("ni,nik->nk", directions[mine], frame)
            angle[mine] = np.arctan2(along[:, 1], along[:, 0])
        grid = np.concatenate([uv, angle[:, None] / (2 * np.pi) % 1.0], axis=1) * self.grid.cells
        grid[:, :2] += self.grid.origin
        return chart, grid

    def save(self, folder: str | Path) -> Path:
        """Store the map in a new folder of .npy files with a manifest; `load_phase_map` opens it.

        Raises
        ------
        StoredMapError
            If the folder exists or cannot be written.
        """
        content = {
            "version": __version__,
            "body": fingerprint(self.body),
            "nodes": list(self.grid.nodes),
            "degree": self.grid.degree,
            "periodic": list(self.grid.periodic),
            "times": [leap.time for leap in self.leaps],
            "error": [self.error.rms, self.error.max, self.error.samples],
            "parameters": self.parameters,
        }
        states = {f"state-{k}.npy": leap.state for k, leap in enumerate(self.leaps)}
        jacobis = {f"jacobi-{k}.npy": leap.jacobi for k, leap in enumerate(self.leaps)}
        return write_folder(folder, content, states | jacobis)
