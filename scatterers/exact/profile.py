"""Segments of the profile of a body of revolution: lines and arcs of axis-parallel conics, as (z, radius), L.

A profile runs from the lower to the upper end of the axis, so that n = (-t_r, t_z) points outward of its tangent
t = (t_z, t_r). A line is n.(q - q_0) = 0; an arc about (z_c, r_c) with semi-axes b along z and a along the radius is

    q(t) = (z_c + b sin t, r_c + a cos t),   G = +-sqrt(a b)/2 ((zeta/b)^2 + ((r - r_c)/a)^2 - 1),  zeta = z - z_c,

convex (+) where t grows, and |grad G| = 1 on a circle. Both are A r^2/2 + B r + C zeta^2/2 + D zeta + E.

Sources: [C76, sec. 3-3].
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from scatterers.base.body import finite
from scatterers.kernels.revolved import CONIC

FloatArray = NDArray[np.float64]
Pair = tuple[float, float]
OFF = 1e-9
"""How far from its conic an end may be, in its semi-axes."""


class Segment(Protocol):
    """Smooth part of a profile; u runs from 0 to 1 along it."""

    @property
    def start(self) -> Pair:
        """First point (z, radius), L."""
        ...

    @property
    def end(self) -> Pair:
        """Last point (z, radius), L."""
        ...

    @property
    def turns(self) -> FloatArray:
        """Values of u (n,), from 0 to 1, between which the tangent turns by a right angle at most."""
        ...

    @property
    def extremes(self) -> FloatArray:
        """Values of u (n,) among which are those of the least and largest z and radius."""
        ...

    def point(self, u: FloatArray) -> FloatArray:
        """Points (z, radius), L: (n,) to (n, 2)."""
        ...

    def tangent(self, u: FloatArray) -> FloatArray:
        """Unit tangents: (n,) to (n, 2)."""
        ...

    def shapes(self) -> tuple[float, list[FloatArray]]:
        """Kind, and parameters of all parts between `turns`, or of the one that all share; see `kernels.revolved`."""
        ...

    def reversed(self) -> "Segment":
        """The same from its end to its start."""
        ...


@dataclass(frozen=True)
class Line:
    """Straight segment: a cone, a cylinder, or a plane across the axis.

    Attributes
    ----------
    start, end : (z, radius), L

    Examples
    --------
    >>> Line((0.0, 1.0), (2.0, 1.0)).point(np.array([0.25]))
    array([[0.5, 1. ]])
    """

    start: Pair
    end: Pair

    def __post_init__(self) -> None:
        _checked(self.start, self.end)

    @property
    def turns(self) -> FloatArray:
        """Both ends."""
        return np.array([0.0, 1.0])

    @property
    def extremes(self) -> FloatArray:
        """Both ends."""
        return self.turns

    def point(self, u: FloatArray) -> FloatArray:
        """Points (z, radius), L: (n,) to (n, 2)."""
        u = np.asarray(u, dtype=float)[..., None]
        return np.asarray((1 - u) * np.array(self.start) + u * np.array(self.end))

    def tangent(self, u: FloatArray) -> FloatArray:
        """Unit tangents: (n,) to (n, 2)."""
        along = np.subtract(self.end, self.start)
        return np.broadcast_to(along / math.hypot(*along), (*np.shape(u), 2)).copy()

    def shapes(self) -> tuple[float, list[FloatArray]]:
        """Conic with A = C = 0."""
        tz, tr = self.tangent(np.zeros(1))[0]
        return CONIC, [np.array([0.0, tz, 0.0, -tr, -tz * self.start[1], self.start[0]])]

    def reversed(self) -> "Line":
        """The same from its end to its start."""
        return Line(self.end, self.start)


@dataclass(frozen=True)
class Arc:
    """Arc of a circle, or of an ellipse with axes along z and the radius.

    Attributes
    ----------
    start, end : (z, radius), L
    centre : (z, radius), L
        The radius may be negative.
    semi_axes : (along z, along the radius), L, optional
        Those of the circle through the start if not given.
    convex : bool
        Whether the body bulges out there.

    Raises
    ------
    ValueError
        If an end is not on the conic.

    Examples
    --------
    >>> Arc((-1.0, 0.0), (1.0, 0.0), (0.0, 0.0)).point(np.array([0.5]))
    array([[0., 1.]])
    """

    start: Pair
    end: Pair
    centre: Pair
    semi_axes: Pair | None = None
    convex: bool = True

    def __post_init__(self) -> None:
        _checked(self.start, self.end)
        finite(z=self.centre[0], radius=self.centre[1])
        b, a = self._axes
        if not (b > 0 and a > 0):
            raise ValueError(f"semi-axes {(b, a)} of an arc are not positive")
        for name, (z, r) in (("start", self.start), ("end", self.end)):
            off = abs(math.hypot((z - self.centre[0]) / b, (r - self.centre[1]) / a) - 1)
            if off > OFF:
                raise ValueError(
                    f"{name} {(z, r)} is not on the arc about {self.centre} with semi-axes {(b, a)}: off by {off:.2g} "
                    "of them; give ends that are"
                )

    @cached_property
    def _axes(self) -> Pair:
        if self.semi_axes is not None:
            return self.semi_axes
        radius = math.dist(self.start, self.centre)
        return radius, radius

    @cached_property
    def _angles(self) -> Pair:
        (b, a), (zc, rc) = self._axes, self.centre
        first, last = (math.atan2((z - zc) / b, (r - rc) / a) for z, r in (self.start, self.end))
        turn = (last - first) % (2 * math.pi) if self.convex else -((first - last) % (2 * math.pi))
        return first, first + turn

    @property
    def turns(self) -> FloatArray:
        """Both ends, and the conic's vertices between them."""
        first, last = self._angles
        low, high = sorted((first, last))
        quarters = np.arange(math.ceil(low / (math.pi / 2)), math.floor(high / (math.pi / 2)) + 1) * (math.pi / 2)
        inner = (quarters - first) / (last - first)
        # an end that is a vertex but for rounding
        inner = inner[(inner > 1e-6) & (inner < 1 - 1e-6)]
        return np.concatenate([[0.0], np.sort(inner), [1.0]])

    @property
    def extremes(self) -> FloatArray:
        """Both ends, and the conic's vertices between them."""
        return self.turns

    def _angle(self, u: FloatArray) -> FloatArray:
        first, last = self._angles
        return np.asarray(first + np.asarray(u, dtype=float) * (last - first))

    def point(self, u: FloatArray) -> FloatArray:
        """Points (z, radius), L: (n,) to (n, 2)."""
        t, (b, a) = self._angle(u), self._axes
        found = np.stack([self.centre[0] + b * np.sin(t), self.centre[1] + a * np.cos(t)], axis=-1)
        # ends are those given, to the last digit
        found[np.asarray(u) == 0], found[np.asarray(u) == 1] = self.start, self.end
        return found

    def tangent(self, u: FloatArray) -> FloatArray:
        """Unit tangents: (n,) to (n, 2)."""
        (b, a), (zc, rc) = self._axes, self.centre
        z, r = np.moveaxis(self.point(u), -1, 0)
        # from the point, not from the angle: exact where it is a vertex
        along = np.stack([b * (r - rc) / a, -a * (z - zc) / b], axis=-1) * (1.0 if self.convex else -1.0)
        return np.asarray(along / np.linalg.norm(along, axis=-1, keepdims=True))

    def shapes(self) -> tuple[float, list[FloatArray]]:
        """Conic with D = 0."""
        (b, a), (zc, rc) = self._axes, self.centre
        m = math.sqrt(a * b) * (1 if self.convex else -1)
        rest = 0.5 * m * (rc / a - 1) * (rc / a + 1)
        return CONIC, [np.array([m / a**2, -m * rc / a**2, m / b**2, 0.0, rest, zc])]

    def reversed(self) -> "Arc":
        """The same from its end to its start."""
        return Arc(self.end, self.start, self.centre, self._axes, not self.convex)


