"""The response to a pulse: the sum over a band of wavenumbers of any complex field, against the delay of its paths.

    h(t) = sum_n w_n u(k_n) e^{-i k_n t} / sum_n w_n          `creeping.field.frequency`
    |error of h| <= sum_n w_n e_n / sum_n w_n

with e_n the errors of the values. What the wave does on the way shows as the delay of its group: a creeping wave, whose
phase has a term in k^{1/3}, comes later than its path is long by that of the mode, some 0.01 of the arc at ka = 40.

Also here: where along the line of sight the echo comes from: the inverse transform of the field over a band of
frequencies.

    h(R) = sum_n w_n f(k_n) e^{-2 i k_n R} / sum_n w_n,   k_n equally spaced by dk

R is the range along the direction of travel, 0 at the origin of the body's coordinates, positive behind it: an echo
from the plane d.x = R has f ~ e^{2ikR}, so that e^{-2ikR} brings it together: the sum of `creeping.field.frequency` at
the delay 2R. Ranges repeat after pi/dk; two echoes are told apart from about pi/(k_N - k_1) on.

Sources: Derivations, F21.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from creeping._presenting import Drawn
from creeping._typing import Any, ArrayLike, ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.frequency import band_sum
from creeping.field.results.labelled import ArrayResult
from creeping.geometry.arguments import number_between, positive_number


@dataclass(frozen=True, eq=False, repr=False)
class ImpulseResponse(Drawn):
    """Impulse response h of a field: values at m delays, (m, ...).

    Attributes
    ----------
    delay : (m,), L or s
        Ascending. Delay 0 has phase 0 in the input: for a plane wave, the moment at which the wave passes the origin.
    values : (m, ...) complex
        In the unit of the field. A path that contributes a e^{ikt} at all wavenumbers gives the value a at delay t.
    error : (...)
        Bound of the error at any delay, from the errors of the field; 0 if none were given.
    resolution : float, L or s
        Width of the peak of a single path at half its power.
    period : float, L or s
        Period of the response in delay.
    unit : str
        "L" or "s".

    Examples
    --------
    >>> import numpy as np
    >>> import creeping as cr
    >>> k = np.linspace(20.0, 60.0, 81)
    >>> found = cr.impulse_response(np.exp(3j * k), k, speed=340.0, window="none")
    >>> round(float(found.period), 4), round(1e3 * found.resolution, 3), found.unit
    (0.037, 0.404, 's')
    """

    delay: FloatArray
    values: ComplexArray
    error: FloatArray
    resolution: float
    period: float
    unit: str

    @property
    def envelope(self) -> FloatArray:
        """Magnitude |h| (m, ...)."""
        return np.abs(self.values)

    def arrivals(self, most: int = 8, *, above: float = 0.05) -> FloatArray:
        """Delays of the strongest peaks of the envelope of one response, in order of time.

        Parameters
        ----------
        most : int
            Largest number of peaks.
        above : float
            Least height relative to the highest peak. Peaks below the error are left out too.

        Returns
        -------
        (p,), L or s
            Delays, accurate to a fraction of ``resolution``. Closer paths merge into one peak.

        Raises
        ------
        InvalidInputError
            If the object holds several responses.
        """
        from scipy.signal import find_peaks

        if self.values.ndim != 1:
            raise InvalidInputError(
                f"arrivals need one response, values (m,), not {self.values.shape}; transform the fields one by one"
            )
        size = self.envelope
        # periodic: a peak may stand at either end
        around = np.concatenate([size[-1:], size, size[:1]])
        apart = max(1, int(self.resolution / (self.delay[1] - self.delay[0])))
        peaks, _ = find_peaks(around, height=max(above * float(size.max()), float(self.error)), distance=apart)
        peaks = peaks[np.argsort(-around[peaks])][:most]
        left, middle, right = around[peaks - 1], around[peaks], around[peaks + 1]
        bend = left - 2 * middle + right
        shift = np.where(bend < 0, 0.5 * (left - right) / np.where(bend < 0, bend, 1.0), 0.0)
        return np.sort(self.delay[0] + (peaks - 1 + shift) * (self.delay[1] - self.delay[0]))

    def __repr__(self) -> str:
        shape = " x ".join(map(str, self.values.shape))
        return (
            f"ImpulseResponse({shape}, delays {self.delay[0]:.4g} to {self.delay[-1]:.4g} {self.unit})\n"
            f"  resolution {self.resolution:.3g} {self.unit}, repeats after {self.period:.4g} {self.unit}\n"
            f"  up to {np.max(self.envelope, initial=0.0):.4g}, error {np.max(self.error, initial=0.0):.2g} at most"
        )


def impulse_response(
    values: ArrayLike | Sequence[ArrayResult],
    wavenumbers: ArrayLike,
    *,
    error: ArrayLike | None = None,
    speed: float | None = None,
    start: float | None = None,
    window: str = "hann",
) -> ImpulseResponse:
    """Response of a field to a pulse that fills the band: each path that the band resolves gives a peak.

    Parameters
    ----------
    values : (n, ...) complex, or sequence of results
        Field at each wavenumber: arrays, or `NearField`, `SurfaceField` or `SourcePattern`, whose errors are used.
        The diagonal of a `Coupling` is infinite, so give single entries, ``[c[0, 1] for c in ...]``.
    wavenumbers : (n,), 1/L
        Ascending, equally spaced, eight or more.
    error : (n, ...), optional
        Error of the values, in the same unit; by default that of the results.
    speed : float, L/s, optional
        Speed of the wave. If given, delays are in seconds; otherwise they are path lengths, L.
    start : float, L or s, optional
        First delay; by default minus half of the period 2 pi/dk.
    window : {"hann", "taylor", "none"}

    Returns
    -------
    ImpulseResponse

    Raises
    ------
    InvalidInputError
        If the wavenumbers are not as described, or values are not finite.

    Examples
    --------
    By a tangent, an arc and a tangent to a point in the shadow of a sphere.

    >>> import numpy as np
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball, k = sc.Sphere(), np.linspace(10.0, 40.0, 61)
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), cr.shadow_line(ball, (0, 0, 1)), length=4.0, n_rays=24)
    >>> u = [cr.near_field(fan, (0.9, 0.0, 1.5), wavenumber=one, boundary="hard", method="rays") for one in k]
    >>> found = cr.impulse_response(u, k)
    >>> found.arrivals(1).round(1).tolist(), bool(found.error < 0.1)
    ([1.5], True)
    """
    off = error
    if isinstance(values, Sequence) and len(values) and isinstance(values[0], ArrayResult):
        u, off = _of_results(values, error)
    else:
        u = np.asarray(values, dtype=complex)
    c = 1.0 if speed is None else positive_number(speed, "speed")
    first = None if start is None else c * number_between(start, "start", -1e100, 1e100)
    found = band_sum(u, wavenumbers, window=window, what="an impulse response", start=first)
    count = len(found.delay)
    return ImpulseResponse(
        delay=found.delay / c,
        values=found.values,
        error=_bound(found.weights, off, u.shape),
        resolution=found.resolution / c,
        period=float(found.delay[1] - found.delay[0]) * count / c,
        unit="L" if speed is None else "s",
    )


def _bound(weights: FloatArray, error: ArrayLike | None, shape: tuple[int, ...]) -> FloatArray:
    """Bound of the error of a sum over a band with weights (n,) of sum 1, from errors of the values; 0 without them."""
    off = np.zeros(shape) if error is None else np.asarray(error, dtype=float)
    # written so that NaN fails
    bad = ~(off >= 0)
    if off.shape != shape or np.any(bad):
        raise InvalidInputError(
            f"error has shape {off.shape}, {int(bad.sum())} of it no number or negative; give one of 0 or more "
            f"for each of the values {shape}"
        )
    unknown = np.any(np.isinf(off), axis=0)
    return np.where(unknown, np.inf, np.tensordot(weights, np.where(np.isinf(off), 0.0, off), axes=1))


def _of_results(results: Sequence[Any], error: ArrayLike | None) -> tuple[ComplexArray, FloatArray]:
    """Values and errors of results, of one shape."""
    if error is not None:
        raise InvalidInputError("results have errors of their own; leave out error, or give arrays of values")
    shapes = {getattr(one, "shape", None) for one in results}
    if len(shapes) > 1 or not all(isinstance(one, ArrayResult) for one in results):
        raise InvalidInputError(f"results of shapes {shapes} are not one at each wavenumber; give those of one call")
    return np.stack([one.values for one in results]), np.stack([one.error for one in results])


@dataclass(frozen=True, eq=False, repr=False)
class RangeProfile(Drawn):
    """Echo against range.

    Attributes
    ----------
    range : (m,), L
        Ascending; distance R along d of the plane d.x = R, 0 at the origin.
    values : (m,) complex, L
        An isolated echo of amplitude f has this value at its range.
    error : float, L
        Bound of the error at any range, from the errors of the field; 0 if none were given.
    resolution : float, L
        Width of the peak of a single echo at half its power.

    Examples
    --------
    >>> import creeping as cr
    >>> k = np.linspace(100.0, 200.0, 101)
    >>> round(cr.range_profile(np.ones(101), k, window="none").resolution, 3)       # 0.886 pi/(k_N - k_1)
    0.028
    """

    range: FloatArray
    values: ComplexArray
    error: float
    resolution: float

    def __repr__(self) -> str:
        size = np.abs(self.values)
        return (
            f"RangeProfile({len(self.range)} ranges, {self.range[0]:.4g} to {self.range[-1]:.4g})\n"
            f"  resolution {self.resolution:.3g}, up to {size.max():.4g} at {self.range[int(np.argmax(size))]:.4g}, "
            f"error {self.error:.2g} at most"
        )


def range_profile(
    field: ArrayLike, wavenumbers: ArrayLike, *, error: ArrayLike | None = None, window: str = "hann"
) -> RangeProfile:
    """Range profile of backscattered amplitudes.

    Parameters
    ----------
    field : (n,) complex, L
        Backscatter f at the wavenumbers.
    wavenumbers : (n,), 1/L
        Ascending, equally spaced, eight or more.
    error : (n,), L, optional
        Of the field.
    window : {"hann", "taylor", "none"}

    Raises
    ------
    InvalidInputError
        If wavenumbers or errors are not as described.

    Examples
    --------
    >>> k = np.linspace(100.0, 200.0, 201)
    >>> found = range_profile(0.5 * np.exp(2j * k * -1.5), k)                    # an echo from d.x = -1.5
    >>> top = abs(found.values).argmax()
    >>> float(found.range[top].round(2)), float(abs(found.values[top]).round(2))
    (-1.5, 0.5)
    """
    f = np.asarray(field, dtype=complex)
    if f.ndim != 1:
        raise InvalidInputError(f"a range profile takes one value at each wavenumber, not {f.shape}")
    # there and back
    found = band_sum(f, wavenumbers, window=window, what="a range profile")
    bound = float(_bound(found.weights, error, f.shape))
    return RangeProfile(0.5 * found.delay, found.values, bound, 0.5 * found.resolution)
