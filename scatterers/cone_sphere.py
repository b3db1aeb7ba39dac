"""Cone that joins a sphere smoothly: the sphere of radius a about the origin and its tangents from (0, 0, l - a).

With the half angle of the cone, sin alpha = a/(l - a), they touch at z = a sin alpha, r = a cos alpha: a joint, where
the curvature along the profile jumps from 1/a to 0. The cone-sphere of the EMCC has a = 2.947 in and alpha = 7 degrees.

Sources: [WWSS93].
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from scatterers.base.body import positive
from scatterers.exact.profile import Arc, Line, Segment
from scatterers.exact.revolved import Revolved


@dataclass(frozen=True)
class ConeSphere(Revolved):
    """Cone about the z axis on a sphere, whose middle is the origin; the tip is above.

    Parameters
    ----------
    radius : float
        Of the sphere, L.
    length : float
        Of the whole, L; more than twice the radius. For a half angle alpha at the tip it is radius (1 + 1/sin alpha).
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.

    Raises
    ------
    ValueError
        If a length is not a positive finite number, the whole is too short, or the speed is not usable.

    Examples
    --------
    >>> import numpy as np
    >>> import scatterers as sc
    >>> target = sc.ConeSphere(radius=0.0749, length=0.0749 * (1 + 1 / np.sin(np.radians(7))))      # of the EMCC, m
    >>> [crease.kind for crease in target.creases]
    ['tip', 'joint']
    >>> round(target.half_angle, 6)
    0.122173
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

    @property
    def half_angle(self) -> float:
        """Angle alpha between the axis and the cone, radians."""
        return math.asin(self.radius / (self.length - self.radius))

    @cached_property
    def _profile(self) -> Sequence[Segment]:
        a, apex = self.radius, self.length - self.radius
        sine = a / apex
        joint = a * sine, a * math.sqrt((1 - sine) * (1 + sine))
        return [Arc((-a, 0.0), joint, (0.0, 0.0), (a, a)), Line(joint, (apex, 0.0))]
