"""Bodies of revolution, and their affine images, from the segments of a profile.

With (u, v, w) = M x, r = sqrt(u^2 + v^2), each segment is a piece F(x) = G(r, w) = 0 of the body; see
`scatterers.kernels.revolved`. A corner of the profile is a circle about the axis: an edge if the tangent turns there,
else a joint, or a seam between parts of one line or arc. Where the profile meets the axis at another than a right angle
there is a tip.

Also here: triangles between rings of points: the tiles of bodies of revolution and of their affine images.

A ring at the radius r has n points at equal parts of its length, (r cos phi, r sin phi/stretch). Between two rings the
fractions (i + 1/2)/n of both are put in order; where one passes, its ring advances by a point and a triangle is closed.

Also here: few squares that cover a body of revolution: parts of its profile turned about the axis by parts of a turn.

    x(u, v) = (r cos phi, r sin phi, w),   (w, r) along the profile by u,   phi by v,   x_u x x_v out of the body

From the axis u goes outwards, and else upwards; where u goes up, phi goes back.

Also here: charts of a body of pieces that has no edges: six over its radial map from the middle of its box.

Sources: [C76, sec. 3-3]; Derivations, B14.
"""

import itertools
import math
from collections.abc import Callable, Sequence
from functools import cache, cached_property
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from creeping._typing import FloatArray, IntArray
from scatterers.body import SHARP, Body, Crease, Levelled, NoCharts, Piece, cached, no_charts, positive
from scatterers.charts.star import CubeSphereAtlas, RadialMap, Spine
from scatterers.exact.profile import Segment
from scatterers.kernels.compiled import Compiled, evaluated
from scatterers.kernels.revolved import AT, ROW, evaluate, numbers, value_and_gradient
from scatterers.kernels.tensor import AT as OF_MAP

SMALLEST = 1e-6
"""Turn of the tangent, radians, below which a corner is a joint, and an end on the axis no tip."""
DENSE = 513
"""Points of a segment by which its length is measured."""


class Squares(NamedTuple):
    """Squares 0 <= u, v <= 1 that cover a body.

    Attributes
    ----------
    vertices : (l, 3), L
    places : (m, n, n, 3), L
        Points of the body at u and v.
    corners : (m, 4)
        Numbers of the vertices at (0, 0), (1, 0), (1, 1), (0, 1). On the axis the whole side u = 0 is one of them.
    pieces : (m,)
    """

    vertices: FloatArray
    places: FloatArray
    corners: IntArray
    pieces: IntArray


def revolved_squares(profile: Sequence[Segment], sectors: int, at: FloatArray) -> Squares:
    """Squares of a profile about the axis w, ``sectors`` in a ring, and their points at u and v ``at`` (n,)."""
    parts = [
        (piece, segment, low, high)
        for piece, segment in enumerate(profile)
        for cuts in [_cuts(segment)]
        for low, high in itertools.pairwise(cuts)
    ]
    heights, radii = np.array(
        [parts[0][1].start, *(segment.point(np.array([high]))[0] for _, segment, _, high in parts)]
    ).T
    counts = np.where(radii > 0, sectors, 1)
    starts, number = np.concatenate([[0], np.cumsum(counts)]), np.arange(sectors)
    phi, after = 2 * np.pi * number / sectors, np.roll(number, -1)
    rings = [_turned(np.full(n, w), np.full(n, r), phi[:n]) for w, r, n in zip(heights, radii, counts, strict=True)]
    places, corners, pieces = [], [], []
    for k, (piece, segment, low, high) in enumerate(parts):
        below, above = (starts[ring] + number % counts[ring] for ring in (k, k + 1))
        one, two, v = after, number, 1 - at
        if radii[k + 1] == 0:
            low, high, below, above, one, two, v = high, low, above, below, number, after, at
        w, r = segment.point(low + at * (high - low)).T[:, None, :, None]
        places.append(_turned(w, r, phi[:, None, None] + 2 * np.pi / sectors * v))
        corners.append(np.stack([below[one], above[one], above[two], below[two]], axis=1))
        pieces.append(np.full(sectors, piece, dtype=np.int64))
    return Squares(*map(np.concatenate, (rings, places, corners, pieces)))


def _turned(w: FloatArray, r: FloatArray, phi: FloatArray) -> FloatArray:
    """Points (..., 3) at heights w and distances r from the axis."""
    return np.stack(np.broadcast_arrays(r * np.cos(phi), r * np.sin(phi), w), axis=-1)


