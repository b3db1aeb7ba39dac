"""Pictures of shadow lines, fans and iso-phase curves in the plane of parameters or in space, and errors of phase maps.

The plane is that of the body's parameters in degrees: (theta, phi), or (theta, psi) on a torus.
"""

import os
from collections.abc import Sequence
from typing import Unpack

import numpy as np

from creeping._presenting import brief
from creeping._typing import Any, FloatArray
from creeping.errors import InvalidInputError
from creeping.geometry.checks import unit_of
from creeping.geometry.incident import incident_of_row
from creeping.phaseflow.phase_map import PhaseMap
from creeping.plotting import _strokes, pages
from creeping.plotting._drawing import View, compose, rays_caption
from creeping.plotting._strokes import LevelColours, RayLook, RayOptions
from creeping.plotting.pictures import TITLE_SIZE, add_legends, draw, drawn_page
from creeping.rays.fan import RayFan
from creeping.rays.isophase import IsoPhaseCurve, split_at_seam
from creeping.shadow.curve import ShadowCurve, nodes_of
from creeping.shadow.line import ShadowLine
from creeping.shadow.status import STATUSES


def line_of(curve: ShadowCurve) -> ShadowLine:
    """Shadow line that consists of one curve, for pictures: how far it is from crossing itself is not known."""
    return ShadowLine(curve.body, incident_of_row(curve.wave), (curve,), np.nan, nodes_of([curve]))


def plot_line(
    line: ShadowLine | ShadowCurve | RayFan,
    ax: Any = None,
    *,
    kind: str | None = None,
    fan: RayFan | None = None,
    curves: Sequence[IsoPhaseCurve] = (),
    view: View | None = None,
    legend: bool | None = None,
    **shown: Unpack[RayOptions],
) -> Any:
    """Draw a shadow line, by default in the plane of the body's parameters, in degrees.

    Parameters
    ----------
    line : ShadowLine, ShadowCurve or RayFan
        A fan is drawn with its line.
    ax : matplotlib.axes.Axes, optional
        By default those of a new figure.
    kind : {"parameters", "3d"}
        By default what the axes are made for.
    fan : RayFan, optional
    curves : sequence of IsoPhaseCurve
    rays : int
        Rays drawn at most.
    until : float, optional
        Travel time up to which rays are drawn; by default until their waves have fallen by 30 dB, or they have crossed
        their neighbours twice.
    wavenumber : float, optional, 1/L
        Of these waves; that at which k rho = 10 if not given.
    boundary : "hard", "soft", "pec" or ImpedanceBoundary
        Of these waves; on a hard body they fall most slowly.
    view : View, optional
        Camera of ``kind="3d"``; by default on the shadow side.
    legend : bool
        By default on a new figure only.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    InvalidInputError
        If the kind is unknown or not that of the axes, or a view is given for the plane.
    """
    if isinstance(line, RayFan):
        fan, line = line, line.line
    elif isinstance(line, ShadowCurve):
        line = line_of(line)
    if _in_space(ax, kind):
        drawing = compose(line, fan, curves, view=view, **shown)
        if ax is None:
            figure, bar = drawn_page(drawing, "matplotlib", dpi=150)
            if legend is not False:
                add_legends(figure, drawing, bar)
            return figure.axes[0]
        draw(ax, drawing)
        if legend:
            drawing.add_legend(ax.figure)
            drawing.colours.add_bar(ax.figure, ax=ax, shrink=0.6, aspect=24, pad=0.02)
        return ax
    if view is not None:
        raise InvalidInputError("a view is for kind='3d'; the plane of the parameters has none")
    torus = is_torus(line)
    fresh, ax = pages.axes_or_new(ax, page_size(torus=torus))
    look = RayLook(**shown)
    body, ends = line.body, _strokes.drawn_ends(fan, look.until, look.wavenumber, look.boundary)
    if fan is not None:
        # finer than in space: near a pole phi turns fast
        for stroke in _strokes.ray_strokes(fan, look.rays, ends, spacing=0.005):
            pieces = _in_plane(body, stroke.lines)
            _add(ax, pieces, color=stroke.colour, linewidth=0.8 * stroke.width, alpha=stroke.alpha, label=stroke.label)
    colours = draw_curves(ax, _strokes.drawn_curves(curves, fan, ends), fan, ends)
    for status in STATUSES:
        pieces = _in_plane(body, _strokes.line_pieces(line, status))
        _add(ax, pieces, color=_strokes.STATUS_COLOURS[status], linewidth=1.8, label=f"shadow line, {status}", zorder=4)
    frame(ax, torus=torus)
    if fresh if legend is None else legend:
        _add_legend(ax, colours)
    if fresh:
        ax.set_title(rays_caption(line, fan, look), fontsize=TITLE_SIZE, loc="left", parse_math=False)
    return ax


