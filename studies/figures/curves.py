"""Charts with their grids, and geodesics from one point with their wavefronts, by phase maps: Figures 2 to 5."""

from pathlib import Path

import numpy as np
from scipy.interpolate import CubicHermiteSpline

import creeping as cr
import scatterers as sc
from creeping._typing import Any, FloatArray
from creeping.geodesics.states import pack, random_bundle_points
from creeping.phaseflow.splines import Grid
from creeping.plotting._drawing import View
from creeping.plotting._strokes import RAY_COLOUR, LevelColours, Stroke, closed
from creeping.plotting.pages import COLOURS, new_figure
from studies.figures import drawing

STEP = 1 / 16
ELLIPSOID, TORUS, WEIGHTED = sc.Ellipsoid(1.2, 0.8, 0.8), sc.Torus(R=1.0, r=0.5), sc.Sphere(speed="1 + x")
FISH_TAIL = 2.75
CAUSTIC_COLOUR = "#d32f2f"
W0 = np.array([0.0, 0.6])
"""Source in the stereographic plane."""
GRID = Grid((16, 16, 64), 3, (False, False))
MARKS = ("o", "s") * 3
"""Of opposite faces, whose colours some readers cannot tell apart."""


def view(azimuth: float, elevation: float) -> View:
    """View from angles in degrees."""
    return View(float(np.radians(azimuth)), float(np.radians(elevation)))


def nodes() -> FloatArray:
    """Nodes of all charts on the body: (6, 16, 16, 3), L."""
    u, v, _ = GRID.axes()
    uv = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1)
    return np.stack([chart.point(uv) for chart in ELLIPSOID.atlas.charts])


def grid_on_body(ax: Any) -> None:
    """Draw the nodes that face the reader, and the edges of the unit squares, on 3-D axes."""
    side = np.linspace(0.0, 1.0, 100)
    edge = np.stack([side, np.zeros_like(side)], axis=-1)
    edges = np.concatenate([edge, 1 - edge, np.roll(edge, 1, axis=1), 1 - np.roll(edge, 1, axis=1)])
    strokes = [
        Stroke(np.split(chart.point(edges), 4), colour, 1.2)
        for chart, colour in zip(ELLIPSOID.atlas.charts, COLOURS, strict=True)
    ]
    seen_from = view(-52, 26)
    drawing.draw_curves(ELLIPSOID, strokes, ax=ax, view=seen_from)
    look: dict[str, Any] = {"depthshade": False, "linewidths": 0, "zorder": 20, "clip_on": False}
    for colour, mark, points in zip(COLOURS, MARKS, nodes(), strict=True):
        seen = seen_from.visible(ELLIPSOID, points)
        if seen.any():
            ax.scatter(*points[seen].T, s=5, color=colour, marker=mark, **look)


def grid_in_chart(ax: Any) -> None:
    """Draw the nodes of chart +x, and those of its neighbours that lie inside its grid, over (u, v)."""
    u, v, _ = GRID.axes()
    inside = nodes()
    s = ELLIPSOID.inverse(inside)
    front = s[..., 0] > 0.05
    tangents = s[..., 1:] / np.where(front, s[..., 0], 1.0)[..., None]
    uv = np.arctan(tangents) / (np.pi / 2) + 0.5
    front &= np.all((uv > u[0] - 1e-9) & (uv < u[-1] + 1e-9), axis=-1)
    front[:2] = False
    ax.plot(*np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2).T, "o", ms=3, mew=0, color=COLOURS[0])
    for k in range(2, 6):
        ax.plot(*uv[k][front[k]].T, MARKS[k], ms=3.4, mfc="none", mew=0.6, color=COLOURS[k])
    ax.plot([0, 1, 1, 0, 0], [0, 0, 1, 1, 0], color=COLOURS[0], lw=1.2)
    arrow = {"arrowstyle": "<->", "lw": 0.6, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", (0.0, -0.33), (u[0], -0.33), arrowprops=arrow, annotation_clip=False)
    ax.text(0.5 * u[0], -0.35, r"$\delta$", ha="center", va="top", fontsize=9)
    limits = {"xlim": (u[0] - 0.03, u[-1] + 0.03), "ylim": (v[0] - 0.03, v[-1] + 0.03)}
    ax.set(aspect="equal", xticks=[0, 0.5, 1], yticks=[0, 0.5, 1], **limits)
    drawing.plain_ticks(ax)
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
    from matplotlib.lines import Line2D

    flow = cr.build_phase_map(
        ELLIPSOID, horizon=1 / 8, time_step=2**-10, stages=7, grid=(16, 64), degree=3, method="tower"
    )
    time = 4.0
    x, p = random_bundle_points(ELLIPSOID, 16 if quick else 64, rng=np.random.default_rng(2))
    error = drawing.end_error(flow, x, p, np.concatenate(flow.flow(x, p, time), axis=-1), time)
    figure = new_figure((7.2, 3.4))
    left = figure.add_axes((0.01, 0.09, 0.56, 0.83), projection="3d")
    grid_on_body(left)
    drawing.panel(figure, "a", "nodes of the charts that face the reader", (0.02, 0.94))
    right = figure.add_axes((0.64, 0.20, 0.345, 0.72))
    grid_in_chart(right)
    right.set_title(r"$\bf{b}$  chart $+x$ and neighbours (hollow)", fontsize=9, loc="left")
    handles = [
        Line2D([], [], color=colour, marker=mark, ms=4, lw=1.2, label=name)
        for name, colour, mark in zip(("$+x$", "$-x$", "$+y$", "$-y$", "$+z$", "$-z$"), COLOURS, MARKS, strict=True)
    ]
    figure.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.02, 0.0), ncols=6, frameon=False, fontsize=8)
    figure.savefig(path, dpi=100 if quick else 300)
    return drawing.rays_card(flow, error, time, rays=len(x), algorithm="1", tau=flow.leaps[0].time, S=7)


