"""What does an incidence of a sweep cost? Lines, rays and fields in bulk, their errors, and scipy for comparison.

Rays are 256 of length 4, with J and attenuation at their ends. Times are processor times on one thread, least of three,
results in memory; errors are those of rays from the same launch points by order 8 at 1e-12. Maps are tuned for 1e8 rays
and built beforehand. Run ``python -m studies.sweep_speed [--quick] [--tables 1 2 ...]`` (five minutes).
"""

import argparse
import os
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

import numpy as np

import creeping as cr
from creeping._typing import Any, FloatArray
from creeping.geodesics.states import pack
from creeping.geometry.directions import fibonacci_directions
from creeping.phaseflow.tuning.flow_choice import tuned_direct
from creeping.shadow.many import shadow_lines
from creeping.shadow.status import SINGULAR
from creeping.sweeping.request import sweep_request
from creeping.sweeping.sweeper import Sweeper
from studies._flow_cases import Row, body, closed_form, show, threads
from studies._peers import scipy_flow, seconds_of

LENGTH, RAYS = 4.0, 256
REPEATS = 3
BODIES = ("ellipsoid", "twisted", "torus")
TOLERANCES = (3e-5, 1e-6)
WAVENUMBERS = tuple(np.linspace(15.0, 60.0, 8))
STEPS_OF_SCIPY = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
"""Tolerances per step; the loosest that errs no more than the sweep is taken."""


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


def _parts(name: str, flow: Any, incidences: FloatArray, n_rays: int) -> Row:
    """Incidences a second, and us an incidence for line and rays."""
    n = len(incidences)
    sweeper = Sweeper(flow, sweep_request("rays", length=LENGTH, n_rays=n_rays))
    whole = seconds_of(lambda: sweeper(incidences), REPEATS) / n
    # as the sweeper calls it: a batch at a time
    line = seconds_of(lambda: [shadow_lines(body(name), part, n_rays) for part in _batches(incidences)], REPEATS) / n
    return {"per s": 1 / whole, "line us": 1e6 * line, "rays us": 1e6 * (whole - line)}


def _batches(incidences: FloatArray) -> list[FloatArray]:
    return [incidences[first : first + 64] for first in range(0, len(incidences), 64)]


