"""Pictures of the field on a plane through a body: its size or its wave in colours, wave fronts, and what is not known.

Wave fronts are where Re(u e^{-i phase}) = 0, half a wavelength apart; ``phase`` is omega t.

Also here: what stands on pictures of the field on a plane: the body's section, the shadow line, axes, what is not
known.

Hatched is what is not OK, dotted where the field is less than its error.
"""

import os

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.cut_result import FieldCut, grid_points, status_words
from creeping.field.results.comparison import decibels, shown_range
from creeping.field.results.point_result import FieldStatus
from creeping.geometry.surface import inside, why_no_rays
from creeping.plotting import pages
from creeping.plotting.coloured_body import LEAST_SAMPLES, NOTHING, at_phase

HATCH, HATCHED = "///", "#6d767d"
DOUBTFUL = "#a3476a", "#ffffff"
"""Colours in the legend of what is hatched upon the colours of the field."""
DOTS, DOTTED = "....", "#9db4c2"


def plot_field_cut(
    cut: FieldCut,
    ax: Any = None,
    *,
    quantity: str | None = None,
    show: str = "level",
    fronts: bool | None = None,
    phase: float = 0.0,
    span: float = 40.0,
    legend: bool | None = None,
) -> Any:
    """Draw the field on a plane with the body's section and the points of the shadow line.

    Hatched is what is not to be trusted, grey where most of the field is missing; dotted where |u| is below its error.

    Parameters
    ----------
    cut : FieldCut
    ax : matplotlib.axes.Axes, optional
        By default those of a new figure.
    quantity : str, optional
        "u"; "E" (if not given) or "H" of a conductor.
    show : {"level", "magnitude", "wave"}
        20 log10 |u|, |u|, or the wave itself, Re(u e^{-i phase}), of E and H the component that the incident one has.
    fronts : bool, optional
        Whether to draw wave fronts; by default where they are neither too many nor too coarsely sampled, and not on the
        wave itself.
    phase : float, radians
        omega t.
    span : float, dB
        Range of the levels below the highest.
    legend : bool
        By default on a new figure only.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    InvalidInputError
        On an unknown quantity or kind of picture, a bad span, or wave fronts of a cut that is too coarse for them.
    """
    fresh, ax = pages.axes_or_new(ax, _page(cut))
    _draw(cut, ax, quantity=quantity, show=show, fronts=fronts, phase=phase, span=span)
    pages.finished(ax, fresh, _title(cut), legend=False)
    if fresh if legend is None else legend:
        add_cut_legend(cut, ax, fresh=fresh, fronts=_with_fronts(cut, show, fronts))
    return ax


def field_cut_picture(
    path: str | os.PathLike[str],
    cut: FieldCut,
    *,
    quantity: str | None = None,
    show: str = "level",
    fronts: bool | None = None,
    phase: float = 0.0,
    span: float = 40.0,
    error: bool = False,
    title: str = "",
    dpi: int = 200,
) -> None:
    """Write a PNG of the field on a plane through a body; see `plot_field_cut`.

    Parameters
    ----------
    path : str or path
        File to write.
    cut : FieldCut
        By `creeping.field_cut`.
    quantity, show, fronts, phase, span
        As of `plot_field_cut`.
    error : bool
        Whether a second panel shows the error of the field.
    title : str
        By default wavenumber and boundary.
    dpi : int

    Raises
    ------
    InvalidInputError
        As `plot_field_cut`.
    CreepingError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> from creeping.plotting import field_cut_picture
    >>> ball = sc.Sphere()
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), cr.shadow_line(ball, (0, 0, 1)), length=3.2, n_rays=24)
    >>> cut = cr.field_cut(fan, wavenumber=8.0, boundary="hard", extent=(3.0, 3.0), step=0.25)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     field_cut_picture(f"{folder}/cut.png", cut, fronts=False, dpi=60)
    """
    width, height = _page(cut)
    with pages.written_figure(path, (width, height if not error else 2 * height - 0.7), dpi) as figure:
        panels = figure.subplots(2, 1, sharex=True) if error else [figure.add_subplot()]
        _draw(cut, panels[0], quantity=quantity, show=show, fronts=fronts, phase=phase, span=span)
        if error:
            panels[0].set_xlabel("")
            _draw_error(cut, panels[1], span)
        pages.finished(panels[0], True, title or _title(cut), legend=False)
        add_cut_legend(cut, panels[0], fresh=True, fronts=_with_fronts(cut, show, fronts))


