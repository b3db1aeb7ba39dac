"""The body in colours of decibels: of the field on it, and of the currents of the whole body at their nodes.

The field is |u|, or |du/dn|/k where u = 0, as `creeping.field.on_body.surface_field` has it, lit and in the shadow.
Also here: the field along rays.

Wave fronts on it are where Re(u e^{-i phase}) = 0 on the triangles of its mesh, joined to polylines. On an edge of a
triangle the real part is taken as linear; fronts are half a wavelength of the wave on the body apart.

Sources: Derivations, F9 and F16.
"""

import os
from contextlib import suppress
from dataclasses import replace

import numpy as np

from creeping._typing import Any, BoolArray, ComplexArray, FloatArray
from creeping.errors import InvalidInputError, SingularIncidenceError
from creeping.field.arguments import checked
from creeping.field.boundary import Boundary, BoundaryLike
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.field.equation.currents import ConductorTileCurrents, TileCurrents
from creeping.field.on_body import surface_field
from creeping.field.results.comparison import decibels, shown_range
from creeping.field.results.labelled import COMPONENTS
from creeping.field.results.point_result import PointField, SurfaceField
from creeping.field.waves.surface import scalar_boundary
from creeping.geometry.checks import unit_of
from creeping.geometry.incident import PlaneWave
from creeping.geometry.piecewise import drawn_mesh
from creeping.geometry.surface import Surface, normal, project, why_no_rays
from creeping.geometry.triangulation import Triangulation
from creeping.plotting._drawing import Drawing, View, caption, compose, shadow_view
from creeping.plotting._strokes import LevelColours, Stroke, chosen_rays, strokes
from creeping.plotting.pages import PAGE, add_bar, beyond, curve_style, dressed, save_figure, written_figure
from creeping.plotting.pictures import chosen_backend, drawn_page
from creeping.rays.fan import RayFan
from creeping.shadow.line import shadow_line

NOTHING = "#b4b9bd"
"""Colour of what has no level."""
LEAST_SAMPLES = 4.5
"""Edges of triangles, or points of a grid, a wavelength from which fronts can be told."""
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
        ax.set(xlim=(0.0, float(fan.travel_time[-1])), ylim=(low, high))
        dressed(ax, f"arclength from the shadow line ({unit_of(fan.body)})", _name(kind))
        title = f"Field of single rays, k = {k:g}/{unit_of(fan.body)}, {_boundary_name(kind)} boundary"
        ax.set_title(title, fontsize=9, parse_math=False)
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


def currents_picture(
    path: str | os.PathLike[str],
    currents: SurfaceCurrents,
    *,
    incident: str | None = None,
    backend: str = "auto",
    view: View | None = None,
    span: float = 60.0,
    wave: str = "",
    name: str = "",
    cells: int | None = None,
    dpi: int = 300,
) -> str:
    """Write a PNG of the body coloured by the magnitude of its currents; where there are none it is grey.

    Parameters
    ----------
    path : str or path
        File to write.
    currents : SurfaceCurrents
    incident : {"theta", "phi"}, optional
        Polarisation of the wave that a conductor's currents belong to; the rms of both if not given.
    backend, view, span, wave, name, cells, dpi
        As of `surface_field_picture`.

    Returns
    -------
    str
        "pyvista" or "matplotlib", whichever drew it.

    Raises
    ------
    InvalidInputError
        On an unknown polarisation or backend, or a bad span.
    CreepingError
        If pyvista is asked for and cannot draw here, or the file cannot be written.
    """
    backend = chosen_backend(backend)
    k = currents.wavenumber
    body: Any = currents.body
    cells, direction = cells or cells_of(body, k), currents.direction
    title = caption(body, PlaneWave(direction), name=name)
    camera = view or shadow_view(direction)
    drawing = Drawing(body, direction, camera, *drawn_mesh(body, cells), [], LevelColours.of(()), title=title)
    if not why_no_rays(body):
        # no line is drawn that crosses itself
        with suppress(SingularIncidenceError):
            drawing = replace(drawing, strokes=strokes(shadow_line(body, direction)))
    levels = current_levels(currents, drawing.mesh.vertices, incident)
    what = {"soft": "|∂u/∂n|/k", "conductor": "|n × H|"}.get(currents.boundary.kind, "|u|")
    wave = wave or f"k = {k:g}/{unit_of(currents.body)}"
    label = f"20 log$_{{10}}${what} (dB)\n{wave}, {currents.boundary.kind}"
    return save_painted(path, drawing, levels, span=span, label=label, bare="no current", backend=backend, dpi=dpi)


