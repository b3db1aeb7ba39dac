"""``creeping sweep``: runs a study file, goes on with one that was interrupted, alone or on a cluster."""

import json
import shlex
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Group, Parameter

from creeping._progress import Progress
from creeping.commands import options
from creeping.commands.options import flow_of, is_file, parse_body
from creeping.errors import InvalidInputError

_workers = Group("Workers")

LARGE = 1800.0
"""Seconds left from which a sweep is shared among the cores by itself."""


def sweep(
    study: Annotated[Path, Parameter(help="Study file, TOML; --example prints one.")] = Path("study.toml"),
    /,
    *,
    output: Annotated[
        Path | None,
        Parameter(
            name=["-o", "--output"], group=options.OUTPUT, help="Folder for the results (zarr); else of the study."
        ),
    ] = None,
    resume: Annotated[
        bool,
        Parameter(negative="", help="Go on with what is there: tasks that are missing, or have failed incidences."),
    ] = False,
    verify: Annotated[
        bool,
        Parameter(negative="", help="With --resume: check what is there; compute damaged tasks again."),
    ] = False,
    scheduler: Annotated[str | None, Parameter(group=_workers, help="Address of a Dask scheduler.")] = None,
    workers: Annotated[
        int | None,
        Parameter(group=_workers, help="Worker processes on this machine; one for each core if it takes long."),
    ] = None,
    cache: options.Cache = True,
    example: Annotated[bool, Parameter(negative="", help="Print a study file to start from.")] = False,
    json_: options.Json = False,
) -> int:
    """Run the sweep of a study file; interrupted, it can be resumed.

    Exit code 4 if --resume would go on: some incidences are missing or failed. 3 if all of them failed.
    """
    from creeping.sweeping.study import EXAMPLE, read_study

    if example:
        print(EXAMPLE, end="")
        return 0
    if verify and not resume:
        raise InvalidInputError("--verify goes with --resume")
    if scheduler is not None and workers is not None:
        raise InvalidInputError("--scheduler and --workers are both given; give one")
    if workers is not None and workers < 1:
        raise InvalidInputError(f"--workers {workers} is not a whole number >= 1")
    read = read_study(study)
    folder = output or (read.folder / read.output if read.output else study.with_suffix(".zarr"))
    if folder.exists() and not resume:
        raise InvalidInputError(f"{folder} exists; give --resume to go on with it, or another -o")
    started = time.perf_counter()
    if scheduler is None and workers is None:
        workers = read.workers
    with Progress("incidences", quiet=json_) as meter:
        plan, store = _prepared(read, folder, resume, cache, meter)
        again = ["creeping", "sweep", str(study), "--resume", "-o", str(folder)]
        again += ["--scheduler", scheduler] if scheduler else []
        again += ["--workers", str(workers)] if workers else []
        # one lock for all: nobody slips in between
        with store.locked():
            if verify:
                meter("verifying")
                for task, reason in store.verify(repair=True):
                    meter.note(f"task {task} is computed anew: {reason}")
            missing = sum(plan.rows(task).stop - plan.rows(task).start for task in store.missing())
            meter.begin(len(plan.incidences) - missing, len(plan.incidences))
            running = time.perf_counter()
            try:
                complete, done = _run(plan, store, scheduler, workers, meter)
            except BaseException:
                meter.message(f"what is done is kept; to go on: {shlex.join(again)}")
                raise
        now = time.perf_counter()
    summary = _summary(plan, store, complete)
    summary |= {"incidences_now": done, "incidences_per_second": round(done / (now - running), 2)}
    summary["seconds"] = round(now - started, 2)
    failed = summary["status"]["failed"]
    if failed or not complete:
        summary["resume"] = shlex.join(again)
    print(json.dumps(summary, indent=1) if json_ else _readable(summary))
    if failed == len(plan.incidences):
        return 3
    return 4 if failed or not complete else 0


def _prepared(read: Any, folder: Path, resume: bool, cache: bool, progress: Progress) -> tuple[Any, Any]:
    """Plan and store of a study; the flow of a sweep that goes on is the one it was begun with."""
    from creeping.commands.forecast import boundary_words, forecast
    from creeping.field.boundary import parse_boundary
    from creeping.sweeping.plan import SweepPlan, task_size
    from creeping.sweeping.request import with_lattice
    from creeping.sweeping.results import require
    from creeping.sweeping.run import open_store
    from creeping.sweeping.store import SweepStore

    for package in ("xarray", "zarr"):
        require(package)
    text = str(read.folder / read.body) if is_file(read.body, read.folder) else read.body
    progress("body")
    file = options.FileOptions(units=read.units, **read.file)
    body = parse_body(text, read.speed, options=file, cache=cache, progress=progress)
    request = read.request_for(body)
    if request.wavenumbers:
        told = forecast(body, request.wavenumbers, parse_boundary(request.boundaries[0]), method=request.method)
        progress.note(f"{told.body}, {boundary_words(*request.boundaries)}")
        progress.note(f"each incidence by {told.by}")
    progress("flow")
    if resume and folder.exists():
        store = SweepStore.open(folder)
        # the size of its tasks is the store's, whatever the study says now
        flow, chunk = store.flow(body), store.chunk
    else:
        flow, chunk = _flow(read, body, request, cache, progress), task_size(request, len(read.incidences), read.chunk)
    request = with_lattice(request, read.incidences)
    asked = {"flow": read.flow, "tolerance": read.tolerance}
    plan = SweepPlan(flow, request, read.incidences, chunk, asked=asked, text=read.text)
    return plan, open_store(plan, folder, resume=resume, note=progress.note)


