"""Kinds of tables that a command writes, ``--format``, and the writing of them."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from creeping.errors import InvalidInputError

FORMATS = ("csv", "mat")
HELP = "Tables: csv or mat (MATLAB), or both joined by a comma."


def table_formats(text: str) -> tuple[str, ...]:
    """Kinds of tables that are asked for.

    Raises
    ------
    InvalidInputError
        If one is unknown, or given twice.

    Examples
    --------
    >>> table_formats("csv, mat")
    ('csv', 'mat')
    """
    names = tuple(name.strip().lower() for name in text.split(","))
    unknown = [name for name in names if name not in FORMATS]
    if unknown or len(set(names)) < len(names):
        raise InvalidInputError(f"--format {text!r}: give some of {', '.join(FORMATS)}, each once")
    return names


def write_tables(
    stem: Path, formats: Sequence[str], result: Any, *, observed: tuple[Sequence[str], Any] | None = None, **named: Any
) -> list[str]:
    """Write a result, for `write_csv` by its name, as a table of each format; returns the names of the files."""
    from creeping import files

    writers: dict[str, Callable[[Path], None]] = {
        "csv": lambda path: files.write_csv(path, observed=observed, **named),
        "mat": lambda path: files.write_mat(path, result, observed=observed),
    }
    for kind in formats:
        writers[kind](stem.with_suffix(f".{kind}"))
    return [f"{stem.name}.{kind}" for kind in formats]
