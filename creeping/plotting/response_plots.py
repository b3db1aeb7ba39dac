"""Pictures that responses to a pulse draw of themselves: level against delay or range.

Also here: pictures that fields between ports, and far fields of sources, draw of themselves: levels in decibels.
"""

from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.comparison import decibels, shown_range
from creeping.field.frequency import suited
from creeping.plotting.far_cuts import dressed
from creeping.plotting.palette import COLOURS, GREY, curve_style
from creeping.plotting.pictures import add_legend, axes_or_new

if TYPE_CHECKING:
    from creeping.field.impulse import ImpulseResponse, RangeProfile
    from creeping.field.ports.coupling_result import Coupling
    from creeping.field.sources import SourcePattern
from typing import TYPE_CHECKING

from creeping.plotting._cut_angles import cut_angles
from creeping.plotting.far_cuts import Curve, draw_cut, heights_of, minus
from creeping.plotting.palette import add_bar, beyond
from creeping.plotting.pictures import wave_title

PAGE = (6.4, 4.2)  # inches
MOST = len(COLOURS)
"""Responses in one picture."""
SECONDS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"))
MATRIX = (5.6, 4.8)
NUMBERED = 12
"""Ports up to which the levels are written into the matrix."""
MARKED = 60
"""Ports up to which what is not OK is crossed out."""


def plot_impulse(
    found: "ImpulseResponse",
    ax: Any = None,
    *,
    start: float | None = None,
    end: float | None = None,
    span: float = 60.0,
    legend: bool | None = None,
) -> Any:
    """Draw the envelope of a response in decibels against the delay, and the bound of its error as a dotted line.

    Parameters
    ----------
    found : ImpulseResponse
        Of one field or up to six.
    ax : matplotlib.axes.Axes, optional
        By default those of a new figure.
    start, end : float, optional
        Delays drawn, in the unit of the response; by default all.
    span : float, dB
        Range below the highest value.
    legend : bool
        By default on a new figure only.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    InvalidInputError
        If there are more responses than can be told apart, or nothing lies between ``start`` and ``end``.
    """
    envelope = np.reshape(found.envelope, (len(found.delay), -1))
    if envelope.shape[1] > MOST:
        raise InvalidInputError(f"{envelope.shape[1]} responses in one picture; draw {MOST} at most, or one by one")
    low, high = _ends(found.delay, start, end)
    scale, unit = (1.0, found.unit) if found.unit != "s" else suited(max(abs(low), abs(high)), SECONDS)
    shown = (found.delay >= low) & (found.delay <= high)
    levels = decibels(envelope)
    heights = shown_range([levels[shown]], span)
    fresh, ax = axes_or_new(ax, PAGE)
    several = envelope.shape[1] > 1
    bounds = np.ravel(found.error)
    # the legend lists what was drawn last first
    for number in reversed(range(envelope.shape[1])):
        name = f"response {number}" if several else "envelope"
        style = curve_style(number)
        curve = np.maximum(levels[:, number], heights[0] - (heights[1] - heights[0]))
        if bounds[number] > 0:
            colour = style["color"] if several else GREY
            label = "_bound" if several and number else "error at most"
            ax.axhline(float(decibels(bounds[number])), color=colour, linewidth=0.9, linestyle=":", label=label)
        ax.plot(found.delay / scale, curve, label=name, **style)
    ax.set_xlim(low / scale, high / scale)
    ax.set_ylim(*heights)
    what = "length of the path" if found.unit == "L" else "delay"
    title = f"resolution {found.resolution / scale:.3g} {unit}, repeats after {found.period / scale:.4g} {unit}"
    dressed(ax, f"{what} ({unit})", "envelope (dB)", title if fresh else None)
    add_legend(ax, fresh, legend)
    return ax


def plot_profile(
    found: "RangeProfile",
    ax: Any = None,
    *,
    start: float | None = None,
    end: float | None = None,
    span: float = 60.0,
    unit: str = "L",
    legend: bool | None = None,
) -> Any:
    """Draw 20 log10 of the size of a range profile against the range; ``start`` and ``end`` are ranges.

    Parameters are as of `plot_impulse`, and ``unit``, that of lengths.
    """
    low, high = _ends(found.range, start, end)
    levels = decibels(found.values)
    heights = shown_range([levels[(found.range >= low) & (found.range <= high)]], span)
    fresh, ax = axes_or_new(ax, PAGE)
    floor = heights[0] - (heights[1] - heights[0])
    ax.plot(found.range, np.maximum(levels, floor), label="profile", **curve_style(0))
    ax.set_xlim(low, high)
    ax.set_ylim(*heights)
    title = f"resolution {found.resolution:.3g} {unit}" if fresh else None
    dressed(ax, f"range along the line of sight ({unit})", f"20 log$_{{10}}$|h| (dB re 1 {unit})", title)
    add_legend(ax, False, legend)
    return ax


