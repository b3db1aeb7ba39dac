"""Cone, pointed or truncated, on a flat base: r < a + (b - a) z/l for 0 < z < l, r the distance from the axis."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

from scatterers.base.body import finite, positive
from scatterers.exact.profile import Line, Segment
from scatterers.exact.revolved import Revolved


@dataclass(frozen=True)
class Cone(Revolved):
    """Circular cone about the z axis; the middle of its base is the origin.

    Parameters
    ----------
    radius : float
        Of the base at z = 0, L.
    length : float
        Along z, L.
    top : float
        Radius at z = length, L; a tip if 0, a flat end if more.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.

    Raises
    ------
    ValueError
        If a length is not a positive finite number, or ``top`` is negative, or the speed is not usable.

    Examples
    --------
    >>> import scatterers as sc
    >>> [crease.kind for crease in sc.Cone(1.0, 2.0).creases], len(sc.Cone(1.0, 2.0, top=0.5).pieces)
    (['tip', 'edge'], 3)
    """

    radius: float
    length: float
    top: float = 0.0
    speed: Any = None

    def __post_init__(self) -> None:
        positive(radius=self.radius, length=self.length)
        finite(top=self.top)
        if self.top < 0:
            raise ValueError(f"top = {self.top!r} is negative; give 0 for a tip, or a radius")
        self._set_speed()

    @cached_property
    def _profile(self) -> Sequence[Segment]:
        corners = [(0.0, 0.0), (0.0, float(self.radius)), (float(self.length), float(self.top))]
        if self.top > 0:
            corners.append((float(self.length), 0.0))
        return [Line(start, end) for start, end in pairwise(corners)]
