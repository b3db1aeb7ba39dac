"""Decibels: of amplitudes, of cross sections, and the range of them that a picture shows."""

from collections.abc import Iterable

import numpy as np

from creeping._typing import ArrayLike, FloatArray
from creeping.errors import InvalidInputError


def decibels(values: ArrayLike) -> FloatArray:
    """20 log10 |values|, dB relative to the unit of the values: -inf where 0, (...) -> (...).

    Examples
    --------
    >>> decibels([1.0, 0.1, 0.0])
    array([  0., -20., -inf])
    """
    with np.errstate(divide="ignore"):
        return np.asarray(20 * np.log10(np.abs(np.asarray(values))))


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
