"""Results of a sweep on disk: a zarr v3 folder that survives the death of its writers.

One array a variable, with dimension names, one chunk a task along the incidences, compressed and with a CRC. Chunks are
written aside and renamed, and ``task_status`` of a task (0 missing, 1 done, 2 done but for failed incidences) after all
its chunks: what is marked is whole, whenever a writer dies. After a power failure `SweepStore.verify` finds what the
disk lost. The group ``study`` holds what the results depend on, with a digest, and the flow. CRCs and digest have no
key: they tell of accidents, not of forgery.
"""

import os
import shutil
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import Any, IntArray
from creeping.errors import CreepingError, InvalidInputError
from creeping.geometry.surface import Surface
from creeping.rays.transport import Flow
from creeping.shadow.status import FAILED
from creeping.storage.folder import content_digest
from creeping.sweeping.accessor import register
from creeping.sweeping.plan import Arrays, SweepPlan, differing, open_flow, save_flow
from creeping.sweeping.results import MISSING, SHOWN, count_attributes, require
from creeping.sweeping.storage.layout import (
    DONE,
    ERROR_BYTES,
    ERRORS,
    SCHEMA,
    STATUS,
    STUDY,
    UNDONE,
    WITH_FAILURES,
    write_empty,
)

if TYPE_CHECKING:
    import xarray


