"""Backscatter of a conducting sphere, ka = 5 to 100: reflected and creeping wave beat in step with Mie's series.

The total is specular reflection plus the wave that has crept round the back; they beat against each other with a period
of ka near 1.2. Where the peaks stand tells the phase of the creeping wave, how high they are its size.
"""

from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

import creeping as cr
import scatterers as sc
from creeping._typing import Any, ComplexArray, FloatArray
from creeping.plotting.palette import COLOURS, EXACT
from creeping.plotting.pictures import new_figure
from tests.reference import sphere

RANGE = (5.0, 100.0)
LENGTH = 6.6
"""Of the rays: once round."""
PARTS = (5.0, 30.0, 100.0)
"""Values of ka at the ends of the panels."""
TITLES = (
    "a  backscatter of a conducting sphere over that of geometrical optics",
    "b  the same at higher frequencies",
    "c  swing of the beat, and the error of the whole",
)


def backscatter(ka: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Creeping and whole field of the unit sphere in the direction the wave came from: (n,) -> (n, 2, 2) each."""
    flow = cr.DirectFlow(sc.Sphere(), rtol=1e-8)
    found = cr.sweep_directions(flow, [(0, 0, 1)], wavenumbers=ka, boundary="pec", length=LENGTH)
    return found["creeping_pec"].values[0], found["total_pec"].values[0]


def exact_backscatter(ka: FloatArray) -> ComplexArray:
    """Mie's series (n,), E across the plane of scattering; in it the sign is opposite."""
    return np.array([sphere.pec_far_field(k, 1.0, [-1.0])[0][0] for k in ka])


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
    degrees = 360 * (mine[0] - theirs[0]) / period
    swing = (mine[1][:n] + low[1][:n]) / (theirs[1][:n] + low_exact[1][:n])
    card |= {"period_of_ka": float(np.median(period)), "largest_shift_degrees": float(np.max(np.abs(degrees)))}
    late = theirs[0] > 10
    card |= {"largest_shift_degrees_beyond_10": float(np.max(np.abs(degrees[late])))}
    card |= {"median_shift_degrees": float(np.median(np.abs(degrees)))}
    return card | {"largest_error_of_swing": float(np.max(np.abs(swing - 1)))}


def draw(path: Path, quick: bool) -> dict[str, Any]:
    """Write the figure and return its card."""
    ka = np.arange(RANGE[0], (40.0 if quick else RANGE[1]) + 1e-9, 0.1 if quick else 0.05)
    creeping, total = backscatter(ka)
    exact = exact_backscatter(ka)
    sigma, sigma_exact = 4 * np.abs(total[:, 0, 0]) ** 2, 4 * np.abs(exact) ** 2
    error = np.abs(sigma / sigma_exact - 1)
    # on a sphere both polarisations are equal, but for the sign of e
    mean = 0.5 * (total[:, 0, 0] - total[:, 1, 1])
    # a beat of amplitudes 1 and x swings by 4x from trough to peak
    swing = 4 * np.abs(creeping[:, 0, 0]) / np.abs((total - creeping)[:, 0, 0])
    _picture(path, ka, (sigma, sigma_exact), (error, swing), 100 if quick else 300)
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
        "parameters": {
            "body": "Sphere()",
            "boundary": "pec",
            "length": LENGTH,
            "ka": [float(ka[0]), round(float(ka[-1]), 6)],
            "count": len(ka),
        },
        "error": {"field": field},
        "headline": f"σ within {100 * field['cross_section_largest_beyond_10']:.2f} % of Mie's series beyond ka = 10 "
        f"({100 * field['cross_section_largest']:.1f} % from 5 on); {field['peaks']} peaks of {field['exact_peaks']}, "
        f"shifted by {field.get('median_shift_degrees', np.nan):.1f} degrees of their period (median)",
    }


def _picture(path: Path, ka: FloatArray, curves: Any, shares: Any, dpi: int) -> None:
    figure = new_figure((7.2, 6.4))
    axes = figure.subplots(3, 1, gridspec_kw={"hspace": 0.42, "left": 0.1, "right": 0.985, "top": 0.96, "bottom": 0.08})
    for number, ax in enumerate(axes[:2]):
        part = (ka >= PARTS[number]) & (ka <= PARTS[number + 1])
        for values, name, style in (
            (curves[1], "Mie's series", {"color": EXACT, "lw": 2.4, "alpha": 0.45}),
            (curves[0], "reflected + creeping", {"color": COLOURS[1], "lw": 1.0}),
        ):
            ax.plot(ka[part], values[part], label=name, **style)
        ax.set_xlim(PARTS[number], min(PARTS[number + 1], ka[-1]))
        ax.set_ylabel("σ / (πa²)", fontsize=9)
        ax.set_title(TITLES[number], fontsize=9, loc="left")
    axes[0].legend(loc="upper right", frameon=False, fontsize=8, ncols=2)
    ax = axes[2]
    ax.semilogy(ka, 100 * shares[1], color=COLOURS[0], lw=1.2, label="swing, trough to peak")
    ax.semilogy(ka, 100 * shares[0], color=COLOURS[1], lw=0.7, label="error against Mie's series")
    ax.set_xlim(ka[0], ka[-1])
    ax.set_ylim(1e-2, 1e2)
    ax.set_ylabel("per cent of σ", fontsize=9)
    ax.set_title(TITLES[2], fontsize=9, loc="left")
    ax.legend(loc="upper right", frameon=False, fontsize=8, ncols=2)
    for ax in axes:
        ax.set_xlabel("ka", fontsize=9, labelpad=1)
        ax.grid(color="#d9dde0", linewidth=0.5)
        ax.tick_params(labelsize=8, direction="in", which="both", top=True, right=True, width=0.5)
    figure.savefig(path, dpi=dpi, format="png")
