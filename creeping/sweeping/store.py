"""Results of a sweep on disk: a zarr v3 folder that survives the death of its writers.

One array a variable, with dimension names, one chunk a task along the incidences, compressed and with a CRC-32C that
zarr compares. Chunks are written aside and renamed, and ``task_status`` of a task (0 missing, 1 done, 2 done but for
failed incidences) after all its chunks: what is marked is whole, whenever a writer dies. The group ``study`` holds what
the results depend on, with a digest, the digest of the files that stay the same from the beginning to the end
(descriptions of the arrays, and coordinates), and the flow. Datasets are given if these agree and the chunks of done
tasks are there; `SweepStore.verify` reads them. CRCs and digests have no key: they tell of accidents, not of forgery,
nor of a chunk that was copied over another.

What stays the same follows from the plan: `mended` writes it anew where it is damaged.
"""

import json
import os
import shutil
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import Any, IntArray
from creeping.errors import CreepingError, InvalidInputError
from creeping.geometry.surface import Surface
from creeping.rays.transport import Flow
from creeping.shadow.status import LineStatus
from creeping.storage.atomic import bytes_of
from creeping.storage.folder import content_digest
from creeping.sweeping import layout
from creeping.sweeping.layout import ERRORS, STATUS, TaskStatus
from creeping.sweeping.plan import Arrays, SweepPlan, differing, open_flow, save_flow
from creeping.sweeping.results import MISSING, SHOWN, count_attributes, register, require

if TYPE_CHECKING:
    import xarray


