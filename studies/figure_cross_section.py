"""Monostatic creeping cross section over the sphere of directions: twisted and triaxial ellipsoid, soft, hard, PEC.

Colour is 4π|f|² of the creeping waves alone, dB re 1 L²; of a conductor the mean over incident polarisations of what
both receive. Maps are of equal area (Mollweide), by the direction in which the wave travels. Grey: the expansion fails
there, as the library says itself; dots: the number of curves of the shadow line is not certain.
"""

from pathlib import Path
from typing import Literal

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any, BoolArray, FloatArray
from creeping.field.comparison import cross_section_decibels
from creeping.geometry.directions import directions_from_angles, theta_phi_grid
from creeping.plotting.pictures import new_figure
from creeping.shadow.status import NEAR_SINGULAR, SINGULAR

BODIES: dict[str, Any] = {
    "twisted ellipsoid": sc.TwistedEllipsoid(),
    "ellipsoid 1, 0.8, 0.6": sc.Ellipsoid(1.0, 0.8, 0.6),
}
K = 15.0
BOUNDARIES: tuple[Literal["soft", "hard", "pec"], ...] = ("soft", "hard", "pec")
NAMES = {"soft": "soft", "hard": "hard", "pec": "conductor"}
SPAN = 30.0
"""Decibels of a colour bar, at most; a map has its own, since soft waves fall off by 50 dB more."""
CHECKED = 4
"""Directions whose field is computed again by the plain route."""
GREY = "#8a9096"


def cross_sections(found: Any) -> dict[str, FloatArray]:
    """Creeping cross section by boundary (n,), dB re 1 L²; -inf where no creeping wave returns."""
    # of a conductor half the sum of squares of the 2 x 2 matrix
    both = np.sqrt(0.5 * np.sum(np.abs(found["creeping_pec"].values[:, 0]) ** 2, axis=(-2, -1)))
    scalar = found["creeping"].values[:, :, 0]
    return {
        "soft": cross_section_decibels(scalar[:, 0]),
        "hard": cross_section_decibels(scalar[:, 1]),
        "pec": cross_section_decibels(both),
    }


def unresolved_of(found: Any) -> dict[str, BoolArray]:
    """Directions in which an expansion fails or nothing is known, by boundary (n,)."""
    missing = found["incidence_status"].values >= SINGULAR
    scalar = found["unresolved"].values[:, :, 0]
    return {
        "soft": missing | scalar[:, 0],
        "hard": missing | scalar[:, 1],
        "pec": missing | found["unresolved_pec"].values[:, 0],
    }


def agreement(found: Any, flow: Any, length: float, n_rays: int) -> dict[str, float]:
    """Largest differences, dB, to one incidence at a time by `shadow_line`, `launch`, `far_field`, where resolved."""
    rows = np.linspace(0, found.sizes["incidence"] - 1, CHECKED).astype(int)
    worst: dict[str, float] = dict.fromkeys(BOUNDARIES, 0.0)
    levels, bad = cross_sections(found), unresolved_of(found)
    for row in rows:
        d = found["direction"].values[row]
        fan = cr.launch(flow, cr.shadow_line(flow.body, d), length=length, n_rays=n_rays)
        for name in BOUNDARIES:
            far = cr.far_field(fan, -d, wavenumber=K, boundary=name, method="rays").creeping
            value = np.sqrt(0.5 * np.sum(np.abs(far) ** 2)) if name == "pec" else np.abs(far[0])
            gap = abs(float(cross_section_decibels(value)) - levels[name][row])
            if np.isfinite(gap) and not bad[name][row]:
                worst[name] = max(worst[name], gap)
    return worst


def grid(n_theta: int, n_phi: int) -> tuple[FloatArray, FloatArray]:
    """Directions in the middle of cells of a map, φ from -180 degrees and running fastest, and weights of sum 1."""
    theta = (np.arange(n_theta) + 0.5) * np.pi / n_theta
    phi = (np.arange(n_phi) + 0.5) * 2 * np.pi / n_phi - np.pi
    weights = theta_phi_grid(n_theta, n_phi)[1] / (4 * np.pi)
    return directions_from_angles(theta[:, None], phi).reshape(-1, 3), weights


def mean_level(levels: FloatArray, weights: FloatArray) -> float:
    """Mean cross section over directions (n,), dB."""
    return float(10 * np.log10(np.average(10 ** (levels / 10), weights=weights)))


