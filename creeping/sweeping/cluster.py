"""A sweep on a Dask cluster: a sliding window of tasks, each of which writes its own chunks.

Workers get the recipe of the sweep once, by a plugin that restarted workers get too; a phase map they open from the
store, mapped from its files. They return a record; the driver marks the task. A task whose worker dies again and again
is put aside until all others are done, and is then done one incidence after the other, alone.

Also here: what runs on the workers of a cluster: the recipe of a sweep, and the computation of its tasks.
"""

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

import dask
import distributed
import numpy as np

from creeping._typing import Any, FloatArray
from creeping.errors import CreepingError
from creeping.geometry.surface import Surface
from creeping.sweeping.layout import TaskStatus
from creeping.sweeping.plan import Arrays, FirstTaskGuard, Maker, SweepPlan, common_error, compute
from creeping.sweeping.request import SweepRequest
from creeping.sweeping.store import SweepStore

AHEAD = 2
"""Tasks in flight for each thread of the workers."""
ANSWER = 20.0
"""Seconds in which a scheduler must answer."""
PATIENCE = 120.0
"""Seconds without any worker after which the sweep is given up."""

THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS", "CREEPING_THREADS")


def fill_on(
    client: Any, plan: SweepPlan, store: SweepStore, missing: list[int], stop: Callable[[], bool]
) -> Iterator[int]:
    """Compute tasks on a cluster; yields each when it is committed.

    Parameters
    ----------
    client : distributed.Client or str
        Client, or the address of a scheduler.
    plan : SweepPlan
    store : SweepStore
    missing : list of int
        Tasks.
    stop : callable
        Asked now and then: whether to start no more tasks, and to wait for those that are being computed only.

    Raises
    ------
    CreepingError
        If the workers cannot write, or there are none for too long, or the first incidences all fail with one and the
        same error.
    """
    if isinstance(client, str):
        with connected(client) as own:
            yield from fill_on(own, plan, store, missing, stop)
        return
    recipe = Recipe(plan.digest, plan.body, plan.request, plan.make, str(store.folder))
    name = f"creeping-{plan.digest[:16]}"
    try:
        client.register_plugin(RecipePlugin(recipe), name=name)
    except (TypeError, AttributeError) as error:
        raise CreepingError(f"{plan.body!r} cannot be sent to workers ({error}); sweep in one process") from error
    dead = []
    status, guard = store.status(), FirstTaskGuard()
    try:
        for task, outcome in _outcomes(client, plan, whole_task, ((task, plan.rows(task)) for task in missing), stop):
            if isinstance(outcome, distributed.KilledWorker):
                dead.append(task)
                continue
            failed, common = outcome
            store.commit(task, failures=failed > 0)
            yield task
            # those that failed before may fail again
            if status[task] == TaskStatus.UNDONE:
                guard.add(store.rows(task).stop - store.rows(task).start, common)
        for task in dead:
            found = _singly(client, plan, plan.rows(task), stop)
            if found is None:
                return
            store.write_task(task, *found)
            store.commit(task, failures=bool(found[1]))
            yield task
    finally:
        with suppress(Exception):
            client.unregister_worker_plugin(name)


def in_order(client: Any, work: Callable[..., Any], asked: list[dict[str, Any]]) -> Iterator[Any]:
    """Results of calls with the options ``asked``, computed on a cluster, in their order.

    Raises
    ------
    CreepingError
        By a call, or if what is called cannot be sent or its worker dies.
    """
    try:
        futures = [client.submit(work, **options, pure=False) for options in asked]
    except (TypeError, AttributeError) as error:
        raise CreepingError(f"the body cannot be sent to workers ({error}); compute in one process") from error
    try:
        while futures:
            result = futures[0].result()
            # what was given is not kept by the workers
            futures.pop(0)
            yield result
    except (distributed.KilledWorker, distributed.client.FutureCancelledError) as error:
        raise CreepingError(f"the cluster gave up a task ({error}); with a store what is done is kept") from error
    finally:
        with suppress(Exception):
            client.cancel(futures, force=True)


