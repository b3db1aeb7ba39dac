"""What the tables of `flow_speed` share: bodies, bundles of rays, flows of equal error, and their costs."""

import math
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any, FloatArray
from creeping.geodesics.bundle import random_bundle_points
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.states import pack
from creeping.geometry.surface import normal
from creeping.phaseflow.tuning.flow_choice import tuned_direct
from creeping.phaseflow.tuning.map_spec import MapSpec
from creeping.phaseflow.tuning.request import build_from
from studies._peers import heyoka_at_error, scipy_flow, seconds_of

BODIES = ("ellipsoid", "torus", "twisted", "gridded")
EXPENSIVE = ("gridded",)
"""Bodies whose F takes a microsecond: fewer rays are integrated directly."""
LENGTH = 8.0
TOLERANCE = 1e-6
FAN_OUTPUTS = 64
REPEATS = 5
PENCIL, OPENING = 32, 0.02
"""Rays of a pencil and its opening angle, rad."""
DIRECTION = np.ones(3) / np.sqrt(3)
"""Of the incident wave whose fan is measured."""
SCIPY_RAYS = 16


Row = dict[str, Any]
"""One line of a table: headings with their values."""


@cache
def body(name: str) -> Any:
    """Body of a name; "gridded" is the twisted ellipsoid given by samples on 64^3 nodes."""
    match name:
        case "ellipsoid":
            return sc.Ellipsoid(1.2, 0.8, 0.8)
        case "triaxial":
            return sc.Ellipsoid(1.37, 0.91, 0.66)
        case "torus":
            return sc.Torus()
        case "twisted":
            return sc.TwistedEllipsoid()
        case "gridded":
            return sc.Gridded.sampled(sc.TwistedEllipsoid(), 64)
    raise KeyError(name)


def closed_form(name: str) -> Any:
    """Body that the peers integrate: of samples the one that was sampled, since they have no splines."""
    return body("twisted" if name == "gridded" else name)


def random_rays(shape: Any, count: int, seed: int = 11) -> FloatArray:
    """States (count, 6) at random in T1Q."""
    return pack(*random_bundle_points(shape, count, rng=np.random.default_rng(seed)))


