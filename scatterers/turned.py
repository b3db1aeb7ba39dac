"""Bodies turned about an axis: cylinder, cone, cone with a sphere, capsule, ogives and the almond.

A cylinder is |z| < l/2, x^2 + y^2 < a^2, with an edge of 90 degrees at either end; a cone, pointed or truncated,
r < a + (b - a) z/l for 0 < z < l, r the distance from the axis.

A cone joins a sphere of radius a about the origin smoothly by its tangents from (0, 0, l - a): with the half angle of
the cone, sin alpha = a/(l - a), they touch at z = a sin alpha, r = a cos alpha: a joint, where the curvature along the
profile jumps from 1/a to 0. The cone-sphere of the EMCC has a = 2.947 in and alpha = 7 degrees. On a capsule, all
points within a distance a of the axis from -(l/2 - a) to l/2 - a, it jumps from 0 to 1/a where the hemispheres begin.

Ogives are arcs that meet the axis in tips.

An arc from radius a at z = 0 to the tip at z = l, along z there at z = 0, has the profile [WWSS93]

    r = a (sqrt(1 - (z/l)^2 sin^2 alpha) - cos alpha)/(1 - cos alpha),

part of an ellipse about (0, -a cos alpha/(1 - cos alpha)), and of a circle of radius (l^2 + a^2)/2 a where

    tan(alpha/2) = a/l;

alpha is then the half angle at the tip. The ogive of the EMCC has a = 1 in, l = 5 in (alpha = 22.62 degrees); its
double ogive has l = 2.5 in below with alpha = 46.4 degrees, an arc of an ellipse (43.6 degrees would make a circle),
and l = 5 in above.

Also here: the NASA almond: half an ellipsoid, and half an ogive with elliptic cross-sections that ends in a tip.

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
from itertools import pairwise
from typing import Any

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
        super().__post_init__()
        if self.length <= self._least * self.radius:
            raise ValueError(
                f"length = {self.length!r} is not more than twice the radius {self.radius!r}; it is that of the whole"
            )


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

    _free = ("top",)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.top < 0:
            raise ValueError(f"top = {self.top!r} is negative; give 0 for a tip, or a radius")

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


Pair = tuple[float, float]


@dataclass(frozen=True)
class Ogive(Lengthy):
    """Circular arc rotated about its chord, the z axis; it has two tips and is centred on the origin.

    Parameters
    ----------
    radius : float
        The largest, at z = 0, L.
    length : float
        From tip to tip, L; more than twice the radius.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.

    Raises
    ------
    ValueError
        If a length is not a positive finite number, the ogive is too short, or the speed is not usable.

    Examples
    --------
    >>> import scatterers as sc
    >>> target = sc.Ogive(radius=0.0254, length=0.254)                     # of the EMCC, m
    >>> [crease.kind for crease in target.creases], round(target.half_angle, 6)
    (['tip', 'tip'], 0.394791)
    """

    _least = 2.0

    @property
    def half_angle(self) -> float:
        """Angle alpha between the axis and the profile at a tip, radians."""
        return 2 * math.atan2(self.radius, 0.5 * self.length)

    @cached_property
    def _profile(self) -> Sequence[Segment]:
        half = 0.5 * self.length
        centre, axes = _ellipse(self.radius, half, None)
        return [Arc((-half, 0.0), (half, 0.0), centre, axes)]


@dataclass(frozen=True)
class DoubleOgive(Revolved):
    """Halves of two ogives that meet at their largest radius, in the plane z = 0: two tips and a joint.

    The tangent is along z on both sides of the joint; the curvature jumps there.

    Parameters
    ----------
    radius : float
        The largest, at z = 0, L.
    lower, upper : float
        Lengths below and above z = 0, L; more than the radius.
    lower_angle, upper_angle : float, optional
        Angles alpha of the EMCC profile r = radius (sqrt(1 - (z sin(alpha)/length)^2) - cos(alpha))/(1 - cos(alpha)),
        radians, below pi/2; by default the profile is a circular arc.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.

    Raises
    ------
    ValueError
        If a length is not a positive finite number, a half is too short, an angle is not between 0 and pi/2, or the
        speed is not usable.

    Examples
    --------
    >>> import numpy as np
    >>> import scatterers as sc
    >>> inch = 0.0254
    >>> target = sc.DoubleOgive(inch, 2.5 * inch, 5 * inch, lower_angle=np.radians(46.4))  # of the EMCC, m
    >>> [crease.kind for crease in target.creases]
    ['tip', 'tip', 'joint']
    """

    radius: float
    lower: float
    upper: float
    lower_angle: float | None = None
    upper_angle: float | None = None
    speed: Any = None

    _free = ("lower_angle", "upper_angle")

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("lower", "upper"):
            length, angle = getattr(self, name), getattr(self, f"{name}_angle")
            if length <= self.radius:
                raise ValueError(f"{name} = {length!r} is not more than the radius {self.radius!r}")
            if angle is not None and not 0 < angle < math.pi / 2:
                raise ValueError(f"{name}_angle = {angle!r} is not between 0 and pi/2; angles are radians")

    def _shape_texts(self) -> list[str]:
        values = [self.radius, self.lower, self.upper, self.lower_angle, self.upper_angle]
        return [str(value if value is None else float(value).hex()) for value in values]

    @cached_property
    def _profile(self) -> Sequence[Segment]:
        below, above = (
            _ellipse(self.radius, length, angle)
            for length, angle in ((self.lower, self.lower_angle), (self.upper, self.upper_angle))
        )
        widest = 0.0, self.radius
        return [Arc((-self.lower, 0.0), widest, *below), Arc(widest, (self.upper, 0.0), *above)]


def _ellipse(radius: float, length: float, angle: float | None) -> tuple[Pair, Pair]:
    """Centre and semi-axes (z, radius), L, of the arc."""
    if angle is None:
        # a little more exact than by the angle of the circle
        circle = 0.5 * (length * (length / radius) + radius)
        return (0.0, radius - circle), (circle, circle)
    # 1 - cos alpha without cancellation
    across = radius / (2 * math.sin(0.5 * angle) ** 2)
    return (0.0, radius - across), (length / math.sin(angle), across)


@dataclass(frozen=True)
class Almond(Revolved):
    """The NASA almond along the x axis, its tip towards +x; widest in the plane x = 0, along y.

    The body has two pieces; piece 0, at x < 0, is half an ellipsoid. They meet in a joint, across which the curvature
    is continuous and its second derivative is not.

    Parameters
    ----------
    length : float
        Length, L. The default is the EMCC almond, 9.936 in, in metres.
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

    # u, v, w are y, 3 z and x: it is three times as wide as thick
    _axes = (1, 2, 0)
    _stretch = 3.0

    @cached_property
    def _profile(self) -> Sequence[Segment]:
        a, b = 29 / 150 * self.length, 5 / 12 * self.length
        tip = math.fsum([self.length, -b])
        widest = 0.0, a
        return [
            Arc((-b, 0.0), widest, (0.0, 0.0), (b, a)),
            Arc(widest, (tip, 0.0), (0.0, -24 * a), (5 * b, 25 * a)),
        ]
