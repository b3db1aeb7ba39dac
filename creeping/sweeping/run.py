"""Sweeps over incident directions, in this process or on a cluster."""

# help() shows names of types instead of what they stand for
from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal, cast

from creeping._progress import reporting
from creeping._typing import Any, ArrayLike
from creeping.errors import CreepingError, InvalidInputError
from creeping.field.boundary import BoundaryLike
from creeping.geometry.arguments import flag, folder_path, rays_refused, shown, whole_number
from creeping.geometry.directions import unit_directions
from creeping.geometry.surface import Surface, why_no_rays
from creeping.phaseflow.phase_map import PhaseMap
from creeping.rays.reach import AUTO
from creeping.rays.transport import Flow, checked_flow
from creeping.storage.memory import within_budget
from creeping.sweeping.layout import TaskStatus
from creeping.sweeping.plan import Arrays, FirstTaskGuard, SweepPlan, bytes_of, common_error, compute, task_size
from creeping.sweeping.request import Quantity, solved_alone, sweep_length, sweep_request, with_lattice
from creeping.sweeping.results import as_dataset, require
from creeping.sweeping.store import SweepStore
from creeping.sweeping.sweeper import NoFlow

if TYPE_CHECKING:
    import xarray


EVERY = 1.0
"""Seconds between reports within a task."""
Progress = Callable[[float, int, float], None]
"""Called with incidences done, incidences to do, and seconds."""


def sweep_directions(
    flow: Flow | Surface,
    directions: ArrayLike,
    *,
    wavenumbers: ArrayLike = (),
    quantity: Quantity = "monostatic",
    observation: ArrayLike | None = None,
    boundary: BoundaryLike | Sequence[BoundaryLike] | None = None,
    length: float | Literal["auto"] = AUTO,
    n_rays: int = 256,
    n_steps: int = 1,
    order: int = 2,
    method: str | None = None,
    accuracy: float | None = None,
    store: str | Path | None = None,
    resume: bool = False,
    client: Any = None,
    chunk: int | None = None,
    progress: Progress | bool | None = None,
) -> xarray.Dataset:
    """Creeping rays, or their field, for many directions of incidence.

    Parameters
    ----------
    flow : PhaseMap or DirectFlow
        Or a body without rays, i.e. `Facets` or `Bodies`, whose fields come from the integral equation.
    directions : (n, 3)
        Directions of incidence, where the waves travel; need not be unit.
    wavenumbers : float or (k,), 1/L
        Wavenumbers of the fields.
    quantity : {"monostatic", "bistatic", "rays"}
        "monostatic": field back towards the source. "bistatic": field in the directions ``observation``. "rays": the
        rays themselves. All results include data of the shadow line: curves, length, shares. These are NaN where no
        rays are launched: with the T-matrix, or on a body with edges where only the equation is valid.
    observation : (m, 3), optional
        Directions of observation for "bistatic".
    boundary : {"soft", "hard", "pec"}, ImpedanceBoundary or a list of them
        By default "soft".
    length : float or "auto", L (travel time for a weighted body)
        Length of the rays. "auto" is one length for all incidences, stored with the results: the length after which
        waves at the lowest wavenumber have decayed, the largest of twelve incidences; see `creeping.launch`.
    n_rays : int
        Number of rays per incidence.
    n_steps : int
        Number of points stored per ray for "rays".
    order : 2 or 1
        Order of the creeping waves.
    method : {"rays", "auto", "currents", "equation", "t-matrix"}
        Method for the fields, by default "rays". "auto" repeats an incidence with the currents of the whole body if
        isolated rays leave a direction unresolved, which takes about 0.1 s per boundary and wavenumber. "currents"
        uses currents for every incidence that a mesh of the body resolves. ``by_currents`` marks these incidences.
        "equation" solves the integral equation for every incidence, in seconds to minutes each
        (`creeping.surface_currents` with ``solve=True``). "t-matrix" computes one matrix per boundary and wavenumber
        (`creeping.t_matrix`) and all incidences from it.
    accuracy : float, optional
        Interpolate fields between closely spaced incidences where the interpolation error is known to be below this
        share of the field, and below ten times this share of the creeping part; 1e-3 is a good value. All other
        incidences are computed. ``interpolated`` marks interpolated incidences; ``interpolation_error`` is the error.
    store : path, optional
        Folder for the results (zarr), written task by task; the dataset reads from the folder on access. By default
        results stay in memory.
    resume : bool
        Continue an existing store: compute tasks that are missing or contain failed incidences.
    client : distributed.Client or str, optional
        Dask cluster that computes the tasks, or the address of its scheduler. All workers must see the store.
    chunk : int, optional
        Number of incidences per task; an existing store keeps its number.
    progress : callable or bool, optional
        True shows a bar, in a terminal or a notebook. A callable is called as ``progress(done, total, seconds)``, with
        numbers of incidences, after each task. If fields take long it is also called between frequencies, about once a
        second; ``done`` then has a fractional part.

    Returns
    -------
    xarray.Dataset
        ``incidence_status`` marks incidences that are singular or failed; these raise no error. For singular
        incidences the integral equation gives the fields; they are NaN if only rays are allowed or it costs too much.

    Raises
    ------
    CreepingError
        On bad input, listing all mistakes at once; if the first incidences all fail with the same error; if the store
        belongs to another study, is in use, or cannot be written. Results already written remain.

    Examples
    --------
    >>> import creeping as cr, scatterers as sc
    >>> flow = cr.DirectFlow(sc.Sphere(), rtol=1e-6)
    >>> ds = cr.sweep_directions(flow, [(0, 0, 1), (1, 1, 0)], quantity="rays", n_rays=4, length=1.0)
    >>> dict(ds.sizes)
    {'incidence': 2, 'ray': 4, 'step': 1, 'axis': 3}
    """
    require("xarray")
    if why_no_rays(flow):
        if quantity == "rays":
            raise InvalidInputError(rays_refused(flow))
        if accuracy is not None:
            raise InvalidInputError(f"accuracy= is of fields by rays: leave it out; {rays_refused(flow)}")
        flow, method = NoFlow(flow), method or "auto"
    elif method == "t-matrix":
        flow = NoFlow(getattr(flow, "body", flow))
    flow = cast(Flow, flow)
    if not isinstance(flow, NoFlow):
        checked_flow(flow)
    _checked_options(flow, quantity, store, resume, client, progress)
    if boundary is None:
        boundary = () if quantity == "rays" else "soft"
    several: Any = list(boundary) if isinstance(boundary, (list, tuple)) else [boundary]
    # that of "auto" is not known before rays are, which may not be needed
    request = sweep_request(
        quantity,
        length=1.0 if isinstance(length, str) and length == AUTO else length,
        n_rays=n_rays,
        n_steps=n_steps,
        wavenumbers=wavenumbers,
        boundary=several,
        observation=observation,
        order=order,
        method=method or "rays",
        accuracy=accuracy,
    )
    unit = unit_directions(directions, "directions")
    if unit.ndim != 2:
        raise InvalidInputError(f"directions have shape {unit.shape}; give rows of three numbers, shape (n, 3)")
    going_on = store is not None and resume and Path(store).exists()
    if going_on:
        # whether rays are needed may be judged otherwise today, as memory is
        begun = SweepStore.open(str(store))
        if (begun.key["flow"]["kind"] == "none") != isinstance(flow, NoFlow):
            flow, length = begun.flow(flow.body), begun.key["request"]["length"]
    elif not isinstance(flow, NoFlow) and solved_alone(flow.body, request, len(unit)):
        flow = NoFlow(flow.body)
    leap = flow.horizon if isinstance(flow, PhaseMap) else 0.0
    known = 1.0 if isinstance(flow, NoFlow) else sweep_length(flow.body, length, request.wavenumbers, leap=leap)
    request = with_lattice(replace(request, length=known), unit)
    chunk = None if chunk is None else whole_number(chunk, "chunk")
    if going_on:
        chunk = begun.chunk
    else:
        chunk = task_size(request, len(unit), chunk, shared=store is not None or client is not None)
    plan = SweepPlan(flow, request, unit, chunk)
    with reporting(progress, "incidences") as told:
        if store is None:
            return in_memory(plan, told)
        opened = open_store(plan, store, resume=resume)
        fill(plan, opened, client=client, progress=told)
    return opened.dataset()


