"""Pictures of the field on the body: decibels as colours of the surface, and along rays.

Shown is |u|, or |du/dn|/k where u = 0, as `creeping.field.on_body.surface_field` has it, lit and in the shadow.

Sources: Derivations, F9 and F16.
"""

import os
from dataclasses import replace

import numpy as np

from creeping._typing import Any, ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.arguments import checked
from creeping.field.boundary import Boundary, BoundaryLike
from creeping.field.on_body import surface_field
from creeping.field.results.comparison import decibels, shown_range
from creeping.field.results.point_result import SurfaceField
from creeping.field.waves.surface import scalar_boundary
from creeping.geometry.checks import unit_of
from creeping.plotting._drawing import View, caption, compose
from creeping.plotting._strokes import chosen_rays
from creeping.plotting.coloured_body import NOTHING, cells_of, save_painted, with_fronts
from creeping.plotting.pages import PAGE, curve_style, dressed, written_figure
from creeping.plotting.pictures import chosen_backend
from creeping.rays.fan import RayFan

CAUSTIC: dict[str, Any] = {"linewidth": 0.7, "linestyle": (0, (4, 3))}


def surface_field_picture(
    path: str | os.PathLike[str],
    fan: RayFan,
    *,
    wavenumber: float,
    boundary: BoundaryLike = "soft",
    order: int = 2,
    backend: str = "auto",
    view: View | None = None,
    span: float = 60.0,
    fronts: bool = False,
    phase: float = 0.0,
    wave: str = "",
    name: str = "",
    cells: int | None = None,
    dpi: int = 300,
) -> str:
    """Write a PNG of the body coloured by the magnitude of the total field on it, with the shadow line on top.

    Parameters
    ----------
    path : str or path
        File to write.
    fan : RayFan
        Long enough to cover the shadow; where no ray passes the body is grey.
    wavenumber : float, 1/L
    boundary : "soft", "hard" or ImpedanceBoundary
    order : 2 or 1
    backend : str
        "pyvista", "matplotlib" or "auto".
    view : View, optional
        Camera; by default on the shadow side.
    span : float, dB
        Range of the colours below the highest level, but for that of a few points.
    fronts : bool
        Whether to draw wave fronts, Re(u e^{-i phase}) = 0, where the field is OK.
    phase : float, radians
        omega t.
    wave : str
        What the picture says of the wave; the wavenumber if not given.
    name : str
        What the title calls the body; its repr if not given.
    cells : int, optional
        Fineness of the body, cells along each side of its box; by default eight a wavelength, within 48 to 96.
    dpi : int

    Returns
    -------
    str
        "pyvista" or "matplotlib", whichever drew it.

    Raises
    ------
    InvalidInputError
        On a bad wavenumber, boundary, order, backend or span, for a weighted body, and if the mesh is too coarse
        for the fronts asked for.
    CreepingError
        If pyvista is asked for and cannot draw here, or the file cannot be written.
    """
    backend = chosen_backend(backend)
    kind = scalar_boundary(boundary)
    k = checked(wavenumber, order)
    drawing = compose(fan.line, view=view, cells=cells or cells_of(fan.body, k))
    field = surface_field(fan, drawing.mesh.vertices, wavenumber=k, boundary=boundary, order=order)
    known = field.ok & np.isfinite(field.error)
    off = f"error where OK {np.median(field.error[known]):.1g} in the median" if known.any() else ""
    drawing = replace(drawing, title=caption(fan.body, fan.line.source, off, name=name))
    if fronts:
        drawing = with_fronts(drawing, field, phase)
    levels = levels_of(_scaled(field, kind))
    label = f"{_name(kind)}\n{wave or f'k = {k:g}/{unit_of(fan.body)}'}, {_boundary_name(kind)}"
    return save_painted(path, drawing, levels, span=span, label=label, bare="no ray passes", backend=backend, dpi=dpi)


def surface_values(
    fan: RayFan, points: FloatArray, *, wavenumber: float, boundary: BoundaryLike = "soft", order: int = 2
) -> ComplexArray:
    """The field at points of the body, u, or du/dn/k of the soft boundary: (n, 3) -> (n,), 0 where no ray passes."""
    field = surface_field(fan, points, wavenumber=wavenumber, boundary=boundary, order=order)
    return _scaled(field, scalar_boundary(boundary))


