"""Published cross sections and target strengths against ours: the Austin suite's sphere, Jech's spheres and spheroids.

``python -m studies.benchmarks FOLDER`` prints the tables. FOLDER holds the files of the benchmarks page, which are not
ours: where to get them stands there.

Sources: [KCY20], [J15].
"""

import csv
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import FloatArray
from creeping.field.echo import Echo
from creeping.files import read_cut
from creeping.sweeping.echoes import echo_of

AUSTIN = "austin_IA_s7f6_bistatic.csv"
FREQUENCIES = "Benchmark_Frequency_TS.csv"
SOUND = 1477.3
"""Speed of sound of Jech's tables, m/s."""
SMALL, LONG = 0.01, 0.07
"""Radius of the sphere and of the spheroid's waist, and its half length, m."""
BOUNDARIES = {"hard": "Rigid", "soft": "PressureRelease"}
BANDS = ((0.0, 1.0), (1.0, 2.0), (2.0, 5.0), (5.0, 8.5), (8.5, 12.0), (12.0, 18.0))
"""Of k times the radius at the waist."""


class Row(NamedTuple):
    """Agreement with one reference, dB, over a part of it."""

    name: str
    part: str
    places: int
    mean: float
    rms: float
    largest: float
    stated: float
    within: float


def conducting_sphere(step: float = 0.5) -> Echo:
    """Bistatic cut of the suite's problem I.A: a sphere of 19.2 m at 320 MHz, the wave from +x."""
    ds = cr.bistatic(sc.Sphere(9.6), wavenumbers=cr.wavenumber("320 MHz"), azimuth=np.arange(0, 180 + 1e-9, step))
    return echo_of(ds, "rcs", ("VV", "HH"), "azimuth")


def target_strengths(shape: str, boundary: str, kilohertz: FloatArray) -> Echo:
    """Backscatter of Jech's sphere, or of the spheroid at broadside."""
    body = sc.Sphere(SMALL) if shape == "Sphere" else sc.Ellipsoid(LONG, SMALL, SMALL)
    k = np.asarray(cr.wavenumber(1e3 * kilohertz, sound_speed=SOUND))
    ds = cr.backscatter(body, wavenumbers=k, azimuth=90.0, boundary=boundary)  # type: ignore[arg-type]
    return echo_of(ds, "ts", (boundary,), "", sound_speed=SOUND)


def published_strengths(folder: Path, shape: str, boundary: str) -> tuple[FloatArray, FloatArray]:
    """Frequencies, kHz, and target strengths, dB, of the exact solutions."""
    column = f"{'Sphere' if shape == 'Sphere' else 'ProlateSpheroid'}_{BOUNDARIES[boundary]}"
    with open(folder / FREQUENCIES, encoding="utf-8") as file:
        rows = [(float(row["Frequency_kHz"]), row[column]) for row in csv.DictReader(file)]
    known = [(f, float(value)) for f, value in rows if value not in ("NA", "")]
    found = np.array(known).T
    return found[0], found[1]


def sphere_rows(folder: Path) -> list[Row]:
    """Agreement with the Austin suite's sphere, by polarisation."""
    echo, given = conducting_sphere(), read_cut(folder / AUSTIN)
    low, high = echo.bounds()
    rows = []
    for c, channel in enumerate(echo.channels):
        levels = given.of(channel)
        assert levels is not None
        found = cr.compare(
            echo.angles, echo.levels()[c, :, 0], given.values, levels, low=low[c, :, 0], high=high[c, :, 0]
        )
        stated = float(np.median(high[c] - echo.levels()[c]))
        name = f"conducting sphere, {channel}; Austin measure {found.austin:.4f}"
        largest = float(np.max(np.abs(found.residual)))
        rows.append(Row(name, "0-180°", len(found.values), found.mean, found.rms, largest, stated, found.within))
    return rows


def strength_rows(folder: Path, shape: str, boundary: str) -> list[Row]:
    """Agreement with Jech's tables, by bands of k times the waist's radius."""
    kilohertz, given = published_strengths(folder, shape, boundary)
    echo = target_strengths(shape, boundary, kilohertz)
    levels, (low, high) = echo.levels()[0, 0], (v[0, 0] for v in echo.bounds())
    waist = echo.wavenumbers * SMALL
    # a table of two digits after the point
    within = (given >= low - 0.005) & (given <= high + 0.005)
    rows = []
    for first, last in BANDS:
        part = (waist >= first) & (waist < last)
        if not np.any(part):
            continue
        off, stated = (levels - given)[part], (high - levels)[part]
        numbers = (float(np.mean(off)), float(np.sqrt(np.mean(off**2))), float(np.max(np.abs(off))))
        known = stated[np.isfinite(stated)]
        middle = float(np.median(known)) if known.size else np.nan
        label = f"k times the waist {first:g} to {last:g}"
        rows.append(
            Row(f"{shape.lower()}, {boundary}", label, int(part.sum()), *numbers, middle, float(np.mean(within[part])))
        )
    return rows


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables of the files in a folder."""
    given = sys.argv[1:] if arguments is None else list(arguments)
    if len(given) != 1 or not Path(given[0]).is_dir():
        raise SystemExit("give the folder of the published tables: python -m studies.benchmarks FOLDER")
    folder = Path(given[0])
    print("                                                      places   mean    rms  largest  stated  within")
    jobs = [("", ""), *((shape, boundary) for shape in ("Sphere", "Spheroid") for boundary in BOUNDARIES)]
    for shape, boundary in jobs:
        file = FREQUENCIES if shape else AUSTIN
        if not (folder / file).is_file():
            print(f"{file} is not in {folder}")
            continue
        for row in strength_rows(folder, shape, boundary) if shape else sphere_rows(folder):
            print(
                f"{row.name:52} {row.places:6d} {row.mean:+6.3f} {row.rms:6.3f} {row.largest:8.3f} {row.stated:7.3f}"
                f" {100 * row.within:6.0f} %  {row.part}",
                flush=True,
            )


if __name__ == "__main__":
    main()
