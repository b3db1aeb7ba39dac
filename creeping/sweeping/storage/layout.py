"""Layout of a store on disk: its arrays, made with nothing in them, and the group that holds its study.

All of it follows from the plan, and is written anew from it where it is damaged, if that gives the same bytes.

Also here: the arrays of a store on disk, read and written a task at a time; what goes wrong there is a `CreepingError`.

Also here: what is cheap to know of the damage to a store: its small files by their digests.

The study of a store lists the digests of all files that are the same from its beginning to its end: what describes
each array, and the coordinates. What describes the root changes with the counts of incidences; its attributes have a
digest among them.
"""

import hashlib
import json
import os
import shutil
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from creeping._typing import Any
from creeping.errors import CreepingError
from creeping.geometry.checks import UNKNOWN
from creeping.storage.folder import content_digest
from creeping.storage.reading import bytes_of, opened
from creeping.sweeping.plan import SweepPlan
from creeping.sweeping.results import (
    MISSING,
    coordinates,
    count_attributes,
    require,
    sweep_attributes,
    variable_attributes,
)

SCHEMA = 2
STATUS, SUMS, ERRORS = "task_status", "task_checksums", "incidence_error"
UNDONE, DONE, WITH_FAILURES = 0, 1, 2
ERROR_BYTES = 256
"""Bytes kept of the message of a failed incidence, UTF-8, zeros after it."""
COORDINATE_CHUNK = 65_536

ROOT, STUDY, STUDY_FILE = "zarr.json", "study", "study/zarr.json"
MOST_DOCUMENT = 10**9
"""Bytes."""
SEAL = "attributes_blake2b"
"""Attribute of the root that holds the digest of the others."""


def write_empty(folder: Path, plan: SweepPlan, unit: str) -> None:
    """Write groups, coordinates, and arrays without chunks; lengths are called ``unit``."""
    zarr = require("zarr")
    group = zarr.open_group(folder, mode="w", zarr_format=3)
    request, count = plan.request, len(plan.incidences)
    beside = coordinates(request, plan.incidences, unit)
    for name, (dims, values, words) in beside.items():
        text = values.dtype.kind == "U"
        where = _create(
            group, name, values.shape, str if text else values.dtype, dims, words, first=COORDINATE_CHUNK, fill=None
        )
        where[:] = values.astype(object) if text else values
    for name, variable in request.variables.items():
        shape = (count, *(request.sizes[d] for d in variable.dims))
        words, dims = variable_attributes(request, name, unit), ("incidence", *variable.dims)
        _create(group, name, shape, variable.dtype, dims, words, first=plan.chunk, fill=variable.fill)
    words = {"description": "0 missing, 1 done, 2 done but for failed incidences; written last"}
    _create(group, STATUS, (plan.tasks,), "int8", ("task",), words, first=1, fill=UNDONE)
    words = {"description": "CRC-32C at the end of each variable's chunk, in the order of the study's list"}
    size = (plan.tasks, len(request.variables))
    _create(group, SUMS, size, "uint32", ("task", "variable"), words, first=1, fill=0)
    words = {"description": "why an incidence failed, UTF-8, zeros after it"}
    _create(group, ERRORS, (count, ERROR_BYTES), "uint8", ("incidence", "character"), words, first=plan.chunk, fill=0)
    # as xarray writes it: which arrays are coordinates
    none_yet = count_attributes(np.full(count, MISSING), [])
    group.attrs.update(sealed(sweep_attributes(plan, unit) | none_yet | {"coordinates": " ".join(beside)}))
    study = group.create_group(STUDY)
    content = {"schema": SCHEMA, "key": plan.key, "variables": list(request.variables), "unit": unit}
    content["files"] = file_digests(folder)
    study.attrs.update({"content": content, "blake2b": content_digest(content)})


def write_anew(folder: Path, plan: SweepPlan, unit: str, names: list[str], known: dict[str, str]) -> None:
    """Write files of a store as they were, with the unit that it was begun with; ``known`` are their digests.

    Raises
    ------
    CreepingError
        If the plan does not give the same files again, or they cannot be written.
    """
    aside = folder.parent / f".{folder.name}-{uuid.uuid4().hex[:12]}"
    try:
        aside.mkdir()
        write_empty(aside, plan, unit)
        for name in names:
            if not is_whole(aside, name, known[name]):
                raise CreepingError(
                    f"{folder / name} is damaged, and this installation would write another one; compute the sweep anew"
                )
        for name in names:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            os.replace(aside / name, folder / name)
    except OSError as error:
        raise CreepingError(f"cannot write to {folder}: {error}; make room, or choose another place") from error
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def _create(
    group: Any,
    name: str,
    shape: tuple[int, ...],
    dtype: Any,
    dims: Any,
    words: dict[str, Any],
    *,
    first: int,
    fill: Any,
) -> Any:
    """Array with chunks that are whole but along the first axis."""
    from zarr.codecs import Crc32cCodec, ZstdCodec

    return group.create_array(
        name,
        shape=shape,
        dtype=dtype,
        chunks=(min(first, shape[0]), *shape[1:]),
        dimension_names=dims,
        attributes=words,
        compressors=[ZstdCodec(level=1), Crc32cCodec()],
        **({} if fill is None else {"fill_value": fill}),
    )


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


def read_document(file: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """What zarr keeps in a file: attributes, and the rest.

    Raises
    ------
    OSError, ValueError
        If it cannot be read, or is something else.
    """
    document = json.loads(bytes_of(file, MOST_DOCUMENT))
    if not isinstance(document, dict) or not isinstance(document.get("attributes"), dict):
        raise ValueError("no attributes are in it")
    return document.pop("attributes"), document


def sealed(attributes: dict[str, Any]) -> dict[str, Any]:
    """Attributes with their digest among them."""
    plain = {name: value for name, value in attributes.items() if name != SEAL}
    return plain | {SEAL: content_digest(plain)}


def file_digests(folder: Path) -> dict[str, str]:
    """Digests of the files of an empty store by their paths; of the root and the study without their attributes."""
    found = {}
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        name = path.relative_to(folder).as_posix()
        found[name] = content_digest(read_document(path)[1]) if name in (ROOT, STUDY_FILE) else _digest(path)
    return found


def damaged_files(folder: Path, known: dict[str, str]) -> list[str]:
    """Files of a store that are not what they were, by their paths."""
    return [name for name, digest in known.items() if not is_whole(folder, name, digest)]


def is_whole(folder: Path, name: str, digest: str) -> bool:
    """Whether a file of a store is what it was; the attributes of the study have a digest of their own."""
    try:
        if name not in (ROOT, STUDY_FILE):
            return _digest(folder / name) == digest
        attributes, rest = read_document(folder / name)
        return content_digest(rest) == digest and (name != ROOT or attributes == sealed(attributes))
    except (OSError, ValueError, RecursionError):
        return False


def _digest(path: Path) -> str:
    with opened(path) as stream:
        return hashlib.file_digest(stream, lambda: hashlib.blake2b(digest_size=16)).hexdigest()
