"""The body in colours of decibels: of the field on it, and of the currents of the whole body at their nodes.

Sources: Derivations, F16.
"""

import os
from dataclasses import replace

import numpy as np

from creeping._typing import Any, BoolArray, ComplexArray, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.comparison import decibels, shown_range
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.field.equation.currents import ConductorTileCurrents, TileCurrents
from creeping.geometry.checks import unit_of
from creeping.geometry.incident import PlaneWave
from creeping.geometry.parts import why_no_rays
from creeping.geometry.surface import Surface, normal
from creeping.plotting._drawing import Drawing, View, bare, caption, compose
from creeping.plotting.palette import add_bar, beyond
from creeping.plotting.pictures import chosen_backend, drawn_page, save_figure
from creeping.shadow.line import shadow_line

NOTHING = "#b4b9bd"
"""Colour of what has no level."""
LEAST_CELLS, MOST_CELLS = 48, 96
"""Of the body along each side of its box."""
WIDTH, REACH = 0.22, 2.5
"""Standard deviation, in wavelengths, of the Gaussian that smooths currents, and where it ends, in it."""
COVERED = 0.3
"""Share of the area about a point that nodes must stand for if there is a current."""
BLOCK = 4000
"""Points that are smoothed at a time."""
INCIDENT = ("theta", "phi")


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
    drawing = bare(body, direction, **asked) if why_no_rays(body) else compose(shadow_line(body, direction), **asked)
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
    if incident is not None and (incident not in INCIDENT or not conductor):
        raise InvalidInputError(f"incident = {incident!r} is not {' or '.join(INCIDENT)}, of a conductor's currents")
    values, covered = _currents_at(currents, points)
    size = np.abs(values)
    if conductor:
        each = np.linalg.norm(size, axis=1)
        size = np.sqrt(np.mean(each**2, axis=1)) if incident is None else each[:, INCIDENT.index(incident)]
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
    for first in range(0, len(points), BLOCK):
        part = slice(first, first + BLOCK)
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
    return total, share > COVERED


def cells_of(body: Surface, wavenumber: float) -> int:
    """Cells along each side of a body's box, about eight a wavelength."""
    side = float(np.cbrt(np.prod(np.diff(body.bounds, axis=0))))
    return int(np.clip(8 * side * wavenumber / (2 * np.pi), LEAST_CELLS, MOST_CELLS))


def painted(drawing: Drawing, levels: FloatArray, *, span: float, label: str, bare: str, backend: str, dpi: int) -> Any:
    """Figure of a body with levels (n,), dB, at the vertices of its mesh, and a bar of colours; ``bare`` names NaN."""
    finite = levels[np.isfinite(levels)]
    # neither a null nor a caustic of a few points stretches the colours
    ends = np.percentile(finite, [1.0, 99.8]) if len(finite) else (-np.inf, np.inf)
    low, high = shown_range([np.clip(finite, *ends)], span, step=2.0)
    colours = _colours(low, high)
    paint = colours.to_rgba(np.nan_to_num(levels, nan=low, posinf=high, neginf=low))[:, :3]
    without = np.isnan(levels)
    handles = []
    if np.any(without):
        from matplotlib.colors import to_rgb
        from matplotlib.patches import Patch

        paint[without] = to_rgb(NOTHING)
        handles.append(Patch(color=NOTHING, label=bare))
    figure, place = drawn_page(replace(drawing, paint=np.asarray(paint)), backend, dpi)
    drawing.add_legend(figure, *handles)
    add_bar(figure, colours, label, extend=beyond(levels, low, high), fontsize=8, cax=figure.add_axes(place))
    return figure


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
    """Write the figure of `painted`, and return its backend."""
    figure = painted(drawing, levels, span=span, label=label, bare=bare, backend=backend, dpi=dpi)
    save_figure(figure, path, dpi)
    return backend


def _colours(low: float, high: float) -> Any:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    return ScalarMappable(Normalize(low, high), "magma")
