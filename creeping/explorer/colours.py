"""Colours of levels as bytes, from tables made once: a frame has ten thousand of them."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from creeping._typing import FloatArray

Bytes = NDArray[np.uint8]
MOST, LEAST, STEP = 60.0, 10.0, 5.0
"""Largest and smallest range of the field's colours, and what its ends are multiples of, dB."""
KEPT = 7.5
"""By how much data may leave their range or fall short of it, dB, before it changes: it does not flicker."""
Span = tuple[float, float]
ENDED = (150, 156, 162)
"""Colour where a ray has ended or no ray passes."""


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


_SHARE = np.arange(256) / 255
LINEAR: Bytes = np.round(255 * np.where(_SHARE <= 0.04045, _SHARE / 12.92, ((_SHARE + 0.055) / 1.055) ** 2.4)).astype(
    np.uint8
)
"""Bytes of colours as the page takes them at vertices, where it has light and no sRGB."""
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
    if before and abs(most - before[1]) < KEPT and abs(max(least, most - MOST) - before[0]) < KEPT:
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
