"""Where along the line of sight the echo comes from: the inverse transform of the field over a band of frequencies.

    h(R) = sum_n w_n f(k_n) e^{-2 i k_n R} / sum_n w_n,   k_n equally spaced by dk

R is the range along the direction of travel, 0 at the origin of the body's coordinates, positive behind it: an echo
from the plane d.x = R has f ~ e^{2ikR}, so that e^{-2ikR} brings it together: the sum of `creeping.field.band_sum` at
the delay 2R. Ranges repeat after pi/dk; two echoes are told apart from about pi/(k_N - k_1) on.

Sources: Derivations, F21.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from creeping._presenting import Drawn
from creeping._typing import ArrayLike, ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.band_sum import band_sum


@dataclass(frozen=True, eq=False, repr=False)
class RangeProfile(Drawn):
    """Echo against range.

    Attributes
    ----------
    range : (m,), L
        Ascending; of the plane d.x = R through the origin at 0.
    values : (m,) complex, L
        An isolated echo of amplitude f has this value at its range.
    resolution : float, L
        Width of a single echo at half its height in power.

    Examples
    --------
    >>> import creeping as cr
    >>> k = np.linspace(100.0, 200.0, 101)
    >>> round(cr.range_profile(np.ones(101), k, window="none").resolution, 3)       # 0.886 pi/(k_N - k_1)
    0.028
    """

    range: FloatArray
    values: ComplexArray
    resolution: float

    def __repr__(self) -> str:
        size = np.abs(self.values)
        return (
            f"RangeProfile({len(self.range)} ranges, {self.range[0]:.4g} to {self.range[-1]:.4g})\n"
            f"  resolution {self.resolution:.3g}, up to {size.max():.4g} at {self.range[int(np.argmax(size))]:.4g}"
        )


def range_profile(field: ArrayLike, wavenumbers: ArrayLike, *, window: str = "hann") -> RangeProfile:
    """Range profile of backscattered amplitudes.

    Parameters
    ----------
    field : (n,) complex, L
        Backscatter f at the wavenumbers.
    wavenumbers : (n,), 1/L
        Ascending, equally spaced, eight or more.
    window : {"hann", "taylor", "none"}

    Raises
    ------
    InvalidInputError
        If they are not that.

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
    return RangeProfile(0.5 * found.delay, found.values, 0.5 * found.resolution)
