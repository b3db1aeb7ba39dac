"""Legend and colour bar, the same beside a matplotlib and a pyvista picture."""

from collections.abc import Sequence

from creeping._typing import Any
from creeping.plotting._strokes import LevelColours, Stroke


def add_legend(figure: Any, everything: Sequence[Stroke]) -> None:
    """Legend under the picture, the shadow line first."""
    from matplotlib.lines import Line2D

    named = sorted((stroke for stroke in everything if stroke.label), key=lambda stroke: -stroke.rank)
    handles = [
        Line2D([], [], color=stroke.colour, linewidth=max(stroke.width, 0.8), alpha=stroke.alpha, label=stroke.label)
        for stroke in named
    ]
    figure.legend(handles=handles, loc="lower center", ncols=min(3, len(handles)), frameon=False, fontsize=8)


def add_colour_bar(figure: Any, colours: LevelColours, ax: Any) -> None:
    """Colour bar of the iso-phase levels, where there are two at least."""
    if colours.high > colours.low:
        bar = figure.colorbar(colours.mappable, ax=ax, shrink=0.6, aspect=24, pad=0.02)
        bar.set_label(f"iso-phase curves: {colours.name}", fontsize=8)
        bar.ax.tick_params(labelsize=8)
        bar.outline.set_linewidth(0.5)
