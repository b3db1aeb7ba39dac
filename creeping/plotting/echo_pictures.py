"""Pictures of an echo: against angle or frequency with the band of its error, as a map of both, and in range.

Also here: pictures that responses to a pulse draw of themselves, level against delay or range; and of a T-matrix: its
backscatter in all directions, the size of its entries by degrees of the waves, and means over orientation.
"""

import os
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.frequency import suited
from creeping.field.results.comparison import LEVELS, decibels, shown_range
from creeping.field.results.impulse import range_profile
from creeping.field.tmatrix.patterns import degrees_of
from creeping.geometry.directions import directions_from_azimuth_elevation
from creeping.plotting import pages
from creeping.plotting.far_cuts import COMPONENTS, QUANTITIES, Curve, draw_curves, draw_cut, heights_of

if TYPE_CHECKING:
    from creeping.field.results.comparison import Comparison, Echo
    from creeping.field.results.impulse import ImpulseResponse, RangeProfile
    from creeping.field.tmatrix.result import TMatrix

SPAN = 60.0
"""Range of levels, dB."""


def echo_picture(
    path: str | os.PathLike[str], echo: "Echo", *, kind: str = "cartesian", title: str = "", dpi: int = 200
) -> None:
    """Write a PNG of an echo as `plot_echo` draws it; of a map over angle and frequency a panel for each channel.

    Parameters
    ----------
    path : str or path
    echo : Echo
        Of several angles, several frequencies, or both.
    kind : {"cartesian", "polar"}
        Of a cut.
    title : str
    dpi : int

    Raises
    ------
    CreepingError
        If nothing can be drawn, or the file cannot be written.
    """
    from matplotlib.patches import Patch

    if len(echo.azimuth) < 2 or len(echo.wavenumbers) < 2:
        polar = kind == "polar"
        with pages.written_figure(path, (6.4, 6.4) if polar else pages.PAGE, dpi) as figure:
            ax = plot_echo(echo, figure.add_subplot(projection="polar" if polar else None))
            pages.finished(ax, True, title)
        return
    count, heights = len(echo.channels), shown_range([echo.levels()], SPAN)
    with pages.written_figure(path, (6.4, 0.6 + 2.9 * count), dpi) as figure:
        for number, channel in enumerate(echo.channels):
            ax = figure.add_subplot(count, 1, number + 1)
            draw_echo_map(ax, echo, number, heights)
            ax.set_title(channel if number else f"{title}\n{channel}", fontsize=9, parse_math=False)
        if echo.unresolved.any():
            patch = Patch(facecolor="white", edgecolor=pages.GREY, linewidth=0.5, label="veiled: unresolved")
            figure.legend(handles=[patch], loc="outside lower center", frameon=False, fontsize=8)


def draw_echo_map(ax: Any, echo: "Echo", number: int, heights: tuple[float, float]) -> None:
    """Draw one channel of an echo over angle and frequency, what is unresolved veiled."""
    from matplotlib.colors import ListedColormap

    scale, unit = suited(float(echo.hertz.max()))
    at = echo.angles, echo.hertz / scale
    pages.dressed(ax, f"{echo.angle_name} (degrees)", f"frequency ({unit})")
    _draw_map(ax, at, echo.levels()[number].T, heights, _level(echo))
    doubtful = echo.unresolved[number]
    veil = np.ma.masked_where(~doubtful, np.ones(doubtful.shape)).T
    ax.pcolormesh(*at, veil, cmap=ListedColormap(["white"]), alpha=0.7, shading="nearest")


