"""The same request gives the same map, bit for bit: in another process, beside a busy one, by wild clocks."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import creeping as cr
import scatterers as sc
from creeping.phaseflow.request import tuned_direct
from creeping.phaseflow.search import direct_seconds, evaluation_seconds, map_seconds, tracing_cost
from tests.plain_body import PlainEllipsoid

ROOT = Path(__file__).parents[3]
BUILD = """
import sys, time
if sys.argv[2] == "wild":
    # every look at a clock finds that seconds have passed
    passed = iter(range(10**9))
    for name in ("process_time", "perf_counter", "monotonic", "thread_time"):
        setattr(time, name, lambda: 3.0 * next(passed))
import creeping as cr, scatterers as sc
for k, body in enumerate((sc.Ellipsoid(1.0, 0.8, 0.6), sc.Torus())):
    cr.build_phase_map(body, tolerance=1e-4, length=4.0, cache=False).save(f"{sys.argv[1]}/built-{k}")
    flow = cr.choose_flow(body, n_rays=300_000, length=4.0, tolerance=1e-5, carry_jacobi=False, cache=False)
    flow.save(f"{sys.argv[1]}/chosen-{k}") if isinstance(flow, cr.PhaseMap) else print(flow)
"""


def built(folder, clock):
    folder.mkdir()
    command = [sys.executable, "-c", BUILD, str(folder), clock]
    done = subprocess.run(
        command, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=True
    )
    return done.stdout, {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.mark.slow
def test_two_builds_are_equal_bit_for_bit(tmp_path):
    first = built(tmp_path / "a", "true")
    busy = subprocess.Popen([sys.executable, "-c", "while True: pass"])
    try:
        second = built(tmp_path / "b", "wild")
    finally:
        busy.kill()
        busy.wait()
    assert len(first[1]) >= 8 and first[0] == second[0] and list(first[1]) == list(second[1])
    for name, content in first[1].items():
        assert content == second[1][name], name
    # the manifest too, so nothing in it is of the hour or the machine
    assert "seconds" not in json.loads(first[1]["built-0/manifest.json"])["content"]["parameters"]


@pytest.mark.parametrize("rays", [(400_000, 3_000_000), (1, 3)])
def test_a_map_follows_from_the_magnitude_of_the_rays(rays):
    asked = {"tolerance": 1e-3, "length": 3.0, "carry_jacobi": False, "cache": False}
    one, other = (cr.build_phase_map(sc.Sphere(), n_rays=n, **asked) for n in rays)
    assert one.horizon == other.horizon and one.grid == other.grid
    np.testing.assert_array_equal(one.leaps[-1].state, other.leaps[-1].state)


def test_numbers_of_numpy_make_the_same_choice():
    asked = {"length": 2.0, "cache": False}
    first = cr.choose_flow(sc.Sphere(), n_rays=10, tolerance=1e-5, **asked)
    again = cr.choose_flow(sc.Sphere(), n_rays=np.int64(10), tolerance=np.float64(1e-5), carry_jacobi=np.True_, **asked)
    assert again == first


def test_costs_are_in_the_order_of_what_they_stand_for():
    short, long = sc.Implicit("x*x + y*y + 2*z*z - 1"), sc.Implicit("x*x + y*y + exp(0.1*sin(x))*z*z - 1")
    sampled = sc.Gridded.sampled(sc.Ellipsoid(1.0, 0.8, 0.6), 24)
    found = [evaluation_seconds(one) for one in (short, long, sampled, PlainEllipsoid(1.0, 0.8, 0.6))]
    assert found == sorted(found) and found[-1] > 100 * found[0]
    assert evaluation_seconds(sc.Sphere(speed="1 + x")) > evaluation_seconds(sc.Sphere())
    # twice the body: the same ray is twice as long
    small, large = sc.Ellipsoid(1.0, 0.8, 0.6), sc.Ellipsoid(2.0, 1.6, 1.2)
    assert tracing_cost(large) == pytest.approx(0.5 * tracing_cost(small), rel=0.05)


def test_cost_of_a_ray_grows_with_its_length_and_accuracy():
    body = sc.Ellipsoid(1.0, 0.8, 0.6)
    rough, fine = (tuned_direct(body, 4.0, 1, tolerance, True) for tolerance in (1e-3, 1e-8))
    assert fine[1] > 1.3 * rough[1]
    assert direct_seconds(fine[0], 8.0, 2, carry_jacobi=True) == pytest.approx(2 * fine[1], rel=0.1)
    assert direct_seconds(fine[0], 4.0, 1, carry_jacobi=False) < fine[1]
    flow = cr.build_phase_map(body, horizon=0.5, grid=(16, 16), degree=3, cache=False)
    states = map_seconds(flow, 4.0, carry_jacobi=False)
    assert states < map_seconds(flow, 4.0, carry_jacobi=True) and states < map_seconds(flow, 8.0, carry_jacobi=False)
