"""Bodies and phase maps shared by the tests; no test touches the user's cache; how long a run may go on."""

import os
import time
from itertools import groupby

# the processes of pytest-xdist share the cores; threads for small matrices would only take them from each other
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import pytest
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
import scatterers as sc


def pytest_addoption(parser):
    about = "start no test later than this, in seconds since 1970; those left are skipped, and told"
    parser.addoption("--until", type=float, default=float("inf"), help=about)
    about = "begin with the file of this number, from the first again after the last"
    parser.addoption("--turn", type=int, default=0, help=about)


def pytest_collection_modifyitems(config, items):
    files = [list(of) for _, of in groupby(items, key=lambda item: item.path)]
    turn = config.getoption("--turn") % max(len(files), 1)
    items[:] = [item for of in files[turn:] + files[:turn] for item in of]


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    if time.time() > item.config.getoption("--until"):
        pytest.skip("no time was left for it")


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