def _flow(read: Any, body: Any, request: Any, cache: bool, progress: Any) -> Any:
    from creeping import build_phase_map
    from creeping.geometry.surface import why_no_rays
    from creeping.sweeping.request import solved_alone
    from creeping.sweeping.sweeper import NoFlow, outputs_of

    if why_no_rays(body) or solved_alone(body, request, len(read.incidences)):
        return NoFlow(body)
    asked = {"length": request.length, "n_steps": outputs_of(body, request), "cache": cache, "progress": progress}
    rays = len(read.incidences) * request.n_rays
    if read.flow == "map":
        # tuned for all rays of the sweep
        return build_phase_map(body, tolerance=read.tolerance, n_rays=rays, **asked)
    return flow_of(read.flow, body, read.tolerance, n_rays=rays, **asked)


def _run(plan: Any, store: Any, scheduler: str | None, workers: int | None, meter: Progress) -> tuple[bool, int]:
    """Fill the store: whether it is complete, and the number of incidences done now."""
    from creeping.kernels.threads import thread_count
    from creeping.sweeping.run import fill

    with _stopping(meter) as asked:
        told: dict[str, Any] = {"progress": meter.told, "stop": asked.is_set}
        if scheduler is None and workers is None:
            # two tasks time a sweep: the first may have to compile
            complete = fill(plan, store, most=2, **told)
            # cores, unless the user has fewer in mind
            if complete or asked.is_set() or meter.left() < LARGE or thread_count() == 1:
                return complete or fill(plan, store, **told), meter.done_now
            workers = thread_count()
            meter.note(f"about {meter.left():.0f} s are left: sharing them among {workers} worker processes")
        if workers is not None:
            from creeping.sweeping.results import require

            require("distributed")
            from creeping.sweeping.cluster import local_client

            meter.note(f"starting {workers} worker processes")
            with local_client(workers) as client:
                return fill(plan, store, client=client, **told), meter.done_now
        return fill(plan, store, client=scheduler, **told), meter.done_now


@contextmanager
def _stopping(meter: Progress) -> Iterator[Any]:
    """Event that the first SIGINT or SIGTERM sets; the second is an interrupt as always."""
    import threading

    asked = threading.Event()

    def ask(*_: Any) -> None:
        if asked.is_set():
            raise KeyboardInterrupt
        asked.set()
        meter.note("finishing the tasks that have begun; interrupt again to stop at once")

    if threading.current_thread() is not threading.main_thread():
        yield asked
        return
    before = {number: signal.signal(number, ask) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _summary(plan: Any, store: Any, complete: bool) -> dict[str, Any]:
    dataset = store.dataset()
    names = [name for name in dataset.attrs if name.startswith("incidences_")]
    return {
        "output": str(store.folder),
        "complete": complete,
        "incidences": len(plan.incidences),
        "status": {name.removeprefix("incidences_"): int(dataset.attrs[name]) for name in names},
        "failures": [{"incidence": row, "error": text} for row, text in store.failures()],
        "quantity": plan.request.quantity,
        "flow": store.key["flow"],
        "tasks": store.tasks,
        "chunk": store.chunk,
        "digest": plan.digest,
    }


def _readable(summary: dict[str, Any]) -> str:
    counts = ", ".join(f"{n} {name.replace('_', ' ')}" for name, n in summary["status"].items() if n)
    rate = f"({summary['incidences_per_second']:.3g} a second once under way)"
    now = f"{summary['incidences_now']} of them now, in {summary['seconds']:.1f} s {rate}"
    if summary["complete"] and not summary["incidences_now"]:
        now = "nothing was missing"
    rows = [f"{summary['incidences']} incidences, {summary['quantity']}: {counts}", now]
    rows += [f"incidence {item['incidence']} failed: {item['error']}" for item in summary["failures"][:5]]
    if summary["status"]["failed"] > 5:
        rows.append(f"... {summary['status']['failed']} incidences failed; their incidence_status is 4")
    rows.append(f"results in {summary['output']}: xarray.open_zarr({summary['output']!r}, consolidated=False)")
    if "resume" in summary:
        why = "to try again those that failed" if summary["complete"] else "not complete; to go on"
        rows.append(f"{why}: {summary['resume']}")
    return "\n".join(rows)
