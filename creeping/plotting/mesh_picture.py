"""Pictures of triangle meshes coloured by a number at their vertices, each from two opposite sides."""

import os
from dataclasses import dataclass

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.plotting._drawing import View
from creeping.plotting.axes3d import brightness
from creeping.plotting.pages import add_bar, new_figure, save_figure

VIEWS = (View(np.radians(-60.0), np.radians(25.0)), View(np.radians(120.0), np.radians(-25.0)))
HIGHEST, SPAN = 0.0, (3.0, 6.0)
"""Power of ten at the upper end of the colours, and the fewest and most decades below it."""
BAD_COLOUR = "#b3202a"
WIDTH, HEIGHT = 7.2, 3.4  # inches, of one mesh


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
    figure = new_figure((WIDTH, HEIGHT * len(meshes)))
    for row, mesh in enumerate(meshes):
        _draw(figure, 1 - (row + 1) / len(meshes), 1 / len(meshes), mesh, label)
    save_figure(figure, path, dpi)


def _draw(figure: Any, bottom: float, height: float, mesh: MeshValues, label: str) -> None:
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
