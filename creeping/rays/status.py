"""What became of a ray: codes, and which of them say that its wave was launched, or that it ended before the fan."""

from enum import IntEnum

from creeping.shadow.status import ATTACHED, CONCAVE, OCCLUDED


class RayStatus(IntEnum):
    """Status of a ray: whether it was launched, and where it ended.

    Examples
    --------
    >>> import creeping as cr
    >>> cr.RayStatus.OK.name, int(cr.RayStatus.OK)
    ('OK', 0)
    """

    OK = 0
    DETACHED = 1
    """kappa_n fell to 0 at ``RayFan.detachment``; the field ends there."""
    OCCLUDED = 2
    """Launched on request from a point that the incident wave does not reach."""
    CONCAVE = 3
    """Launched on request from a point where kappa_n(d) <= 0: no creeping ray."""
    STALLED = 4
    """The speed vanishes at the launch point, so the ray does not move and J is not defined (NaN)."""
    NON_SMOOTH = 5
    """Reached, at ``RayFan.detachment``, a region that the body declares non-smooth, or a point at which the geodesic
    cannot be continued; the field ends there."""
    EDGE = 6
    """Reached an edge of the body at ``RayFan.detachment``; its contribution beyond is left out."""
    TIP = 7
    """Reached a tip of the body at ``RayFan.detachment``; its contribution beyond is left out."""


LINE_STATUS = {ATTACHED: RayStatus.OK, OCCLUDED: RayStatus.OCCLUDED, CONCAVE: RayStatus.CONCAVE}
"""Status of a ray that starts well, by the state of the line at its launch point."""
AT_CREASES = (RayStatus.EDGE, RayStatus.TIP)
"""Statuses of rays that end at a crease,"""
ENDED = (RayStatus.DETACHED, RayStatus.NON_SMOOTH, *AT_CREASES)
"""of rays whose field ends at ``RayFan.detachment``,"""
LAUNCHED = (RayStatus.OK, *ENDED)
"""and of those that the wave launched."""