def in_memory(plan: SweepPlan, progress: Progress | None = None) -> xarray.Dataset:
    """Dataset of a plan, computed in this process and kept in memory.

    Raises
    ------
    InvalidInputError
        If the results do not fit into memory.
    """
    count = len(plan.incidences)
    size = float(bytes_of(plan.request) * count)
    # beyond 8 GB a store is asked for
    if size > 8e9:
        raise InvalidInputError(f"{count} incidences give {size / 1e9:.0f} GB of results; give store=, a folder")
    # they are put together of tasks
    within_budget(2 * size, f"results of {count} incidences", "give store=, a folder, or ask for fewer", asked=count)
    arrays: Arrays = plan.request.empty(count, filled=False)
    errors: list[tuple[int, str]] = []
    told = _Told(progress, count)
    for task, found, failed in _computed(plan, range(plan.tasks), told):
        rows = plan.rows(task)
        for name, values in arrays.items():
            values[rows] = found[name]
        errors += [(rows.start + row, text) for row, text in failed.items()]
        told.add(rows)
    return as_dataset(plan, arrays, errors)


class _Told:
    """What is told of the progress: incidences done, those to do, and seconds."""

    def __init__(self, progress: Progress | None, count: int, done: int = 0) -> None:
        self._progress, self._count, self._done = progress, count, done
        self._started = self._last = time.perf_counter()

    def within(self, rows: slice, share: float) -> None:
        """Tell how far a task is, now and then, but not its end."""
        now = time.perf_counter()
        if self._progress and share < 1 and now - self._last >= EVERY:
            self._last = now
            self._progress(self._done + share * (rows.stop - rows.start), self._count, now - self._started)

    def add(self, rows: slice) -> None:
        """Tell that a task is done."""
        self._done += rows.stop - rows.start
        self._last = time.perf_counter()
        if self._progress:
            self._progress(self._done, self._count, self._last - self._started)


