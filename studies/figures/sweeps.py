"""Cross sections of sweeps: over all directions, over circles of incidence and observer, and over frequency."""

from pathlib import Path
from typing import Literal

import numpy as np
from scipy.interpolate import CubicSpline

import creeping as cr
import scatterers as sc
from creeping._typing import Any, BoolArray, ComplexArray, FloatArray
from creeping.field.results.comparison import cross_section_decibels
from creeping.geometry.directions import directions_from_angles, great_circle, theta_phi_grid
from creeping.plotting.pages import COLOURS, EXACT, new_figure
from creeping.shadow.status import LineStatus
from studies.figures.drawing import plain_ticks
from tests.reference import sphere

BODIES: dict[str, tuple[Any, tuple[float, float, float], str]] = {
    "twisted ellipsoid": (sc.TwistedEllipsoid(), (0, 1, 0), "y"),
    "ellipsoid 1, 0.8, 0.6": (sc.Ellipsoid(1.0, 0.8, 0.6), (1, 1, 0), "x + y"),
}
"""Body, and where the circle from z passes: for the twisted one in the plane in which it is bent."""
BOUNDARIES: tuple[Literal["soft", "hard", "pec"], ...] = ("soft", "hard", "pec")
K = 15.0
BISTATIC_K = 20.0
GREY = "#8a9096"
PANELS = (5.0, 30.0, 100.0)
"""Values of ka at the ends of the panels."""


def cross_section(path: Path, quick: bool) -> dict[str, Any]:
    """Monostatic creeping cross section over the sphere of directions: twisted and triaxial ellipsoid, soft, hard, PEC.

    Colour is 4π|f|² of the creeping waves alone, dB re 1 L²; of a conductor the mean over incident polarisations of
    what both receive. Maps are of equal area (Mollweide), by the direction in which the wave travels. Grey: the
    expansion fails there, as the library says itself; dots: the number of curves of the shadow line is not certain.
    """
    shape = (10, 20) if quick else (90, 180)
    directions, weights = grid(*shape)
    maps: dict[str, Any] = {}
    cards: dict[str, dict[str, Any]] = {}
    for name, (body, *_) in BODIES.items():
        flow = cr.DirectFlow(body, rtol=1e-6)
        found = cr.sweep_directions(flow, directions, wavenumbers=K, boundary=BOUNDARIES)
        levels, bad = cross_sections(found), unresolved_of(found)
        near = found["incidence_status"].values == LineStatus.NEAR_SINGULAR
        maps[name] = levels, bad, near
        cards[name] = {
            "against_one_by_one_dB": agreement(found, flow, found.attrs["length"]),
            "unresolved": {b: float(np.sum(weights * bad[b])) for b in BOUNDARIES},
            "without_return": {b: float(np.sum(weights * np.isneginf(levels[b]))) for b in BOUNDARIES},
            "near_singular": int(near.sum()),
            "mean_dB": {b: mean_level(levels[b][~bad[b]], weights[~bad[b]]) for b in BOUNDARIES},
            "highest_dB": {b: float(np.max(levels[b][~bad[b]])) for b in BOUNDARIES},
        }
    _mollweide(path, shape, maps, 100 if quick else 250)
    worst = max(max(card["against_one_by_one_dB"].values()) for card in cards.values())
    twisted = cards["twisted ellipsoid"]
    return {
        "parameters": {"bodies": [repr(b) for b, *_ in BODIES.values()], "wavenumber": K, "directions": list(shape)},
        "error": {"field": cards},
        "headline": f"{len(directions)} directions of each body; within {worst:.2g} dB of one by one; of the twisted "
        f"ellipsoid {100 * twisted['unresolved']['hard']:.1f} % unresolved, {twisted['near_singular']} near singular",
    }


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
    missing = found["incidence_status"].values >= LineStatus.SINGULAR
    scalar = found["unresolved"].values[:, :, 0]
    return {
        "soft": missing | scalar[:, 0],
        "hard": missing | scalar[:, 1],
        "pec": missing | found["unresolved_pec"].values[:, 0],
    }