def plot_curve(curve: IsoPhaseCurve, ax: Any = None, *, kind: str | None = None, legend: bool | None = None) -> Any:
    """Draw an iso-phase curve alone, or over what the axes have already.

    Parameters
    ----------
    curve : IsoPhaseCurve
    ax : matplotlib.axes.Axes, optional
        By default those of a new figure; `plot_line` draws curves with the body's picture.
    kind : {"parameters", "3d"}
        By default what the axes are made for.
    legend : bool
        By default on a new figure only.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    InvalidInputError
        If the kind is unknown or not that of the axes.
    """
    space = _in_space(ax, kind)
    # the body is not known here: a polar angle is never negative, that of a torus takes both signs
    torus = bool(np.any(curve.parameters[:, 0] < 0))
    page = (6.4, 4.4) if space else page_size(torus=torus)
    fresh, ax = pages.axes_or_new(ax, page, space=space)
    if space:
        points = np.concatenate([curve.points, curve.points[: int(curve.closed)]])
        # above the body of a picture, which orders what it draws by hand
        name = _strokes.LEVEL_NAMES.get(curve.of, curve.of)
        ax.plot(*points.T, linewidth=1.0, zorder=13, label=f"{name} = {curve.level:g}")
        if fresh:
            ax.set(xlabel="x (L)", ylabel="y (L)", zlabel="z (L)", aspect="equal")
    else:
        framed = bool(ax.get_xlabel())
        draw_curves(ax, [curve])
        if not framed:
            frame(ax, torus=torus)
    pages.add_legend(ax, fresh, legend)
    return ax


def plot_growth(flow: PhaseMap, ax: Any = None, *, tolerance: float | None = None, legend: bool | None = None) -> Any:
    """Draw the error of a phase map against the length of the ray, and the tolerance that it was built for.

    Parameters
    ----------
    flow : PhaseMap
    ax : matplotlib.axes.Axes, optional
        By default those of a new figure.
    tolerance : float, optional
        By default that of the build, if there was one.
    legend : bool
        By default on a new figure only.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    InvalidInputError
        If the error has not been measured.
    """
    growth, error = flow.growth, flow.error
    if growth is None and not error.samples:
        raise InvalidInputError("the error of this map has not been measured; build_phase_map does")
    fresh, ax = pages.axes_or_new(ax, pages.PAGE)
    lengths = (flow.horizon,) if growth is None else growth.lengths
    rms, largest = ((error.rms,), (error.max,)) if growth is None else (growth.rms, growth.max)
    for number, name, values in ((1, "max", largest), (0, "rms", rms)):
        ax.plot(lengths, values, marker="os"[number], markersize=4, label=name, **pages.curve_style(number))
    if growth is not None:
        ax.plot(lengths[-1:], [growth.bound], "_", color=pages.COLOURS[0], markersize=12, label="bound of the rms")
    tolerance = flow.parameters.get("tolerance") if tolerance is None else tolerance
    if tolerance is not None:
        ax.axhline(tolerance, color=pages.GREY, linewidth=0.9, linestyle=":", label=f"tolerance {tolerance:.3g}")
    ax.set_yscale("log")
    weighted = getattr(flow.body, "speed", None) is not None
    across = "travel time of the ray" if weighted else f"length of the ray ({unit_of(flow.body)})"
    pages.dressed(ax, across, "error of (x, p)")
    return pages.finished(ax, fresh, f"{brief(flow.body)}, T0 = {flow.horizon:g}", legend)


def _in_space(ax: Any, kind: str | None) -> bool:
    """Whether to draw in space."""
    if kind is not None and kind not in ("parameters", "3d"):
        raise InvalidInputError(f"kind {kind!r} is unknown; give parameters or 3d")
    space = kind == "3d"
    if ax is None:
        return space
    made_for = "3d" if ax.name == "3d" else "parameters"
    if kind is not None and kind != made_for:
        raise InvalidInputError(f"kind {kind!r} does not fit the axes, which are made for {made_for!r}")
    return made_for == "3d"


