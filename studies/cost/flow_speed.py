"""What does a ray cost? Phase maps against direct integration and scipy at equal error, all in one run.

Rays of length 8; errors are the rms of (x, p) at their ends over fresh random rays, against order 8 at 1e-13. Times are
processor times on one core, least of several. scipy integrates closed forms, of the body given by samples that of the
one that was sampled. Run ``python -m studies flow_speed [--quick]`` (ten minutes).
"""

import math
import time
from collections.abc import Iterator
from functools import partial

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any
from creeping.phaseflow.building import measure
from studies import tables
from studies.cost.flow_cases import (
    BODIES,
    EXPENSIVE,
    LENGTH,
    REPEATS,
    body,
    built,
    card,
    direct_at,
    pencils,
    random_rays,
    rms,
    sample,
    scipy_at_error,
    seconds_each,
    seconds_of,
    threads,
)
from studies.tables import Row

NS = 1e9 / LENGTH
TUNED = (1e4, 3e4, 1e5, 3e5, 1e6)
"""Numbers of rays for which maps are tuned, to find the one that pays soonest."""
EXAMPLES: dict[str, tuple[Any, tuple[int, ...]]] = {
    "1 ellipsoid": (sc.Ellipsoid(1.2, 0.8, 0.8), (16, 64)),
    "2 torus": (sc.Torus(), (32, 64, 64)),
    "3 speed 1 + x": (sc.Sphere(speed="1 + x"), (16, 64)),
    "4 twisted": (sc.TwistedEllipsoid(), (24, 96)),
}
"""Bodies and grids of [YC06b]."""
PAPER = 200
"""Points of the paper, whose error is (sum e^2)^(1/2)/N: the rms over the root of N."""


def long_leaps(names: tuple[str, ...] = BODIES, count: int = 65_536, samples: int = 4000) -> Iterator[Row]:
    """Rays at random and in pencils, ns per ray and unit of length, states only, at equal error."""
    for name in names:
        # for so many rays that only the composition counts
        flow, fresh = built(name, rays=1e8)[0], sample(name, samples)
        rays = random_rays(body(name), count)
        error = fresh.error(flow)
        direct = direct_at(name, error)
        known = sample("twisted", samples) if name == "gridded" else fresh
        scipy, scipy_error = scipy_at_error(known, error)
        row = {"body": name, "map": NS * seconds_each(flow, rays)}
        row["pencils"] = NS * seconds_each(flow, pencils(body(name), count))
        row["order 8"] = NS * seconds_each(direct, rays[: min(count, 1024)] if name in EXPENSIVE else rays, 3)
        row |= {"scipy": NS * scipy, "map error": error, "order 8 error": fresh.error(direct)}
        yield row | {"scipy error": scipy_error, **card(flow)}


def break_even(
    names: tuple[str, ...] = BODIES, tuned: tuple[float, ...] = TUNED, count: int = 4096, samples: int = 4000
) -> Iterator[Row]:
    """Rays from which a map and its build are faster than order 8 at the error of the map; us per ray."""
    for name in names:
        few = random_rays(body(name), min(count, 1024) if name in EXPENSIVE else count)
        # fewer where a build is expensive
        for number in tuned[::2] if name in EXPENSIVE else tuned:
            try:
                flow, seconds = built(name, number)
            except cr.ToleranceError:
                continue
            error = sample(name, samples).error(flow)
            direct = direct_at(name, error)
            composed, order8 = seconds_each(flow, random_rays(body(name), count)), seconds_each(direct, few, 3)
            row = {
                "body": name,
                "tuned for": number,
                "build s": seconds,
                "map": 1e6 * composed,
                "order 8": 1e6 * order8,
            }
            row |= {"map error": error}
            row["order 8 error"] = sample(name, samples).error(direct)
            row["rays"] = seconds / (order8 - composed) if order8 > composed else math.inf
            yield row | card(flow)


def requested(
    names: tuple[str, ...] = BODIES, exponents: tuple[int, ...] = (3, 4, 5, 6, 7, 8, 9), samples: int = 4000
) -> Iterator[Row]:
    """Tolerance asked for and error reached over fresh rays; states only.

    "worst" is the largest of five such samples: on the torus a ray in thousands carries most of the error.
    """
    for name in names:
        others = () if name in EXPENSIVE else (21, 22, 23, 24)
        for exponent in exponents:
            wanted = 10.0**-exponent
            row = {"body": name, "requested": wanted, "achieved": math.nan}
            try:
                flow, seconds = built(name, tolerance=wanted)
            except cr.ToleranceError as error:
                yield row | {"remark": f"refused: {error}"}
                continue
            fresh = sample(name, samples)
            gaps = fresh.gaps(flow.transport(fresh.states, np.array([LENGTH]))[:, 0])
            row |= {"achieved": rms(gaps), "ratio": rms(gaps) / wanted}
            row["worst"] = max([rms(gaps), *(sample(name, samples, seed).error(flow) for seed in others)])
            row |= {"median": float(np.median(gaps)), "largest": float(gaps.max())}
            row["map ns"] = NS * seconds_each(flow, fresh.states)
            yield row | {"build s": seconds, **card(flow)}


