"""Colours of levels as bytes, from tables made once: a frame has ten thousand of them."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from creeping._typing import FloatArray

Bytes = NDArray[np.uint8]
RANGE = (-50.0, 6.0)
"""Of the field's colours, dB relative to the incident wave: fixed, so that pictures of two incidences compare."""
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


FIELD_COLOURS = ColourTable("magma")
LEVEL_COLOURS = ColourTable("viridis", 0.0, 0.9)


def field_colours(levels: FloatArray) -> Bytes:
    """Colours of decibels (...): ENDED where they are -inf or NaN, the highest on caustics (inf)."""
    share = (np.nan_to_num(levels, nan=RANGE[0], posinf=RANGE[1], neginf=RANGE[0]) - RANGE[0]) / (RANGE[1] - RANGE[0])
    out = FIELD_COLOURS(share)
    out[~(levels > -np.inf)] = ENDED
    return out
