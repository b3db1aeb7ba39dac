"""Pictures of a T-matrix: its backscatter in all directions, and the size of its entries by degrees of the waves.

Also here: means over orientation against frequency.
"""

import os
from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.frequency import suited
from creeping.field.results.comparison import decibels, shown_range
from creeping.field.results.echo import LEVELS
from creeping.field.tmatrix.patterns import degrees_of
from creeping.geometry.directions import directions_from_azimuth_elevation
from creeping.plotting import pages
from creeping.plotting.far_cuts import COMPONENTS, QUANTITIES

if TYPE_CHECKING:
    from creeping.field.tmatrix.result import TMatrix

PER_LOBE = 8
"""Pixels from a null of |f(d, -d)|, of degree 2L in each angle, to the next."""
SPANS = {"backscatter": 50.0, "waves": 120.0}
"""Range of levels of each kind, dB."""


def plot_t_matrix(
    T: "TMatrix", ax: Any = None, *, kind: str = "backscatter", component: str | None = None, span: float | None = None
) -> Any:
    """Draw the backscatter of all orientations as a map, or the size of the matrix by degrees.

    Parameters
    ----------
    T : TMatrix
    ax : matplotlib.axes.Axes, optional
        By default those of a new figure.
    kind : {"backscatter", "waves"}
        "backscatter": target strength, for a conductor radar cross section, by azimuth and elevation of the source as
        seen from the body. "waves": norm of the entries by degrees of the incoming and the outgoing wave, which falls
        to the error where the order suffices.
    component : {"tt", "tp", "pt", "pp"}, optional
        Of a conductor: scattered by incident, t for θ̂ and p for φ̂. By default the mean over incident, and the sum over
        scattered polarisations.
    span : float, dB, optional
        Range below the highest value, by default 50 dB for "backscatter" and 120 dB for "waves".

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    InvalidInputError
        On an unknown kind or component.
    """
    if kind not in SPANS:
        raise InvalidInputError(f"kind {kind!r} is unknown; give {' or '.join(SPANS)}")
    if component is not None and (component not in COMPONENTS or not T.vector):
        known = f"give {', '.join(COMPONENTS)}" if T.vector else "a scalar field has none"
        raise InvalidInputError(f"component {component!r} is unknown; {known}")
    fresh, ax = pages.axes_or_new(ax, pages.PAGE)
    span = SPANS[kind] if span is None else span
    if kind == "backscatter":
        _draw_backscatter(ax, T, component, span)
    else:
        _draw_waves(ax, T, span)
    return pages.finished(ax, fresh, pages.wave_title(T, T.unit), legend=False)


def averages_picture(
    path: str | os.PathLike[str],
    quantity: str,
    hertz: FloatArray,
    levels: FloatArray,
    error: FloatArray,
    *,
    title: str = "",
    dpi: int = 200,
) -> None:
    """Write a PNG of levels (k,), dB, averaged over orientation, with their errors (k,), dB, against frequencies, Hz.

    Raises
    ------
    CreepingError
        If nothing can be drawn, or the file cannot be written.
    """
    name, unit = LEVELS[quantity]
    scale, hertz_name = suited(float(hertz.max()))
    low, high = shown_range([levels - error, levels + error], SPANS["backscatter"], step=1.0)
    with pages.written_figure(path, pages.PAGE, dpi) as figure:
        ax = figure.add_subplot()
        look = {"color": pages.COLOURS[0], "alpha": 0.18, "linewidth": 0}
        ax.fill_between(hertz / scale, levels - error, levels + error, label="stated error", **look)
        ax.plot(hertz / scale, levels, label="mean over orientation", **pages.curve_style(0))
        ax.set(xlim=(hertz[0] / scale, hertz[-1] / scale), ylim=(low, high))
        pages.dressed(ax, f"frequency ({hertz_name})", f"{name} ({unit})")
        pages.finished(ax, True, title)


def _draw_backscatter(ax: Any, T: "TMatrix", component: str | None, span: float) -> None:
    count = PER_LOBE * (2 * T.order + 1) // 2
    elevation, azimuth = np.linspace(-90.0, 90.0, count + 1), np.linspace(-180.0, 180.0, 2 * count + 1)
    both = np.meshgrid(np.radians(azimuth), np.radians(elevation))
    f = T.backscatter(-directions_from_azimuth_elevation(*map(np.ravel, both))).total
    if component is not None:
        f = f[:, *COMPONENTS[component]]
    elif T.vector:
        f = np.sqrt(np.mean(np.sum(np.abs(f) ** 2, axis=1), axis=1))
    name, levels_of = QUANTITIES["rcs" if T.vector else "amplitude"]
    label = name % T.unit + f", {component or 'mean'}" * T.vector
    pages.dressed(ax, "azimuth (degrees)", "elevation (degrees)")
    _draw_map(ax, (azimuth, elevation), levels_of(f).reshape(both[0].shape), span, label)
    ax.set(xlim=(-180, 180), ylim=(-90, 90), xticks=np.arange(-180, 181, 60), yticks=np.arange(-90, 91, 30))


def _draw_waves(ax: Any, T: "TMatrix", span: float) -> None:
    deg, _ = degrees_of(T.order, vector=T.vector)
    known, first = np.unique(deg, return_index=True)
    squares = np.add.reduceat(np.add.reduceat(np.abs(T.matrix) ** 2, first, axis=0), first, axis=1)
    pages.dressed(ax, "degree of the incoming wave", "degree of the outgoing wave")
    _draw_map(ax, (known, known), 0.5 * decibels(squares / squares.max()), span, "norm of T by degrees (dB re largest)")
    ax.set_aspect("equal")


def _draw_map(ax: Any, at: tuple[Any, Any], levels: FloatArray, span: float, label: str) -> None:
    """Levels (m, n) in colours over places along the axes (n,) and (m,), with their bar."""
    low, high = shown_range([levels], span)
    grid = np.where(np.isneginf(levels), low, levels)
    image = ax.pcolormesh(*at, grid, vmin=low, vmax=high, cmap="cividis", shading="nearest", rasterized=True)
    ax.grid(visible=False)
    pages.add_bar(ax.figure, image, label, extend=pages.beyond(levels, low, high), fontsize=9, ax=ax)