def current_levels(currents: SurfaceCurrents, points: FloatArray, incident: str | None = None) -> FloatArray:
    """20 log10 of the magnitude of the currents at points of the body: (n, 3) -> (n,), NaN where there are none.

    |n x H| of a conductor, of one incident polarisation or the root mean square of both; |u|, |du/dn|/k if soft.
    """
    conductor = currents.values.ndim > 1
    if incident is not None and (incident not in COMPONENTS or not conductor):
        raise InvalidInputError(f"incident = {incident!r} is not {' or '.join(COMPONENTS)}, of a conductor's currents")
    values, covered = _currents_at(currents, points)
    size = np.abs(values)
    if conductor:
        each = np.linalg.norm(size, axis=1)
        size = np.sqrt(np.mean(each**2, axis=1)) if incident is None else each[:, COMPONENTS.index(incident)]
    elif currents.boundary.kind == "soft":
        size = size / currents.wavenumber
    return decibels(np.where(covered, size, np.nan))


def _currents_at(currents: SurfaceCurrents, points: FloatArray) -> tuple[ComplexArray, BoolArray]:
    """Currents at points of the body (n, 3), and whether there are any.

    Of expansions nodes about a point are smoothed by a Gaussian, each with its phase carried along to the point: where
    rays of several sheets pass they add up, as they do in the field. Solved ones are known between nodes.
    """
    if isinstance(currents, TileCurrents | ConductorTileCurrents):
        return currents.between_nodes(points), np.ones(len(points), dtype=bool)
    from scipy.sparse import csr_array
    from scipy.spatial import cKDTree

    k = currents.wavenumber
    # standard deviation of the Gaussian, in wavelengths, and where it ends, in it
    width, end = 0.22 * 2 * np.pi / k, 2.5
    n = normal(currents.body, points)
    tree = cKDTree(currents.points)
    total, share = np.zeros((len(points), *currents.values.shape[1:]), dtype=complex), np.zeros(len(points))
    flat = currents.values.reshape(len(currents.points), -1)
    for first in range(0, len(points), 4000):
        part = slice(first, first + 4000)
        pairs = cKDTree(points[part]).sparse_distance_matrix(tree, end * width, output_type="ndarray")
        row, node = pairs["i"] + first, pairs["j"]
        # not what is on the other side of a thin body
        facing = np.einsum("nc,nc->n", n[row], currents.normals[node]) > 0.3
        row, node, distance = row[facing], node[facing], pairs["v"][facing]
        weight = np.exp(-0.5 * (distance / width) ** 2) * currents.weights[node]
        weight /= 2 * np.pi * width**2 * (1 - np.exp(-0.5 * end**2))
        phase = k * np.einsum("nc,nc->n", currents.travel[node], points[row] - currents.points[node])
        count = len(points[part])
        shape = (count, len(currents.points))
        summed = csr_array((weight * np.exp(1j * phase), (row - first, node)), shape=shape)
        total[part] = (summed @ flat).reshape(count, *currents.values.shape[1:])
        share[part] = np.bincount(row - first, weight, count)
    # nodes stand for so much of the area about a point if there is a current
    return total, share > 0.3


def cells_of(body: Surface, wavenumber: float) -> int:
    """Cells along each side of a body's box, about eight a wavelength, within 48 to 96."""
    side = float(np.cbrt(np.prod(np.diff(body.bounds, axis=0))))
    return int(np.clip(8 * side * wavenumber / (2 * np.pi), 48, 96))


