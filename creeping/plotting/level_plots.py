"""Pictures that results draw of their levels: a far field against the angle, a map's error against the ray's length."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from creeping._presenting import brief
from creeping._typing import Any, ArrayLike, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.decibels import shown_range
from creeping.geometry.unit import unit_of
from creeping.plotting._cut_angles import CutAngles, cut_angles
from creeping.plotting.far_cuts import Curve, checked_angles, cut_curves, draw_cut, level_name
from creeping.plotting.palette import COLOURS, GREY, curve_style
from creeping.plotting.pictures import add_legend, axes_or_new, wave_title

if TYPE_CHECKING:
    from creeping.field.far_result import FarField
    from creeping.phaseflow.phase_map import PhaseMap

PAGE = (6.4, 4.2)  # inches


def plot_far(
    far: "FarField",
    ax: Any = None,
    *,
    quantity: str = "rcs",
    parts: bool = False,
    components: Sequence[str] = ("tt", "pp"),
    angles: ArrayLike | None = None,
    angle_name: str = "angle",
    unit: str | None = None,
    span: float = 60.0,
    legend: bool | None = None,
) -> Any:
    """Draw a cut of the far field in decibels against the angle in degrees, round a circle on polar axes.

    Directions that are unresolved are hatched; crosses at the upper edge mark those where the field is not finite.

    Parameters
    ----------
    far : FarField
        In directions of one plane through the origin, or of one θ, unless ``angles`` are given.
    ax : matplotlib.axes.Axes, optional
        By default those of a new figure.
    quantity : {"rcs", "amplitude"}
        10 log10(4π|f|²), dBsm where lengths are known to be metres, or 20 log10 |f|.
    parts : bool
        Whether to draw the field's ``parts`` as thin lines.
    components : sequence of str
        Of vector fields: "tt", "tp", "pt", "pp", scattered by incident, t for θ̂ and p for φ̂.
    angles : (m,), radians, optional
        Angle of each direction, joined in this order; by default found from the directions.
    angle_name : str
        Name of ``angles``.
    unit : str, optional
        Of lengths; by default that of the result, "m" where the body knows it.
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
        If the directions are on no cut, or nothing can be drawn.
    """
    if angles is None:
        cut = cut_angles(far.directions)
    else:
        given = checked_angles(angles)
        cut = CutAngles(given, angle_name, np.arange(len(given)))
    curves = cut_curves(len(cut.values), {"total": far}, quantity=quantity, parts=parts, components=components)
    heights = shown_range([curve.levels for curve in curves if curve.thick], span)
    curves = [curve.ordered(cut.order, _short(curve.label)) for curve in curves]
    fresh, ax = axes_or_new(ax, PAGE)
    unit = unit or far.unit
    draw_cut(ax, cut.values[cut.order], curves, heights, level=level_name(quantity, unit), angle_name=cut.name)
    _mark(ax, cut.values[cut.order], curves, heights[1])
    if fresh:
        ax.set_title(f"{wave_title(far, unit)} boundary", fontsize=9, parse_math=False)
    add_legend(ax, fresh, legend)
    return ax


def _short(label: str) -> str:
    """Label without the name of the whole, where something else tells: "total" alone stays."""
    return label.removeprefix("total").lstrip(", ") or label


def _mark(ax: Any, angle: FloatArray, curves: Sequence[Curve], high: float) -> None:
    """Crosses where there is no curve."""
    x = angle if ax.name == "polar" else np.degrees(angle)
    look: dict[str, Any] = {"linestyle": "none", "markersize": 4, "markeredgewidth": 0.8, "zorder": 4}
    gone = np.any([np.isnan(curve.levels) for curve in curves if curve.thick], axis=0)
    if np.any(gone):
        height = np.full(int(gone.sum()), high)
        ax.plot(x[gone], height, marker="x", color=GREY, label="not finite", clip_on=False, **look)


def plot_growth(flow: "PhaseMap", ax: Any = None, *, tolerance: float | None = None, legend: bool | None = None) -> Any:
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