def plot_echo(
    echo: "Echo", ax: Any = None, *, channel: str | None = None, span: float = SPAN, legend: bool | None = None
) -> Any:
    """Draw an echo: against its angle, or frequency, where one of them varies; as a map of both where both do.

    Parameters
    ----------
    echo : Echo
    ax : matplotlib.axes.Axes, optional
        By default those of a new figure; polar ones are drawn round.
    channel : str, optional
        The one that a map shows; by default the first.
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
        If there is a single value only, or no such channel.
    """
    angles, waves = len(echo.azimuth), len(echo.wavenumbers)
    if angles < 2 and waves < 2:
        raise InvalidInputError("one angle and one frequency make no picture; levels() and error have the values")
    number = 0 if channel is None else echo.channels.index(channel) if channel in echo.channels else -1
    if number < 0:
        raise InvalidInputError(f"channel {channel!r} is not among {', '.join(echo.channels)}")
    fresh, ax = pages.axes_or_new(ax, pages.PAGE)
    if angles > 1 and waves > 1:
        draw_echo_map(ax, echo, number, shown_range([echo.levels()[number]], span))
        return pages.finished(ax, fresh, f"{echo.channels[number]}; veiled: unresolved", legend=False)
    at = (slice(None), 0) if angles > 1 else (0, slice(None))
    levels, bounds = echo.levels(), np.stack(echo.bounds())
    levels[np.isposinf(levels)] = np.nan
    places = [(number, *at) for number in range(len(echo.channels))]
    curves = [
        Curve(channel, levels[here], pages.curve_style(here[0]), bounds[(slice(None), *here)], echo.unresolved[here])
        for channel, here in zip(echo.channels, places, strict=True)
    ]
    low, high = heights_of(curves, span)
    for number, curve in enumerate(curves):
        # a word for those that lie below the picture as a whole
        if np.nanmax(curve.levels, initial=-np.inf) < low:
            curves[number] = replace(curve, label=f"{curve.label}, below {pages.minus(low)} dB")
    if angles > 1:
        draw_cut(ax, np.radians(echo.angles), curves, (low, high), level=_level(echo), angle_name=echo.angle_name)
    else:
        scale, unit = suited(float(echo.hertz.max()))
        x, doubtful = echo.hertz / scale, echo.unresolved[:, 0].any(axis=0)
        draw_curves(ax, x, curves, (low, high))
        if doubtful.any():
            ax.plot(x[doubtful], np.full(doubtful.sum(), low), "|", color=pages.GREY, clip_on=False, label="unresolved")
        ax.set(xlim=(x[0], x[-1]), ylim=(low, high))
        pages.dressed(ax, f"frequency ({unit})", _level(echo))
    pages.add_legend(ax, fresh, legend)
    return ax


def range_picture(
    path: str | os.PathLike[str],
    profiles: "dict[str, RangeProfile]",
    echo: "Echo",
    span: tuple[float, float],
    *,
    title: str = "",
    dpi: int = 200,
) -> None:
    """Write a PNG of range profiles by channel over the ranges ``span``, m, as far as they reach.

    Beside them stands the window's own profile about the strongest echo: what is no higher may be its side lobe.
    """
    with pages.written_figure(path, pages.PAGE, dpi) as figure:
        ax = figure.add_subplot()
        curves = {channel: echo.levels(found.values) for channel, found in profiles.items()}
        low, high = shown_range(curves.values(), SPAN)
        # the legend lists what was drawn last first
        for number, (channel, found) in reversed(list(enumerate(profiles.items()))):
            style = pages.curve_style(number)
            if 0 < found.error < np.inf:
                _draw_bound(ax, float(echo.levels(np.array(found.error))), style["color"], first=not number)
            ax.plot(found.range, np.maximum(curves[channel], low - 1), label=channel, **style)
        strongest = max(profiles.values(), key=lambda found: float(np.max(np.abs(found.values))))
        alone = np.abs(range_profile(np.ones(len(echo.wavenumbers)), echo.wavenumbers).values)
        size = np.abs(strongest.values)
        alone = np.roll(alone, int(np.argmax(size)) - int(np.argmax(alone))) * float(np.max(size))
        look: dict[str, Any] = {"color": pages.GREY, "alpha": 0.2, "linewidth": 0}
        side = np.maximum(echo.levels(alone), low - 1)
        ax.fill_between(strongest.range, low - 1, side, label="strongest echo with side lobes", **look)
        reach = strongest.range
        ax.set(xlim=(max(span[0], reach[0]), min(span[1], reach[-1])), ylim=(low, high))
        pages.dressed(ax, f"range along the line of sight (m), away from the {echo.viewer}", _level(echo))
        pages.finished(ax, True, title)