def circles(path: Path, quick: bool) -> dict[str, Any]:
    """Figure 3: geodesic circles on the ellipsoid 1.2, 0.8, 0.8, and their fish-tails behind the caustic.

    From one point y, 1024 rays (y, p(alpha)) are carried by the phase map; the geodesic circle of radius t is

        alpha -> x(t; y, p(alpha))

    Past the conjugate locus, where the reduced length M12(t, alpha) vanishes for the first time, the circles have cusps
    on it and cross themselves. M12 is carried along the rays (M12(0) = 0, M12'(0) = 1); its zero is found on the cubic
    between two times. The source is at (0.8, 0.4, 0.45) before scaling by the half-axes, brought to the unit sphere.
    """
    from matplotlib.lines import Line2D

    source = ELLIPSOID.forward(np.array([0.8, 0.4, 0.45]) / np.linalg.norm([0.8, 0.4, 0.45]))
    flow = cr.build_phase_map(ELLIPSOID, tolerance=1e-4 if quick else 1e-6)
    p = drawing.directions_at(ELLIPSOID, source, drawing.turn(256 if quick else 1024))
    x, times = np.broadcast_to(source, p.shape), drawing.equal_times(STEP, 4.0)
    states = flow.transport(pack(x, p, jacobi=True), times)
    error = drawing.end_error(flow, x, p, states[:, -1, :6], times[-1])
    caustic, when = first_caustic(states, times)
    coarse = np.arange(4, len(times), 4)
    fine = np.arange(2 * int(when.min() / STEP / 2), len(times), 2)
    colours = LevelColours(float(times[4]), float(times[-1]), "t")
    tail = Stroke([closed(states[:, round(FISH_TAIL / STEP), :3])], "#000000", 1.4, rank=2)
    rings = drawing.circle_strokes(states[:, coarse, :3], times[coarse], colours)
    some = drawing.ray_stroke(ELLIPSOID, states[..., :3], states[..., 3:6], times, every=len(p) // 32)
    red = Stroke([closed(caustic)], CAUSTIC_COLOUR, 1.4, rank=3)
    near = view(20, 22)
    far = View(near.azimuth + np.pi + 0.15, float(np.radians(-18)))
    figure = new_figure((9.6, 3.3))
    for left, strokes, seen in ((0.0, [some, *rings, red], near), (0.31, [*rings, tail, red], far)):
        ax = figure.add_axes((left, 0.08, 0.31, 0.82), projection="3d")
        drawing.draw_curves(ELLIPSOID, strokes, ax=ax, view=seen, source=source)
    fish_tails(figure.add_axes((0.64, 0.10, 0.26, 0.80)), states[:, fine, :3], times[fine], caustic, far, colours)
    drawing.panel(figure, "a", "from the source: rays and circles", (0.01, 0.94))
    drawing.panel(figure, "b", "the far side", (0.32, 0.94))
    drawing.panel(figure, "c", "fish-tails behind the caustic", (0.64, 0.94))
    drawing.add_level_bar(figure, colours, times[coarse], "length $t$", cax=figure.add_axes((0.925, 0.14, 0.014, 0.70)))
    handles = [
        Line2D([], [], color=CAUSTIC_COLOUR, lw=1.4, label="first caustic (conjugate locus)"),
        Line2D([], [], color="black", lw=1.6, label=f"circle $t$ = {FISH_TAIL:g}"),
        Line2D([], [], color=some.colour, lw=0.8, label="geodesic"),
    ]
    figure.legend(handles=handles, loc="lower left", ncols=3, frameon=False, fontsize=8)
    figure.savefig(path, dpi=100 if quick else 300)
    found = {"source": source.tolist(), "rays": len(p), "caustic_times": [float(when.min()), float(when.max())]}
    return drawing.rays_card(flow, error, float(times[-1]), **found)


def first_caustic(states: FloatArray, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """First zero of M12 on each ray: points (n, 3) and times (n,), from states (n, m, 10)."""
    points, found = [], []
    for one in states:
        zeros = CubicHermiteSpline(times, one[:, 8], one[:, 9]).roots(extrapolate=False)
        # that of the start left out
        found.append(zeros[zeros > 0.5 * times[1]][0])
        points.append(CubicHermiteSpline(times, one[:, :3], one[:, 3:6])(found[-1]))
    return np.array(points), np.array(found)


def fish_tails(
    ax: Any, points: FloatArray, levels: FloatArray, caustic: FloatArray, view: View, colours: LevelColours
) -> None:
    """Draw the circles around the caustic, the projection of the far side, on plane axes."""
    for k, level in enumerate(levels.tolist()):
        circle = closed(points[:, k])
        flat = np.where(view.visible(ELLIPSOID, circle)[:, None], view.project(circle), np.nan)
        chosen = level == FISH_TAIL
        ax.plot(*flat.T, color="black" if chosen else colours(level), lw=1.6 if chosen else 0.7, zorder=2 + chosen)
    ax.plot(*view.project(closed(caustic)).T, color=CAUSTIC_COLOUR, lw=1.4)
    low, high = view.frame(caustic, margin=0.06)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", xticks=[], yticks=[])
    for spine in ax.spines.values():
        spine.set_linewidth(0.5)


def torus(path: Path, quick: bool) -> dict[str, Any]:
    """Figure 4: geodesics from one point of the torus R = 1, r = 0.5, and their geodesic circles.

        x = ((R + r cos theta) cos psi, (R + r cos theta) sin psi, r sin theta)

    Rays leave a point of the outer equator, theta = psi = 0, in all directions. With rho = R + r cos theta, Clairaut's
    rho cos(angle to the parallel) = h is constant along each: rays with h > R - r turn back before the inner equator
    and cross the outer one again and again, the others wind around the tube.
    """
    source, drawn, last, seen = np.array([1.5, 0.0, 0.0]), 64, 3.0, view(-28, 42)
    flow = cr.build_phase_map(TORUS, tolerance=1e-4 if quick else 1e-6)
    p = drawing.directions_at(TORUS, source, drawing.turn(512 if quick else 2048))
    x, times = np.broadcast_to(source, p.shape), drawing.equal_times(STEP, 3.5)
    points, tangents = flow.flow(x, p, times)
    error = drawing.end_error(flow, x, p, np.concatenate([points[:, -1], tangents[:, -1]], axis=-1), times[-1])
    chosen = np.arange(4, round(last / STEP) + 1, 4)
    colours = LevelColours(float(times[chosen[0]]), last, "t")
    rings = drawing.circle_strokes(points[:, chosen], times[chosen], colours)
    rays = drawing.ray_stroke(TORUS, points, tangents, times, every=len(points) // drawn)
    figure = new_figure((9.6, 3.7))
    for left, strokes in ((0.0, [rays]), (0.46, rings)):
        ax = figure.add_axes((left, 0.02, 0.45, 0.90), projection="3d")
        drawing.draw_curves(TORUS, strokes, ax=ax, view=seen, source=source)
    drawing.panel(figure, "a", f"{drawn} geodesics from a point, length {times[-1]:g}", (0.01, 0.945))
    drawing.panel(figure, "b", f"geodesic circles of {len(p)} rays", (0.47, 0.945))
    drawing.add_level_bar(figure, colours, times[chosen], "length $t$", cax=figure.add_axes((0.935, 0.16, 0.014, 0.66)))
    figure.savefig(path, dpi=100 if quick else 300)
    return drawing.rays_card(flow, error, float(times[-1]), source=source.tolist(), rays=len(p))


def weighted(path: Path, quick: bool) -> dict[str, Any]:
    """Figure 5: weighted geodesics on the unit sphere with speed c = 1 + x, against the exact solution.

    Seen from (-1, 0, 0), with w = (y, z)/(1 + x), the sphere is a plane with ds = 2 |dw|/(1 + |w|^2) and
    1 + x = 2/(1 + |w|^2). So travel time is ds/c = |dw|: rays are straight lines, fronts are circles,

        w(t) = w0 + t (cos alpha, sin alpha),   x = (1 - |w|^2, 2 w_1, 2 w_2)/(1 + |w|^2)

    Direction is p = dx/dt / |dx/dt|. No ray reaches (-1, 0, 0) in finite time.
    """
    flow = cr.build_phase_map(WEIGHTED, tolerance=1e-4 if quick else 1e-6)
    angles, times, drawn = drawing.turn(256 if quick else 512), drawing.equal_times(STEP, 3.0), 32
    truth = np.concatenate(exact(angles, times), axis=-1)
    x, p = truth[:, 0, :3], truth[:, 0, 3:]
    points, tangents = flow.flow(x, p, times)
    found = np.concatenate([points, tangents], axis=-1)
    error = drawing.end_error(flow, x, p, found[:, -1], times[-1])
    off = np.linalg.norm(found - truth, axis=-1)
    levels = times[4::4]
    colours = LevelColours(float(levels[0]), float(times[-1]), "t")
    figure = new_figure((7.6, 3.5))
    rays = drawing.ray_stroke(WEIGHTED, points, tangents, times, every=len(points) // drawn)
    fronts = drawing.circle_strokes(points[:, np.searchsorted(times, levels)], levels, colours)
    ax = figure.add_axes((0.0, 0.03, 0.46, 0.88), projection="3d")
    drawing.draw_curves(WEIGHTED, [rays, *fronts], ax=ax, view=view(112, 30), source=from_plane(W0))
    w = points[..., 1:] / (1 + points[..., :1])
    in_plane(figure.add_axes((0.54, 0.13, 0.34, 0.77)), w, w[:: len(w) // drawn], times, levels, colours)
    drawing.panel(figure, "a", "on the sphere, $c = 1 + x$", (0.01, 0.935))
    drawing.panel(figure, "b", "in the stereographic plane; + exact solution", (0.49, 0.935))
    drawing.add_level_bar(figure, colours, levels, "travel time $t$", cax=figure.add_axes((0.915, 0.17, 0.018, 0.68)))
    figure.savefig(path, dpi=100 if quick else 300)
    card = drawing.rays_card(flow, error, float(times[-1]), source=from_plane(W0).tolist(), rays=len(angles))
    against = {"rms": float(np.sqrt(np.mean(off[:, -1] ** 2))), "max": float(off.max()), "samples": len(angles)}
    card["error"]["exact"] = against
    card["headline"] += f"; against the exact rays: rms {against['rms']:.1e}"
    return card


def from_plane(w: FloatArray) -> FloatArray:
    """Points of the sphere: (..., 2) -> (..., 3)."""
    square = np.sum(w * w, axis=-1, keepdims=True)
    return np.asarray(np.concatenate([1 - square, 2 * w], axis=-1) / (1 + square))


def exact(angles: FloatArray, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rays that leave w0 at the angles in the plane: points and unit tangents (n, m, 3)."""
    e = np.stack([np.cos(angles), np.sin(angles)], axis=-1)[:, None]
    w = W0 + times[:, None] * e
    square = np.sum(w * w, axis=-1, keepdims=True)
    along = np.sum(w * e, axis=-1, keepdims=True)
    # derivative of from_plane along e, up to the factor 2/(1 + |w|^2)^2
    velocity = np.concatenate([-2 * along, (1 + square) * e - 2 * along * w], axis=-1)
    return from_plane(w), velocity / np.linalg.norm(velocity, axis=-1, keepdims=True)


def in_plane(
    ax: Any, w: FloatArray, rays: FloatArray, times: FloatArray, levels: FloatArray, colours: LevelColours
) -> None:
    """Draw rays and fronts in the stereographic plane, computed lines over exact crosses."""
    for ray in rays:
        ax.plot(*ray.T, color=RAY_COLOUR, lw=0.5)
    some = drawing.turn(8)
    for number, level in enumerate(levels.tolist()):
        ax.plot(*closed(w[:, int(np.searchsorted(times, level))]).T, color=colours(level), lw=0.9)
        if number % 2:
            cross = W0 + level * np.stack([np.cos(some), np.sin(some)], axis=-1)
            ax.plot(*cross.T, "+", ms=5, mew=0.7, color="black")
    ax.plot(*W0, "o", ms=4, color=drawing.SOURCE_COLOUR, mec="white", mew=0.6, zorder=5)
    ax.set_aspect("equal")
    drawing.plain_ticks(ax)
    ax.set_xlabel("$y/(1 + x)$", fontsize=9)
    ax.set_ylabel("$z/(1 + x)$", fontsize=9)