def _ends(values: FloatArray, start: float | None, end: float | None) -> tuple[float, float]:
    """First and last value drawn."""
    low = float(values[0]) if start is None else float(start)
    high = float(values[-1]) if end is None else float(end)
    # written so that NaN fails
    if not (low < high and np.any((values >= low) & (values <= high))):
        raise InvalidInputError(
            f"nothing lies between start = {low:g} and end = {high:g}; "
            f"values reach from {values[0]:g} to {values[-1]:g}"
        )
    return low, high


def plot_coupling(found: "Coupling", ax: Any = None, *, span: float = 60.0, legend: bool | None = None) -> Any:
    """Draw a coupling matrix: 20 log10 of each entry's size, what is not OK crossed out, the diagonal left empty.

    Parameters
    ----------
    found : Coupling
    ax : matplotlib.axes.Axes, optional
        By default those of a new figure.
    span : float, dB
        Range below the highest value.
    legend : bool
        By default on a new figure only.

    Returns
    -------
    matplotlib.axes.Axes
    """
    count = len(found.ports)
    levels = np.where(np.isfinite(found.values), decibels(np.nan_to_num(found.values)), np.nan)
    low, high = shown_range([levels], span)
    fresh, ax = axes_or_new(ax, MATRIX)
    image = ax.imshow(levels, vmin=low, vmax=high, cmap="cividis", interpolation="nearest")
    if count <= NUMBERED:
        _numbered(ax, levels, 0.5 * (low + high))
    doubtful = ~found.ok & np.isfinite(found.values)
    if count <= MARKED and doubtful.any():
        rows, columns = np.nonzero(doubtful)
        ax.plot(columns, rows, "x", color="#d55e00", markersize=4 if count > NUMBERED else 9, label="not OK")
    per = found.to_xarray()["total"].attrs["units"]
    per = per if per.startswith("1/") else f"1 {per}"
    add_bar(ax.figure, image, f"20 log$_{{10}}$ (dB re {per})", extend=beyond(levels, low, high), fontsize=9, ax=ax)
    ax.set_xlabel("receiver", fontsize=9)
    ax.set_ylabel("source", fontsize=9)
    ax.tick_params(labelsize=8, width=0.5)
    ax.xaxis.get_major_locator().set_params(integer=True)
    ax.yaxis.get_major_locator().set_params(integer=True)
    if fresh:
        ax.set_title(wave_title(found, found.length_unit), fontsize=9, parse_math=False)
    add_legend(ax, fresh, legend)
    return ax


def plot_pattern(found: "SourcePattern", ax: Any = None, *, span: float = 60.0, legend: bool | None = None) -> Any:
    """Draw far fields of sources in decibels against the angle of a cut, one curve a source, with their errors.

    Parameters
    ----------
    found : SourcePattern
        In directions of one plane through the origin, or of one θ; of up to six sources.
    ax : matplotlib.axes.Axes, optional
        By default those of a new figure; polar ones are drawn round.
    span : float, dB
        Range below the highest value.
    legend : bool
        By default on a new figure only.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    InvalidInputError
        If the directions are on no cut, or sources are too many.
    """
    if len(found.sources) > len(COLOURS):
        raise InvalidInputError(
            f"{len(found.sources)} sources in one picture; draw {len(COLOURS)} at most: source_pattern of some of them"
        )
    cut = cut_angles(found.directions)
    curves = [_curve(found, number).ordered(cut.order, _named(found, number)) for number in range(len(found.sources))]
    heights = heights_of(curves, span)
    fresh, ax = axes_or_new(ax, PAGE)
    level = "20 log$_{10}$|F| (dB re no body)"
    draw_cut(ax, cut.values[cut.order], curves, heights, level=level, angle_name=cut.name)
    if fresh:
        ax.set_title(wave_title(found, found.length_unit), fontsize=9, parse_math=False)
    add_legend(ax, fresh, legend)
    return ax


def _curve(found: "SourcePattern", number: int) -> Curve:
    """Curve of one source."""
    values, off = found.values[:, number], found.error[:, number]
    size = np.abs(values)
    band = decibels(np.stack([np.maximum(size - off, 0.0), size + off]))
    return Curve("", decibels(values), curve_style(number), band, ~found.ok[:, number])


def _named(found: "SourcePattern", number: int) -> str:
    place = ", ".join(f"{x:.4g}" for x in found.sources[number])
    return f"source at ({place})"


def _numbered(ax: Any, levels: FloatArray, middle: float) -> None:
    """Write the levels into their cells, dark on light and light on dark."""
    for row, column in zip(*np.nonzero(np.isfinite(levels)), strict=True):
        value = levels[row, column]
        ax.text(
            column,
            row,
            minus(round(value)),
            ha="center",
            va="center",
            fontsize=7,
            color="black" if value > middle else "white",
        )
