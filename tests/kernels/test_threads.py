"""Work in slices: they cover everything once, end at blocks, change no bit, and stop where they are told to."""

import multiprocessing
import sys
import threading
import time

import numpy as np
import pytest
from patience import HANGS

import creeping as cr
import scatterers as sc
from creeping.field.currents import radiation
from creeping.field.equation.split_sums import SmoothKernel, SplitSums
from creeping.geodesics import integrator
from creeping.geodesics.states import pack, random_bundle_points
from creeping.kernels import threads
from creeping.kernels.threads import in_slices, in_threads
from creeping.phaseflow import rotation
from tests.plain_body import PlainEllipsoid


@pytest.mark.parametrize("count", [0, 63, 70_001])
@pytest.mark.parametrize("several", ["1", "3"])
@pytest.mark.parametrize("options", [{}, {"even": True, "most": 130}, {"first": 1}])
def test_slices_cover_everything_once(count, several, options, monkeypatch):
    monkeypatch.setenv("CREEPING_THREADS", several)
    seen, ends = np.zeros(count, int), []

    def work(part):
        seen[part] += 1
        ends.append(part)

    in_threads(work, count, **options)
    assert np.all(seen == 1) and all(part.start % 64 == 0 for part in ends)
    if "most" in options:
        assert max((part.stop - part.start for part in ends), default=0) <= 128


def test_slices_are_as_long_as_their_time_allows(monkeypatch):
    monkeypatch.setattr(threads, "SLICE", 0.004)
    parts = []

    def work(part):
        parts.append(part.stop - part.start)
        time.sleep(2e-6 * parts[-1])

    in_slices(work, 40_000)
    assert parts[0] == 64 and 256 < max(parts) <= 2048


@pytest.mark.parametrize("lanes, ordered", [(6, False), pytest.param(12, True, marks=pytest.mark.slow)])
def test_no_bit_depends_on_the_slices(lanes, ordered, rng, monkeypatch):
    body = sc.Ellipsoid(1.2, 0.9, 0.8)
    flow = cr.build_phase_map(body, horizon=0.5, grid=(16, 24))
    states, times = pack(*random_bundle_points(body, 900, rng=rng), lanes=lanes), np.array([0.5, 3.0, 10.0])
    if ordered:
        for name, value in (("ORDERED", 100), ("NEAR", 0), ("SHARE", 320)):
            monkeypatch.setattr(rotation, name, value)
    direct = [cr.DirectFlow(body, 1e-9), cr.DirectFlow(body, step=0.05)]
    whole = [one.transport(states, times) for one in (flow, *direct)]
    monkeypatch.setattr(rotation, "BUDGET", 7)
    monkeypatch.setattr(integrator, "BUDGET", 5)
    monkeypatch.setattr(threads, "SLICE", 1e-9)
    calls = []
    monkeypatch.setattr(rotation, "pause", lambda: calls.append("map"))
    monkeypatch.setattr(integrator, "pause", lambda: calls.append("trace"))
    for one, before in zip((flow, *direct), whole, strict=True):
        np.testing.assert_array_equal(one.transport(states, times), before)
    assert calls.count("map") > 20 and calls.count("trace") > 50


def test_no_bit_of_radiation_depends_on_the_slices(rng, monkeypatch):
    points, at = rng.normal(size=(300, 3)), 5 * rng.normal(size=(200, 3))
    weights = rng.normal(size=300) + 1j * rng.normal(size=300)
    J = rng.normal(size=(300, 3)) + 0j
    unit = at / np.linalg.norm(at, axis=1)[:, None]

    def sums():
        return (
            radiation.phase_sums(points, weights[None], unit, 9.0),
            radiation.field_of_scalar((points, points), weights, weights, at, 9.0),
            radiation.field_of_vector(points, J, at, 9.0, electric=False),
        )

    monkeypatch.setattr(radiation, "transformed", lambda *_: False)
    before = sums()
    monkeypatch.setattr(threads, "SLICE", 1e-9)
    for one, other in zip(before, sums(), strict=True):
        np.testing.assert_array_equal(one, other)


def test_an_error_in_one_thread_ends_the_others(monkeypatch):
    monkeypatch.setenv("CREEPING_THREADS", "2")
    done = []

    def work(part):
        if part.start == 0:
            raise ArithmeticError("the first")
        time.sleep(0.002)
        done.append(part)

    with pytest.raises(ArithmeticError, match="the first"):
        in_threads(work, 64_000, most=64)
    assert len(done) < 100


def test_an_interrupt_waits_for_the_slices_and_takes_no_more(monkeypatch, interruptible):
    monkeypatch.setenv("CREEPING_THREADS", "2")
    begun, ended = [], []

    def work(part):
        begun.append(part.start)
        time.sleep(0.05)
        ended.append(part.start)

    threading.Timer(0.2, lambda: __import__("_thread").interrupt_main()).start()
    with pytest.raises(KeyboardInterrupt):
        in_threads(work, 64_000, most=64)
    assert sorted(begun) == sorted(ended) and len(begun) < 60
    time.sleep(0.2)
    assert len(begun) < 60


def test_a_callback_that_has_failed_is_not_called_again():
    class Failing(PlainEllipsoid):
        calls = 0

        def hessian(self, points):
            Failing.calls += 1
            raise ArithmeticError("no Hessian")

    body = Failing(1.0, 0.9, 0.8)
    states = pack(*random_bundle_points(sc.Ellipsoid(1.0, 0.9, 0.8), 640, rng=np.random.default_rng(1)))
    for times in (1, 2):
        with pytest.raises(ArithmeticError, match="no Hessian"):
            integrator.trace_states(body, states, np.array([1.0]))
        assert Failing.calls == times


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere libraries of the system do not allow a fork")
@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
def test_a_forked_process_has_threads_of_its_own(rng, monkeypatch):
    """After the pool and OpenMP of the split sums have been used: both would wait for threads of the parent."""
    monkeypatch.setenv("CREEPING_THREADS", "2")
    at, one = rng.random((50, 3)), np.ones((50, 3)) / np.sqrt(3)

    def work():
        sums = SplitSums(SmoothKernel(6.0, np.ones(3), 0.9), at, one, at, one, np.ones(50))
        done = np.zeros(70_001, int)
        in_threads(lambda part: np.add.at(done, part, 1), len(done))
        return np.all(done == 1), sums.curl(one.astype(complex)[..., None])

    fork = multiprocessing.get_context("fork")
    near, far = fork.Pipe(duplex=False)
    whole, own = work()
    child = fork.Process(target=lambda: far.send(work()))
    child.start()
    try:
        assert near.poll(HANGS), "the forked process hangs"
        there = near.recv()
    finally:
        child.kill()
        child.join()
    assert whole and there[0]
    # the sums are of single precision, and their digits depend on where memory lies
    np.testing.assert_allclose(there[1], own, atol=10 * np.finfo(np.float32).eps * np.abs(own).max())