def mirrored(levels: FloatArray, bad: BoolArray, shape: tuple[int, int]) -> dict[str, float]:
    """Differences, dB, between directions that x = 0 and z = 0 exchange, the planes of symmetry of both bodies.

    Where both are resolved, the largest and the share above 0.1; "one_sided" is the share resolved on one side only.
    """
    # nothing, -inf, is alike on both sides or very different
    L, ok = np.maximum(levels, -300.0).reshape(shape), ~bad.reshape(shape)
    largest, above, one_sided = 0.0, 0.0, 0.0
    i, j = np.indices(shape)
    for image in ((i, shape[1] // 2 - 1 - j), (-1 - i, j)):
        # of x: φ to π - φ, of z: θ to π - θ; indices below 0 count from the end
        there = ok[image]
        gap = np.where(ok & there, np.abs(L - L[image]), 0.0)
        largest = max(largest, float(gap.max()))
        above += 0.5 * float(np.mean(gap > 0.1))
        one_sided += 0.5 * float(np.mean(ok ^ there))
    return {"largest_dB": largest, "above_0.1_dB": above, "one_sided": one_sided}


def draw(path: Path, quick: bool) -> dict[str, Any]:
    """Write the figure and return its card."""
    shape = (10, 20) if quick else (90, 180)
    directions, weights = grid(*shape)
    maps: dict[str, Any] = {}
    cards: dict[str, dict[str, Any]] = {}
    for name, body in BODIES.items():
        flow = cr.DirectFlow(body, rtol=1e-6)
        found = cr.sweep_directions(flow, directions, wavenumbers=K, boundary=BOUNDARIES, n_rays=256)
        levels, bad = cross_sections(found), unresolved_of(found)
        near = found["incidence_status"].values == NEAR_SINGULAR
        maps[name] = levels, bad, near
        cards[name] = {
            "against_one_by_one_dB": agreement(found, flow, found.attrs["length"], 256),
            "mirrored": {b: mirrored(levels[b], bad[b], shape) for b in BOUNDARIES},
            "unresolved": {b: float(np.sum(weights * bad[b])) for b in BOUNDARIES},
            "without_return": {b: float(np.sum(weights * np.isneginf(levels[b]))) for b in BOUNDARIES},
            "near_singular": int(near.sum()),
            "mean_dB": {b: mean_level(levels[b][~bad[b]], weights[~bad[b]]) for b in BOUNDARIES},
            "highest_dB": {b: float(np.max(levels[b][~bad[b]])) for b in BOUNDARIES},
        }
    _picture(path, shape, maps, 100 if quick else 250)
    worst = max(max(card["against_one_by_one_dB"].values()) for card in cards.values())
    twisted = cards["twisted ellipsoid"]
    return {
        "parameters": {"bodies": [repr(b) for b in BODIES.values()], "wavenumber": K, "directions": list(shape)},
        "error": {"field": cards},
        "headline": f"{len(directions)} directions of each body; within {worst:.2g} dB of one by one; of the twisted "
        f"ellipsoid {100 * twisted['unresolved']['hard']:.1f} % unresolved, {twisted['near_singular']} near singular",
    }


def _picture(path: Path, shape: tuple[int, int], maps: dict[str, Any], dpi: int) -> None:
    from matplotlib.colors import ListedColormap
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    figure = new_figure((7.4, 6.6))
    phi = np.linspace(-np.pi, np.pi, shape[1] + 1)
    latitude = np.linspace(np.pi / 2, -np.pi / 2, shape[0] + 1)
    for row, boundary in enumerate(BOUNDARIES):
        for column, (name, (levels, bad, near)) in enumerate(maps.items()):
            # caustics that are not told, a few cells, must not set the range
            known = levels[boundary][~bad[boundary] & np.isfinite(levels[boundary])]
            high = float(np.quantile(known, 0.998))
            low = max(float(np.min(known)), high - SPAN)
            ax = figure.add_axes((0.05 + 0.49 * column, 0.705 - 0.305 * row, 0.36, 0.235), projection="mollweide")
            # nothing returns: the colour of what is below the range
            level = np.maximum(levels[boundary], low - 1).reshape(shape)
            drawn = ax.pcolormesh(phi, latitude, level, cmap="viridis", vmin=low, vmax=high, rasterized=True)
            hidden = np.ma.masked_where(~bad[boundary].reshape(shape), np.ones(shape))
            ax.pcolormesh(phi, latitude, hidden, cmap=ListedColormap([GREY]), rasterized=True)
            v, u = np.nonzero(near.reshape(shape))
            middle = 0.5 * (phi[u] + phi[u + 1]), 0.5 * (latitude[v] + latitude[v + 1])
            ax.plot(*middle, "o", ms=1.6, color="white", mec="black", mew=0.2)
            _angles(ax)
            ax.set_title(f"{'abcdef'[2 * row + column]}  {NAMES[boundary]}: {name}", fontsize=9, pad=4)
            bar = figure.add_axes((0.425 + 0.49 * column, 0.735 - 0.305 * row, 0.012, 0.175))
            figure.colorbar(drawn, cax=bar, extend="both")
            bar.tick_params(labelsize=7, direction="in", width=0.5, pad=2)
    handles: list[Any] = [Patch(color=GREY, label="unresolved or singular")]
    handles.append(Line2D([], [], ls="", marker=".", ms=6, mfc="white", mec="black", mew=0.4, label="near singular"))
    figure.legend(handles=handles, loc="lower left", ncols=2, frameon=False, fontsize=8, bbox_to_anchor=(0.03, 0.0))
    words = f"4π|f|² in dB re 1 L², k = {K:g}/L; θ up the side, φ along the middle"
    figure.text(0.98, 0.023, words, fontsize=8, ha="right", va="center")
    figure.savefig(path, dpi=dpi, format="png")


def _angles(ax: Any) -> None:
    """θ from z at the side, φ along the equator, both in degrees."""
    from matplotlib.patheffects import withStroke

    ax.set_xticks(
        np.radians([-120, -60, 0, 60, 120]), labels=["\N{MINUS SIGN}120°", "\N{MINUS SIGN}60°", "0°", "60°", "120°"]
    )
    ax.set_yticks(np.radians([60, 30, 0, -30, -60]), labels=["30°", "60°", "90°", "120°", "150°"])
    ax.tick_params(labelsize=7)
    # over the colours of the map: the grid tells enough of φ elsewhere
    for text in ax.get_xticklabels():
        text.set(color="white", path_effects=[withStroke(linewidth=1.2, foreground="black")])
    ax.grid(color="white", linewidth=0.3, alpha=0.5)
    ax.spines["geo"].set_linewidth(0.5)