def pencils(shape: Any, count: int) -> FloatArray:
    """States (count, 6): narrow pencils from random points, consecutive rays being neighbours."""
    x, p = random_bundle_points(shape, -(-count // PENCIL), rng=np.random.default_rng(12))
    across = np.cross(normal(shape, x), p)
    angle = np.tile(np.linspace(-OPENING / 2, OPENING / 2, PENCIL), len(x))[:, None]
    x, p, across = (np.repeat(rows, PENCIL, axis=0) for rows in (x, p, across))
    return pack(x, p * np.cos(angle) + across * np.sin(angle))[:count]


def fan_rays(shape: Any, count: int) -> FloatArray:
    """States (count, 11) of a fan: at equal distances along the shadow line, in the direction of the wave."""
    curve = cr.shadow_line(shape, DIRECTION).curves[0]
    x = curve.at(curve.length * np.arange(count) / count)
    states = pack(x, np.broadcast_to(DIRECTION, x.shape), jacobi=True)
    return np.pad(states, ((0, 0), (0, 1)))


def rms(found: FloatArray, exact: FloatArray) -> float:
    """Rms of |(x, p) - exact|, the norm in R^6: (n, 6 or more), (n, 6 or more)."""
    gap = found[:, :6] - exact[:, :6]
    return float(np.sqrt(np.mean(np.sum(gap * gap, axis=1))))


@dataclass(frozen=True)
class Sample:
    """Fresh rays with their exact states at LENGTH, by which every flow's error is measured."""

    body: Any
    states: FloatArray
    exact: FloatArray

    def gaps(self, flow: Any) -> FloatArray:
        """Errors |(x, p) - exact| of a flow."""
        found = flow.transport(self.states, np.array([LENGTH]))[:, 0]
        return np.asarray(np.linalg.norm(found - self.exact, axis=1))

    def error(self, flow: Any) -> float:
        """Their rms."""
        return float(np.sqrt(np.mean(self.gaps(flow) ** 2)))

    def few(self, count: int) -> "Sample":
        """The first of the rays."""
        return Sample(self.body, self.states[:count], self.exact[:count])


@cache
def sample(name: str, count: int, seed: int = 11) -> Sample:
    """Fresh random rays, traced at 1e-13; at most 400 where F is expensive."""
    states = random_rays(body(name), min(count, 400) if name in EXPENSIVE else count, seed)
    return Sample(body(name), states, trace_states(body(name), states, np.array([LENGTH]), rtol=1e-13)[:, 0])


def seconds_each(flow: Any, states: FloatArray, n_steps: int = 1, repeats: int = REPEATS) -> float:
    """Processor time of one ray of LENGTH, s: the least of several measurements."""
    times = LENGTH * np.arange(1, n_steps + 1) / n_steps
    return seconds_of(lambda: flow.transport(states, times), repeats) / len(states)


@dataclass(frozen=True)
class Build:
    """A map with what it cost.

    Attributes
    ----------
    rays : float
        For which it was tuned.
    flow : PhaseMap
    seconds : float
        Of the whole build, probing and measuring included.
    """

    rays: float
    flow: cr.PhaseMap
    seconds: float


@cache
def built(name: str, rays: float = 1e6, n_steps: int = 1, tolerance: float = TOLERANCE) -> Build:
    """Map for rays of LENGTH, with the Jacobi matrix if there are outputs in between; kernels compiled before.

    Raises
    ------
    ToleranceError
        If there is none.
    """
    shape = body(name)
    _compile(name, n_steps > 1)
    spec = MapSpec(
        body=shape, tolerance=tolerance, length=LENGTH, n_steps=n_steps, n_rays=int(rays), carry_jacobi=n_steps > 1
    )
    started = time.process_time()
    flow = build_from(spec, lambda _: None)
    return Build(rays, flow, time.process_time() - started)


@cache
def _compile(name: str, carry_jacobi: bool) -> None:
    """Compile the kernels of every kind of table by maps that cost little."""
    for degree in (3, 5):
        for precision in ("single", "double"):
            cr.build_phase_map(
                body(name), tolerance=1e-2, length=2.0, degree=degree, precision=precision, carry_jacobi=carry_jacobi,
                cache=False,
            )  # fmt: skip


@cache
def direct_at(name: str, tolerance: float, n_steps: int = 1) -> cr.DirectFlow:
    """Order-8 integration with the longest equal steps that meet the tolerance."""
    return tuned_direct(body(name), LENGTH, n_steps, tolerance, n_steps > 1)[0]


def peers(name: str, target: float, count: int, samples: int) -> dict[str, float]:
    """Seconds a ray, and errors, of heyoka (nan if it is not installed) and scipy on the closed form."""
    shape, times = closed_form(name), np.array([LENGTH])
    states = random_rays(shape, count)
    fresh = sample("twisted" if name == "gridded" else name, samples)
    found = dict.fromkeys(("heyoka", "heyoka error", "scipy", "scipy error"), float("nan"))
    try:
        series = heyoka_at_error(shape, fresh.states, times, fresh.exact[:, None], target, False)
    except ImportError:
        pass
    else:
        found["heyoka error"] = rms(series.flow(fresh.states, times)[:, -1], fresh.exact)
        found["heyoka"] = seconds_of(lambda: series.flow(states, times), 2) / len(states)
    found["scipy"], found["scipy error"] = _scipy_at_error(fresh.few(SCIPY_RAYS), target)
    return found


def _scipy_at_error(fresh: Sample, target: float) -> tuple[float, float]:
    """Seconds a ray of scipy's DOP853 at the loosest tolerance whose error is <= target, and the error."""

    def run(exponent: float) -> FloatArray:
        return scipy_flow(fresh.body, fresh.states, np.array([LENGTH]), rtol=10.0**exponent)[:, 0]

    loose, fine = -4.0, -13.0
    while loose - fine > 0.2:
        middle = (loose + fine) / 2
        if rms(run(middle), fresh.exact) <= target:
            fine = middle
        else:
            loose = middle
    return seconds_of(lambda: run(fine), 1) / len(fresh.states), rms(run(fine), fresh.exact)


@contextmanager
def threads(count: int) -> Iterator[None]:
    """Run with so many threads."""
    before = os.environ.get("CREEPING_THREADS")
    os.environ["CREEPING_THREADS"] = str(count)
    try:
        yield
    finally:
        if before is None:
            del os.environ["CREEPING_THREADS"]
        else:
            os.environ["CREEPING_THREADS"] = before


def wall_by_threads(call: Callable[[], object], counts: tuple[int, ...]) -> list[float]:
    """Least wall times on so many threads, measured in turn, s."""
    least = [float("inf")] * len(counts)
    for _ in range(2 * REPEATS):
        for k, count in enumerate(counts):
            with threads(count):
                started = time.perf_counter()
                call()
                least[k] = min(least[k], time.perf_counter() - started)
    return least


def attempted(name: str, rays: float = 1e6, n_steps: int = 1, tolerance: float = TOLERANCE) -> Build | str:
    """The map, or why there is none."""
    try:
        return built(name, rays, n_steps, tolerance)
    except cr.ToleranceError as error:
        return str(error)


def variants(name: str, tuned: tuple[float, ...], n_steps: int, count: int) -> list[tuple[Build, float]]:
    """Maps tuned for several numbers of rays, fewer where a build is expensive, with the seconds of a ray."""
    rays = starts(name, count, n_steps)
    found = [attempted(name, n, n_steps) for n in (tuned[::2] if name in EXPENSIVE else tuned)]
    return [(one, seconds_each(one.flow, rays, n_steps)) for one in found if isinstance(one, Build)]


def starts(name: str, count: int, n_steps: int) -> FloatArray:
    """Random rays, with the Jacobi matrix if there are outputs in between."""
    x, p = random_bundle_points(body(name), count, rng=np.random.default_rng(11))
    return pack(x, p, jacobi=n_steps > 1)


def card(flow: cr.PhaseMap) -> Row:
    """Horizon, grid and size of a map, for a table."""
    leap = flow.leaps[-1]
    grid = "x".join(map(str, (len(leap.state), *flow.grid.nodes)))
    return {"T0": flow.horizon, "grid": f"{grid} p{flow.grid.degree} {leap.state.dtype}", "MB": flow.nbytes / 1e6}


def show(title: str, rows: list[Row]) -> None:
    """Print a table in columns of fixed width, the last one ragged."""
    headings = list(dict.fromkeys(key for row in rows for key in row))
    lines = [headings, *([_text(row.get(key, "")) for key in headings] for row in rows)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(headings) - 1)]
    print(f"\n{title}")
    for line in lines:
        cells = [f"{cell:>{width}}" for cell, width in zip(line, widths, strict=False)]
        print("  ".join([*cells, line[-1]]).rstrip(), flush=True)


def _text(value: Any) -> str:
    if not isinstance(value, float):
        return str(value)
    if math.isnan(value):
        return "-"
    return f"{value:.1e}" if value != 0 and not 1e-3 <= abs(value) < 1e4 else f"{value:.3g}"


def plain(value: Any) -> Any:
    """The same without nan and infinity, which json has not."""
    if isinstance(value, dict):
        return {key: plain(one) for key, one in value.items()}
    if isinstance(value, list):
        return [plain(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def draw(rows: list[Row], path: Path) -> None:
    """Error reached against tolerance asked for, log-log."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(5, 4.5), layout="constrained")
    axes = figure.add_subplot(xlabel="requested rms error at length 8", ylabel="achieved", xscale="log", yscale="log")
    for name in dict.fromkeys(row["body"] for row in rows):
        mine = [row for row in rows if row["body"] == name]
        axes.plot([row["requested"] for row in mine], [row["achieved"] for row in mine], "o-", ms=4, label=name)
    ends = [min(row["requested"] for row in rows), max(row["requested"] for row in rows)]
    axes.plot(ends, ends, "k--", lw=0.8, label="requested")
    axes.legend()
    figure.savefig(path, dpi=150)
