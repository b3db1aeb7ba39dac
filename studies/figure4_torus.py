"""Figure 4: geodesics from one point of the torus R = 1, r = 0.5, and their geodesic circles.

    x = ((R + r cos theta) cos psi, (R + r cos theta) sin psi, r sin theta)

Rays leave a point of the outer equator, theta = psi = 0, in all directions. With rho = R + r cos theta, Clairaut's
rho cos(angle to the parallel) = h is constant along each: rays with h > R - r turn back before the inner equator and
cross the outer one again and again, the others wind around the tube.
"""

from pathlib import Path

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any, FloatArray
from creeping.plotting._drawing import View
from creeping.plotting._strokes import LevelColours
from studies._curves import add_level_bar, circle_strokes, directions_at, draw_curves, equal_times, ray_stroke, turn
from studies._measured import end_error, error_card, headline, map_card

BODY = sc.Torus(R=1.0, r=0.5)
SOURCE = np.array([1.5, 0.0, 0.0])
VIEW = View(float(np.radians(-28)), float(np.radians(42)))
RAYS = 2048
DRAWN = 64
STEP = 1 / 16
FAN_LENGTH = 3.5
LAST = 3.0


def fan_from_point(ax: Any, points: FloatArray, tangents: FloatArray, times: FloatArray) -> None:
    """Draw some of the rays (rays, steps, 3) on the torus."""
    stroke = ray_stroke(BODY, points, tangents, times, every=len(points) // DRAWN)
    draw_curves(BODY, [stroke], ax=ax, view=VIEW, source=SOURCE)


def circles(ax: Any, points: FloatArray, levels: FloatArray, colours: LevelColours) -> None:
    """Draw the geodesic circles (rays, levels, 3) on the torus."""
    draw_curves(BODY, circle_strokes(points, levels, colours), ax=ax, view=VIEW, source=SOURCE)


def draw(path: Path, quick: bool) -> dict[str, Any]:
    """Write the figure and return its card."""
    from matplotlib.figure import Figure

    flow = cr.build_phase_map(BODY, tolerance=1e-4 if quick else 1e-6)
    rays = RAYS // 4 if quick else RAYS
    p = directions_at(BODY, SOURCE, turn(rays))
    times = equal_times(STEP, FAN_LENGTH)
    points, tangents = flow.flow(np.broadcast_to(SOURCE, p.shape), p, times)
    ends = np.concatenate([points[:, -1], tangents[:, -1]], axis=-1)
    error = end_error(flow, np.broadcast_to(SOURCE, p.shape), p, ends, FAN_LENGTH)
    chosen = np.arange(4, round(LAST / STEP) + 1, 4)
    colours = LevelColours(float(times[chosen[0]]), LAST, "t")
    figure = Figure(figsize=(9.6, 3.7), facecolor="white")
    fan_from_point(figure.add_axes((0.0, 0.02, 0.45, 0.90), projection="3d"), points, tangents, times)
    circles(figure.add_axes((0.46, 0.02, 0.45, 0.90), projection="3d"), points[:, chosen], times[chosen], colours)
    figure.text(0.01, 0.945, rf"$\bf{{a}}$  {DRAWN} geodesics from a point, length {FAN_LENGTH:g}", fontsize=9)
    figure.text(0.47, 0.945, rf"$\bf{{b}}$  geodesic circles of {rays} rays", fontsize=9)
    add_level_bar(figure, colours, times[chosen], "length $t$", cax=figure.add_axes((0.935, 0.16, 0.014, 0.66)))
    figure.savefig(path, dpi=100 if quick else 300)
    return {
        "parameters": {"body": repr(BODY), "source": SOURCE.tolist(), "rays": rays, "time": FAN_LENGTH}
        | map_card(flow),
        "error": error_card(flow, error),
        "headline": headline(flow, error, FAN_LENGTH),
    }
