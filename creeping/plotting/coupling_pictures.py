"""Pictures of couplings: of a port to the rest of a hard body as colours, of ports as a matrix, of sources afar.

On the body |u| of a unit point source e^{ikr}/(4 pi r) at the port is shown, as `creeping.field.ports.port_map` has it.

Sources: Derivations, F25.
"""

import os
import re
from collections.abc import Sequence
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import Any, ArrayLike, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.boundary import BoundaryLike
from creeping.field.frequency import suited
from creeping.field.ports.port_map import PortField, port_field
from creeping.field.results.comparison import decibels, error_decibels, shown_range
from creeping.field.results.labelled import power
from creeping.field.results.point_result import FieldStatus
from creeping.geometry.directions import tangent_frames
from creeping.geometry.piecewise import drawn_mesh
from creeping.geometry.surface import Surface, normal, project, size
from creeping.plotting import pages
from creeping.plotting._cut_angles import cut_angles
from creeping.plotting._drawing import Drawing, View, shadow_view
from creeping.plotting._strokes import LevelColours, Stroke
from creeping.plotting.coloured_body import cells_of, save_painted, with_fronts
from creeping.plotting.far_cuts import Curve, draw_cut, heights_of
from creeping.plotting.pictures import chosen_backend

if TYPE_CHECKING:
    from creeping.field.ports.coupling_result import Coupling
    from creeping.field.sources import SourcePattern

MOST_CURVES = 15
"""Curves of a picture: of six colours with styles of their own, and more than that is no picture."""


def coupling_picture(
    path: str | os.PathLike[str],
    body: Surface,
    source: ArrayLike,
    *,
    wavenumber: float,
    boundary: BoundaryLike = "hard",
    order: int = 2,
    backend: str = "auto",
    view: View | None = None,
    span: float = 60.0,
    fronts: bool = False,
    phase: float = 0.0,
    cells: int | None = None,
    dpi: int = 300,
) -> str:
    """Write a PNG of the body coloured by the field of a unit source on it; where that is not OK it is grey.

    Parameters
    ----------
    path : str or path
        File to write.
    body : Surface
        Smooth and plain.
    source : (3,), L
        On the body; a ring is drawn round it.
    wavenumber : float, 1/L
    boundary : "hard"
    order : 2 or 1
    view : View, optional
        Camera; by default one that sees the source from aside.
    backend, span, fronts, phase, cells, dpi
        As of `surface_field_picture`.

    Returns
    -------
    str
        "pyvista" or "matplotlib", whichever drew it.

    Raises
    ------
    InvalidInputError
        As `creeping.port_field`, on a bad backend or span, and if the mesh is too coarse for the fronts asked for.
    CreepingError
        If pyvista is asked for and cannot draw here, or the file cannot be written.
    """
    backend = chosen_backend(backend)
    mesh, normals = drawn_mesh(body, cells or cells_of(body, wavenumber))
    field = port_field(body, source, mesh.vertices, wavenumber=wavenumber, boundary=boundary, order=order)
    n = normal(body, field.source)
    camera = shadow_view(n) if view is None else view
    ring = Stroke([_ring(body, field.source, n)], "#111111", 2.0, label="source", rank=2)
    drawing = Drawing(body, None, camera, mesh, normals, [ring], LevelColours.of(()))
    if fronts:
        drawing = with_fronts(drawing, field, phase)
    unit = power(field.length_unit, -1)
    label = f"20 log$_{{10}}$|u| (dB re 1 {unit})\nk = {field.wavenumber:g}/{field.length_unit}, {field.boundary}"
    finite = np.isfinite(field.values)
    counts = {s.name: int(np.sum((field.status == s) & finite)) for s in FieldStatus if s != FieldStatus.OK}
    shares = (f"{100 * count / field.size:.2g} % {name}" for name, count in counts.items() if count)
    look: dict[str, Any] = {"bare": "not OK: " + (", ".join(shares) or "none"), "backend": backend, "dpi": dpi}
    return save_painted(path, drawing, coupling_levels(field), span=span, label=label, **look)


def coupling_levels(field: PortField) -> FloatArray:
    """20 log10 |u| of a field of a source on the body (...), NaN where its status is not OK, inf at the source."""
    at_source = ~np.isfinite(field.values)
    return np.where(field.ok | at_source, decibels(field.values), np.nan)


def _ring(body: Surface, point: FloatArray, n: FloatArray) -> FloatArray:
    """Closed curve (k, 3) on the body round a point, of a twentieth of the body's size."""
    one, two = tangent_frames(n)
    angle = np.linspace(0, 2 * np.pi, 49)[:, None]
    return project(body, point + 0.05 * size(body) * (np.cos(angle) * one + np.sin(angle) * two))


