"""Errors of whole calls; trouble of one ray is data (``RayFan.status``), not an exception.

A message names what, how many, the worst and the remedy; the numbers are attributes as well.
"""

from typing import Any


class CreepingError(ValueError):
    """Base of every error that creeping raises on purpose.

    Parameters
    ----------
    message : str
        What, how many, the worst, the remedy.
    **numbers
        The figures of the message, kept as attributes.

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
    """The body is not a closed smooth surface, or its parts contradict each other."""


class SingularIncidenceError(CreepingError):
    """The shadow line crosses itself, so it is not a set of smooth curves."""


class IntegrationError(CreepingError):
    """A direct integration failed to reach its end time."""


class ToleranceError(CreepingError):
    """No phase map within the limits reaches the requested tolerance."""


class StoredMapError(CreepingError):
    """A stored phase map is damaged, of another version or of another body."""