class SweepStore:
    """A store; make one with `create`, or open one with `open`.

    Attributes
    ----------
    folder : Path
    content : dict
        What it says of its study.
    key : dict
        What the results depend on; see `SweepPlan.key`.
    """

    def __init__(self, folder: Path, content: dict[str, Any]) -> None:
        self.folder, self.content, self.key = folder, content, content["key"]
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
        folder = Path(folder).absolute()
        if folder.exists():
            raise InvalidInputError(f"{folder} exists; resume it, or choose another store")
        with layout.aside_of(folder) as aside:
            layout.write_study(aside, layout.write_empty(aside, plan))
            save_flow(plan.flow, aside / layout.STUDY)
            aside.rename(folder)
        return cls.open(folder)

    @classmethod
    def open(cls, folder: str | Path) -> "SweepStore":
        """Open a store; its arrays are looked at when they are read.

        Raises
        ------
        CreepingError
            If there is none, or what it says of its study is damaged or of another schema.
        """
        require("zarr")
        folder = Path(folder).absolute()
        file = folder / layout.STUDY / layout.ROOT
        try:
            attributes = json.loads(bytes_of(file, layout.MOST_DOCUMENT))["attributes"]
            content = attributes["content"]
            intact = attributes["blake2b"] == content_digest(content)
        except OSError as error:
            raise CreepingError(f"{folder} holds no sweep ({error}); choose another store") from error
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            raise CreepingError(f"{file} is damaged ({error}); compute the sweep anew") from error
        if not intact:
            raise CreepingError(f"{file} is damaged: its digest differs; compute the sweep anew")
        if content.get("schema") != layout.SCHEMA:
            raise CreepingError(f"{folder} has schema {content.get('schema')!r}, this version reads {layout.SCHEMA}")
        return cls(folder, content)

    def __getstate__(self) -> dict[str, Any]:
        # what blocks of the dataset take along to a worker
        return self.__dict__ | {"_opened": {}, "_lock": None}

    def rows(self, task: int) -> slice:
        """Incidences of a task."""
        return slice(task * self.chunk, min((task + 1) * self.chunk, self.count))

    def _place(self, task: int) -> str:
        return f"task {task} (incidences {self.rows(task).start} to {self.rows(task).stop - 1})"

    @property
    def matrices(self) -> Path:
        """Folder of the T-matrices that its fields are made of."""
        return self.folder / layout.STUDY / "t-matrices"

    def flow(self, body: Surface) -> Flow:
        """Flow that the sweep was begun with.

        Raises
        ------
        CreepingError
            If it is of another body, damaged, or of no known kind.
        """
        try:
            return open_flow(self.key["flow"], self.folder / layout.STUDY, body)
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
            self._lock = FileLock(self.folder / layout.STUDY / ".lock", timeout=0)
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

    def status(self) -> IntArray:
        """Status of the tasks (tasks,): 0 missing, 1 done, 2 done but for failed incidences."""
        return self._whole(STATUS, lambda task: slice(task, task + 1))

    def incidence_status(self) -> IntArray:
        """Status of the incidences (n,); -1 of those that are missing."""
        found = self._whole("incidence_status", self.rows)
        for task in np.flatnonzero(self.status() == TaskStatus.UNDONE):
            found[self.rows(int(task))] = MISSING
        return found

    def _whole(self, name: str, rows: Callable[[int], slice]) -> IntArray:
        """All of an array (n,) of whole numbers; where it cannot be read, the error names the task."""
        try:
            with self.reading(name):
                return np.asarray(self.array(name)[:], dtype=np.int64)
        except CreepingError:
            for task in range(self.tasks):
                with self.reading(name, task):
                    self.array(name)[rows(task)]
            raise

    def missing(self) -> list[int]:
        """Tasks that are not done; those with failed incidences are among them, to be tried again."""
        return [int(task) for task in np.flatnonzero(self.status() != TaskStatus.DONE)]

    def write_task(self, task: int, arrays: Arrays, errors: dict[int, str]) -> None:
        """Write all chunks of a task; `commit` marks it afterwards.

        Raises
        ------
        CreepingError
            If an array has not the shape that the layout says.
        """
        rows = self.rows(task)
        if self.array(STATUS)[task] != TaskStatus.UNDONE:
            # a task that is tried again is not whole until it is marked again
            self.put(STATUS, slice(task, task + 1), TaskStatus.UNDONE)
        for name in self.variables:
            expected = (rows.stop - rows.start, *self.array(name).shape[1:])
            if arrays[name].shape != expected:
                raise CreepingError(f"the sweeper gave {name} of shape {arrays[name].shape}, not {expected}: a mistake")
            self.put(name, rows, arrays[name])
        if errors:
            texts = np.zeros((rows.stop - rows.start, layout.ERROR_BYTES), dtype=np.uint8)
            for row, text in errors.items():
                raw = text.encode()[: layout.ERROR_BYTES]
                texts[row, : len(raw)] = np.frombuffer(raw, dtype=np.uint8)
            self.put(ERRORS, rows, texts)

    def commit(self, task: int, *, failures: bool) -> None:
        """Mark a task, all of whose chunks are written."""
        self.put(STATUS, slice(task, task + 1), TaskStatus.WITH_FAILURES if failures else TaskStatus.DONE)

    def undo(self, task: int) -> None:
        """Mark a task as missing."""
        for name in self.variables:
            self.chunk_file(name, task).unlink(missing_ok=True)
        self.put(STATUS, slice(task, task + 1), TaskStatus.UNDONE)

    def failures(self) -> list[tuple[int, str]]:
        """The first incidences that failed, and why."""
        found: list[tuple[int, str]] = []
        for task in np.flatnonzero(self.status() == TaskStatus.WITH_FAILURES):
            first = self.rows(int(task)).start
            failed, texts = self.read("incidence_status", int(task)) == LineStatus.FAILED, self.read(ERRORS, int(task))
            for row in np.flatnonzero(failed):
                found.append((first + int(row), bytes(texts[row]).rstrip(b"\0").decode(errors="replace")))
            if len(found) >= SHOWN:
                break
        return found[:SHOWN]

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
        damaged = []
        with self.locked() if repair else nullcontext():
            for task in map(int, np.flatnonzero(self.status() != TaskStatus.UNDONE)):
                try:
                    for name in self.variables:
                        self.read(name, task)
                except CreepingError as error:
                    damaged.append((task, str(error)))
                    if repair:
                        self.undo(task)
        return damaged

    def lost(self) -> dict[int, str]:
        """Done tasks without all their chunks, and the first variable that they lack."""
        lost = {}
        for task, mark in enumerate(self.status()):
            names = [*self.variables, ERRORS][: None if mark == TaskStatus.WITH_FAILURES else -1]
            name = next((name for name in names if not self._exists(name, task)), None)
            if mark != TaskStatus.UNDONE and name is not None:
                lost[task] = name
        return lost

    def _is_described(self) -> bool:
        try:
            found = layout.unchanging_digest(self.folder, self.variables, self.content["coordinates"])
            return found == str(self.content["unchanging"])
        except OSError:
            return False

    def finish(self) -> None:
        """Write counts to the attributes of the folder, for other readers."""
        with self.writing():
            layout.write_root(self.folder, self._attributes(), self.content["coordinates"])

    def _attributes(self) -> dict[str, Any]:
        return {**self.content["attributes"], **count_attributes(self.incidence_status(), self.failures())}

    def dataset(self, *, loaded: bool = False) -> "xarray.Dataset":
        """Dataset whose values are read when they are used; a chunk that is damaged then is a `CreepingError`.

        Or one that is ``loaded``, what is missing as its arrays are filled.

        Raises
        ------
        CreepingError
            If the store is damaged or incomplete; of one that is loaded also if a chunk is damaged.
        """
        # refuse a store whose descriptions are damaged, or that lacks chunks of done tasks
        if not self._is_described():
            raise CreepingError(
                f"what describes arrays or holds coordinates in {self.folder} is damaged or missing; to write it anew, "
                "resume"
            )
        lost = self.lost()
        if lost:
            task, name = next(iter(lost.items()))
            raise CreepingError(
                f"{name} of {self._place(task)} is missing in {self.folder} ({len(lost)} such tasks); to compute it "
                "anew, resume",
                task=task,
            )
        options: dict[str, Any] = {"consolidated": False} | ({"chunks": None} if loaded else {})
        with self.reading("a variable"):
            opened: xarray.Dataset = register().open_zarr(self.folder, **options)
            opened = opened.set_coords(self.content["coordinates"])
            # in the order of the request; a selection lacks coordinates with dimensions of their own
            found = opened[self.variables].assign_coords(opened.coords)
            found.attrs = self._attributes()
            if loaded:
                return found.load()
        return found.assign({name: found[name].copy(data=self._lazily(name)) for name in self.variables})

    def _lazily(self, name: str) -> Any:
        """Array of a variable for dask, whose blocks are read by `read`."""
        from dask import array

        whole = self.array(name)
        chunks = array.core.normalize_chunks(whole.chunks, whole.shape)
        kind, label = np.empty((0,) * whole.ndim, whole.dtype), f"{name}-{uuid.uuid4().hex}"
        return array.map_blocks(_block, store=self, variable=name, chunks=chunks, meta=kind, name=label)

    def read(self, name: str, task: int) -> Any:
        """Values of a variable of one task.

        Raises
        ------
        CreepingError
            If its chunk is damaged, or is missing though the task is done.
        """
        with self.reading(name, task):
            if not self._exists(name, task) and self.array(STATUS)[task] != TaskStatus.UNDONE:
                # zarr would read the fill value
                raise ValueError("its chunk is missing")
            return self.array(name)[self.rows(task)]

    def chunk_file(self, name: str, task: int) -> Path:
        """File of the chunk of a task."""
        return self.folder.joinpath(name, "c", str(task), *["0"] * (self.array(name).ndim - 1))

    def _exists(self, name: str, task: int) -> bool:
        """Whether a chunk is there, and has anything in it."""
        with suppress(OSError):
            return self.chunk_file(name, task).stat().st_size > 0
        return False

    def array(self, name: str) -> Any:
        """Array as zarr opens it."""
        if name not in self._opened:
            zarr = require("zarr")
            # chunks of fill values too, so that one that is lost is missed
            with self.reading(f"{name}/{layout.ROOT}"), zarr.config.set({"array.write_empty_chunks": name != ERRORS}):
                self._opened[name] = zarr.open_array(self.folder / name, mode="r+", zarr_format=3)
        return self._opened[name]

    def put(self, name: str, rows: slice, values: Any) -> None:
        """Write rows of an array."""
        with self.writing():
            self.array(name)[rows] = values

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Make what goes wrong in a write an error with the space that is left."""
        try:
            yield
        except OSError as error:
            free = shutil.disk_usage(self.folder).free if self.folder.exists() else 0
            raise CreepingError(
                f"cannot write to {self.folder}: {os.strerror(error.errno) if error.errno else error} "
                f"({free / 1e6:.0f} MB are free); what is done is kept: make room and resume"
            ) from error

    @contextmanager
    def reading(self, name: str, task: int | None = None) -> Iterator[None]:
        """Make what goes wrong in a read an error that names the variable and the task."""
        try:
            yield
        except CreepingError:
            raise
        except Exception as error:  # whatever zarr, its codecs and json make of damage
            what = name if task is None else f"{name} of {self._place(task)}"
            raise CreepingError(
                f"{what} in {self.folder} is damaged ({error}); to compute damaged tasks anew, resume with "
                "--verify, or after SweepStore.verify(repair=True)",
                task=task,
            ) from error

    def mended(self, plan: SweepPlan) -> list[str]:
        """Write damaged descriptions anew, and mark tasks as missing whose chunks or marks are lost; see `plan`.

        Parameters
        ----------
        plan : SweepPlan
            That of the store; see `require_same`.

        Returns
        -------
        list of str
            What was damaged.

        Raises
        ------
        CreepingError
            If the plan does not give the same files again, or another process fills the store.
        """
        found = []
        with self.locked():
            if not self._is_described():
                with layout.aside_of(self.folder) as aside:
                    anew = layout.write_empty(aside, plan, self.content["unit"])
                    if anew["unchanging"] != self.content["unchanging"]:
                        raise CreepingError(
                            f"what describes arrays in {self.folder} is damaged, and this installation would write it "
                            "otherwise; compute the sweep anew"
                        )
                    shutil.copytree(aside, self.folder, dirs_exist_ok=True)
                self._opened.clear()
                found = ["what describes arrays or holds coordinates was damaged, and is written anew"]
            for task in range(self.tasks):
                try:
                    with self.reading(STATUS, task):
                        self.array(STATUS)[task]
                except CreepingError:
                    self.chunk_file(STATUS, task).unlink(missing_ok=True)
                    found.append(f"the mark of task {task} was damaged; it is computed anew")
            for task, name in self.lost().items():
                self.undo(task)
                found.append(f"{name} of task {task} was missing; the task is computed anew")
        return found


def _block(*, store: SweepStore, variable: str, block_id: tuple[int, ...]) -> Any:
    return store.read(variable, block_id[0])
