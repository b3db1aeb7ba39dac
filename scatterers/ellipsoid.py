"""Ellipsoid of any three semi-axes: F = x^2/a^2 + y^2/b^2 + z^2/c^2 - 1, x = psi(s) = (a s_1, b s_2, c s_3)."""

from dataclasses import dataclass
from typing import Any

from scatterers.base.quadrics import BentEllipsoid, positive


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
