"""Pictures of the far field in one plane: decibels against the angle, over straight axes or round a circle.

Also here: the picture that a far field draws of itself against the angle.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import Any, ArrayLike, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.field.results.comparison import cross_section_decibels, decibels, shown_range
from creeping.plotting import pages
from creeping.plotting._cut_angles import CutAngles, cut_angles

if TYPE_CHECKING:
    from creeping.field.results.far_result import FarField

ABOVE = 10.0
"""Room for bands over the curves, dB."""
QUANTITIES = {
    "amplitude": ("20 log$_{10}$|f| (dB re 1 %s)", decibels),
    "rcs": ("4π|f|$^2$ (dB re 1 %s$^2$)", cross_section_decibels),
}
COMPONENTS = {"tt": (0, 0), "tp": (0, 1), "pt": (1, 0), "pp": (1, 1)}
"""Scattered by incident component of a vector field: t is θ̂, p is φ̂."""
PARTS = {"creeping": "--", "reflected": "-.", "forward": ":", "dark": "--", "lit": "-."}
"""Line of each part of a far field."""


@dataclass(frozen=True)
class Curve:
    """One curve of a cut: ``levels`` (m,) in dB, NaN where the field is not finite.

    ``band`` (2, m) is the range of its error in dB, down to -inf, NaN where that is not known; ``doubt`` (m,) the
    directions that are unresolved.
    """

    label: str
    levels: FloatArray
    style: dict[str, Any]
    band: FloatArray | None = None
    doubt: BoolArray | None = None

    @property
    def thick(self) -> bool:
        """Whether it sets the range: parts, which are thinner, may vanish."""
        return bool(self.style["linewidth"] > 0.8)

    def ordered(self, order: IntArray, label: str) -> Curve:
        """The same with its points in another order, and another label."""
        band = None if self.band is None else self.band[:, order]
        doubt = None if self.doubt is None else self.doubt[order]
        return Curve(label, self.levels[order], self.style, band, doubt)


def far_cut_picture(
    path: str | os.PathLike[str],
    angles: ArrayLike,
    fields: Mapping[str, FarField | ComplexArray],
    *,
    kind: str = "cartesian",
    quantity: str = "amplitude",
    exact: ComplexArray | None = None,
    parts: bool = False,
    components: Sequence[str] = ("tt", "pp"),
    span: float = 60.0,
    angle_name: str = "angle",
    title: str | None = None,
    unit: str | None = None,
    dpi: int = 300,
) -> None:
    """Write a PNG of far fields against the angle in one plane, with the bands of their errors.

    Angles at which a field is unresolved are hatched.

    Parameters
    ----------
    path : str or path
        File to write.
    angles : (m,), radians
        Angle of each direction; drawn in degrees, and joined in this order.
    fields : dict of label to FarField or complex (m,) or (m, 2, 2), L
        Curves, first over last.
    kind : str
        "cartesian", or "polar": angle 0 at the top, clockwise.
    quantity : str
        "amplitude", 20 log10 |f|, or "rcs", 10 log10(4π|f|²): dBsm of conductors in metres.
    exact : complex (m,) or (m, 2, 2), L, optional
        Reference, drawn thin and black under the others.
    parts : bool
        Whether to draw the ``parts`` of each FarField as thin lines.
    components : sequence of str
        Of vector fields: "tt", "tp", "pt", "pp", scattered by incident, t for θ̂ and p for φ̂.
    span : float, dB
        Range below the highest value; what is lower is cut off.
    angle_name : str
        Name of the angle on the axis.
    title : str, optional
        By default the wavenumber and the boundary, where all fields share them.
    unit : str, optional
        Of lengths; by default that of the fields.
    dpi : int

    Raises
    ------
    InvalidInputError
        On an unknown kind, quantity or component, on shapes that do not fit, or where nothing can be drawn.
    CreepingError
        If the file cannot be written.
    """
    if kind not in ("cartesian", "polar"):
        raise InvalidInputError(f"kind {kind!r} is unknown; give cartesian or polar")
    angle = checked_angles(angles)
    curves = cut_curves(len(angle), fields, quantity=quantity, exact=exact, parts=parts, components=components)
    heights = heights_of(curves, span)
    units = {getattr(field, "unit", "L") for field in fields.values()}
    shared = units.pop() if len(units) == 1 else "L"
    level = level_name(quantity, unit or shared, [getattr(one, "total", one) for one in fields.values()])
    if title is None:
        whole = [one for one in fields.values() if hasattr(one, "total")]
        known = {f"{pages.wave_title(one, getattr(one, 'unit', 'L'))} boundary" for one in whole}
        title = known.pop() if len(known) == 1 else ""
    with pages.written_figure(path, pages.PAGE if kind == "cartesian" else (6.4, 6.4), dpi) as figure:
        ax = figure.add_subplot(projection="polar" if kind == "polar" else None)
        draw_cut(ax, angle, curves, heights, level=level, angle_name=angle_name)
        ax.set_title(title, fontsize=9)
        pages.add_legend(ax, fresh=True)


def heights_of(curves: Sequence[Curve], span: float) -> tuple[float, float]:
    """Lowest and highest decibel of an axis for thick curves and their bands, at most ``span`` below the curves.

    Of a band what 95 of 100 values reach counts, as of stated errors, and at most `ABOVE` over the curves.
    """
    thick = [curve for curve in curves if curve.thick]
    levels = [curve.levels for curve in thick]
    _, top = shown_range(levels, span)
    ends: list[FloatArray] = []
    for band in (curve.band for curve in thick if curve.band is not None):
        below, above = (end[np.isfinite(end)] for end in band)
        ends += [np.maximum(np.quantile(below, [0.05]), top - span)] if len(below) else []
        ends += [np.minimum(np.quantile(above, [0.95]), top + ABOVE)] if len(above) else []
    low, high = shown_range([*levels, *ends], span + ABOVE)
    # a narrow axis ends at whole decibels rather than fives
    if high - low <= 10.0:
        low, high = shown_range([*levels, *ends], span + ABOVE, step=1.0)
    return max(low, top - span), high


def band_words(curves: Sequence[Curve], low: float, high: float) -> str:
    """What the legend calls the bands of curves on an axis."""
    bands = [curve.band for curve in curves if curve.band is not None]
    beyond = any(bool(np.any(band[0] < low) or np.any(band[1] > high)) for band in bands)
    return "stated error, in part beyond the axis" if beyond else "stated error"


def draw_cut(
    ax: Any,
    angle: FloatArray,
    curves: Sequence[Curve],
    heights: tuple[float, float],
    *,
    level: str,
    angle_name: str,
) -> None:
    """Draw curves over an angle (m,), radians: straight axes in degrees, or polar ones; the first curve on top.

    Axes that have curves already keep room for them. ``level`` names what the curves are, with its unit.
    """
    low, high = heights
    if ax.lines:
        low, high = min(low, ax.get_ylim()[0]), max(high, ax.get_ylim()[1])
    polar = ax.name == "polar"
    dress = _round_axes if polar else _straight_axes
    dress(ax, angle, (low, high), level, angle_name)
    draw_curves(ax, angle if polar else np.degrees(angle), curves, (low, high))
    _hatch(ax, angle, curves)


def draw_curves(ax: Any, x: FloatArray, curves: Sequence[Curve], heights: tuple[float, float]) -> None:
    """Draw curves over x (m,) with the bands of their errors, the first curve on top."""
    low, high = heights
    # lines that leave the axes through the floor are cut there; round a circle they would pass the centre
    floor = low if ax.name == "polar" else low - (high - low)
    name = band_words(curves, low, high)
    for curve in reversed(curves):
        if curve.band is not None:
            look = {"color": curve.style["color"], "alpha": 0.18, "linewidth": 0, "zorder": 0.5}
            ax.fill_between(x, *np.maximum(curve.band, floor), label=name, **look)
            name = "_one entry is enough"
        ax.plot(x, np.maximum(curve.levels, floor), label=curve.label, **curve.style)


def _hatch(ax: Any, angle: FloatArray, curves: Sequence[Curve]) -> None:
    """Hatch the angles at which a curve is unresolved, half a step to both sides of each direction."""
    doubts = [curve.doubt for curve in curves if curve.doubt is not None]
    if not doubts or not np.any(doubts):
        return
    doubtful = np.any(doubts, axis=0)
    across = angle if ax.name == "polar" else np.degrees(angle)
    middles = 0.5 * (across[1:] + across[:-1])
    starts, ends = np.append(across[:1], middles), np.append(middles, across[-1:])
    edges = np.flatnonzero(np.diff(np.concatenate([[0], doubtful.astype(int), [0]])))
    look: dict[str, Any] = {"facecolor": "none", "edgecolor": "#b4b9bd", "hatch": "////", "linewidth": 0, "zorder": 0.2}
    label = "unresolved"
    for first, after in edges.reshape(-1, 2):
        span = sorted((starts[first], ends[after - 1]))
        ax.axvspan(*span, label=label, **look)
        label = "_one entry is enough"


def level_name(quantity: str, unit: str, totals: Iterable[Any]) -> str:
    """Name of the levels on an axis: decibels relative to a unit of length or area, dBsm for conductors in metres."""
    if quantity == "rcs" and unit == "m" and any(np.ndim(total) == 3 for total in totals):
        return "4π|f|$^2$ (dBsm)"
    return QUANTITIES[quantity][0] % unit.replace("$", r"\$")


def cut_curves(
    count: int,
    fields: Mapping[str, FarField | ComplexArray],
    *,
    quantity: str = "amplitude",
    exact: ComplexArray | None = None,
    parts: bool = False,
    components: Sequence[str] = ("tt", "pp"),
) -> list[Curve]:
    """Curves of a cut of ``count`` directions, topmost first; for the arguments see `far_cut_picture`."""
    if quantity not in QUANTITIES:
        raise InvalidInputError(f"quantity {quantity!r} is unknown; give {' or '.join(QUANTITIES)}")
    unknown = [name for name in components if name not in COMPONENTS]
    if unknown or not components:
        raise InvalidInputError(f"components {list(components)} are not among {', '.join(COMPONENTS)}")
    if not fields:
        raise InvalidInputError("there is no field to draw; give one at least")
    thick: list[Curve] = []
    thin: list[Curve] = []
    for label, field in fields.items():
        whole = field if isinstance(field, np.ndarray) else getattr(field, "total", field)
        for suffix, pick in _picks(label, whole, count, components):
            style = pages.curve_style(len(thick))
            colour = style["color"]
            doubt = getattr(field, "unresolved", None)
            levels, band = _levels(pick(whole), quantity), _band(field, pick, quantity)
            thick.append(Curve(label + suffix, levels, style, band, doubt))
            for number, (part, values) in enumerate(getattr(field, "parts", {}).items() if parts else ()):
                # of one curve alone the parts have colours of their own, of several that of their curve
                own = pages.COLOURS[1 + number] if len(fields) == 1 and not suffix else colour
                style = {"color": own, "linewidth": 0.7, "linestyle": PARTS[part]}
                levels = _levels(pick(values), quantity)
                # a part that is nowhere has no line
                if np.any(np.isfinite(levels)):
                    thin.append(Curve(f"{label}{suffix}, {part}", levels, style))
    if exact is not None:
        for suffix, pick in _picks("exact", exact, count, components):
            # broad and pale, so that a curve that lies on it hides it not
            style = {"color": pages.EXACT, "linewidth": 3.2, "alpha": 0.3}
            thin.append(Curve(f"exact{suffix}", _levels(pick(exact), quantity), style))
    return thick + thin


def _band(field: Any, pick: Any, quantity: str) -> FloatArray | None:
    """Levels of |f| less and more its error (2, m); None of a field without one."""
    error = getattr(field, "error", None)
    if error is None or not np.any(np.isfinite(error)):
        return None
    size, off = np.abs(pick(field.total)), pick(error)
    ends = np.stack([np.maximum(size - off, 0.0), size + off])
    return np.asarray(QUANTITIES[quantity][1](ends.astype(complex)))


def checked_angles(angles: ArrayLike) -> FloatArray:
    """Angles of a cut (m,), radians, if they are usable."""
    angle = np.asarray(angles, dtype=float)
    if angle.ndim != 1 or len(angle) < 2 or not np.all(np.isfinite(angle)):
        raise InvalidInputError(f"angles of shape {angle.shape} are not two or more finite numbers in radians")
    return angle


def _picks(label: str, values: Any, count: int, components: Sequence[str]) -> list[tuple[str, Any]]:
    """Suffix of the label and selection of the values (m,) for every curve of one field."""
    shape = np.shape(values)
    if shape == (count,):
        return [("", np.asarray)]
    if shape != (count, 2, 2):
        raise InvalidInputError(
            f"field {label!r} has shape {shape}; {count} angles take ({count},) or ({count}, 2, 2) complex numbers"
        )
    picks = {name: lambda v, at=COMPONENTS[name]: np.asarray(v)[:, *at] for name in components}
    return [(f" {component_name(name)}", pick) for name, pick in picks.items()]


def component_name(name: str) -> str:
    """Name of a component of a vector field, and what radar calls it: θ̂ is vertical, φ̂ horizontal.

    Examples
    --------
    >>> component_name("tt"), component_name("pt")
    ('θθ (VV)', 'φθ (HV)')
    """
    greek, radar = (name.translate(str.maketrans("tp", letters)) for letters in ("θφ", "VH"))
    return f"{greek} ({radar})"


def _levels(values: ComplexArray, quantity: str) -> FloatArray:
    levels: FloatArray = QUANTITIES[quantity][1](values)
    return np.where(np.isposinf(levels), np.nan, levels)


def _straight_axes(ax: Any, angle: FloatArray, heights: tuple[float, float], label: str, angle_name: str) -> None:
    from matplotlib.ticker import MaxNLocator

    left, right = np.degrees(angle.min()), np.degrees(angle.max())
    if ax.lines:
        left, right = min(left, ax.get_xlim()[0]), max(right, ax.get_xlim()[1])
    ax.set(xlim=(left, right), ylim=heights)
    # multiples of 15, 30, 45, ... degrees
    ax.xaxis.set_major_locator(MaxNLocator(9, steps=[1, 1.5, 2, 3, 4.5, 6, 9, 10]))
    pages.dressed(ax, f"{angle_name} (degrees)", label)
    ax.spines[:].set_linewidth(0.5)


def _round_axes(ax: Any, _: FloatArray, heights: tuple[float, float], label: str, angle_name: str) -> None:
    from matplotlib.patheffects import withStroke

    ax.set_theta_zero_location("N")
    ax.set_theta_direction(-1)
    signed = [v if v <= 180 else v - 360 for v in range(0, 360, 30)]
    ax.set_thetagrids(range(0, 360, 30), labels=[f"{pages.minus(v)}°" for v in signed])
    low, high = heights
    step = next(s for s in (5, 10, 20, 50, 100, 1000) if (high - low) / s <= 6)
    rings = np.arange(step * np.ceil(low / step + 1e-9), high + 1e-9, step)
    ax.set_ylim(low, high)
    ax.set_rgrids(rings, labels=[""] * len(rings))
    # between two spokes, away from the forward lobe; over the curves, which may pass there
    for text in [one for one in ax.texts if one.get_gid() == "ring"]:
        text.remove()
    halo = [withStroke(linewidth=2.0, foreground="white")]
    look: dict[str, Any] = {"fontsize": 7, "color": pages.GREY, "ha": "center", "va": "center", "gid": "ring"}
    for ring in rings:
        ax.text(np.radians(165), ring, pages.minus(ring), path_effects=halo, zorder=4, **look)
    ax.tick_params(axis="x", labelsize=8)
    ax.grid(color="#d9dde0", linewidth=0.5)
    ax.spines["polar"].set_linewidth(0.5)
    ax.set_xlabel(f"{angle_name}; rings: {label}", fontsize=9)


def plot_far(
    far: FarField,
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
        10 log10(4π|f|²), dBsm of conductors in metres, or 20 log10 |f|.
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
    heights = heights_of(curves, span)
    # where something else tells, the name of the whole is left out
    labels = [curve.label.removeprefix("total").lstrip(", ") or curve.label for curve in curves]
    curves = [curve.ordered(cut.order, label) for curve, label in zip(curves, labels, strict=True)]
    fresh, ax = pages.axes_or_new(ax, pages.PAGE)
    unit, values = unit or far.unit, cut.values[cut.order]
    draw_cut(ax, values, curves, heights, level=level_name(quantity, unit, [far.total]), angle_name=cut.name)
    # crosses where there is no curve
    x = values if ax.name == "polar" else np.degrees(values)
    look: dict[str, Any] = {"linestyle": "none", "markersize": 4, "markeredgewidth": 0.8, "zorder": 4}
    gone = np.any([np.isnan(curve.levels) for curve in curves if curve.thick], axis=0)
    if np.any(gone):
        height = np.full(int(gone.sum()), heights[1])
        ax.plot(x[gone], height, marker="x", color=pages.GREY, label="not finite", clip_on=False, **look)
    return pages.finished(ax, fresh, f"{pages.wave_title(far, unit)} boundary", legend)
