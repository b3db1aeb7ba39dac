"""States of a point of the shadow line, and of the line of an incidence; codes and names, once.

A point is attached (it launches a creeping ray), occluded (the incident ray is stopped before) or concave
(kappa_n(d) <= 0: the incident ray touches from inside).
"""

from enum import IntEnum


class PointState(IntEnum):
    """Codes of points."""

    ATTACHED = 0
    OCCLUDED = 1
    CONCAVE = 2


STATUSES = tuple(one.name.lower() for one in PointState)
"""Names of the codes of points."""
NO_RAY = -1
"""Status of a place for a ray that the incidence did not fill."""


class LineStatus(IntEnum):
    """Codes of lines, one for each incidence."""

    OK = 0
    NEAR_SINGULAR = 1
    FOLLOWED = 2
    SINGULAR = 3
    FAILED = 4


INCIDENCE_STATUSES = {
    LineStatus.OK: "ok",
    LineStatus.NEAR_SINGULAR: "near singular: the number of curves is not certain",
    LineStatus.FOLLOWED: "followed one by one: the meshes did not resolve the line",
    LineStatus.SINGULAR: "singular: the line crosses itself, and there are no rays",
    LineStatus.FAILED: "failed: an error, nothing is given",
}
"""Meanings of the codes of incidences."""
