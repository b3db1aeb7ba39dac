"""Pictures that responses to a pulse draw of themselves: level against delay or range."""

from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.decibels import decibels, shown_range
from creeping.field.frequency import suited
from creeping.plotting.far_cuts import dressed
from creeping.plotting.palette import COLOURS, GREY, curve_style
from creeping.plotting.pictures import add_legend, axes_or_new

if TYPE_CHECKING:
    from creeping.field.impulse import ImpulseResponse
    from creeping.field.slant_range import RangeProfile

PAGE = (6.4, 4.2)  # inches
MOST = len(COLOURS)
"""Responses in one picture."""
SECONDS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"))


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
