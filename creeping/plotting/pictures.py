"""Whole figures of the body in space as PNG files, by pyvista or matplotlib.

Also here: the picture with matplotlib, for axes that are given and where OpenGL is missing. Hidden lines are found by
looking, not by a depth buffer: mplot3d sorts whole artists, not points. So the body is drawn first, and of each curve
the visible part over it and the hidden part faintly; that holds for the view it was drawn for, not after turning the
axes.

Also here: triangle meshes coloured by a number at their vertices, each from two opposite sides.
"""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Unpack

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.plotting._drawing import Drawing, View, compose
from creeping.plotting._strokes import ARROW_COLOUR, BODY_COLOUR, HIDDEN, RayOptions, Stroke, runs
from creeping.plotting.pages import PAGE, InlineAxes3D, add_bar, new_figure, save_figure
from creeping.plotting.scene import gl_available, render
from creeping.rays.fan import RayFan
from creeping.rays.isophase import IsoPhaseCurve
from creeping.shadow.line import ShadowLine

TITLE_SIZE = 8.0
"""Of the letters of a title, points."""
BAD_COLOUR = "#b3202a"
"""Of vertices that are rough."""
Place = tuple[float, float, float, float]  # left, bottom, width, height, as shares of the figure


def picture(
    path: str | os.PathLike[str],
    line: ShadowLine,
    fan: RayFan | None = None,
    curves: Sequence[IsoPhaseCurve] = (),
    *,
    backend: str = "auto",
    view: View | None = None,
    name: str = "",
    dpi: int = 300,
    **shown: Unpack[RayOptions],
) -> str:
    """Write a PNG of the body with its shadow line, creeping rays and iso-phase curves.

    Parameters
    ----------
    path : str or path
        File to write.
    line : ShadowLine
    fan : RayFan, optional
    curves : sequence of IsoPhaseCurve
    backend : str
        "pyvista", "matplotlib", or "auto": pyvista where there is OpenGL.
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
    name : str
        What the title calls the body; its repr if not given.
    dpi : int
        Pixels per inch; the figure is 6.4 inches wide, its height follows the body.

    Returns
    -------
    str
        "pyvista" or "matplotlib", whichever drew it.

    Raises
    ------
    InvalidInputError
        If the backend is not one of the three.
    CreepingError
        If pyvista is asked for and cannot draw here, or the file cannot be written.
    """
    backend = chosen_backend(backend)
    drawing = compose(line, fan, curves, view=view, name=name, **shown)
    figure, bar = drawn_page(drawing, backend, dpi)
    add_legends(figure, drawing, bar)
    save_figure(figure, path, dpi)
    return backend


def add_legends(figure: Any, drawing: Drawing, bar: Place) -> None:
    """Legend of a page, and the colour bar of its levels at the place for it."""
    drawing.add_legend(figure)
    if drawing.colours.high > drawing.colours.low:
        drawing.colours.add_bar(figure, cax=figure.add_axes(bar))


def chosen_backend(backend: str) -> str:
    """Either "pyvista" or "matplotlib"; "auto" is pyvista where there is OpenGL.

    Raises
    ------
    InvalidInputError
        If the backend is not one of the three.
    """
    if backend not in ("auto", "pyvista", "matplotlib"):
        raise InvalidInputError(f"backend {backend!r} is unknown; give one of auto, pyvista, matplotlib")
    if backend == "auto":
        return "pyvista" if gl_available().ok else "matplotlib"
    return backend


def drawn_page(drawing: Drawing, backend: str, dpi: int) -> tuple[Any, Place]:
    """Figure with the body's picture and room for a legend, and the place of a colour bar."""
    figure, place = _page(drawing)
    if backend == "pyvista":
        _draw_pyvista(figure, place, drawing, dpi)
    else:
        draw(figure.add_axes(place, axes_class=InlineAxes3D), drawing)
    figure.text(0.02, 0.99, drawing.title, fontsize=TITLE_SIZE, va="top", parse_math=False)
    left, bottom, width, height = place
    return figure, (left + width + 0.02, bottom + 0.12 * height, 0.022, 0.76 * height)


def _page(drawing: Drawing) -> tuple[Any, Place]:
    """Figure with room for the body's picture, the legend below and the colour bar at the right."""
    low, high = drawing.frame
    width = 0.82 * PAGE[0]
    # neither a strip nor a tower: the rest of the room stays white
    body = float(np.clip(width * (high[1] - low[1]) / (high[0] - low[0]), 2.4, 4.6))
    legend = 0.55 if len({stroke.label for stroke in drawing.strokes} - {""}) > 3 else 0.38
    lines = drawing.title.count("\n") + 1 if drawing.title else 0
    height = body + legend + 0.05 + 0.16 * lines
    return new_figure((PAGE[0], height)), (0.01, legend / height, width / PAGE[0], body / height)


