"""What tracing, building and composing cost: work that is counted, times nominal seconds of a unit of it.

    evaluation   e = LEVEL + ARITHMETIC, of F with its derivatives and of what a stage of a ray makes of them
    tracing      steps of 64 rays, counted, times 64 STAGES e
    build        nodes (tracing + NODE + DOUBLING d)
    a ray        leaps times `leap_seconds`, and ENTRY for the conversion to the map's coordinates and back

No clock is read: what is chosen by these figures follows from body, tolerance, length and number of rays, the same on
every machine and however busy it is. All constants were measured on one core of a 2.9 GHz x86-64 with AVX-512; on
another machine everything is faster or slower alike, and what is cheaper than what stays.

Sources: Derivations, R16.
"""

import numpy as np

from creeping._typing import Any
from creeping.geodesics.attenuation import NODES, fine_spacing
from creeping.geodesics.bundle import random_bundle_points
from creeping.geodesics.direct_flow import DirectFlow
from creeping.geodesics.equations import natural_horizon
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.states import pack
from creeping.geometry.evaluators import speed_of
from creeping.geometry.surface import Surface
from creeping.kernels.threads import BLOCK
from creeping.phaseflow.building import Plan
from creeping.phaseflow.coordinates.base import Model
from creeping.phaseflow.phase_map import PhaseMap

STAGES = 12
"""Evaluations of a step of the order-8 pair."""
OPERATION = 4e-11
"""Seconds of one floating-point operation of a level, in blocks: 2 ns for a quadric, 50 ns for a quintic spline."""
CLOSED_FORM = 50.0
"""Operations of a level that does not tell."""
CALLED_BACK = 1.1e-6
"""Seconds of a point of F by numpy methods, in blocks of 64: a twisted ellipsoid, and 0.9 of it the calls."""
ARITHMETIC, WITH_JACOBI, WEIGHTED = 1.2e-9, 1.8e-9, 1.8e-9
"""Seconds of a stage of a ray besides F: of (x, p), more with the Jacobi matrix, more of either with a speed."""
ADAPTING = 5e-10
"""Seconds more of a stage where the step adapts."""
SAMPLE = 1e-8
"""Seconds of a point of a ray at which the attenuation is sampled, besides F."""
NODE, DOUBLING = 6e-7, 4e-7
"""Seconds that a node takes of a build besides tracing, and of a doubling."""
FIXED = 0.1
"""Seconds of a build that do not depend on its size."""
ENTRY = 5e-8
"""Seconds of the conversions of a ray to the coordinates of a map and back."""


def evaluation_seconds(body: Surface) -> float:
    """Nominal seconds of F, its gradient and Hessian at one point, and of the speed if there is one.

    Examples
    --------
    >>> import scatterers as sc
    >>> round(1e9 * evaluation_seconds(sc.Sphere()), 3)
    2.0
    """
    speed = speed_of(body)
    return sum(_seconds(one) for one in (body, speed) if one is not None)


def _seconds(source: Any) -> float:
    compiled = getattr(source, "compiled", None)
    return CALLED_BACK if compiled is None else OPERATION * float(getattr(compiled, "operations", CLOSED_FORM))


def stage_seconds(body: Surface, *, jacobi: bool = False) -> float:
    """Nominal seconds of one ray and stage."""
    more = WEIGHTED if speed_of(body) is not None else 0.0
    return evaluation_seconds(body) + (ARITHMETIC + more) + (WITH_JACOBI + more if jacobi else 0.0)


def tracing_cost(body: Surface) -> float:
    """Nominal seconds of direct integration at 1e-9 per ray and unit of length, the steps of 256 rays being counted."""
    length, rays = natural_horizon(body), 256
    states = pack(*random_bundle_points(body, rays, rng=np.random.default_rng(0)))
    steps: list[int] = []
    trace_states(body, states, np.array([length]), rtol=1e-9, step=length / 4, taken=steps)
    return sum(steps) * BLOCK * STAGES * (stage_seconds(body) + ADAPTING) / (rays * length)


def direct_seconds(flow: DirectFlow, length: float, n_steps: int, *, carry_jacobi: bool) -> float:
    """Nominal seconds of a ray by equal steps; with the Jacobi matrix the attenuation is carried too."""
    body, step = flow.body, flow.step
    assert step is not None
    if not carry_jacobi:
        return n_steps * _steps(length / n_steps, step) * STAGES * stage_seconds(body)
    spacing = fine_spacing(body, flow.rtol, step)
    fine = n_steps * _steps(length / n_steps, spacing)
    steps = fine * _steps(length / fine, step)
    samples = fine * NODES
    return steps * STAGES * stage_seconds(body, jacobi=True) + samples * (evaluation_seconds(body) + SAMPLE)


def _steps(length: float, step: float) -> int:
    return max(1, int(np.ceil(length / step - 1e-9)))


def map_seconds(flow: PhaseMap, length: float, *, carry_jacobi: bool) -> float:
    """Nominal seconds of a ray by a map."""
    leap = flow.leaps[-1]
    flat = flow.grid.is_flat
    each = leap_seconds(flow.grid.degree, float(leap.state.nbytes), carry_jacobi=carry_jacobi, flat=flat)
    return float(length / flow.horizon * each + ENTRY)


def leap_seconds(degree: int, nbytes: float, *, carry_jacobi: bool = False, flat: bool = False) -> float:
    """Nominal seconds of one leap of a ray anywhere on the body, for a table of (x, p) of so many bytes.

    20 (cubic) and 40 ns in the nearest cache, more by the logarithm of the table beyond 1 MB, where a stencil's cache
    lines come from farther away. A table without azimuth has 4 or 6 rows where another has 16 or 36.
    """
    base, farther = (20.0, 16.0) if degree == 3 else (40.0, 27.0)
    if flat:
        base, farther = (10.0, 4.0) if degree == 3 else (16.0, 5.0)
    leap = 1e-9 * (base + farther * float(np.log2(max(nbytes / 1e6, 1.0))))
    # Jacobi matrix and curvatures are three times as much, but packed beside each other; the attenuation is summed
    return (4 if flat else 2) * leap + 20e-9 if carry_jacobi else leap


def build_seconds(plan: Plan, model: Model, cost: float) -> float:
    """Nominal seconds of a direct build, given the `tracing_cost` of the body."""
    nodes = model.charts * int(np.prod(plan.grid.nodes))
    # the curvatures are wanted at several times of each leap
    traced = cost * plan.horizon / 2**plan.doublings * (6.0 if plan.carry_jacobi else 1.0)
    each = (traced + NODE + DOUBLING * plan.doublings) * (2.5 if plan.carry_jacobi else 1.0)
    return float(FIXED + nodes * each)


def doublings_of(horizon: float, natural: float, cost: float) -> int:
    """Doublings that make the build fastest: each halves the tracing and costs two leaps and a fit at every node."""
    d = 0
    while cost * horizon / 2 ** (d + 1) > DOUBLING and horizon / 2 ** (d + 1) >= natural / 8:
        d += 1
    return d


def measuring_seconds(cost: float, length: float, samples: int, rtol: float) -> float:
    """Nominal seconds of rays that are traced as a reference: steps of order 8 shorten like rtol^(1/8)."""
    return cost * length * samples * float((1e-9 / rtol) ** (1 / 8))
