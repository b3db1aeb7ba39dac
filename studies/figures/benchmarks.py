"""Published cross sections and target strengths against ours: the Austin suite's sphere, Jech's spheres and spheroids.

``python -m studies benchmarks FOLDER`` prints the tables. FOLDER holds the files of the benchmarks page, which are not
ours: where to get them stands there.

Sources: [KCY20], [J15].
"""

import csv
import os
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any, FloatArray
from creeping.field.results.comparison import Echo
from creeping.files import read_cut
from creeping.plotting.pages import COLOURS, EXACT, new_figure
from creeping.sweeping.echoes import echo_of
from studies import Row, main
from studies.accuracy.bodies import rms
from studies.figures.drawing import plain_ticks
from tests.reference import sphere

FREQUENCIES = "Benchmark_Frequency_TS.csv"
SOUND = 1477.3
"""Speed of sound of Jech's tables, m/s."""
SMALL = 0.01
"""Radius of the sphere and of the spheroid's waist, m; its half length is seven times that."""
BOUNDARIES = {"hard": "Rigid", "soft": "PressureRelease"}
KILOHERTZ = (12.0, 400.0)
EXACT_LOOK: dict[str, Any] = {"color": EXACT, "lw": 3.0, "alpha": 0.3}


def conducting_sphere(step: float = 0.5) -> Echo:
    """Bistatic cut of the suite's problem I.A: a sphere of 19.2 m at 320 MHz, the wave from +x."""
    ds = cr.bistatic(sc.Sphere(9.6), wavenumbers=cr.wavenumber("320 MHz"), azimuth=np.arange(0, 180 + 1e-9, step))
    return echo_of(ds, "rcs", ("VV", "HH"), "azimuth")


def target_strengths(shape: str, boundary: str, kilohertz: FloatArray) -> Echo:
    """Backscatter of Jech's sphere, or of the spheroid at broadside."""
    body = sc.Sphere(SMALL) if shape == "Sphere" else sc.Ellipsoid(0.07, SMALL, SMALL)
    k = np.asarray(cr.wavenumber(1e3 * kilohertz, sound_speed=SOUND))
    ds = cr.backscatter(body, wavenumbers=k, azimuth=90.0, boundary=boundary)  # type: ignore[arg-type]
    return echo_of(ds, "ts", (boundary,), "", sound_speed=SOUND)


def published_strengths(folder: Path, shape: str, boundary: str) -> tuple[FloatArray, FloatArray]:
    """Frequencies, kHz, and target strengths, dB, of the exact solutions."""
    column = f"{'Sphere' if shape == 'Sphere' else 'ProlateSpheroid'}_{BOUNDARIES[boundary]}"
    with open(folder / FREQUENCIES, encoding="utf-8") as file:
        rows = [(row["Frequency_kHz"], row[column]) for row in csv.DictReader(file) if row[column] not in ("NA", "")]
    kilohertz, levels = np.array(rows, dtype=float).T
    return kilohertz, levels


def strengths(echo: Echo, boundary: str) -> FloatArray:
    """Target strengths (k,) of the small sphere by partial waves."""
    found = [sphere.far_field(k, SMALL, [-1.0], boundary)[0] for k in echo.wavenumbers]  # type: ignore[arg-type]
    return np.asarray(20 * np.log10(np.abs(found)))


