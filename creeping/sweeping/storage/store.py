"""Results of a sweep on disk: a zarr v3 folder that survives the death of its writers.

One array a variable, with dimension names, one chunk a task along the incidences, compressed and with a CRC. Chunks are
written aside and renamed, and ``task_status`` of a task (0 missing, 1 done, 2 done but for failed incidences) after all
its chunks: what is marked is whole, whenever a writer dies. The group ``study`` holds what the results depend on, with
a digest, the digests of what describes arrays and coordinates, and the flow. A store is opened if these agree and the
chunks of done tasks are there; `SweepStore.verify` reads them. CRCs and digests have no key: they tell of accidents,
not of forgery.

Also here: mending a store before it is filled further: files written anew from the plan, tasks computed anew.
"""

import shutil
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import IntArray
from creeping.errors import CreepingError, InvalidInputError
from creeping.geometry.checks import unit_of
from creeping.geometry.surface import Surface
from creeping.rays.transport import Flow
from creeping.shadow.status import FAILED
from creeping.storage.folder import content_digest
from creeping.sweeping.plan import Arrays, SweepPlan, differing, open_flow, save_flow
from creeping.sweeping.results import MISSING, SHOWN, count_attributes, register, require
from creeping.sweeping.storage.layout import (
    DONE,
    ERROR_BYTES,
    ERRORS,
    ROOT,
    SCHEMA,
    SEAL,
    STATUS,
    STUDY,
    STUDY_FILE,
    SUMS,
    UNDONE,
    WITH_FAILURES,
    StoreArrays,
    checksum,
    damaged_files,
    exists,
    read_document,
    sealed,
    write_empty,
)

if TYPE_CHECKING:
    import xarray
import json

from creeping.storage.atomic import written_aside
from creeping.sweeping.storage.layout import write_anew