def _computed(
    plan: SweepPlan,
    tasks: Iterable[int],
    told: _Told,
    stop: Callable[[], bool] = lambda: False,
    store: SweepStore | None = None,
) -> Iterator[tuple[int, Arrays, dict[int, str]]]:
    """Results of tasks, one after the other in this process, and the errors of incidences that failed, by row."""
    sweeper = plan.make(plan.flow, plan.request)
    sweeper.store = store.matrices if store else None
    before, guard = store.status() if store else [TaskStatus.UNDONE] * plan.tasks, FirstTaskGuard()
    for task in tasks:
        if stop():
            return
        rows = plan.rows(task)
        sweeper.passed = partial(told.within, rows)
        arrays, errors = compute(sweeper, plan.incidences[rows])
        yield task, arrays, errors
        # those that failed before may fail again
        if before[task] == TaskStatus.UNDONE:
            guard.add(rows.stop - rows.start, common_error(errors, rows.stop - rows.start))


def open_store(
    plan: SweepPlan, folder: str | Path, *, resume: bool, note: Callable[[str], None] = lambda _: None
) -> SweepStore:
    """Store of a plan: made, or opened, and mended, if ``resume`` and it exists; ``note`` is told what was damaged.

    Raises
    ------
    InvalidInputError
        If the folder exists and ``resume`` is false, or holds another study.
    """
    if not Path(folder).exists():
        return SweepStore.create(folder, plan)
    if not resume:
        raise InvalidInputError(
            f"{folder} exists; give resume=True (--resume) to go on with it, or choose another store"
        )
    store = SweepStore.open(folder)
    store.require_same(plan)
    for text in store.mended(plan):
        note(text)
    return store


def fill(
    plan: SweepPlan,
    store: SweepStore,
    *,
    client: Any = None,
    progress: Progress | None = None,
    stop: Callable[[], bool] = lambda: False,
    most: int | None = None,
) -> bool:
    """Compute the missing tasks of a store.

    Parameters
    ----------
    plan : SweepPlan
    store : SweepStore
    client : distributed.Client or str, optional
        Cluster, or the address of its scheduler; this process if not given.
    progress : callable, optional
        See `sweep_directions`.
    stop : callable
        Asked between tasks: whether to leave the rest for another time.
    most : int, optional
        Tasks to do at most, in this process.

    Returns
    -------
    bool
        Whether nothing is missing now.

    Raises
    ------
    CreepingError
        If the store is in use or cannot be written, or the first incidences all fail with one and the same error.
    """
    with store.locked():
        missing = store.missing()
        left = len(missing)
        done = len(plan.incidences) - sum(plan.rows(t).stop - plan.rows(t).start for t in missing)
        told = _Told(progress, len(plan.incidences), done)
        if client is not None and missing:
            require("distributed")
            from creeping.sweeping.cluster import fill_on

            filled = fill_on(client, plan, store, missing, stop)
        else:
            filled = _filled(plan, store, missing[:most], told, stop)
        try:
            for task in filled:
                left -= 1
                told.add(plan.rows(task))
        except BaseException:
            # the first error is the one to tell
            with suppress(CreepingError):
                store.finish()
            raise
        store.finish()
    return left == 0


def _filled(
    plan: SweepPlan, store: SweepStore, tasks: list[int], told: _Told, stop: Callable[[], bool]
) -> Iterator[int]:
    """Compute tasks in this process; yields each when it is committed."""
    for task, arrays, errors in _computed(plan, tasks, told, stop, store) if tasks else ():
        store.write_task(task, arrays, errors)
        store.commit(task, failures=bool(errors))
        yield task


def _checked_options(flow: Flow, quantity: str, store: Any, resume: Any, client: Any, progress: Any) -> None:
    """Refuse options that are of no kind that can be meant, or do not go together."""
    flag(resume, "resume")
    if store is not None:
        folder_path(store, "store")
    if not (progress is None or isinstance(progress, bool) or callable(progress)):
        raise InvalidInputError(f"progress = {shown(progress)} cannot be called; give True or a function of 3 numbers")

    if isinstance(quantity, str) and quantity != "rays" and getattr(flow.body, "speed", None) is not None:
        raise InvalidInputError(
            f"quantity {quantity!r} is for rays of constant speed; leave out the speed, or ask for 'rays'"
        )
    if store is None and (resume or client is not None):
        word, more = ("resume", "") if resume else ("client", ", seen by all workers")
        raise InvalidInputError(f"{word} goes with store=, the folder of the results{more}")
