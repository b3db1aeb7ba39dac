"""Layout of a store of results on disk: its arrays, made with nothing in them, and the group that holds its study.

All of it follows from the plan, and is written anew from it where it is damaged, if that gives the same bytes.
"""

import hashlib
import json
import shutil
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from enum import IntEnum
from pathlib import Path

import numpy as np

from creeping._typing import Any
from creeping.errors import CreepingError
from creeping.geometry.checks import unit_of
from creeping.storage.atomic import bytes_of, written_aside
from creeping.storage.folder import content_digest
from creeping.sweeping import results
from creeping.sweeping.plan import SweepPlan
from creeping.sweeping.results import MISSING, require

SCHEMA = 3
ROOT, STUDY = "zarr.json", "study"
STATUS, ERRORS = "task_status", "incidence_error"
ERROR_BYTES = 256
"""Bytes kept of the message of a failed incidence, UTF-8, zeros after it."""
MOST_DOCUMENT = 10**9
"""Bytes of what describes a study, an array or a chunk of coordinates."""


class TaskStatus(IntEnum):
    """How far a task is."""

    UNDONE = 0
    DONE = 1
    WITH_FAILURES = 2


@contextmanager
def aside_of(folder: Path) -> Iterator[Path]:
    """A new folder beside another, gone afterwards if it is still there.

    Raises
    ------
    CreepingError
        If something cannot be written.
    """
    aside = folder.parent / f".{folder.name}-{uuid.uuid4().hex[:12]}"
    try:
        aside.mkdir(parents=True)
        yield aside
    except OSError as error:
        raise CreepingError(f"cannot make the store {folder}: {error}; choose another place") from error
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def write_empty(folder: Path, plan: SweepPlan, unit: str | None = None) -> dict[str, Any]:
    """Write the arrays of a plan without chunks, coordinates and root; what the study is to say of them.

    Lengths are called ``unit``, by default as the body knows it.
    """
    group = require("zarr").open_group(folder, mode="w", zarr_format=3)
    from zarr.codecs import Crc32cCodec, ZstdCodec

    codecs = [ZstdCodec(level=1), Crc32cCodec()]

    def create(name: str, shape: Any, dtype: Any, dims: Any, words: Any, first: int, **fill: Any) -> Any:
        """Array with chunks that are whole but along the first axis."""
        options = {"chunks": (min(first, shape[0]), *shape[1:]), "compressors": codecs, "attributes": words} | fill
        return group.create_array(name, shape=shape, dtype=dtype, dimension_names=dims, **options)

    request, count, unit = plan.request, len(plan.incidences), unit or unit_of(plan.body)
    beside = results.coordinates(request, plan.incidences, unit)
    for name, (dims, values, words) in beside.items():
        text = values.dtype.kind == "U"
        where = create(name, values.shape, str if text else values.dtype, dims, words, values.shape[0])
        where[:] = values.astype(object) if text else values
    for name, variable in request.variables.items():
        shape = (count, *(request.sizes[d] for d in variable.dims))
        words, dims = results.variable_attributes(request, name, unit), ("incidence", *variable.dims)
        create(name, shape, variable.dtype, dims, words, plan.chunk, fill_value=variable.fill)
    words = {"description": "0 missing, 1 done, 2 done but for failed incidences; written last"}
    create(STATUS, (plan.tasks,), "int8", ("task",), words, 1, fill_value=int(TaskStatus.UNDONE))
    words = {"description": "why an incidence failed, UTF-8, zeros after it"}
    create(ERRORS, (count, ERROR_BYTES), "uint8", ("incidence", "character"), words, plan.chunk, fill_value=0)
    attributes = results.sweep_attributes(plan, unit)
    write_root(folder, attributes | results.count_attributes(np.full(count, MISSING), []), list(beside))
    return {
        "schema": SCHEMA,
        "key": plan.key,
        "variables": list(request.variables),
        "coordinates": list(beside),
        "unit": unit,
        "attributes": attributes,
        "unchanging": unchanging_digest(folder, list(request.variables), list(beside)),
    }


def write_root(folder: Path, attributes: dict[str, Any], beside: list[str]) -> None:
    """Describe the folder, as xarray does: which arrays are coordinates."""
    _write_group(folder, attributes | {"coordinates": " ".join(beside)})


def write_study(folder: Path, content: dict[str, Any]) -> None:
    """Write what a new folder says of its study, with its digest."""
    (folder / STUDY).mkdir()
    _write_group(folder / STUDY, {"content": content, "blake2b": content_digest(content)})


def _write_group(folder: Path, attributes: dict[str, Any]) -> None:
    with written_aside(folder / ROOT) as aside:
        aside.write_text(json.dumps({"attributes": attributes, "zarr_format": 3, "node_type": "group"}))


def unchanging_digest(folder: Path, variables: list[str], beside: list[str]) -> str:
    """Digest of what describes the arrays, and of the coordinates ``beside`` them: names and bytes of the files.

    Other arrays, and files that a system or a viewer leaves, are nobody's business.

    Raises
    ------
    OSError
        If one cannot be read.
    """
    files = [folder / name / ROOT for name in (*variables, *beside, STATUS, ERRORS)]
    for name in beside:
        chunks = folder / name / "c"
        numbered = (path for path in chunks.rglob("*") if all(map(str.isdigit, path.relative_to(chunks).parts)))
        files += [path for path in numbered if path.is_file()]
    found = {
        path.relative_to(folder).as_posix(): hashlib.blake2b(bytes_of(path, MOST_DOCUMENT)).hexdigest()
        for path in files
    }
    return content_digest(found)
