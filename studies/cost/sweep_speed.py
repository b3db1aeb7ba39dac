"""What do an incidence, a frequency and a value between cost? Lines, rays and fields in bulk, and their errors.

Shadow lines at sweep speed, of 1000 incidences on five bodies, against the independent `creeping.shadow_line`, panels
of exact points, on every tenth direction.

Rays are 256 of length 4, with J and attenuation at their ends. Times are processor times on one thread, least of
several, results in memory; errors of rays are those from the same launch points by order 8 at 1e-12. Maps are built
beforehand. Run ``python -m studies sweep_speed [--quick] [--tables NAME ...]`` (ten minutes).
"""

import time
from collections.abc import Iterator
from functools import cache, partial
from typing import NamedTuple

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any, FloatArray
from creeping.geometry.directions import fibonacci_directions, great_circle
from creeping.phaseflow.request import tuned_direct
from creeping.shadow.line import shadow_lines
from creeping.shadow.status import INCIDENCE_STATUSES, STATUSES, LineStatus
from creeping.sweeping.request import sweep_request
from creeping.sweeping.sweeper import Sweeper
from studies import Row, main
from studies.cost.flow_speed import body, seconds_of, threads

LENGTH, RAYS = 4.0, 256
BODIES = ("ellipsoid", "twisted", "torus", "gridded")
TOLERANCES = (3e-5, 1e-6)
FIELDS: dict[str, Any] = {
    "wavenumbers": tuple(np.linspace(15.0, 60.0, 8)),
    "boundary": ["soft", "hard"],
    "length": LENGTH,
    "n_rays": RAYS,
}
"""Monostatic fields of a sweep."""
LINE_BODIES = ("ellipsoid", "torus", "twisted", "peanut", "bumpy")


@cache
def flow_of(name: str, tolerance: float, direct: bool = False) -> Any:
    """Map tuned for a sweep, or order 8 with the longest equal steps that meet the tolerance."""
    if direct:
        return tuned_direct(body(name), LENGTH, 1, tolerance, True)[0]
    return cr.build_phase_map(body(name), tolerance=tolerance, length=LENGTH, n_steps=1, n_rays=10**8)


def errors_of_rays(name: str, flow: Any, incidences: FloatArray, n_rays: int) -> Row:
    """Rms and largest error of points, rms of J over 1 + |J|, rms of the attenuation; rays at their ends.

    A ray that detaches no longer decays: where only one of both sees it come off, for a moment mostly, the ray is
    counted in "missed" and its attenuation left out.
    """
    request = sweep_request("rays", length=LENGTH, n_rays=n_rays)
    exact = Sweeper(cr.DirectFlow(body(name), rtol=1e-12), request)(incidences)
    found = Sweeper(flow, request)(incidences)
    gap = np.linalg.norm(found["points"] - exact["points"], axis=-1)
    J = (found["spreading"] - exact["spreading"]) / (1 + np.abs(exact["spreading"]))
    A = (found["attenuation"] - exact["attenuation"])[..., 0]
    ends, exact_ends = (np.minimum(one["detachment"], 2 * LENGTH) for one in (found, exact))
    alike = np.abs(ends - exact_ends) < 0.01
    return {
        "points": float(np.sqrt(np.nanmean(gap**2))),
        "largest": float(np.nanmax(gap)),
        "J": float(np.sqrt(np.nanmean(J**2))),
        "att.": float(np.sqrt(np.mean(A[alike] ** 2))),
        "missed": float(np.mean(~alike & np.isfinite(A))),
    }