def comparison_picture(
    path: str | os.PathLike[str], echo: "Echo", comparisons: "dict[str, Comparison]", *, title: str = "", dpi: int = 200
) -> None:
    """Write a PNG of computed and given levels, one above the other with their residual below.

    Parameters
    ----------
    path : str or path
    echo : Echo
    comparisons : dict of str to Comparison
        By channel.
    title : str
    dpi : int

    Raises
    ------
    CreepingError
        If the file cannot be written.
    """
    band = len(echo.wavenumbers) > 1
    scale, unit = suited(float(echo.hertz.max())) if band else (1.0, "degrees")
    with pages.written_figure(path, (6.4, 5.6), dpi) as figure:
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1))
        # the legend lists what was drawn last first
        for number, (channel, found) in reversed(list(enumerate(comparisons.items()))):
            x, style = found.values / scale, pages.curve_style(number)
            broad = {"linewidth": 3.2, "alpha": 0.3, "zorder": 1.9}
            above.plot(x, found.reference, label=f"{channel}, given", **style | broad)
            above.plot(x, found.levels, label=channel, **style)
            below.plot(x, found.residual, label=f"_{channel}", **style)
        below.axhline(0.0, color=pages.GREY, linewidth=0.6)
        below.margins(x=0)
        pages.dressed(above, "", _level(echo))
        pages.dressed(below, f"frequency ({unit})" if band else f"{echo.angle_name} ({unit})", "residual (dB)")
        pages.finished(above, True, title)


def _level(echo: "Echo") -> str:
    name, unit = echo.level_name
    return f"{name} ({unit})"


