"""How bodies show themselves in notebooks: a short table of what they are and how large."""

import sys
from collections.abc import Callable
from html import escape
from typing import Any

LONGEST = 120
"""Characters of a body's text in its table."""


class Shown:
    """A body with a table for notebooks; it has ``bounds``, and ``unit`` if that is known."""

    # no state: bodies stay frozen and pickle as before
    __slots__ = ()

    def _repr_html_(self) -> str:
        body: Any = self
        text, unit = " ".join(repr(body).split()), getattr(body, "unit", "L")
        rows = {
            "body": text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}...",
            "box": f"{' x '.join(f'{side:.4g}' for side in body.bounds[1] - body.bounds[0])} {unit}",
            "lengths": "metres" if unit == "m" else f"{unit}, any unit; wavenumbers are in its inverse",
        }
        if getattr(body, "creases", ()):
            rows["surface"] = f"in smooth pieces, {len(body.creases)} edges, joints or tips"
        if getattr(body, "without_rays", ""):
            rows["rays"] = f"none: {body.without_rays}"
        cells = "".join(f"<tr><th>{name}</th><td>{escape(value)}</td></tr>" for name, value in rows.items())
        return f"<table><caption>{type(body).__name__}</caption><tbody>{cells}</tbody></table>"


def teller(progress: Any) -> Callable[[str], None]:
    """What is called with each line of progress: a function that was given, for True one that shows it.

    Raises
    ------
    TypeError
        If it is neither.
    """
    if progress is True:
        return _show
    if progress is not None and progress is not False and not callable(progress):
        raise TypeError(f"progress = {progress!r} cannot be called; give True or a function of one text")
    return progress or _ignore


def _show(text: str) -> None:
    print(f"scatterers: {text}", file=sys.stderr)


def _ignore(text: str) -> None:
    pass
