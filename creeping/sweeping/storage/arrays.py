"""The arrays of a store on disk, read and written a task at a time; what goes wrong there is a `CreepingError`."""

import os
import shutil
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from creeping._typing import Any
from creeping.errors import CreepingError
from creeping.geometry.unit import UNKNOWN
from creeping.sweeping.results import require
from creeping.sweeping.storage.damage import ROOT
from creeping.sweeping.storage.layout import ERRORS, STATUS, SUMS, UNDONE


class StoreArrays:
    """Arrays of a folder whose study is known; see `creeping.sweeping.storage.store.SweepStore`."""

    def __init__(self, folder: Path, content: dict[str, Any]) -> None:
        self.folder, self.key = folder, content["key"]
        self.chunk, self.count = int(self.key["chunk"]), int(self.key["incidences"]["count"])
        self.tasks = -(-self.count // self.chunk)
        self.variables: list[str] = list(content["variables"])
        self.files: dict[str, str] = content["files"]
        # stores without it were begun when all of them called lengths L
        self.unit = str(content.get("unit", UNKNOWN))
        self._opened: dict[str, Any] = {}
        self._lock: Any = None

    def rows(self, task: int) -> slice:
        """Incidences of a task."""
        return slice(task * self.chunk, min((task + 1) * self.chunk, self.count))

    def read(self, name: str, task: int) -> Any:
        """Values of a variable of one task.

        Raises
        ------
        CreepingError
            If its chunk is damaged, or is missing though the task is done.
        """
        with self.reading(name, task):
            if not exists(self.chunk_file(name, task)) and self.array(STATUS)[task] != UNDONE:
                # zarr would read the fill value
                raise ValueError("its chunk is missing")
            if self.array(STATUS)[task] != UNDONE and name in self.variables:
                known = self.array(SUMS)[task][self.variables.index(name)]
                if checksum(self.chunk_file(name, task)) != known:
                    raise ValueError("its chunk is another than the one that was written")
            return self.array(name)[self.rows(task)]

    def lazily(self, name: str) -> Any:
        """Array of a variable for dask, whose blocks are read by `read`."""
        from dask import array

        whole = self.array(name)
        chunks = array.core.normalize_chunks(whole.chunks, whole.shape)
        kind, label = np.empty((0,) * whole.ndim, whole.dtype), f"{name}-{uuid.uuid4().hex}"
        return array.map_blocks(_block, store=self, variable=name, chunks=chunks, meta=kind, name=label)

    def __getstate__(self) -> dict[str, Any]:
        # what blocks of the dataset take along to a worker
        return self.__dict__ | {"_opened": {}, "_lock": None}

    def close(self) -> None:
        """Forget what is known of the arrays on disk."""
        self._opened.clear()

    def chunk_file(self, name: str, task: int) -> Path:
        """File of the chunk of a task."""
        return self.folder.joinpath(name, "c", str(task), *["0"] * (self.array(name).ndim - 1))

    def array(self, name: str) -> Any:
        """Array as zarr opens it."""
        if name not in self._opened:
            zarr = require("zarr")
            # chunks of fill values too, so that one that is lost is missed
            with self.reading(f"{name}/{ROOT}"), zarr.config.set({"array.write_empty_chunks": name != ERRORS}):
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
            what = name if task is None else f"{name} of task {task}"
            rows = "" if task is None else f" (incidences {self.rows(task).start} to {self.rows(task).stop - 1})"
            raise CreepingError(
                f"{what}{rows} in {self.folder} is damaged ({error}); to compute damaged tasks anew, resume with "
                "--verify, or after SweepStore.verify(repair=True)",
                task=task,
            ) from error


def exists(chunk: Path) -> bool:
    """Whether a chunk is there, and has anything in it."""
    try:
        return chunk.stat().st_size > 0
    except OSError:
        return False


def checksum(chunk: Path) -> int:
    """CRC-32C at the end of a chunk's file, which zarr compares with the rest of it."""
    with open(chunk, "rb") as stream:
        stream.seek(-4, os.SEEK_END)
        return int.from_bytes(stream.read(4), "little")


def _block(*, store: StoreArrays, variable: str, block_id: tuple[int, ...]) -> Any:
    return store.read(variable, block_id[0])