def agreement(found: Any, flow: Any, length: float) -> dict[str, float]:
    """Largest differences, dB, to four incidences by `shadow_line`, `launch` and `far_field`, where resolved."""
    rows = np.linspace(0, found.sizes["incidence"] - 1, 4).astype(int)
    worst: dict[str, float] = dict.fromkeys(BOUNDARIES, 0.0)
    levels, bad = cross_sections(found), unresolved_of(found)
    for row in rows:
        d = found["direction"].values[row]
        fan = cr.launch(flow, cr.shadow_line(flow.body, d), length=length, n_rays=256)
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


def _mollweide(path: Path, shape: tuple[int, int], maps: dict[str, Any], dpi: int) -> None:
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
            # each map has its own 30 dB: soft waves fall off by 50 dB more
            low = max(float(np.min(known)), high - 30.0)
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
            kind = "conductor" if boundary == "pec" else boundary
            ax.set_title(f"{'abcdef'[2 * row + column]}  {kind}: {name}", fontsize=9, pad=4)
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


def bistatic(path: Path, quick: bool) -> dict[str, Any]:
    """Bistatic cross section of hard ellipsoids, plain and twisted, incidence and observer all round one great circle.

    A row of a map is one incidence; the bright diagonal is the forward lobe. Reciprocity, f(d, r) = f(-r, -d),
    exchanges points of a map by pairs, and is what the field is judged by: nothing in the formulas of the parts imposes
    it.
    """
    rows, columns = (4, 36) if quick else (72, 360)
    found = {name: around(name, rows, columns) for name in reversed(BODIES)}
    cards = {name: reciprocity(*one) for name, one in found.items()}
    _squares(path, found, 100 if quick else 250)
    words = [f"{100 * card['median_relative']:.2g} % of {card['pairs']:.0f} pairs" for card in cards.values()]
    return {
        "parameters": {"bodies": [repr(BODIES[name][0]) for name in found], "wavenumber": BISTATIC_K}
        | {"boundary": "hard", "incidences": rows, "observers": columns},
        "error": {"field": cards},
        "headline": f"reciprocity (median of |f|): {', '.join(words)}; unresolved "
        + " and ".join(f"{100 * card['unresolved']:.0f} %" for card in cards.values()),
    }


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


def around(name: str, rows: int, columns: int) -> tuple[ComplexArray, BoolArray]:
    """Field (rows, columns), and whether it is resolved; NaN along the row of an incidence that is singular."""
    body, through, _ = BODIES[name]
    found = cr.sweep_directions(
        cr.DirectFlow(body, rtol=1e-6),
        circle(through, rows),
        quantity="bistatic",
        observation=circle(through, columns),
        wavenumbers=BISTATIC_K,
        boundary="hard",
    )
    total = found["total"].values[:, 0, 0]
    return total, ~found["unresolved"].values[:, 0, 0] & np.isfinite(total)


