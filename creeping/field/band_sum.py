"""The inverse transform of values over a band of wavenumbers: what came by paths of which length.

    h(t) = sum_n w_n u(k_n) e^{-i k_n t} / sum_n w_n,   k_n = k_1 + n dk

A path of length t brings u = a e^{ikt}, and h(t) = a there; w is a window, whose first side lobes bound what a strong
path hides. Delays repeat after 2 pi/dk.

Sources: [H78] for the windows; Derivations, F21.
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import ArrayLike, ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.storage.memory import within_budget

WINDOWS = ("hann", "none", "taylor")
PADDING = 8
"""Samples for each one that the band resolves."""
LEAST = 8
"""Wavenumbers of a band."""
POINT_BYTES, VALUE_BYTES = 1600.0, 80.0 * PADDING
"""Of a wavenumber, mostly for the width of the window's transform, and of a value at it, padded."""
EQUAL = 1e-4
"""How far spacings of the wavenumbers may differ from their mean, as a share of it."""


class BandSum(NamedTuple):
    """Delays (m,), L, ascending; sums (m, ...); weights (n,) of sum 1; width at half power (resolution), L."""

    delay: FloatArray
    values: ComplexArray
    weights: FloatArray
    resolution: float


def band_sum(
    values: ComplexArray, wavenumbers: ArrayLike, *, window: str, what: str, start: float | None = None
) -> BandSum:
    """Sums over a band of values (n, ...) at wavenumbers (n,), 1/L; the first delay is ``start``, L, or minus half.

    Raises
    ------
    InvalidInputError
        If the wavenumbers are not as many, eight or more, finite, ascending and equally spaced, values are not finite,
        or there is no such window.
    """
    k = np.asarray(wavenumbers, dtype=float)
    if k.ndim != 1 or values.shape[:1] != k.shape or len(k) < LEAST:
        raise InvalidInputError(
            f"{what} takes eight or more values at as many wavenumbers, not {values.shape} and {k.shape}"
        )
    bad = ~np.isfinite(values)
    if not np.all(np.isfinite(k)) or np.any(bad):
        raise InvalidInputError(
            f"{what} takes finite values; {int(bad.sum())} of {bad.size} are not: leave out those that are not resolved"
        )
    within_budget(
        len(k) * (POINT_BYTES + VALUE_BYTES * (values.size // len(k))),
        f"{what} of {values.size} values",
        "give fewer",
        asked=values.size,
    )
    steps = np.diff(k)
    step = float(np.mean(steps))
    if not (step > 0 and np.max(np.abs(steps - step)) <= EQUAL * step):
        raise InvalidInputError(f"{what} takes ascending, equally spaced wavenumbers")
    weights = _window(window, len(k))
    weights = weights / weights.sum()
    count, period = PADDING * len(k), 2 * np.pi / step
    first = -0.5 * period if start is None else start
    delay = first + period * np.arange(count) / count

    def column(of: FloatArray | ComplexArray) -> ComplexArray:
        return np.asarray(of, dtype=complex).reshape(-1, *(1,) * (values.ndim - 1))

    # e^{-ik_n t} = e^{-i n dk first} e^{-2 pi i n j/count} e^{-ik_1 t} at the delay of number j
    turned = values * column(weights * np.exp(-1j * step * first * np.arange(len(k))))
    sums = np.fft.fft(turned, count, axis=0) * column(np.exp(-1j * k[0] * delay))
    return BandSum(delay, np.asarray(sums), weights, _resolution(weights, step))


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
    shape = np.abs(np.fft.rfft(weights, count))
    below = int(np.argmax(shape < np.sqrt(0.5)))
    # between the bins
    part = (shape[below - 1] - np.sqrt(0.5)) / (shape[below - 1] - shape[below])
    return float(2 * (below - 1 + part) / count * 2 * np.pi / step)