def _draw(
    cut: FieldCut, ax: Any, *, quantity: str | None, show: str, fronts: bool | None, phase: float, span: float
) -> None:
    size, wave = cut.magnitude(quantity), at_phase(cut.wave(quantity), phase)
    name = quantity or cut.quantities[0]
    missing = missing_of(cut)
    look: dict[str, Any]
    if show == "level":
        levels = decibels(size)
        low, high = shown_range([levels[cut.outside & ~missing]], span)
        values, label, look = levels, f"20 log$_{{10}}$|{name}| (dB)", {"vmin": low, "vmax": high, "cmap": "magma"}
    elif show == "magnitude":
        # a focus of a few points does not darken the rest
        high = _top(size[cut.outside & ~missing], 99.9)
        values, label, look = size, f"|{name}|", {"vmin": 0.0, "vmax": high, "cmap": "magma"}
    elif show == "wave":
        high = _top(np.abs(wave[cut.outside & ~missing]), 99.5)
        of = name if name == "u" else f"{name}·{name}$_0$*/|{name}$_0$|"
        label = f"Re({of} e$^{{-iωt}}$), ωt = {np.degrees(phase):.4g}°" if phase else f"Re({of})"
        values, look = wave, {"vmin": -high, "vmax": high, "cmap": "RdBu_r"}
    else:
        raise InvalidInputError(f"show = {show!r} is not one of level, magnitude, wave")
    values = np.where(missing, np.nan, np.where(np.isneginf(values), look["vmin"], values))
    _paint(cut, ax, values, label, pages.beyond(values, look["vmin"], look["vmax"]), look)
    if _with_fronts(cut, show, fronts):
        shown = np.where(missing, np.nan, _filled(wave, cut.outside))
        ax.contour(cut.across, cut.up, shown, [0.0], colors="white", linewidths=0.5, alpha=0.6, zorder=1.4)
    hatch(cut, ax, size)
    dress(cut, ax)


def _draw_error(cut: FieldCut, ax: Any, span: float) -> None:
    levels = decibels(cut.error)
    finite = levels[np.isfinite(levels)]
    low, high = shown_range([np.clip(finite, *np.percentile(finite, [0.5, 100.0]))], span)
    look = {"vmin": low, "vmax": high, "cmap": "viridis"}
    shown = np.where(np.isneginf(levels), low, levels)
    _paint(cut, ax, shown, "20 log$_{10}$ error (dB)", pages.beyond(shown, low, np.inf), look)
    hatch(cut, ax, None)
    dress(cut, ax)


def _paint(cut: FieldCut, ax: Any, values: FloatArray, label: str, extend: str, look: dict[str, Any]) -> None:
    from matplotlib.colors import to_rgba

    ax.set_facecolor(NOTHING)
    half = [0.5 * (one[1] - one[0]) for one in (cut.across, cut.up)]
    ends = [end for one, h in zip((cut.across, cut.up), half, strict=True) for end in (one[0] - h, one[-1] + h)]
    shown = np.ma.masked_invalid(_filled(values, np.isfinite(values)))
    way: dict[str, Any] = {"origin": "lower", "extent": ends}
    image = ax.imshow(shown, interpolation="bilinear", interpolation_stage="data", **way, **look)
    unknown = cut.outside & ~np.isfinite(values)
    if np.any(unknown):
        cover = np.zeros((*unknown.shape, 4))
        cover[unknown] = to_rgba(NOTHING)
        ax.imshow(cover, interpolation="nearest", zorder=1.45, **way)
    pages.add_bar(ax.figure, image, label, extend=extend, fontsize=9, ax=ax, shrink=0.9, pad=0.02)


def _top(sizes: FloatArray, share: float) -> float:
    """Upper end of the colours: above it are a few in a hundred, or there is nothing to show."""
    return float(np.percentile(sizes, share)) or 1.0 if sizes.size else 1.0


