"""Fields on planes of one ``creeping run``: what ``--plane`` asks for, and the files that come of it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np

from creeping import plotting
from creeping._typing import FloatArray
from creeping.commands.body import Output, write_tables
from creeping.commands.run_field import DPI, ORDER, Job
from creeping.errors import InvalidInputError
from creeping.field.cut_result import FieldCut, cut_grid, field_cut
from creeping.field.equation.solution import Solution
from creeping.field.near import conductor_field, near_field
from creeping.field.routes import affordable
from creeping.rays.fan import RayFan

PLANES = {"incidence": None, "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
TRIED, LEAST_TRIED, MOST_TRIED = 16, 128, 1536
"""One in so many points is computed to know how long all take; so many at least, and at most."""
FORMS = "incidence, xy, xz or yz, with :STEP if it is not to fit the wave, e.g. xz:0.02"


@dataclass(frozen=True)
class Plane:
    """One ``--plane``: its text, the axes that span it (2, 3) or None, and the step if one is given, L."""

    text: str
    axes: Any
    step: float | None


def parse_plane(text: str) -> Plane:
    """What one ``--plane`` asks for.

    Raises
    ------
    InvalidInputError
        If the text has none of the known forms.
    """
    name, colon, rest = text.partition(":")
    step = None
    if colon:
        try:
            step = float(rest)
        except ValueError:
            step = np.nan
    if name not in PLANES or (step is not None and not (np.isfinite(step) and step > 0)):
        raise InvalidInputError(f"--plane {text!r} is unknown; give {FORMS}")
    numbers = PLANES[name]
    return Plane(text, None if numbers is None else np.eye(3)[list(numbers)], step)


def write_planes(
    planes: Sequence[Plane],
    job: Job,
    source: RayFan | Solution,
    output: Output,
    progress: Callable[[str], None],
) -> tuple[list[dict[str, Any]], list[str]]:
    """Compute fields on planes, by a fan or a solution, and write their files.

    Returns entries of the summary and the names of the files.
    """
    entries, names = [], []
    for number, plane in enumerate(planes, 1):
        stem = "plane" if number == 1 else f"plane_{number}"
        grid = cut_grid(source, **_options(plane, job, source))
        progress(f"field on the plane {plane.text}: {len(grid.points)} points")
        if isinstance(source, RayFan):
            _tell_time(plane, job, source, grid.points, progress)
        started = perf_counter()
        cut = field_cut(source, **_options(plane, job, source), **_polarisation(job))
        seconds = perf_counter() - started
        if job.unit:
            cut = replace(cut, field=replace(cut.field, length_unit=job.unit))
        names += write_tables(output.folder / stem, output.formats, cut, cut=cut)
        if output.pictures and np.any(cut.field.ok):
            title = f"{output.name}\n{job.told(cut.field.length_unit)}, {cut.field.boundary}"
            plotting.field_cut_picture(output.folder / f"{stem}.png", cut, error=True, title=title, dpi=DPI)
            names.append(f"{stem}.png")
        entries.append(_entry(plane, cut) | {"seconds": round(seconds, 2)})
    return entries, names


def _options(plane: Plane, job: Job, source: RayFan | Solution) -> dict[str, Any]:
    """Arguments of `field_cut`, and of `cut_grid`."""
    axes = {} if plane.axes is None else {"across": plane.axes[0], "up": plane.axes[1]}
    return (job.asked if isinstance(source, RayFan) else {}) | axes | {"step": plane.step}


def _polarisation(job: Job) -> dict[str, Any]:
    """Of a conductor the transmitted one of the first component that pictures show."""
    return {"polarisation": {"t": "theta", "p": "phi"}[job.components[0][1]]} if job.boundary == "pec" else {}


def _tell_time(plane: Plane, job: Job, fan: RayFan, points: FloatArray, progress: Callable[[str], None]) -> None:
    """Say how long the points of a plane take."""
    k = job.wavenumber
    count = max(LEAST_TRIED, min(MOST_TRIED, len(points) // TRIED))
    # of many points currents may cost too much where they serve a few
    if len(points) < TRIED * LEAST_TRIED or affordable(fan, count, k) != affordable(fan, len(points), k):
        return

    def compute(some: FloatArray) -> None:
        if job.boundary == "pec":
            conductor_field(fan, some, wavenumber=k, **_polarisation(job))
        else:
            near_field(fan, some, wavenumber=k, boundary=job.boundary, order=ORDER)

    seconds = expected_seconds(compute, points, count)
    progress(f"field on the plane {plane.text}: about {seconds:.{0 if seconds >= 10 else 1}f} s")


def expected_seconds(compute: Callable[[FloatArray], None], points: FloatArray, count: int) -> float:
    """Seconds that all points (n, 3) take, by ``count`` of them spread over all.

    What is made once and kept, kernels and currents, is made with the first half of these; the second is timed.
    """
    some = points[np.random.default_rng(0).choice(len(points), count, replace=False)]
    before, timed = some[: count // 2], some[count // 2 :]
    compute(before)
    started = perf_counter()
    compute(timed)
    return (perf_counter() - started) * len(points) / len(timed)


def _entry(plane: Plane, cut: FieldCut) -> dict[str, Any]:
    field = cut.field
    methods, counts = np.unique(field.method, return_counts=True)
    off = field.error[field.ok]
    return {
        "plane": plane.text,
        "points": [len(cut.across), len(cut.up)],
        "step": cut.step,
        "inside": int(np.sum(~cut.outside)),
        "status": field.status_counts,
        "methods": {str(name): int(count) for name, count in zip(methods, counts, strict=True)},
        "error_median": float(np.median(off)) if off.size else None,
        "error_max": float(off.max()) if off.size else None,
    }


def plane_words(entry: dict[str, Any]) -> str:
    """One line on a field on a plane."""
    states = ", ".join(f"{count} {name}" for name, count in entry["status"].items())
    error = "" if entry["error_max"] is None else f"; error {entry['error_median']:.1e} in the median, "
    error += "" if entry["error_max"] is None else f"{entry['error_max']:.1e} at most"
    return (
        f"field on the plane {entry['plane']}: {' x '.join(map(str, entry['points']))} points {entry['step']:.3g} "
        f"apart, {states}{error}; {entry['seconds']:.1f} s"
    )
