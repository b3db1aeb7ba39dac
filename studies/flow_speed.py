"""What does a ray cost? Phase maps against direct integration, heyoka and scipy at equal error, all in one run.

Rays of length 8; errors are the rms of (x, p) at their ends over fresh random rays, against order 8 at 1e-13. Times are
processor times on one core, least of several. Peers integrate closed forms: beside the body given by samples stands the
one that was sampled. Run ``python -m studies.flow_speed [--quick] [-o DIR]`` (ten minutes).
"""

import argparse
import json
import math
import os
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

import creeping as cr
from creeping._typing import Any
from creeping.geodesics.integrator import trace_states
from creeping.phaseflow.tuning.flow_choice import tuned_direct
from studies import _flow_cases as cases
from studies._flow_cases import (
    BODIES,
    EXPENSIVE,
    FAN_OUTPUTS,
    LENGTH,
    TOLERANCE,
    Row,
    body,
    rms,
    sample,
    seconds_each,
    show,
)
from studies._peers import seconds_of

NS = 1e9 / LENGTH
TUNED = (1e4, 3e4, 1e5, 3e5, 1e6)
"""Numbers of rays for which maps are tuned, to find the one that pays soonest."""


def long_leaps(names: tuple[str, ...] = BODIES, count: int = 65_536, samples: int = 4000) -> list[Row]:
    """Table 1: states only, rays at random and in pencils, ns per ray and unit of length."""
    rows = []
    for name in names:
        # for so many rays that only the composition counts
        flow, fresh = cases.built(name, rays=1e8).flow, sample(name, samples)
        rays = cases.random_rays(body(name), count)
        error = fresh.error(flow)
        direct = cases.direct_at(name, error)
        random = NS * seconds_each(flow, rays)
        order8 = NS * seconds_each(direct, rays[: min(count, 1024)] if name in EXPENSIVE else rays, repeats=3)
        others = cases.peers(name, error, min(count, 4096), samples)
        heyoka, scipy = NS * others.pop("heyoka"), NS * others.pop("scipy")
        row = {"body": name, "map": random, "pencils": NS * seconds_each(flow, cases.pencils(body(name), count))}
        row |= {"order 8": order8, "heyoka": heyoka, "scipy": scipy}
        row |= {"map error": error, "order 8 error": fresh.error(direct), **others}
        row |= {"order 8/map": order8 / random, "heyoka/map": heyoka / random, "scipy/map": scipy / random}
        rows.append(row | cases.card(flow))
    return rows


