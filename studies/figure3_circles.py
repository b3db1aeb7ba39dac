"""Figure 3: geodesic circles on the ellipsoid 1.2, 0.8, 0.8, and their fish-tails behind the caustic.

From one point y, 1024 rays (y, p(alpha)) are carried by the phase map; the geodesic circle of radius t is

    alpha -> x(t; y, p(alpha))

Past the conjugate locus, where the reduced length M12(t, alpha) vanishes for the first time, the circles have cusps on
it and cross themselves. M12 is carried along the rays (M12(0) = 0, M12'(0) = 1); its zero is found on the cubic between
two times. The source is at (0.8, 0.4, 0.45) before scaling by the half-axes, brought to the unit sphere.
"""

from pathlib import Path

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any, FloatArray
from creeping.geodesics.states import pack
from creeping.plotting._drawing import View
from creeping.plotting._strokes import LevelColours, Stroke, closed
from studies._curves import add_level_bar, circle_strokes, directions_at, draw_curves, equal_times, ray_stroke, turn
from studies._measured import end_error, error_card, headline, map_card

BODY = sc.Ellipsoid(1.2, 0.8, 0.8)
SOURCE = BODY.forward(np.array([0.8, 0.4, 0.45]) / np.linalg.norm([0.8, 0.4, 0.45]))
ANGLES = 1024
STEP = 1 / 16
LAST = 4.0
FISH_TAIL = 2.75
CAUSTIC_COLOUR = "#d32f2f"


def first_caustic(states: FloatArray, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """First zero of M12 on each ray: points (n, 3) and times (n,), from states (n, m, 10)."""
    m12 = states[..., 8]
    before = np.argmax((m12[:, 1:-1] > 0) & (m12[:, 2:] <= 0), axis=1) + 1
    rows = np.arange(len(states))
    left, right = states[rows, before], states[rows, before + 1]
    h = times[before + 1] - times[before]

    def hermite(
        s: FloatArray, values: FloatArray, rates: FloatArray, ends: FloatArray, end_rates: FloatArray
    ) -> FloatArray:
        m0, m1 = h * rates, h * end_rates
        cubic = m0 + s * (3 * (ends - values) - 2 * m0 - m1 + s * (2 * (values - ends) + m0 + m1))
        return np.asarray(values + s * cubic)

    # the zero is simple: bisection on the cubic cannot miss it
    low, high = np.zeros(len(rows)), np.ones(len(rows))
    for _ in range(40):
        middle = 0.5 * (low + high)
        positive = hermite(middle, left[:, 8], left[:, 9], right[:, 8], right[:, 9]) > 0
        low, high = np.where(positive, middle, low), np.where(positive, high, middle)
    points = np.stack(
        [hermite(low, left[:, k], left[:, k + 3], right[:, k], right[:, k + 3]) for k in range(3)], axis=-1
    )
    return points, times[before] + low * h


def on_body(ax: Any, strokes: list[Stroke], view: View) -> None:
    """Draw the curves on the body."""
    draw_curves(BODY, strokes, ax=ax, view=view, source=SOURCE)


def fish_tails(
    ax: Any, points: FloatArray, levels: FloatArray, caustic: FloatArray, view: View, colours: LevelColours
) -> None:
    """Draw the circles around the caustic, the projection of the far side, on plane axes."""
    for k, level in enumerate(levels.tolist()):
        circle = closed(points[:, k])
        flat = np.where(view.visible(BODY, circle)[:, None], view.project(circle), np.nan)
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


def draw(path: Path, quick: bool) -> dict[str, Any]:
    """Write the figure and return its card."""
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

    flow = cr.build_phase_map(BODY, tolerance=1e-4 if quick else 1e-6)
    rays = ANGLES // 4 if quick else ANGLES
    p = directions_at(BODY, SOURCE, turn(rays))
    x = np.broadcast_to(SOURCE, p.shape)
    times = equal_times(STEP, LAST)
    states = flow.transport(pack(x, p, jacobi=True), times)
    error = end_error(flow, x, p, states[:, -1, :6], LAST)
    caustic, when = first_caustic(states, times)
    figure = Figure(figsize=(9.6, 3.3), facecolor="white")
    coarse = np.arange(4, len(times), 4)
    fine = np.arange(2 * int(when.min() / STEP / 2), len(times), 2)
    colours = LevelColours(float(times[4]), LAST, "t")
    tail = Stroke([closed(states[:, round(FISH_TAIL / STEP), :3])], "#000000", 1.4, rank=2)
    circles = circle_strokes(states[:, coarse, :3], times[coarse], colours)
    some = ray_stroke(BODY, states[..., :3], states[..., 3:6], times, every=rays // 32)
    red = Stroke([closed(caustic)], CAUSTIC_COLOUR, 1.4, rank=3)
    near = View(float(np.radians(20)), float(np.radians(22)))
    far = View(near.azimuth + np.pi + 0.15, float(np.radians(-18)))
    on_body(figure.add_axes((0.0, 0.08, 0.31, 0.82), projection="3d"), [some, *circles, red], near)
    on_body(figure.add_axes((0.31, 0.08, 0.31, 0.82), projection="3d"), [*circles, tail, red], far)
    ax = figure.add_axes((0.64, 0.10, 0.26, 0.80))
    fish_tails(ax, states[:, fine, :3], times[fine], caustic, far, colours)
    for left, letter, text in (
        (0.01, "a", "from the source: rays and circles"),
        (0.32, "b", "the far side"),
        (0.64, "c", "fish-tails behind the caustic"),
    ):
        figure.text(left, 0.94, rf"$\bf{{{letter}}}$  {text}", fontsize=9)
    add_level_bar(figure, colours, times[coarse], "length $t$", cax=figure.add_axes((0.925, 0.14, 0.014, 0.70)))
    figure.legend(
        handles=[
            Line2D([], [], color=CAUSTIC_COLOUR, lw=1.4, label="first caustic (conjugate locus)"),
            Line2D([], [], color="black", lw=1.6, label=f"circle $t$ = {FISH_TAIL:g}"),
            Line2D([], [], color=some.colour, lw=0.8, label="geodesic"),
        ],
        loc="lower left",
        ncols=3,
        frameon=False,
        fontsize=8,
    )
    figure.savefig(path, dpi=100 if quick else 300)
    return {
        "parameters": {
            "body": repr(BODY),
            "source": SOURCE.tolist(),
            "rays": rays,
            "time": LAST,
            "caustic_times": [float(when.min()), float(when.max())],
        }
        | map_card(flow),
        "error": error_card(flow, error),
        "headline": headline(flow, error, LAST),
    }