def _squares(path: Path, found: dict[str, tuple[ComplexArray, BoolArray]], dpi: int) -> None:
    from matplotlib.colors import to_rgb
    from matplotlib.patches import Patch

    levels = {name: cross_section_decibels(total) for name, (total, _) in found.items()}
    high = 5 * np.ceil(max(float(np.nanmax(one)) for one in levels.values()) / 5)
    figure = new_figure((7.2, 4.1))
    box: dict[str, Any] = {"extent": (0, 360, 0, 360), "origin": "lower", "interpolation": "nearest", "aspect": "equal"}
    for column, (name, (total, resolved)) in enumerate(found.items()):
        ax = figure.add_axes((0.075 + 0.43 * column, 0.17, 0.39, 0.72))
        drawn = ax.imshow(np.maximum(levels[name], high - 51), cmap="viridis", vmin=high - 50, vmax=high, **box)
        veil = np.concatenate([np.broadcast_to(to_rgb(GREY), (*total.shape, 3)), 0.75 * ~resolved[..., None]], axis=2)
        ax.imshow(veil, **box)
        ax.set_xticks(range(0, 361, 90))
        ax.set_yticks(range(0, 361, 90))
        ax.set_xlabel(f"observation, from z towards {BODIES[name][2]} (degrees)", fontsize=9)
        ax.set_title(f"{'ab'[column]}  {name}", fontsize=9, loc="left")
        ax.tick_params(labelsize=8, direction="in", width=0.5)
    figure.axes[0].set_ylabel("incidence: where the wave travels (degrees)", fontsize=9)
    bar = figure.add_axes((0.92, 0.205, 0.018, 0.65))
    figure.colorbar(drawn, cax=bar, extend="min")
    bar.set_title("dB re 1 L²", fontsize=8, pad=8)
    bar.tick_params(labelsize=8, direction="in", width=0.5)
    veiled = Patch(color=GREY, label="veiled: unresolved")
    figure.legend(handles=[veiled], loc="lower left", bbox_to_anchor=(0.06, 0.0), frameon=False, fontsize=8)
    figure.text(0.98, 0.03, f"4π|f|$^2$, hard, k = {BISTATIC_K:g}/L", fontsize=8, ha="right")
    figure.savefig(path, dpi=dpi, format="png")


