"""What figures share: curves and fans on a body, keys, and the card with what a figure measured.

Directions at a point are p(alpha) = cos(alpha) e1 + sin(alpha) e2 in the polar frame of its chart. Hidden parts of
curves are faint, as in the pictures of `creeping.plotting`. The number under a figure of rays is the error of one g_T0,
and of rays at their ends against direct integration.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

import creeping as cr
from creeping._typing import Any, ArrayLike, FloatArray
from creeping.geometry.evaluators import polar_frame
from creeping.geometry.piecewise import drawn_mesh
from creeping.geometry.surface import Surface, size
from creeping.plotting import pictures, plot_line
from creeping.plotting._drawing import Drawing, Mark, View, compose
from creeping.plotting._strokes import RAY_COLOUR, LevelColours, Stroke, closed, refined
from creeping.plotting.pages import add_bar

SOURCE_COLOUR = "#c2185b"
RAY_COUNT = 32
"""Rays of a fan that are drawn."""


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
    drawing = Scene(body, None, view, *drawn_mesh(body, 80), list(strokes), LevelColours.of([]))
    pictures.draw(ax, drawing)
    if source is not None and view.visible(body, np.asarray(source, dtype=float)[None])[0]:
        ax.plot(*np.reshape(source, (3, 1)), "o", ms=4, color=SOURCE_COLOUR, mec="white", mew=0.6, zorder=25)


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
    bar = add_bar(figure, colours.mappable, label, fontsize=8, **place)
    bar.set_ticks(levels[1::2] if len(levels) > 8 else levels)
    bar.ax.hlines(levels, 0, 1, colors="white", linewidth=0.4)


def plain_ticks(ax: Any, which: Literal["major", "both"] = "major") -> None:
    """Small ticks that point inwards on all sides."""
    ax.tick_params(labelsize=8, direction="in", which=which, top=True, right=True, width=0.5)


def panel(figure: Any, letter: str, text: str, place: tuple[float, float]) -> None:
    """Title of a panel: its letter in bold and what it shows."""
    figure.text(*place, rf"$\bf{{{letter}}}$  {text}", fontsize=9)


def on_body(ax: Any, fan: cr.RayFan, curves: Sequence[cr.IsoPhaseCurve], until: float | None = np.inf) -> Drawing:
    """Draw shadow line, rays and iso-phase curves on 3-D axes; ``until`` as of `creeping.plotting.picture`."""
    drawing = compose(fan.line, fan, curves, rays=RAY_COUNT, until=until)
    pictures.draw(ax, drawing)
    return drawing


def in_parameters(ax: Any, fan: cr.RayFan, curves: Sequence[cr.IsoPhaseCurve], until: float | None = np.inf) -> None:
    """Draw the same over the parameters, degrees, without legend."""
    plot_line(fan.line, ax, fan=fan, curves=curves, rays=RAY_COUNT, until=until, legend=False)


def add_legend(figure: Any, drawings: Sequence[Drawing]) -> None:
    """One legend under all panels, of whatever any of them shows."""
    named = {stroke.label: stroke for drawing in drawings for stroke in drawing.strokes if stroke.label}
    replace(drawings[0], strokes=list(named.values())).add_legend(figure, columns=len(named))


def map_card(flow: cr.PhaseMap) -> dict[str, Any]:
    """Parameters of a map for a card."""
    return {
        "T0": flow.horizon,
        "charts": len(flow.leaps[-1].state),
        "nodes": list(flow.grid.nodes),
        "degree": flow.grid.degree,
    }


def end_error(
    flow: cr.PhaseMap, points: FloatArray, directions: FloatArray, ends: FloatArray, time: float
) -> cr.ErrorEstimate:
    """Error of 64 of the rays at one time, against `trace` at 1e-12.

    Parameters
    ----------
    flow : PhaseMap
    points, directions : (n, 3)
        Where the rays start.
    ends : (n, 6)
        (x, p) that the map found at the time.
    time : float
    """
    some = np.unique(np.linspace(0, len(points) - 1, 64).astype(int))
    exact = np.concatenate(cr.trace(flow.body, points[some], directions[some], time, rtol=1e-12), axis=-1)
    error = np.linalg.norm(ends[some] - exact, axis=-1)
    return cr.ErrorEstimate(float(np.sqrt(np.mean(error**2))), float(error.max()), len(some))


def rays_card(flow: cr.PhaseMap, error: cr.ErrorEstimate, time: float, **parameters: Any) -> dict[str, Any]:
    """Card of a figure of rays that a map carried to a time."""
    return {
        "parameters": {"body": repr(flow.body), **parameters, "time": time} | map_card(flow),
        "error": {"map": asdict(flow.error), "rays": asdict(error)},
        "headline": f"one g_T0 (T0 = {flow.horizon:g}): rms {flow.error.rms:.1e}; rays at t = {time:g}: "
        f"rms {error.rms:.1e}, max {error.max:.1e} ({error.samples} traced)",
    }


def fans_error(fans: Sequence[cr.RayFan]) -> cr.ErrorEstimate:
    """Error at the ends of several fans together."""
    samples = sum(fan.error.samples for fan in fans)
    squares = sum(fan.error.samples * fan.error.rms**2 for fan in fans)
    return cr.ErrorEstimate(float(np.sqrt(squares / samples)), max(fan.error.max for fan in fans), samples)