def plot_impulse(
    found: "ImpulseResponse",
    ax: Any = None,
    *,
    start: float | None = None,
    end: float | None = None,
    span: float = SPAN,
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
    if envelope.shape[1] > len(pages.COLOURS):
        raise InvalidInputError(
            f"{envelope.shape[1]} responses in one picture; draw {len(pages.COLOURS)} at most, or one by one"
        )
    ends = _ends(found.delay, start, end)
    seconds = ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs"), (1e-9, "ns"))
    scale, unit = (1.0, found.unit) if found.unit != "s" else suited(max(map(abs, ends)), seconds)
    several = envelope.shape[1] > 1
    names = [f"response {number}" for number in range(envelope.shape[1])] if several else ["envelope"]
    fresh, ax = pages.axes_or_new(ax, pages.PAGE)
    _draw_levels(ax, found.delay, envelope, np.ravel(found.error), ends, names, span, scale)
    what = "length of the path" if found.unit == "L" else "delay"
    title = f"resolution {found.resolution / scale:.3g} {unit}, repeats after {found.period / scale:.4g} {unit}"
    pages.dressed(ax, f"{what} ({unit})", "envelope (dB)")
    return pages.finished(ax, fresh, title, legend)


def _draw_levels(
    ax: Any,
    x: FloatArray,
    sizes: FloatArray,
    bounds: FloatArray,
    ends: tuple[float, float],
    names: Sequence[str],
    span: float,
    scale: float = 1.0,
) -> None:
    """Draw sizes (m, n) in decibels over x (m,) from one end to the other, the bounds of their errors (n,) dotted."""
    levels, shown = decibels(sizes), (x >= ends[0]) & (x <= ends[1])
    low, high = shown_range([levels[shown]], span)
    # the legend lists what was drawn last first
    for number, name in reversed(list(enumerate(names))):
        style = pages.curve_style(number)
        if 0 < bounds[number] < np.inf:
            colour = style["color"] if len(names) > 1 else pages.GREY
            _draw_bound(ax, float(decibels(bounds[number])), colour, first=not number)
        ax.plot(x / scale, np.maximum(levels[:, number], low - (high - low)), label=name, **style)
    ax.set(xlim=(ends[0] / scale, ends[1] / scale), ylim=(low, high))


def plot_profile(
    found: "RangeProfile",
    ax: Any = None,
    *,
    start: float | None = None,
    end: float | None = None,
    span: float = SPAN,
    unit: str = "L",
    legend: bool | None = None,
) -> Any:
    """Draw 20 log10 of the size of a range profile against the range; ``start`` and ``end`` are ranges.

    Parameters are as of `plot_impulse`, and ``unit``, that of lengths.
    """
    ends = _ends(found.range, start, end)
    fresh, ax = pages.axes_or_new(ax, pages.PAGE)
    _draw_levels(ax, found.range, np.abs(found.values)[:, None], np.array([found.error]), ends, ["profile"], span)
    pages.dressed(ax, f"range along the line of sight ({unit})", f"20 log$_{{10}}$|h| (dB re 1 {unit})")
    pages.finished(ax, fresh, f"resolution {found.resolution:.3g} {unit}", legend=False)
    # one curve has a legend only where it is asked for, and inside
    pages.add_legend(ax, False, legend)
    return ax


def _draw_bound(ax: Any, level: float, colour: str, *, first: bool) -> None:
    """A dotted line at the bound of an error; the first of several has the label."""
    ax.axhline(level, color=colour, linewidth=0.9, linestyle=":", label="error at most" if first else "_bound")


def _ends(values: FloatArray, start: float | None, end: float | None) -> tuple[float, float]:
    """First and last value drawn."""
    low = float(values[0]) if start is None else float(start)
    high = float(values[-1]) if end is None else float(end)
    # written so that NaN fails
    if not (low < high and np.any((values >= low) & (values <= high))):
        reach = f"values reach from {values[0]:g} to {values[-1]:g}"
        raise InvalidInputError(f"nothing lies between start = {low:g} and end = {high:g}; {reach}")
    return low, high


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
    # range of levels of each kind of picture, dB
    spans = {"backscatter": 50.0, "waves": 120.0}
    if kind not in spans:
        raise InvalidInputError(f"kind {kind!r} is unknown; give {' or '.join(spans)}")
    if component is not None and (component not in COMPONENTS or not T.vector):
        known = f"give {', '.join(COMPONENTS)}" if T.vector else "a scalar field has none"
        raise InvalidInputError(f"component {component!r} is unknown; {known}")
    fresh, ax = pages.axes_or_new(ax, pages.PAGE)
    span = spans[kind] if span is None else span
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
    low, high = shown_range([levels - error, levels + error], 50.0, step=1.0)
    with pages.written_figure(path, pages.PAGE, dpi) as figure:
        ax = figure.add_subplot()
        look = {"color": pages.COLOURS[0], "alpha": 0.18, "linewidth": 0}
        ax.fill_between(hertz / scale, levels - error, levels + error, label="stated error", **look)
        ax.plot(hertz / scale, levels, label="mean over orientation", **pages.curve_style(0))
        ax.set(xlim=(hertz[0] / scale, hertz[-1] / scale), ylim=(low, high))
        pages.dressed(ax, f"frequency ({hertz_name})", f"{name} ({unit})")
        pages.finished(ax, True, title)


def _draw_backscatter(ax: Any, T: "TMatrix", component: str | None, span: float) -> None:
    # eight pixels from a null of |f(d, -d)|, of degree 2L in each angle, to the next
    count = 8 * (2 * T.order + 1) // 2
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
    levels = levels_of(f).reshape(both[0].shape)
    _draw_map(ax, (azimuth, elevation), levels, shown_range([levels], span), label)
    ax.set(xlim=(-180, 180), ylim=(-90, 90), xticks=np.arange(-180, 181, 60), yticks=np.arange(-90, 91, 30))


def _draw_waves(ax: Any, T: "TMatrix", span: float) -> None:
    deg, _ = degrees_of(T.order, vector=T.vector)
    known, first = np.unique(deg, return_index=True)
    squares = np.add.reduceat(np.add.reduceat(np.abs(T.matrix) ** 2, first, axis=0), first, axis=1)
    pages.dressed(ax, "degree of the incoming wave", "degree of the outgoing wave")
    levels = 0.5 * decibels(squares / squares.max())
    _draw_map(ax, (known, known), levels, shown_range([levels], span), "norm of T by degrees (dB re largest)")
    ax.set_aspect("equal")


def _draw_map(ax: Any, at: tuple[Any, Any], levels: FloatArray, heights: tuple[float, float], label: str) -> None:
    """Levels (m, n) in colours over places along the axes (n,) and (m,), with their bar."""
    low, high = heights
    # nulls are low, what is not there stays white
    grid = np.where(np.isneginf(levels), low, levels)
    image = ax.pcolormesh(*at, grid, vmin=low, vmax=high, cmap="cividis", shading="nearest", rasterized=True)
    ax.grid(visible=False)
    pages.add_bar(ax.figure, image, label, extend=pages.beyond(levels, low, high), fontsize=9, ax=ax)