def _filled(values: FloatArray, known: BoolArray) -> FloatArray:
    """Values with those that are not known, which are painted over, from the nearest that is."""
    from scipy.ndimage import distance_transform_edt

    if not np.any(known):
        return np.full(values.shape, np.nan)
    nearest = distance_transform_edt(~known, return_distances=False, return_indices=True)
    return np.asarray(values[tuple(nearest)])


def _with_fronts(cut: FieldCut, show: str, fronts: bool | None) -> bool:
    wavelength = 2 * np.pi / cut.field.wavenumber
    fine = cut.step * LEAST_SAMPLES <= wavelength
    if fronts and not fine:
        raise InvalidInputError(
            f"wave fronts of points {cut.step:.3g} apart: a wavelength has {wavelength / cut.step:.2g}; give a step of "
            f"{wavelength / LEAST_SAMPLES:.2g} or less, or fronts=False"
        )
    # more than 40 fronts across a picture hide it
    few = max(np.ptp(cut.across), np.ptp(cut.up)) <= 40.0 * wavelength
    return bool(fine and few and show != "wave") if fronts is None else fronts


def _title(cut: FieldCut) -> str:
    field = cut.field
    ok = field.ok & np.isfinite(field.error)
    off = field.error[ok]
    told = f"; error {np.median(off):.1g} {field.unit} in the median, {off.max():.1g} at most" if off.size else ""
    return f"{pages.wave_title(field, field.length_unit)}{told}"


def _page(cut: FieldCut) -> tuple[float, float]:
    share = float(np.ptp(cut.up) / np.ptp(cut.across))
    width = pages.PAGE[0]
    return width, float(np.clip(0.74 * width * share + 1.0, 2.4, 9.0))


def missing_of(cut: FieldCut) -> BoolArray:
    """Where most of the field is missing: neither OK nor merely of a large error."""
    kept = (FieldStatus.OK, FieldStatus.UNRESOLVED)
    return np.asarray(cut.outside & ~np.isin(cut.status, kept))


def below_error(cut: FieldCut, size: FloatArray) -> BoolArray:
    """Where the field is OK, and less than its error."""
    with np.errstate(invalid="ignore"):
        return np.asarray((cut.status == FieldStatus.OK) & (size < cut.error))


def hatch(cut: FieldCut, ax: Any, size: FloatArray | None) -> None:
    """Hatch what is not OK, and dot what is below its error if the size is given."""
    missing = missing_of(cut)
    doubtful = cut.outside & ~missing & (cut.status != FieldStatus.OK)
    marks = [(missing, HATCH, HATCHED), (doubtful, HATCH, DOUBTFUL[1])]
    if size is not None:
        marks.append((below_error(cut, size), DOTS, DOTTED))
    for where, pattern, colour in marks:
        if not np.any(where):
            continue
        look: dict[str, Any] = {"colors": "none", "hatches": [pattern], "zorder": 1.5}
        filled = ax.contourf(cut.across, cut.up, where.astype(float), [0.5, 1.5], **look)
        # the colour of hatches is that of edges
        filled.set(edgecolor=colour, linewidth=0.0)


def dress(cut: FieldCut, ax: Any) -> None:
    """Section of the body, shadow line, direction of the wave and axes."""
    from matplotlib.patheffects import withStroke

    # 400 points along the longer side, so that the section is drawn round
    share = max(1, int(np.ceil(400 / max(cut.outside.shape))))
    across, up = (np.linspace(one[0], one[-1], share * (len(one) - 1) + 1) for one in (cut.across, cut.up))
    points = grid_points(cut.point, cut.axes, across, up)
    level = _level(cut.body, points.reshape(-1, 3)).reshape(points.shape[:2])
    if level.min() < 0 < level.max():
        ax.contourf(across, up, level, [level.min() - 1.0, 0.0], colors=pages.GREY, zorder=2)
        ax.contour(across, up, level, [0.0], colors="#111111", linewidths=0.8, zorder=2.1)
    ax.plot(*cut.shadow_points().T, "o", color="#111111", markeredgecolor="#ffffff", markersize=5, zorder=3)
    along = cut.axes @ cut.direction
    if np.hypot(*along) > 0.2:
        middle = np.array([0.14, 0.9])
        box = {"boxstyle": "round,pad=0.2", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}
        look: dict[str, Any] = {"fontsize": 9, "weight": "bold", "ha": "center", "va": "center", "bbox": box}
        ax.annotate("d", middle - 0.085 * along, xycoords="axes fraction", **look)
        arrow = {"arrowstyle": "-|>", "color": "#111111", "linewidth": 1.4, "shrinkA": 0, "shrinkB": 0}
        arrow["path_effects"] = [withStroke(linewidth=3.2, foreground="#ffffff")]
        ends = middle + 0.08 * along, middle - 0.05 * along
        ax.annotate("", *ends, xycoords="axes fraction", textcoords="axes fraction", arrowprops=arrow)
    ax.set(aspect="equal", xlim=cut.across[[0, -1]], ylim=cut.up[[0, -1]])
    ax.set_xlabel(_axis(cut, 0) + _place(cut), fontsize=9)
    ax.set_ylabel(_axis(cut, 1), fontsize=9)
    ax.tick_params(labelsize=8, width=0.5)


