"""Whole figures as PNG files: the body in space, by pyvista or matplotlib, and the parameter plane."""

import os
from collections.abc import Sequence
from typing import Unpack

import numpy as np

from creeping._typing import Any
from creeping.errors import InvalidInputError
from creeping.plotting import axes3d
from creeping.plotting._drawing import Drawing, View, compose
from creeping.plotting._strokes import ARROW_COLOUR, RayOptions
from creeping.plotting.pages import new_figure, save_figure
from creeping.plotting.scene import gl_available, render
from creeping.rays.fan import RayFan
from creeping.rays.isophase import IsoPhaseCurve
from creeping.shadow.line import ShadowLine

WIDTH = 6.4  # inches
TITLE_SIZE = 8.0
"""Of the letters of a title, points."""
FINER = 1.6
"""Pixels of what OpenGL renders for each of the file, along a side."""
Place = tuple[float, float, float, float]  # left, bottom, width, height, as shares of the figure


def picture(
    path: str | os.PathLike[str],
    line: ShadowLine,
    fan: RayFan | None = None,
    curves: Sequence[IsoPhaseCurve] = (),
    *,
    backend: str = "auto",
    view: View | None = None,
    name: str = "",
    dpi: int = 300,
    **shown: Unpack[RayOptions],
) -> str:
    """Write a PNG of the body with its shadow line, creeping rays and iso-phase curves.

    Parameters
    ----------
    path : str or path
        File to write.
    line : ShadowLine
    fan : RayFan, optional
    curves : sequence of IsoPhaseCurve
    backend : str
        "pyvista", "matplotlib", or "auto": pyvista where there is OpenGL.
    view : View, optional
        Camera; by default on the shadow side.
    rays : int
        Rays drawn at most.
    until : float, optional
        Travel time up to which rays are drawn; by default until their waves have fallen by 30 dB, or they have crossed
        their neighbours twice.
    wavenumber : float, optional, 1/L
        Of these waves; that at which k rho = 10 if not given.
    boundary : "hard", "soft", "pec" or ImpedanceBoundary
        Of these waves; on a hard body they fall most slowly.
    name : str
        What the title calls the body; its repr if not given.
    dpi : int
        Pixels per inch; the figure is 6.4 inches wide, its height follows the body.

    Returns
    -------
    str
        "pyvista" or "matplotlib", whichever drew it.

    Raises
    ------
    InvalidInputError
        If the backend is not one of the three.
    CreepingError
        If pyvista is asked for and cannot draw here, or the file cannot be written.
    """
    backend = chosen_backend(backend)
    drawing = compose(line, fan, curves, view=view, name=name, **shown)
    figure, bar = drawn_page(drawing, backend, dpi)
    drawing.add_legend(figure)
    if drawing.colours.high > drawing.colours.low:
        drawing.colours.add_bar(figure, cax=figure.add_axes(bar))
    save_figure(figure, path, dpi)
    return backend


def chosen_backend(backend: str) -> str:
    """Either "pyvista" or "matplotlib"; "auto" is pyvista where there is OpenGL.

    Raises
    ------
    InvalidInputError
        If the backend is not one of the three.
    """
    if backend not in ("auto", "pyvista", "matplotlib"):
        raise InvalidInputError(f"backend {backend!r} is unknown; give one of auto, pyvista, matplotlib")
    if backend == "auto":
        return "pyvista" if gl_available().ok else "matplotlib"
    return backend


def drawn_page(drawing: Drawing, backend: str, dpi: int) -> tuple[Any, Place]:
    """Figure with the body's picture and room for a legend, and the place of a colour bar."""
    figure, place = _page(drawing)
    if backend == "pyvista":
        _draw_pyvista(figure, place, drawing, dpi)
    else:
        from creeping.plotting._inline import InlineAxes3D

        axes3d.draw(figure.add_axes(place, axes_class=InlineAxes3D), drawing)
    figure.text(0.02, 0.99, drawing.title, fontsize=TITLE_SIZE, va="top", parse_math=False)
    left, bottom, width, height = place
    return figure, (left + width + 0.02, bottom + 0.12 * height, 0.022, 0.76 * height)


def _page(drawing: Drawing) -> tuple[Any, Place]:
    """Figure with room for the body's picture, the legend below and the colour bar at the right."""
    low, high = drawing.frame
    width = 0.82 * WIDTH
    # neither a strip nor a tower: the rest of the room stays white
    body = float(np.clip(width * (high[1] - low[1]) / (high[0] - low[0]), 2.4, 4.6))
    legend = 0.55 if len({stroke.label for stroke in drawing.strokes} - {""}) > 3 else 0.38
    lines = drawing.title.count("\n") + 1 if drawing.title else 0
    height = body + legend + 0.05 + 0.16 * lines
    return new_figure((WIDTH, height)), (0.01, legend / height, width / WIDTH, body / height)


def _draw_pyvista(figure: Any, place: Place, drawing: Drawing, dpi: int) -> None:
    """Render the scene without any text, which matplotlib then sets, sharper and as in the other backend."""
    ax = figure.add_axes(place)
    # more pixels than the file has: reduced on saving, which smooths every edge
    inches = figure.get_size_inches()
    width, height = (round(FINER * dpi * float(size) * share) for size, share in zip(inches, place[2:], strict=True))
    image = render(drawing, (width, height), scale=FINER * dpi / 72)
    low, high = drawing.frame
    middle = 0.5 * (low + high)
    half_height = max(0.5 * float(high[1] - low[1]), 0.5 * float(high[0] - low[0]) * height / width)
    half_width = half_height * width / height
    extent = (middle[0] - half_width, middle[0] + half_width, middle[1] - half_height, middle[1] + half_height)
    ax.imshow(image, extent=extent, interpolation="antialiased")
    ax.set_axis_off()
    ax.set_autoscale_on(False)
    for mark in drawing.marks:
        ax.fill(*drawing.view.project(mark.outline(drawing.view)).T, color=ARROW_COLOUR, linewidth=0)
        ax.text(*drawing.view.project(mark.label(drawing.view)), mark.name, **mark.text)