def save_painted(
    path: str | os.PathLike[str],
    drawing: Drawing,
    levels: FloatArray,
    *,
    span: float,
    label: str,
    bare: str,
    backend: str,
    dpi: int,
) -> str:
    """Write a figure of a body with levels (n,), dB, at the vertices of its mesh, and a bar of colours.

    ``bare`` names what is NaN. Returns the backend.
    """
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize, to_rgb
    from matplotlib.patches import Patch

    finite = levels[np.isfinite(levels)]
    # neither a null nor a caustic of a few points stretches the colours
    ends = np.percentile(finite, [1.0, 99.8]) if len(finite) else (-np.inf, np.inf)
    low, high = shown_range([np.clip(finite, *ends)], span, step=2.0)
    colours = ScalarMappable(Normalize(low, high), "magma")
    paint = colours.to_rgba(np.nan_to_num(levels, nan=low, posinf=high, neginf=low))[:, :3]
    without = np.isnan(levels)
    handles = []
    if np.any(without):
        paint[without] = to_rgb(NOTHING)
        handles.append(Patch(color=NOTHING, label=bare))
    figure, place = drawn_page(replace(drawing, paint=np.asarray(paint)), backend, dpi)
    drawing.add_legend(figure, *handles)
    add_bar(figure, colours, label, extend=beyond(levels, low, high), fontsize=8, cax=figure.add_axes(place))
    save_figure(figure, path, dpi)
    return backend


def at_phase(wave: ComplexArray, phase: float) -> FloatArray:
    """The wave as it is when omega t = phase, radians: Re(u e^{-i phase}) of u (...).

    Examples
    --------
    >>> import numpy as np
    >>> at_phase(np.array([1.0, 1j]), np.pi / 2).round(12).tolist()
    [0.0, 1.0]
    """
    return np.asarray(wave.real * np.cos(phase) + wave.imag * np.sin(phase))


def samples_a_wave(mesh: Triangulation, wavenumber: float) -> float:
    """Edges of a mesh a wavelength, by its median edge."""
    sides = mesh.vertices[mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]]]
    return 2 * np.pi / (wavenumber * float(np.median(np.linalg.norm(np.diff(sides, axis=2), axis=-1))))


def front_strokes(
    body: Surface,
    mesh: Triangulation,
    wave: ComplexArray,
    known: BoolArray,
    *,
    wavenumber: float,
    phase: float = 0.0,
) -> list[Stroke]:
    """Wave fronts of values (n,) at the vertices of a body's mesh, on triangles whose corners are all known (n,).

    Raises
    ------
    InvalidInputError
        If the mesh is too coarse for the wavelength.
    """
    import pyvista

    there = samples_a_wave(mesh, wavenumber)
    if there < LEAST_SAMPLES:
        raise InvalidInputError(
            f"wave fronts on a mesh of {there:.2g} edges a wavelength; {LEAST_SAMPLES:g} are the least: give "
            f"{LEAST_SAMPLES / there:.2g} times the cells, or leave fronts out"
        )
    triangles = mesh.triangles[np.all(known[mesh.triangles], axis=1)]
    if not len(triangles):
        return []
    part = pyvista.PolyData.from_regular_faces(mesh.vertices, triangles)
    found = part.contour([0.0], at_phase(np.where(known, wave, 0.0), phase)).strip(join=True, max_length=len(triangles))
    lines = [project(body, cell.points) for cell in found.cell if cell.n_points > 1]
    return [Stroke(lines, "#00c2d1", 0.6, alpha=0.8, label="wave fronts", rank=1, through=False)] if lines else []


def with_fronts(drawing: Drawing, field: PointField, phase: float) -> Drawing:
    """A drawing with the wave fronts of a field at the vertices of its mesh, where that is OK, below its other strokes.

    Raises
    ------
    InvalidInputError
        If the mesh is too coarse for the wavelength.
    """
    known = field.ok & np.isfinite(field.values)
    asked: dict[str, Any] = {"wavenumber": field.wavenumber, "phase": phase}
    fronts = front_strokes(drawing.body, drawing.mesh, field.values, known, **asked)
    return replace(drawing, strokes=fronts + drawing.strokes)