def fans(names: tuple[str, ...] = BODIES, count: int = 512, checked: int = 16) -> Iterator[Row]:
    """Incidences a second, rays with J and attenuation, and us an incidence for line and rays; fewer of samples."""
    for name in names:
        n_rays = RAYS // 2 if name == "gridded" else RAYS
        for direct in (False, True):
            incidences = fibonacci_directions(count // 16 if direct and name == "gridded" else count)
            n = len(incidences)
            # as the sweeper calls it: a batch at a time
            batches = [incidences[first : first + 64] for first in range(0, n, 64)]
            for tolerance in TOLERANCES[: 1 if name == "gridded" else None]:
                flow = flow_of(name, tolerance, direct)
                sweeper = Sweeper(flow, sweep_request("rays", length=LENGTH, n_rays=n_rays))
                whole = seconds_of(partial(sweeper, incidences)) / n
                line = seconds_of(partial(_lines, body(name), batches, n_rays)) / n
                row = {"body": name, "flow": "order 8" if direct else "map", "for": tolerance, "per s": 1 / whole}
                row |= {"line us": 1e6 * line, "rays us": 1e6 * (whole - line)}
                yield row | errors_of_rays(name, flow, incidences[:: max(1, n // checked)], n_rays)


def _lines(shape: Any, batches: list[FloatArray], n_rays: int) -> None:
    for part in batches:
        shadow_lines(shape, part, n_rays)


def fields(names: tuple[str, ...] = BODIES[:3], count: int = 256) -> Iterator[Row]:
    """Monostatic field, soft and hard, at 8 wavenumbers from 15 to 60.

    "off" is the share of incidences whose creeping field by the map is 10 % or more off that by order 8.
    """
    incidences, request = fibonacci_directions(count), sweep_request("monostatic", **FIELDS)
    for name in names:
        reference: Any = None
        for direct in (True, False):
            sweeper = Sweeper(flow_of(name, TOLERANCES[0], direct), request)
            seconds = seconds_of(partial(sweeper, incidences)) / count
            found = sweeper(incidences)
            reference = found if direct else reference
            gap = np.abs(found["creeping"] - reference["creeping"]) > 0.1 * np.abs(reference["creeping"])
            row = {"body": name, "flow": "order 8" if direct else "map", "per s": 1 / seconds, "us": 1e6 * seconds}
            row["unresolved"] = float(np.mean(found["unresolved"]))
            yield row | {"off": float(np.mean(np.any(gap & ~found["unresolved"], axis=(1, 2))))}


def between(tenth: int = 1) -> Iterator[Row]:
    """Sweeps with accuracy=1e-3 beside some of their incidences without: rates, and errors over the median field."""
    # the last passes through singular directions of the twisted ellipsoid
    tilted = (0.3, 0.5, 0.81)
    cuts = {"0.1 deg": (3600, tilted), "0.025 deg": (14_400, tilted), "singular": (3600, (1.0, 0.0, 0.05))}
    for name in ("triaxial", "twisted"):
        for case, (count, axis) in cuts.items():
            if name == "twisted" or case != "singular":
                first = np.cross(axis, (1.0, 0.0, 0.1))
                circle = great_circle(first, np.cross(axis, first), count // tenth)
                yield {"body": name, "incidences": case, **interpolated(name, circle, 512 // tenth)}


def interpolated(name: str, directions: FloatArray, few: int) -> Row:
    """Ratio, rates and errors of one sweep."""
    flow = cr.build_phase_map(body(name), tolerance=TOLERANCES[0], length=LENGTH)
    some = np.sort(np.random.default_rng(0).choice(len(directions), min(few, len(directions)), replace=False))
    plain = partial(cr.sweep_directions, flow, directions[some], **FIELDS)
    quick = partial(cr.sweep_directions, flow, directions, accuracy=1e-3, **FIELDS)
    alone, each = seconds_of(plain, 2) / len(some), seconds_of(quick, 2) / len(directions)
    known, found = plain(), quick()
    row = {"computed per s": 1 / alone, "between per s": 1 / each, "ratio": alone / each}
    row["interpolated"] = float(found.interpolated.mean())
    found = found.isel(incidence=some)
    inside = found.interpolated.values
    for part in ("total", "creeping"):
        off = np.abs(known[part].values - found[part].values)
        share = (off / np.median(np.abs(known[part].values), axis=0))[inside]
        row |= {f"{part} {q:.0%}": float(np.quantile(share, q)) for q in (0.5, 0.99)}
        if part == "total":
            row["covered"] = float(np.mean(off[inside] <= found.interpolation_error.values[inside] + 1e-15))
    return row


def frequencies(methods: tuple[Any, ...] = ("currents", "rays")) -> Iterator[Row]:
    """Seconds of the first frequency, geometry included, and of one more: fan of 512 rays, 361 directions, k = 40."""
    shape = sc.Ellipsoid(1, 0.8, 0.6)
    flow, line = cr.build_phase_map(shape, tolerance=1e-6), cr.shadow_line(shape, (0.3, 0.5, 0.812))
    theta = np.radians(np.arange(-180, 181))
    directions = np.stack([np.sin(theta), 0 * theta, np.cos(theta)], axis=-1)
    for method in methods:
        for boundary in ("soft", "hard", "pec"):
            # the first fan compiles
            for _ in range(2):
                spent, fan = [], cr.launch(flow, line, length=5.0, n_rays=512)
                for k in (40.0, 40.5, 41.0, 41.5, 42.0):
                    started = time.process_time()
                    cr.far_field(fan, directions, wavenumber=k, boundary=boundary, method=method)
                    spent.append(time.process_time() - started)
            yield {"method": method, "boundary": boundary, "first": spent[0], "further": float(np.median(spent[1:]))}


class Lines(NamedTuple):
    """Lines of n incidences: status, curves, length and shares (n,) and (n, 3), and v."""

    status: Any
    curves: FloatArray
    length: FloatArray
    shares: FloatArray
    singular_distance: FloatArray


def swept(body: Any, directions: FloatArray) -> Lines:
    """Lines as a sweep gets them."""
    found = shadow_lines(body, directions, RAYS)
    shares = np.stack([found.attached, found.occluded, found.concave], axis=1)
    return Lines(found.status, found.curves, found.length, shares, found.singular_distance)


def independent(body: Any, directions: FloatArray) -> tuple[Lines, float]:
    """Lines by `shadow_line`, and seconds of each."""
    n = len(directions)
    nothing = np.full((n, 6), np.nan)
    lines = Lines(np.zeros(n, np.int8), nothing[:, 0], nothing[:, 1], nothing[:, 2:5], nothing[:, 5])
    started = time.process_time()
    for row, d in enumerate(directions):
        try:
            line = cr.shadow_line(body, d)
        except cr.SingularIncidenceError:
            lines.status[row] = LineStatus.SINGULAR
            continue
        lines.curves[row], lines.length[row] = len(line.curves), line.length
        lines.shares[row] = [line.fractions[name] for name in STATUSES]
    return lines, (time.process_time() - started) / n


def differences(found: Lines, exact: Lines) -> Row:
    """Lines that differ in the number of curves, and worst errors: of status OK, and of all (in brackets)."""
    both = np.isfinite(found.length) & np.isfinite(exact.length) & (exact.status < LineStatus.SINGULAR)
    certain = both & (found.status == LineStatus.OK)
    length = np.abs(found.length / np.where(both, exact.length, 1.0) - 1)
    share = np.abs(found.shares - exact.shares)
    row: Row = {}
    for suffix, rows in (("", certain), (", all", both)):
        row[f"counts differ{suffix}"] = int(np.sum(found.curves[rows] != exact.curves[rows]))
        row[f"length{suffix}"] = float(np.max(length[rows], initial=0.0))
        for k, name in enumerate(STATUSES):
            row[f"{name}{suffix}"] = float(np.max(share[rows, k], initial=0.0))
    return row | {"compared": int(both.sum())}


def lines(names: tuple[str, ...] = LINE_BODIES, count: int = 1000) -> Iterator[Row]:
    """Cost of a line, statuses and curves of Fibonacci incidences."""
    directions = fibonacci_directions(count)
    for name in names:
        found = swept(body(name), directions)
        row: Row = {"body": name, "us a line": 1e6 * seconds_of(partial(swept, body(name), directions)) / count}
        for code in (LineStatus.OK, LineStatus.NEAR_SINGULAR, LineStatus.FOLLOWED, LineStatus.SINGULAR):
            row[INCIDENCE_STATUSES[code].split(":")[0]] = int(np.sum(found.status == code))
        counts = np.unique(found.curves[np.isfinite(found.curves)]).astype(int)
        least = float(np.min(found.singular_distance))
        yield row | {"curves seen": " ".join(map(str, counts)), "least v": least if np.isfinite(least) else np.nan}


def panels(names: tuple[str, ...] = LINE_BODIES, count: int = 1000, every: int = 10) -> Iterator[Row]:
    """Against shadow_line, some of them: counts that differ and worst errors, of certain lines and of all."""
    directions = fibonacci_directions(count)
    for name in names:
        exact, each = independent(body(name), directions[::every])
        few = Lines(*(values[::every] for values in swept(body(name), directions)))
        yield {"body": name, "s a line": each, **differences(few, exact)}


if __name__ == "__main__":
    quick: dict[str, Any] = {
        "lines": {"count": 100},
        "panels": {"count": 100},
        "fans": {"count": 64, "checked": 4},
        "fields": {"count": 32},
        "between": {"tenth": 10},
        "frequencies": {"methods": ("rays",)},
    }
    with threads(1):
        main((lines, panels, fans, fields, between, frequencies), quick)
