"""Pictures that shadow lines, fans and iso-phase curves draw of themselves, in the plane of parameters or in space.

Also here: the error of a phase map against the length of the ray.
"""

from collections.abc import Sequence

import numpy as np

from creeping._presenting import brief
from creeping._typing import Any
from creeping.errors import InvalidInputError
from creeping.field.boundary import BoundaryLike
from creeping.geometry.checks import unit_of
from creeping.geometry.incident import incident_of_row
from creeping.phaseflow.phase_map import PhaseMap
from creeping.plotting._drawing import Drawing, View, compose, rays_caption
from creeping.plotting._strokes import LEVEL_NAMES
from creeping.plotting.far_cuts import PAGE
from creeping.plotting.palette import COLOURS, GREY, curve_style
from creeping.plotting.parameter_plane import draw_curves, frame, is_torus, page_size, plot_parameters
from creeping.plotting.pictures import TITLE_SIZE, add_legend, axes_or_new, drawn_page
from creeping.rays.fan import RayFan
from creeping.rays.isophase import IsoPhaseCurve
from creeping.shadow.curve import ShadowCurve
from creeping.shadow.line import ShadowLine

KINDS = ("parameters", "3d")


def line_of(curve: ShadowCurve) -> ShadowLine:
    """Shadow line that consists of one curve, for pictures: how far it is from crossing itself is not known."""
    return ShadowLine(curve.body, incident_of_row(curve.wave), (curve,), np.nan, curve.line_nodes())


def plot_line(
    line: ShadowLine,
    ax: Any = None,
    *,
    kind: str | None = None,
    fan: RayFan | None = None,
    curves: Sequence[IsoPhaseCurve] = (),
    rays: int = 48,
    until: float | None = None,
    wavenumber: float | None = None,
    boundary: BoundaryLike = "hard",
    view: View | None = None,
    legend: bool | None = None,
) -> Any:
    """Draw a shadow line, by default in the plane of the body's parameters, in degrees.

    Parameters
    ----------
    line : ShadowLine
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
    shown: dict[str, Any] = {"rays": rays, "until": until, "wavenumber": wavenumber, "boundary": boundary}
    if _in_space(ax, kind):
        if ax is None:
            return _page(compose(line, fan, curves, view=view, **shown), legend is not False)
        from creeping.plotting.axes3d import plot_rays_3d

        return plot_rays_3d(line, fan, curves, ax=ax, view=view, legend=bool(legend), **shown)
    if view is not None:
        raise InvalidInputError("a view is for kind='3d'; the plane of the parameters has none")
    fresh, ax = axes_or_new(ax, page_size(torus=is_torus(line)))
    ax = plot_parameters(line, fan, curves, ax=ax, legend=fresh if legend is None else legend, **shown)
    if fresh:
        title = rays_caption(line, fan, until, wavenumber, boundary)
        ax.set_title(title, fontsize=TITLE_SIZE, loc="left", parse_math=False)
    return ax


def plot_shadow_curve(curve: ShadowCurve, ax: Any = None, **options: Any) -> Any:
    """Draw one curve of a shadow line; options as for `plot_line`."""
    return plot_line(line_of(curve), ax, **options)


def plot_fan(fan: RayFan, ax: Any = None, **options: Any) -> Any:
    """Draw a fan and its shadow line; options as for `plot_line`."""
    return plot_line(fan.line, ax, fan=fan, **options)


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
    fresh, ax = axes_or_new(ax, page, space=space)
    if space:
        points = np.concatenate([curve.points, curve.points[: int(curve.closed)]])
        # above the body of a picture, which orders what it draws by hand
        name = LEVEL_NAMES.get(curve.of, curve.of)
        ax.plot(*points.T, linewidth=1.0, zorder=13, label=f"{name} = {curve.level:g}")
        if fresh:
            ax.set(xlabel="x (L)", ylabel="y (L)", zlabel="z (L)", aspect="equal")
    else:
        framed = bool(ax.get_xlabel())
        draw_curves(ax, [curve])
        if not framed:
            frame(ax, torus=torus)
    add_legend(ax, fresh, legend)
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
    fresh, ax = axes_or_new(ax, PAGE)
    lengths = (flow.horizon,) if growth is None else growth.lengths
    rms, largest = ((error.rms,), (error.max,)) if growth is None else (growth.rms, growth.max)
    for number, name, values in ((1, "max", largest), (0, "rms", rms)):
        ax.plot(lengths, values, marker="os"[number], markersize=4, label=name, **curve_style(number))
    if growth is not None:
        ax.plot(lengths[-1:], [growth.bound], "_", color=COLOURS[0], markersize=12, label="bound of the rms")
    tolerance = flow.parameters.get("tolerance") if tolerance is None else tolerance
    if tolerance is not None:
        ax.axhline(tolerance, color=GREY, linewidth=0.9, linestyle=":", label=f"tolerance {tolerance:.3g}")
    ax.set_yscale("log")
    weighted = getattr(flow.body, "speed", None) is not None
    ax.set_xlabel("travel time of the ray" if weighted else f"length of the ray ({unit_of(flow.body)})", fontsize=9)
    ax.set_ylabel("error of (x, p)", fontsize=9)
    ax.grid(color="#d9dde0", linewidth=0.5)
    ax.tick_params(labelsize=8, direction="in", top=True, right=True, width=0.5, which="both")
    if fresh:
        # a body may be an expression of the user's and is no formula
        ax.set_title(f"{brief(flow.body)}, T0 = {flow.horizon:g}", fontsize=9, parse_math=False)
    add_legend(ax, fresh, legend)
    return ax


def _in_space(ax: Any, kind: str | None) -> bool:
    """Whether to draw in space."""
    if kind is not None and kind not in KINDS:
        raise InvalidInputError(f"kind {kind!r} is unknown; give {' or '.join(KINDS)}")
    space = kind == "3d"
    if ax is None:
        return space
    made_for = "3d" if ax.name == "3d" else "parameters"
    if kind is not None and kind != made_for:
        raise InvalidInputError(f"kind {kind!r} does not fit the axes, which are made for {made_for!r}")
    return made_for == "3d"


def _page(drawing: Drawing, legend: bool) -> Any:
    """Axes of a new figure as `picture` writes it."""
    figure, bar = drawn_page(drawing, "matplotlib", dpi=150)
    if legend:
        drawing.add_legend(figure)
        if drawing.colours.high > drawing.colours.low:
            drawing.colours.add_bar(figure, cax=figure.add_axes(bar))
    return figure.axes[0]
