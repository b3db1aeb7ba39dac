"""Sweeps on a cluster: the same bytes however many workers, however they die, with few tasks in flight."""

import asyncio
import os
import signal

import fake_sweeps as fake
import numpy as np
import pytest

from creeping import CreepingError
from creeping.geometry.directions import fibonacci_directions
from creeping.shadow.status import LineStatus
from creeping.sweeping import cluster
from creeping.sweeping.run import fill
from creeping.sweeping.store import SweepStore


@pytest.fixture(scope="module")
def two():
    """Two workers that find poison at incidences 13, which kills them, and 21, which raises."""
    z = fibonacci_directions(40)[:, 2]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("FAKE_DIES", str(z[13]))
        patch.setenv("FAKE_RAISES", str(z[21]))
        patch.setenv("FAKE_SECONDS", "0.003")
        with cluster.local_client(2) as client:
            yield client


@pytest.mark.slow
def test_one_and_two_workers_and_none_give_the_same_bytes(two, tmp_path):
    # d_z of other numbers of incidences is no poison
    plan = fake.plan(41, 3)
    stores = {name: SweepStore.create(tmp_path / f"{name}.zarr", plan) for name in ("none", "one", "two")}
    fill(plan, stores["none"])
    in_flight = []

    def count(*_):
        # results that have been told are released by and by
        in_flight.append(sum(one.status == "pending" for one in list(two.futures.values())))

    fill(plan, stores["two"], client=two, progress=count)
    # and by the address, as of a scheduler elsewhere
    import distributed

    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address="127.0.0.1:0") as elsewhere:
        fill(plan, stores["one"], client=elsewhere.scheduler_address)
    first = fake.bytes_of(stores["none"].folder)
    assert len(first) > 14 * len(plan.request.variables)
    assert first == fake.bytes_of(stores["one"].folder) == fake.bytes_of(stores["two"].folder)
    assert set(two.run(os.getenv, "CREEPING_THREADS").values()) == {"1"}
    assert len(in_flight) == 14 and 0 < max(in_flight) <= 2 * cluster.AHEAD


@pytest.mark.slow
def test_poison_costs_its_incidence_alone(two, tmp_path, monkeypatch):
    plan = fake.plan(40, 4)
    store = SweepStore.create(tmp_path / "s.zarr", plan)
    assert fill(plan, store, client=two)
    ds = store.dataset()
    assert np.flatnonzero(ds.incidence_status == LineStatus.FAILED).tolist() == [13, 21]
    good = np.delete(np.arange(40), [13, 21])
    assert np.array_equal(ds.creeping.values[good], fake.creeping_of(40)[good])
    assert store.failures() == [
        (13, "its worker died each time it was tried"),
        (21, "ArithmeticError: a poisonous incidence"),
    ]
    # resumed, those two tasks are tried again, here where that does no harm
    monkeypatch.delenv("FAKE_DIES")
    monkeypatch.delenv("FAKE_RAISES")
    assert store.missing() == [3, 5]
    assert fill(plan, store)
    assert np.array_equal(store.dataset().creeping, fake.creeping_of(40))


@pytest.mark.slow
def test_a_killed_worker_loses_nothing(two, tmp_path):
    plan = fake.plan(36, 3)
    store = SweepStore.create(tmp_path / "s.zarr", plan)
    victims = list(two.run(os.getpid).values())

    def progress(done, *_):
        if done >= 9 and victims:
            os.kill(victims.pop(), signal.SIGKILL)
            victims.clear()

    assert fill(plan, store, client=two, progress=progress) and not victims
    assert store.failures() == [] and np.array_equal(store.dataset().creeping, fake.creeping_of(36))


def test_stopping_keeps_what_is_done(two, tmp_path):
    plan = fake.plan(300, 3)
    store = SweepStore.create(tmp_path / "s.zarr", plan)
    done = []
    assert not fill(plan, store, client=two, progress=lambda *a: done.append(a[0]), stop=lambda: len(done) >= 5)
    # tasks that had begun are finished, those that had not are dropped
    assert 5 <= len(done) <= 5 + 2 * cluster.AHEAD
    assert 100 - len(store.missing()) == len(done) and store.dataset().attrs["incidences_ok"] == done[-1]
    assert two.futures == {} or all(f.status == "cancelled" for f in two.futures.values())


def test_stopping_bears_a_task_that_the_scheduler_has_forgotten(two):
    future = two.submit(len, "", pure=False)
    flying = {future: 0}
    # as where it ended between the question and the answer
    two.cancel([future], force=True)
    two.run_on_scheduler(_forgets, future.key)
    cluster._drop_what_waits(two, flying)
    assert not flying or all(one.done() for one in flying)


async def _forgets(key, dask_scheduler):
    """Wait until a scheduler knows a task no more."""
    while key in dask_scheduler.tasks:
        await asyncio.sleep(0.01)


def test_a_worker_that_cannot_write_ends_the_sweep_with_the_reason(two, tmp_path):
    plan = fake.plan(12, 3)
    store = SweepStore.create(tmp_path / "s.zarr", plan)
    # a file where the folder of chunks should be
    (store.folder / "curves" / "c").touch()
    with pytest.raises(CreepingError, match=r"cannot write to .*s\.zarr.*resume"):
        fill(plan, store, client=two)
    (store.folder / "curves" / "c").unlink()
    assert fill(plan, store, client=two)


def test_no_scheduler_there(tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "ANSWER", 0.5)
    plan = fake.plan(4, 4)
    store = SweepStore.create(tmp_path / "s.zarr", plan)
    with pytest.raises(CreepingError, match=r"no Dask scheduler answers at 'tcp://127.0.0.1:9'"):
        fill(plan, store, client="tcp://127.0.0.1:9")


@pytest.mark.slow
def test_the_cluster_is_for_this_user_of_this_machine(two):
    import distributed
    import psutil

    # nothing listens to the world
    mine = psutil.Process()
    listening = [
        connection.laddr.ip
        for process in (mine, *mine.children(recursive=True))
        for connection in process.net_connections(kind="inet")
        if connection.status == psutil.CONN_LISTEN
    ]
    assert len(listening) >= 3 and set(listening) <= {"127.0.0.1", "::1"}
    # and nobody without the certificates of this run gets anything carried out
    address = two.scheduler.address
    for tried in (address, address.replace("tls", "tcp")):
        with pytest.raises((OSError, TypeError, AssertionError)):
            distributed.Client(tried, timeout=0.3, set_as_default=False)
