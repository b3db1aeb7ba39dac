"""What all studies share: tables of rows, printed as they come, and a command line of their tables."""

import argparse
import math
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

from creeping._typing import Any

Row = dict[str, Any]
"""One line of a table: headings with their values."""
Table = Callable[..., Iterable[Row]]
"""The first line of its docstring is the title."""
WIDE, NARROW = 16, 8
"""Characters of the first column, which names the body, and of the others, at least."""


def show(title: str, rows: Iterable[Row]) -> None:
    """Print a table row by row, under the headings of its first row."""
    print(f"\n{title}", flush=True)
    widths: list[int] = []
    for row in rows:
        if not widths:
            least = [WIDE, *[NARROW] * (len(row) - 1)]
            widths = [max(n, len(name), len(_text(row[name]))) for n, name in zip(least, row, strict=True)]
            print(_line(row, widths))
        print(_line(map(_text, row.values()), widths), flush=True)


def _line(cells: Iterable[str], widths: Sequence[int]) -> str:
    first, *others = cells
    # what only later rows have stands at their ends
    wide = [*widths[1:], *[NARROW] * len(others)]
    return "  ".join([f"{first:{widths[0]}}", *(f"{cell:>{wide[k]}}" for k, cell in enumerate(others))]).rstrip()


def _text(value: Any) -> str:
    if not isinstance(value, float):
        return str(value)
    if math.isnan(value):
        return "-"
    return f"{value:.1e}" if value != 0 and not 1e-3 <= abs(value) < 1e4 else f"{value:.3g}"


def main(
    tables: Sequence[Table],
    quick: Mapping[str, Mapping[str, Any]] | None = None,
    *,
    places: int = 0,
    arguments: Sequence[str] | None = None,
) -> None:
    """Print the tables that the command line asks for.

    Parameters
    ----------
    tables : sequence of functions
        Each takes its options as keywords and gives rows.
    quick : dict, optional
        By the name of a table: its options with ``--quick``.
    places : int
        How many folders or files the tables take, as their first arguments.
    arguments : sequence of str, optional
        Instead of those of the process.
    """
    names = [table.__name__ for table in tables]
    parser = argparse.ArgumentParser(
        description=tables[0].__globals__["__doc__"],
        formatter_class=argparse.RawDescriptionHelpFormatter,
        prog=sys.argv[0],
    )
    if places:
        parser.add_argument("places", nargs=places, type=Path, metavar="FOLDER", help="where the files are")
    parser.add_argument("--quick", action="store_true", help="less of everything")
    parser.add_argument("--tables", nargs="+", choices=names, default=names, help="tables wanted, all if none is named")
    given = parser.parse_args(arguments)
    for table in tables:
        if table.__name__ in given.tables:
            options = (quick or {}).get(table.__name__, {}) if given.quick else {}
            title = (table.__doc__ or "").splitlines()[0]
            show(title, table(*getattr(given, "places", ()), **options))
