"""What runs on the workers of a cluster: the recipe of a sweep, and the computation of its tasks."""

import os
import signal
import threading
from dataclasses import dataclass, field
from pathlib import Path

import distributed
import numpy as np

from creeping._typing import Any, FloatArray
from creeping.errors import CreepingError
from creeping.geometry.surface import Surface
from creeping.sweeping.plan import Arrays, Maker, common_error, compute
from creeping.sweeping.request import SweepRequest
from creeping.sweeping.storage.store import SweepStore

THREADS = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS", "CREEPING_THREADS")


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
            # the driver has mended it
            store = SweepStore.open(self.folder, mending=True)
            self.own.tools = (self.make(store.flow(self.body), self.request), store)
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


def whole_task(digest: str, task: int, incidences: FloatArray) -> tuple[int, str]:
    """Compute a task on a worker and write its chunks: how many incidences failed, and their `common_error`."""
    sweeper, store = _RECIPES[digest].tools()
    arrays, errors = compute(sweeper, np.asarray(incidences))
    store.write_task(task, arrays, errors)
    return len(errors), common_error(errors, len(incidences))


def one_incidence(digest: str, incidence: FloatArray) -> tuple[Arrays, dict[int, str]]:
    """Compute one incidence on a worker."""
    return compute(_RECIPES[digest].tools()[0], np.asarray(incidence))


def process() -> tuple[str, int]:
    """Machine and process that this is."""
    return os.uname().nodename, os.getpid()