def _cuts(segment: Segment) -> FloatArray:
    """Values of u from 0 to 1 between which a segment turns by 1.1 radians at most."""
    tangent = segment.tangent(np.linspace(0, 1, DENSE))
    return _evenly(np.abs(tangent[:-1, 0] * tangent[1:, 1] - tangent[:-1, 1] * tangent[1:, 0]), 1.1)


def _evenly(parts: FloatArray, most: float) -> FloatArray:
    """Values of u that share what adds up along a segment evenly, at most so much each, from its parts at equal u."""
    along = np.concatenate([[0.0], np.cumsum(parts)])
    count = max(1, math.ceil(along[-1] / most))
    found = np.interp(np.linspace(0, along[-1], count + 1), along, np.linspace(0, 1, len(along)))
    # of a straight line nothing adds up
    found[0], found[-1] = 0.0, 1.0
    return np.asarray(found)


class Revolved(Levelled, Body):
    """Base of bodies with a profile; a subclass gives ``_profile``, and where it is placed."""

    # the axes of space that are u, v and w, and v over that coordinate
    _axes: tuple[int, int, int] = (0, 1, 2)
    _stretch: float = 1.0

    @cached_property
    def _profile(self) -> Sequence[Segment]:
        """Segments from the lower to the upper end of the axis."""
        raise NotImplementedError

    @cached
    def pieces(self) -> Sequence[Piece]:
        """Smooth surfaces that bound the body, in order along the axis, the lowest first."""
        return [
            Piece(Compiled(evaluate, "level", self._packed([s], whole=False)), self._box([s])) for s in self._profile
        ]

    @property
    def axis_of_revolution(self) -> tuple[float, float, float] | None:
        """Unit vector along the axis; None if the body is stretched and not a body of revolution."""
        if self._stretch != 1.0:
            return None
        x, y, z = (float(self._axes[2] == k) for k in range(3))
        return x, y, z

    @cached
    def bounds(self) -> FloatArray:
        """Box (2, 3) that contains the body, L."""
        return self._box(self._profile)

    def _box(self, segments: Sequence[Segment]) -> FloatArray:
        outline = np.concatenate([segment.point(segment.extremes) for segment in segments])
        (low, _), (high, r) = outline.min(0), outline.max(0)
        return self._placed(np.array([[-r, -r, low], [r, r, high]]))

    def _placed(self, local: FloatArray) -> FloatArray:
        """Points (..., 3), L, of (u, v, w)."""
        iu, iv, iw = self._axes
        x = np.empty(np.shape(local))
        x[..., iu], x[..., iv], x[..., iw] = local[..., 0], local[..., 1] / self._stretch, local[..., 2]
        return x

    def _packed(
        self, segments: Sequence[Segment], of_map: FloatArray | None = None, *, whole: bool = True
    ) -> FloatArray:
        """Parameters of the compiled functions."""
        rows, shapes = [], []
        kept = [(segment, *segment.shapes()) for segment in segments]
        # one conic alone needs no search
        turns = [s.turns if splined or len(kept) > 1 else s.turns[[0, -1]] for s, splined, _ in kept]
        at = AT.rows + ROW.width * sum(len(u) - 1 for u in turns)
        for piece, ((segment, splined, parts), u) in enumerate(zip(kept, turns, strict=True)):
            ends = np.column_stack([segment.point(u), segment.tangent(u)])
            before = np.zeros(2) if piece == 0 else segments[piece - 1].tangent(np.ones(1))[0]
            after = np.zeros(2) if piece == len(segments) - 1 else segments[piece + 1].tangent(np.zeros(1))[0]
            corner = before[0] * ends[0, 3] - before[1] * ends[0, 2]
            # on both sides of a joint the same normal divides the plane
            ends[0, 2:] = _shared(ends[0, 2:], before)
            ends[-1, 2:] = _shared(ends[-1, 2:], after)
            for k, (start, end) in enumerate(pairwise(ends)):
                where = at + (sum(map(len, parts[:k])) if splined else 0)
                turned = -math.copysign(1.0, corner) if k == 0 else 1.0
                rows.append([*start, *end, piece, splined, where, turned])
            at += sum(map(len, parts))
            shapes += parts
        place = [*self._axes, self._stretch, float(whole), len(rows)]
        header = np.concatenate([np.zeros(OF_MAP.end) if of_map is None else of_map, place])
        return np.concatenate([header, np.ravel(rows), *shapes])

    @cached_property
    def compiled(self) -> Compiled:
        """Compiled function that gives F, its gradient and its Hessian."""
        return Compiled(evaluate, "level", self._packed(self._profile))

    def piece(self, points: FloatArray) -> IntArray:
        """Number of the piece nearest to points (..., 3), L, which lie near the body: (...)."""
        # this level has the numbers of the pieces in the place of F
        return evaluated(Compiled(numbers, "level", self.compiled.parameters), points)[0].astype(np.int64)

    @cached
    def creases(self) -> Sequence[Crease]:
        """Circles along which pieces meet, and tips."""
        found = []
        last = len(self._profile) - 1
        for number, (end, u) in enumerate(((0, 0.0), (last, 1.0))):
            segment = self._profile[end]
            along = segment.tangent(np.array([u]))[0]
            if abs(along[0]) > SMALLEST:
                w = (segment.start, segment.end)[number][0]
                found.append(Crease("tip", (end, end), self._placed(np.array([[0.0, 0.0, w]]))))
        for k in range(last):
            w, r = self._profile[k].end
            turn = _turn(self._profile[k].tangent(np.ones(1))[0], self._profile[k + 1].tangent(np.zeros(1))[0])
            phi = ring_angles(360, self._stretch)
            points = self._placed(np.stack([r * np.cos(phi), r * np.sin(phi), np.full(360, w)], axis=-1))
            points = np.concatenate([points, points[:1]])
            if abs(turn) > SMALLEST:
                a, b = (piece.gradient(points) for piece in self.pieces[k : k + 2])
                angles = np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.sum(a * b, axis=-1))
                found.append(Crease("edge", (k, k + 1), points, float(np.max(angles))))
                continue
            # a seam where piece k + 1 has all of piece k, too
            w, r = self._profile[k].point(np.array([0.0, 0.5])).T
            off = self.pieces[k + 1].level(self._placed(np.stack([r, 0 * r, w], axis=-1)))
            same = np.max(np.abs(off)) < 1e-12 * np.max(np.abs(self.bounds))
            found.append(Crease("seam" if same else "joint", (k, k + 1), points, 0.0))
        return found

    def tiles(self, edge: float) -> tuple[FloatArray, FloatArray, IntArray]:
        """Triangulate the body, in rings about the axis; sides are at most about ``edge``, L.

        Returns
        -------
        corners, normals : (m, 3, 3), L and 1
            Corners of the triangles, counter-clockwise seen from outside, and unit normals of the piece there. At a
            tip the normal is that of the side towards the middle of the triangle.
        pieces : (m,)
            Number of the piece of each triangle; each lies on one piece.

        Raises
        ------
        ValueError
            If ``edge`` is not a positive finite number, or asks for too many tiles.
        """
        positive(edge=edge)
        long, wide = np.ptp(self.bounds, axis=0).sum() / edge, max(np.ptp(self.bounds, axis=0)) / edge
        if long * wide > 1e7:
            raise ValueError(f"edge = {edge!r} asks for some {long * wide:.1g} tiles, more than 1e+07; give more")
        # steps along and across the profile: the third side is then 1.06 edges at most
        side = 0.75 * edge
        corners, normals, pieces = [], [], []
        for number, segment in enumerate(self._profile):
            # values of u at equal steps of the length
            u = _evenly(np.linalg.norm(np.diff(segment.point(np.linspace(0, 1, DENSE)), axis=0), axis=1), side)
            (w, r), (tw, tr) = segment.point(u).T, segment.tangent(u).T
            # points on the rings; one where the radius is 0
            length = r * _ring_length(self._stretch)[1][-1]
            sizes = np.where(r > 0, np.maximum(6, np.ceil(length / side)), 1).astype(np.int64)
            for k in range(len(u) - 1):
                ring, of_ring = strip(int(sizes[k]), int(sizes[k + 1]))
                angles = [ring_angles(int(n), self._stretch) for n in sizes[k : k + 2]]
                phi = np.where(ring == 0, angles[0][of_ring % sizes[k]], angles[1][of_ring % sizes[k + 1]])
                at = k + ring
                x = np.stack([r[at] * np.cos(phi), r[at] * np.sin(phi), w[at]], axis=-1)
                corners.append(self._placed(x))
                # the apex of a fan has no angle of its own
                # angles (m, 3) of corners, of an apex the angle of the middle of the other two
                apex = sizes[at] == 1
                other = np.where(apex, 0.0, 1.0)
                middle = np.arctan2(np.sum(other * np.sin(phi), axis=-1), np.sum(other * np.cos(phi), axis=-1))
                phi = np.where(apex, middle[:, None], phi)
                n = np.stack([tw[at] * np.cos(phi), tw[at] * np.sin(phi), -tr[at]], axis=-1)
                normals.append(self._normal(n))
                pieces.append(np.full(len(x), number, dtype=np.int64))
        return np.concatenate(corners), np.concatenate(normals), np.concatenate(pieces)

    def squares(self, at: FloatArray) -> Squares:
        """Patches 0 <= u, v <= 1 that cover the body, and their points at all pairs u, v of the numbers ``at`` (n,)."""
        found = revolved_squares(self._profile, 6 if self._stretch == 1.0 else 12, at)
        return found._replace(vertices=self._placed(found.vertices), places=self._placed(found.places))

    def _normal(self, local: FloatArray) -> FloatArray:
        # stretched where points are drawn together
        n = self._placed(local * np.array([1.0, self._stretch**2, 1.0]))
        return np.asarray(n / np.linalg.norm(n, axis=-1, keepdims=True))

    @cached
    def atlas(self) -> CubeSphereAtlas | NoCharts:
        """Six charts of a body about z without edges or tips that is star-shaped about its middle; else `NoCharts`."""
        from scatterers.kernels.charts import one_cell

        sharp = [crease for crease in self.creases if crease.kind in SHARP]
        if sharp or self._axes != (0, 1, 2) or self._stretch != 1:
            return no_charts(sharp)
        half, middle = 0.5 * np.ptp(self.bounds, axis=0), self.bounds.mean(axis=0)
        wider = np.stack([self.bounds[0] - 0.1 * half, self.bounds[1] + 0.1 * half])
        # a grid of one cell, the map and the body; see `scatterers.charts.star.SpaceLevel`
        space: Any = SimpleNamespace(
            box=wider,
            flat=lambda of_map: self._packed(self._profile, one_cell(wider, of_map)),
            sources={"level": evaluate, "forward": _forward()},
        )
        sphere_map = RadialMap(space, middle, half, Spine.none())
        points = self.tiles(0.05 * float(np.linalg.norm(half)))[0].reshape(-1, 3)
        if hidden := int(np.sum(~(sphere_map.facing(points) > 0))):
            return NoCharts(
                f"the body is not star-shaped about the middle of its box: {hidden} of {len(points)} points are "
                "hidden; no charts cover it, take its tiles"
            )
        return CubeSphereAtlas(sphere_map, sphere_map.compiled_locator)


