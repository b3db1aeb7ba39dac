"""The phase map g_T0 of a body's geodesic flow, and the composition of maps to any time.

A point (x, p) of T1Q has coordinates (chart, u, v, angle). A map stores, as splines in (u, v, angle), the displacement
of the time-t flow in the coordinates of its model (`coordinates`), its Jacobi matrix and the curvatures along it;
g_(m T0) = g_T0 o ... o g_T0 [YC06a, Algorithm 2]. The remainder of a time below T0 is covered by the shorter maps of
the tower, if there is one, and below those by the order-8 integrator.
"""

import hashlib
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from creeping._presenting import Drawn, brief
from creeping._typing import Any, ArrayLike, FloatArray, IntArray
from creeping._version import __version__
from creeping.errors import InvalidInputError
from creeping.geodesics.attenuation import with_attenuation
from creeping.geodesics.integrator import ErrorEstimate, as_times, trace_states
from creeping.geodesics.states import DETACHMENT, bundle_states, checked_states, unpack
from creeping.geometry.arguments import folder_path, positive_number, real_number, whole_number
from creeping.geometry.surface import Surface, fingerprint
from creeping.phaseflow.coordinates import Model
from creeping.phaseflow.splines import Grid, Leap
from creeping.storage.folder import write_folder

TABLES = "state", "jacobi", "curvature", "flagged"
"""Tables of a leap that are stored as files."""


@dataclass(frozen=True)
class ErrorGrowth:
    """Error of composed maps as a function of ray length, measured against direct integration.

    Attributes
    ----------
    lengths : tuple of float, L (travel time for a weighted body)
        Ascending.
    rms, max : tuple of float
        Errors at each length, as defined in `ErrorEstimate`.
    bound : float
        Upper bound of the rms at the last length: its square lies two standard errors above the measured square. Near
        an unstable geodesic few rays carry most of the error, and the measured rms scatters.

    Examples
    --------
    >>> import creeping as cr
    >>> growth = cr.ErrorGrowth(lengths=(1.0, 2.0, 4.0), rms=(1e-9, 2e-9, 8e-9), max=(3e-9, 6e-9, 2e-8), bound=9e-9)
    >>> f"{growth.rms_after(2.0):.0e}"
    '2e-09'
    """

    lengths: tuple[float, ...]
    rms: tuple[float, ...]
    max: tuple[float, ...]
    bound: float

    def rms_after(self, length: float) -> float:
        """Rms error at a length, L, interpolated logarithmically; beyond the last length it grows exponentially.

        Raises
        ------
        InvalidInputError
            If the length is not a number >= 0.
        """
        length = real_number(length, "length")
        if not length >= 0:
            raise InvalidInputError(f"length = {length!r} is not a number >= 0")
        if length <= self.lengths[0]:
            return self.rms[0]
        t, e = np.log(self.lengths), np.log(np.maximum(self.rms, 1e-300))
        at = np.log(length)
        if length > self.lengths[-1]:
            # errors of a chaotic flow grow like an exponential, which a power law underestimates
            rate = (e[-1] - e[-2]) / (self.lengths[-1] - self.lengths[-2]) if len(t) > 1 else 0.0
            return float(np.exp(min(e[-1] + rate * (length - self.lengths[-1]), 50.0)))
        return float(np.exp(np.interp(at, t, e)))

    def trusted_length(self, tolerance: float) -> float:
        """Largest length, L, whose rms error meets the tolerance; extrapolates to at most twice the measured length.

        Raises
        ------
        InvalidInputError
            If the tolerance is not a positive finite number.
        """
        tolerance = positive_number(tolerance, "tolerance")
        ends = np.linspace(self.lengths[0], 2 * self.lengths[-1], 2001)
        good = np.array([self.rms_after(float(t)) <= tolerance for t in ends])
        return float(ends[np.argmin(good) - 1]) if good[0] and not good.all() else float(ends[-1] if good[0] else 0.0)