class SweepStore:
    """A store; make one with `create`, or open one with `open`.

    Attributes
    ----------
    folder : Path
    key : dict
        What the results depend on; see `SweepPlan.key`.
    """

    def __init__(self, folder: Path, content: dict[str, Any]) -> None:
        self.folder, self.key = folder, content["key"]
        self.chunk, self.count = int(self.key["chunk"]), int(self.key["incidences"]["count"])
        self.tasks = -(-self.count // self.chunk)
        self.variables: list[str] = list(content["variables"])
        self._opened: dict[str, Any] = {}
        self._lock: Any = None

    @classmethod
    def create(cls, folder: str | Path, plan: SweepPlan) -> "SweepStore":
        """Make the store of a plan, nothing in it computed; it appears whole or not at all.

        Raises
        ------
        InvalidInputError
            If the folder exists.
        CreepingError
            If it cannot be written, or the flow cannot be stored.
        """
        require("zarr")
        folder = Path(folder).absolute()
        aside = folder.parent / f".{folder.name}-{uuid.uuid4().hex[:12]}"
        try:
            if folder.exists():
                raise InvalidInputError(f"{folder} exists; resume it, or choose another store")
            aside.mkdir(parents=True)
            write_empty(aside, plan)
            save_flow(plan.flow, aside / STUDY)
            aside.rename(folder)
        except BaseException as error:
            shutil.rmtree(aside, ignore_errors=True)
            if isinstance(error, OSError):
                raise CreepingError(f"cannot make the store {folder}: {error}; choose another place") from error
            raise
        return cls.open(folder)

    @classmethod
    def open(cls, folder: str | Path) -> "SweepStore":
        """Open a store.

        Raises
        ------
        CreepingError
            If there is none, or what it says of its study is damaged or of another schema.
        """
        zarr = require("zarr")
        folder = Path(folder).absolute()
        try:
            attributes = dict(zarr.open_group(folder / STUDY, mode="r", zarr_format=3).attrs)
            content = attributes["content"]
            intact = attributes["blake2b"] == content_digest(content)
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise CreepingError(f"{folder} holds no sweep ({error}); choose another store") from error
        if not intact:
            raise CreepingError(f"{folder}/{STUDY} is damaged: its digest differs; compute the sweep anew")
        if content.get("schema") != SCHEMA:
            raise CreepingError(f"{folder} has schema {content.get('schema')!r}, this version reads {SCHEMA}")
        return cls(folder, content)

    def flow(self, body: Surface) -> Flow:
        """Flow that the sweep was begun with.

        Raises
        ------
        CreepingError
            If it is of another body, damaged, or of no known kind.
        """
        try:
            return open_flow(self.key["flow"], self.folder / STUDY, body)
        except KeyError as error:
            raise CreepingError(f"{self.folder} lacks {error} of its flow; compute the sweep anew") from error

    def require_same(self, plan: SweepPlan) -> None:
        """Refuse to go on with another study than the one that the store was begun with.

        Raises
        ------
        InvalidInputError
            If the studies differ; with the entries in which they do.
        """
        names = differing(self.key, plan.key)
        if names:
            raise InvalidInputError(
                f"{self.folder} belongs to another study: {'; '.join(names)}; choose another store, or remove it",
                differing=names,
            )

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Hold the store as its only driver; who holds it may ask again.

        Workers of the driver need no lock, their chunks are theirs alone.

        Raises
        ------
        CreepingError
            If another process holds it, or nothing can be written there.
        """
        from filelock import FileLock, Timeout

        if self._lock is None:
            self._lock = FileLock(self.folder / STUDY / ".lock", timeout=0)
        try:
            self._lock.acquire()
        except Timeout as error:
            raise CreepingError(f"another process is filling {self.folder}; wait for it or choose another") from error
        except OSError as error:
            raise CreepingError(f"cannot write to {self.folder}: {error}; choose another place") from error
        try:
            yield
        finally:
            self._lock.release()

    def rows(self, task: int) -> slice:
        """Incidences of a task."""
        return slice(task * self.chunk, min((task + 1) * self.chunk, self.count))

    def status(self) -> IntArray:
        """Status of the tasks (tasks,): 0 missing, 1 done, 2 done but for failed incidences."""
        with self._reading(STATUS):
            return np.asarray(self._array(STATUS)[:], dtype=np.int64)

    def missing(self) -> list[int]:
        """Tasks that are not done; those with failed incidences are among them, to be tried again."""
        return [int(task) for task in np.flatnonzero(self.status() != DONE)]

    def write_task(self, task: int, arrays: Arrays, errors: dict[int, str]) -> None:
        """Write all chunks of a task; `commit` marks it afterwards.

        Raises
        ------
        CreepingError
            If an array has not the shape that the layout says.
        """
        rows = self.rows(task)
        if self._array(STATUS)[task] != UNDONE:
            # a task that is tried again is not whole until it is marked again
            self._put(STATUS, slice(task, task + 1), UNDONE)
        for name in self.variables:
            expected = (rows.stop - rows.start, *self._array(name).shape[1:])
            if arrays[name].shape != expected:
                raise CreepingError(f"the sweeper gave {name} of shape {arrays[name].shape}, not {expected}: a mistake")
            self._put(name, rows, arrays[name])
        if errors:
            texts = np.zeros((rows.stop - rows.start, ERROR_BYTES), dtype=np.uint8)
            for row, text in errors.items():
                raw = text.encode()[:ERROR_BYTES]
                texts[row, : len(raw)] = np.frombuffer(raw, dtype=np.uint8)
            self._put(ERRORS, rows, texts)

    def commit(self, task: int, *, failures: bool) -> None:
        """Mark a task, all of whose chunks are written."""
        self._put(STATUS, slice(task, task + 1), WITH_FAILURES if failures else DONE)

    def failures(self, most: int = SHOWN) -> list[tuple[int, str]]:
        """The first incidences that failed, and why."""
        found: list[tuple[int, str]] = []
        for task in np.flatnonzero(self.status() == WITH_FAILURES):
            rows = self.rows(int(task))
            with self._reading(ERRORS, int(task)):
                failed = np.flatnonzero(self._array("incidence_status")[rows] == FAILED)
                texts = self._array(ERRORS)[rows]
            for row in failed[: most - len(found)]:
                found.append((rows.start + int(row), bytes(texts[row]).rstrip(b"\0").decode(errors="replace")))
            if len(found) >= most:
                break
        return found

    def verify(self, *, repair: bool = False) -> list[tuple[int, str]]:
        """Read every chunk of the tasks that are done.

        Parameters
        ----------
        repair : bool
            Mark damaged tasks as missing, so that resuming computes them anew.

        Returns
        -------
        list of (task, reason)
            Of damaged tasks.

        Raises
        ------
        CreepingError
            If they are to be repaired while another process fills the store.
        """
        with self.locked() if repair else nullcontext():
            return self._verified(repair)

    def incidence_status(self) -> IntArray:
        """Status of the incidences (n,); -1 of those that are missing."""
        try:
            with self._reading("incidence_status"):
                return np.asarray(self._array("incidence_status")[:], dtype=np.int64)
        except CreepingError:
            # once more, by task, for the message
            for task in range(self.tasks):
                with self._reading("incidence_status", task):
                    self._array("incidence_status")[self.rows(task)]
            raise

    def finish(self, seconds: float) -> None:
        """Write counts and seconds, of this run and those before it, to the attributes of the dataset."""
        zarr = require("zarr")
        status = self.incidence_status()
        for task in np.flatnonzero(self.status() == UNDONE):
            status[self.rows(int(task))] = MISSING
        with self._writing():
            group = zarr.open_group(self.folder, mode="r+", zarr_format=3)
            old = {k: v for k, v in group.attrs.items() if k != "errors"}
            group.attrs.put(old | count_attributes(status, self.failures(), float(old.get("seconds", 0)) + seconds))

    def dataset(self) -> "xarray.Dataset":
        """Dataset whose values are read when they are used."""
        opened: xarray.Dataset = register().open_zarr(self.folder, consolidated=False)
        # in the order of the request; a selection lacks coordinates with dimensions of their own
        return opened[self.variables].assign_coords(opened.coords)

    def _verified(self, repair: bool) -> list[tuple[int, str]]:
        damaged = []
        for task in np.flatnonzero(self.status() != UNDONE):
            reason = self._damage(int(task))
            if reason:
                damaged.append((int(task), reason))
                if repair:
                    for name in self.variables:
                        self._chunk(name, int(task)).unlink(missing_ok=True)
                    self._put(STATUS, slice(task, task + 1), UNDONE)
        return damaged

    def _damage(self, task: int) -> str:
        for name in self.variables:
            array = self._array(name)
            if not self._chunk(name, task).exists():
                # zarr would read the fill value
                return f"{name}: its chunk is missing"
            try:
                with self._reading(name, task):
                    array[self.rows(task)]
            except CreepingError as error:
                return str(error)
        return ""

    def _chunk(self, name: str, task: int) -> Path:
        return self.folder.joinpath(name, "c", str(task), *["0"] * (self._array(name).ndim - 1))

    def _array(self, name: str) -> Any:
        if name not in self._opened:
            zarr = require("zarr")
            # chunks of fill values too, so that one that is lost is missed
            with zarr.config.set({"array.write_empty_chunks": name != ERRORS}):
                self._opened[name] = zarr.open_array(self.folder / name, mode="r+", zarr_format=3)
        return self._opened[name]

    def _put(self, name: str, rows: slice, values: Any) -> None:
        with self._writing():
            self._array(name)[rows] = values

    @contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            free = shutil.disk_usage(self.folder).free if self.folder.exists() else 0
            raise CreepingError(
                f"cannot write to {self.folder}: {os.strerror(error.errno) if error.errno else error} "
                f"({free / 1e6:.0f} MB are free); what is done is kept: make room and resume"
            ) from error

    @contextmanager
    def _reading(self, name: str, task: int | None = None) -> Iterator[None]:
        try:
            yield
        except (OSError, ValueError, RuntimeError) as error:
            what = name if task is None else f"{name} of task {task}"
            rows = "" if task is None else f" (incidences {self.rows(task).start} to {self.rows(task).stop - 1})"
            raise CreepingError(
                f"{what}{rows} in {self.folder} is damaged ({error}); to compute damaged tasks anew, resume with "
                "--verify, or after SweepStore.verify(repair=True)",
                task=task,
            ) from error
