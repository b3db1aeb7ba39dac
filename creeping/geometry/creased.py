"""Bodies of smooth pieces: which bodies they are, their pieces as bodies of their own, and their creases by place.

A piece is F_i = 0, smooth a little beyond where it bounds the body; the body is all of them, each up to its creases.
A point on a crease belongs to two pieces; what starts there along d goes by the piece of x + δ d (`ahead`).

Sources: Derivations, R1.
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import Any, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.geometry.kept import kept
from creeping.geometry.surface import project, size

SAMPLE = 0.1
"""Longest sides of the triangles that samples of a body come from, in its sizes."""
AHEAD = 1e-12
"""δ, in body sizes: some digits above rounding."""
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


def is_creased(body: Any) -> bool:
    """Whether a body is one of smooth pieces that meet in creases.

    Examples
    --------
    >>> import scatterers as sc
    >>> is_creased(sc.Sphere())
    False
    """
    return len(getattr(body, "creases", ())) > 0


def checked_smooth(body: Any, what: str, remedy: str) -> None:
    """Refuse a body with creases where only a smooth one will do.

    Raises
    ------
    InvalidInputError
    """
    if is_creased(body):
        raise InvalidInputError(
            f"{what} needs a smooth body; this one has {len(body.creases)} creases between its pieces: {remedy}"
        )


def tiles_of(body: Any, share: float) -> Tiles:
    """Triangles with sides of at most a share of the body's size, made once."""

    def made() -> Tiles:
        corners, normals, pieces = body.tiles(share * size(body))
        return Tiles(np.asarray(corners, float), np.asarray(normals, float), np.asarray(pieces, np.int64))

    return kept(body, f"tiles {share:g}", made)


def pieces_of(body: Any) -> tuple[Any, ...]:
    """Pieces of a body with creases, as bodies (`Piece`) without charts, made once."""

    def made() -> tuple[Piece, ...]:
        tiles = tiles_of(body, SAMPLE)
        centres = tiles.corners.mean(axis=1)
        return tuple(
            Piece(surface, body.bounds, centres[tiles.pieces == number]) for number, surface in enumerate(body.pieces)
        )

    return kept(body, "pieces", made)


def piece_ahead(body: Any, points: FloatArray, directions: FloatArray) -> IntArray:
    """Piece on which what starts at points along directions goes: (n, 3), (3,) or (n, 3) -> (n,)."""
    return np.asarray(body.piece(points + AHEAD * size(body) * directions), dtype=np.int64)


def nearest_crease(
    body: Any, points: FloatArray, pieces: IntArray | None = None, kinds: tuple[str, ...] = KINDS
) -> tuple[IntArray, FloatArray]:
    """Nearest crease of some kinds to each point and its distance, L: (n, 3) -> (n,), (n,); -1 and inf without any.

    Of creases between ``pieces`` (n, 2), in either order, where there are such.
    """
    best, nearest = np.full(len(points), -1), np.full(len(points), np.inf)
    fits = np.zeros(len(points), dtype=bool)
    for number, crease in enumerate(body.creases):
        if crease.kind not in kinds:
            continue
        distance = distance_to_polyline(points, np.asarray(crease.points, dtype=float))
        between = np.ones(len(points), dtype=bool)
        if pieces is not None:
            between = np.all(np.sort(pieces, axis=1) == np.sort(crease.pieces), axis=1)
        closer = (between & ~fits) | ((between == fits) & (distance < nearest))
        best[closer], nearest[closer] = number, distance[closer]
        fits |= between
    return best, nearest


def distance_to_polyline(points: FloatArray, line: FloatArray) -> FloatArray:
    """Distance of points (n, 3) from a polyline (m, 3), or from its one point: (n,), L.

    Examples
    --------
    >>> distance_to_polyline(np.array([[0.5, 1.0, 0.0]]), np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0]])).tolist()
    [0.5]
    """
    if len(line) == 1:
        return np.asarray(np.linalg.norm(points - line[0], axis=1))
    found = np.empty(len(points))
    along = np.diff(line, axis=0)
    square = np.maximum(np.sum(along**2, axis=1), 1e-300)
    block = max(1, 2_000_000 // len(along))
    for first in range(0, len(points), block):
        away = points[first : first + block, None] - line[:-1]
        share = np.clip(np.sum(away * along, axis=2) / square, 0.0, 1.0)
        found[first : first + block] = np.min(np.linalg.norm(away - share[..., None] * along, axis=2), axis=1)
    return found


def tips_of(body: Any) -> tuple[IntArray, FloatArray]:
    """Numbers of the tips among the creases, and their points: (n,), (n, 3)."""
    numbers = [number for number, crease in enumerate(body.creases) if crease.kind == "tip"]
    points = [np.asarray(body.creases[number].points, dtype=float).reshape(-1, 3)[0] for number in numbers]
    return np.array(numbers, dtype=np.int64), np.array(points).reshape(-1, 3)
