"""Smooth part of a profile through points: a quintic spline (z(t), r(t)) of the length t of the polygon through them.

An end on the axis that is a smooth pole is mirrored there, r(-t) = -r(t), z(-t) = z(t): the coefficients that are then
0 are set to it, so that derivatives of the body are exact on the axis. Other ends are not-a-knot.

Sources: [B78].
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from scatterers.kernels.revolved import SPLINE

FloatArray = NDArray[np.float64]
Pair = tuple[float, float]
DEGREE = 5
MOST_TURN = np.pi / 2
"""Turn of the tangent between two points beyond which a profile is too coarse."""


class SplineSegment:
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
        self._breaks, self._bases, self._coefficients = _fitted(points, poles)
        heading = np.unwrap(np.arctan2(*self.tangent(np.linspace(0, 1, 8 * len(points) + 1)).T[::-1]))
        at_breaks = np.interp(self.turns, np.linspace(0, 1, len(heading)), heading)
        if (worst := float(np.max(np.abs(np.diff(at_breaks))))) > MOST_TURN:
            raise ValueError(
                f"the profile turns by {np.degrees(worst):.0f} degrees between two of its {len(points)} points; "
                "give more points, or name the corners"
            )

    @property
    def start(self) -> Pair:
        """First point (z, radius), L."""
        return float(self._points[0, 0]), float(self._points[0, 1])

    @property
    def end(self) -> Pair:
        """Last point (z, radius), L."""
        return float(self._points[-1, 0]), float(self._points[-1, 1])

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

    def shapes(self) -> tuple[float, list[FloatArray]]:
        """Spline: of each interval its ends and coefficients."""
        rows = []
        for low, high, base, by_power in zip(
            self._breaks, self._breaks[1:], self._bases, self._coefficients, strict=False
        ):
            rows.append(np.concatenate([[low - base, high - base], by_power[:, 0], by_power[:, 1]]))
        return SPLINE, rows

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
    # even degrees have their knots between the points
    degree -= degree % 2 == 0
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