def _scaled(field: SurfaceField, kind: Boundary) -> ComplexArray:
    return np.asarray(field.values / (field.wavenumber if kind.kind == "soft" else 1.0))


def levels_of(values: ComplexArray) -> FloatArray:
    """20 log10 of magnitudes (n,): NaN where they are 0, inf where they are NaN, on a caustic."""
    size = np.abs(values)
    size = np.where(np.isnan(size), np.inf, size)
    return decibels(np.where(size > 0, size, np.nan))


def decay_picture(
    path: str | os.PathLike[str],
    fan: RayFan,
    *,
    wavenumber: float,
    boundary: BoundaryLike = "soft",
    order: int = 2,
    rays: int = 6,
    span: float = 80.0,
    dpi: int = 300,
) -> None:
    """Write a PNG of each ray's own field against the way along it, for a few rays spread over the shadow line.

    The curves rise at caustics, which dashed lines mark, and end where a ray has detached.

    Parameters
    ----------
    path : str or path
    fan : RayFan
    wavenumber : float, 1/L
    boundary : "soft", "hard" or ImpedanceBoundary
    order : 2 or 1
    rays : int
        Rays drawn at most.
    span : float, dB
        Range below the field where the rays start.
    dpi : int

    Raises
    ------
    InvalidInputError
        On a bad wavenumber, boundary, order, number of rays or span, and for a weighted body.
    CreepingError
        If the file cannot be written.
    """
    from matplotlib.lines import Line2D

    kind = scalar_boundary(boundary)
    k = checked(wavenumber, order)
    picked = chosen_rays(fan, rays)
    if not picked:
        raise InvalidInputError("the fan has no ray to draw; launch one from another shadow line")
    field = surface_field(fan, wavenumber=k, boundary=boundary, order=order)[picked]
    levels = decibels(field / k if kind.kind == "soft" else field)
    levels[~np.isfinite(levels)] = np.nan
    # beside a caustic a step of a ray may lie at any height: the range follows the starts
    starts = levels[:, : max(2, levels.shape[1] // 8)]
    low, high = shown_range([np.clip(levels, -np.inf, np.nanmax(starts) + 10.0)], span)
    with written_figure(path, PAGE, dpi) as figure:
        ax = figure.add_subplot()
        for number, (ray, level) in enumerate(zip(picked, levels, strict=True)):
            _draw_decay(ax, fan, ray, level, curve_style(number, 1.2))
        ax.set_xlim(0.0, float(fan.travel_time[-1]))
        ax.set_ylim(low, high)
        title = f"Field of single rays, k = {k:g}/{unit_of(fan.body)}, {_boundary_name(kind)} boundary"
        dressed(ax, f"arclength from the shadow line ({unit_of(fan.body)})", _name(kind), title)
        handles = ax.get_legend_handles_labels()[0]
        if np.any(fan.caustic_index[picked]):
            handles.append(Line2D([], [], color=NOTHING, label="caustic", **CAUSTIC))
        figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False, fontsize=8)


def _draw_decay(ax: Any, fan: RayFan, ray: int, level: FloatArray, style: dict[str, Any]) -> None:
    ax.plot(fan.travel_time, level, label=f"ray {ray}", **style)
    passed = np.diff(fan.caustic_index[ray])
    for step in np.flatnonzero(passed > 0):
        J = fan.spreading[ray, step : step + 2]
        share = J[0] / (J[0] - J[1]) if J[0] * J[1] < 0 else 0.5
        at = fan.travel_time[step] + share * (fan.travel_time[step + 1] - fan.travel_time[step])
        ax.axvline(at, color=style["color"], alpha=0.7, **CAUSTIC)


def _name(kind: Boundary) -> str:
    return "20 log$_{10}$|∂u/∂n|/k (dB)" if kind.kind == "soft" else "20 log$_{10}$|u| (dB)"


def _boundary_name(kind: Boundary) -> str:
    return f"impedance η = {kind.admittance:g}" if kind.kind == "impedance" else kind.kind
