"""The body in colours of decibels: of the field on it, and of the currents of the whole body at their nodes.

Also here: triangle meshes coloured by a number at their vertices, each from two opposite sides.

Wave fronts on it are where Re(u e^{-i phase}) = 0 on the triangles of its mesh, joined to polylines. On an edge of a
triangle the real part is taken as linear; fronts are half a wavelength of the wave on the body apart.

Sources: Derivations, F16.
"""

import os
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from creeping._typing import Any, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.errors import InvalidInputError, SingularIncidenceError
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.field.equation.currents import ConductorTileCurrents, TileCurrents
from creeping.field.results.comparison import decibels, shown_range
from creeping.field.results.labelled import COMPONENTS
from creeping.field.results.point_result import PointField
from creeping.geometry.checks import unit_of
from creeping.geometry.incident import PlaneWave
from creeping.geometry.surface import Surface, normal, project, why_no_rays
from creeping.geometry.triangulation import Triangulation
from creeping.plotting._drawing import Drawing, View, bare, caption, compose
from creeping.plotting._strokes import Stroke
from creeping.plotting.pages import add_bar, beyond, new_figure, save_figure
from creeping.plotting.pictures import brightness, chosen_backend, drawn_page
from creeping.shadow.line import shadow_line

NOTHING = "#b4b9bd"
"""Colour of what has no level."""
WIDTH, REACH = 0.22, 2.5
"""Standard deviation, in wavelengths, of the Gaussian that smooths currents, and where it ends, in it."""
SIDES = [[0, 1], [1, 2], [2, 0]]
LEAST_SAMPLES = 4.5
"""Edges of triangles, or points of a grid, a wavelength from which fronts can be told."""
VIEWS = (View(np.radians(-60.0), np.radians(25.0)), View(np.radians(120.0), np.radians(-25.0)))
HIGHEST, SPAN = 0.0, (3.0, 6.0)
"""Power of ten at the upper end of a mesh's colours, and the fewest and most decades below it."""
BAD_COLOUR = "#b3202a"
MESH_WIDTH, MESH_HEIGHT = 7.2, 3.4  # inches, of one mesh


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
    asked: Any = {"view": view, "cells": cells or cells_of(body, k)}
    direction = currents.direction
    line = None
    if not why_no_rays(body):
        # none is drawn that crosses itself
        with suppress(SingularIncidenceError):
            line = shadow_line(body, direction)
    drawing = compose(line, **asked) if line else bare(body, direction, **asked)
    drawing = replace(drawing, title=caption(body, PlaneWave(direction), name=name))
    levels = current_levels(currents, drawing.mesh.vertices, incident)
    what = {"soft": "|∂u/∂n|/k", "conductor": "|n × H|"}.get(currents.boundary.kind, "|u|")
    wave = wave or f"k = {k:g}/{unit_of(currents.body)}"
    label = f"20 log$_{{10}}${what} (dB)\n{wave}, {currents.boundary.kind}"
    return save_painted(path, drawing, levels, span=span, label=label, bare="no current", backend=backend, dpi=dpi)


def current_levels(currents: SurfaceCurrents, points: FloatArray, incident: str | None = None) -> FloatArray:
    """20 log10 of the magnitude of the currents at points of the body: (n, 3) -> (n,), NaN where there are none.

    |n x H| of a conductor, of one incident polarisation or the root mean square of both; |u|, |du/dn|/k if soft.
    """
    return decibels(_magnitudes(currents, points, incident))


