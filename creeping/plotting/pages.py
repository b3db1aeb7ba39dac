"""What all pictures share: pages and axes, their names, titles and legends, colours of curves and bars of colours.

Pages are figures outside pyplot that notebooks show: no window, no global state, and their axes answer as pictures. A
notebook asks the last value of a cell for ``_repr_png_``, whichever backend is on.

Any two colours of curves differ by 12 or more (CIEDE2000), also as seen in deuteranopia and protanopia, and each stands
on white with a contrast of 3 to 1; `tests/plotting/test_palette.py` holds them to it. Styles differ as well, for print
without colour.

Sources: [MOF09] for the simulation.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D

from creeping._typing import Any, FloatArray
from creeping.storage.atomic import written_aside

PAGE = (6.4, 4.2)
"""Width and height of a page of curves, inches."""
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
"""Of marks, lines that are no curve, and bodies in section."""
EXACT = "#111111"


class InlineFigure(Figure):
    """A figure that shows itself."""

    def _repr_png_(self) -> bytes:
        """The figure as a PNG."""
        with BytesIO() as stream:
            self.savefig(stream, format="png", dpi=self.dpi)
            return stream.getvalue()


class _Inline:
    """Axes that show the figure that they are in."""

    figure: Any

    def _repr_png_(self) -> bytes:
        """The whole figure as a PNG."""
        return bytes(self.figure._repr_png_())


class InlineAxes(_Inline, Axes):
    """Axes of the plane."""


class InlineAxes3D(_Inline, Axes3D):  # type: ignore[misc, unused-ignore]
    """Axes of space."""


def new_figure(inches: tuple[float, float]) -> InlineFigure:
    """Return a white figure outside pyplot, with a canvas of its own."""
    figure = InlineFigure(figsize=inches, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def axes_or_new(ax: Any, inches: tuple[float, float], *, space: bool = False) -> tuple[bool, Any]:
    """Whether the axes are new, and the axes: those given, or those of a new figure, of the plane or of space."""
    if ax is not None:
        return False, ax
    figure = new_figure(inches)
    figure.set_layout_engine("constrained")
    return True, figure.add_subplot(axes_class=InlineAxes3D if space else InlineAxes)


@contextmanager
def written_figure(path: str | os.PathLike[str], inches: tuple[float, float], dpi: int) -> Iterator[Any]:
    """New figure that is written as a PNG when all is drawn on it."""
    figure = new_figure(inches)
    figure.set_layout_engine("constrained")
    yield figure
    save_figure(figure, path, dpi)


def save_figure(figure: Any, path: str | os.PathLike[str], dpi: int) -> None:
    """Write the figure as PNG, at once when complete."""
    with written_aside(path) as aside:
        figure.savefig(aside, dpi=dpi, format="png")


def add_legend(ax: Any, fresh: bool, legend: bool | None = None) -> None:
    """Legend below a new figure, or on axes that were given if it is asked for; what was drawn last comes first."""
    handles, labels = ax.get_legend_handles_labels()
    if not (fresh if legend is None else legend) or not labels:
        return
    look: dict[str, Any] = {"frameon": False, "fontsize": 8}
    if fresh:
        columns = min(4 if max(map(len, labels)) < 20 else 3, len(labels))
        ax.figure.legend(handles[::-1], labels[::-1], loc="outside lower center", ncols=columns, **look)
    else:
        ax.legend(handles[::-1], labels[::-1], **look)


def finished(ax: Any, fresh: bool, title: str, legend: bool | None = None) -> Any:
    """Axes with the title of a new figure, which is no formula, and their legend."""
    if fresh:
        ax.set_title(title, fontsize=9, parse_math=False)
    add_legend(ax, fresh, legend)
    return ax


def wave_title(field: Any, unit: str) -> str:
    """Wavenumber and boundary of a field, lengths in ``unit``: a title that is no formula, boundaries being users'."""
    return f"k = {field.wavenumber:g}/{unit}, {field.boundary}"


def dressed(ax: Any, across: str, up: str) -> None:
    """Give straight axes their names, grid and ticks."""
    ax.set_xlabel(across, fontsize=9)
    ax.set_ylabel(up, fontsize=9)
    ax.grid(color="#d9dde0", linewidth=0.5)
    ax.tick_params(labelsize=8, direction="in", top=True, right=True, width=0.5, which="both")


def minus(value: float) -> str:
    """A number with a minus sign in place of a hyphen, as the numbers of straight axes have it."""
    return f"{value:g}".replace("-", "\N{MINUS SIGN}")


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


def add_bar(figure: Any, colours: Any, label: str, *, fontsize: float, **place: Any) -> Any:
    """Add the bar of a matplotlib image or mapping of colours, and return it; ``place`` as of ``Figure.colorbar``."""
    bar = figure.colorbar(colours, **place)
    bar.set_label(label, fontsize=fontsize)
    bar.ax.tick_params(labelsize=8, width=0.5)
    bar.outline.set_linewidth(0.5)
    return bar
