"""An echo, its levels in decibels, and two cuts of levels compared.

An echo has amplitudes by channel, angle and wavenumber.

    radar cross section   sigma = 4 pi |f|^2,   10 log10 sigma, dBsm
    target strength       TS = 20 log10 |f|, dB re 1 m

Of two cuts: the residual, its mean and rms, and the measure of the Austin benchmark suite.

    residual = s - s_ref, dB, at the reference's places, which may repeat after a period
    austin   = mean |max(s, T) - max(s_ref, T)|,   T = max s_ref - 80 dB

Also here: decibels of amplitudes, of cross sections, and the range of them that a picture shows.

Sources: [S08] for the cross section, [U83] for target strength, [KCY20] for the measure.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from creeping._presenting import Drawn
from creeping._typing import Any, ArrayLike, BoolArray, ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.frequency import frequency
from creeping.field.results.labelled import Tabled, dataset, power

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True, eq=False)
class Comparison:
    """Computed levels against reference levels, over angle or frequency.

    Attributes
    ----------
    values : (m,)
        Reference angles or frequencies within the computed range: degrees or Hz.
    levels, reference : (m,), dB
        Computed levels, interpolated at ``values``, and reference levels.
    shift : float, degrees or Hz
        Shift of the reference angles or frequencies that gives the best agreement.
    within : float
        Share of the points at which the reference lies within the stated error; NaN if no error was given.
    wrapped : int
        Number of reference points that were moved by whole periods into the computed range.

    Examples
    --------
    >>> import creeping as cr
    >>> found = cr.compare([0, 10, 20], [-10.0, -12.0, -20.0], [0, 10], [-10.5, -12.5])
    >>> found.mean, found.summary()["places"]
    (0.5, 2.0)
    """

    values: FloatArray
    levels: FloatArray
    reference: FloatArray
    shift: float
    within: float
    wrapped: int = 0

    @property
    def residual(self) -> FloatArray:
        """Computed minus reference level (m,), dB."""
        return self.levels - self.reference

    @property
    def mean(self) -> float:
        """Mean of the residual, dB."""
        return float(np.mean(self.residual))

    @property
    def rms(self) -> float:
        """Rms of the residual, dB."""
        return float(np.sqrt(np.mean(self.residual**2)))

    @property
    def austin(self) -> float:
        """Mean |residual|, dB, as in Austin RCS benchmarks: levels are cut off 80 dB below the largest reference."""
        least = self.reference.max() - 80.0
        return float(np.mean(np.abs(np.maximum(self.levels, least) - np.maximum(self.reference, least))))

    def summary(self) -> dict[str, float]:
        """Statistics by name: residuals in dB, share within the error, shift, number of points."""
        return {
            "mean_db": self.mean,
            "rms_db": self.rms,
            "largest_db": float(np.max(np.abs(self.residual))),
            "austin_db": self.austin,
            "within_error": self.within,
            "shift": self.shift,
            "places": float(len(self.values)),
            "wrapped": float(self.wrapped),
        }


def compare(
    values: ArrayLike,
    levels: ArrayLike,
    reference_values: ArrayLike,
    reference: ArrayLike,
    *,
    low: ArrayLike | None = None,
    high: ArrayLike | None = None,
    align: float = 0.0,
    period: float | None = None,
) -> Comparison:
    """Compare computed levels with reference levels, over angle or frequency.

    Parameters
    ----------
    values, levels : (n,), degrees or Hz, and dB
        Computed angles or frequencies, ascending, and levels. Sample finely: levels are interpolated at the reference.
    reference_values, reference : (m,)
        Reference, in the units of ``values`` and ``levels``. Points that are not finite or lie outside the computed
        range are left out.
    low, high : (n,), dB, optional
        Levels that the stated error allows.
    align : float, degrees or Hz
        Largest shift of the reference to try, e.g. for the unknown zero of a turntable.
    period : float, optional
        Period of ``values``: 360 for azimuths in degrees, so that a reference over 0 to 360 matches -180 to 180.
        Leave it out for polar angles and frequencies.

    Raises
    ------
    InvalidInputError
        If the shapes of the arrays differ, or the reference and the computed range do not overlap.

    Examples
    --------
    >>> found = compare([0, 1, 2], [0.0, -3.0, -9.0], [0.5, 1.5], [-1.4, -6.0])
    >>> found.residual.round(2).tolist(), round(found.rms, 3)
    ([-0.1, 0.0], 0.071)
    >>> found = compare([-90, 0, 90], [-1.0, 0.0, -3.0], [0, 270], [0.0, -1.5], period=360.0)
    >>> found.values.tolist(), found.residual.tolist(), found.wrapped
    ([-90.0, 0.0], [0.5, 0.0], 1)
    """
    x, y = _pair(values, levels, "values and levels")
    at, given = _pair(reference_values, reference, "reference")
    if np.any(np.diff(x) <= 0):
        raise InvalidInputError("values are not ascending")
    if not (np.isfinite(align) and align >= 0):
        raise InvalidInputError(f"align = {align!r} is not a finite number >= 0")
    if period is not None and not (np.isfinite(period) and period > 0):
        raise InvalidInputError(f"period = {period!r} is not a finite number > 0; 360 is that of azimuths in degrees")
    ends, closed = (float(x[0]), float(x[-1])), _closes(x, period)
    if closed:
        x, y = np.append(x, x[0] + (period or 0.0)), np.append(y, y[0])
    # the least shift of those that are as good
    shifts = sorted(np.linspace(-align, align, 201) if align else np.zeros(1), key=abs)
    # a shift has to leave nine tenths of the places
    least = 0.9 * np.sum(_usable(x, y, _turned(x, at, period), given))
    off = [_spread(x, y, _turned(x, at + shift, period), given, least) for shift in shifts]
    shift = float(shifts[int(np.nanargmin(off)) if np.any(np.isfinite(off)) else 0])
    places = _turned(x, at + shift, period)
    ok = _usable(x, y, places, given)
    if not np.any(ok):
        again = "" if period is None else f", whole periods of {period:g} apart or not"
        raise InvalidInputError(
            f"the reference, from {at.min():g} to {at.max():g}, has no place in common with the computed range, "
            f"from {ends[0]:g} to {ends[1]:g}{again}"
        )
    there, here = places[ok], given[ok]
    wrapped = int(np.sum(there != (at + shift)[ok]))
    if wrapped:
        # what came round the period stands where it belongs
        order = np.argsort(there, kind="stable")
        there, here = there[order], here[order]
    within = np.nan
    if low is not None and high is not None:
        bounds = [np.maximum(_pair(values, v, "bounds")[1], -1e3) for v in (low, high)]
        bottom, top = (np.interp(there, x, np.append(v, v[:1]) if closed else v) for v in bounds)
        known = np.isfinite(bottom) & np.isfinite(top)
        within = float(np.mean(((here >= bottom) & (here <= top))[known])) if np.any(known) else np.nan
    return Comparison(there, np.interp(there, x, y), here, shift, within, wrapped)


def _closes(x: FloatArray, period: float | None) -> bool:
    """Whether values (n,) go round a period but for the step from the last to the first."""
    if period is None or len(x) < 2:
        return False
    left = x[0] + period - x[-1]
    return bool(0 < left <= np.max(np.diff(x)) * (1 + 1e-9))


def _turned(x: FloatArray, at: FloatArray, period: float | None) -> FloatArray:
    """Places, those beyond the values (n,) by whole periods within the first one of them."""
    if period is None:
        return at
    beyond = (at < x[0]) | (at > x[-1])
    return np.where(beyond, x[0] + np.mod(at - x[0], period), at)


def _pair(values: ArrayLike, levels: ArrayLike, what: str) -> tuple[FloatArray, FloatArray]:
    x, y = np.asarray(values, dtype=float), np.asarray(levels, dtype=float)
    if x.ndim != 1 or x.shape != y.shape or not len(x) or not np.all(np.isfinite(x)):
        raise InvalidInputError(f"{what} of shapes {x.shape} and {y.shape} are not two rows of equal length")
    return x, y


def _usable(x: FloatArray, y: FloatArray, at: FloatArray, given: FloatArray) -> FloatArray:
    inside = (at >= x[0]) & (at <= x[-1]) & np.isfinite(given)
    return np.asarray(inside & np.isfinite(np.interp(at, x, y)))


def _spread(x: FloatArray, y: FloatArray, at: FloatArray, given: FloatArray, least: float) -> float:
    """Standard deviation of the residual: a level of its own, as calibrations have, is no shift."""
    ok = _usable(x, y, at, given)
    return float(np.std(np.interp(at[ok], x, y) - given[ok])) if np.any(ok) and np.sum(ok) >= least else np.nan


def decibels(values: ArrayLike) -> FloatArray:
    """20 log10 |values|, dB relative to the unit of the values: -inf where 0, (...) -> (...).

    Examples
    --------
    >>> decibels([1.0, 0.1, 0.0])
    array([  0., -20., -inf])
    """
    with np.errstate(divide="ignore"):
        return np.asarray(20 * np.log10(np.abs(np.asarray(values))))


def error_decibels(values: ArrayLike, error: ArrayLike) -> FloatArray:
    """By how many decibels |values| + error lies above |values|, (...) -> (...).

    Examples
    --------
    >>> error_decibels([1.0, 0.0], [1.0, 1.0]).round(2).tolist()
    [6.02, inf]
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(20 * np.log10(1 + np.asarray(error) / np.abs(np.asarray(values))))


