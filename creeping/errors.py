"""Errors of whole calls; trouble of one ray is data (``RayFan.status``), not an exception.

A message names what, how many, the worst and the remedy; the numbers are attributes as well.
"""

from collections.abc import Iterable
from typing import Any


class CreepingError(ValueError):
    """Base class of all errors that creeping raises on purpose.

    Parameters
    ----------
    message : str
        What is wrong, in how many cases, the worst case, and the remedy.
    **numbers
        The numbers in the message, which become attributes of the error.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> try:
    ...     cr.shadow_line(sc.Sphere(), direction=(0, 0, 0))
    ... except cr.CreepingError as error:
    ...     print(error)
    direction is the zero vector; give where the wave travels, e.g. (1, 1, 1)
    """

    def __init__(self, message: str, **numbers: Any) -> None:
        super().__init__(message)
        for name, value in numbers.items():
            setattr(self, name, value)


class InvalidInputError(CreepingError):
    """An argument has the wrong shape, unit, range or is not finite."""


class SurfaceError(CreepingError):
    """The body is not a closed smooth surface, or its level function and its charts disagree."""


class SingularIncidenceError(CreepingError):
    """The shadow line crosses itself and is therefore not a set of smooth curves."""


class IntegrationError(CreepingError):
    """A direct integration failed to reach its end time."""


class ToleranceError(CreepingError):
    """No phase map within the limits reaches the requested tolerance."""


class StoredMapError(CreepingError):
    """A stored phase map is damaged, was written by another version, or belongs to another body."""


def near_names(name: str, known: Iterable[str]) -> str:
    """The end of a message about an unknown name: those that begin like it, or are spelled almost so, if any.

    Examples
    --------
    >>> near_names("backscater", ["backscatter", "bistatic"]), near_names("fig6", ["fig6-a", "fig6-b"])
    ('; did you mean backscatter?', '; did you mean fig6-a or fig6-b?')
    """
    from difflib import get_close_matches

    names = {one.lower().replace("_", ""): one for one in known}
    asked = name.lower().replace("_", "")
    close = [one for short, one in names.items() if asked and short.startswith(asked)]
    close = close or [names[short] for short in get_close_matches(asked, names)]
    return f"; did you mean {' or '.join(close)}?" if close else ""
