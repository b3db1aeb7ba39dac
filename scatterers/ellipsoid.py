"""Ellipsoid of any three semi-axes: F = x^2/a^2 + y^2/b^2 + z^2/c^2 - 1, x = psi(s) = (a s_1, b s_2, c s_3).

Also here: sphere about the origin: F = |x|^2/radius^2 - 1, x = psi(s) = radius s.

Also here: twisted ellipsoid: F = x^2/a^2 + (y - d cos(pi z))^2/b^2 + z^2/c^2 - 1.

psi(s) = (a s_1, b s_2 + d cos(pi c s_3), c s_3). Not convex: near z = 0, y < 0 the profile has
y'' = -pi^2 d + b/c^2 on the default body, negative, so kappa_n < 0 along z there.
"""

from dataclasses import dataclass
from typing import Any

from scatterers.base.quadrics import BentEllipsoid, finite, positive


@dataclass(frozen=True)
class Ellipsoid(BentEllipsoid):
    """Ellipsoid with semi-axes a, b, c along x, y, z.

    Parameters
    ----------
    a, b, c : float
        Semi-axes, L; positive.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.

    Raises
    ------
    ValueError
        If a semi-axis is not a positive finite number, or the speed is not usable.

    Examples
    --------
    >>> import scatterers as sc
    >>> body = sc.Ellipsoid(2.0, 1.0, 0.5)
    >>> body.bounds
    array([[-2. , -1. , -0.5],
           [ 2. ,  1. ,  0.5]])
    >>> body.gradient([2.0, 0.0, 0.0])
    array([1., 0., 0.])
    """

    a: float
    b: float
    c: float
    speed: Any = None

    def __post_init__(self) -> None:
        positive(a=self.a, b=self.b, c=self.c)
        self._set_speed()

    def _shape(self) -> tuple[float, float, float, float]:
        return self.a, self.b, self.c, 0.0


@dataclass(frozen=True)
class Sphere(BentEllipsoid):
    """Sphere about the origin.

    Parameters
    ----------
    radius : float
        L; positive.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow; ``"1 + x"`` is an example of [YC06b]. On the unit sphere it
        vanishes at (-1, 0, 0), which no ray reaches in finite time: ds/c is there the flat metric of a plane.

    Raises
    ------
    ValueError
        If the radius is not a positive finite number, or the speed is not usable.

    Examples
    --------
    >>> import scatterers as sc
    >>> ball = sc.Sphere(radius=2.0)
    >>> ball.level([[4.0, 0.0, 0.0], [0.0, 0.0, 1.0]])          # outside, inside
    array([ 3.  , -0.75])
    >>> ball.parameters([0.0, 2.0, 0.0]).round(6)               # theta, phi
    array([1.570796, 1.570796])
    """

    radius: float = 1.0
    speed: Any = None

    def __post_init__(self) -> None:
        positive(radius=self.radius)
        self._set_speed()

    def _shape(self) -> tuple[float, float, float, float]:
        return self.radius, self.radius, self.radius, 0.0


@dataclass(frozen=True)
class TwistedEllipsoid(BentEllipsoid):
    """Ellipsoid whose y is shifted by d cos(pi z); the body of the creeping rays in [YC06b].

    Parameters
    ----------
    a, b, c : float
        Semi-axes along x, y, z, L; positive.
    d : float
        Amplitude of the shift, L.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.

    Raises
    ------
    ValueError
        If a semi-axis is not a positive finite number, d is not finite, or the speed is not usable.

    Examples
    --------
    >>> import scatterers as sc
    >>> body = sc.TwistedEllipsoid()
    >>> body.bounds[1]
    array([0.5, 0.7, 1. ])
    >>> float(body.level([0.0, 0.2, 0.0]))                      # on the spine
    -1.0
    """

    a: float = 0.5
    b: float = 0.5
    c: float = 1.0
    d: float = 0.2
    speed: Any = None

    def __post_init__(self) -> None:
        positive(a=self.a, b=self.b, c=self.c)
        finite(d=self.d)
        self._set_speed()

    def _shape(self) -> tuple[float, float, float, float]:
        return self.a, self.b, self.c, self.d
