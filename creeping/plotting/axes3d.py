"""The 3-D picture with matplotlib, where OpenGL is missing: hidden lines are found by looking, not by a depth buffer.

mplot3d sorts whole artists, not points. So the body is drawn first, and of each curve the visible part over it and
the hidden part faintly; that holds for the view it was drawn for, not after turning the axes.
"""

from collections.abc import Sequence
from typing import Unpack

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.plotting._drawing import Drawing, View, compose
from creeping.plotting._strokes import ARROW_COLOUR, BODY_COLOUR, HIDDEN, RayOptions, Stroke, runs
from creeping.rays.fan import RayFan
from creeping.rays.isophase import IsoPhaseCurve
from creeping.shadow.line import ShadowLine


def plot_rays_3d(
    line: ShadowLine,
    fan: RayFan | None = None,
    curves: Sequence[IsoPhaseCurve] = (),
    *,
    ax: Any = None,
    view: View | None = None,
    legend: bool = True,
    **shown: Unpack[RayOptions],
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
        Travel time up to which rays are drawn; by default until their waves have fallen by 30 dB, or they have crossed
        their neighbours twice.
    wavenumber : float, optional, 1/L
        Of these waves; that at which k rho = 10 if not given.
    boundary : "hard", "soft", "pec" or ImpedanceBoundary
        Of these waves; on a hard body they fall most slowly.
    legend : bool
        Whether to add a legend and the colour bar of the levels.

    Returns
    -------
    mpl_toolkits.mplot3d.Axes3D
    """
    if ax is None:
        from matplotlib import pyplot

        ax = pyplot.figure(figsize=(6.4, 5.2), dpi=150).add_subplot(projection="3d")
    drawing = compose(line, fan, curves, view=view, **shown)
    draw(ax, drawing)
    if legend:
        drawing.add_legend(ax.figure)
        drawing.colours.add_bar(ax.figure, ax=ax, shrink=0.6, aspect=24, pad=0.02)
    return ax


def draw(ax: Any, drawing: Drawing) -> None:
    """Draw a composed picture on 3-D axes, without legend."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    # the order of drawing is ours: the body, hidden lines, visible lines by rank, arrows
    ax.computed_zorder = False
    _draw_body(ax, drawing)
    for stroke in drawing.strokes:
        _draw_stroke(ax, drawing, stroke)
    # not quiver: its heads are flat in space and vanish when seen from the side
    outlines = [mark.outline(drawing.view) for mark in drawing.marks]
    ax.add_collection3d(Poly3DCollection(outlines, facecolors=ARROW_COLOUR, linewidths=0, zorder=30))
    for mark in drawing.marks:
        ax.text(*mark.label(drawing.view), mark.name, zorder=30, **mark.text)
    # 3-D axes are square; a wide body may use all of the place they were given
    for artist in ax.collections:
        artist.set_clip_on(False)
    _frame(ax, drawing)


def _draw_body(ax: Any, drawing: Drawing) -> None:
    """Draw the triangles that face the camera, lit from it; the others are behind them."""
    from matplotlib.colors import to_rgb
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    corners = drawing.mesh.vertices[drawing.mesh.triangles]
    middle = drawing.normals[drawing.mesh.triangles].mean(axis=1)
    facing = middle @ drawing.view.toward / np.linalg.norm(middle, axis=1)
    front = facing > -0.05
    if drawing.paint is None:
        shade = brightness(facing[front])[:, None] * np.array(to_rgb(BODY_COLOUR))
    else:
        # little shade: colours are read off a bar
        paint = drawing.paint[drawing.mesh.triangles[front]].mean(axis=1)
        shade = (0.55 + 0.45 * brightness(facing[front]))[:, None] * paint
    # edges in the colour of the face close the hairlines between triangles
    ax.add_collection3d(Poly3DCollection(corners[front], facecolors=shade, edgecolors=shade, linewidths=0.3, zorder=1))


def brightness(facing: FloatArray) -> FloatArray:
    """Brightness of a surface lit from the camera, by n.toward: dark at the rim, so that the outline shows on white."""
    return np.asarray(0.62 + 0.38 * np.clip(facing, 0, 1))


def _draw_stroke(ax: Any, drawing: Drawing, stroke: Stroke) -> None:
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    # one call for all lines: the march to the camera is vectorised over points
    lengths = np.cumsum([len(points) for points in stroke.lines])[:-1]
    seen = np.split(drawing.view.visible(drawing.body, np.concatenate(stroke.lines)), lengths)
    visible = [piece for points, mask in zip(stroke.lines, seen, strict=True) for piece in runs(points, mask)]
    # a segment is hidden if either of its ends is, so the hidden runs reach one point into the visible ones
    hidden = [
        piece
        for points, mask in zip(stroke.lines, seen, strict=True)
        for piece in runs(points, ~mask | np.append(~mask[1:], False) | np.append(False, ~mask[:-1]))
    ]
    for pieces, share, above in ((hidden, HIDDEN if stroke.through else 0.0, 0), (visible, 1.0, 10)):
        if pieces and share > 0:
            lines = Line3DCollection(
                pieces,
                colors=stroke.colour,
                linewidths=stroke.width,
                alpha=stroke.alpha * share,
                capstyle="butt",
                joinstyle="round",
                zorder=2 + stroke.rank + above,
            )
            ax.add_collection3d(lines)


def _frame(ax: Any, drawing: Drawing) -> None:
    """Equal aspect, no axes, everything in the picture and nothing wasted."""
    low, high = drawing.frame
    half = 0.5 * float(np.max(high - low))
    ax.set_axis_off()
    ax.set_proj_type("ortho")
    ax.view_init(elev=np.degrees(drawing.view.elevation), azim=np.degrees(drawing.view.azimuth))
    _limits(ax, drawing.centre, half)
    ax.set_box_aspect((1, 1, 1), zoom=1.0)
    # mplot3d does not say how large it draws nor where: measure, correct the size, measure, correct the place
    place = ax.get_position(original=True).transformed(ax.figure.transSubfigure)
    _, unit = _measure(ax, drawing)
    ax.set_box_aspect((1, 1, 1), zoom=float(np.min(np.array([place.width, place.height]) / (unit * (high - low)))))
    centre, unit = _measure(ax, drawing)
    off = (centre - 0.5 * (place.min + place.max)) / unit
    _limits(ax, drawing.centre + off[0] * drawing.view.right + off[1] * drawing.view.up, half)


def _limits(ax: Any, centre: FloatArray, half: float) -> None:
    for axis, value in zip("xyz", centre, strict=True):
        getattr(ax, f"set_{axis}lim")(value - half, value + half)


def _measure(ax: Any, drawing: Drawing) -> tuple[FloatArray, FloatArray]:
    """Where the centre of the picture lies (2,), pixels, and how many pixels one L takes, across and up (2,)."""
    from mpl_toolkits.mplot3d.proj3d import proj_transform

    ax.apply_aspect()
    centre, view = drawing.centre, drawing.view
    ends = np.stack([centre, centre + view.right, centre + view.up])
    pixels = ax.transData.transform(np.stack(proj_transform(*ends.T, ax.get_proj())[:2], axis=-1))
    return pixels[0], np.linalg.norm(pixels[1:] - pixels[0], axis=-1)
