"""Mending a store before it is filled further: files written anew from the plan, tasks computed anew."""

import json

from creeping.errors import CreepingError
from creeping.storage.atomic import written_aside
from creeping.sweeping.plan import SweepPlan
from creeping.sweeping.storage.damage import STUDY_FILE, damaged_files, read_document
from creeping.sweeping.storage.layout import write_anew
from creeping.sweeping.storage.store import SweepStore


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
