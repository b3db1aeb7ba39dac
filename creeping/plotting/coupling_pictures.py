"""Pictures of how a port on a hard body couples to the rest of it: decibels as colours of the surface.

Shown is |u| of a unit point source e^{ikr}/(4 pi r) at the port, as `creeping.field.ports.port_map` has it.

Also here: wave fronts on a body: where Re(u e^{-i phase}) = 0 on the triangles of its mesh, joined to polylines.

On an edge of a triangle the real part is taken as linear; fronts are half a wavelength of the wave on the body apart.

Sources: Derivations, F25.
"""

import os
from dataclasses import replace

import numpy as np

from creeping._typing import Any, ArrayLike, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.field.boundary import BoundaryLike
from creeping.field.comparison import decibels
from creeping.field.labelled import power
from creeping.field.point_result import FieldStatus, PointField
from creeping.field.ports.port_map import PortField, port_field
from creeping.geometry.piecewise import drawn_mesh
from creeping.geometry.surface import Surface, normal, project, size
from creeping.geometry.triangulation import Triangulation
from creeping.plotting._drawing import Drawing, View, shadow_view
from creeping.plotting._strokes import LevelColours, Stroke
from creeping.plotting.coloured_body import cells_of, save_painted
from creeping.plotting.pictures import chosen_backend

RING = 0.05
"""Radius of the ring round the source, in body sizes."""
SOURCE = "#111111"

COLOUR, FRONT_WIDTH = "#00c2d1", 0.6
LEAST_SAMPLES = 4.5
"""Edges of triangles, or points of a grid, a wavelength from which fronts can be told."""

SIDES = [[0, 1], [1, 2], [2, 0]]


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
    ring = Stroke([_ring(body, field.source, n)], SOURCE, 2.0, label="source", rank=2)
    drawing = Drawing(body, None, camera, mesh, normals, [ring], LevelColours.of(()))
    if fronts:
        drawing = with_fronts(drawing, field, phase)
    unit = power(field.length_unit, -1)
    label = f"20 log$_{{10}}$|u| (dB re 1 {unit})\nk = {field.wavenumber:g}/{field.length_unit}, {field.boundary}"
    levels = coupling_levels(field)
    return save_painted(path, drawing, levels, span=span, label=label, bare=_bare(field), backend=backend, dpi=dpi)


def coupling_levels(field: PortField) -> FloatArray:
    """20 log10 |u| of a field of a source on the body (...), NaN where its status is not OK, inf at the source."""
    at_source = ~np.isfinite(field.values)
    return np.where(field.ok | at_source, decibels(field.values), np.nan)


def _bare(field: PortField) -> str:
    """What is grey, by status."""
    finite = np.isfinite(field.values)
    counts = {s.name: int(np.sum((field.status == s) & finite)) for s in FieldStatus if s != FieldStatus.OK}
    share = {name: 100 * count / field.size for name, count in counts.items() if count}
    return "not OK: " + (", ".join(f"{value:.2g} % {name}" for name, value in share.items()) or "none")


def _ring(body: Surface, point: FloatArray, n: FloatArray) -> FloatArray:
    """Closed curve (k, 3) on the body round a point."""
    one = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    one /= np.linalg.norm(one)
    angle = np.linspace(0, 2 * np.pi, 49)[:, None]
    radius = RING * size(body)
    return project(body, point + radius * (np.cos(angle) * one + np.sin(angle) * np.cross(n, one)))


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
    return [Stroke(lines, COLOUR, FRONT_WIDTH, alpha=0.8, label="wave fronts", rank=1, through=False)]


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