def plot_coupling(
    found: "Coupling", ax: Any = None, *, names: Sequence[str] = (), span: float = 60.0, legend: bool | None = None
) -> Any:
    """Draw a coupling matrix: 20 log10 of each entry's size, what is not OK crossed out, the diagonal left empty.

    Parameters
    ----------
    found : Coupling
    ax : matplotlib.axes.Axes, optional
        By default those of a new figure.
    names : sequence of str
        Of the ports; their numbers if not given.
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
    fresh, ax = pages.axes_or_new(ax, (5.6, 4.8))
    image = ax.imshow(levels, vmin=low, vmax=high, cmap="cividis", interpolation="nearest")
    # more numbers, or more crosses, cannot be read
    numbered = count <= 12
    if numbered:
        # dark on light and light on dark
        for row, column in zip(*np.nonzero(np.isfinite(levels)), strict=True):
            colour = "black" if levels[row, column] > 0.5 * (low + high) else "white"
            below = found.error[row, column] >= np.abs(found.values[row, column])
            level = decibels(np.array(found.error[row, column])) if below else levels[row, column]
            text = ("<" if below else "") + pages.minus(round(float(level)))
            ax.text(column, row, text, ha="center", va="center", fontsize=7, color=colour)
    doubtful = ~found.ok & np.isfinite(found.values)
    if count <= 60 and doubtful.any():
        rows, columns = np.nonzero(doubtful)
        ax.plot(columns, rows, "x", color="#d55e00", markersize=9 if numbered else 4, label="not OK")
    pages.add_bar(ax.figure, image, _level_name(found), extend=pages.beyond(levels, low, high), fontsize=9, ax=ax)
    ax.set_xlabel("to port", fontsize=9)
    ax.set_ylabel("from port", fontsize=9)
    ax.tick_params(labelsize=8, width=0.5)
    for axis in (ax.xaxis, ax.yaxis):
        axis.get_major_locator().set_params(integer=True)
    if names:
        ax.set_xticks(range(count), names, rotation=45 if max(map(len, names)) > 4 else 0)
        ax.set_yticks(range(count), names)
    off = error_decibels(found.values, found.error)[found.ok & (np.abs(found.values) > 0)]
    told = f", error {np.median(off):.2g} dB in the median" if np.any(np.isfinite(off)) else ""
    return pages.finished(ax, fresh, pages.wave_title(found, found.length_unit) + told, legend)


def plot_coupling_band(
    found: "Sequence[Coupling]",
    ax: Any = None,
    *,
    names: Sequence[str] = (),
    hertz: FloatArray | None = None,
    span: float = 60.0,
    legend: bool | None = None,
) -> Any:
    """Draw the coupling of each pair of ports over frequency, dB, with its error as a band; faint where it is not OK.

    Parameters
    ----------
    found : sequence of Coupling
        Of the same ports at ascending wavenumbers; of up to fifteen pairs.
    ax : matplotlib.axes.Axes, optional
        By default those of a new figure.
    names : sequence of str
        Of the ports; their numbers if not given.
    hertz : (n,), Hz, optional
        Frequencies; else the wavenumber is the axis.
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
        If there are more pairs than curves that can be told apart.
    """
    pairs = list(combinations(range(len(found[0].ports)), 2))
    if len(pairs) > MOST_CURVES:
        raise InvalidInputError(f"{len(pairs)} pairs of ports are more than {MOST_CURVES} curves; plot single matrices")
    fresh, ax = pages.axes_or_new(ax, pages.PAGE)
    scale, unit = suited(float(hertz[-1])) if hertz is not None else (1.0, f"1/{found[0].length_unit}")
    x = np.array([one.wavenumber for one in found]) if hertz is None else np.asarray(hertz) / scale
    curves = []
    for number, (i, j) in enumerate(pairs):
        size, off, ok = (np.array([getattr(one, name)[i, j] for one in found]) for name in ("values", "error", "ok"))
        size, style = np.abs(size), pages.curve_style(number)
        label = f"{names[i] if names else i} to {names[j] if names else j}{'' if ok.all() else ', faint: not OK'}"
        ax.plot(x, decibels(size), **style | {"alpha": 0.35})
        ax.plot(x, np.where(ok, decibels(size), np.nan), label=label, **style)
        low = decibels(np.maximum(size - off, 1e-3 * size))
        told = "_" if number else "stated error"
        ax.fill_between(x, low, decibels(size + off), color=style["color"], alpha=0.14, linewidth=0, label=told)
        curves.append(decibels(size))
    ax.set_ylim(*shown_range(curves, span))
    pages.dressed(ax, f"frequency ({unit})" if hertz is not None else f"k ({unit})", _level_name(found[0]))
    return pages.finished(ax, fresh, "perfect conductor" if found[0].boundary == "pec" else "hard body", legend)


def _level_name(found: "Coupling") -> str:
    unit = re.sub(r"\^?(-?\d+)$", r"$^{\1}$", found.unit)
    return f"coupling of unit moments (dB re {unit if unit.startswith('1/') else f'1 {unit}'})"


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
    count, most = len(found.sources), len(pages.COLOURS)
    if count > most:
        raise InvalidInputError(f"{count} sources in one picture; draw {most} at most: source_pattern of some of them")
    cut = cut_angles(found.directions)
    curves = []
    for number, (values, off) in enumerate(zip(found.values.T, found.error.T, strict=True)):
        size = np.abs(values)
        band = decibels(np.stack([np.maximum(size - off, 0.0), size + off]))
        label = f"source at ({', '.join(f'{x:.4g}' for x in found.sources[number])})"
        curve = Curve(label, decibels(values), pages.curve_style(number), band, ~found.ok[:, number])
        curves.append(curve.ordered(cut.order, label))
    heights = heights_of(curves, span)
    fresh, ax = pages.axes_or_new(ax, pages.PAGE)
    level = "20 log$_{10}$|F| (dB re no body)"
    draw_cut(ax, cut.values[cut.order], curves, heights, level=level, angle_name=cut.name)
    return pages.finished(ax, fresh, pages.wave_title(found, found.length_unit), legend)
