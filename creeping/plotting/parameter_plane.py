"""The picture in the plane of the body's parameters: (theta, phi), or (theta, psi) on a torus, in degrees."""

from collections.abc import Sequence

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.field.boundary import BoundaryLike
from creeping.plotting._strokes import (
    FADED,
    FADED_WIDTH,
    STATUS_COLOURS,
    LevelColours,
    curve_pieces,
    drawn_curves,
    drawn_ends,
    line_pieces,
    ray_strokes,
)
from creeping.rays.fan import RayFan
from creeping.rays.isophase import IsoPhaseCurve, split_at_seam
from creeping.shadow.line import ShadowLine
from creeping.shadow.status import STATUSES


def plot_parameters(
    line: ShadowLine,
    fan: RayFan | None = None,
    curves: Sequence[IsoPhaseCurve] = (),
    *,
    ax: Any = None,
    rays: int = 48,
    until: float | None = None,
    wavenumber: float | None = None,
    boundary: BoundaryLike = "hard",
    legend: bool = True,
) -> Any:
    """Draw the shadow line, creeping rays and iso-phase curves over (phi, theta) in degrees.

    Parameters
    ----------
    line : ShadowLine
    fan : RayFan, optional
    curves : sequence of IsoPhaseCurve
    ax : matplotlib.axes.Axes, optional
        Axes to draw on; by default those of a new figure.
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
    matplotlib.axes.Axes
    """
    if ax is None:
        from matplotlib import pyplot

        ax = pyplot.figure(figsize=page_size(torus=is_torus(line)), dpi=150, layout="constrained").add_subplot()
    body, ends = line.body, drawn_ends(fan, until, wavenumber, boundary)
    if fan is not None:
        # finer than in space: near a pole phi turns fast
        for stroke in ray_strokes(fan, rays, ends, spacing=0.005):
            pieces = [
                piece for points in stroke.lines for piece in split_at_seam(body.parameters(points), closed=False)
            ]
            _add(ax, pieces, color=stroke.colour, linewidth=0.8 * stroke.width, alpha=stroke.alpha, label=stroke.label)
    colours = draw_curves(ax, drawn_curves(curves, fan, ends), fan, ends)
    for status in STATUSES:
        pieces = _in_plane(body, line_pieces(line, status))
        _add(ax, pieces, color=STATUS_COLOURS[status], linewidth=1.8, label=f"shadow line, {status}", zorder=4)
    frame(ax, torus=is_torus(line))
    if legend:
        _add_legend(ax, colours)
    return ax


def page_size(*, torus: bool) -> tuple[float, float]:
    """Width and height, inches, of a page that the plane fills, with a legend below and a bar beside it."""
    return (6.4, 5.9) if torus else (6.4, 3.6)


def draw_curves(
    ax: Any, curves: Sequence[IsoPhaseCurve], fan: RayFan | None = None, ends: FloatArray | None = None
) -> LevelColours:
    """Draw iso-phase curves, faint where rays of their fan have detached, and return the colours of their levels.

    ``ends`` are those of `creeping.plotting._strokes.drawn_ends`, none by default.
    """
    colours = LevelColours.of(curves)
    for curve in curves:
        # levels are read off the colour bar; a single one has none
        label = "" if colours.high > colours.low or curve is not curves[0] else colours.words(curve.level)
        bound, free = (
            [piece for part in parts for piece in split_at_seam(part, closed=False)]
            for parts in curve_pieces(curve, fan, curve.parameters, ends)
        )
        colour = colours(curve.level)
        _add(ax, bound, color=colour, linewidth=1.0, label=label, zorder=3)
        _add(ax, free, color=colour, linewidth=FADED_WIDTH, alpha=FADED, zorder=3)
    return colours


def _in_plane(body: Any, lines: Sequence[FloatArray]) -> list[FloatArray]:
    """Lines on the body (n, 3) as pieces of curves of its parameters (k, 2)."""
    return [piece for points in lines for piece in split_at_seam(body.parameters(points), closed=False)]


def is_torus(line: ShadowLine) -> bool:
    """Whether theta runs all the way round, as on a torus, rather than from pole to pole.

    A polar angle is never negative, while the shadow line of a torus, n.d = 0, meets both signs of theta.
    """
    return any(float(np.min(line.body.parameters(curve.points)[..., 0])) < 0 for curve in line.curves)


def _add(ax: Any, pieces: Sequence[FloatArray], *, label: str = "", **style: Any) -> None:
    """Add the pieces (k, 2) as one artist, phi to the right and theta upwards or downwards."""
    from matplotlib.collections import LineCollection

    if pieces:
        lines = [np.degrees(piece[:, ::-1]) for piece in pieces]
        ax.add_collection(LineCollection(lines, label=label or "_hidden", capstyle="round", **style))


def frame(ax: Any, *, torus: bool) -> None:
    """Axes of the plane: (phi, theta), or (psi, theta) all the way round on a torus, in degrees."""
    name = "psi" if torus else "phi"
    ax.set_xlim(-180, 180)
    ax.set_xticks(range(-180, 181, 60))
    # a polar angle grows from the upper pole down, like the picture of the body
    ax.set_ylim(*((-180, 180) if torus else (180, 0)))
    ax.set_yticks(range(-180, 181, 60) if torus else range(0, 181, 30))
    ax.set_xlabel(rf"$\{name}$ (degrees)", fontsize=9)
    ax.set_ylabel(r"$\theta$ (degrees)", fontsize=9)
    ax.set_aspect("equal")
    ax.tick_params(labelsize=8, direction="in", top=True, right=True, width=0.5)
    for spine in ax.spines.values():
        spine.set_linewidth(0.5)


def _add_legend(ax: Any, colours: LevelColours) -> None:
    handles, labels = ax.get_legend_handles_labels()
    order = sorted(range(len(labels)), key=lambda k: not labels[k].startswith("shadow"))
    ax.figure.legend(
        [handles[k] for k in order],
        [labels[k] for k in order],
        loc="outside lower center" if ax.figure.get_layout_engine() is not None else "lower center",
        ncols=min(3, max(1, len(labels))),
        frameon=False,
        fontsize=8,
    )
    # without levels to tell apart there is no bar, and no place for one
    if colours.high > colours.low:
        colours.add_bar(ax.figure, cax=ax.inset_axes((1.03, 0.0, 0.025, 1.0)))
