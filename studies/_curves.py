"""Curves on a body without an incidence: geodesics from a point, their wavefronts, and the axes they are drawn on.

Directions at a point are p(alpha) = cos(alpha) e1 + sin(alpha) e2 in the polar frame of its chart. Hidden parts of
curves are faint, as in the pictures of `creeping.plotting`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from creeping._typing import Any, ArrayLike, FloatArray
from creeping.geometry.evaluators import polar_frame
from creeping.geometry.piecewise import drawn_mesh
from creeping.geometry.surface import Surface, size
from creeping.plotting import axes3d
from creeping.plotting._drawing import Drawing, Mark, View
from creeping.plotting._strokes import ARROW_COLOUR, RAY_COLOUR, LevelColours, Stroke, closed, refined

SOURCE_COLOUR = "#c2185b"


@dataclass(frozen=True)
class Scene(Drawing):
    """A body with curves and the triad of its axes; no wave, so no arrow of incidence."""

    @cached_property
    def frame(self) -> tuple[FloatArray, FloatArray]:
        """Lower left and upper right corner (2,) of the picture, L."""
        tips = [mark.foot + 1.4 * (mark.tip - mark.foot) for mark in self.triad]
        return self.view.frame(np.concatenate([self.mesh.vertices, np.stack(tips)]), margin=0.02)

    @cached_property
    def triad(self) -> list[Mark]:
        """Coordinate axes in the lower left corner of the body's box, where a round body leaves room."""
        low, high = self.view.frame(self.mesh.vertices, margin=0.0)
        length = 0.1 * float(np.max(high - low))
        flat = self.view.project(length * np.eye(3))
        foot = self._at(*(low - np.minimum(flat.min(axis=0), 0.0) - 0.05 * (high - low)))
        return [Mark(name, foot, foot + length * unit) for name, unit in zip("xyz", np.eye(3), strict=True)]


def draw_curves(
    body: Surface, strokes: Sequence[Stroke], *, ax: Any, view: View, source: ArrayLike | None = None
) -> None:
    """Draw a body with curves on 3-D axes.

    Parameters
    ----------
    body : Surface
    strokes : sequence of Stroke
    ax : mpl_toolkits.mplot3d.Axes3D
    view : View
    source : (3,), L, optional
        A point to mark, where it is visible.
    """
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    scene = Scene(body, np.zeros(3), view, *drawn_mesh(body, 80), list(strokes), LevelColours.of([]))
    ax.computed_zorder = False
    axes3d._draw_body(ax, scene)
    for stroke in scene.strokes:
        axes3d._draw_stroke(ax, scene, stroke)
    ax.add_collection3d(
        Poly3DCollection([mark.outline(view) for mark in scene.triad], facecolors=ARROW_COLOUR, linewidths=0, zorder=30)
    )
    for mark in scene.triad:
        ax.text(*mark.label(view), mark.name, zorder=30, **mark.text)
    if source is not None and view.visible(body, np.asarray(source, dtype=float)[None])[0]:
        ax.plot(*np.reshape(source, (3, 1)), "o", ms=4, color=SOURCE_COLOUR, mec="white", mew=0.6, zorder=25)
    # 3-D axes are square; a wide body may use all of the place they were given
    for artist in ax.collections:
        artist.set_clip_on(False)
    axes3d._frame(ax, scene)


def directions_at(body: Surface, point: FloatArray, angles: FloatArray) -> FloatArray:
    """Unit tangents p(alpha) at a point of the body: (3,), (n,) -> (n, 3)."""
    chart, uv = body.atlas.locate(point[None])
    frame = polar_frame(body.atlas.charts[int(chart[0])].tangents(uv))[0]
    return np.asarray(np.stack([np.cos(angles), np.sin(angles)], axis=-1) @ frame.T)


def turn(count: int) -> FloatArray:
    """Equally spaced angles over a turn: (count,), radians."""
    return 2 * np.pi * np.arange(count) / count


def equal_times(step: float, last: float) -> FloatArray:
    """Multiples of the step from 0 to the last: (m,)."""
    return np.linspace(0.0, last, round(last / step) + 1, dtype=np.float64)


def ray_stroke(body: Surface, points: FloatArray, tangents: FloatArray, times: FloatArray, *, every: int = 1) -> Stroke:
    """Every so-manieth of the rays (rays, steps, 3) as one stroke, drawn round."""
    spacing = 0.01 * size(body)
    lines = [refined(x, p, times, spacing)[0] for x, p in zip(points[::every], tangents[::every], strict=True)]
    return Stroke(lines, RAY_COLOUR, 0.5, label="geodesic")


def circle_strokes(points: FloatArray, levels: FloatArray, colours: LevelColours) -> list[Stroke]:
    """Geodesic circles: points (rays, levels, 3) of a full turn of rays, one closed stroke a level."""
    return [Stroke([closed(points[:, k])], colours(level), 0.9, rank=1) for k, level in enumerate(levels.tolist())]


def add_level_bar(figure: Any, colours: LevelColours, levels: FloatArray, label: str, **place: Any) -> None:
    """Colour bar with the range of the levels; ``place`` as for ``Figure.colorbar``."""
    bar = figure.colorbar(colours.mappable, **place)
    bar.set_label(label, fontsize=8)
    bar.ax.tick_params(labelsize=8, width=0.5)
    bar.set_ticks(levels[1::2] if len(levels) > 8 else levels)
    bar.ax.hlines(levels, 0, 1, colors="white", linewidth=0.4)
    bar.outline.set_linewidth(0.5)


def tag(ax: Any, letter: str, text: str) -> None:
    """Title of a panel: its letter in bold and what it shows."""
    ax.set_title(rf"$\bf{{{letter}}}$  {text}", fontsize=9, loc="left")
