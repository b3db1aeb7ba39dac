"""The NASA almond: half an ellipsoid, and half an ogive with elliptic cross-sections that ends in a tip.

With the length d, t = x/d, the points are (d t, y(t) cos psi, y(t) sin psi/3), -pi < psi < pi,

    y = a d sqrt(1 - (t/b)^2),                         -b < t < 0,
    y = 25 a d (sqrt(1 - (t/5 b)^2) - 0.96),           0 < t < 7 b/5,   a = 29/150, b = 5/12.

[WWSS93] prints these with a = 0.193333, a/3 = 0.064444, b = 0.416667, 25 a = 4.83345, 25 a/3 = 1.61115, 5 b = 2.08335
and the tip at t = 0.58333. As printed the halves miss each other by 5e-6 d at t = 0; with the fractions, of which all
but 4.83345, 1.61115 and 2.08335 are roundings, they meet, with one tangent and one curvature. What jumps at t = 0 is
the second derivative of the curvature along x.

Sources: [WWSS93].
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from scatterers.base.body import positive
from scatterers.exact.profile import Arc, Segment
from scatterers.exact.revolved import Revolved

WIDE, BACK = 29 / 150, 5 / 12
FLAT = 3.0
"""Width over thickness."""


@dataclass(frozen=True)
class Almond(Revolved):
    """The NASA almond along the x axis, its tip towards +x; widest in the plane x = 0, along y.

    Two pieces: 0 is half an ellipsoid, x < 0. They meet in a joint; the curvature is continuous there, its second
    derivative is not.

    Parameters
    ----------
    length : float
        L; that of the EMCC's is 9.936 in, the default in metres.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.

    Raises
    ------
    ValueError
        If the length is not a positive finite number, or the speed is not usable.

    Examples
    --------
    >>> import scatterers as sc
    >>> almond = sc.Almond()
    >>> almond.creases
    [Crease(tip of piece 1 at (0.147218, 0.0, 0.0)), Crease(joint between pieces 0 and 1, length 0.217 L, closed)]
    >>> (almond.bounds[1] - almond.bounds[0]).round(6)
    array([0.252374, 0.097585, 0.032528])
    """

    length: float = 9.936 * 0.0254
    speed: Any = None

    # u, v, w are y, 3 z and x
    _axes = (1, 2, 0)
    _stretch = FLAT

    def __post_init__(self) -> None:
        positive(length=self.length)
        self._set_speed()

    @cached_property
    def _profile(self) -> Sequence[Segment]:
        a, b = WIDE * self.length, BACK * self.length
        tip = math.fsum([self.length, -b])
        widest = 0.0, a
        return [
            Arc((-b, 0.0), widest, (0.0, 0.0), (b, a)),
            Arc(widest, (tip, 0.0), (0.0, -24 * a), (5 * b, 25 * a)),
        ]
