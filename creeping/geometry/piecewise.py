"""Bodies of smooth pieces: which bodies they are, their pieces as bodies of their own, and their creases by place.

A piece is F_i = 0, smooth a little beyond where it bounds the body; the body is all of them, each up to its creases.
A point on a crease belongs to two pieces; what starts there along d goes by the piece of x + δ d (`ahead`).

Sources: Derivations, R1.
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull

from creeping._typing import Any, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.geometry.patches import halved
from creeping.geometry.surface import is_faceted, jet, memo, normal, project, size, why_no_rays
from creeping.geometry.triangulation import Triangulation, triangulate

SAMPLE = 0.1
"""Longest sides of the triangles that samples of a body come from, in its sizes."""
AHEAD = 1e-12
"""δ, in body sizes: some digits above rounding."""
CONVEX = 1e-7
"""Depth below the convex hull, in body sizes, up to which a corner of a triangle lies on it."""
KINDS = ("edge", "joint", "tip", "seam")
SMOOTH = ("joint", "seam")
"""Creases across which the normal does not jump: rays and lines go on there."""


class Piece:
    """One smooth piece of a body, in the box of the whole, so that tolerances refer to the body.

    Parameters
    ----------
    surface : Surface
        Its level.
    bounds : (2, 3), L
        Of the body.
    samples : (n, 3), L
        Points of the piece where it bounds the body.
    """

    def __init__(self, surface: Any, bounds: FloatArray, samples: FloatArray) -> None:
        self._surface, self.bounds = surface, np.asarray(bounds, dtype=float)
        self.compiled = getattr(surface, "compiled", None)
        self.samples = project(self, samples) if len(samples) else samples  # type: ignore[arg-type]

    def level(self, points: FloatArray) -> FloatArray:
        """F_i: points (..., 3), L, to (...)."""
        return np.asarray(self._surface.level(points), dtype=float)

    def gradient(self, points: FloatArray) -> FloatArray:
        """Gradient of F_i: (..., 3) -> (..., 3)."""
        return np.asarray(self._surface.gradient(points), dtype=float)

    def hessian(self, points: FloatArray) -> FloatArray:
        """Hessian of F_i: (..., 3) -> (..., 3, 3)."""
        return np.asarray(self._surface.hessian(points), dtype=float)

    def jet(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """F_i, its gradient and its Hessian."""
        return jet(self._surface, points)


class Tiles(NamedTuple):
    """Triangles of a body: corners and normals there (m, 3, 3), L and 1, and the piece of each (m,)."""

    corners: FloatArray
    normals: FloatArray
    pieces: IntArray

    @property
    def areas(self) -> FloatArray:
        """Area of each (m,), L^2."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=-1))


def is_piecewise(body: Any) -> bool:
    """Whether a body is one of smooth pieces that meet in creases.

    Examples
    --------
    >>> import scatterers as sc
    >>> is_piecewise(sc.Sphere())
    False
    """
    # what is no body at all is told by others
    return not isinstance(body, type) and len(getattr(body, "creases", ())) > 0


def has_edges(body: Any) -> bool:
    """Whether the normal of a body jumps somewhere along a curve.

    Examples
    --------
    >>> import scatterers as sc
    >>> has_edges(sc.Capsule(1.0, 4.0)), has_edges(sc.Cylinder(1.0, 4.0))
    (False, True)
    """
    return is_piecewise(body) and any(crease.kind == "edge" for crease in body.creases)


def checked_smooth(body: Any, what: str, remedy: str) -> None:
    """Refuse a body with creases where only a smooth one will do.

    Raises
    ------
    InvalidInputError
    """
    if is_piecewise(body):
        raise InvalidInputError(
            f"{what} needs a smooth body; this one has {len(body.creases)} creases between its pieces: {remedy}"
        )


def tiles_of(body: Any, share: float) -> Tiles:
    """Triangles with sides of at most a share of the body's size, cached."""

    def made() -> Tiles:
        corners, normals, pieces = body.tiles(share * size(body))
        return Tiles(np.asarray(corners, float), np.asarray(normals, float), np.asarray(pieces, np.int64))

    return memo(body, f"tiles {share:g}", made)


