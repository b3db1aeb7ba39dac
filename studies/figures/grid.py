"""The grid of Figure 2: nodes of charts on a body, and in one of them those of its neighbours."""

from pathlib import Path

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any, FloatArray
from creeping.geodesics.bundle import random_bundle_points
from creeping.phaseflow.splines import Grid
from creeping.plotting._drawing import View
from creeping.plotting._strokes import Stroke
from creeping.plotting.pages import COLOURS
from studies.figures.drawing import draw_curves, end_error, panel, plain_ticks, rays_card

BODY = sc.Ellipsoid(1.2, 0.8, 0.8)
GRID = Grid((16, 16, 64), 3, (False, False))
FACES = ("$+x$", "$-x$", "$+y$", "$-y$", "$+z$", "$-z$")
MARKS = ("o", "s") * 3
"""Of opposite faces, whose colours some readers cannot tell apart."""
VIEW = View(float(np.radians(-52)), float(np.radians(26)))
TIME = 4.0


def nodes() -> FloatArray:
    """Nodes of all charts on the body: (6, 16, 16, 3), L."""
    u, v, _ = GRID.axes()
    uv = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1)
    return np.stack([chart.point(uv) for chart in BODY.atlas.charts])


def grid_on_body(ax: Any) -> None:
    """Draw the nodes that face the reader, and the edges of the unit squares, on 3-D axes."""
    side = np.linspace(0.0, 1.0, 100)
    edge = np.stack([side, np.zeros_like(side)], axis=-1)
    edges = np.concatenate([edge, 1 - edge, np.roll(edge, 1, axis=1), 1 - np.roll(edge, 1, axis=1)])
    strokes = [
        Stroke(np.split(chart.point(edges), 4), colour, 1.2)
        for chart, colour in zip(BODY.atlas.charts, COLOURS, strict=True)
    ]
    draw_curves(BODY, strokes, ax=ax, view=VIEW)
    look: dict[str, Any] = {"depthshade": False, "linewidths": 0, "zorder": 20, "clip_on": False}
    for colour, mark, points in zip(COLOURS, MARKS, nodes(), strict=True):
        seen = VIEW.visible(BODY, points)
        if seen.any():
            ax.scatter(*points[seen].T, s=5, color=colour, marker=mark, **look)


def grid_in_chart(ax: Any) -> None:
    """Draw the nodes of chart +x, and those of its neighbours that lie inside its grid, over (u, v)."""
    u, v, _ = GRID.axes()
    inside = nodes()
    s = BODY.inverse(inside)
    front = s[..., 0] > 0.05
    tangents = s[..., 1:] / np.where(front, s[..., 0], 1.0)[..., None]
    uv = np.arctan(tangents) / (np.pi / 2) + 0.5
    front &= np.all((uv > u[0] - 1e-9) & (uv < u[-1] + 1e-9), axis=-1)
    front[:2] = False
    ax.plot(*np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2).T, "o", ms=3, mew=0, color=COLOURS[0])
    for k in range(2, 6):
        ax.plot(*uv[k][front[k]].T, MARKS[k], ms=3.4, mfc="none", mew=0.6, color=COLOURS[k])
    ax.plot([0, 1, 1, 0, 0], [0, 0, 1, 1, 0], color=COLOURS[0], lw=1.2)
    ax.annotate(
        "",
        (0.0, -0.33),
        (u[0], -0.33),
        arrowprops={"arrowstyle": "<->", "lw": 0.6, "shrinkA": 0, "shrinkB": 0},
        annotation_clip=False,
    )
    ax.text(0.5 * u[0], -0.35, r"$\delta$", ha="center", va="top", fontsize=9)
    ax.set_aspect("equal")
    ax.set_xlim(u[0] - 0.03, u[-1] + 0.03)
    ax.set_ylim(v[0] - 0.03, v[-1] + 0.03)
    ax.set_xticks([0, 0.5, 1])
    ax.set_yticks([0, 0.5, 1])
    plain_ticks(ax)
    ax.set_xlabel("$u$", fontsize=9, labelpad=1)
    ax.set_ylabel("$v$", fontsize=9)


def six_charts(path: Path, quick: bool) -> dict[str, Any]:
    """Figure 2: the six-chart grid on the ellipsoid 1.2, 0.8, 0.8, and how far neighbouring charts reach into one.

    Face +-a of the cube over s = (x/1.2, y/0.8, z/0.8), with (a, b, c) cyclic:

        s_b/s_a = tan xi,  s_c/|s_a| = tan eta,   xi = (u - 1/2) pi/2,  eta = (v - 1/2) pi/2

    The unit squares of (u, v) tile the body. Each grid of 16 x 16 nodes has two nodes beyond every edge (h = 1/11,
    delta = 2/11), so every point finds a chart in which it is two grid points from the edge [YC06b]. The card measures
    the map of Algorithm 1 [YC06a] on this grid with 64 angles: T0 = 1/8, tau = 2^-10, S = 7, cubic splines.
    """
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    flow = cr.build_phase_map(BODY, horizon=1 / 8, time_step=2**-10, stages=7, grid=(16, 64), degree=3, method="tower")
    x, p = random_bundle_points(BODY, 16 if quick else 64, rng=np.random.default_rng(2))
    error = end_error(flow, x, p, np.concatenate(flow.flow(x, p, TIME), axis=-1), TIME)
    figure = Figure(figsize=(7.2, 3.4), facecolor="white")
    left = figure.add_axes((0.01, 0.09, 0.56, 0.83), projection="3d")
    grid_on_body(left)
    panel(figure, "a", "nodes of the charts that face the reader", (0.02, 0.94))
    right = figure.add_axes((0.64, 0.20, 0.345, 0.72))
    grid_in_chart(right)
    right.set_title(r"$\bf{b}$  chart $+x$ and neighbours (hollow)", fontsize=9, loc="left")
    handles = [
        Line2D([], [], color=colour, marker=mark, ms=4, lw=1.2, label=name)
        for name, colour, mark in zip(FACES, COLOURS, MARKS, strict=True)
    ]
    figure.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.02, 0.0), ncols=6, frameon=False, fontsize=8)
    figure.savefig(path, dpi=100 if quick else 300)
    return rays_card(flow, error, TIME, rays=len(x), algorithm="1", tau=flow.leaps[0].time, S=7)
