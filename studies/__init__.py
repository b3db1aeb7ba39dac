"""Questions to the method: figures of the paper, accuracy, cost.

``FIGURES`` names the figures for the command line; each is a function ``draw(path, quick)``, which writes the picture
and returns its card: parameters, measured errors and a headline. Modules are imported when first asked for. All other
studies print tables of rows as they come, by a command line of their tables.
"""

import argparse
import inspect
import json
import math
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from creeping._version import __version__

FIGURES = {
    "fig2-grid": "curves.six_charts",
    "fig3-circles": "curves.circles",
    "fig4-torus": "curves.torus",
    "fig5-weighted": "curves.weighted",
    "fig6-creeping": "fans.creeping",
    "fig6-torus": "fans.torus",
    "source-rays": "fans.sources",
    "field-cut": "fields.cut",
    "field-body": "fields.body",
    "field-decay": "fields.decay",
    "field-benchmarks": "benchmarks.published",
    "mesh-quality": "fields.mesh_quality",
    "sweep-cross-section": "sweeps.cross_section",
    "sweep-sphere-rcs": "sweeps.sphere_rcs",
    "sweep-bistatic": "sweeps.bistatic",
}
"""Name on the command line: module of `studies.figures` and function."""
Row = dict[str, Any]
"""One line of a table: headings with their values."""
Table = Callable[..., Iterable[Row]]
"""The first line of its docstring is the title."""
WIDE, NARROW = 16, 8
"""Characters of the first column, which names the body, and of the others, at least."""


def drawer(name: str) -> Callable[[Path, bool], dict[str, Any]]:
    """Function that draws a figure.

    Raises
    ------
    InvalidInputError
        If there is no such figure.
    """
    from creeping.errors import InvalidInputError, near_names

    known = f"figures are {', '.join(FIGURES)}"
    if name not in FIGURES:
        raise InvalidInputError(f"unknown figure {name!r}{near_names(name, FIGURES) or f'; {known}'}")
    module, function = FIGURES[name].split(".")
    found: Callable[[Path, bool], dict[str, Any]] = getattr(import_module(f"studies.figures.{module}"), function)
    return found


def titles() -> dict[str, str]:
    """First line of each figure's docstring, by name."""
    return {name: title(drawer(name)) for name in FIGURES}


def title(thing: object) -> str:
    """First line of a docstring."""
    return (inspect.getdoc(thing) or "").splitlines()[0]


def draw(name: str, folder: str | Path, *, quick: bool = False) -> dict[str, Any]:
    """Draw one figure as ``<name>.png`` with a sidecar ``<name>.json``.

    Parameters
    ----------
    name : str
        A key of ``FIGURES``.
    folder : path
        Made if it does not exist.
    quick : bool
        Coarser and faster.

    Returns
    -------
    dict
        The sidecar: name, title, file, headline, parameters, error, seconds, version, quick.

    Raises
    ------
    InvalidInputError
        If there is no such figure or the folder cannot be made.
    CreepingError
        If a file cannot be written.
    """
    from creeping import InvalidInputError
    from creeping.files import write_text
    from creeping.storage.atomic import written_aside

    folder, function = Path(folder), drawer(name)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidInputError(f"cannot make the folder {folder}: {error}; choose another") from error
    target = folder / f"{name}.png"
    started = time.perf_counter()
    with written_aside(target) as aside:
        found = function(aside, quick)
    card = {
        "name": name,
        "title": title(function),
        "file": target.name,
        **{key: found[key] for key in ("headline", "parameters", "error")},
        "seconds": round(time.perf_counter() - started, 2),
        "version": __version__,
        "quick": quick,
    }
    write_text(target.with_suffix(".json"), json.dumps(card, indent=1, allow_nan=False) + "\n")
    return card


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
            show(title(table), table(*getattr(given, "places", ()), **options))