def _shared(tangent: FloatArray, other: FloatArray) -> FloatArray:
    """Mean of two unit tangents if they agree, the first if they do not."""
    if not np.any(other) or abs(_turn(tangent, other)) > SMALLEST:
        return tangent
    mean = tangent + other
    return np.asarray(mean / np.linalg.norm(mean))


def _turn(before: FloatArray, after: FloatArray) -> float:
    return math.atan2(before[0] * after[1] - before[1] * after[0], before @ after)


@cache
def _ring_length(stretch: float) -> tuple[FloatArray, FloatArray]:
    """Angles in [0, 2 pi] and the length of the ring of radius 1 up to there."""
    angles = np.linspace(0, 2 * np.pi, 4097)
    middle = 0.5 * (angles[1:] + angles[:-1])
    steps = np.hypot(np.sin(middle), np.cos(middle) / stretch) * angles[1]
    return angles, np.concatenate([[0.0], np.cumsum(steps)])


def ring_angles(n: int, stretch: float) -> FloatArray:
    """Angles (n,), radians, that divide a ring into parts of equal length."""
    angles, lengths = _ring_length(stretch)
    return np.asarray(np.interp(np.arange(n) * (lengths[-1] / n), lengths, angles))


def strip(lower: int, upper: int) -> tuple[IntArray, IntArray]:
    """Corners of the triangles between a ring and the next one along the profile, counter-clockwise from outside.

    Returns
    -------
    ring : (m, 3)
        0 of a corner on the lower ring, 1 of one on the upper.
    number : (m, 3)
        Of the point on its ring.
    """
    # a single point is the corner of all, and never advances
    below = (np.arange(lower) + 0.5) / lower if lower > 1 else np.zeros(0)
    above = (np.arange(upper) + 0.5) / upper if upper > 1 else np.zeros(0)
    of_upper = np.concatenate([np.zeros(len(below), dtype=np.int64), np.ones(len(above), dtype=np.int64)])
    of_upper = of_upper[np.argsort(np.concatenate([below, above]), kind="stable")]
    j = np.cumsum(of_upper) - of_upper
    i = np.arange(len(of_upper)) - j
    up = of_upper == 1
    number = np.where(
        up[:, None],
        np.stack([i % lower, (j + 1) % upper, j % upper], axis=-1),
        np.stack([i % lower, (i + 1) % lower, j % upper], axis=-1),
    )
    ring = np.where(up[:, None], [0, 1, 1], [0, 0, 1])
    return ring.astype(np.int64), number


@cache
def _forward() -> Callable[..., None]:
    """The sphere map's function on this level, the same object at every call."""
    from scatterers.kernels.charts import forward_over

    return forward_over(value_and_gradient, "body of revolution")
