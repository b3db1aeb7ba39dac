"""Segments of the profile of a body of revolution: lines and arcs of axis-parallel conics, as (z, radius), L.

A profile runs from the lower to the upper end of the axis, so that n = (-t_r, t_z) points outward of its tangent
t = (t_z, t_r). A line is n.(q - q_0) = 0; an arc about (z_c, r_c) with semi-axes b along z and a along the radius is

    q(t) = (z_c + b sin t, r_c + a cos t),   G = +-sqrt(a b)/2 ((zeta/b)^2 + ((r - r_c)/a)^2 - 1),  zeta = z - z_c,

convex (+) where t grows, and |grad G| = 1 on a circle. Both are A r^2/2 + B r + C zeta^2/2 + D zeta + E.

Also here: smooth part of a profile through points: a quintic spline (z(t), r(t)) of the length t of the polygon through
them.

An end on the axis that is a smooth pole is mirrored there, r(-t) = -r(t), z(-t) = z(t): the coefficients that are then
0 are set to it, so that derivatives of the body are exact on the axis. Other ends are not-a-knot.

Sources: [C76, sec. 3-3]; [B78].
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from creeping._typing import FloatArray
from scatterers.body import finite

DEGREE = 5


Pair = tuple[float, float]


class Segment:
    """Smooth part of a profile; u runs from 0 to 1 along it, from ``start`` to ``end``, (z, radius), L."""

    start: Any
    end: Any

    @property
    def turns(self) -> FloatArray:
        """Values of u (n,), from 0 to 1, between which the tangent turns by a right angle at most."""
        return np.array([0.0, 1.0])

    @property
    def extremes(self) -> FloatArray:
        """Values of u (n,) among which are those of the least and largest z and radius."""
        return self.turns

    def point(self, u: FloatArray) -> FloatArray:
        """Points (z, radius), L: (n,) to (n, 2)."""
        raise NotImplementedError

    def tangent(self, u: FloatArray) -> FloatArray:
        """Unit tangents: (n,) to (n, 2)."""
        raise NotImplementedError

    def shapes(self) -> tuple[bool, list[FloatArray]]:
        """Whether it is a spline; parameters of all parts between `turns`, or of the one that all share."""
        raise NotImplementedError

    def reversed(self) -> "Segment":
        """The same from its end to its start."""
        raise NotImplementedError


@dataclass(frozen=True)
class Line(Segment):
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

    def point(self, u: FloatArray) -> FloatArray:
        """Points (z, radius), L: (n,) to (n, 2)."""
        u = np.asarray(u, dtype=float)[..., None]
        return np.asarray((1 - u) * np.array(self.start) + u * np.array(self.end))

    def tangent(self, u: FloatArray) -> FloatArray:
        """Unit tangents: (n,) to (n, 2)."""
        along = np.subtract(self.end, self.start)
        return np.broadcast_to(along / math.hypot(*along), (*np.shape(u), 2)).copy()

    def shapes(self) -> tuple[bool, list[FloatArray]]:
        """Conic with A = C = 0."""
        tz, tr = self.tangent(np.zeros(1))[0]
        return False, [np.array([0.0, tz, 0.0, -tr, -tz * self.start[1], self.start[0]])]

    def reversed(self) -> "Line":
        """The same from its end to its start."""
        return Line(self.end, self.start)


@dataclass(frozen=True)
class Arc(Segment):
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
            # how far from its conic an end may be, in its semi-axes
            if off > 1e-9:
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

    def shapes(self) -> tuple[bool, list[FloatArray]]:
        """Conic with D = 0."""
        (b, a), (zc, rc) = self._axes, self.centre
        m = math.sqrt(a * b) * (1 if self.convex else -1)
        rest = 0.5 * m * (rc / a - 1) * (rc / a + 1)
        return False, [np.array([m / a**2, -m * rc / a**2, m / b**2, 0.0, rest, zc])]

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


class SplineSegment(Segment):
    """Segment of a profile through points.

    Parameters
    ----------
    points : (n, 2), n >= 3
        (z, radius), L, in order.
    poles : (bool, bool)
        Whether the first and the last point are smooth poles.

    Raises
    ------
    ValueError
        If the points are so few that the profile turns by more than a right angle between two of them.

    Examples
    --------
    >>> t = np.linspace(0, np.pi, 13)
    >>> half = SplineSegment(np.stack([-np.cos(t), np.sin(t)], axis=-1), (True, True))
    >>> float(np.abs(np.linalg.norm(half.point(np.linspace(0, 1, 100)), axis=-1) - 1).max()) < 1e-4
    True
    """

    def __init__(self, points: FloatArray, poles: tuple[bool, bool]) -> None:
        points = np.array(points, dtype=float)
        for pole, row in zip(poles, (0, -1), strict=True):
            if pole:
                points[row, 1] = 0.0
        self._points, self._poles = points, poles
        self.start, self.end = (tuple(points[row].tolist()) for row in (0, -1))
        self._breaks, self._bases, self._coefficients = _fitted(points, poles)
        heading = np.unwrap(np.arctan2(*self.tangent(np.linspace(0, 1, 8 * len(points) + 1)).T[::-1]))
        at_breaks = np.interp(self.turns, np.linspace(0, 1, len(heading)), heading)
        if (worst := float(np.max(np.abs(np.diff(at_breaks))))) > np.pi / 2:
            raise ValueError(
                f"the profile turns by {np.degrees(worst):.0f} degrees between two of its {len(points)} points; "
                "give more points, or name the corners"
            )

    @property
    def turns(self) -> FloatArray:
        """Knots."""
        return np.asarray(self._breaks / self._breaks[-1])

    @cached_property
    def extremes(self) -> FloatArray:
        """Knots, and where z or the radius is stationary."""
        found = [self._breaks]
        for low, high, base, by_power in zip(
            self._breaks, self._breaks[1:], self._bases, self._coefficients, strict=False
        ):
            for column in by_power.T:
                roots = np.polynomial.polynomial.polyroots(np.trim_zeros(column[1:] * np.arange(1, DEGREE + 1), "b"))
                t = base + roots[np.abs(roots.imag) < 1e-9 * (high - low)].real
                found.append(t[(t > low) & (t < high)])
        return np.asarray(np.unique(np.concatenate(found)) / self._breaks[-1])

    def _derivative(self, u: FloatArray, order: int) -> FloatArray:
        t = np.asarray(u, dtype=float) * self._breaks[-1]
        k = np.clip(np.searchsorted(self._breaks, t, side="right") - 1, 0, len(self._bases) - 1)
        s, by_power = (t - self._bases[k])[..., None], self._coefficients[k]
        for _ in range(order):
            by_power = by_power[..., 1:, :] * np.arange(1, by_power.shape[-2])[:, None]
        total = by_power[..., -1, :]
        for power in range(by_power.shape[-2] - 2, -1, -1):
            total = total * s + by_power[..., power, :]
        return np.asarray(total)

    def point(self, u: FloatArray) -> FloatArray:
        """Points (z, radius), L: (n,) to (n, 2)."""
        found = self._derivative(u, 0)
        # ends are those given, to the last digit
        found[np.asarray(u) == 0], found[np.asarray(u) == 1] = self.start, self.end
        return found

    def tangent(self, u: FloatArray) -> FloatArray:
        """Unit tangents: (n,) to (n, 2)."""
        along = self._derivative(u, 1)
        return np.asarray(along / np.linalg.norm(along, axis=-1, keepdims=True))

    def shapes(self) -> tuple[bool, list[FloatArray]]:
        """Spline: of each interval its ends and coefficients."""
        rows = []
        for low, high, base, by_power in zip(
            self._breaks, self._breaks[1:], self._bases, self._coefficients, strict=False
        ):
            rows.append(np.concatenate([[low - base, high - base], by_power[:, 0], by_power[:, 1]]))
        return True, rows

    def reversed(self) -> "SplineSegment":
        """The same from its end to its start."""
        return SplineSegment(self._points[::-1], self._poles[::-1])


def _fitted(points: FloatArray, poles: tuple[bool, bool]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Knots (m + 1,), where each interval is expanded (m,), and coefficients (m, 6, 2) of its powers."""
    from scipy.interpolate import PPoly, make_interp_spline

    t = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    length, mirror = t[-1], np.array([1.0, -1.0])
    t_all, x, kind = t, points, None
    if poles[0] and poles[1]:
        t_all, x = np.concatenate([t, 2 * length - t[-2::-1]]), np.concatenate([points, points[-2::-1] * mirror])
        x[-1], kind = x[0], "periodic"
    elif poles[0]:
        t_all, x = np.concatenate([-t[:0:-1], t]), np.concatenate([points[:0:-1] * mirror, points])
    elif poles[1]:
        t_all, x = np.concatenate([t, 2 * length - t[-2::-1]]), np.concatenate([points, points[-2::-1] * mirror])
    degree = min(DEGREE, len(t_all) - 1)
    # even degrees have their knots between the points, but for three points, whose parabola has none
    degree -= degree == 4
    spline = make_interp_spline(t_all, x, degree, bc_type=kind)
    columns = [PPoly.from_spline((spline.t, spline.c[:, k], degree)) for k in range(2)]
    edges, powers = columns[0].x, np.stack([column.c for column in columns], axis=-1)
    kept = [k for k in range(len(edges) - 1) if edges[k] < edges[k + 1] and -1e-12 * length <= edges[k] < length]
    breaks = np.append(np.maximum(edges[kept], 0.0), length)
    by_power = np.zeros((len(kept), DEGREE + 1, 2))
    by_power[:, : degree + 1] = np.moveaxis(powers[::-1, kept], 0, 1)
    bases = breaks[:-1].copy()
    if poles[1]:
        bases[-1] = breaks[-1]
        by_power[-1] = _expanded(by_power[-1], breaks[-1] - breaks[-2])
    for pole, row in zip(poles, (0, -1), strict=True):
        if pole:
            by_power[row, 1::2, 0] = 0.0
            by_power[row, 0::2, 1] = 0.0
    return breaks, bases, by_power


def _expanded(by_power: FloatArray, by: float) -> FloatArray:
    """Coefficients of a polynomial about a place that lies ``by`` farther on."""
    shift = np.polynomial.Polynomial([by, 1.0])
    columns = []
    for column in by_power.T:
        about = np.polynomial.Polynomial(column)(shift)
        columns.append(np.pad(about.coef, (0, DEGREE + 1 - len(about.coef))))
    return np.stack(columns, axis=-1)


def smooth_end(points: FloatArray, first: bool, limit: float) -> bool:
    """Whether the spline through points (n, 2) meets the axis at a right angle at its first or last point."""
    segment = SplineSegment(points, (False, False))
    along: Sequence[float] = segment.tangent(np.array([0.0 if first else 1.0]))[0]
    return abs(along[0]) < limit