def _magnitudes(currents: SurfaceCurrents, points: FloatArray, incident: str | None) -> FloatArray:
    """Magnitude of the currents at points of the body (n, 3), NaN where there are none: (n,)."""
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
    return np.where(covered, size, np.nan)


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
    width = WIDTH * 2 * np.pi / k
    n = normal(currents.body, points)
    tree = cKDTree(currents.points)
    total, share = np.zeros((len(points), *currents.values.shape[1:]), dtype=complex), np.zeros(len(points))
    flat = currents.values.reshape(len(currents.points), -1)
    for first in range(0, len(points), 4000):
        part = slice(first, first + 4000)
        pairs = cKDTree(points[part]).sparse_distance_matrix(tree, REACH * width, output_type="ndarray")
        row, node = pairs["i"] + first, pairs["j"]
        # not what is on the other side of a thin body
        facing = np.einsum("nc,nc->n", n[row], currents.normals[node]) > 0.3
        row, node, distance = row[facing], node[facing], pairs["v"][facing]
        weight = np.exp(-0.5 * (distance / width) ** 2) * currents.weights[node]
        weight /= 2 * np.pi * width**2 * (1 - np.exp(-0.5 * REACH**2))
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
    sides = mesh.vertices[mesh.triangles[:, SIDES]]
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
    edges = mesh.triangles[:, SIDES]
    there = samples_a_wave(mesh, wavenumber)
    if there < LEAST_SAMPLES:
        raise InvalidInputError(
            f"wave fronts on a mesh of {there:.2g} edges a wavelength; {LEAST_SAMPLES:g} are the least: give "
            f"{LEAST_SAMPLES / there:.2g} times the cells, or leave fronts out"
        )
    real = at_phase(np.where(known, wave, 0.0), phase)
    edges = edges[np.all(known[mesh.triangles], axis=1)]
    # a corner at 0 counts as positive: each triangle is crossed by none of its edges or by two
    crossed = (real[edges[..., 0]] < 0) != (real[edges[..., 1]] < 0)
    pairs = np.sort(edges[crossed], axis=1).reshape(-1, 2, 2)
    if not len(pairs):
        return []
    ends, place = np.unique(pairs.reshape(-1, 2), axis=0, return_inverse=True)
    low, high = real[ends[:, 0]], real[ends[:, 1]]
    share = (low / (low - high))[:, None]
    points = project(body, (1 - share) * mesh.vertices[ends[:, 0]] + share * mesh.vertices[ends[:, 1]])
    lines = [points[chain] for chain in chains(place.reshape(-1, 2))]
    return [Stroke(lines, "#00c2d1", 0.6, alpha=0.8, label="wave fronts", rank=1, through=False)]


def chains(segments: IntArray) -> list[IntArray]:
    """Polylines of segments (m, 2) between nodes that belong to two of them at most; a closed one ends as it begins.

    Examples
    --------
    >>> import numpy as np
    >>> [chain.tolist() for chain in chains(np.array([[4, 7], [1, 2], [2, 4], [8, 9], [9, 5], [5, 8]]))]
    [[1, 2, 4, 7], [8, 9, 5, 8]]
    """
    at: dict[int, list[int]] = {}
    for number, (one, other) in enumerate(segments.tolist()):
        at.setdefault(one, []).append(number)
        at.setdefault(other, []).append(number)
    left = np.ones(len(segments), dtype=bool)
    found = []
    # open ones from their ends, then what is closed
    starts = [node for node, here in at.items() if len(here) == 1]
    for start in sorted(starts) + segments[:, 0].tolist():
        nodes = [start]
        while ahead := [number for number in at[nodes[-1]] if left[number]]:
            left[ahead[0]] = False
            one, other = segments[ahead[0]].tolist()
            nodes.append(other if one == nodes[-1] else one)
        if len(nodes) > 1:
            found.append(np.array(nodes))
    return found


def with_fronts(drawing: Drawing, field: PointField, phase: float) -> Drawing:
    """A drawing with the wave fronts of a field at the vertices of its mesh, where that is OK, below its other strokes.

    Raises
    ------
    InvalidInputError
        If the mesh is too coarse for the wavelength.
    """
    known = field.ok & np.isfinite(field.values)
    asked: dict[str, Any] = {"wavenumber": field.wavenumber, "phase": phase}
    return replace(
        drawing, strokes=front_strokes(drawing.body, drawing.mesh, field.values, known, **asked) + drawing.strokes
    )


