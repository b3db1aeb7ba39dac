"""What does a ray cost? Phase maps against direct integration and scipy at equal error, all in one run.

Rays of length 8; errors are the rms of (x, p) at their ends over fresh random rays, against order 8 at 1e-13. Times are
processor times on one core, least of several. scipy integrates closed forms, of the body given by samples that of the
one that was sampled. F and p.Hp of the closed forms are not shortened by F = 0 and |p| = 1, which hold on T1Q alone:
shortened, the flow would leave T1Q exponentially where kappa_n < 0.

Run ``python -m studies flow_speed [--quick]`` (ten minutes).
"""

import math
import os
import time
import timeit
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import cache, partial
from unittest.mock import patch

import numpy as np
from scipy.integrate import solve_ivp

import creeping as cr
import scatterers as sc
from creeping._typing import Any, FloatArray
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.states import pack, random_bundle_points
from creeping.geometry.surface import normal
from creeping.phaseflow.building import measure
from creeping.phaseflow.request import tuned_direct
from studies import Row, main
from studies.accuracy.bodies import rms

BODIES = ("ellipsoid", "torus", "twisted", "gridded")
EXPENSIVE = ("gridded",)
"""Bodies whose F takes a microsecond: fewer rays are integrated directly."""
LENGTH = 8.0
NS = 1e9 / LENGTH


@cache
def body(name: str) -> Any:
    """Body of a name; "gridded" is the twisted ellipsoid given by samples on 64^3 nodes."""
    shapes: dict[str, Callable[[], Any]] = {
        "ellipsoid": lambda: sc.Ellipsoid(1.2, 0.8, 0.8),
        "triaxial": lambda: sc.Ellipsoid(1.37, 0.91, 0.66),
        "torus": sc.Torus,
        "twisted": sc.TwistedEllipsoid,
        "gridded": lambda: sc.Gridded.sampled(sc.TwistedEllipsoid(), 64),
        "peanut": lambda: sc.Implicit("(x**2 + y**2 + z**2 + 0.64)**2 - 2.56*x**2 - 0.6561"),
        "bumpy": lambda: sc.Implicit("x**2 + y**2 + z**2 - 1 - 0.3*sin(3*x)*sin(3*y)*sin(3*z)"),
    }
    return shapes[name]()


def random_rays(shape: Any, count: int) -> FloatArray:
    """States (count, 6) at random in T1Q."""
    return pack(*random_bundle_points(shape, count, rng=np.random.default_rng(11)))


