"""Where along the line of sight the echo comes from: the inverse transform of the field over a band of frequencies.

    h(R) = sum_n w_n f(k_n) e^{-2 i k_n R} / sum_n w_n,   k_n equally spaced by dk

R is the range along the direction of travel, 0 at the origin of the body's coordinates, positive behind it: an echo
from the plane d.x = R has f ~ e^{2ikR}, so that e^{-2ikR} brings it together. w is a window, whose first side lobes
bound what a strong echo hides. Ranges repeat after pi/dk; two echoes are told apart from about pi/(k_N - k_1) on.

Sources: [H78] for the windows; Derivations, F21.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from typing import NamedTuple

import numpy as np

from creeping._typing import ArrayLike, ComplexArray, FloatArray
from creeping.errors import InvalidInputError

WINDOWS = ("hann", "none", "taylor")
PADDING = 8
"""Samples of the profile for each one that the band resolves."""
EQUAL = 1e-4
"""How far spacings of the wavenumbers may differ from their mean, as a share of it."""


class RangeProfile(NamedTuple):
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
    f, k = np.asarray(field, dtype=complex), np.asarray(wavenumbers, dtype=float)
    if f.ndim != 1 or k.shape != f.shape or len(k) < 8:
        raise InvalidInputError(
            f"a range profile takes eight or more values at as many wavenumbers, not {f.shape} and {k.shape}"
        )
    if not (np.all(np.isfinite(k)) and np.all(np.isfinite(f))):
        raise InvalidInputError("a range profile takes finite values; leave out those that are not resolved")
    steps = np.diff(k)
    step = float(np.mean(steps))
    if not (step > 0 and np.max(np.abs(steps - step)) <= EQUAL * step):
        raise InvalidInputError("a range profile takes ascending, equally spaced wavenumbers")
    weights = _window(window, len(k))
    count = PADDING * len(k)
    # e^{-2i k_n R} with k_n = k_1 + n dk: a discrete transform in n, times the carrier e^{-2i k_1 R}
    sums = np.fft.fftshift(np.fft.fft(weights * f, count))
    ranges = np.fft.fftshift(np.fft.fftfreq(count)) * np.pi / step
    values = sums * np.exp(-2j * k[0] * ranges) / weights.sum()
    return RangeProfile(ranges, np.asarray(values), _resolution(weights, step))


def _window(name: str, count: int) -> FloatArray:
    from scipy.signal import windows

    if name not in WINDOWS:
        raise InvalidInputError(f"window {name!r} is none of {', '.join(WINDOWS)}")
    if name == "none":
        return np.ones(count)
    found = windows.hann(count + 2)[1:-1] if name == "hann" else windows.taylor(count, nbar=4, sll=35)
    return np.asarray(found, dtype=float)


def _resolution(weights: FloatArray, step: float) -> float:
    """Full width at half power of the window's transform, L."""
    count = 64 * len(weights)
    shape = np.abs(np.fft.rfft(weights, count)) / weights.sum()
    below = int(np.argmax(shape < np.sqrt(0.5)))
    # between the bins
    part = (shape[below - 1] - np.sqrt(0.5)) / (shape[below - 1] - shape[below])
    return float(2 * (below - 1 + part) / count * np.pi / step)