@contextmanager
def connected(address: str) -> Iterator[Any]:
    """Client of the scheduler at an address.

    Raises
    ------
    CreepingError
        If no scheduler answers there.
    """
    try:
        client = distributed.Client(address, timeout=ANSWER, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise CreepingError(f"no Dask scheduler answers at {address!r} ({error}); start one first") from error
    with client:
        yield client


@contextmanager
def local_client(workers: int) -> Iterator[Any]:
    """Client of as many worker processes of this machine, of one thread each."""
    options = {
        # a task goes to a worker when the worker is free: fewer are lost with it, or have to be waited for
        "distributed.scheduler.worker-saturation": 1.0,
        # one death may be an accident
        "distributed.scheduler.allowed-failures": 1,
    }
    with (
        dask.config.set(options),
        distributed.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            # any free port, of this machine alone: 8787 may be taken by a cluster of the user
            dashboard_address="127.0.0.1:0",
            # a scheduler carries out what it is sent: certificates of this run alone keep other users out
            security=True,
            env=dict.fromkeys(THREADS, "1"),
            silence_logs=50,
        ) as cluster,
        distributed.Client(cluster, set_as_default=False) as client,
    ):
        yield client


def _outcomes(
    client: Any,
    plan: SweepPlan,
    work: Callable[..., Any],
    parts: Iterator[tuple[int, slice]],
    stop: Callable[[], bool],
    most: int | None = None,
) -> Iterator[tuple[int, Any]]:
    """What ``work`` gives of numbered parts of the incidences, or the `KilledWorker`, in the order of completion.

    Never more than a few for each thread of the workers are in flight, nor more than ``most``.
    """
    flying: dict[Any, int] = {}
    stopping, alive = False, time.monotonic()
    try:
        while True:
            if stop() and not stopping:
                stopping = True
                _drop_what_waits(client, flying)
            threads = sum(client.nthreads().values())
            room = max(0, (most or AHEAD * max(1, threads)) - len(flying))
            for number, rows in islice(parts, 0 if stopping else room):
                key = f"creeping-{number}-{os.urandom(6).hex()}"
                future = client.submit(work, plan.digest, plan.incidences[rows], number, key=key, pure=False)
                flying[future] = number
            if not flying:
                return
            alive = time.monotonic() if threads else alive
            if time.monotonic() - alive > PATIENCE:
                raise CreepingError(
                    f"the cluster has had no worker for {PATIENCE:.0f} s; start workers; what is done is kept: resume"
                )
            done = set[Any]()
            # a second without an outcome is no failure
            with client.as_current(), suppress(TimeoutError):
                done = distributed.wait(list(flying), timeout=1.0, return_when="FIRST_COMPLETED").done
            while done:
                # released at once, whoever still refers to it: were its worker to die, it would be computed again, and
                # what has been marked as done be written anew
                future = done.pop()
                number, outcome = flying.pop(future), _outcome(future)
                future.release()
                yield number, outcome
    except CancelledError as error:
        raise CreepingError(
            f"the cluster gave up a task ({error}); see to its scheduler; what is done is kept: resume"
        ) from error
    finally:
        with suppress(Exception):
            client.cancel(list(flying), force=True)


def _outcome(future: Any) -> Any:
    """Result of a future that is finished, or the `KilledWorker`; other errors are raised."""
    error = future.exception()
    if error is None:
        return future.result()
    if isinstance(error, distributed.KilledWorker):
        return error
    if isinstance(error, CreepingError):
        raise error
    raise CreepingError(
        f"a task failed on its worker ({type(error).__name__}: {error}); what is done is kept: resume"
    ) from error