def pencils(shape: Any, count: int, pencil: int = 32, opening: float = 0.02) -> FloatArray:
    """States (count, 6): pencils of so many rays within an angle, rad, from random points, neighbour by neighbour."""
    x, p = random_bundle_points(shape, -(-count // pencil), rng=np.random.default_rng(12))
    across = np.cross(normal(shape, x), p)
    angle = np.tile(np.linspace(-opening / 2, opening / 2, pencil), len(x))[:, None]
    x, p, across = (np.repeat(rows, pencil, axis=0) for rows in (x, p, across))
    return pack(x, p * np.cos(angle) + across * np.sin(angle))[:count]


@dataclass(frozen=True)
class Sample:
    """Fresh rays with their exact states at LENGTH, by which every flow's error is measured."""

    body: Any
    states: FloatArray
    exact: FloatArray

    def gaps(self, found: FloatArray) -> FloatArray:
        """Errors |(x, p) - exact| of states at the ends, the norm in R^6."""
        return np.asarray(np.linalg.norm(found - self.exact[: len(found)], axis=1))

    def error(self, flow: Any) -> float:
        """Their rms by a flow."""
        return rms(self.gaps(flow.transport(self.states, np.array([LENGTH]))[:, 0]))


@cache
def sample(name: str, count: int) -> Sample:
    """Fresh random rays, traced at 1e-13; at most 400 where F is expensive."""
    states = random_rays(body(name), min(count, 400) if name in EXPENSIVE else count)
    return Sample(body(name), states, trace_states(body(name), states, np.array([LENGTH]), rtol=1e-13)[:, 0])


def seconds_of(call: Callable[[], object], repeats: int = 3) -> float:
    """Least processor time of the calls after one for warming up, s."""
    call()
    return min(timeit.repeat(call, timer=time.process_time, number=1, repeat=repeats))


def seconds_each(flow: Any, states: FloatArray, repeats: int = 5) -> float:
    """Processor time of one ray of LENGTH, s: the least of several measurements."""
    return seconds_of(lambda: flow.transport(states, np.array([LENGTH])), repeats) / len(states)


@cache
def built(name: str, rays: float = 1e6) -> tuple[cr.PhaseMap, float]:
    """Map tuned for so many rays of LENGTH, and seconds of its build, probing included; compiled before.

    Raises
    ------
    ToleranceError
        If there is none.
    """
    _compile(name)
    started = time.process_time()
    flow = cr.build_phase_map(
        body(name), tolerance=1e-6, length=LENGTH, n_steps=1, n_rays=int(rays), carry_jacobi=False, cache=False
    )
    return flow, time.process_time() - started


@cache
def _compile(name: str) -> None:
    """Compile the kernels of every kind of table by maps that cost little."""
    cheap: dict[str, Any] = {"tolerance": 1e-2, "length": 2.0, "carry_jacobi": False, "cache": False}
    for degree in (3, 5):
        for precision in ("single", "double"):
            cr.build_phase_map(body(name), degree=degree, precision=precision, **cheap)


@cache
def direct_at(name: str, tolerance: float) -> cr.DirectFlow:
    """Order-8 integration with the longest equal steps that meet the tolerance."""
    return tuned_direct(body(name), LENGTH, 1, tolerance, False)[0]


def threads(count: int) -> AbstractContextManager[Any]:
    """Run with so many threads."""
    return patch.dict(os.environ, CREEPING_THREADS=str(count))


def card(flow: cr.PhaseMap) -> Row:
    """Horizon, grid and size of a map, for a table."""
    leap = flow.leaps[-1]
    grid = "x".join(map(str, (len(leap.state), *flow.grid.nodes)))
    return {"T0": flow.horizon, "MB": flow.nbytes / 1e6, "grid": f"{grid} p{flow.grid.degree} {leap.state.dtype}"}


def scipy_at_error(fresh: Sample, target: float, rays: int = 16) -> tuple[float, float]:
    """Seconds a ray of scipy's DOP853 at the loosest tolerance whose error is <= target, and the error."""

    def run(exponent: float) -> FloatArray:
        return scipy_flow(fresh.body, fresh.states[:rays], np.array([LENGTH]), rtol=10.0**exponent)[:, 0]

    loose, fine = -4.0, -13.0
    while loose - fine > 0.2:
        middle = (loose + fine) / 2
        if rms(fresh.gaps(run(middle))) <= target:
            fine = middle
        else:
            loose = middle
    return seconds_of(lambda: run(fine), 1) / rays, rms(fresh.gaps(run(fine)))


def scipy_flow(shape: Any, states: FloatArray, times: FloatArray, *, rtol: float) -> FloatArray:
    """Flow ray by ray with scipy's DOP853, right-hand side in plain floats.

    Parameters
    ----------
    shape : Ellipsoid, Torus or TwistedEllipsoid, without speed
    states : (n, 6)
        (x, p) on T1Q.
    times : (m,), L
        Ascending, > 0 at the end.
    rtol : float
        Tolerance per step, relative and absolute.

    Returns
    -------
    (n, m, 6)
    """
    terms = closed_form(shape)

    def rates(_: float, lanes: FloatArray) -> list[float]:
        x, y, z, u, v, w = lanes.tolist()
        gx, gy, gz, bent = terms(x, y, z, u, v, w)
        turn = -bent / (gx * gx + gy * gy + gz * gz)
        return [u, v, w, turn * gx, turn * gy, turn * gz]

    out = np.empty((len(states), len(times), 6))
    # the end of the last step needs no dense output, which costs three more evaluations
    outputs = None if len(times) == 1 else times
    for ray, state in enumerate(states[:, :6]):
        found = solve_ivp(rates, (0.0, float(times[-1])), state, method="DOP853", t_eval=outputs, rtol=rtol, atol=rtol)
        if not found.success:
            raise cr.IntegrationError(f"scipy stopped on ray {ray}: {found.message}")
        out[ray] = found.y.T[-len(times) :]
    return out


def closed_form(shape: Any) -> Callable[..., tuple[float, ...]]:
    """From the six scalars of (x, p): the gradient g of a multiple of F, and p.Hp of the same."""
    match shape:
        case sc.Ellipsoid():
            a, b, c = shape.a**-2, shape.b**-2, shape.c**-2
            return lambda x, y, z, u, v, w: (a * x, b * y, c * z, a * u * u + b * v * v + c * w * w)
        case sc.Torus():
            return _torus(shape.R)
        case sc.TwistedEllipsoid():
            return _twisted(shape)
    raise TypeError(f"no closed form for {type(shape).__name__}; give an Ellipsoid, Torus or TwistedEllipsoid")


def _torus(major: float) -> Callable[..., tuple[float, ...]]:
    def terms(x: float, y: float, z: float, u: float, v: float, w: float) -> tuple[float, ...]:
        inverse = (x * x + y * y) ** -0.5
        radial = 1.0 - major * inverse
        around = (x * v - y * u) * inverse
        return radial * x, radial * y, z, u * u + v * v + w * w - major * inverse * around * around

    return terms


def _twisted(shape: sc.TwistedEllipsoid) -> Callable[..., tuple[float, ...]]:
    a, b, c, d = shape.a**-2, shape.b**-2, shape.c**-2, shape.d

    def terms(x: float, y: float, z: float, u: float, v: float, w: float) -> tuple[float, ...]:
        shift, slope = d * math.cos(math.pi * z), (math.pi * d) * math.sin(math.pi * z)
        gy = b * (y - shift)
        along = v + slope * w
        bend = gy * math.pi**2 * shift + c
        return a * x, gy, gy * slope + c * z, a * u * u + b * along * along + bend * w * w

    return terms


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
    names: tuple[str, ...] = BODIES,
    tuned: tuple[float, ...] = (1e4, 3e4, 1e5, 3e5, 1e6),
    count: int = 4096,
    samples: int = 4000,
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
            row = {"body": name, "tuned for": number, "build s": seconds, "map": 1e6 * composed}
            row |= {"order 8": 1e6 * order8, "map error": error, "order 8 error": sample(name, samples).error(direct)}
            row["rays"] = seconds / (order8 - composed) if order8 > composed else math.inf
            yield row | card(flow)


def two_threads(names: tuple[str, ...] = ("ellipsoid", "twisted"), count: int = 100_000) -> Iterator[Row]:
    """Wall time on one and on two threads, s, measured in turn."""
    for name in names:
        rays = random_rays(body(name), count)
        for kind, flow in (("map", built(name)[0]), ("order 8", direct_at(name, 1e-6))):
            least = [math.inf, math.inf]
            for _ in range(10):
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
    examples: dict[str, tuple[Any, tuple[int, ...]]] = {
        "1 ellipsoid": (sc.Ellipsoid(1.2, 0.8, 0.8), (16, 64)),
        "2 torus": (sc.Torus(), (32, 64, 64)),
        "3 speed 1 + x": (sc.Sphere(speed="1 + x"), (16, 64)),
        "4 twisted": (sc.TwistedEllipsoid(), (24, 96)),
    }
    asked = [(name, shape, paper | {"grid": grid}) for name, (shape, grid) in examples.items()]
    chosen = {"sphere": sc.Sphere(), **{name[2:]: shape for name, (shape, _) in examples.items()}}
    asked += [(name, shape, {"tolerance": tolerance}) for name, shape in chosen.items()]
    for name, shape, options in asked:
        seconds = seconds_of(partial(cr.build_phase_map, shape, cache=False, **options), 1)
        flow = cr.build_phase_map(shape, cache=False, **options)
        error = measure(flow, samples=samples, rng=np.random.default_rng(7))
        # the paper's error is (sum e^2)^(1/2)/N of 200 points: the rms over the root of N
        row = {"example": name, "rms": error.rms, "paper": error.rms / 200**0.5, "max": error.max}
        yield row | {"build s": seconds, **card(flow)}


if __name__ == "__main__":
    quick: dict[str, Any] = {
        "long_leaps": {"count": 4096, "samples": 1000},
        "break_even": {"names": BODIES[:3], "tuned": (1e4, 1e6)},
        "two_threads": {"count": 20_000},
        "sizes": {"numbers": (1000, 10_000, 100_000), "nodes": (20, 30, 40)},
    }
    with threads(1):
        main((long_leaps, break_even, two_threads, sizes, one_leap), quick)
