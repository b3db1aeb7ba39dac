"""Cylinder with hemispherical ends: all points within a distance a of the axis from -(l/2 - a) to l/2 - a.

The curvature along z jumps from 0 to 1/a where the hemispheres begin: two joints.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from scatterers.base.body import positive
from scatterers.exact.profile import Arc, Line, Segment
from scatterers.exact.revolved import Revolved


@dataclass(frozen=True)
class Capsule(Revolved):
    """Cylinder about the z axis with hemispheres at its ends; its middle is the origin.

    Parameters
    ----------
    radius : float
        L.
    length : float
        Of the whole, hemispheres included, L; more than twice the radius.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.

    Raises
    ------
    ValueError
        If a length is not a positive finite number, the whole is too short, or the speed is not usable.

    Examples
    --------
    >>> import scatterers as sc
    >>> pill = sc.Capsule(radius=1.0, length=6.0)
    >>> pill.creases[0], len(pill.creases)
    (Crease(joint between pieces 0 and 1, length 6.28 L, closed), 2)
    >>> len(pill.atlas.charts)
    6
    """

    radius: float
    length: float
    speed: Any = None

    def __post_init__(self) -> None:
        positive(radius=self.radius, length=self.length)
        if self.length <= 2 * self.radius:
            raise ValueError(
                f"length = {self.length!r} is not more than twice the radius {self.radius!r}; it is that of the whole"
            )
        self._set_speed()

    @cached_property
    def _profile(self) -> Sequence[Segment]:
        a, top = self.radius, 0.5 * self.length
        flat = top - a
        return [
            Arc((-top, 0.0), (-flat, a), (-flat, 0.0), (a, a)),
            Line((-flat, a), (flat, a)),
            Arc((flat, a), (top, 0.0), (flat, 0.0), (a, a)),
        ]
