"""Questions to the method, one a file: figures of the paper, accuracy, cost.

``FIGURES`` names the figures for the command line; each module has ``draw(path, quick)``, which writes the picture and
returns its card: parameters, measured errors and a headline. Modules are imported when first asked for.
"""

import json
import time
from importlib import import_module
from pathlib import Path
from typing import Any

from creeping._version import __version__

FIGURES = {
    "fig2-grid": "figure2_grid",
    "fig3-circles": "figure3_circles",
    "fig4-torus": "figure4_torus",
    "fig5-weighted": "figure5_weighted",
    "fig6-creeping": "figure6_creeping",
    "fig6-torus": "figure6_torus",
    "source-rays": "figure_source_rays",
    "field-cut": "figure_field_cut",
    "field-body": "figure_field_body",
    "field-decay": "figure_field_decay",
    "field-benchmarks": "figure_benchmarks",
    "mesh-quality": "figure_mesh_quality",
    "sweep-cross-section": "figure_cross_section",
    "sweep-sphere-rcs": "figure_sphere_rcs",
    "sweep-bistatic": "figure_bistatic_map",
}
"""Name on the command line: module of this package."""


def titles() -> dict[str, str]:
    """First line of each figure's docstring, by name."""
    return {name: _title(import_module(f"studies.{module}")) for name, module in FIGURES.items()}


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
    module = import_module(f"studies.{FIGURES[name]}")
    target = folder / f"{name}.png"
    started = time.perf_counter()
    with written_aside(target) as aside:
        found = module.draw(aside, quick)
    card = {
        "name": name,
        "title": _title(module),
        "file": target.name,
        "headline": found["headline"],
        "parameters": found["parameters"],
        "error": found["error"],
        "seconds": round(time.perf_counter() - started, 2),
        "version": __version__,
        "quick": quick,
    }
    write_text(target.with_suffix(".json"), json.dumps(card, indent=1, allow_nan=False) + "\n")
    return card


def _title(module: Any) -> str:
    return str(module.__doc__).splitlines()[0]