def fans(names: tuple[str, ...] = BODIES, count: int = 4096, samples: int = 4000) -> list[Row]:
    """Table 2: fans of rays with Jacobi matrix and attenuation, 64 outputs, us per ray; also without the attenuation.

    Outputs shorten the steps of order 8, whose error is far below that of the map.
    """
    rows, times = [], LENGTH * np.arange(1, FAN_OUTPUTS + 1) / FAN_OUTPUTS
    for name in names:
        shape = body(name)
        flow = cases.built(name, n_steps=FAN_OUTPUTS).flow
        fan = cases.fan_rays(shape, count)
        few = fan[:: max(1, count // 256)] if name in EXPENSIVE else fan
        exact = trace_states(shape, few[:, :6].copy(), times[-1:], rtol=1e-13)[:, 0]
        direct = cases.direct_at(name, sample(name, samples).error(flow), FAN_OUTPUTS)
        order8 = partial(trace_states, shape, few, times, rtol=0.0, step=direct.step)
        with_attenuation = np.pad(fan, ((0, 0), (0, 1)), constant_values=np.inf)
        mine = 1e6 * seconds_each(flow, with_attenuation, FAN_OUTPUTS)
        full = 1e6 * seconds_of(order8, 3) / len(few)
        row = {"body": name, "map": mine, "order 8": full}
        row["map, no att."] = 1e6 * seconds_each(flow, fan[:, :10], FAN_OUTPUTS)
        row["order 8, no att."] = 1e6 * seconds_each(direct, few[:, :10], FAN_OUTPUTS, 3)
        row |= {"map error": rms(flow.transport(few[:, :10], times[-1:])[:, 0], exact)}
        row |= {"order 8 error": rms(order8()[:, -1], exact), "order 8/map": full / mine}
        rows.append(row | cases.card(flow))
    return rows


def break_even(names: tuple[str, ...] = BODIES, tuned: tuple[float, ...] = TUNED, count: int = 4096) -> list[Row]:
    """Table 3: rays from which a map and its build are faster than order 8 at the error of the map; us per ray."""
    rows = []
    for name in names:
        mine: list[Row] = []
        few = cases.random_rays(body(name), min(count, 1024) if name in EXPENSIVE else count)
        for one, composed in cases.variants(name, tuned, 1, count):
            error = sample(name, 4000).error(one.flow)
            direct = cases.direct_at(name, error)
            order8 = seconds_each(direct, few, repeats=3)
            rays = one.seconds / (order8 - composed) if order8 > composed else math.inf
            row = {"body": name, "tuned for": one.rays, "build s": one.seconds, "map": 1e6 * composed}
            row |= {"order 8": 1e6 * order8, "map error": error, "order 8 error": sample(name, 4000).error(direct)}
            mine.append(row | {"rays": rays, **cases.card(one.flow)})
        for row in mine:
            row["least"] = "*" if row["rays"] == min(one["rays"] for one in mine) else ""
        rows += mine
    return rows


def choices(
    names: tuple[str, ...] = BODIES,
    numbers: tuple[int, ...] = (1000, 10_000, 100_000, 1_000_000),
    tuned: tuple[float, ...] = TUNED,
    count: int = 4096,
) -> list[Row]:
    """Table 4: seconds of choose_flow and its rays, against the better of maps and order 8.

    "ratio" lets order 8 find its steps first, as the choice does; "bare" knows them beforehand; "decision" leaves out
    the time spent on choosing, but for the build of a map.
    """
    rows = []
    for name in names:
        for n_steps in (1, FAN_OUTPUTS):
            known = cases.variants(name, tuned, n_steps, min(count, 1024) if n_steps > 1 else count)
            few = cases.starts(name, 256 if name in EXPENSIVE else 1024, n_steps)
            started = time.process_time()
            direct = tuned_direct(body(name), LENGTH, n_steps, TOLERANCE, n_steps > 1)[0]
            tuning = time.process_time() - started
            order8 = seconds_each(direct, few, n_steps, 3)
            for rays in numbers:
                row = {"body": name, "outputs": n_steps, **_choice(name, rays, n_steps, count)}
                best = min((one.seconds + rays * each for one, each in known), default=math.inf)
                better, bare = min(best, tuning + rays * order8), min(best, rays * order8)
                row |= {"with a map": best, "order 8": rays * order8, "its tuning": tuning}
                spent = row["choosing"] if row["choice"] == "map" else 0.0
                decision = (spent + rays * 1e-6 * row["us"]) / bare
                rows.append(row | {"ratio": row["total"] / better, "bare": row["total"] / bare, "decision": decision})
    return rows


def _choice(name: str, rays: int, n_steps: int, count: int) -> Row:
    started = time.process_time()
    flow = cr.choose_flow(
        body(name),
        n_rays=rays,
        length=LENGTH,
        tolerance=TOLERANCE,
        n_steps=n_steps,
        carry_jacobi=n_steps > 1,
        cache=False,
    )
    spent = time.process_time() - started
    composed = isinstance(flow, cr.PhaseMap)
    # the better of both has been measured with as many rays
    few = 256 if name in EXPENSIVE and not composed else min(count, 1024) if n_steps > 1 or not composed else count
    each = seconds_each(flow, cases.starts(name, few, n_steps), n_steps, 3)
    kind = "map" if composed else "order 8"
    return {"rays": rays, "choice": kind, "choosing": spent, "us": 1e6 * each, "total": spent + rays * each}


def requested(
    names: tuple[str, ...] = BODIES, exponents: tuple[int, ...] = (3, 4, 5, 6, 7, 8, 9), samples: int = 4000
) -> list[Row]:
    """Table 5: tolerance asked for and error reached over fresh rays; states only.

    "worst" is the largest of five such samples: on the torus a ray in thousands carries most of the error.
    """
    rows = []
    for name in names:
        others = () if name in EXPENSIVE else (21, 22, 23, 24)
        for exponent in exponents:
            wanted = 10.0**-exponent
            one = cases.attempted(name, tolerance=wanted)
            if isinstance(one, str):
                rows.append({"body": name, "requested": wanted, "achieved": math.nan, "remark": f"refused: {one}"})
                continue
            gaps = sample(name, samples).gaps(one.flow)
            error = float(np.sqrt(np.mean(gaps**2)))
            row = {"body": name, "requested": wanted, "achieved": error, "ratio": error / wanted}
            row["worst"] = max([error, *(sample(name, samples, seed).error(one.flow) for seed in others)])
            row |= {"median": float(np.median(gaps)), "largest": float(gaps.max())}
            row["map ns"] = NS * seconds_each(one.flow, sample(name, samples).states)
            rows.append(row | {"build s": one.seconds, **cases.card(one.flow)})
    return rows


def two_threads(names: tuple[str, ...] = ("ellipsoid", "twisted"), count: int = 100_000) -> list[Row]:
    """Table 6: wall time on one and on two threads, s."""
    rows, times = [], np.array([LENGTH])
    for name in names:
        flow, rays = cases.built(name).flow, cases.random_rays(body(name), count)
        for kind, one in (("map", flow), ("order 8", cases.direct_at(name, TOLERANCE))):
            spent = cases.wall_by_threads(partial(one.transport, rays, times), (1, 2))
            rows.append({"body": name, "flow": kind, "one": spent[0], "two": spent[1], "two/one": spent[1] / spent[0]})
    return rows


def sizes(
    numbers: tuple[int, ...] = (1000, 10_000, 100_000, 1_000_000), nodes: Any = (20, 30, 40, 50, 60)
) -> list[Row]:
    """Table 7: cost against rays of the ellipsoid, error and build against nodes of a triaxial one, fitted."""
    flow, shape = cases.built("ellipsoid").flow, body("ellipsoid")
    rays = [n * seconds_each(flow, cases.random_rays(shape, n)) for n in numbers]
    errors, builds, totals = [], [], []
    for n in nodes:
        grid: Any = {"grid": (n, 2 * n), "horizon": 1.0, "degree": 5, "precision": "double", "carry_jacobi": False}
        started = time.process_time()
        one = cr.build_phase_map(body("triaxial"), cache=False, **grid)
        builds.append(time.process_time() - started)
        errors.append(one.error.rms)
        totals.append(len(one.leaps[-1].state) * int(np.prod(one.grid.nodes)))
    found = (
        ("rays", "map s", numbers, rays),
        ("side", "leap error", nodes, errors),
        ("nodes", "build s", totals, builds),
    )
    return [_power(*one) for one in found]


def _power(size: str, what: str, x: Any, y: list[float]) -> Row:
    """Points with the exponent of y = c x^e."""
    exponent = float(np.polyfit(np.log(x), np.log(y), 1)[0])
    points = ", ".join(f"{a:g}: {b:.2e}" for a, b in zip(x, y, strict=True))
    return {"against": size, "quantity": what, "exponent": exponent, "points": points}


TABLES: tuple[Callable[..., list[Row]], ...] = (
    long_leaps, fans, break_even, choices, requested, two_threads, sizes,
)  # fmt: skip
QUICK: dict[str, Any] = {
    "long_leaps": {"count": 4096, "samples": 1000},
    "fans": {"count": 512, "samples": 1000},
    "break_even": {"names": BODIES[:3], "tuned": (1e4, 1e6)},
    "choices": {"names": BODIES[:3], "tuned": (1e4, 1e6)},
    "requested": {"names": BODIES[:3], "exponents": (3, 5, 7), "samples": 1000},
    "two_threads": {"count": 20_000},
    "sizes": {"numbers": (1000, 10_000, 100_000), "nodes": (20, 30, 40)},
}


def main() -> None:
    """Print the tables, and write them to a folder if one is given."""
    parser = argparse.ArgumentParser(description="Cost of rays by phase maps, order 8, heyoka and scipy.")
    parser.add_argument("--quick", action="store_true", help="fewer rays and bodies")
    parser.add_argument("--tables", type=int, nargs="+", default=range(1, 8), help="numbers of the tables wanted")
    parser.add_argument("-o", metavar="DIR", type=Path, help="folder for flow_speed.json and requested.png")
    given = parser.parse_args()
    print(f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.2f}")
    found = {}
    with cases.threads(1):
        for table in [TABLES[number - 1] for number in given.tables]:
            found[table.__name__] = rows = table(**QUICK[table.__name__] if given.quick else {})
            show((table.__doc__ or "").splitlines()[0], rows)
    if given.o:
        given.o.mkdir(parents=True, exist_ok=True)
        (given.o / "flow_speed.json").write_text(json.dumps(cases.plain(found), indent=1))
        if "requested" in found:
            cases.draw(found["requested"], given.o / "requested.png")


if __name__ == "__main__":
    main()
