"""Body of revolution about z from a profile: a table of points, or segments.

Sources: [C76, sec. 3-3].
"""

import hashlib
import operator
import reprlib
from collections.abc import Iterable, Sequence
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from creeping._typing import ArrayLike, FloatArray
from scatterers.body import numbers
from scatterers.exact.profile import Line, Segment, SplineSegment, smooth_end, upward
from scatterers.exact.revolved import Revolved


class Revolution(Revolved):
    """Closed body of revolution about the z axis.

    Parameters
    ----------
    profile : (n, 2) array_like, or sequence of segments
        Points (z, radius), L, in order from one end of the body to the other. Quintic splines join the points between
        corners; a straight line joins two consecutive corners. A point given twice is a corner. An end off the axis is
        closed by a plane. An end on the axis is a smooth pole if the profile meets the axis at a right angle, within
        0.05 radians, else a tip. Alternatively segments ``Line`` and ``Arc`` of `scatterers.exact.profile`, each
        beginning where the previous segment ends.
    corners : iterable of int
        Numbers of further points that are corners; an end on the axis becomes a tip.
    speed : str or object with ``value`` and ``gradient``, optional
        Speed c(x) of the weighted flow.

    Raises
    ------
    ValueError
        If the profile is neither a table nor segments, is not finite, crosses itself, touches the axis between
        its ends, or turns by more than a right angle between two points; or the speed is not usable.

    Examples
    --------
    >>> import numpy as np
    >>> import scatterers as sc
    >>> t = np.linspace(-np.pi / 2, np.pi / 2, 41)
    >>> ball = sc.Revolution(np.stack([2 * np.sin(t), np.cos(t)], axis=-1))               # a spheroid
    >>> ball.creases, bool(abs(ball.gradient([0.0, 0.0, 2.0]) - (0, 0, 1)).max() < 1e-12)
    ([], True)
    >>> bullet = sc.Revolution([(0, 1), (2, 1), (2, 1), (3, 0.75), (4, 0.0)])
    >>> [crease.kind for crease in bullet.creases]
    ['tip', 'edge', 'edge']
    >>> from scatterers.exact.profile import Arc, Line
    >>> half = sc.Revolution([Line((0, 0), (0, 1)), Arc((0, 1), (1, 0), (0, 0))])         # half a ball
    >>> half.creases
    [Crease(edge between pieces 0 and 1, 90 degrees, length 6.28 L, closed)]
    """

    def __init__(
        self, profile: ArrayLike | Sequence[Segment], *, corners: Iterable[int] = (), speed: Any = None
    ) -> None:
        self.speed = speed
        self._set_speed()
        self._segments = upward(_segments(profile, corners))

    @cached_property
    def _profile(self) -> Sequence[Segment]:
        return self._segments

    def _shape_texts(self) -> list[str]:
        return [hashlib.blake2b(self.compiled.parameters.tobytes(), digest_size=16).hexdigest()]

    def __repr__(self) -> str:
        return f"Revolution({len(self.pieces)} pieces, {len(self.creases)} creases, speed={self.speed!r})"


def _segments(profile: Any, corners: Iterable[int]) -> list[Segment]:
    try:
        given = [operator.index(k) for k in corners]
    except TypeError:
        raise ValueError(f"corners {reprlib.repr(corners)} are no numbers of points; give whole numbers") from None
    if isinstance(profile, (list, tuple)) and profile and all(hasattr(one, "tangent") for one in profile):
        if given:
            raise ValueError("corners belong to a table of points; segments meet in corners of themselves")
        return list(profile)
    try:
        table = numbers(profile)
    except (TypeError, ValueError):
        raise ValueError(
            f"profile {reprlib.repr(profile)} is neither a table of points (z, radius) nor a list of segments"
        ) from None
    if table.ndim != 2 or table.shape[1] != 2 or len(table) < 2:
        raise ValueError(f"profile of shape {table.shape}; give points (n, 2), (z, radius), two at least")
    # splines of so many take half a gigabyte and ten seconds
    if len(table) > 200_000:
        raise ValueError(f"{len(table)} points of the profile are more than 200000; splines need fewer")
    if bad := int(np.sum(~np.all(np.isfinite(table), axis=1))):
        raise ValueError(f"{bad} of {len(table)} points of the profile are not finite")
    # cos(pi/2) is not quite 0
    table = np.where(np.abs(table) < 1e-14 * np.max(np.abs(table)), 0.0, table)
    if bad := int(np.sum(table[:, 1] < 0)):
        raise ValueError(f"the radius of {bad} of {len(table)} points of the profile is negative")
    if wrong := [k for k in given if not -len(table) <= k < len(table)]:
        raise ValueError(f"corners {wrong} are no points of the profile, which has {len(table)}")
    named = {k % len(table) for k in given}
    # the second of two equal points only marks the corner
    twice = np.flatnonzero(np.all(table[1:] == table[:-1], axis=1))
    named |= {int(k) for k in twice}
    kept = np.setdiff1d(np.arange(len(table)), twice + 1)
    points = table[kept]
    at = sorted({0, len(points) - 1} | {int(np.searchsorted(kept, k, side="right")) - 1 for k in named})
    tips = 0 in named, len(table) - 1 in named or bool(len(twice) and twice[-1] == len(table) - 2)
    found: list[Segment] = []
    for low, high in pairwise(at):
        found.append(_between(points[low : high + 1], (low == 0 and not tips[0], high == at[-1] and not tips[1])))
    first, last = found[0].start, found[-1].end
    if first[1] > 0:
        found.insert(0, Line((first[0], 0.0), first))
    if last[1] > 0:
        found.append(Line(last, (last[0], 0.0)))
    return found


def _between(points: FloatArray, may_be_poles: tuple[bool, bool]) -> Segment:
    """Line or spline from corner to corner."""
    # within so many radians of a right angle to the axis an end is a smooth pole
    limit = 0.05
    if len(points) == 2:
        (z0, r0), (z1, r1) = points.tolist()
        return Line((z0, r0), (z1, r1))
    first = may_be_poles[0] and points[0, 1] == 0 and smooth_end(points, True, limit)
    last = may_be_poles[1] and points[-1, 1] == 0 and smooth_end(points, False, limit)
    return SplineSegment(points, (first, last))