def cross_section_decibels(values: ArrayLike) -> FloatArray:
    """10 log10(4π|f|²) of far fields f, L: dB relative to L^2, dBsm if L is the metre, (...) -> (...)."""
    return np.asarray(decibels(values) + 10 * np.log10(4 * np.pi))


def shown_range(levels: Iterable[FloatArray], span: float, *, step: float = 5.0) -> tuple[float, float]:
    """Lowest and highest decibel of a picture, multiples of ``step``, at most ``span`` apart.

    Nulls reach -inf and caustics +inf; neither stretches the range.

    Raises
    ------
    InvalidInputError
        If the span is not positive, or no level is finite.
    """
    if not (np.isfinite(span) and span > 0):
        raise InvalidInputError(f"span = {span!r} dB is not a positive finite number")
    joined = np.concatenate([np.asarray(level, dtype=float).ravel() for level in levels] or [np.zeros(0)])
    finite = joined[np.isfinite(joined)]
    if not len(finite):
        raise InvalidInputError(
            f"none of {len(joined)} values can be drawn in dB: all are 0 or not finite; "
            "longer rays (length=) reach more of the shadow"
        )
    high = step * np.ceil(finite.max() / step + 1e-9)
    low = max(step * np.floor(finite.min() / step), high - step * np.ceil(span / step))
    return float(low), float(max(high, low + step))


