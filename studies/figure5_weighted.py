"""Figure 5: weighted geodesics on the unit sphere with speed c = 1 + x, against the exact solution.

Seen from (-1, 0, 0), with w = (y, z)/(1 + x), the sphere is a plane with ds = 2 |dw|/(1 + |w|^2) and
1 + x = 2/(1 + |w|^2). So travel time is ds/c = |dw|: rays are straight lines, fronts are circles,

    w(t) = w0 + t (cos alpha, sin alpha),   x = (1 - |w|^2, 2 w_1, 2 w_2)/(1 + |w|^2)

Direction is p = dx/dt / |dx/dt|. No ray reaches (-1, 0, 0) in finite time.
"""

from pathlib import Path

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any, FloatArray
from creeping.plotting._drawing import View
from creeping.plotting._strokes import RAY_COLOUR, LevelColours, closed
from studies._curves import SOURCE_COLOUR, add_level_bar, circle_strokes, draw_curves, equal_times, ray_stroke, turn
from studies._measured import end_error, error_card, headline, map_card

BODY = sc.Sphere(speed="1 + x")
W0 = np.array([0.0, 0.6])
VIEW = View(float(np.radians(112)), float(np.radians(30)))
RAYS = 512
DRAWN = 32
STEP = 1 / 16
LAST = 3.0


def from_plane(w: FloatArray) -> FloatArray:
    """Points of the sphere: (..., 2) -> (..., 3)."""
    square = np.sum(w * w, axis=-1, keepdims=True)
    return np.asarray(np.concatenate([1 - square, 2 * w], axis=-1) / (1 + square))


def to_plane(points: FloatArray) -> FloatArray:
    """Stereographic image: (..., 3) -> (..., 2)."""
    return np.asarray(points[..., 1:] / (1 + points[..., :1]))


def exact(angles: FloatArray, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Rays that leave w0 at the angles in the plane: points and unit tangents (n, m, 3)."""
    e = np.stack([np.cos(angles), np.sin(angles)], axis=-1)[:, None]
    w = W0 + times[:, None] * e
    square = np.sum(w * w, axis=-1, keepdims=True)
    along = np.sum(w * e, axis=-1, keepdims=True)
    # derivative of from_plane along e, up to the factor 2/(1 + |w|^2)^2
    velocity = np.concatenate([-2 * along, (1 + square) * e - 2 * along * w], axis=-1)
    return from_plane(w), velocity / np.linalg.norm(velocity, axis=-1, keepdims=True)


def on_sphere(
    ax: Any, points: FloatArray, tangents: FloatArray, times: FloatArray, levels: FloatArray, colours: LevelColours
) -> None:
    """Draw rays and iso-travel-time curves on the sphere."""
    rays = ray_stroke(BODY, points, tangents, times, every=len(points) // DRAWN)
    fronts = circle_strokes(points[:, np.searchsorted(times, levels)], levels, colours)
    draw_curves(BODY, [rays, *fronts], ax=ax, view=VIEW, source=from_plane(W0))


def in_plane(ax: Any, points: FloatArray, times: FloatArray, levels: FloatArray, colours: LevelColours) -> None:
    """Draw the same in the stereographic plane, computed lines over exact crosses."""
    w = to_plane(points)
    for ray in w[:: len(w) // DRAWN]:
        ax.plot(*ray.T, color=RAY_COLOUR, lw=0.5)
    some = turn(8)
    for number, level in enumerate(levels.tolist()):
        ax.plot(*closed(w[:, int(np.searchsorted(times, level))]).T, color=colours(level), lw=0.9)
        if number % 2:
            cross = W0 + level * np.stack([np.cos(some), np.sin(some)], axis=-1)
            ax.plot(*cross.T, "+", ms=5, mew=0.7, color="black")
    ax.plot(*W0, "o", ms=4, color=SOURCE_COLOUR, mec="white", mew=0.6, zorder=5)
    ax.set_aspect("equal")
    ax.tick_params(labelsize=8, direction="in", top=True, right=True, width=0.5)
    ax.set_xlabel("$y/(1 + x)$", fontsize=9)
    ax.set_ylabel("$z/(1 + x)$", fontsize=9)


def draw(path: Path, quick: bool) -> dict[str, Any]:
    """Write the figure and return its card."""
    from matplotlib.figure import Figure

    flow = cr.build_phase_map(BODY, tolerance=1e-4 if quick else 1e-6)
    angles = turn(RAYS // 2 if quick else RAYS)
    times = equal_times(STEP, LAST)
    truth = np.concatenate(exact(angles, times), axis=-1)
    x, p = truth[:, 0, :3], truth[:, 0, 3:]
    points, tangents = flow.flow(x, p, times)
    found = np.concatenate([points, tangents], axis=-1)
    error = end_error(flow, x, p, found[:, -1], LAST)
    off = np.linalg.norm(found - truth, axis=-1)
    against_exact = {"rms": float(np.sqrt(np.mean(off[:, -1] ** 2))), "max": float(off.max()), "samples": len(angles)}
    levels = times[4::4]
    colours = LevelColours(float(levels[0]), LAST, "t")
    figure = Figure(figsize=(7.6, 3.5), facecolor="white")
    on_sphere(figure.add_axes((0.0, 0.03, 0.46, 0.88), projection="3d"), points, tangents, times, levels, colours)
    ax = figure.add_axes((0.54, 0.13, 0.34, 0.77))
    in_plane(ax, points, times, levels, colours)
    figure.text(0.01, 0.935, r"$\bf{a}$  on the sphere, $c = 1 + x$", fontsize=9)
    figure.text(0.49, 0.935, r"$\bf{b}$  in the stereographic plane; + exact solution", fontsize=9)
    add_level_bar(figure, colours, levels, "travel time $t$", cax=figure.add_axes((0.915, 0.17, 0.018, 0.68)))
    figure.savefig(path, dpi=100 if quick else 300)
    return {
        "parameters": {"body": repr(BODY), "source": from_plane(W0).tolist(), "rays": len(angles), "time": LAST}
        | map_card(flow),
        "error": error_card(flow, error) | {"exact": against_exact},
        "headline": headline(flow, error, LAST) + f"; against the exact rays: rms {against_exact['rms']:.1e}",
    }
