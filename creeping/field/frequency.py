"""Wavenumbers from frequencies and wavelengths: k = 2 pi f/c = 2 pi/lambda.

c is the speed of light in a vacuum, or a given speed of sound.

Also here: the inverse transform of values over a band of wavenumbers: what came by paths of which length.

    h(t) = sum_n w_n u(k_n) e^{-i k_n t} / sum_n w_n,   k_n = k_1 + n dk

A path of length t brings u = a e^{ikt}, and h(t) = a there; w is a window, whose first side lobes bound what a strong
path hides. Delays repeat after 2 pi/dk.

Sources: [BIPM19] for the speed of light, which is exact; [H78] for the windows; Derivations, F21.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from creeping._typing import ArrayLike, ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.storage.memory import within_budget

HERTZ = {"hz": 1.0, "khz": 1e3, "mhz": 1e6, "ghz": 1e9, "thz": 1e12}
"""Units of frequency by their names in small letters, 1/s."""
METRES = {"m": 1.0, "dm": 0.1, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "nm": 1e-9}
"""Units of wavelength, m."""

WINDOWS = ("hann", "none", "taylor")
PADDING = 8
"""Samples for each one that the band resolves."""


def wavenumber(value: str | ArrayLike, *, sound_speed: float | None = None) -> float | FloatArray:
    """Wavenumber k, 1/m, of a frequency or a wavelength.

    Parameters
    ----------
    value : str, float or array of float
        Frequency in Hz, or text with a unit: a frequency ("10 GHz", "38kHz"), a wavelength ("3 cm"), or a range of
        either, "first:last:step", with one unit at the end or one after each number.
    sound_speed : float, m/s, optional
        Speed of sound in the medium; by default the speed of light is used.

    Returns
    -------
    float, or (n,) of float, 1/m
        One number for one value, an array for an array or a range.

    Raises
    ------
    InvalidInputError
        If the value is not positive and finite, or the text cannot be read.

    Examples
    --------
    >>> import creeping as cr
    >>> round(cr.wavenumber("10 GHz"), 3), round(cr.wavenumber(38e3, sound_speed=1477), 3)
    (209.585, 161.653)
    >>> cr.wavenumber("2:4:1GHz").round(2)
    array([41.92, 62.88, 83.83])
    """
    speed = _speed(sound_speed)
    if not isinstance(value, str):
        hertz = _positive(value, "frequency")
        return float(2 * np.pi * hertz / speed) if hertz.ndim == 0 else np.asarray(2 * np.pi * hertz / speed)
    numbers, scale, of_length = _parsed(value)
    values = _positive(scale * numbers, "frequency" if not of_length else "wavelength")
    with np.errstate(over="ignore"):
        found = _positive(2 * np.pi / values if of_length else 2 * np.pi * values / speed, "wavenumber")
    return np.asarray(found) if ":" in value else float(found[0])


def is_length(text: str) -> bool:
    """Whether a text is of wavelengths, else of frequencies.

    Raises
    ------
    InvalidInputError
        If it is neither.

    Examples
    --------
    >>> is_length("3 cm"), is_length("300 MHz")
    (True, False)
    """
    return _parsed(text)[2]


def frequency(wavenumber: ArrayLike, *, sound_speed: float | None = None) -> float | FloatArray:
    """Frequency, Hz, of wavenumbers, 1/m: one number for one, else (n,).

    Examples
    --------
    >>> round(frequency(209.585) / 1e9, 4)
    10.0
    """
    found = _positive(wavenumber, "wavenumber") * _speed(sound_speed) / (2 * np.pi)
    return float(found) if found.ndim == 0 else np.asarray(found)


def suited(
    value: float, units: tuple[tuple[float, str], ...] = ((1e9, "GHz"), (1e6, "MHz"), (1e3, "kHz"), (1.0, "Hz"))
) -> tuple[float, str]:
    """Size and name of the largest unit that a value reaches; of the smallest if it reaches none.

    Examples
    --------
    >>> suited(38e3), suited(0.5)
    ((1000.0, 'kHz'), (1.0, 'Hz'))
    """
    return next((unit for unit in units if value * (1 + 1e-9) >= unit[0]), units[-1])


def _speed(sound_speed: float | None) -> float:
    if sound_speed is None:
        # of light in a vacuum, m/s
        return 299_792_458.0
    if np.ndim(sound_speed) or isinstance(sound_speed, (str, bool)):
        raise InvalidInputError(f"sound_speed = {sound_speed!r} is no number of m/s")
    speed = float(_positive(sound_speed, "sound_speed"))
    # in water that is half air, of 1 bar, sound travels at 24 by Wood's formula; little is slower
    if speed < 10:
        raise InvalidInputError(
            f"sound_speed = {speed:g} m/s is slower than sound in any medium; of {speed:g} km/s give {1000 * speed:g}"
        )
    return speed


def _positive(value: ArrayLike, what: str) -> FloatArray:
    try:
        if np.asarray(value).dtype.kind not in "iuf":
            raise TypeError
        numbers = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInputError(f'{what} = {value!r} is no number; give Hz, or text such as "10 GHz"') from None
    bad = np.atleast_1d(~(np.isfinite(numbers) & (numbers > 0)))
    if np.any(bad):
        first = np.atleast_1d(numbers)[bad.argmax()]
        raise InvalidInputError(f"{what} {first!r} is not a positive finite number ({bad.sum()} of {bad.size} are not)")
    return numbers


def _parsed(text: str) -> tuple[FloatArray, float, bool]:
    """Numbers (n,) of a text, their unit in Hz or m, and whether it is a length."""
    number = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
    parts = [re.fullmatch(rf"\s*({number})\s*([^\W\d]*)\s*", part) for part in text.split(":")]
    known = f"units are {', '.join(['Hz', 'kHz', 'MHz', 'GHz', 'THz', *METRES])}"
    found = [(float(part[1]), part[2]) for part in parts if part]
    if len(found) < len(parts) or len(parts) not in (1, 3):
        raise InvalidInputError(
            f'{text!r} is no frequency or wavelength such as "10 GHz", "3 cm", "2:18:0.1GHz"; {known}'
        )
    last_unit = found[-1][1] or "Hz"
    units = [unit or last_unit for _, unit in found]
    # of frequencies capitals do not matter, of lengths they would
    scales = [HERTZ.get(unit.lower(), METRES.get(unit)) for unit in units]
    unknown = [unit for unit, scale in zip(units, scales, strict=True) if scale is None]
    if unknown:
        raise InvalidInputError(f"{text!r}: unknown unit {unknown[0]!r}; {known}")
    of_length = {unit.lower() not in HERTZ for unit in units}
    if len(of_length) > 1:
        raise InvalidInputError(f"{text!r} mixes units of frequency and of wavelength; give one kind")
    scale = scales[-1] or 1.0
    # in the unit of the last number, whose digits stay what they are
    numbers = [
        value if own == scale else value * (own or 1.0) / scale for (value, _), own in zip(found, scales, strict=True)
    ]
    if len(numbers) == 1:
        return np.array(numbers), scale, of_length.pop()
    first, last, step = numbers
    if not (step > 0 and first > 0 and np.isfinite(last) and last >= first):
        raise InvalidInputError(f"{text!r} is no range: give first:last:step, positive, the first not above the last")
    if first < last < first + step * (1 - 1e-9):
        raise InvalidInputError(f"{text!r} has a step longer than the band; give one of {last - first:g} or less")
    if not (last - first) / step < 100_000:
        raise InvalidInputError(f"{text!r} has {(last - first) / step + 1:.3g} values; 100000 are the most")
    values = first + step * np.arange(int((last - first) / step + 1e-9) + 1)
    return np.asarray(values, dtype=float), scale, of_length.pop()


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
    if k.ndim != 1 or values.shape[:1] != k.shape or len(k) < 8:
        raise InvalidInputError(
            f"{what} takes eight or more values at as many wavenumbers, not {values.shape} and {k.shape}"
        )
    bad = ~np.isfinite(values)
    if not np.all(np.isfinite(k)) or np.any(bad):
        raise InvalidInputError(
            f"{what} takes finite values; {int(bad.sum())} of {bad.size} are not: leave out those that are not resolved"
        )
    # of a wavenumber, mostly for the width of the window's transform, and of a value at it, padded
    needed = len(k) * (1600.0 + 80.0 * PADDING * (values.size // len(k)))
    within_budget(needed, f"{what} of {values.size} values", "give fewer", asked=values.size)
    steps = np.diff(k)
    step = float(np.mean(steps))
    if not (step > 0 and np.max(np.abs(steps - step)) <= 1e-4 * step):
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
    # full width at half power of the window's transform, between its bins
    bins = 64 * len(weights)
    shape, half = np.abs(np.fft.rfft(weights, bins)), np.sqrt(0.5)
    below = int(np.argmax(shape < half))
    part = (shape[below - 1] - half) / (shape[below - 1] - shape[below])
    return BandSum(delay, np.asarray(sums), weights, float(2 * (below - 1 + part) / bins * 2 * np.pi / step))


def _window(name: str, count: int) -> FloatArray:
    from scipy.signal import windows

    if name not in WINDOWS:
        raise InvalidInputError(f"window {name!r} is none of {', '.join(WINDOWS)}")
    if name == "none":
        return np.ones(count)
    found = windows.hann(count + 2)[1:-1] if name == "hann" else windows.taylor(count, nbar=4, sll=35)
    return np.asarray(found, dtype=float)