def fans(names: tuple[str, ...] = BODIES, count: int = 512, checked: int = 16) -> list[Row]:
    """Table 1: incidences a second, 256 rays of length 4 with J and attenuation."""
    rows = []
    for name in names:
        incidences = fibonacci_directions(count)
        for direct in (False, True):
            for tolerance in TOLERANCES:
                flow = flow_of(name, tolerance, direct)
                row = {"body": name, "flow": "order 8" if direct else "map", "for": tolerance}
                row |= _parts(name, flow, incidences, RAYS)
                rows.append(row | errors_of_rays(name, flow, incidences[:: count // checked], RAYS))
    return rows


def fields(names: tuple[str, ...] = BODIES, count: int = 256, checked: int = 4) -> list[Row]:
    """Table 2: monostatic field, soft and hard, at 8 wavenumbers from 15 to 60; differences to one by one over |f|.

    "off" is the share of incidences whose creeping field by the map is 10 % or more off that by order 8.
    """
    rows = []
    incidences = fibonacci_directions(count)
    request = sweep_request(
        "monostatic", length=LENGTH, n_rays=RAYS, wavenumbers=WAVENUMBERS, boundary=["soft", "hard"]
    )
    for name in names:
        reference: Any = None
        for direct in (True, False):
            sweeper = Sweeper(flow_of(name, TOLERANCES[0], direct), request)
            seconds = seconds_of(partial(sweeper, incidences), REPEATS) / count
            found = sweeper(incidences)
            reference = found if direct else reference
            row = {"body": name, "flow": "order 8" if direct else "map", "per s": 1 / seconds, "us": 1e6 * seconds}
            row["unresolved"] = float(np.mean(found["unresolved"]))
            row["status > 0"] = int(np.sum(found["incidence_status"] > 0))
            gap = np.abs(found["creeping"] - reference["creeping"]) > 0.1 * np.abs(reference["creeping"])
            row["off"] = float(np.mean(np.any(gap & ~found["unresolved"], axis=(1, 2))))
            row |= _against_finer(name, found, incidences, request, checked)
            rows.append(row)
    return rows


def _against_finer(name: str, found: dict[str, Any], incidences: FloatArray, request: Any, checked: int) -> Row:
    """Creeping and reflected fields against those of an exact flow and four times the rays, each over its own size."""
    some = np.flatnonzero(found["incidence_status"] < SINGULAR)[:: max(1, len(incidences) // checked)]
    more = replace(request, n_rays=4 * request.n_rays)
    plain = Sweeper(cr.DirectFlow(body(name), rtol=1e-10), more)(incidences[some])
    gaps = {}
    for part in ("creeping", "reflected"):
        exact = plain[part]
        size = np.abs(exact)
        clear = (size > 0) & ~plain["unresolved"] & ~found["unresolved"][some]
        gap = (np.abs(found[part][some] - exact) / np.where(clear, size, 1.0))[clear]
        gaps[f"{part}, median"] = float(np.median(gap)) if gap.size else np.nan
        gaps[f"{part}, 90 %"] = float(np.quantile(gap, 0.9)) if gap.size else np.nan
    return gaps | {"checked": len(some)}


def gridded(count: int = 256, checked: int = 4, n_rays: int = 128) -> list[Row]:
    """Table 3: twisted ellipsoid given by samples on 64^3 nodes, 128 rays: what a body from a mesh costs."""
    incidences, rows = fibonacci_directions(count), []
    for direct in (False, True):
        few = incidences[:: count // 16] if direct else incidences
        flow = flow_of("gridded", TOLERANCES[0], direct)
        row = {"body": "gridded", "flow": "order 8" if direct else "map", **_parts("gridded", flow, few, n_rays)}
        rows.append(row | errors_of_rays("gridded", flow, incidences[:: count // checked], n_rays))
    return rows


def against_scipy(names: tuple[str, ...] = BODIES, count: int = 512, lines: int = 3, rays: int = 24) -> list[Row]:
    """Table 4: seconds an incidence of `shadow_line` and scipy's DOP853 ray by ray, over those of the sweep."""
    rows = []
    for name in names:
        incidences = fibonacci_directions(count)
        flow = flow_of(name, TOLERANCES[0])
        mine = 1 / _parts(name, flow, incidences, RAYS)["per s"]
        error = errors_of_rays(name, flow, incidences[:: count // 8], RAYS)["points"]
        few = incidences[count // 3 :: count // 3][:lines]
        shape, form = body(name), closed_form(name)
        line = seconds_of(partial(_lines_one_by_one, shape, few), 1) / len(few)
        found = shadow_lines(shape, few, rays)
        states = pack(found.launch.points.reshape(-1, 3), np.repeat(found.directions, rays, axis=0), lanes=12)
        states = states[np.isfinite(states[:, 0])]
        times = np.array([LENGTH])
        exact = cr.DirectFlow(shape, rtol=1e-12).transport(states, times)[:, 0]
        for rtol in STEPS_OF_SCIPY:
            ends = scipy_flow(form, states, times, rtol=rtol, carry_jacobi=True)[:, 0]
            gap = float(np.sqrt(np.mean(np.sum((ends[:, :3] - exact[:, :3]) ** 2, axis=1))))
            if gap <= error:
                break
        ray = seconds_of(partial(scipy_flow, form, states, times, rtol=rtol, carry_jacobi=True), 1)
        theirs = line + RAYS * ray / len(states)
        row = {"body": name, "sweep ms": 1e3 * mine, "line ms": 1e3 * line, "scipy ms": 1e3 * theirs}
        row |= {"rtol": rtol, "error": error, "scipy error": gap, "ratio": theirs / mine}
        rows.append(row | {"ratio of rays": (theirs - line) / mine})
    return rows


def _lines_one_by_one(shape: Any, incidences: FloatArray) -> list[cr.ShadowLine]:
    return [cr.shadow_line(shape, d) for d in incidences]


def growth(
    numbers: tuple[int, ...] = (10, 100, 1000, 10_000),
    rays: tuple[int, ...] = (64, 128, 256, 512, 1024),
    wavenumbers: tuple[int, ...] = (1, 2, 4, 8, 16, 32),
    count: int = 128,
) -> list[Row]:
    """Table 5: twisted ellipsoid by the map; how seconds grow with incidences, rays and wavenumbers."""
    flow, incidences = flow_of("twisted", TOLERANCES[0]), fibonacci_directions(count)

    def run(d: FloatArray, **options: Any) -> float:
        sweeper = Sweeper(flow, sweep_request(length=LENGTH, **options))
        return seconds_of(lambda: sweeper(d), REPEATS)

    by_number = [run(fibonacci_directions(n), quantity="rays", n_rays=64) for n in numbers]
    by_rays = [run(incidences, quantity="rays", n_rays=n) for n in rays]
    by_k = [
        run(incidences, quantity="monostatic", wavenumbers=np.linspace(15, 60, n), boundary=["soft", "hard"])
        for n in wavenumbers
    ]
    points = (("incidences", numbers, by_number), ("rays", rays, by_rays), ("wavenumbers", wavenumbers, by_k))
    return [_power(what, x, y) for what, x, y in points]


def _power(what: str, x: Any, y: list[float]) -> Row:
    """Points with the exponent of y = c x^e, over all and over the upper half."""
    slope, late = (float(np.polyfit(np.log(x[s:]), np.log(y[s:]), 1)[0]) for s in (0, len(x) // 2))
    text = ", ".join(f"{a:g}: {b:.2e}" for a, b in zip(x, y, strict=True))
    return {"against": what, "exponent": slope, "of the upper half": late, "seconds": text}


TABLES: tuple[Callable[..., list[Row]], ...] = (fans, fields, gridded, against_scipy, growth)
QUICK: dict[str, Any] = {
    "fans": {"count": 64, "checked": 4},
    "fields": {"count": 32, "checked": 2},
    "gridded": {"count": 32, "checked": 2},
    "against_scipy": {"count": 64, "lines": 1, "rays": 4},
    "growth": {"numbers": (10, 100, 1000), "rays": (64, 128, 256), "wavenumbers": (1, 4, 16), "count": 16},
}


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description="Cost of an incidence of a sweep.")
    parser.add_argument("--quick", action="store_true", help="fewer incidences")
    parser.add_argument("--tables", type=int, nargs="+", default=range(1, 6), help="numbers of the tables wanted")
    given = parser.parse_args()
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.2f}")
    with threads(1):
        for table in [TABLES[number - 1] for number in given.tables]:
            show((table.__doc__ or "").splitlines()[0], table(**QUICK[table.__name__] if given.quick else {}))


if __name__ == "__main__":
    main()
