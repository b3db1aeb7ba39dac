"""Squares that cover a body: surfaces that polynomials of degree DEGREE make on 0 <= u, v <= 1.

Also here: polynomials on the unit square by their values at Lobatto's points, and surfaces that such polynomials make.

    u_j = (1 - cos(pi j/q))/2,   f(u, v) = sum_ij l_i(u) l_j(v) f_ij,   l_i(u) = [b_i/(u - u_i)]/sum_j b_j/(u - u_j)

b_j = prod_{i != j} 1/(u_j - u_i). The sides of the square hold points, so that two surfaces that share those of a side
meet there without a gap.

Also here: triangles of a body on flat facets, and squares that cover it.

Two triangles that share a side and lie in one plane are a quadrilateral, if it is convex; the longest shared sides go
first, so that rectangles come back. A triangle that stays alone is three quadrilaterals about its middle, each with a
corner and half of both sides there.

Also here: records of arrays that have as many rows each: some of the rows, and several records as one.

Sources: Derivations, B14; [BT04].
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Self

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Rows:
    """A record whose fields are arrays of one first axis, or such records; a number is the same for all rows.

    Examples
    --------
    >>> @dataclass(frozen=True, eq=False)
    ... class Places(Rows):
    ...     points: np.ndarray
    ...     unit: float
    >>> places = Places(np.arange(6.0).reshape(3, 2), 0.5)
    >>> places[1:].points.tolist(), Places.joined([places[:1], places[2:]]).points.tolist()
    ([[2.0, 3.0], [4.0, 5.0]], [[0.0, 1.0], [4.0, 5.0]])
    """

    def __getitem__(self, index: Any) -> Self:
        """Some of the rows, by an index of the first axis."""
        values = (getattr(self, one.name) for one in fields(self))
        return type(self)(*(value if isinstance(value, float) else value[index] for value in values))

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """All rows of one record or more, one after the other."""

        def whole(values: list[Any]) -> Any:
            first = values[0]
            if isinstance(first, float):
                return first
            return type(first).joined(values) if isinstance(first, Rows) else np.concatenate(values)

        return cls(*(whole([getattr(part, one.name) for part in parts]) for one in fields(cls)))


DEGREE = 6
"""Degree of the polynomials along u and v."""
ENDS = ((0, 3), (1, 2), (0, 1), (3, 2))
"""Of a square's corners (0, 0), (1, 0), (1, 1), (0, 1) those at the ends of its sides u = 0, u = 1, v = 0, v = 1."""

PLANE = 1e-5
"""Angle between two triangles, radians, up to which they are in one plane."""
SHARP = 0.35
"""Angle, radians, by which the normal turns across an edge."""
ROUNDS = 40
"""Halvings at most."""
LEAN = 0.2
"""Least sine of the angles of a quadrilateral."""


@dataclass(frozen=True, eq=False)
class Patches(Rows):
    """Squares that cover a body.

    Attributes
    ----------
    places : (m, q + 1, q + 1, 3), L
        Points by u and v; x_u x x_v points outward.
    pieces : (m,)
        The piece of each, 0 of a smooth body.
    edges : (m, 4) of bool
        Whether the normal jumps across the sides u = 0, u = 1, v = 0, v = 1.
    sides : (m, 4)
        Numbers of these sides: two squares that meet there have the same one.
    spans : (m, 4, 2)
        Where on a side, 0 to 1, each begins and ends, along u or v.
    pointed : (m,) of bool
        Whether the side u = 0 is one point.
    tips : (m,) of bool
        Whether that is a tip of the body.
    off : (m,)
        Distance from the body, L.
    """

    places: FloatArray
    pieces: IntArray
    edges: BoolArray
    sides: IntArray
    spans: FloatArray
    pointed: BoolArray
    tips: BoolArray
    off: FloatArray

    @property
    def gap(self) -> float:
        """Integral of the normal as a share of the area: 0 where the squares close."""
        u, w = np.polynomial.legendre.leggauss(len(lobatto(DEGREE)))
        at = np.broadcast_to(0.5 * (1 + u), (len(self.places), len(u)))
        _, along, across = on_squares(self.places, at, at)
        n, share = np.cross(along, across), np.outer(w, w)
        area = float(np.sum(np.linalg.norm(n, axis=-1) * share))
        return float(np.linalg.norm(np.einsum("muvx,uv->x", n, share))) / area

    @property
    def angle(self) -> float:
        """Least sine of the angle between x_u and x_v, but where a square is one point."""
        at = np.broadcast_to(lobatto(DEGREE), (len(self.places), DEGREE + 1))
        _, along, across = on_squares(self.places, at, at)
        with np.errstate(divide="ignore", invalid="ignore"):
            sine = np.linalg.norm(np.cross(along, across), axis=-1)
            sine /= np.linalg.norm(along, axis=-1) * np.linalg.norm(across, axis=-1)
        sine[self.pointed, 0] = 1.0
        return float(np.min(sine))