class SweepStore(StoreArrays):
    """A store; make one with `create`, or open one with `open`.

    Attributes
    ----------
    folder : Path
    key : dict
        What the results depend on; see `SweepPlan.key`.
    files : dict
        Digests of what is the same from beginning to end; see `creeping.sweeping.storage.layout`.
    unit : str
        Of lengths in what it says of its arrays: "m" where the body knew it, else "L".
    """

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
            write_empty(aside, plan, unit_of(plan.body))
            save_flow(plan.flow, aside / STUDY)
            aside.rename(folder)
        except BaseException as error:
            shutil.rmtree(aside, ignore_errors=True)
            if isinstance(error, OSError):
                raise CreepingError(f"cannot make the store {folder}: {error}; choose another place") from error
            raise
        return cls.open(folder)

    @classmethod
    def open(cls, folder: str | Path, *, mending: bool = False) -> "SweepStore":
        """Open a store.

        Parameters
        ----------
        folder : path
        mending : bool
            Open it though files are damaged, for `mended`; what it says of its study must be whole.

        Raises
        ------
        CreepingError
            If there is none, if what it says of its study is damaged or of another schema, or if a file that describes
            an array or holds coordinates is damaged, or a chunk of a done task missing.
        """
        require("zarr")
        folder = Path(folder).absolute()
        try:
            attributes, _ = read_document(folder / STUDY_FILE)
            content = attributes["content"]
            intact = attributes["blake2b"] == content_digest(content)
        except OSError as error:
            raise CreepingError(f"{folder} holds no sweep ({error}); choose another store") from error
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            raise CreepingError(f"{folder / STUDY_FILE} is damaged ({error}); compute the sweep anew") from error
        if not intact:
            raise CreepingError(f"{folder / STUDY_FILE} is damaged: its digest differs; compute the sweep anew")
        if content.get("schema") != SCHEMA:
            raise CreepingError(f"{folder} has schema {content.get('schema')!r}, this version reads {SCHEMA}")
        store = cls(folder, content)
        if not mending:
            store.require_whole()
        return store

    def require_whole(self) -> None:
        """Refuse a store with damaged files, or without chunks of done tasks.

        Raises
        ------
        CreepingError
            With the first of them and their number.
        """
        names = damaged_files(self.folder, self.files)
        if names:
            raise CreepingError(
                f"{self.folder / names[0]} is damaged or missing ({len(names)} such files); to write it anew, resume",
                path=self.folder / names[0],
            )
        lost = self.lost()
        if lost:
            task, name = next(iter(lost.items()))
            rows = self.rows(task)
            raise CreepingError(
                f"{name} of task {task} (incidences {rows.start} to {rows.stop - 1}) is missing in {self.folder} "
                f"({len(lost)} such tasks); to compute it anew, resume",
                task=task,
            )

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

    @property
    def matrices(self) -> Path:
        """Folder of the T-matrices that its fields are made of."""
        return self.folder / STUDY / "t-matrices"

    def status(self) -> IntArray:
        """Status of the tasks (tasks,): 0 missing, 1 done, 2 done but for failed incidences."""
        with self.reading(STATUS):
            return np.asarray(self.array(STATUS)[:], dtype=np.int64)

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
        if self.array(STATUS)[task] != UNDONE:
            # a task that is tried again is not whole until it is marked again
            self.put(STATUS, slice(task, task + 1), UNDONE)
        for name in self.variables:
            expected = (rows.stop - rows.start, *self.array(name).shape[1:])
            if arrays[name].shape != expected:
                raise CreepingError(f"the sweeper gave {name} of shape {arrays[name].shape}, not {expected}: a mistake")
            self.put(name, rows, arrays[name])
        sums = [checksum(self.chunk_file(name, task)) for name in self.variables]
        self.put(SUMS, slice(task, task + 1), np.array([sums], dtype=np.uint32))
        if errors:
            texts = np.zeros((rows.stop - rows.start, ERROR_BYTES), dtype=np.uint8)
            for row, text in errors.items():
                raw = text.encode()[:ERROR_BYTES]
                texts[row, : len(raw)] = np.frombuffer(raw, dtype=np.uint8)
            self.put(ERRORS, rows, texts)

    def commit(self, task: int, *, failures: bool) -> None:
        """Mark a task, all of whose chunks are written."""
        self.put(STATUS, slice(task, task + 1), WITH_FAILURES if failures else DONE)

    def failures(self, most: int = SHOWN) -> list[tuple[int, str]]:
        """The first incidences that failed, and why."""
        found: list[tuple[int, str]] = []
        for task in np.flatnonzero(self.status() == WITH_FAILURES):
            rows = self.rows(int(task))
            with self.reading(ERRORS, int(task)):
                failed = np.flatnonzero(self.array("incidence_status")[rows] == FAILED)
                texts = self.array(ERRORS)[rows]
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
            with self.reading("incidence_status"):
                return np.asarray(self.array("incidence_status")[:], dtype=np.int64)
        except CreepingError:
            # once more, by task, for the message
            for task in range(self.tasks):
                with self.reading("incidence_status", task):
                    self.array("incidence_status")[self.rows(task)]
            raise

    def finish(self) -> None:
        """Write counts to the attributes of the dataset."""
        zarr = require("zarr")
        status = self.incidence_status()
        for task in np.flatnonzero(self.status() == UNDONE):
            status[self.rows(int(task))] = MISSING
        with self.writing(), self.reading(ROOT):
            group = zarr.open_group(self.folder, mode="r+", zarr_format=3)
            old = {k: v for k, v in group.attrs.items() if k != "errors"}
            group.attrs.put(sealed(old | count_attributes(status, self.failures())))

    def dataset(self) -> "xarray.Dataset":
        """Dataset whose values are read when they are used; a chunk that is damaged then is a `CreepingError`.

        Raises
        ------
        CreepingError
            As `require_whole`.
        """
        self.require_whole()
        opened: xarray.Dataset = register().open_zarr(self.folder, consolidated=False)
        # in the order of the request; a selection lacks coordinates with dimensions of their own
        found = opened[self.variables].assign_coords(opened.coords)
        found.attrs.pop(SEAL)
        return found.assign({name: found[name].copy(data=self.lazily(name)) for name in self.variables})

    def loaded(self) -> "xarray.Dataset":
        """Dataset in memory, what is missing as its arrays are filled.

        Raises
        ------
        CreepingError
            As `require_whole`, and if a chunk is damaged.
        """
        self.require_whole()
        with self.reading("a variable"):
            opened: xarray.Dataset = register().open_zarr(self.folder, consolidated=False, chunks=None).load()
        found = opened[self.variables].assign_coords(opened.coords)
        found.attrs.pop(SEAL)
        return found

    def lost(self) -> dict[int, str]:
        """Done tasks without all their chunks, and the first variable that they lack."""
        lost = {}
        for task, mark in enumerate(self.status()):
            names = [] if mark == UNDONE else [*self.variables, *([ERRORS] if mark == WITH_FAILURES else [])]
            name = next((name for name in names if not exists(self.chunk_file(name, task))), None)
            if name is not None:
                lost[task] = name
        return lost

    def _verified(self, repair: bool) -> list[tuple[int, str]]:
        damaged = []
        for task in np.flatnonzero(self.status() != UNDONE):
            reason = self._damage(int(task))
            if reason:
                damaged.append((int(task), reason))
                if repair:
                    self.undo(int(task))
        return damaged

    def undo(self, task: int) -> None:
        """Mark a task as missing."""
        for name in self.variables:
            self.chunk_file(name, task).unlink(missing_ok=True)
        self.put(STATUS, slice(task, task + 1), UNDONE)

    def _damage(self, task: int) -> str:
        for name in self.variables:
            try:
                self.read(name, task)
            except CreepingError as error:
                return str(error)
        return ""

    def forget_mark(self, task: int) -> bool:
        """Remove the mark of a task if it cannot be read; whether that was so."""
        try:
            with self.reading(STATUS, task):
                self.array(STATUS)[task]
            return False
        except CreepingError:
            self.chunk_file(STATUS, task).unlink(missing_ok=True)
            return True


def mended(store: SweepStore, plan: SweepPlan) -> list[str]:
    """Write damaged files of a store anew, and mark done tasks as missing whose chunks or marks are lost.

    Parameters
    ----------
    store : SweepStore
    plan : SweepPlan
        That of the store; see `SweepStore.require_same`.

    Returns
    -------
    list of str
        What was damaged.

    Raises
    ------
    CreepingError
        If a damaged file does not follow from the plan, or another process fills the store.
    """
    try:
        store.require_whole()
        return []
    except CreepingError:
        pass
    found = []
    with store.locked():
        names = damaged_files(store.folder, store.files)
        if names:
            others = [name for name in names if name != STUDY_FILE]
            write_anew(store.folder, plan, store.unit, others, store.files)
            if STUDY_FILE in names:
                _write_study(store)
            store.close()
            found = [f"{name} was damaged, and is written anew" for name in names]
        marks = [task for task in range(store.tasks) if store.forget_mark(task)]
        found += [f"the mark of task {task} was damaged; it is computed anew" for task in marks]
        for task, name in store.lost().items():
            store.undo(task)
            found.append(f"{name} of task {task} was missing; the task is computed anew")
    return found


def _write_study(store: SweepStore) -> None:
    """Write the description of the study anew, whose content is whole."""
    file = store.folder / STUDY_FILE
    attributes, _ = read_document(file)
    with written_aside(file) as aside:
        aside.write_text(json.dumps({"attributes": attributes, "zarr_format": 3, "node_type": "group"}))
