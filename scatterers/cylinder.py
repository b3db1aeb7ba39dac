"""Cylinder with flat ends: |z| < l/2, x^2 + y^2 < a^2, with an edge of 90 degrees at either end."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

from scatterers.base.body import positive
from scatterers.exact.profile import Line, Segment
from scatterers.exact.revolved import Revolved


@dataclass(frozen=True)
class Cylinder(Revolved):
    """Circular cylinder about the z axis, closed by planes; its middle is the origin.

    Parameters
    ----------
    radius : float
        L.
    length : float
        Along z, L.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.

    Raises
    ------
    ValueError
        If a length is not a positive finite number, or the speed is not usable.

    Examples
    --------
    >>> import scatterers as sc
    >>> can = sc.Cylinder(radius=1.0, length=3.0)
    >>> can.creases[0]
    Crease(edge between pieces 0 and 1, 90 degrees, length 6.28 L, closed)
    >>> can.piece([[0.0, 0.2, 1.5], [0.6, 0.8, 0.0]])
    array([2, 1])
    """

    radius: float
    length: float
    speed: Any = None

    def __post_init__(self) -> None:
        positive(radius=self.radius, length=self.length)
        self._set_speed()

    @cached_property
    def _profile(self) -> Sequence[Segment]:
        a, half = self.radius, 0.5 * self.length
        corners = (-half, 0.0), (-half, a), (half, a), (half, 0.0)
        return [Line(start, end) for start, end in pairwise(corners)]