@lru_cache
def lobatto(degree: int) -> FloatArray:
    """Lobatto's points of a degree on 0 <= u <= 1 (degree + 1,).

    Examples
    --------
    >>> lobatto(2).round(12)
    array([0. , 0.5, 1. ])
    """
    return np.asarray(0.5 * (1 - np.cos(np.pi * np.arange(degree + 1) / degree)))


def barycentric(nodes: FloatArray) -> FloatArray:
    """Weights b_j of nodes (n,)."""
    apart = nodes[:, None] - nodes
    np.fill_diagonal(apart, 1.0)
    return np.asarray(1 / np.prod(apart, axis=1))


def interpolation(nodes: FloatArray, at: FloatArray) -> FloatArray:
    """l_j at places (m,): (m, n).

    Examples
    --------
    >>> rows = interpolation(lobatto(4), np.array([0.1, 1.0]))
    >>> bool(np.allclose(rows @ lobatto(4) ** 4, [1e-4, 1.0]))
    True
    """
    away = np.asarray(at, dtype=float)[:, None] - nodes
    hit = away == 0
    terms = barycentric(nodes) / np.where(hit, 1.0, away)
    on = hit.any(axis=1)
    terms[on] = hit[on]
    return np.asarray(terms / terms.sum(axis=1, keepdims=True))


def differentiation(nodes: FloatArray) -> FloatArray:
    """l_j' at the nodes (n, n)."""
    b, apart = barycentric(nodes), nodes[:, None] - nodes
    np.fill_diagonal(apart, 1.0)
    out = b / b[:, None] / apart
    np.fill_diagonal(out, 0.0)
    np.fill_diagonal(out, -out.sum(axis=1))
    return np.asarray(out)


