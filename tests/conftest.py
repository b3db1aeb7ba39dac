"""Bodies and phase maps shared by the tests; no test touches the user's cache; how long a run may go on."""

import os
import signal
import time
from itertools import groupby

# the processes of pytest-xdist share the cores; threads for small matrices would only take them from each other
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pytest
import shared_bodies as sc
from processor_time import ProcessorTime
from results_to_show import (  # noqa: F401
    ball_cut,
    ball_fan,
    dark_fan,
    small_map,
    sphere_curves,
    sphere_fan,
    sphere_line,
    torus_fan,
    twisted_curves,
    twisted_fan,
)

import creeping as cr

FIRST = ("README.md", "tests/tests/reference/", "tests/scatterers/", "tests/dumb_inputs/test_bad_arguments.py")
"""Files that a run begins with, for the two workers in turn: one compiles kernels while the other needs few of them."""


def pytest_addoption(parser):
    about = "start no test later than this, in seconds since 1970; those left are skipped, and told"
    parser.addoption("--until", type=float, default=float("inf"), help=about)
    about = "take one file in N, from the I-th on: I/N"
    parser.addoption("--share", default="0/1", help=about)
    parser.addoption("--guard", action="store_true", help="fail if too many tests take too long")


def pytest_configure(config):
    config.pluginmanager.register(ProcessorTime())
    config.pluginmanager.register(sc.SharedInExamples())


def pytest_collection_modifyitems(config, items):
    files = [list(of) for _, of in groupby(items, key=lambda item: item.path)]
    first, step = map(int, config.getoption("--share").split("/"))
    files = files[first::step]
    files.sort(key=lambda of: next((i for i, begin in enumerate(FIRST) if of[0].nodeid.startswith(begin)), len(FIRST)))
    items[:] = [item for of in files for item in of]


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    if time.time() > item.config.getoption("--until"):
        pytest.skip("no time was left for it")


@pytest.fixture
def interruptible():
    """Ctrl-C raises KeyboardInterrupt here, though shells have jobs in the background ignore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(autouse=True, scope="session")
def _own_cache(tmp_path_factory):
    patch = pytest.MonkeyPatch()
    patch.setenv("CREEPING_CACHE", str(tmp_path_factory.mktemp("maps")))
    yield
    patch.undo()


BODIES = {
    "sphere": sc.Sphere(),
    "ellipsoid": sc.Ellipsoid(1.2, 0.8, 0.8),
    "triaxial": sc.Ellipsoid(1.0, 0.8, 0.6),
    "torus": sc.Torus(),
    "twisted": sc.TwistedEllipsoid(),
    "weighted": sc.Sphere(speed="1 + x"),
}


@pytest.fixture(params=list(BODIES))
def body(request):
    return BODIES[request.param]


@pytest.fixture(scope="session")
def phase_map():
    """Maps with a tolerance of 1e-6, built once: phase_map(name or body)."""
    built = {}

    def get(which):
        shape = BODIES.get(which, which) if isinstance(which, str) else which
        if repr(shape) not in built:
            built[repr(shape)] = cr.build_phase_map(shape, tolerance=1e-6)
        return built[repr(shape)]

    return get


@pytest.fixture
def rng():
    return np.random.default_rng(20260301)
