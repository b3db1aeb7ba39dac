"""Two cuts of levels compared: the residual, its mean and rms, and the measure of the Austin benchmark suite.

    residual = s - s_ref, dB, at the reference's places
    austin   = mean |max(s, T) - max(s_ref, T)|,   T = max s_ref - 80 dB

Sources: [KCY20] for the measure.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from creeping._typing import ArrayLike, FloatArray
from creeping.errors import InvalidInputError

OVERLAP = 0.9
"""Share of the places that a shift has to leave."""
FLOOR = 80.0
"""Depth below the reference's largest value at which levels are cut off, dB."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """Levels of fields in directions or at frequencies against a reference.

    Attributes
    ----------
    values : (m,)
        Places of the reference that lie within the computed ones: degrees or Hz.
    levels, reference : (m,), dB
        Computed, interpolated there, and given.
    shift : float
        What was added to the reference's places to bring both together.
    within : float
        Share of the places where the reference lies within the stated error; NaN without one.

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

    @property
    def residual(self) -> FloatArray:
        """Computed less given (m,), dB."""
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
        """Measure of the Austin suite, dB."""
        least = self.reference.max() - FLOOR
        return float(np.mean(np.abs(np.maximum(self.levels, least) - np.maximum(self.reference, least))))

    def summary(self) -> dict[str, float]:
        """Numbers by name, dB."""
        return {
            "mean_db": self.mean,
            "rms_db": self.rms,
            "largest_db": float(np.max(np.abs(self.residual))),
            "austin_db": self.austin,
            "within_error": self.within,
            "shift": self.shift,
            "places": float(len(self.values)),
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
) -> Comparison:
    """Compare levels with a reference's, over directions or frequencies.

    Parameters
    ----------
    values, levels : (n,), degrees or Hz, and dB
        Computed, ascending; interpolated at the reference's places, so give them finely enough.
    reference_values, reference : (m,)
        Given; what is not finite, or outside the computed places, is left out.
    low, high : (n,), dB, optional
        Levels that the stated error allows.
    align : float, degrees or Hz
        Largest shift of the reference that is tried: a turntable has its own zero.

    Raises
    ------
    InvalidInputError
        If the arrays do not fit, or have no place in common.

    Examples
    --------
    >>> found = compare([0, 1, 2], [0.0, -3.0, -9.0], [0.5, 1.5], [-1.4, -6.0])
    >>> found.residual.round(2).tolist(), round(found.rms, 3)
    ([-0.1, 0.0], 0.071)
    """
    x, y = _pair(values, levels, "values and levels")
    at, given = _pair(reference_values, reference, "reference")
    if np.any(np.diff(x) <= 0):
        raise InvalidInputError("values are not ascending")
    if not (np.isfinite(align) and align >= 0):
        raise InvalidInputError(f"align = {align!r} is not a finite number >= 0")
    # the least shift of those that are as good
    shifts = sorted(np.linspace(-align, align, 201) if align else np.zeros(1), key=abs)
    least = OVERLAP * np.sum(_usable(x, y, at, given))
    off = [_spread(x, y, at + shift, given, least) for shift in shifts]
    shift = float(shifts[int(np.nanargmin(off)) if np.any(np.isfinite(off)) else 0])
    ok = _usable(x, y, at + shift, given)
    if not np.any(ok):
        raise InvalidInputError(
            f"the reference, from {at.min():g} to {at.max():g}, has no place with what was computed, "
            f"from {x[0]:g} to {x[-1]:g}"
        )
    there = at[ok] + shift
    within = np.nan
    if low is not None and high is not None:
        bottom, top = (np.interp(there, x, np.maximum(_pair(x, v, "bounds")[1], -1e3)) for v in (low, high))
        known = np.isfinite(bottom) & np.isfinite(top)
        within = float(np.mean(((given[ok] >= bottom) & (given[ok] <= top))[known])) if np.any(known) else np.nan
    return Comparison(there, np.interp(there, x, y), given[ok], shift, within)


def _pair(values: ArrayLike, levels: ArrayLike, what: str) -> tuple[FloatArray, FloatArray]:
    x, y = np.asarray(values, dtype=float), np.asarray(levels, dtype=float)
    if x.ndim != 1 or x.shape != y.shape or not len(x) or not np.all(np.isfinite(x)):
        raise InvalidInputError(f"{what} of shapes {x.shape} and {y.shape} are not two rows of as many numbers")
    return x, y


def _usable(x: FloatArray, y: FloatArray, at: FloatArray, given: FloatArray) -> FloatArray:
    inside = (at >= x[0]) & (at <= x[-1]) & np.isfinite(given)
    return np.asarray(inside & np.isfinite(np.interp(at, x, y)))


def _spread(x: FloatArray, y: FloatArray, at: FloatArray, given: FloatArray, least: float) -> float:
    """Standard deviation of the residual: a level of its own, as calibrations have, is no shift."""
    ok = _usable(x, y, at, given)
    return float(np.std(np.interp(at[ok], x, y) - given[ok])) if np.any(ok) and np.sum(ok) >= least else np.nan