@dataclass(frozen=True)
class MeshValues:
    """One mesh to be drawn.

    Attributes
    ----------
    vertices : (n, 3)
    triangles : (m, 3)
    values : (n,)
        Positive; colours are of their logarithm.
    bad : (n,) bool
        Vertices that get a dot.
    title : str
    """

    vertices: FloatArray
    triangles: IntArray
    values: FloatArray
    bad: BoolArray
    title: str = ""


def mesh_picture(
    path: str | os.PathLike[str],
    *meshes: MeshValues,
    label: str = "disagreement of jets of degree 4 and 6",
    dpi: int = 200,
) -> None:
    """Write a PNG of meshes, one below the other.

    Parameters
    ----------
    path : str or path
        File to write.
    meshes : MeshValues
    label : str
        Of the colour bars.
    dpi : int

    Raises
    ------
    CreepingError
        If the file cannot be written.
    """
    figure = new_figure((MESH_WIDTH, MESH_HEIGHT * len(meshes)))
    for row, mesh in enumerate(meshes):
        _draw_mesh(figure, 1 - (row + 1) / len(meshes), 1 / len(meshes), mesh, label)
    save_figure(figure, path, dpi)


def _draw_mesh(figure: Any, bottom: float, height: float, mesh: MeshValues, label: str) -> None:
    """Draw one mesh into a band of the figure."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import Normalize

    decade = np.log10(np.maximum(mesh.values, 10.0 ** (HIGHEST - SPAN[1])))
    lowest = float(np.clip(np.floor(np.percentile(decade, 1)), HIGHEST - SPAN[1], HIGHEST - SPAN[0]))
    colours = ScalarMappable(Normalize(lowest, HIGHEST), "viridis")
    corners = mesh.vertices[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    paint = colours.to_rgba(decade[mesh.triangles].mean(axis=1))[:, :3]
    for k, view in enumerate(VIEWS):
        ax = figure.add_axes((0.01 + 0.43 * k, bottom + 0.04 * height, 0.42, 0.86 * height))
        facing = normals @ view.toward
        front = np.flatnonzero(facing > 0)
        # the far ones first, so that the near ones cover them
        front = front[np.argsort(corners[front].mean(axis=1) @ view.toward)]
        shade = (0.6 + 0.4 * brightness(facing[front]))[:, None] * paint[front]
        flat = view.project(corners[front])
        # edges in the colour of the face close the hairlines between triangles
        ax.add_collection(PolyCollection(list(flat), facecolors=shade, edgecolors=shade, linewidths=0.3))
        seen = np.intersect1d(np.flatnonzero(mesh.bad), mesh.triangles[front])
        dots = view.project(mesh.vertices[seen]).T
        # rims of white: red on dark blue is hard to see for the colour-blind
        ax.plot(*dots, ".", color="white", markersize=6.0, markeredgewidth=0)
        ax.plot(*dots, ".", color=BAD_COLOUR, markersize=3.6, markeredgewidth=0)
        ax.autoscale_view()
        ax.set_aspect("equal")
        ax.set_axis_off()
    rough = f"{int(mesh.bad.sum())} of {len(mesh.vertices)} vertices rough"
    figure.text(0.02, bottom + 0.94 * height, mesh.title, fontsize=9, va="center")
    colour = BAD_COLOUR if mesh.bad.any() else "black"
    figure.text(0.86, bottom + 0.94 * height, rough, fontsize=8, va="center", ha="right", color=colour)
    place = figure.add_axes((0.885, bottom + 0.1 * height, 0.018, 0.76 * height))
    bar = add_bar(figure, colours, label, fontsize=7, extend="min", cax=place)
    ticks = np.arange(lowest, HIGHEST + 1)
    bar.set_ticks(ticks, labels=[f"$10^{{{int(t)}}}$" for t in ticks])