def two_threads(names: tuple[str, ...] = ("ellipsoid", "twisted"), count: int = 100_000) -> Iterator[Row]:
    """Wall time on one and on two threads, s, measured in turn."""
    for name in names:
        rays = random_rays(body(name), count)
        for kind, flow in (("map", built(name)[0]), ("order 8", direct_at(name, 1e-6))):
            least = [math.inf, math.inf]
            for _ in range(2 * REPEATS):
                for k in range(2):
                    with threads(k + 1):
                        started = time.perf_counter()
                        flow.transport(rays, np.array([LENGTH]))
                        least[k] = min(least[k], time.perf_counter() - started)
            yield {"body": name, "flow": kind, "one": least[0], "two": least[1], "two/one": least[1] / least[0]}


def sizes(
    numbers: tuple[int, ...] = (1000, 10_000, 100_000, 1_000_000), nodes: tuple[int, ...] = (20, 30, 40, 50, 60)
) -> Iterator[Row]:
    """Exponents e of y = c x^e: cost by rays of the ellipsoid, error and build by nodes of a triaxial one."""
    flow = built("ellipsoid")[0]
    rays = [n * seconds_each(flow, random_rays(body("ellipsoid"), n)) for n in numbers]
    errors, builds, totals = [], [], []
    for n in nodes:
        grid: Any = {"grid": (n, 2 * n), "horizon": 1.0, "degree": 5, "precision": "double", "carry_jacobi": False}
        started = time.process_time()
        one = cr.build_phase_map(body("triaxial"), cache=False, **grid)
        builds.append(time.process_time() - started)
        errors.append(one.error.rms)
        totals.append(len(one.leaps[-1].state) * int(np.prod(one.grid.nodes)))
    for size, what, x, y in (
        ("rays", "map s", numbers, rays),
        ("side", "leap error", nodes, errors),
        ("nodes", "build s", totals, builds),
    ):
        exponent = float(np.polyfit(np.log(x), np.log(y), 1)[0])
        points = ", ".join(f"{a:g}: {b:.2e}" for a, b in zip(x, y, strict=True))
        yield {"against": size, "quantity": what, "exponent": exponent, "points": points}


def one_leap(samples: int = 2000, tolerance: float = 1e-6) -> Iterator[Row]:
    """One g_T0 by Algorithm 1 on the grids of [YC06b], and by the maps that are chosen for 1e-6: error and build.

    T0 = 1/8, tau = 2^-10, S = 7, B = 2, cubic splines; errors over random points of T1Q, seconds of a second build.
    """
    paper: dict[str, Any] = {"horizon": 1 / 8, "time_step": 2**-10, "stages": 7, "degree": 3, "method": "tower"}
    asked = [(name, shape, paper | {"grid": grid}) for name, (shape, grid) in EXAMPLES.items()]
    chosen = {"sphere": sc.Sphere(), **{name[2:]: shape for name, (shape, _) in EXAMPLES.items()}}
    asked += [(name, shape, {"tolerance": tolerance}) for name, shape in chosen.items()]
    for name, shape, options in asked:
        seconds = seconds_of(partial(cr.build_phase_map, shape, cache=False, **options), 1)
        flow = cr.build_phase_map(shape, cache=False, **options)
        error = measure(flow, samples=samples, rng=np.random.default_rng(7))
        row = {"example": name, "rms": error.rms, "paper": error.rms / PAPER**0.5, "max": error.max}
        yield row | {"build s": seconds, **card(flow)}


QUICK: dict[str, Any] = {
    "long_leaps": {"count": 4096, "samples": 1000},
    "break_even": {"names": BODIES[:3], "tuned": (1e4, 1e6)},
    "requested": {"names": BODIES[:3], "exponents": (3, 5, 7), "samples": 1000},
    "two_threads": {"count": 20_000},
    "sizes": {"numbers": (1000, 10_000, 100_000), "nodes": (20, 30, 40)},
}


if __name__ == "__main__":
    with threads(1):
        tables.main((long_leaps, break_even, requested, two_threads, sizes, one_leap), QUICK)
