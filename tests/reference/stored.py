"""Exact values that take seconds to compute, kept as small files: what the tests of the default suite compare with.

A case is a function of no arguments in `tests.reference.cases`; it returns arrays by their names, the points that
they belong to among them. ``read`` opens the file of a case. A slow test computes every case anew and compares.
``python -m tests.reference.stored [NAME ...]`` writes the files, those of all cases where none is named.
"""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tests.reference.conditions import Arrays

FOLDER = Path(__file__).with_name("values")


def cases() -> dict[str, Callable[[], Arrays]]:
    """All cases by their names."""
    from tests.reference import cases as module

    own = {name: made for name, made in vars(module).items() if getattr(made, "__module__", "") == module.__name__}
    return {name: made for name, made in own.items() if not name.startswith("_")}


def read(name: str) -> Arrays:
    """What a case had returned when its file was written."""
    with np.load(FOLDER / f"{name}.npz", allow_pickle=False) as file:
        return dict(file)


def write(name: str) -> None:
    """Compute a case and write its file."""
    FOLDER.mkdir(exist_ok=True)
    np.savez_compressed(FOLDER / f"{name}.npz", allow_pickle=False, **cases()[name]())


if __name__ == "__main__":
    for case in sys.argv[1:] or cases():
        print(case, flush=True)
        write(case)
