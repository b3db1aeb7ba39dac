"""Picture of a triangle mesh coloured by a number at its vertices, from two opposite sides."""

import os

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.plotting._view import View
from creeping.plotting.axes3d import brightness
from creeping.plotting.pictures import new_figure, save_figure

VIEWS = (View(np.radians(-60.0), np.radians(25.0)), View(np.radians(120.0), np.radians(-25.0)))
HIGHEST, SPAN = 0.0, (3.0, 6.0)
"""Power of ten at the upper end of the colours, and the fewest and most decades below it."""
BAD_COLOUR = "#b3202a"
SIZE = (7.2, 3.8)


def mesh_picture(
    path: str | os.PathLike[str],
    vertices: FloatArray,
    triangles: IntArray,
    values: FloatArray,
    *,
    bad: BoolArray,
    label: str = "disagreement of jets of degree 4 and 6",
    dpi: int = 200,
) -> None:
    """Write a PNG of a mesh coloured by values > 0 at its vertices, on a logarithmic scale.

    Parameters
    ----------
    path : str or path
        File to write.
    vertices : (n, 3)
    triangles : (m, 3)
    values : (n,)
    bad : (n,) bool
        Vertices that get a dot.
    label : str
        Of the colour bar.
    dpi : int

    Raises
    ------
    CreepingError
        If the file cannot be written.
    """
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import Normalize

    decade = np.log10(np.maximum(values, 10.0 ** (HIGHEST - SPAN[1])))
    lowest = float(np.clip(np.floor(np.percentile(decade, 1)), HIGHEST - SPAN[1], HIGHEST - SPAN[0]))
    colours = ScalarMappable(Normalize(lowest, HIGHEST), "viridis")
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    paint = colours.to_rgba(decade[triangles].mean(axis=1))[:, :3]
    figure = new_figure(SIZE)
    for k, view in enumerate(VIEWS):
        ax = figure.add_axes((0.01 + 0.43 * k, 0.06, 0.42, 0.9))
        facing = normals @ view.toward
        front = np.flatnonzero(facing > 0)
        # the far ones first, so that the near ones cover them
        front = front[np.argsort(corners[front].mean(axis=1) @ view.toward)]
        shade = (0.6 + 0.4 * brightness(facing[front]))[:, None] * paint[front]
        flat = view.project(corners[front])
        # edges in the colour of the face close the hairlines between triangles
        ax.add_collection(PolyCollection(list(flat), facecolors=shade, edgecolors=shade, linewidths=0.3))
        seen = np.intersect1d(np.flatnonzero(bad), triangles[front])
        ax.plot(*view.project(vertices[seen]).T, ".", color=BAD_COLOUR, markersize=2.5, label=f"{int(bad.sum())} rough")
        ax.autoscale_view()
        ax.set_aspect("equal")
        ax.set_axis_off()
    if np.any(bad):
        figure.axes[0].legend(loc="lower left", fontsize=8, frameon=False, markerscale=3)
    bar = figure.colorbar(colours, cax=figure.add_axes((0.885, 0.1, 0.018, 0.8)), extend="min")
    bar.set_label(label, fontsize=8)
    ticks = np.arange(lowest, HIGHEST + 1)
    bar.set_ticks(ticks, labels=[f"$10^{{{int(t)}}}$" for t in ticks])
    bar.ax.tick_params(labelsize=8, width=0.5)
    bar.outline.set_linewidth(0.5)
    save_figure(figure, path, dpi)
