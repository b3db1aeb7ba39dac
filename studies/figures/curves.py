"""Geodesics from one point, carried by a phase map, and their wavefronts: Figures 3, 4 and 5."""

from pathlib import Path

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any, FloatArray
from creeping.geodesics.states import pack
from creeping.plotting._drawing import View
from creeping.plotting._strokes import RAY_COLOUR, LevelColours, Stroke, closed
from studies.figures.drawing import (
    SOURCE_COLOUR,
    add_level_bar,
    circle_strokes,
    directions_at,
    draw_curves,
    end_error,
    equal_times,
    panel,
    plain_ticks,
    ray_stroke,
    rays_card,
    turn,
)

STEP = 1 / 16
ELLIPSOID, TORUS, WEIGHTED = sc.Ellipsoid(1.2, 0.8, 0.8), sc.Torus(R=1.0, r=0.5), sc.Sphere(speed="1 + x")
FISH_TAIL = 2.75
CAUSTIC_COLOUR = "#d32f2f"
W0 = np.array([0.0, 0.6])
"""Source in the stereographic plane."""


def view(azimuth: float, elevation: float) -> View:
    """View from angles in degrees."""
    return View(float(np.radians(azimuth)), float(np.radians(elevation)))


def circles(path: Path, quick: bool) -> dict[str, Any]:
    """Figure 3: geodesic circles on the ellipsoid 1.2, 0.8, 0.8, and their fish-tails behind the caustic.

    From one point y, 1024 rays (y, p(alpha)) are carried by the phase map; the geodesic circle of radius t is

        alpha -> x(t; y, p(alpha))

    Past the conjugate locus, where the reduced length M12(t, alpha) vanishes for the first time, the circles have cusps
    on it and cross themselves. M12 is carried along the rays (M12(0) = 0, M12'(0) = 1); its zero is found on the cubic
    between two times. The source is at (0.8, 0.4, 0.45) before scaling by the half-axes, brought to the unit sphere.
    """
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    source = ELLIPSOID.forward(np.array([0.8, 0.4, 0.45]) / np.linalg.norm([0.8, 0.4, 0.45]))
    flow = cr.build_phase_map(ELLIPSOID, tolerance=1e-4 if quick else 1e-6)
    p = directions_at(ELLIPSOID, source, turn(256 if quick else 1024))
    x, times = np.broadcast_to(source, p.shape), equal_times(STEP, 4.0)
    states = flow.transport(pack(x, p, jacobi=True), times)
    error = end_error(flow, x, p, states[:, -1, :6], times[-1])
    caustic, when = first_caustic(states, times)
    coarse = np.arange(4, len(times), 4)
    fine = np.arange(2 * int(when.min() / STEP / 2), len(times), 2)
    colours = LevelColours(float(times[4]), float(times[-1]), "t")
    tail = Stroke([closed(states[:, round(FISH_TAIL / STEP), :3])], "#000000", 1.4, rank=2)
    rings = circle_strokes(states[:, coarse, :3], times[coarse], colours)
    some = ray_stroke(ELLIPSOID, states[..., :3], states[..., 3:6], times, every=len(p) // 32)
    red = Stroke([closed(caustic)], CAUSTIC_COLOUR, 1.4, rank=3)
    near = view(20, 22)
    far = View(near.azimuth + np.pi + 0.15, float(np.radians(-18)))
    figure = Figure(figsize=(9.6, 3.3), facecolor="white")
    for left, strokes, seen in ((0.0, [some, *rings, red], near), (0.31, [*rings, tail, red], far)):
        ax = figure.add_axes((left, 0.08, 0.31, 0.82), projection="3d")
        draw_curves(ELLIPSOID, strokes, ax=ax, view=seen, source=source)
    fish_tails(figure.add_axes((0.64, 0.10, 0.26, 0.80)), states[:, fine, :3], times[fine], caustic, far, colours)
    panel(figure, "a", "from the source: rays and circles", (0.01, 0.94))
    panel(figure, "b", "the far side", (0.32, 0.94))
    panel(figure, "c", "fish-tails behind the caustic", (0.64, 0.94))
    add_level_bar(figure, colours, times[coarse], "length $t$", cax=figure.add_axes((0.925, 0.14, 0.014, 0.70)))
    handles = [
        Line2D([], [], color=CAUSTIC_COLOUR, lw=1.4, label="first caustic (conjugate locus)"),
        Line2D([], [], color="black", lw=1.6, label=f"circle $t$ = {FISH_TAIL:g}"),
        Line2D([], [], color=some.colour, lw=0.8, label="geodesic"),
    ]
    figure.legend(handles=handles, loc="lower left", ncols=3, frameon=False, fontsize=8)
    figure.savefig(path, dpi=100 if quick else 300)
    found = {"source": source.tolist(), "rays": len(p), "caustic_times": [float(when.min()), float(when.max())]}
    return rays_card(flow, error, float(times[-1]), **found)


def first_caustic(states: FloatArray, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """First zero of M12 on each ray: points (n, 3) and times (n,), from states (n, m, 10)."""
    m12 = states[..., 8]
    before = np.argmax((m12[:, 1:-1] > 0) & (m12[:, 2:] <= 0), axis=1) + 1
    rows = np.arange(len(states))
    left, right = states[rows, before], states[rows, before + 1]
    h = times[before + 1] - times[before]

    def hermite(s: FloatArray, lane: int, rate: int) -> FloatArray:
        a, b, m0, m1 = left[:, lane], right[:, lane], h * left[:, rate], h * right[:, rate]
        return np.asarray(a + s * (m0 + s * (3 * (b - a) - 2 * m0 - m1 + s * (2 * (a - b) + m0 + m1))))

    # the zero is simple: bisection on the cubic cannot miss it
    low, high = np.zeros(len(rows)), np.ones(len(rows))
    for _ in range(40):
        middle = 0.5 * (low + high)
        positive = hermite(middle, 8, 9) > 0
        low, high = np.where(positive, middle, low), np.where(positive, high, middle)
    points = np.stack([hermite(low, k, k + 3) for k in range(3)], axis=-1)
    return points, times[before] + low * h


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
    ax.set_xlim(low[0], high[0])
    ax.set_ylim(low[1], high[1])
    ax.set_aspect("equal")
    ax.set_xticks([])
    ax.set_yticks([])
    for spine in ax.spines.values():
        spine.set_linewidth(0.5)


def torus(path: Path, quick: bool) -> dict[str, Any]:
    """Figure 4: geodesics from one point of the torus R = 1, r = 0.5, and their geodesic circles.

        x = ((R + r cos theta) cos psi, (R + r cos theta) sin psi, r sin theta)

    Rays leave a point of the outer equator, theta = psi = 0, in all directions. With rho = R + r cos theta, Clairaut's
    rho cos(angle to the parallel) = h is constant along each: rays with h > R - r turn back before the inner equator
    and cross the outer one again and again, the others wind around the tube.
    """
    from matplotlib.figure import Figure

    source, drawn, last, seen = np.array([1.5, 0.0, 0.0]), 64, 3.0, view(-28, 42)
    flow = cr.build_phase_map(TORUS, tolerance=1e-4 if quick else 1e-6)
    p = directions_at(TORUS, source, turn(512 if quick else 2048))
    x, times = np.broadcast_to(source, p.shape), equal_times(STEP, 3.5)
    points, tangents = flow.flow(x, p, times)
    error = end_error(flow, x, p, np.concatenate([points[:, -1], tangents[:, -1]], axis=-1), times[-1])
    chosen = np.arange(4, round(last / STEP) + 1, 4)
    colours = LevelColours(float(times[chosen[0]]), last, "t")
    rings = circle_strokes(points[:, chosen], times[chosen], colours)
    figure = Figure(figsize=(9.6, 3.7), facecolor="white")
    for left, strokes in (
        (0.0, [ray_stroke(TORUS, points, tangents, times, every=len(points) // drawn)]),
        (0.46, rings),
    ):
        ax = figure.add_axes((left, 0.02, 0.45, 0.90), projection="3d")
        draw_curves(TORUS, strokes, ax=ax, view=seen, source=source)
    panel(figure, "a", f"{drawn} geodesics from a point, length {times[-1]:g}", (0.01, 0.945))
    panel(figure, "b", f"geodesic circles of {len(p)} rays", (0.47, 0.945))
    add_level_bar(figure, colours, times[chosen], "length $t$", cax=figure.add_axes((0.935, 0.16, 0.014, 0.66)))
    figure.savefig(path, dpi=100 if quick else 300)
    return rays_card(flow, error, float(times[-1]), source=source.tolist(), rays=len(p))


def weighted(path: Path, quick: bool) -> dict[str, Any]:
    """Figure 5: weighted geodesics on the unit sphere with speed c = 1 + x, against the exact solution.

    Seen from (-1, 0, 0), with w = (y, z)/(1 + x), the sphere is a plane with ds = 2 |dw|/(1 + |w|^2) and
    1 + x = 2/(1 + |w|^2). So travel time is ds/c = |dw|: rays are straight lines, fronts are circles,

        w(t) = w0 + t (cos alpha, sin alpha),   x = (1 - |w|^2, 2 w_1, 2 w_2)/(1 + |w|^2)

    Direction is p = dx/dt / |dx/dt|. No ray reaches (-1, 0, 0) in finite time.
    """
    from matplotlib.figure import Figure

    flow = cr.build_phase_map(WEIGHTED, tolerance=1e-4 if quick else 1e-6)
    angles, times, drawn = turn(256 if quick else 512), equal_times(STEP, 3.0), 32
    truth = np.concatenate(exact(angles, times), axis=-1)
    x, p = truth[:, 0, :3], truth[:, 0, 3:]
    points, tangents = flow.flow(x, p, times)
    found = np.concatenate([points, tangents], axis=-1)
    error = end_error(flow, x, p, found[:, -1], times[-1])
    off = np.linalg.norm(found - truth, axis=-1)
    levels = times[4::4]
    colours = LevelColours(float(levels[0]), float(times[-1]), "t")
    figure = Figure(figsize=(7.6, 3.5), facecolor="white")
    rays = ray_stroke(WEIGHTED, points, tangents, times, every=len(points) // drawn)
    fronts = circle_strokes(points[:, np.searchsorted(times, levels)], levels, colours)
    ax = figure.add_axes((0.0, 0.03, 0.46, 0.88), projection="3d")
    draw_curves(WEIGHTED, [rays, *fronts], ax=ax, view=view(112, 30), source=from_plane(W0))
    w = points[..., 1:] / (1 + points[..., :1])
    in_plane(figure.add_axes((0.54, 0.13, 0.34, 0.77)), w, w[:: len(w) // drawn], times, levels, colours)
    panel(figure, "a", "on the sphere, $c = 1 + x$", (0.01, 0.935))
    panel(figure, "b", "in the stereographic plane; + exact solution", (0.49, 0.935))
    add_level_bar(figure, colours, levels, "travel time $t$", cax=figure.add_axes((0.915, 0.17, 0.018, 0.68)))
    figure.savefig(path, dpi=100 if quick else 300)
    card = rays_card(flow, error, float(times[-1]), source=from_plane(W0).tolist(), rays=len(angles))
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
    some = turn(8)
    for number, level in enumerate(levels.tolist()):
        ax.plot(*closed(w[:, int(np.searchsorted(times, level))]).T, color=colours(level), lw=0.9)
        if number % 2:
            cross = W0 + level * np.stack([np.cos(some), np.sin(some)], axis=-1)
            ax.plot(*cross.T, "+", ms=5, mew=0.7, color="black")
    ax.plot(*W0, "o", ms=4, color=SOURCE_COLOUR, mec="white", mew=0.6, zorder=5)
    ax.set_aspect("equal")
    plain_ticks(ax)
    ax.set_xlabel("$y/(1 + x)$", fontsize=9)
    ax.set_ylabel("$z/(1 + x)$", fontsize=9)
