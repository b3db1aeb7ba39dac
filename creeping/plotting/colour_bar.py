"""Bars of colours: their look, and the arrows at their ends for what lies beyond."""

import numpy as np

from creeping._typing import Any, FloatArray


def beyond(values: FloatArray, low: float, high: float) -> str:
    """Ends of a bar from ``low`` to ``high`` that some values (...) lie beyond: "neither", "min", "max" or "both".

    Examples
    --------
    >>> beyond(np.array([-1.0, 0.5, np.nan]), 0.0, 1.0), beyond(np.array([0.5]), 0.0, 1.0)
    ('min', 'neither')
    """
    ends = ("min" if np.any(values < low) else "") + ("max" if np.any(values > high) else "")
    return {"": "neither", "minmax": "both"}.get(ends, ends)


def add_bar(figure: Any, colours: Any, label: str, *, extend: str, fontsize: float, **place: Any) -> None:
    """Add the bar of a matplotlib image or mapping of colours; ``place`` as of ``Figure.colorbar``."""
    bar = figure.colorbar(colours, extend=extend, **place)
    bar.set_label(label, fontsize=fontsize)
    bar.ax.tick_params(labelsize=8, width=0.5)
    bar.outline.set_linewidth(0.5)
