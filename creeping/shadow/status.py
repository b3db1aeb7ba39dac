"""States of a point of the shadow line, and of the line of an incidence; codes and names, once.

A point is attached (it launches a creeping ray), occluded (the incident ray is stopped before) or concave
(kappa_n(d) <= 0: the incident ray touches from inside).
"""

ATTACHED, OCCLUDED, CONCAVE = range(3)
STATUSES = ("attached", "occluded", "concave")
"""Names of the codes of points."""

OK, NEAR_SINGULAR, FOLLOWED, SINGULAR, FAILED = range(5)
INCIDENCE_STATUSES = {
    OK: "ok",
    NEAR_SINGULAR: "near singular: the number of curves is not certain",
    FOLLOWED: "followed one by one: the meshes did not resolve the line",
    SINGULAR: "singular: the line crosses itself, and there are no rays",
    FAILED: "failed: an error, nothing is given",
}
"""Meanings of the codes of incidences."""

NO_RAY = -1
"""Status of a place for a ray that the incidence did not fill."""