def _drop_what_waits(client: Any, flying: dict[Any, int]) -> None:
    """Cancel tasks that no worker has begun."""
    # stacks of all that runs, asked without names: a scheduler fails over the name of a task that ended meanwhile
    busy = {key for stacks in client.call_stack().values() for key in stacks} if flying else set()
    idle = [future for future in flying if future.key not in busy and not future.done()]
    for future in idle:
        flying.pop(future)
    client.cancel(idle, force=True)


def _singly(
    client: Any, plan: SweepPlan, rows: slice, stop: Callable[[], bool]
) -> tuple[Arrays, dict[int, str]] | None:
    """Results of incidences, one after the other with nothing else on the cluster; None if stopped."""
    arrays, errors = plan.request.empty(rows.stop - rows.start), dict[int, str]()
    each = ((row, slice(row, row + 1)) for row in range(rows.start, rows.stop))
    done = 0
    for row, outcome in _outcomes(client, plan, one_incidence, each, stop, most=1):
        place, done = row - rows.start, done + 1
        if isinstance(outcome, Exception):
            errors[place] = "its worker died each time it was tried"
            continue
        found, failed = outcome
        for name, values in arrays.items():
            values[place] = found[name][0]
        if failed:
            errors[place] = failed[0]
    return (arrays, errors) if done == rows.stop - rows.start else None


@dataclass
class Recipe:
    """What a worker needs to make the sweeper; pickled with the body in it, but not the tables of a map."""

    digest: str
    body: Surface
    request: SweepRequest
    make: Maker
    folder: str
    driver: tuple[str, int] = field(default_factory=lambda: process())
    own: threading.local = field(default_factory=threading.local, repr=False)

    def tools(self) -> tuple[Any, SweepStore]:
        """Sweeper and store of this thread, made when first asked for.

        Raises
        ------
        CreepingError
            If the worker does not see the folder of the store.
        """
        if not hasattr(self.own, "tools"):
            if not Path(self.folder).is_dir():
                raise CreepingError(f"the worker on {process()[0]} does not see {self.folder}; give a shared folder")
            store = SweepStore.open(self.folder)
            sweeper = self.make(store.flow(self.body), self.request)
            sweeper.store = store.matrices
            self.own.tools = (sweeper, store)
        tools: tuple[Any, SweepStore] = self.own.tools
        return tools

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "own"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state, own=threading.local())


_RECIPES: dict[str, Recipe] = {}
"""Of the sweeps that this process, a worker, takes part in."""


class RecipePlugin(distributed.WorkerPlugin):  # type: ignore[misc]
    """Gives a worker the recipe of a sweep."""

    def __init__(self, recipe: Recipe) -> None:
        self.recipe = recipe

    def setup(self, worker: Any) -> None:
        """Keep the recipe, and keep to one thread: the cores are shared out among the workers."""
        _RECIPES[self.recipe.digest] = self.recipe
        if process() == self.recipe.driver:
            return
        for name in THREADS:
            os.environ.setdefault(name, "1")
        if worker.nanny and threading.current_thread() is threading.main_thread():
            # a terminal interrupts its whole group of processes; to stop is the driver's part
            signal.signal(signal.SIGINT, signal.SIG_IGN)

    def teardown(self, worker: Any) -> None:
        """Forget the recipe."""
        _RECIPES.pop(self.recipe.digest, None)


def whole_task(digest: str, incidences: FloatArray, task: int) -> tuple[int, str]:
    """Compute a task on a worker and write its chunks: how many incidences failed, and their `common_error`."""
    sweeper, store = _RECIPES[digest].tools()
    arrays, errors = compute(sweeper, np.asarray(incidences))
    store.write_task(task, arrays, errors)
    return len(errors), common_error(errors, len(incidences))


def one_incidence(digest: str, incidence: FloatArray, _: int) -> tuple[Arrays, dict[int, str]]:
    """Compute one incidence on a worker."""
    return compute(_RECIPES[digest].tools()[0], np.asarray(incidence))


def process() -> tuple[str, int]:
    """Machine and process that this is."""
    return os.uname().nodename, os.getpid()
