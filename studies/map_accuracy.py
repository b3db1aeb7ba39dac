"""How accurate is one g_T0, and what does it cost to build? The four examples of the paper, and maps from a tolerance.

Algorithm 1 with T0 = 1/8, tau = 2^-10, S = 7, B = 2, cubic splines on the grids of [YC06b], and the maps that
``build_phase_map`` chooses for 1e-6. Errors are rms and largest |(x, p) - traced| over random points of T1Q; seconds
are processor time of a second build, so that compilation does not count. Run ``python -m studies.map_accuracy``.
"""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

import creeping as cr
import scatterers as sc
from creeping.phaseflow.building import measure

SAMPLES = 2000

EXAMPLES: dict[str, tuple[Any, tuple[int, ...]]] = {
    "1 ellipsoid 1.2, 0.8, 0.8": (sc.Ellipsoid(1.2, 0.8, 0.8), (16, 64)),
    "2 torus": (sc.Torus(), (32, 64, 64)),
    "3 sphere, speed 1 + x": (sc.Sphere(speed="1 + x"), (16, 64)),
    "4 twisted ellipsoid": (sc.TwistedEllipsoid(), (24, 96)),
}
TOLERANCE = 1e-6
PAPER = 200
"""Points of the paper, whose error is (sum e^2)^(1/2)/N: the rms over the root of N."""


def timed(build: Callable[[], cr.PhaseMap]) -> tuple[cr.PhaseMap, float]:
    """Build twice; the second map and its processor time, s."""
    build()
    started = time.process_time()
    flow = build()
    return flow, time.process_time() - started


def rows() -> list[tuple[str, cr.PhaseMap, float]]:
    """All builds: (name, map, seconds)."""
    found = []
    for name, (body, grid) in EXAMPLES.items():

        def tower(body: Any = body, grid: Any = grid) -> cr.PhaseMap:
            return cr.build_phase_map(
                body, horizon=1 / 8, time_step=2**-10, stages=7, grid=grid, degree=3, method="tower", cache=False
            )

        found.append((name, *timed(tower)))
    for body in (sc.Sphere(), *(body for body, _ in EXAMPLES.values())):

        def chosen(body: Any = body) -> cr.PhaseMap:
            return cr.build_phase_map(body, tolerance=TOLERANCE, cache=False)

        label = type(body).__name__ + (f", speed {body.speed.expression}" if body.speed else "")
        found.append((f"{TOLERANCE:g}: {label}", *timed(chosen)))
    return found


def main() -> None:
    """Print the table."""
    print(
        f"{'case':28} {'T0':>6} {'nodes':>20} {'degree':>6} {'MB':>5} {'rms':>8} {'paper':>8} {'max':>8} {'build s':>8}"
    )
    for name, flow, seconds in rows():
        error = measure(flow, samples=SAMPLES, rng=np.random.default_rng(7))
        nodes = " x ".join(map(str, (len(flow.leaps[-1].state), *flow.grid.nodes)))
        print(
            f"{name:28} {flow.horizon:6.3g} {nodes:>20} {flow.grid.degree:6d} {flow.nbytes / 1e6:5.0f} "
            f"{error.rms:8.1e} {error.rms / PAPER**0.5:8.1e} {error.max:8.1e} {seconds:8.2f}"
        )


if __name__ == "__main__":
    main()