def is_convex(body: Any) -> bool:
    """Whether all corners of the triangles of a body with creases lie on their convex hull; asked once.

    Nothing on a convex body hides another part of it.
    """

    def asked() -> bool:
        corners = np.unique(tiles_of(body, SAMPLE).corners.reshape(-1, 3), axis=0)
        hull = ConvexHull(corners)
        block = max(1, 4_000_000 // len(hull.equations))
        parts = -(-len(corners) // block)
        # distances of points inward from their nearest plane, until one is within
        return all(
            -np.min(np.max(corners[k::parts] @ hull.equations[:, :3].T + hull.equations[:, 3], axis=1))
            < CONVEX * size(body)
            for k in range(parts)
        )

    return memo(body, "is convex", asked)


def drawn_mesh(body: Any, cells: int) -> tuple[Triangulation, FloatArray]:
    """A body as it is drawn, with the normals of its vertices (n, 3), 1; along edges these are there once a side."""
    if why_no_rays(body):
        return _drawn_parts(body, cells)
    if is_piecewise(body):
        tiles = tiles_of(body, 2.0 / cells)
        corners = tiles.corners.reshape(-1, 3)
        return Triangulation(corners, np.arange(len(corners)).reshape(-1, 3)), tiles.normals.reshape(-1, 3)
    mesh = triangulate(body, cells=cells)
    return mesh, normal(body, mesh.vertices)


def _drawn_parts(body: Any, cells: int) -> tuple[Triangulation, FloatArray]:
    """The same of a body without rays: its facets, or all its parts."""
    if is_faceted(body):
        fine = halved(body.vertices, body.triangles, 2.0 / cells * size(body))
        corners = fine.vertices[fine.triangles]
        n = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        n /= np.linalg.norm(n, axis=1, keepdims=True)
        flat = Triangulation(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
        return flat, np.repeat(n, 3, axis=0)
    vertices, triangles, normals, count = [], [], [], 0
    for part, turn, shift in zip(body.parts, body.turns, body.shifts, strict=True):
        mesh, n = drawn_mesh(part, cells)
        vertices.append(mesh.vertices @ turn.T + shift)
        triangles.append(mesh.triangles + count)
        normals.append(n @ turn.T)
        count += len(mesh.vertices)
    return Triangulation(np.concatenate(vertices), np.concatenate(triangles)), np.concatenate(normals)


def pieces_of(body: Any) -> tuple[Any, ...]:
    """Pieces of a body with creases, as bodies (`Piece`) without charts, cached."""

    def made() -> tuple[Piece, ...]:
        tiles = tiles_of(body, SAMPLE)
        centres = tiles.corners.mean(axis=1)
        return tuple(
            Piece(surface, body.bounds, centres[tiles.pieces == number]) for number, surface in enumerate(body.pieces)
        )

    return memo(body, "pieces", made)


def pieces_across(body: Any) -> FloatArray:
    """Diagonal of the box about each piece (n,), L; cached."""

    def made() -> FloatArray:
        tiles = tiles_of(body, SAMPLE)
        out = np.zeros(len(body.pieces))
        for number in np.unique(tiles.pieces):
            out[number] = np.linalg.norm(np.ptp(tiles.corners[tiles.pieces == number].reshape(-1, 3), axis=0))
        return out

    return memo(body, "pieces across", made)


def piece_ahead(body: Any, points: FloatArray, directions: FloatArray) -> IntArray:
    """Piece on which what starts at points along directions goes: (n, 3), (3,) or (n, 3) -> (n,)."""
    return np.asarray(body.piece(points + AHEAD * size(body) * directions), dtype=np.int64)


def nearest_crease(
    body: Any, points: FloatArray, pieces: IntArray | None = None, kinds: tuple[str, ...] = KINDS
) -> tuple[IntArray, FloatArray]:
    """Nearest crease of some kinds to each point and its distance, L: (n, 3) -> (n,), (n,); -1 and inf without any.

    Of creases between ``pieces`` (n, 2), in either order, where there are such.
    """
    segments = memo(body, "crease segments", lambda: _Segments.of(body))
    wanted = np.isin(segments.kinds, [KINDS.index(kind) for kind in kinds])
    best, nearest = np.full(len(points), -1), np.full(len(points), np.inf)
    left = np.ones(len(points), dtype=bool)
    if pieces is not None:
        sides = np.sort(pieces, axis=1)
        for pair in np.unique(sides, axis=0):
            mine = wanted & np.all(segments.sides == pair, axis=1)
            rows = np.flatnonzero(np.all(sides == pair, axis=1))
            if mine.any():
                best[rows], nearest[rows] = segments.nearest(points[rows], np.flatnonzero(mine))
                left[rows] = False
    rows = np.flatnonzero(left)
    if len(rows) and wanted.any():
        best[rows], nearest[rows] = segments.nearest(points[rows], np.flatnonzero(wanted))
    return best, nearest


class _Segments(NamedTuple):
    """Segments of all creases, a tip as one of no length: ends (n, 3), crease, pieces in order (n, 2), and kind."""

    starts: FloatArray
    ends: FloatArray
    creases: IntArray
    sides: IntArray
    kinds: IntArray

    @classmethod
    def of(cls, body: Any) -> "_Segments":
        starts, ends, numbers = [np.zeros((0, 3))], [np.zeros((0, 3))], [np.zeros(0, np.int64)]
        for number, crease in enumerate(body.creases):
            x = np.asarray(crease.points, dtype=float).reshape(-1, 3)
            starts.append(x[:-1] if len(x) > 1 else x)
            ends.append(x[1:] if len(x) > 1 else x)
            numbers.append(np.full(len(starts[-1]), number))
        creases = np.concatenate(numbers)
        sides = np.array([sorted(crease.pieces) for crease in body.creases])[creases]
        kinds = np.array([KINDS.index(crease.kind) for crease in body.creases])[creases]
        return cls(np.concatenate(starts), np.concatenate(ends), creases, sides, kinds)

    def nearest(self, points: FloatArray, among: IntArray) -> tuple[IntArray, FloatArray]:
        """Crease of the nearest of some segments to each point (n, 3), and its distance, L."""
        crease, distance = np.empty(len(points), np.int64), np.empty(len(points))
        a, along = self.starts[among], self.ends[among] - self.starts[among]
        square = np.maximum(np.sum(along**2, axis=1), 1e-300)
        block = max(1, 1_000_000 // len(among))
        for first in range(0, len(points), block):
            away = points[first : first + block, None] - a
            share = np.clip(np.sum(away * along, axis=2) / square, 0.0, 1.0)
            gap = np.linalg.norm(away - share[..., None] * along, axis=2)
            least = np.argmin(gap, axis=1)
            crease[first : first + block] = self.creases[among[least]]
            distance[first : first + block] = gap[np.arange(len(least)), least]
        return crease, distance


def tips_of(body: Any) -> tuple[IntArray, FloatArray]:
    """Numbers of the tips among the creases, and their points: (n,), (n, 3)."""
    numbers = [number for number, crease in enumerate(body.creases) if crease.kind == "tip"]
    points = [np.asarray(body.creases[number].points, dtype=float).reshape(-1, 3)[0] for number in numbers]
    return np.array(numbers, dtype=np.int64), np.array(points).reshape(-1, 3)
