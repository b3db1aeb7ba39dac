"""Pictures of how a port on a hard body couples to the rest of it: decibels as colours of the surface.

Shown is |u| of a unit point source e^{ikr}/(4 pi r) at the port, as `creeping.field.port_map` has it.

Sources: Derivations, F25.
"""

import os

import numpy as np

from creeping._typing import ArrayLike, FloatArray
from creeping.field.boundary import BoundaryLike
from creeping.field.decibels import decibels
from creeping.field.labelled import power
from creeping.field.point_result import FieldStatus
from creeping.field.port_map import PortField, port_field
from creeping.geometry.creased import drawn_mesh
from creeping.geometry.surface import Surface, normal, project, size
from creeping.plotting._drawing import Drawing
from creeping.plotting._strokes import LevelColours, Stroke
from creeping.plotting._view import View, shadow_view
from creeping.plotting.body_fronts import with_fronts
from creeping.plotting.coloured_body import cells_of, save_painted
from creeping.plotting.pictures import chosen_backend

RING = 0.05
"""Radius of the ring round the source, in body sizes."""
SOURCE = "#111111"


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
