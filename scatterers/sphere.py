"""Sphere about the origin: F = |x|^2/radius^2 - 1, x = psi(s) = radius s."""

from dataclasses import dataclass
from typing import Any

from scatterers.base.quadrics import BentEllipsoid, positive


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
