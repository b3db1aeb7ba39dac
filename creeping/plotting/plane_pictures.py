"""Pictures of the field on a plane through a body: its size or its wave in colours, wave fronts, and what is not known.

Wave fronts are where Re(u e^{-i phase}) = 0, half a wavelength apart; ``phase`` is omega t.
"""

import os

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.cut_result import FieldCut
from creeping.field.decibels import decibels, shown_range
from creeping.plotting.body_fronts import LEAST_SAMPLES, at_phase
from creeping.plotting.colour_bar import add_bar, beyond
from creeping.plotting.coloured_body import NOTHING
from creeping.plotting.pictures import axes_or_new, new_figure, save_figure, wave_title
from creeping.plotting.plane_marks import FRONT, add_cut_legend, dress, hatch, missing_of

SHOWS = ("level", "magnitude", "wave")
MOST_FRONTS = 40.0
"""Wavelengths across a picture up to which it has wave fronts unless they are asked for."""
PAGE = 6.4  # inches


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
    fresh, ax = axes_or_new(ax, _page(cut))
    _draw(cut, ax, quantity=quantity, show=show, fronts=fronts, phase=phase, span=span)
    if fresh:
        ax.set_title(_title(cut), fontsize=9, parse_math=False)
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
    figure = new_figure((width, height if not error else 2 * height - 0.7))
    figure.set_layout_engine("constrained")
    panels = figure.subplots(2, 1, sharex=True) if error else [figure.add_subplot()]
    _draw(cut, panels[0], quantity=quantity, show=show, fronts=fronts, phase=phase, span=span)
    if error:
        panels[0].set_xlabel("")
        _draw_error(cut, panels[1], span)
    panels[0].set_title(title or _title(cut), fontsize=9, parse_math=False)
    add_cut_legend(cut, panels[0], fresh=True, fronts=_with_fronts(cut, show, fronts))
    save_figure(figure, path, dpi)


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
        raise InvalidInputError(f"show = {show!r} is not one of {', '.join(SHOWS)}")
    values = np.where(missing, np.nan, np.where(np.isneginf(values), look["vmin"], values))
    _paint(cut, ax, values, label, beyond(values, look["vmin"], look["vmax"]), look)
    if _with_fronts(cut, show, fronts):
        shown = np.where(missing, np.nan, _filled(wave, cut.outside))
        ax.contour(cut.across, cut.up, shown, [0.0], colors=FRONT, linewidths=0.5, alpha=0.6, zorder=1.4)
    hatch(cut, ax, size)
    dress(cut, ax)


def _draw_error(cut: FieldCut, ax: Any, span: float) -> None:
    levels = decibels(cut.error)
    finite = levels[np.isfinite(levels)]
    low, high = shown_range([np.clip(finite, *np.percentile(finite, [0.5, 100.0]))], span)
    look = {"vmin": low, "vmax": high, "cmap": "viridis"}
    shown = np.where(np.isneginf(levels), low, levels)
    _paint(cut, ax, shown, "20 log$_{10}$ error (dB)", beyond(shown, low, np.inf), look)
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
    add_bar(ax.figure, image, label, extend=extend, fontsize=9, ax=ax, shrink=0.9, pad=0.02)


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
    few = max(np.ptp(cut.across), np.ptp(cut.up)) <= MOST_FRONTS * wavelength
    return bool(fine and few and show != "wave") if fronts is None else fronts


def _title(cut: FieldCut) -> str:
    field = cut.field
    ok = field.ok & np.isfinite(field.error)
    off = field.error[ok]
    told = f"; error {np.median(off):.1g} {field.unit} in the median, {off.max():.1g} at most" if off.size else ""
    return f"{wave_title(field, field.length_unit)}{told}"


def _page(cut: FieldCut) -> tuple[float, float]:
    share = float(np.ptp(cut.up) / np.ptp(cut.across))
    return PAGE, float(np.clip(0.74 * PAGE * share + 1.0, 2.4, 9.0))