def parameter_picture(
    path: str | os.PathLike[str],
    line: ShadowLine,
    fan: RayFan | None = None,
    curves: Sequence[IsoPhaseCurve] = (),
    *,
    name: str = "",
    dpi: int = 300,
    **shown: Unpack[RayOptions],
) -> None:
    """Write a PNG of the same in the plane of the body's parameters; see `plot_line`.

    Raises
    ------
    CreepingError
        If the file cannot be written.
    """
    with pages.written_figure(path, page_size(torus=is_torus(line)), dpi) as figure:
        ax = plot_line(line, figure.add_subplot(), fan=fan, curves=curves, legend=True, **shown)
        title = rays_caption(line, fan, RayLook(**shown), name)
        ax.set_title(title, fontsize=TITLE_SIZE, loc="left", parse_math=False)


def page_size(*, torus: bool) -> tuple[float, float]:
    """Width and height, inches, of a page that the plane fills, with a legend below and a bar beside it."""
    return (6.4, 5.9) if torus else (6.4, 3.6)


def draw_curves(
    ax: Any, curves: Sequence[IsoPhaseCurve], fan: RayFan | None = None, ends: FloatArray | None = None
) -> LevelColours:
    """Draw iso-phase curves, faint where rays of their fan have detached, and return the colours of their levels.

    ``ends`` are those of `creeping.plotting._strokes.drawn_ends`, none by default.
    """
    colours = LevelColours.of(curves)
    for curve in curves:
        bound, free = (
            [piece for part in parts for piece in split_at_seam(part, closed=False)]
            for parts in _strokes.curve_pieces(curve, fan, curve.parameters, ends)
        )
        colour, label = colours(curve.level), colours.label(curve is curves[0])
        _add(ax, bound, color=colour, linewidth=1.0, label=label, zorder=3)
        _add(ax, free, color=colour, linewidth=_strokes.FADED_WIDTH, alpha=_strokes.FADED, zorder=3)
    return colours


def _in_plane(body: Any, lines: Sequence[FloatArray]) -> list[FloatArray]:
    """Lines on the body (n, 3) as pieces of curves of its parameters (k, 2)."""
    return [piece for points in lines for piece in split_at_seam(body.parameters(points), closed=False)]


def is_torus(line: ShadowLine) -> bool:
    """Whether theta runs all the way round, as on a torus, rather than from pole to pole.

    A polar angle is never negative, while the shadow line of a torus, n.d = 0, meets both signs of theta.
    """
    return any(float(np.min(line.body.parameters(curve.points)[..., 0])) < 0 for curve in line.curves)


def _add(ax: Any, pieces: Sequence[FloatArray], *, label: str = "", **style: Any) -> None:
    """Add the pieces (k, 2) as one artist, phi to the right and theta upwards or downwards."""
    from matplotlib.collections import LineCollection

    if pieces:
        lines = [np.degrees(piece[:, ::-1]) for piece in pieces]
        ax.add_collection(LineCollection(lines, label=label or "_hidden", capstyle="round", **style))


def frame(ax: Any, *, torus: bool) -> None:
    """Axes of the plane: (phi, theta), or (psi, theta) all the way round on a torus, in degrees."""
    name = "psi" if torus else "phi"
    ax.set(xlim=(-180, 180), xticks=range(-180, 181, 60))
    # a polar angle grows from the upper pole down, like the picture of the body
    ax.set(ylim=(-180, 180) if torus else (180, 0), yticks=range(-180, 181, 60) if torus else range(0, 181, 30))
    ax.set_xlabel(rf"$\{name}$ (degrees)", fontsize=9)
    ax.set_ylabel(r"$\theta$ (degrees)", fontsize=9)
    ax.set_aspect("equal")
    ax.tick_params(labelsize=8, direction="in", top=True, right=True, width=0.5)
    ax.spines[:].set_linewidth(0.5)


def _add_legend(ax: Any, colours: LevelColours) -> None:
    named = sorted(zip(*ax.get_legend_handles_labels(), strict=True), key=lambda one: not one[1].startswith("shadow"))
    place = "outside lower center" if ax.figure.get_layout_engine() is not None else "lower center"
    look: dict[str, Any] = {"loc": place, "ncols": min(3, max(1, len(named))), "frameon": False, "fontsize": 8}
    ax.figure.legend([handle for handle, _ in named], [label for _, label in named], **look)
    # without levels to tell apart there is no bar, and no place for one
    if colours.high > colours.low:
        colours.add_bar(ax.figure, cax=ax.inset_axes((1.03, 0.0, 0.025, 1.0)))