def _checked(start: Pair, end: Pair) -> None:
    for z, r in (start, end):
        finite(z=z, radius=r)
        if r < 0:
            raise ValueError(f"radius = {r!r} of a profile is negative")
    if start == end:
        raise ValueError(f"a segment of the profile begins and ends at {start}")


def upward(segments: Sequence[Segment]) -> list[Segment]:
    """Segments in the direction from the lower to the upper end of the axis.

    Raises
    ------
    ValueError
        If they do not follow each other, do not begin and end on the axis, touch it between, or cross each other.
    """
    if not segments:
        raise ValueError("a profile without segments")
    for one, other in pairwise(segments):
        if one.end != other.start:
            raise ValueError(f"a segment of the profile ends at {one.end}, the next begins at {other.start}")
    ends = segments[0].start, segments[-1].end
    if any(r != 0 for _, r in ends):
        raise ValueError(f"the profile begins at {ends[0]} and ends at {ends[1]}; begin and end at radius 0")
    outline = np.concatenate([segment.point(np.linspace(0, 1, 65))[:-1] for segment in segments])
    if np.any(outline[1:, 1] <= 0):
        raise ValueError("the profile touches the axis between its ends; give one body")
    z, r = np.concatenate([outline, [ends[1]]]).T
    # area below the profile
    area = float(np.sum(np.diff(z) * (r[1:] + r[:-1])) / 2)
    if crossing := _crossing(z, r):
        raise ValueError(f"the profile crosses itself near (z, radius) = {crossing}")
    return list(segments) if area > 0 else [segment.reversed() for segment in segments[::-1]]


def _crossing(z: FloatArray, r: FloatArray) -> Pair | None:
    """Where a polygon crosses itself, None if it does not."""
    p = np.stack([z, r], axis=-1)
    # more would take long, and a profile so fine is smooth
    p = p[:: max(1, len(p) // 600)]
    a, b = p[:-1], p[1:]

    def side(of: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
        along, there = end - start, of[:, None] - start
        return np.asarray(along[:, 0] * there[..., 1] - along[:, 1] * there[..., 0])

    apart = (side(a, a, b) * side(b, a, b) < 0) & ((side(a, a, b) * side(b, a, b)).T < 0)
    found = np.argwhere(apart)
    return (float(a[found[0, 0], 0]), float(a[found[0, 0], 1])) if len(found) else None
