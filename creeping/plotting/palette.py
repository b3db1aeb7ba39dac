"""Colours and line styles of curves, told apart by people who see red and green alike, and in print without colour.

Any two colours differ by 12 or more (CIEDE2000), also as seen in deuteranopia and protanopia, and each stands on white
with a contrast of 3 to 1; `tests/plotting/test_palette.py` holds them to it.

Also here: bars of colours: their look, and the arrows at their ends for what lies beyond.

Sources: [MOF09] for the simulation.
"""

import numpy as np

from creeping._typing import Any, FloatArray

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#7a0f45", "#3a92fa")
STYLES: tuple[Any, ...] = (
    "-",
    (0, (5, 1.6)),
    (0, (5, 1.6, 1, 1.6)),
    (0, (1.2, 1.2)),
    (0, (9, 1.6)),
    (0, (5, 1.6, 1, 1.6, 1, 1.6)),
)
"""Of matplotlib: no two curves of a picture have the same one until all are taken."""
GREY = "#5a6872"
"""Of marks and lines that are no curve."""
EXACT = "#111111"


def curve_style(number: int, width: float = 1.3) -> dict[str, Any]:
    """Look of a curve by its number in a picture, for matplotlib.

    Later ones lie on top: of two that agree the broken one shows the other through its gaps.
    """
    colour, style = number % len(COLOURS), number % len(STYLES)
    return {
        "color": COLOURS[colour],
        "linestyle": STYLES[style],
        "linewidth": width,
        "zorder": 2.0 + 0.01 * style,
    }


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
