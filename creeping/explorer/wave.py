"""The wave itself, as colours that move with its phase: crests and troughs along the rays and on the body.

    colour = h Re(u e^{-i omega t})/|u|,   h = (20 log10 |u| - low)/(high - low), within 0..1

so that waves are seen through the whole range of the colours, deep in the shadow too. Between two steps of a ray the
eikonal is linear, as it is along any ray, and the rest of the wave, which is slow to vary, is taken as linear; the
quarter of a turn of a caustic is spread over the step that passes it.

Also here: colours of levels as bytes, from tables made once: a frame has ten thousand of them.

Sources: Derivations, F3.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from creeping._typing import ComplexArray, FloatArray
from creeping.plotting.coloured_body import LEAST_SAMPLES, at_phase
from creeping.rays.fan import RayFan

Bytes = NDArray[np.uint8]
MOST, LEAST, STEP = 60.0, 10.0, 5.0
"""Largest and smallest range of the field's colours, and what its ends are multiples of, dB."""
ENDED = (150, 156, 162)
"""Colour where a ray has ended or no ray passes."""
_SHARE = np.arange(256) / 255
LINEAR: Bytes = np.round(255 * np.where(_SHARE <= 0.04045, _SHARE / 12.92, ((_SHARE + 0.055) / 1.055) ** 2.4)).astype(
    np.uint8
)
"""Bytes of colours as the page takes them at vertices, where it has light and no sRGB."""


Span = tuple[float, float]


@dataclass(frozen=True, eq=False)
class RayWave:
    """The field along rays, fine enough to show its phase.

    Attributes
    ----------
    segments : (rays (points - 1), 2, 3) of float32
    values : (rays, points) complex
        Of modulus 1: e^{i arg u}.
    levels : (rays, points), dB
        -inf where a ray has ended.
    """

    segments: FloatArray
    values: ComplexArray
    levels: FloatArray


def ray_wave(fan: RayFan, envelope: ComplexArray, levels: FloatArray, wavenumber: float) -> RayWave | None:
    """The wave of rays from its envelope and levels at their steps (rays, steps); None if too short to be drawn."""
    rays, steps = levels.shape
    if not rays:
        return None
    waves = wavenumber * float(fan.travel_time[1] - fan.travel_time[0]) / (2 * np.pi)
    # six points a wavelength, unless rays have too many segments
    parts = max(1, min(int(np.ceil(6.0 * waves)), 60_000 // (rays * (steps - 1))))
    if parts < LEAST_SAMPLES * waves:
        return None
    slow = np.unwrap(np.angle(np.where(np.isfinite(envelope), envelope, 1.0)), axis=1)
    ended = _between(np.isneginf(levels).astype(float), parts) > 0
    fine = _between(np.clip(levels, -1e3, 1e3), parts)
    return RayWave(
        segments(_between(fan.points, parts)),
        np.exp(1j * _between(wavenumber * fan.eikonal + slow, parts)),
        np.where(ended, -np.inf, fine),
    )


def strengths(values: ComplexArray, levels: FloatArray, span: Span) -> ComplexArray:
    """h u/|u| of fields (...) and their levels, dB: NaN where there is none, of modulus 1 at most."""
    low, high = span
    share = np.clip((np.nan_to_num(levels, nan=low, posinf=high, neginf=low) - low) / (high - low), 0.0, 1.0)
    size = np.abs(values)
    known = np.isfinite(size) & (size > 0)
    unit = np.where(known, values, 1.0) / np.where(known, size, 1.0)
    return np.where(levels > -np.inf, share * unit, np.nan)


def wave_colours(strength: ComplexArray, phase: float) -> Bytes:
    """Colours of `strengths` (...) when omega t = phase, radians: (..., 3); ENDED where there is no field."""
    height = at_phase(strength, phase)
    out = WAVE_COLOURS(0.5 + 0.5 * np.nan_to_num(height))
    out[np.isnan(height)] = ENDED
    return out


def segments(points: FloatArray, *, closed: bool = False) -> FloatArray:
    """Segments of lines (n, m, 3): (k, 2, 3) of float32."""
    if closed:
        points = np.concatenate([points, points[:, :1]], axis=1)
    pairs = np.stack([points[:, :-1], points[:, 1:]], axis=2)
    return np.ascontiguousarray(pairs.reshape(-1, 2, 3), dtype=np.float32)


def _between(values: FloatArray, parts: int) -> FloatArray:
    """Values (rays, steps, ...) with each step cut into equal parts, linear: (rays, (steps - 1) parts + 1, ...)."""
    share = (np.arange(parts) / parts).reshape(-1, *[1] * (values.ndim - 2))
    first, last = values[:, :-1, None], values[:, 1:, None]
    cut = (first + share * (last - first)).reshape(len(values), -1, *values.shape[2:])
    return np.concatenate([cut, values[:, -1:]], axis=1)


class ColourTable:
    """A map of matplotlib from 0..1 to bytes.

    Parameters
    ----------
    name : str
    low, high : float
        Part of the map that is used.
    """

    def __init__(self, name: str, low: float = 0.0, high: float = 1.0) -> None:
        self.name, self.low, self.high = name, low, high

    @cached_property
    def table(self) -> Bytes:
        """The colours (256, 3)."""
        from matplotlib import colormaps

        return np.asarray(colormaps[self.name](np.linspace(self.low, self.high, 256), bytes=True)[:, :3])

    def __call__(self, share: FloatArray) -> Bytes:
        """Colours of numbers in 0..1, clipped to it: (...) -> (..., 3)."""
        return self.table[np.clip(255 * np.asarray(share), 0, 255).astype(np.intp)]

    def hexadecimal(self, share: float) -> str:
        """One colour as text."""
        r, g, b = self(np.array(share))
        return f"#{r:02x}{g:02x}{b:02x}"


FIELD_COLOURS = ColourTable("magma")


WAVE_COLOURS = ColourTable("RdBu_r")


LEVEL_COLOURS = ColourTable("viridis", 0.0, 0.9)


def fitted_span(levels: FloatArray | None, before: Span | None = None) -> Span:
    """Range of colours that fits decibels (...), relative to the incident wave; the one before while that fits too.

    Neither the few points beside a caustic nor those in the deepest shadow stretch it.
    """
    finite = np.zeros(0) if levels is None else levels[np.isfinite(levels)]
    if not len(finite):
        return before or (-50.0, 5.0)
    least, most = np.percentile(finite, [1.0, 99.0])
    # by so much data may leave their range or fall short of it: it does not flicker
    if before and abs(most - before[1]) < 7.5 and abs(max(least, most - MOST) - before[0]) < 7.5:
        return before
    high = float(STEP * np.ceil(most / STEP))
    low = float(STEP * np.floor(max(least, high - MOST) / STEP))
    return min(low, high - LEAST), high


def field_colours(levels: FloatArray, span: Span) -> Bytes:
    """Colours of decibels (...): ENDED where they are -inf or NaN, the highest on caustics (inf)."""
    low, high = span
    share = (np.nan_to_num(levels, nan=low, posinf=high, neginf=low) - low) / (high - low)
    out = FIELD_COLOURS(share)
    out[~(levels > -np.inf)] = ENDED
    return out