def _draw_pyvista(figure: Any, place: Place, drawing: Drawing, dpi: int) -> None:
    """Render the scene without any text, which matplotlib then sets, sharper and as in the other backend."""
    ax = figure.add_axes(place)
    # more pixels along a side than the file has: reduced on saving, which smooths every edge
    dots = 1.6 * dpi
    width, height = (
        round(dots * inches * share) for inches, share in zip(figure.get_size_inches(), place[2:], strict=True)
    )
    image = render(drawing, (width, height), scale=dots / 72)
    low, high = drawing.frame
    middle = 0.5 * (low + high)
    half_height = max(0.5 * float(high[1] - low[1]), 0.5 * float(high[0] - low[0]) * height / width)
    half_width = half_height * width / height
    extent = (middle[0] - half_width, middle[0] + half_width, middle[1] - half_height, middle[1] + half_height)
    ax.imshow(image, extent=extent, interpolation="antialiased")
    ax.set_axis_off()
    ax.set_autoscale_on(False)
    for mark in drawing.marks:
        ax.fill(*drawing.view.project(mark.outline(drawing.view)).T, color=ARROW_COLOUR, linewidth=0)
        ax.text(*drawing.view.project(mark.label(drawing.view)), mark.name, **mark.text)


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
    # equal aspect, no axes, everything in the picture and nothing wasted
    low, high = drawing.frame
    half = 0.5 * float(np.max(high - low))
    ax.set_axis_off()
    ax.set_proj_type("ortho")
    ax.view_init(elev=np.degrees(drawing.view.elevation), azim=np.degrees(drawing.view.azimuth))
    ax.set(**{f"{axis}lim": (at - half, at + half) for axis, at in zip("xyz", drawing.centre, strict=True)})
    ax.set_box_aspect((1, 1, 1), zoom=1.0)
    # mplot3d does not say how large it draws nor where: measure, correct the size, measure, correct the place
    place = ax.get_position(original=True).transformed(ax.figure.transSubfigure)
    _, unit = _measure(ax, drawing)
    ax.set_box_aspect((1, 1, 1), zoom=float(np.min(np.array([place.width, place.height]) / (unit * (high - low)))))
    centre, unit = _measure(ax, drawing)
    off = (centre - 0.5 * (place.min + place.max)) / unit
    moved = drawing.centre + off[0] * drawing.view.right + off[1] * drawing.view.up
    ax.set(**{f"{axis}lim": (at - half, at + half) for axis, at in zip("xyz", moved, strict=True)})


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
            look: dict[str, Any] = {"colors": stroke.colour, "linewidths": stroke.width, "alpha": stroke.alpha * share}
            look |= {"capstyle": "butt", "joinstyle": "round", "zorder": 2 + stroke.rank + above}
            ax.add_collection3d(Line3DCollection(pieces, **look))


def _measure(ax: Any, drawing: Drawing) -> tuple[FloatArray, FloatArray]:
    """Where the centre of the picture lies (2,), pixels, and how many pixels one L takes, across and up (2,)."""
    from mpl_toolkits.mplot3d.proj3d import proj_transform

    ax.apply_aspect()
    centre, view = drawing.centre, drawing.view
    ends = np.stack([centre, centre + view.right, centre + view.up])
    pixels = ax.transData.transform(np.stack(proj_transform(*ends.T, ax.get_proj())[:2], axis=-1))
    return pixels[0], np.linalg.norm(pixels[1:] - pixels[0], axis=-1)


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
    figure = new_figure((7.2, 3.4 * len(meshes)))
    for row, mesh in enumerate(meshes):
        _draw_mesh(figure, 1 - (row + 1) / len(meshes), 1 / len(meshes), mesh, label)
    save_figure(figure, path, dpi)


def _draw_mesh(figure: Any, bottom: float, height: float, mesh: MeshValues, label: str) -> None:
    """Draw one mesh into a band of the figure, from two opposite sides."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import Normalize

    # from 1 three to six decades down
    decade = np.log10(np.maximum(mesh.values, 1e-6))
    lowest = float(np.clip(np.floor(np.percentile(decade, 1)), -6.0, -3.0))
    colours = ScalarMappable(Normalize(lowest, 0.0), "viridis")
    corners = mesh.vertices[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    paint = colours.to_rgba(decade[mesh.triangles].mean(axis=1))[:, :3]
    for k, view in enumerate((View(np.radians(-60.0), np.radians(25.0)), View(np.radians(120.0), np.radians(-25.0)))):
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
    ticks = np.arange(lowest, 1.0)
    bar.set_ticks(ticks, labels=[f"$10^{{{int(t)}}}$" for t in ticks])
