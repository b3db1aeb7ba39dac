"""How far do the files of a folder come? Each to a far field, by the options that its refusals name.

A file is opened without options; where it is refused and the refusal names an option that decides nothing for its user
(`OPTIONS`), it is opened again with that. Then a fan and the far field of a hard body ten wavelengths across, in four
directions, in a process of its own. One row a file: options, seconds of the processor for body, fan and field, what is
lost at edges and tips, the largest field and the error of it, how many directions are unresolved, or the refusal.

Run ``python -m studies real_files FOLDER`` (a minute a file, five at most).
"""

import re
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path

import numpy as np

import creeping as cr
import scatterers as sc
from creeping._typing import Any
from creeping.commands.options import CAD, MESHES
from studies import Row, main

OPTIONS = {"part": "largest", "cap": 1e9, "subdivide": "auto", "union": True, "sew": 1e-3, "units": "m"}
"""What is taken of an option that a refusal names, in this order."""
EMPTY: Row = dict.fromkeys(
    "file, options, stage, body s, fan s, all s, lost, method, field, error, unresolved, refusal".split(", "), ""
)


def far_field_of(path: Path, options: dict[str, Any]) -> Row:
    """Row of a file that comes as far as a far field, or of its refusal."""
    row: Row = {**EMPTY, "file": path.name, "options": options, "stage": "body"}
    began = time.process_time()
    try:
        body: Any = (sc.Cad if path.suffix.lower() in CAD else sc.Mesh)(path, cache=False, **options)
        row |= {"body s": time.process_time() - began, "stage": "fan"}
        # ten wavelengths across
        k = 2 * np.pi * 10.0 / float(np.linalg.norm(np.ptp(body.bounds, axis=0)))
        fan = cr.launch(cr.DirectFlow(body), _line(body), wavenumber=k)
        losses = fan.losses()
        row |= {"fan s": time.process_time() - began, "stage": "field"}
        row["lost"] = None if losses is None else [float(share) for share in losses]
        far = cr.far_field(fan, [(1, 0, 0), (0, 1, 0), (0, 0, 1), (-0.6, 0.8, 0)], wavenumber=k, boundary="hard")
    except (ValueError, RuntimeError, MemoryError) as error:
        return row | {"refusal": f"{type(error).__name__}: {error}"}
    largest = int(np.argmax(np.abs(far.total)))
    return row | {
        "stage": "done",
        "all s": time.process_time() - began,
        "method": str(far.method[0]),
        "field": float(np.abs(far.total[largest])),
        "error": float(far.error[largest]),
        "unresolved": int(np.sum(far.unresolved)),
    }


def _line(body: Any) -> cr.ShadowLine:
    """Shadow line of an incidence, or of another one if that is singular."""
    try:
        return cr.shadow_line(body, (1.0, 0.4, 0.7))
    except cr.SingularIncidenceError:
        return cr.shadow_line(body, (0.9, 0.5, 0.7))


def named_option(refusal: str, given: dict[str, Any]) -> dict[str, Any]:
    """The options given, and the first that a refusal names beside them."""
    for name, value in OPTIONS.items():
        if name not in given and re.search(rf"\b{name}\b ?=|\b{name}\b in ", refusal):
            return given | {name: value}
    return given


def followed(path: Path, limit: float) -> list[Row]:
    """Rows of a file: one for each option that it was opened with, the last one where it comes to."""
    rows: list[Row] = []
    options: dict[str, Any] = {}
    while True:
        rows.append(_in_process(path, options, limit))
        more = named_option(rows[-1].get("refusal", ""), options)
        if more == options:
            return rows
        options = more


def _in_process(path: Path, options: dict[str, Any], limit: float) -> Row:
    import resource

    most = (resource.RLIMIT_CPU, (int(limit), int(limit) + 5))
    with ProcessPoolExecutor(1, get_context("spawn"), resource.setrlimit, most) as pool:
        try:
            return pool.submit(far_field_of, path, options).result()
        except BrokenProcessPool:
            return {**EMPTY, "file": path.name, "options": options, "stage": "ended by the system, or out of time"}


def files(where: Path, limit: float = 300.0) -> Iterator[Row]:
    """Files of a folder, or one file: how far each comes, options by options."""
    for path in sorted(where.iterdir()) if where.is_dir() else [where]:
        if path.suffix.lower() in (*CAD, *MESHES):
            yield from followed(path.absolute(), limit)


if __name__ == "__main__":
    main((files,), {"files": {"limit": 60.0}}, places=1)
