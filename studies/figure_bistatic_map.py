"""Bistatic cross section of hard ellipsoids, plain and twisted, incidence and observation all round one great circle.

A row of a map is one incidence; the bright diagonal is the forward lobe. Reciprocity, f(d, r) = f(-r, -d), exchanges
points of a map by pairs, and is what the field is judged by: nothing in the formulas of the parts imposes it.
"""

from pathlib import Path

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any, BoolArray, ComplexArray, FloatArray
from creeping.field.comparison import cross_section_decibels
from creeping.geometry.directions import great_circle
from creeping.plotting.pictures import new_figure

CASES: dict[str, tuple[Any, tuple[float, float, float], str]] = {
    "ellipsoid 1, 0.8, 0.6": (sc.Ellipsoid(1.0, 0.8, 0.6), (1, 1, 0), "x + y"),
    "twisted ellipsoid": (sc.TwistedEllipsoid(), (0, 1, 0), "y"),
}
"""Body, and where the circle from z passes: for the twisted one in the plane in which it is bent."""
K = 20.0
SPAN = 50.0
GREY = (0.60, 0.62, 0.64)


def circle(through: tuple[float, float, float], n: int) -> FloatArray:
    """Directions (n, 3) in the middle of n equal cells of the circle from z: none along z, which is singular."""
    return great_circle((0, 0, 1), through, n, start=np.pi / n, stop=(2 + 1 / n) * np.pi)


def reciprocal(values: Any) -> Any:
    """Values (n, n) at (d, r) -> those at (-r, -d): angles α, β of both become β + 180 and α + 180 degrees."""
    half = len(values) // 2
    return np.roll(values.T, (half, half), axis=(0, 1))


def reciprocity(total: ComplexArray, resolved: BoolArray) -> dict[str, float]:
    """Differences of f to that of the reciprocal directions, where both are resolved.

    Incidences (n) are in the middle of an odd number m/n of the observers (m). Relative to the mean of both |f|, and
    the largest to the largest |f| of the map.
    """
    n, m = total.shape
    mine = slice(m // n // 2, None, m // n)
    here, ok = total[:, mine], resolved[:, mine]
    there, ok = reciprocal(here), ok & reciprocal(ok)
    # each pair once, and not those that are their own partners: backscatter
    own = np.arange(n * n).reshape(n, n)
    ok = ok & (own < reciprocal(own))
    gap = np.abs(here - there)[ok]
    relative = gap / (0.5 * (np.abs(here) + np.abs(there))[ok])
    return {
        "pairs": int(ok.sum()),
        "median_relative": float(np.median(relative)),
        "ninetieth_percentile_relative": float(np.quantile(relative, 0.9)),
        "above_tenth": float(np.mean(relative > 0.1)),
        "largest_over_largest": float(gap.max() / np.nanmax(np.abs(total))),
        "unresolved": float(np.mean(~resolved)),
    }


def bistatic(name: str, rows: int, columns: int) -> tuple[ComplexArray, BoolArray]:
    """Field (rows, columns), and whether it is resolved; NaN along the row of an incidence that is singular."""
    body, through, _ = CASES[name]
    found = cr.sweep_directions(
        cr.DirectFlow(body, rtol=1e-6),
        circle(through, rows),
        quantity="bistatic",
        observation=circle(through, columns),
        wavenumbers=K,
        boundary="hard",
    )
    total = found["total"].values[:, 0, 0]
    return total, ~found["unresolved"].values[:, 0, 0] & np.isfinite(total)


def draw(path: Path, quick: bool) -> dict[str, Any]:
    """Write the figure and return its card."""
    rows, columns = (4, 36) if quick else (72, 360)
    found = {name: bistatic(name, rows, columns) for name in CASES}
    cards = {name: reciprocity(*one) for name, one in found.items()}
    _picture(path, found, 100 if quick else 250)
    words = [f"{100 * card['median_relative']:.2g} % of {card['pairs']:.0f} pairs" for card in cards.values()]
    return {
        "parameters": {
            "bodies": [repr(case[0]) for case in CASES.values()],
            "wavenumber": K,
            "boundary": "hard",
            "incidences": rows,
            "observers": columns,
        },
        "error": {"field": cards},
        "headline": f"reciprocity (median of |f|): {', '.join(words)}; unresolved "
        + " and ".join(f"{100 * card['unresolved']:.0f} %" for card in cards.values()),
    }


def _picture(path: Path, found: dict[str, tuple[ComplexArray, BoolArray]], dpi: int) -> None:
    from matplotlib.patches import Patch

    levels = {name: cross_section_decibels(total) for name, (total, _) in found.items()}
    high = 5 * np.ceil(max(float(np.nanmax(one)) for one in levels.values()) / 5)
    figure = new_figure((7.2, 4.1))
    box: dict[str, Any] = {"extent": (0, 360, 0, 360), "origin": "lower", "interpolation": "nearest", "aspect": "equal"}
    for column, (name, (total, resolved)) in enumerate(found.items()):
        ax = figure.add_axes((0.075 + 0.43 * column, 0.17, 0.39, 0.72))
        shown = np.maximum(levels[name], high - SPAN - 1)
        drawn = ax.imshow(shown, cmap="viridis", vmin=high - SPAN, vmax=high, **box)
        veil = np.concatenate([np.broadcast_to(GREY, (*total.shape, 3)), 0.75 * ~resolved[..., None]], axis=2)
        ax.imshow(veil, **box)
        ax.set_xticks(range(0, 361, 90))
        ax.set_yticks(range(0, 361, 90))
        ax.set_xlabel(f"observation, from z towards {CASES[name][2]} (degrees)", fontsize=9)
        ax.set_title(f"{'ab'[column]}  {name}", fontsize=9, loc="left")
        ax.tick_params(labelsize=8, direction="in", width=0.5)
    figure.axes[0].set_ylabel("incidence: where the wave travels (degrees)", fontsize=9)
    bar = figure.add_axes((0.92, 0.205, 0.018, 0.65))
    figure.colorbar(drawn, cax=bar, extend="min")
    bar.set_title("dB re 1 L²", fontsize=8, pad=8)
    bar.tick_params(labelsize=8, direction="in", width=0.5)
    figure.legend(
        handles=[Patch(color=GREY, label="veiled: unresolved")],
        loc="lower left",
        bbox_to_anchor=(0.06, 0.0),
        frameon=False,
        fontsize=8,
    )
    figure.text(0.98, 0.03, f"4π|f|$^2$, hard, k = {K:g}/L", fontsize=8, ha="right")
    figure.savefig(path, dpi=dpi, format="png")