def _level(body: Any, points: FloatArray) -> FloatArray:
    """F of a body, or of one without F 0.5 outside and -0.5 inside (n,)."""
    if why_no_rays(body):
        return np.where(inside(body, points), -0.5, 0.5)
    return np.asarray(np.nan_to_num(body.level(points), nan=-1.0))


def _axis(cut: FieldCut, number: int) -> str:
    axis, unit = cut.axes[number], cut.field.length_unit
    place = int(np.argmax(np.abs(axis)))
    if abs(axis[place]) > 1 - 1e-9:
        offset = cut.point[place]
        name = f"{'-' if axis[place] < 0 else ''}{'xyz'[place]}"
        return f"{name} ({unit})" if abs(offset) < 1e-9 else f"{name} from {'xyz'[place]} = {offset:.4g} ({unit})"
    if abs(axis @ cut.direction) > 1 - 1e-9:
        return f"along d ({unit})"
    return f"along ({', '.join(f'{v:.3g}' for v in axis + 0.0)}) ({unit})"


def _place(cut: FieldCut) -> str:
    """Where the plane is, unless it passes through the origin."""
    normal = np.cross(*cut.axes)
    height = float(normal @ cut.point)
    if abs(height) < 1e-9:
        return ""
    place = int(np.argmax(np.abs(normal)))
    if abs(normal[place]) > 1 - 1e-9:
        return f", at {'xyz'[place]} = {cut.point[place]:.4g}"
    return f", through ({', '.join(f'{v:.4g}' for v in cut.point + 0.0)})"


def add_cut_legend(cut: FieldCut, ax: Any, *, fresh: bool, fronts: bool = False) -> None:
    """Legend below a new figure, or on axes that were given."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch
    from matplotlib.patheffects import withStroke

    handles: list[Any] = []
    if np.any(~cut.outside):
        handles.append(Patch(facecolor=pages.GREY, edgecolor="#111111", label="body"))
    if len(cut.shadow_points()):
        look: dict[str, Any] = {"color": "#111111", "markeredgecolor": "#ffffff", "markersize": 5}
        handles.append(Line2D([], [], marker="o", linestyle="none", label="shadow line", **look))
    if fronts:
        # white on white would not be seen
        around = [withStroke(linewidth=4.0, foreground="#8c4a6e")]
        handles.append(Line2D([], [], color="white", linewidth=1.0, path_effects=around, label="wave front"))
    if words := status_words(cut):
        face, edge = (NOTHING, HATCHED) if np.any(missing_of(cut)) else DOUBTFUL
        handles.append(Patch(facecolor=face, edgecolor=edge, linewidth=0, hatch=HATCH, label=f"not OK: {words}"))
    if any(np.any(below_error(cut, cut.magnitude(name))) for name in cut.quantities):
        handles.append(Patch(facecolor="#2b2140", edgecolor=DOTTED, linewidth=0, hatch=DOTS, label="below its error"))
    columns = len(handles) if sum(len(one.get_label()) for one in handles) < 70 else 2
    if handles and fresh:
        ax.figure.legend(handles=handles, loc="outside lower center", ncols=columns, frameon=False, fontsize=8)
    elif handles:
        ax.legend(handles=handles, frameon=True, fontsize=8)
