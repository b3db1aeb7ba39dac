"""Questions to the method: figures of the paper, accuracy, cost.

``FIGURES`` names the figures for the command line; each is a function ``draw(path, quick)``, which writes the picture
and returns its card: parameters, measured errors and a headline. Modules are imported when first asked for.
"""

import inspect
import json
import time
from collections.abc import Callable
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


def drawer(name: str) -> Callable[[Path, bool], dict[str, Any]]:
    """Function that draws a figure."""
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

    if name not in FIGURES:
        raise InvalidInputError(f"unknown figure {name!r}; figures are {', '.join(FIGURES)}")
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidInputError(f"cannot make the folder {folder}: {error}; choose another") from error
    function = drawer(name)
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