def on_squares(places: FloatArray, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points x, x_u and x_v (m, a, b, 3) of surfaces (m, q + 1, q + 1, 3) at u (m, a) and v (m, b).

    Examples
    --------
    >>> flat = np.stack([*np.meshgrid(lobatto(2), lobatto(2), indexing="ij"), np.zeros((3, 3))], axis=-1)
    >>> x, along, across = on_squares(flat[None], np.array([[0.3]]), np.array([[0.7]]))
    >>> x.ravel().round(12), along.ravel().round(12)
    (array([0.3, 0.7, 0. ]), array([1., 0., 0.]))
    """
    nodes = lobatto(places.shape[1] - 1)
    m = len(places)
    slope = differentiation(nodes)
    at_u, at_v = (interpolation(nodes, t.ravel()).reshape(m, -1, len(nodes)) for t in (u, v))
    rows = [np.einsum("mai,mijx->majx", part, places) for part in (at_u, at_u @ slope)]
    x, x_u = (np.einsum("mbj,majx->mabx", at_v, part) for part in rows)
    return x, x_u, np.einsum("mbj,majx->mabx", at_v @ slope, rows[0])


def sides_of(triangles: IntArray) -> tuple[IntArray, IntArray]:
    """Sides of triangles (t, 3) by their ends (s, 2), and the number of that opposite to each corner (t, 3)."""
    ends = np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]], axis=2)
    pairs, number = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
    return pairs, number.reshape(-1, 3)


def turns_of(vertices: FloatArray, triangles: IntArray, number: IntArray) -> tuple[FloatArray, IntArray]:
    """Angle between the triangles at each side (s,), radians, and these triangles (s, 2), of a closed mesh."""
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    n = np.cross(b - a, c - a)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    beside = np.argsort(number.ravel(), kind="stable").reshape(-1, 2) // 3
    one, other = n[beside.T]
    return np.arctan2(np.linalg.norm(np.cross(one, other), axis=1), np.sum(one * other, axis=1)), beside


def chordal(vertices: FloatArray, triangles: IntArray) -> float:
    """Mean distance, L, of flat triangles from the smooth surface that they stand for, whose corners are on it.

    Of a sphere a quarter of the angle between neighbours times the height of a triangle.

    Examples
    --------
    >>> import trimesh
    >>> ball = trimesh.creation.icosphere(subdivisions=3)              # 1 - (V/V_ball)^(1/3) is 0.0029
    >>> round(chordal(ball.vertices, ball.faces), 4)
    0.0029
    """
    _, number = sides_of(triangles)
    turned = turns_of(vertices, triangles, number)[0][number]
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    twice = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    opposite = np.stack([np.linalg.norm(v, axis=1) for v in (c - b, a - c, b - a)], axis=1)
    each = np.where(turned < SHARP, turned, 0.0) * twice[:, None] / opposite
    return float(0.25 * np.sum(each.mean(axis=1) * twice) / np.sum(twice))


@dataclass(frozen=True, eq=False)
class Triangles:
    """Triangles (t, 3) of vertices (n, 3), L; ``tessellated`` if they stand for curved faces."""

    vertices: FloatArray
    triangles: IntArray
    tessellated: bool = False

    @property
    def flat(self) -> bool:
        """Whether neighbours lie in one plane or meet at an edge: then the triangles are the body."""
        turned = turns_of(self.vertices, self.triangles, sides_of(self.triangles)[1])[0]
        return bool(np.all((turned < PLANE) | (turned > SHARP)))


def halved(vertices: FloatArray, triangles: IntArray, longest: float) -> Triangles:
    """Triangles with sides no longer than this, L: sides are halved, for both triangles alike.

    Examples
    --------
    >>> found = halved(np.eye(3), np.array([[0, 1, 2]]), 1.0)
    >>> len(found.vertices), len(found.triangles)
    (6, 4)
    """
    for _ in range(ROUNDS):
        sides, number = sides_of(triangles)
        long = np.linalg.norm(vertices[sides[:, 0]] - vertices[sides[:, 1]], axis=1) > longest
        if not long.any():
            break
        middle = np.full(len(sides), -1)
        middle[long] = len(vertices) + np.arange(int(long.sum()))
        vertices = np.concatenate([vertices, vertices[sides[long]].mean(axis=1)])
        triangles = _parted(triangles, middle[number[:, [2, 0, 1]]], vertices)
    return Triangles(vertices, triangles)


def _parted(triangles: IntArray, middles: IntArray, vertices: FloatArray) -> IntArray:
    """Triangles (t, 3) parted at the middles of sides (t, 3), from corner i to i + 1, -1 for none."""
    there = middles >= 0
    count = there.sum(axis=1)
    # the sides that are halved first; of two the one that is not is the last
    turn = np.where(count == 2, (np.argmin(there, axis=1) + 1) % 3, np.argmax(there, axis=1))
    rows, around = np.arange(len(triangles))[:, None], (turn[:, None] + np.arange(3)) % 3
    (a, b, c), (ab, bc, ca) = triangles[rows, around].T, middles[rows, around].T
    out = [triangles[count == 0]]
    for number, parts in ((1, ((a, ab, c), (ab, b, c))), (3, ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)))):
        out += [np.stack(part, axis=1)[count == number] for part in parts]
    two = count == 2
    out.append(np.stack([ab, b, bc], axis=1)[two])
    # the rest is a square: its shorter diagonal
    short = np.linalg.norm(vertices[a] - vertices[bc], axis=1) <= np.linalg.norm(vertices[ab] - vertices[c], axis=1)
    for those, parts in ((two & short, ((a, ab, bc), (a, bc, c))), (two & ~short, ((a, ab, c), (ab, bc, c)))):
        out += [np.stack(part, axis=1)[those] for part in parts]
    return np.concatenate(out)


def own_triangles(body: Any) -> Triangles | None:
    """Triangles of the mesh that a body of pieces was made of, ``corners`` (m, 3, 3); None where they do not close."""
    corners = getattr(body, "corners", None)
    if corners is None:
        return None
    vertices, number = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    found = Triangles(vertices, number.reshape(-1, 3), getattr(body, "tessellated", False))
    return found if np.all(np.bincount(sides_of(found.triangles)[1].ravel()) == 2) else None


def facet_patches(body: Any) -> Patches:
    """Squares of a body with ``vertices`` and ``triangles``."""
    vertices, triangles = body.vertices, body.triangles
    pairs, number = sides_of(triangles)
    turned, beside = turns_of(vertices, triangles, number)
    quads, alone = _paired(vertices, triangles, pairs, number, turned < PLANE, beside)
    return Patches.joined(
        [_of_quads(vertices, quads, pairs, turned), _of_triangles(vertices, triangles[alone], pairs, turned)]
    )


def _paired(
    vertices: FloatArray, triangles: IntArray, pairs: IntArray, number: IntArray, flat: BoolArray, beside: IntArray
) -> tuple[IntArray, IntArray]:
    """Quadrilaterals of two triangles (q, 4), counter-clockwise, and the numbers of triangles that stay alone."""
    free, quads = np.ones(len(triangles), dtype=bool), []
    sides = np.flatnonzero(flat)
    length = np.linalg.norm(vertices[pairs[sides, 0]] - vertices[pairs[sides, 1]], axis=1)
    # sides of one length in the order of their numbers, however they are rounded
    sides = sides[np.argsort(-np.round(length / np.max(length, initial=0.0), 9), kind="stable")]
    first, second = beside[sides].T
    # the corners of each opposite to the side that they share
    apex = [triangles[t, np.argmax(number[t] == sides[:, None], axis=1)] for t in (first, second)]
    at = np.argmax(number[first] == sides[:, None], axis=1)
    low, high = (triangles[first, (at + step) % 3] for step in (1, 2))
    corners = np.stack([apex[0], low, apex[1], high], axis=1)
    good = _is_convex(vertices[corners])
    for one, other, corner in zip(first[good].tolist(), second[good].tolist(), corners[good], strict=True):
        if free[one] and free[other]:
            free[one] = free[other] = False
            quads.append(corner)
    return np.array(quads, dtype=np.int64).reshape(-1, 4), np.flatnonzero(free)


def _is_convex(corners: FloatArray) -> BoolArray:
    """Whether plane quadrilaterals (m, 4, 3) are convex, with no angle near 0 or pi."""
    ahead = np.roll(corners, -1, axis=1) - corners
    ahead /= np.maximum(np.linalg.norm(ahead, axis=2, keepdims=True), 1e-300)
    turn = np.cross(np.roll(ahead, 1, axis=1), ahead)
    normal = turn.sum(axis=1, keepdims=True)
    normal /= np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-300)
    return np.asarray(np.all(np.sum(turn * normal, axis=2) > LEAN, axis=1))


def _of_quads(vertices: FloatArray, quads: IntArray, pairs: IntArray, turned: FloatArray) -> Patches:
    """Squares of quadrilaterals (q, 4)."""
    ends = np.stack([quads[:, end] for end in ENDS], axis=1)
    sides = _numbers(pairs, ends)
    spans = np.where((ends[..., 0] > ends[..., 1])[..., None], [1.0, 0.0], [0.0, 1.0])
    return _patches(vertices[quads], sides, turned[sides] > SHARP, spans)


def _of_triangles(vertices: FloatArray, triangles: IntArray, pairs: IntArray, turned: FloatArray) -> Patches:
    """Squares of triangles (t, 3), three of each: a corner, the middles of a side, of the triangle and of a side."""
    x, parts = vertices[triangles], []
    middle = x.mean(axis=1)
    for k in range(3):
        before, here, after = (triangles[:, (k + step) % 3] for step in (2, 0, 1))
        a = x[:, k]
        corners = np.stack([a, 0.5 * (a + vertices[after]), middle, 0.5 * (a + vertices[before])], axis=1)
        # along v = 0 to the next corner, along u = 0 to the one before
        ends = np.stack([np.stack([here, before], axis=1), np.stack([here, after], axis=1)], axis=1)
        own = _numbers(pairs, ends)
        none = np.full(len(a), -1)
        sides = np.stack([own[:, 0], none, own[:, 1], none], axis=1)
        sharp = (sides >= 0) & (turned[sides] > SHARP)
        spans = np.where((ends[..., 0] > ends[..., 1])[..., None], [1.0, 0.5], [0.0, 0.5])
        every = np.tile([0.0, 1.0], (len(a), 4, 1))
        every[:, [0, 2]] = spans
        parts.append(_patches(corners, sides, sharp, every))
    return Patches.joined(parts)


def _numbers(pairs: IntArray, ends: IntArray) -> IntArray:
    """Numbers of sides with these ends (..., 2), in either order."""
    count = int(pairs.max(initial=0)) + 1
    known, asked = pairs[:, 0] * count + pairs[:, 1], np.sort(ends, axis=-1)
    return np.searchsorted(known, asked[..., 0] * count + asked[..., 1])


def _patches(corners: FloatArray, sides: IntArray, sharp: BoolArray, spans: FloatArray) -> Patches:
    """Squares by their corners (m, 4, 3): (0, 0), (1, 0), (1, 1), (0, 1) in u and v."""
    u = lobatto(DEGREE)[:, None, None]
    v = lobatto(DEGREE)[None, :, None]
    a, b, c, d = (corners[:, None, None, number] for number in range(4))
    places = (1 - u) * (1 - v) * a + u * (1 - v) * b + u * v * c + (1 - u) * v * d
    m = len(corners)
    nothing = np.zeros(m, dtype=bool)
    return Patches(places, np.zeros(m, dtype=np.int64), sharp, sides, spans, nothing, nothing, np.zeros(m))
