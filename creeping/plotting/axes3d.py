"""The 3-D picture with matplotlib, where OpenGL is missing: hidden lines are found by looking, not by a depth buffer.

mplot3d sorts whole artists, not points. So the body is drawn first, and of each curve the visible part over it and
the hidden part faintly; that holds for the view it was drawn for, not after turning the axes.
"""

from collections.abc import Sequence

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.plotting._inputs import IsoPhaseCurveLike, RayFanLike, ShadowLineLike
from creeping.plotting._strokes import ARROW_COLOUR, BODY_COLOUR, LevelColours, Stroke, runs, strokes
from creeping.plotting._view import View, arrow, shadow_view
from creeping.surface import Surface, normal
from creeping.triangulation import Triangulation, triangulate

HIDDEN = 0.16  # opacity of a hidden line, times that of the line


def plot_rays_3d(
    line: ShadowLineLike,
    fan: RayFanLike | None = None,
    curves: Sequence[IsoPhaseCurveLike] = (),
    *,
    ax: Any = None,
    view: View | None = None,
    rays: int = 64,
    until: float | None = None,
    cells: int = 72,
    legend: bool = True,
) -> Any:
    """Draw the body, its shadow line, creeping rays and iso-phase curves on matplotlib axes.

    Parameters
    ----------
    line : ShadowLine
    fan : RayFan, optional
    curves : sequence of IsoPhaseCurve
    ax : mpl_toolkits.mplot3d.Axes3D, optional
        Axes to draw on; by default those of a new figure.
    view : View, optional
        Camera; by default on the shadow side.
    rays : int
        Rays drawn at most.
    until : float, optional
        Travel time up to which rays are drawn; by default to their end.
    cells : int
        Fineness of the body's picture, cells along each side of its box.
    legend : bool
        Whether to add a legend and the colour bar of the levels.

    Returns
    -------
    mpl_toolkits.mplot3d.Axes3D
    """
    if ax is None:
        from matplotlib import pyplot

        ax = pyplot.figure(figsize=(6.4, 5.0), dpi=150).add_subplot(projection="3d")
    view = shadow_view(line.direction) if view is None else view
    mesh = triangulate(line.body.level, line.body.gradient, line.body.bounds, cells=cells)
    everything = strokes(line, fan, curves, rays=rays, until=until)
    ax.computed_zorder = False
    _draw_body(ax, line.body, mesh, view)
    for stroke in everything:
        _draw_stroke(ax, line.body, stroke, view)
    ends = arrow(view, np.asarray(line.direction), mesh.vertices)
    _draw_arrow(ax, ends, view)
    _frame(ax, np.concatenate([mesh.vertices, np.stack(ends)]), view)
    if legend:
        from creeping.plotting._legend import add_colour_bar, add_legend

        add_legend(ax.figure, everything)
        add_colour_bar(ax.figure, LevelColours.of(curves), ax)
    return ax


def _draw_body(ax: Any, body: Surface, mesh: Triangulation, view: View) -> None:
    """The triangles that face the camera, lit from it; the others are behind them."""
    from matplotlib.colors import to_rgb
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    corners = mesh.vertices[mesh.triangles]
    facing = normal(body, corners.mean(axis=1)) @ view.toward
    front = facing > -0.05
    shade = brightness(facing[front])[:, None] * np.array(to_rgb(BODY_COLOUR))
    # edges in the colour of the face close the hairlines between triangles
    ax.add_collection3d(Poly3DCollection(corners[front], facecolors=shade, edgecolors=shade, linewidths=0.3, zorder=1))


def brightness(facing: FloatArray) -> FloatArray:
    """Brightness of a surface lit from the camera, by n.toward: dark at the rim, so that the outline shows on white."""
    return np.asarray(0.62 + 0.40 * np.clip(facing, 0, 1) ** 0.7).clip(0, 1)


def _draw_stroke(ax: Any, body: Surface, stroke: Stroke, view: View) -> None:
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    # one call for all lines: the march to the camera is vectorised over points
    lengths = np.cumsum([len(points) for points in stroke.lines])[:-1]
    seen = np.split(view.visible(body, np.concatenate(stroke.lines)), lengths)
    for hidden in (True, False):
        # a segment is hidden if either of its ends is, so the two parts share the points where they meet
        pieces = []
        for points, mask in zip(stroke.lines, seen, strict=True):
            part = ~mask if hidden else mask
            if hidden:
                part = part | np.append(part[1:], False) | np.append(False, part[:-1])
            pieces += list(runs(points, part))
        if pieces:
            ax.add_collection3d(
                Line3DCollection(
                    pieces,
                    colors=stroke.colour,
                    linewidths=stroke.width,
                    alpha=stroke.alpha * (HIDDEN if hidden else 1.0),
                    capstyle="round",
                    joinstyle="round",
                    zorder=2 + stroke.rank + (0 if hidden else 10),
                )
            )


def _draw_arrow(ax: Any, ends: tuple[FloatArray, FloatArray], view: View) -> None:
    tail, head = ends
    ax.quiver(*tail, *(head - tail), color=ARROW_COLOUR, linewidth=1.6, arrow_length_ratio=0.25, zorder=30)
    beside = tail - 0.12 * np.linalg.norm(head - tail) * view.up
    ax.text(*beside, "d", ha="center", va="top", fontsize=10, fontweight="bold", color=ARROW_COLOUR, zorder=30)


def _frame(ax: Any, points: FloatArray, view: View) -> None:
    """Equal aspect, no axes, everything in the picture."""
    low, high = points.min(axis=0), points.max(axis=0)
    flat = view.project(points)
    half = 0.5 * float(np.max(high - low))
    for axis, centre in zip("xyz", 0.5 * (low + high), strict=True):
        getattr(ax, f"set_{axis}lim")(centre - half, centre + half)
    ax.set_box_aspect((1, 1, 1), zoom=1.35 * 2 * half / float(np.max(np.ptp(flat, axis=0))))
    ax.set_proj_type("ortho")
    ax.view_init(elev=np.degrees(view.elevation), azim=np.degrees(view.azimuth))
    ax.set_axis_off()
