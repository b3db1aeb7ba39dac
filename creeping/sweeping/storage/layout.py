"""Layout of a store on disk: its arrays, made with nothing in them, and the group that holds its study.

All of it follows from the plan, and is written anew from it where it is damaged, if that gives the same bytes.
"""

import os
import shutil
import uuid
from pathlib import Path

from creeping._typing import Any
from creeping.errors import CreepingError
from creeping.storage.folder import content_digest
from creeping.sweeping.plan import SweepPlan
from creeping.sweeping.results import coordinates, require, sweep_attributes, variable_attributes
from creeping.sweeping.storage.damage import STUDY, file_digests, is_whole, sealed

SCHEMA = 2
STATUS, SUMS, ERRORS = "task_status", "task_checksums", "incidence_error"
UNDONE, DONE, WITH_FAILURES = 0, 1, 2
ERROR_BYTES = 256
"""Bytes kept of the message of a failed incidence, UTF-8, zeros after it."""
COORDINATE_CHUNK = 65_536


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
    group.attrs.update(sealed(sweep_attributes(plan, unit) | {"coordinates": " ".join(beside)}))
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