LEVELS = {"rcs": ("radar cross section", "dBsm"), "ts": ("target strength", "dB re 1 m")}
"""Names of the levels, and their units where lengths are metres."""


@dataclass(frozen=True, eq=False, repr=False)
class Echo(Drawn, Tabled):
    """Echo in c channels at n angles and k wavenumbers; lengths are in metres.

    Attributes
    ----------
    quantity : {"rcs", "ts"}
    channels : tuple of str
        Polarisations, received then transmitted, or a boundary.
    angle_name : str
        "azimuth" or "elevation", the angle that varies; "" for one direction.
    azimuth, elevation : (n,), degrees
        Of the radar, or of the observers of a bistatic cut, as seen from the body.
    incidence : (azimuth, elevation), degrees, or None
        Of the radar of a bistatic cut; None in backscatter.
    wavenumbers : (k,), 1/m
    total : (c, n, k) complex, m
        Amplitude f.
    parts : dict of str to (c, n, k) complex, m
        Contributions that add up to ``total`` (creeping, reflected, forward); NaN where no rays were summed.
    error : (c, n, k), m
        Error of |f|.
    unresolved : (c, n, k) of bool
        Whether an expansion fails or the error is large, as in `FarField`.
    by_currents : (c, n, k) of bool
        Whether currents, the integral equation or a T-matrix gave the value, rather than rays.
    sound_speed : float, m/s, optional
        Speed of the wave; the speed of light if None.
    otherwise : str
        Method used where ``by_currents`` is False: "rays", or "rays+optics" for a body with edges, joints or tips.

    Raises
    ------
    InvalidInputError
        If the arrays do not fit each other.

    Examples
    --------
    >>> import creeping as cr, scatterers as sc
    >>> from creeping.sweeping.echoes import echo_of
    >>> ds = cr.backscatter(sc.Sphere(0.15), wavenumbers=[200.0, 210.0])
    >>> echo = echo_of(ds, "rcs", ("VV", "HH"), "")
    >>> echo.levels().shape, echo.levels()[0, 0].round(1).tolist()
    ((2, 1, 2), [-11.4, -11.4])
    """

    quantity: str
    channels: tuple[str, ...]
    angle_name: str
    azimuth: FloatArray
    elevation: FloatArray
    incidence: tuple[float, float] | None
    wavenumbers: FloatArray
    total: ComplexArray
    parts: dict[str, ComplexArray]
    error: FloatArray
    unresolved: BoolArray
    by_currents: BoolArray
    sound_speed: float | None = None
    otherwise: str = "rays"

    def __post_init__(self) -> None:
        if self.quantity not in LEVELS:
            raise InvalidInputError(f"quantity {self.quantity!r} is none of {', '.join(LEVELS)}")
        shape = (len(self.channels), len(self.azimuth), len(self.wavenumbers))
        flags = {"error": self.error, "unresolved": self.unresolved, "by_currents": self.by_currents}
        for name, values in {"total": self.total, **self.parts, **flags}.items():
            if values.shape != shape:
                raise InvalidInputError(f"{name} of an echo has shape {values.shape}, not {shape}")
        if self.elevation.shape != self.azimuth.shape:
            raise InvalidInputError(f"elevation has shape {self.elevation.shape}, not {self.azimuth.shape}")

    def __repr__(self) -> str:
        told = self.summary()
        kind = "pec" if self.quantity == "rcs" else self.channels[0]
        tops = ", ".join(f"{c} up to {'none' if v is None else f'{v:.1f}'}" for c, v in told["largest"].items())
        return (
            f"Echo({told['quantity']}, {kind}, {told['angles']} angles x {told['frequencies']} frequencies)\n"
            f"  {tops} {told['unit']}; {told['unresolved']} of {told['values']} values unresolved"
        )

    @property
    def angles(self) -> FloatArray:
        """Azimuth or elevation, whichever varies: (n,), degrees."""
        return self.elevation if self.angle_name == "elevation" else self.azimuth

    @property
    def hertz(self) -> FloatArray:
        """Frequencies (k,), Hz, rounded to 14 digits, which removes the rounding of the wavenumbers."""
        found = np.atleast_1d(frequency(self.wavenumbers, sound_speed=self.sound_speed))
        return np.array([float(f"{value:.14g}") for value in found])

    @property
    def viewer(self) -> str:
        """Sensor that observes the body: "radar" or "sonar"."""
        return "radar" if self.quantity == "rcs" else "sonar"

    @property
    def level_name(self) -> tuple[str, str]:
        """Name of the level, e.g. "radar cross section", and its unit."""
        return LEVELS[self.quantity]

    def levels(self, amplitude: ComplexArray | FloatArray | None = None) -> FloatArray:
        """Levels, dB, of ``total`` (c, n, k), or of another amplitude (...), m, in the shape of that amplitude."""
        values = self.total if amplitude is None else amplitude
        return cross_section_decibels(values) if self.quantity == "rcs" else decibels(values)

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Levels, dB, of |f| - error and |f| + error: (c, n, k) each; the lower may be -inf."""
        size = np.abs(self.total)
        return self.levels(np.maximum(size - self.error, 0.0)), self.levels(size + self.error)

    def to_xarray(self) -> xarray.Dataset:
        """``xarray.Dataset`` of amplitude, parts, level, error and flags by channel, angle and frequency."""
        dims = ("channel", "angle", "frequency")
        coordinates: dict[str, Any] = {
            "channel": (("channel",), list(self.channels)),
            "angle": (("angle",), self.angles, {"units": "degree", "long_name": self.angle_name or "angle"}),
            "azimuth": (("angle",), self.azimuth, {"units": "degree"}),
            "elevation": (("angle",), self.elevation, {"units": "degree"}),
            "frequency": (("frequency",), self.hertz, {"units": "Hz"}),
            "wavenumber": (("frequency",), self.wavenumbers, {"units": power("m", -1), "long_name": "k"}),
        }
        name, unit = self.level_name
        variables: dict[str, Any] = {
            "total": (dims, self.total, {"units": "m", "long_name": "far-field amplitude f"}),
            "level": (dims, self.levels(), {"units": unit, "long_name": name}),
            "error": (dims, self.error, {"units": "m", "long_name": "error of |f|"}),
            "unresolved": (dims, self.unresolved, {"long_name": "an expansion fails, or the error is large"}),
            "by_currents": (dims, self.by_currents, {"long_name": f"else by {self.otherwise}"}),
        }
        variables |= {part: (dims, values, {"units": "m"}) for part, values in self.parts.items()}
        return dataset(variables, coordinates)

    def summary(self) -> dict[str, Any]:
        """Numbers of angles and frequencies, largest level per channel, error, number of unresolved values, by name."""
        levels, off = self.levels(), error_decibels(self.total, self.error)
        known = off[np.isfinite(off)]
        return {
            "quantity": LEVELS[self.quantity][0],
            "unit": LEVELS[self.quantity][1],
            "channels": list(self.channels),
            "angles": len(self.azimuth),
            "frequencies": len(self.wavenumbers),
            "largest": {
                c: _finite(np.max(v, initial=-np.inf, where=np.isfinite(v)))
                for c, v in zip(self.channels, levels, strict=True)
            },
            "not_finite": int(np.sum(~np.isfinite(self.total))),
            "error_db_median": _finite(np.median(known)) if known.size else None,
            "error_db_95": _finite(np.quantile(known, 0.95)) if known.size else None,
            "unresolved": int(self.unresolved.sum()),
            "by_currents": int(self.by_currents.sum()),
            "otherwise_by": self.otherwise,
            "values": int(levels.size),
        }


def _finite(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None
