"""Cylinder with flat ends: |z| < l/2, x^2 + y^2 < a^2, with an edge of 90 degrees at either end.

Also here: cone, pointed or truncated, on a flat base: r < a + (b - a) z/l for 0 < z < l, r the distance from the axis.

Also here: cone that joins a sphere smoothly: the sphere of radius a about the origin and its tangents from (0, 0, l -
a).

With the half angle of the cone, sin alpha = a/(l - a), they touch at z = a sin alpha, r = a cos alpha: a joint, where
the curvature along the profile jumps from 1/a to 0. The cone-sphere of the EMCC has a = 2.947 in and alpha = 7 degrees.

Also here: cylinder with hemispherical ends: all points within a distance a of the axis from -(l/2 - a) to l/2 - a.

The curvature along z jumps from 0 to 1/a where the hemispheres begin: two joints.

Sources: [WWSS93].
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

from scatterers.body import finite, positive
from scatterers.exact.profile import Arc, Line, Segment
from scatterers.exact.revolved import Revolved


@dataclass(frozen=True)
class Lengthy(Revolved):
    """Base of bodies with a radius and a length; ``_least`` is that of their ratio."""

    radius: float
    length: float
    speed: Any = None

    _least = 0.0

    def __post_init__(self) -> None:
        positive(radius=self.radius, length=self.length)
        if self.length <= self._least * self.radius:
            raise ValueError(
                f"length = {self.length!r} is not more than twice the radius {self.radius!r}; it is that of the whole"
            )
        self._set_speed()


@dataclass(frozen=True)
class Cylinder(Lengthy):
    """Circular cylinder about the z axis with flat ends, centred on the origin.

    Parameters
    ----------
    radius : float
        Radius, L.
    length : float
        Length along z, L.
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

    @cached_property
    def _profile(self) -> Sequence[Segment]:
        a, half = self.radius, 0.5 * self.length
        corners = (-half, 0.0), (-half, a), (half, a), (half, 0.0)
        return [Line(start, end) for start, end in pairwise(corners)]


@dataclass(frozen=True)
class Cone(Revolved):
    """Circular cone about the z axis; the centre of the base is the origin.

    Parameters
    ----------
    radius : float
        Radius of the base at z = 0, L.
    length : float
        Length along z, L.
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


@dataclass(frozen=True)
class ConeSphere(Lengthy):
    """Sphere about the origin with a cone tangent to it; the axis is z and the tip points towards +z.

    Parameters
    ----------
    radius : float
        Radius of the sphere, L.
    length : float
        Total length, L; more than twice the radius. A cone of half angle alpha has length radius (1 + 1/sin alpha).
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.

    Raises
    ------
    ValueError
        If a length is not a positive finite number, the body is too short, or the speed is not usable.

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

    _least = 2.0

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


@dataclass(frozen=True)
class Capsule(Lengthy):
    """Cylinder about the z axis with hemispherical ends, centred on the origin.

    Parameters
    ----------
    radius : float
        Radius, L.
    length : float
        Total length including the hemispheres, L; more than twice the radius.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.

    Raises
    ------
    ValueError
        If a length is not a positive finite number, the body is too short, or the speed is not usable.

    Examples
    --------
    >>> import scatterers as sc
    >>> pill = sc.Capsule(radius=1.0, length=6.0)
    >>> pill.creases[0], len(pill.creases)
    (Crease(joint between pieces 0 and 1, length 6.28 L, closed), 2)
    >>> len(pill.atlas.charts)
    6
    """

    _least = 2.0

    @cached_property
    def _profile(self) -> Sequence[Segment]:
        a, top = self.radius, 0.5 * self.length
        flat = top - a
        return [
            Arc((-top, 0.0), (-flat, a), (-flat, 0.0), (a, a)),
            Line((-flat, a), (flat, a)),
            Arc((flat, a), (top, 0.0), (flat, 0.0), (a, a)),
        ]
