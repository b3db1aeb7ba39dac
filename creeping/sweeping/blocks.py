"""A sweep of many wavenumbers as one store for each block of them, side by side in a folder: none is lost with another.

What is computed once for all incidences, an equation or a T-matrix, is a block and a task for each wavenumber. Where
each incidence has a cost of its own, wavenumbers share its geometry, and tasks have few incidences.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from creeping._progress import EVERY
from creeping._typing import Any, BoolArray, FloatArray
from creeping.errors import CreepingError
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.surface import Surface, why_no_rays
from creeping.rays.transport import Flow
from creeping.shadow.status import LineStatus
from creeping.sweeping.results import MISSING, count_attributes, require
from creeping.sweeping.run import Progress, sweep_directions
from creeping.sweeping.store import SweepStore
from creeping.sweeping.sweeper import NoFlow

if TYPE_CHECKING:
    import xarray

TASK = 32
"""Values of one task: of some 0.1 s each where currents serve, so that a few seconds of work are lost at most."""


class Rows(NamedTuple):
    """A dataset in which some values are not computed yet, and which are: (incidences, wavenumbers)."""

    dataset: xarray.Dataset
    known: BoolArray


Told = Callable[[Rows], None]


def begun(store: str | Path) -> SweepStore | None:
    """The first block of a folder, if it has begun: its flow is that of all, and so are the sizes, see `sizes_of`."""
    first = Path(store) / "0000"
    return SweepStore.open(first) if first.exists() else None


def sweep_blocks(
    flow: Flow | Surface,
    incidences: FloatArray,
    wavenumbers: FloatArray,
    *,
    store: str | Path,
    resume: bool,
    sizes: tuple[int, int],
    progress: Progress | None = None,
    rows: Told | None = None,
    **asked: Any,
) -> xarray.Dataset:
    """Dataset of `creeping.sweep_directions` for incidences (n, 3) and wavenumbers (k,), in memory when all is there.

    Parameters
    ----------
    flow, incidences, wavenumbers, asked
        As of `creeping.sweep_directions`.
    store : path
        Folder of the blocks.
    resume : bool
        Go on with those that are there.
    sizes : (int, int)
        Wavenumbers of a block, and incidences of a task; see `sizes_of`.
    progress : callable, optional
        As of `creeping.sweep_directions`.
    rows : callable, optional
        Called with `Rows` after a task now and then, and when the sweep is interrupted.

    Raises
    ------
    CreepingError
        As by `creeping.sweep_directions`.
    """
    count, all_k = len(incidences), len(wavenumbers)
    each, chunk = sizes
    blocks = [wavenumbers[first : first + each] for first in range(0, all_k, each)]
    started = time.perf_counter()
    done: list[xarray.Dataset] = []
    shown, took = started, 0.0

    def show(last: bool = False) -> None:
        nonlocal shown, took
        begun = time.perf_counter()
        # and not before ten times what making the last one took
        if rows is None or not (last or begun - shown >= max(EVERY, 10 * took)):
            return
        if (found := _so_far(done, Path(store), blocks)) is not None:
            rows(found)
        shown = time.perf_counter()
        took = shown - begun

    def told(share: float, _: int, __: float) -> None:
        before = sum(map(len, blocks[: len(done)]))
        if progress is not None:
            part = (before * count + share * len(blocks[len(done)])) / all_k
            progress(part, count, time.perf_counter() - started)
        # tasks that are done are counted in whole incidences
        if share == int(share) and share < count:
            show()

    try:
        for number, block in enumerate(blocks):
            place = Path(store) / f"{number:04d}"
            options: dict[str, Any] = asked | {"chunk": chunk, "progress": told, "resume": resume, "store": place}
            sweep_directions(flow, incidences, wavenumbers=block, **options)
            done.append(SweepStore.open(place).dataset(loaded=True))
            if number + 1 < len(blocks):
                show()
    except BaseException:
        # the first error is the one to tell
        with suppress(CreepingError):
            show(last=True)
        raise
    return _joined(done, len(blocks))


def sizes_of(
    flow: Flow | Surface, incidences: FloatArray, wavenumbers: FloatArray, asked: dict[str, Any]
) -> tuple[int, int]:
    """Wavenumbers of a block, and incidences of a task, so that a task is some seconds of work.

    Rays of many incidences and wavenumbers are quicker together; where a trial is served otherwise, each value has a
    cost of its own, and the equation a large one.
    """
    count, all_k, method = len(incidences), len(wavenumbers), asked["method"]
    body = getattr(flow, "body", flow)
    if isinstance(flow, NoFlow) or why_no_rays(body) or is_piecewise(body) or method == "t-matrix":
        return 1, count
    if method == "auto":
        ends = np.unique(wavenumbers[[0, -1]])
        trial = sweep_directions(flow, incidences[[0, count // 2]][: min(count, 2)], wavenumbers=ends, **asked)
        method = "currents" if any(np.any(trial[n]) for n in trial if str(n).startswith("by_currents")) else "rays"
    if method == "rays":
        return all_k, min(count, TASK)
    task = 1 if method == "equation" else TASK
    values = count * len(asked.get("observation", (None,)))
    return (all_k, max(1, task // all_k)) if values >= TASK and count > 1 else (max(1, task // values), count)


def _so_far(done: list[xarray.Dataset], store: Path, blocks: list[FloatArray]) -> Rows | None:
    """What the blocks of a folder hold that are done, and the next one; nothing if there is none yet."""
    parts, place = list(done), store / f"{len(done):04d}"
    if len(parts) < len(blocks) and place.exists():
        parts.append(SweepStore.open(place).dataset(loaded=True))
    if not parts:
        return None
    known = np.zeros((parts[0].sizes["incidence"], sum(map(len, blocks))), dtype=bool)
    for number, one in enumerate(parts):
        first = sum(map(len, blocks[:number]))
        known[:, first : first + len(blocks[number])] = one["incidence_status"].values[:, None] != MISSING
    joined = _joined(parts, len(blocks))
    blank = {name: {"b": False, "i": MISSING}.get(one.dtype.kind, np.nan) for name, one in joined.data_vars.items()}
    return Rows(joined.reindex(wavenumber=np.concatenate(blocks), fill_value=blank), known)


def _joined(parts: list[xarray.Dataset], count: int) -> xarray.Dataset:
    """One dataset of so many blocks of wavenumbers, or the first; an incidence has failed, or is missing, if at any."""
    if count == 1:
        return parts[0]
    options: dict[str, Any] = {"data_vars": "minimal", "coords": "minimal", "compat": "override", "join": "override"}
    found = require("xarray").concat(parts, dim="wavenumber", combine_attrs="override", **options)
    each = np.stack([one["incidence_status"].values for one in parts])
    status = np.where(np.any(each == MISSING, axis=0) | (len(parts) < count), MISSING, each.max(axis=0))
    status = np.where(np.any(each == LineStatus.FAILED, axis=0), LineStatus.FAILED, status)
    words = count_attributes(status, [])
    texts = dict.fromkeys(text for one in parts for text in str(one.attrs.get("errors", "")).splitlines())
    words |= {"errors": "\n".join(texts)} if texts else {}
    result: xarray.Dataset = found.assign(incidence_status=found["incidence_status"].copy(data=status))
    return result.assign_attrs(words | {"sweep_digest": " ".join(one.attrs["sweep_digest"] for one in parts)})
