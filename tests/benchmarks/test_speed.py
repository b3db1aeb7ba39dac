"""Costs that matter to a user; run with ``python -m pytest tests/benchmarks -m slow -n 0 --benchmark-enable``."""

import os
import subprocess
import sys

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.geodesics.integrator import trace_states
from creeping.geodesics.states import pack, random_bundle_points
from creeping.phaseflow.request import tuned_direct

pytestmark = pytest.mark.slow
BODIES = {"ellipsoid": sc.Ellipsoid(1.2, 0.8, 0.8), "twisted": sc.TwistedEllipsoid()}
LENGTH = 8.0
ENDS = np.array([LENGTH])


@pytest.fixture(scope="module")
def tuned():
    """Maps for rays of length 8 within 1e-6, built once: tuned(body, outputs)."""
    kept = {}

    def get(body, n_steps=1):
        key = repr(body), n_steps
        if key not in kept:
            kept[key] = cr.build_phase_map(
                body, tolerance=1e-6, length=LENGTH, n_steps=n_steps, carry_jacobi=n_steps > 1, cache=False
            )
        return kept[key]

    return get


@pytest.fixture(params=BODIES)
def states(request):
    body = BODIES[request.param]
    return body, pack(*random_bundle_points(body, 20_000, rng=np.random.default_rng(0)))


@pytest.mark.parametrize("which, grid", [("ellipsoid", (16, 64)), ("twisted", (24, 96))])
def test_build_of_the_tower(benchmark, which, grid):
    options = {"horizon": 1 / 8, "time_step": 2**-10, "stages": 7, "degree": 3, "method": "tower", "cache": False}
    benchmark.pedantic(cr.build_phase_map, (BODIES[which],), {"grid": grid, **options}, rounds=3, warmup_rounds=1)


def test_one_leap(benchmark, states, phase_map):
    body, points = states
    flow = phase_map(body)
    benchmark(flow.leap, points, 1)


def test_direct_integration_over_the_same_time(benchmark, states, phase_map):
    body, points = states
    benchmark(trace_states, body, points, np.array([phase_map(body).horizon]), rtol=1e-7)


def test_long_leaps(benchmark, states, tuned):
    body, points = states
    benchmark(tuned(body).transport, points, ENDS)


def test_direct_integration_of_equal_error(benchmark, states, tuned):
    body, points = states
    direct, _ = tuned_direct(body, LENGTH, 1, tuned(body).growth.rms[-1], False)
    benchmark(direct.transport, points, ENDS)


def test_leap_on_a_body_given_by_samples(benchmark):
    body = sc.Gridded.sampled(sc.TwistedEllipsoid(), 32)
    flow = cr.build_phase_map(body, horizon=0.5, grid=(32, 48), carry_jacobi=False, cache=False)
    points = pack(*random_bundle_points(body, 20_000, rng=np.random.default_rng(0)))
    benchmark(flow.leap, points, 1)


def test_fan_of_64_outputs(benchmark, states, tuned):
    body, points = states
    with_jacobi = pack(points[:4096, :3], points[:4096, 3:], jacobi=True)
    benchmark(tuned(body, 64).transport, with_jacobi, LENGTH * np.arange(1, 65) / 64)


def test_opening_a_stored_map(benchmark, states, tuned, tmp_path):
    body, _ = states
    benchmark(cr.load_phase_map, tuned(body).save(tmp_path / "map"), body)


@pytest.mark.parametrize("rays", [1000, 1_000_000])
@pytest.mark.parametrize("which", BODIES)
def test_choice_of_a_flow(benchmark, which, rays):
    options = {"n_rays": rays, "length": LENGTH, "carry_jacobi": False, "cache": False}
    benchmark.pedantic(cr.choose_flow, (BODIES[which],), options, rounds=3, warmup_rounds=1)


@pytest.mark.parametrize("which", BODIES)
def test_shadow_line(benchmark, which):
    benchmark(cr.shadow_line, BODIES[which], (1, 1, 1))


@pytest.mark.parametrize("which", BODIES)
def test_fan(benchmark, which, phase_map):
    body = BODIES[which]
    line, flow = cr.shadow_line(body, (1, 1, 1)), phase_map(body)
    benchmark(cr.launch, flow, line, length=4.0, n_rays=256, max_gap=np.inf)


def test_help_of_the_command_line(benchmark):
    command = [sys.executable, "-c", "from creeping.commands.main import main; main(['--help'])"]
    benchmark.pedantic(subprocess.run, (command,), {"capture_output": True, "env": {**os.environ}}, rounds=5)