@dataclass(frozen=True, eq=False, repr=False)
class PhaseMap(Drawn):
    """Phase map of a body; make one with `build_phase_map`, or open a stored one with `load_phase_map`.

    Attributes
    ----------
    body : Surface
    model : Model
        Coordinates in which maps are composed, and a simple reference motion, relative to which maps are stored.
    grid : Grid
    leaps : tuple of Leap
        Maps by ascending time; the last is g_T0. Only ``method="tower"`` has more than one.
    error : ErrorEstimate
        Of one g_T0, measured when the map was built; NaN before.
    growth : ErrorGrowth or None
        Error as a function of ray length.
    parameters : dict
        How the map was built.

    Examples
    --------
    >>> import numpy as np
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> pm = cr.build_phase_map(sc.Sphere(), horizon=0.5, grid=(16, 16), degree=3, cache=False)
    >>> x, p = pm.flow((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), np.pi)                     # half a great circle
    >>> bool(np.allclose(x, [-1, 0, 0])), pm.error.rms < 1e-9
    (True, True)
    """

    body: Surface
    model: Model
    grid: Grid
    leaps: tuple[Leap, ...]
    error: ErrorEstimate = field(default_factory=lambda: ErrorEstimate(float("nan"), float("nan"), 0))
    growth: ErrorGrowth | None = None
    parameters: dict[str, Any] = field(default_factory=dict)

    @property
    def horizon(self) -> float:
        """T0, L (travel time for a weighted body)."""
        return self.leaps[-1].time

    @property
    def nbytes(self) -> int:
        """Memory that the splines take, bytes."""
        return sum(leap.nbytes for leap in self.leaps)

    @cached_property
    def digest(self) -> str:
        """Hash of the tables, hexadecimal. It is cached, so do not change the tables."""
        tables = hashlib.blake2b(digest_size=16)
        for leap in self.leaps:
            for array in (leap.state, leap.centre, leap.jacobi, leap.matrix, leap.curvature, leap.flagged):
                tables.update(np.ascontiguousarray(array).view(np.uint8).reshape(-1).data)
        return tables.hexdigest()

    @property
    def has_jacobi(self) -> bool:
        """Whether the map carries the Jacobi matrix, which fans need."""
        return self.leaps[-1].has_jacobi

    def __repr__(self) -> str:
        leap = self.leaps[-1]
        grid = " x ".join(map(str, (len(leap.state), *self.grid.nodes)))
        error = f"rms {self.error.rms:.1e}, max {self.error.max:.1e} ({self.error.samples} samples)"
        growth = self.growth
        grown = "" if growth is None else f"; after {growth.lengths[-1]:g}: rms {growth.rms[-1]:.1e}"
        return (
            f"PhaseMap({brief(self.body)})\n"
            f"  T0 = {self.horizon:g}, {grid} nodes, degree {self.grid.degree}, {leap.state.dtype}, "
            f"{self.nbytes / 1e6:.1f} MB\n"
            f"  error of one g_T0: {error if self.error.samples else 'not measured'}{grown}"
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

        Raises
        ------
        InvalidInputError
            On bad points or directions.
        """
        states, shape = bundle_states(self.body, points, directions)
        return unpack(self.leap(states, 1)[:, None], shape, scalar=True)

    def flow(self, points: ArrayLike, directions: ArrayLike, times: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Advance to any times >= 0.

        Parameters
        ----------
        points : (..., 3), L
        directions : (..., 3)
        times : scalar or (m,), L (travel time for a weighted body)
            Ascending.

        Returns
        -------
        points, directions : (..., 3) for a scalar time, (..., m, 3) else

        Raises
        ------
        InvalidInputError
            On bad points, directions or times.
        """
        values, scalar = as_times(times)
        states, shape = bundle_states(self.body, points, directions)
        return unpack(self._transported(states, values), shape, scalar)

    def transport(self, states: FloatArray, times: FloatArray) -> FloatArray:
        """Advance states (n, c), c = 6, 10 or 12, to ascending times (m,), L: (n, m, c).

        Components 0 to 5 are x, L, and p. Components 6 to 9 are the columns of the Jacobi matrix of the metric ds/c;
        M12 is a time, M21 is 1/time. Component 10 is the attenuation integral, L^(1/3). Component 11 is the time of
        detachment, inf before (`attenuation`).

        Raises
        ------
        InvalidInputError
            If the states include a Jacobi matrix and the map does not carry one.
        """
        return self._transported(checked_states(states), as_times(times)[0])

    def _transported(self, states: FloatArray, times: FloatArray) -> FloatArray:
        """What `transport` gives of checked states and times."""
        attenuates = states.shape[1] > 10
        if attenuates and not self._leaps_serve(times):
            return with_attenuation(self.body, states, times, rtol=self._rtol)
        # a thousand rays take some seconds for so many leaps
        if len(times) and times.max() > 1e5 * self.horizon:
            raise InvalidInputError(
                f"times up to {times.max():.3g} take {times.max() / self.horizon:.2g} leaps of {self.horizon:.3g}, "
                "more than 100000; give shorter ones"
            )
        # a time that misses a multiple of the horizon by rounding is that multiple
        whole = np.floor(times / self.horizon * (1 + 4e-16) + 1e-12).astype(np.int64)
        rest = np.maximum(times - whole * self.horizon, 0.0)
        rest[rest < 1e-12 * self.horizon] = 0.0
        if attenuates and self.attenuates_at(times):
            # multiples of the horizon they are, but for rounding
            whole, rest = np.round(times / self.horizon).astype(np.int64), np.zeros_like(times)
        stops, place = np.unique(whole, return_inverse=True) if len(times) > 1 else (whole, np.zeros(1, np.int64))
        at = self._composed(states, self.leaps[-1], np.diff(stops, prepend=0))
        if stops[0] == 0:
            at[:, 0] = states
        # a copy of all states takes as long as a leap
        out = at if len(stops) == len(times) and not np.any(rest > 0) else at[:, place]
        for k in range(len(stops)):
            mine = np.flatnonzero((place == k) & (rest > 0))
            if len(mine):
                out[:, mine] = self._remainder(at[:, k], rest[mine], stops[k] * self.horizon)
        return out

    def attenuates_at(self, times: FloatArray) -> bool:
        """Whether all times (m,), L, are multiples of the horizon and the map stores the attenuation there."""
        leaps = times / self.horizon
        return self.leaps[-1].has_curvature and bool(np.all(np.abs(leaps - np.round(leaps)) < 1e-11 * (1 + leaps)))

    def _leaps_serve(self, times: FloatArray) -> bool:
        """Whether leaps carry the attenuation most of the way to the times (m,), L, and traces from there are short."""
        if not self.leaps[-1].has_curvature or not len(times):
            return False
        whole = np.floor(times / self.horizon * (1 + 4e-16) + 1e-12)
        traced = sum(float(np.max(times[whole == k] - k * self.horizon)) for k in np.unique(whole))
        return bool(traced <= 0.5 * times.max())

    def _remainder(self, states: FloatArray, times: FloatArray, begun: float) -> FloatArray:
        """Advance by times below the horizon from a time ``begun``: down the tower, then by direct integration."""
        if states.shape[1] > 10:
            more = with_attenuation(self.body, states, times, rtol=self._rtol)
            # a trace counts from its own start
            later = np.isinf(states[:, None, DETACHMENT]) & np.isfinite(more[..., DETACHMENT])
            more[..., DETACHMENT] += np.where(later, begun, 0.0)
            return more
        if len(self.leaps) == 1:
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
        """Compose one map (g_T0 by default) ``count`` times on states (n, 6 or 10); units are those of `transport`.

        Raises
        ------
        InvalidInputError
            If ``count`` is negative, or the states have components that the map does not carry.
        """
        count = whole_number(count, "count", 0)
        states = checked_states(states).copy()
        if count == 0:
            return states
        return self._composed(states, level or self.leaps[-1], np.array([count]))[:, 0]

    def _composed(self, states: FloatArray, level: Leap, counts: IntArray) -> FloatArray:
        if states.shape[1] > 6 and not level.has_jacobi:
            raise InvalidInputError("this map carries no Jacobi matrix; build it with carry_jacobi=True")
        if states.shape[1] > 10 and not level.has_curvature:
            raise InvalidInputError("this map carries no curvatures over a leap; use transport, which traces for them")
        return self.model.flow(self.grid, level, states, counts)

    def save(self, folder: str | Path) -> Path:
        """Store the map in a new folder of .npy files with a manifest; `load_phase_map` opens it.

        Raises
        ------
        StoredMapError
            If the folder exists or cannot be written.
        """
        folder = folder_path(folder, "folder")
        content = {
            "version": __version__,
            "body": fingerprint(self.body),
            "model": self.model.name,
            "nodes": list(self.grid.nodes),
            "degree": self.grid.degree,
            "periodic": list(self.grid.periodic),
            "times": [leap.time for leap in self.leaps],
            "centres": [leap.centre.tolist() for leap in self.leaps],
            "matrices": [leap.matrix.tolist() for leap in self.leaps],
            "error": [self.error.rms, self.error.max, self.error.samples],
            "growth": self.growth and [self.growth.lengths, self.growth.rms, self.growth.max, [self.growth.bound]],
            "parameters": self.parameters,
        }
        leaps = enumerate(self.leaps)
        return write_folder(
            folder, content, {f"{name}-{k}.npy": getattr(leap, name) for k, leap in leaps for name in TABLES}
        )
