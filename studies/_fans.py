"""Creeping rays of one incidence as a pair of panels: on the body, and in the plane of its parameters."""

from collections.abc import Sequence

import creeping as cr
from creeping._typing import Any, FloatArray
from creeping.plotting import axes3d, plot_parameters
from creeping.plotting._drawing import Drawing, compose
from studies._curves import add_level_bar

RAY_COUNT = 32


def on_body(ax: Any, fan: cr.RayFan, curves: Sequence[cr.IsoPhaseCurve]) -> Drawing:
    """Draw shadow line, rays and iso-phase curves on 3-D axes."""
    drawing = compose(fan.line, fan, curves, rays=RAY_COUNT)
    axes3d.draw(ax, drawing)
    return drawing


def in_parameters(ax: Any, fan: cr.RayFan, curves: Sequence[cr.IsoPhaseCurve]) -> None:
    """Draw the same over the parameters, degrees, without legend."""
    plot_parameters(fan.line, fan, curves, ax=ax, rays=RAY_COUNT, legend=False)


def add_keys(
    figure: Any, drawings: Sequence[Drawing], levels: FloatArray, bar: tuple[float, float, float, float]
) -> None:
    """One legend under all panels, of whatever any of them shows, and one colour bar."""
    add_legend(figure, drawings)
    label = f"iso-phase curves: {drawings[0].colours.name} $t$"
    add_level_bar(figure, drawings[0].colours, levels, label, cax=figure.add_axes(bar))


def add_legend(figure: Any, drawings: Sequence[Drawing]) -> None:
    """One legend under all panels, of whatever any of them shows."""
    from matplotlib.lines import Line2D

    named = {stroke.label: stroke for drawing in drawings for stroke in drawing.strokes if stroke.label}
    ordered = sorted(named.values(), key=lambda stroke: -stroke.rank)
    handles = [
        Line2D([], [], color=stroke.colour, lw=max(stroke.width, 0.9), alpha=stroke.alpha, label=stroke.label)
        for stroke in ordered
    ]
    figure.legend(handles=handles, loc="lower center", ncols=len(handles), frameon=False, fontsize=8)