def published(path: Path, quick: bool) -> dict[str, Any]:
    """Benchmarks: a conducting sphere of ka = 64 bistatically, and target strengths of a sphere and a spheroid.

    The Austin RCS suite's sphere (problem I.A) and that of Jech et al. against partial waves; Jech's spheroid,
    broadside, with what is published of it if ``CREEPING_BENCHMARKS`` names the folder of the tables. Bands are the
    stated errors.

    Sources: [KCY20], [J15].
    """
    cut = conducting_sphere(2.0 if quick else 0.5)
    # levels (2, m) of the conducting sphere, VV and HH, by partial waves
    k = float(cut.wavenumbers[0])
    # the scattering angle is counted from the forward direction; V, along theta, is across the plane of the cut
    across, along = sphere.pec_amplitudes(k, 9.6, -np.cos(np.radians(cut.angles)))
    exact = np.asarray(20 * np.log10(np.abs(np.stack([across, along])) / k) + 10 * np.log10(4 * np.pi))
    residual = cut.levels()[:, :, 0] - exact
    kilohertz = np.arange(KILOHERTZ[0], KILOHERTZ[1] + 1e-9, 32.0 if quick else 4.0)
    echoes = {(s, b): target_strengths(s, b, kilohertz) for s in ("Sphere", "Spheroid") for b in BOUNDARIES}
    off = {b: echoes["Sphere", b].levels()[0, 0] - strengths(echoes["Sphere", b], b) for b in BOUNDARIES}
    beyond = echoes["Sphere", "hard"].wavenumbers * SMALL > 10
    figure = new_figure((7.2, 8.2))
    figure.set_layout_engine("constrained")
    axes = figure.subplots(4, 1, height_ratios=(1.5, 0.8, 1.2, 1.2))
    low, high = cut.bounds()
    for c, channel in enumerate(cut.channels):
        look = {"color": COLOURS[c], "ls": ("-", "--")[c], "lw": 1.1}
        axes[0].plot(cut.angles, exact[c], label="Mie's series" if c == 0 else "_", **EXACT_LOOK)
        axes[0].fill_between(cut.angles, low[c, :, 0], high[c, :, 0], color=COLOURS[c], alpha=0.2, lw=0)
        axes[0].plot(cut.angles, cut.levels()[c, :, 0], label=channel, **look)
        axes[1].plot(cut.angles, residual[c], **look)
    axes[1].set_xlabel("azimuth from the radar (degrees)", fontsize=9)
    for ax, shape in zip(axes[2:], ("Sphere", "Spheroid"), strict=True):
        for c, boundary in enumerate(BOUNDARIES):
            echo = echoes[shape, boundary]
            bottom, top = (np.maximum(v[0, 0], -80.0) for v in echo.bounds())
            look = {"color": COLOURS[c], "ls": ("-", "--")[c], "lw": 1.1}
            _reference(ax, shape, boundary, echo, kilohertz, first=c == 0)
            ax.fill_between(kilohertz, bottom, top, color=COLOURS[c], alpha=0.2, lw=0)
            ax.plot(kilohertz, echo.levels()[0, 0], label=boundary, **look)
        ax.set_ylim(*((-60, -38) if shape == "Sphere" else (-45, -20)))
        ax.set_xlabel("frequency (kHz)", fontsize=9)
    titles = (
        "a  conducting sphere of 19.2 m at 320 MHz, bistatic: cross section (dBsm)",
        "   residual (dB)",
        "b  sphere of 1 cm: target strength (dB re 1 m)",
        "c  prolate spheroid, 7 x 1 cm, broadside: target strength (dB re 1 m)",
    )
    for ax, title in zip(axes, titles, strict=True):
        ax.set_title(title, fontsize=9, loc="left")
        ax.grid(color="#d9dde0", linewidth=0.5)
        plain_ticks(ax)
        if ax is not axes[1]:
            ax.legend(loc="best", frameon=False, fontsize=8, ncols=3)
    figure.savefig(path, dpi=100 if quick else 200, format="png")
    worst = {b: float(np.max(np.abs(v[beyond]))) for b, v in off.items()}
    field = {
        "sphere_mean_db": float(np.mean(np.abs(residual))),
        "sphere_largest_db": float(np.max(np.abs(residual))),
        **{f"target_strength_{b}_beyond_ka_10_db": v for b, v in worst.items()},
    }
    return {
        "parameters": {"radius": 9.6, "megahertz": 320.0, "kilohertz": list(KILOHERTZ), "quick": quick},
        "error": {"field": field},
        "headline": f"bistatic sphere of ka = 64 within {field['sphere_mean_db']:.3f} dB of Mie's series in the mean, "
        f"{field['sphere_largest_db']:.2f} at most; target strengths beyond ka = 10 within "
        f"{max(worst.values()):.2f} dB of partial waves",
    }


def _reference(ax: Any, shape: str, boundary: str, echo: Echo, kilohertz: FloatArray, *, first: bool) -> None:
    if shape == "Sphere":
        ax.plot(kilohertz, strengths(echo, boundary), label="partial waves" if first else "_", **EXACT_LOOK)
        return
    folder = Path(os.environ.get("CREEPING_BENCHMARKS", ""))
    if (folder / FREQUENCIES).is_file():
        ax.plot(*published_strengths(folder, shape, boundary), label="published" if first else "_", **EXACT_LOOK)


def large_sphere(folder: Path) -> Iterator[Row]:
    """The Austin suite's sphere: differences, dB, their Austin measure, and the share within the stated error."""
    echo, given = conducting_sphere(), read_cut(_known(folder, "austin_IA_s7f6_bistatic.csv"))
    low, high = echo.bounds()
    for c, channel in enumerate(echo.channels):
        levels = given.of(channel)
        assert levels is not None
        found = cr.compare(
            echo.angles, echo.levels()[c, :, 0], given.values, levels, low=low[c, :, 0], high=high[c, :, 0]
        )
        row = {"channel": channel, "places": len(found.values), "mean": found.mean, "rms": found.rms}
        row |= {"largest": float(np.max(np.abs(found.residual))), "Austin": found.austin}
        yield row | {"stated": float(np.median(high[c] - echo.levels()[c])), "within": found.within}


def small_bodies(folder: Path) -> Iterator[Row]:
    """Jech's sphere and spheroid: differences, dB, by bands of k times the waist's radius."""
    _known(folder, FREQUENCIES)
    for shape in ("Sphere", "Spheroid"):
        for boundary in BOUNDARIES:
            kilohertz, given = published_strengths(folder, shape, boundary)
            echo = target_strengths(shape, boundary, kilohertz)
            levels, (low, high) = echo.levels()[0, 0], (v[0, 0] for v in echo.bounds())
            waist = echo.wavenumbers * SMALL
            # a table of two digits after the point
            within = (given >= low - 0.005) & (given <= high + 0.005)
            for first, last in pairwise((0.0, 1.0, 2.0, 5.0, 8.5, 12.0, 18.0)):
                part = (waist >= first) & (waist < last)
                if np.any(part):
                    off, stated = (levels - given)[part], (high - levels)[part]
                    row: Row = {"body": f"{shape.lower()}, {boundary}", "k times waist": f"{first:g}-{last:g}"}
                    row |= {"places": int(part.sum()), "mean": float(np.mean(off)), "rms": rms(off)}
                    row |= {"largest": float(np.max(np.abs(off))), "stated": float(np.nanmedian(stated))}
                    yield row | {"within": float(np.mean(within[part]))}


def _known(folder: Path, name: str) -> Path:
    if not (folder / name).is_file():
        raise SystemExit(f"{name} is not in {folder}")
    return folder / name


if __name__ == "__main__":
    main((large_sphere, small_bodies), places=1)