def backscatter(ka: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Creeping and whole field of the unit sphere in the direction the wave came from: (n,) -> (n, 2, 2) each.

    Rays go once round, and a little more.
    """
    flow = cr.DirectFlow(sc.Sphere(), rtol=1e-8)
    found = cr.sweep_directions(flow, [(0, 0, 1)], wavenumbers=ka, boundary="pec", length=6.6)
    return found["creeping_pec"].values[0], found["total_pec"].values[0]


def peaks(ka: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Places and heights of the peaks of a curve, between its samples by a cubic spline."""
    spline = CubicSpline(ka, values)
    turns = spline.derivative().roots(extrapolate=False)
    places = turns[spline(turns, 2) < 0]
    return places, np.asarray(spline(places))


def beat(ka: FloatArray, found: FloatArray, exact: FloatArray) -> dict[str, Any]:
    """How far the peaks of σ/(πa²) stand from the exact ones, in degrees of their period.

    Between neighbouring peaks and troughs both curves swing; the ratio of the swings is that of the creeping waves.
    """
    mine, theirs = peaks(ka, found), peaks(ka, exact)
    low, low_exact = peaks(ka, -found), peaks(ka, -exact)
    n = min(len(theirs[0]), len(low_exact[0]))
    card: dict[str, Any] = {"peaks": len(mine[0]), "exact_peaks": len(theirs[0])}
    if card["peaks"] != card["exact_peaks"] or len(low[0]) != len(low_exact[0]):
        return card
    period = np.gradient(theirs[0])
    degrees = np.abs(360 * (mine[0] - theirs[0]) / period)
    swing = (mine[1][:n] + low[1][:n]) / (theirs[1][:n] + low_exact[1][:n])
    return card | {
        "period_of_ka": float(np.median(period)),
        "largest_shift_degrees": float(np.max(degrees)),
        "largest_shift_degrees_beyond_10": float(np.max(degrees[theirs[0] > 10])),
        "median_shift_degrees": float(np.median(degrees)),
        "largest_error_of_swing": float(np.max(np.abs(swing - 1))),
    }


def sphere_rcs(path: Path, quick: bool) -> dict[str, Any]:
    """Backscatter of a conducting sphere, ka = 5 to 100: reflected and creeping wave beat in step with Mie's series.

    The total is specular reflection plus the wave that has crept round the back; they beat against each other with a
    period of ka near 1.2. Where the peaks stand tells the phase of the creeping wave, how high they are its size.
    """
    ka = np.arange(PANELS[0], (40.0 if quick else PANELS[-1]) + 1e-9, 0.1 if quick else 0.05)
    creeping, total = backscatter(ka)
    # of Mie's series E across the plane of scattering; in it the sign is opposite
    exact = np.array([sphere.pec_far_field(k, 1.0, [-1.0])[0][0] for k in ka])
    sigma, sigma_exact = 4 * np.abs(total[:, 0, 0]) ** 2, 4 * np.abs(exact) ** 2
    error = np.abs(sigma / sigma_exact - 1)
    # on a sphere both polarisations are equal, but for the sign of e
    mean = 0.5 * (total[:, 0, 0] - total[:, 1, 1])
    # a beat of amplitudes 1 and x swings by 4x from trough to peak
    swing = 4 * np.abs(creeping[:, 0, 0]) / np.abs((total - creeping)[:, 0, 0])
    _beats(path, ka, (sigma, sigma_exact), (error, swing), 100 if quick else 300)
    field = {
        "cross_section_largest": float(error.max()),
        "cross_section_largest_beyond_10": float(error[ka > 10].max()),
        "cross_section_median": float(np.median(error)),
        "field_largest_beyond_10": float((np.abs(total[:, 0, 0] + exact) / np.abs(exact))[ka > 10].max()),
        "across_largest_beyond_10": float((np.abs(total[:, 1, 1] - exact) / np.abs(exact))[ka > 10].max()),
        "mean_of_both_largest_beyond_10": float((np.abs(mean + exact) / np.abs(exact))[ka > 10].max()),
        **beat(ka, sigma, sigma_exact),
    }
    return {
        "parameters": {"body": "Sphere()", "boundary": "pec", "count": len(ka)}
        | {"ka": [float(ka[0]), round(float(ka[-1]), 6)]},
        "error": {"field": field},
        "headline": f"σ within {100 * field['cross_section_largest_beyond_10']:.2f} % of Mie's series beyond ka = 10 "
        f"({100 * field['cross_section_largest']:.1f} % from 5 on); {field['peaks']} peaks of {field['exact_peaks']}, "
        f"shifted by {field.get('median_shift_degrees', np.nan):.1f} degrees of their period (median)",
    }


def _beats(path: Path, ka: FloatArray, curves: Any, shares: Any, dpi: int) -> None:
    figure = new_figure((7.2, 6.4))
    axes = figure.subplots(3, 1, gridspec_kw={"hspace": 0.42, "left": 0.1, "right": 0.985, "top": 0.96, "bottom": 0.08})
    above = "a  backscatter of a conducting sphere over that of geometrical optics", "b  the same at higher frequencies"
    for number, ax in enumerate(axes[:2]):
        part = (ka >= PANELS[number]) & (ka <= PANELS[number + 1])
        for values, name, style in (
            (curves[1], "Mie's series", {"color": EXACT, "lw": 2.4, "alpha": 0.45}),
            (curves[0], "reflected + creeping", {"color": COLOURS[1], "lw": 1.0}),
        ):
            ax.plot(ka[part], values[part], label=name, **style)
        ax.set_xlim(PANELS[number], min(PANELS[number + 1], ka[-1]))
        ax.set_ylabel("σ / (πa²)", fontsize=9)
        ax.set_title(above[number], fontsize=9, loc="left")
    axes[0].legend(loc="upper right", frameon=False, fontsize=8, ncols=2)
    ax = axes[2]
    ax.semilogy(ka, 100 * shares[1], color=COLOURS[0], lw=1.2, label="swing, trough to peak")
    ax.semilogy(ka, 100 * shares[0], color=COLOURS[1], lw=0.7, label="error against Mie's series")
    ax.set_xlim(ka[0], ka[-1])
    ax.set_ylim(1e-2, 1e2)
    ax.set_ylabel("per cent of σ", fontsize=9)
    ax.set_title("c  swing of the beat, and the error of the whole", fontsize=9, loc="left")
    ax.legend(loc="upper right", frameon=False, fontsize=8, ncols=2)
    for ax in axes:
        ax.set_xlabel("ka", fontsize=9, labelpad=1)
        ax.grid(color="#d9dde0", linewidth=0.5)
        plain_ticks(ax, "both")
    figure.savefig(path, dpi=dpi, format="png")
