"""Curves of the shadow line on one smooth piece of a body: from seeds along T to the creases, or round to the start.

    F_i(x) = 0,   grad F_i(x).d = 0,   T = grad F_i x Hd / |.|

Seeds are sign changes of n.d along the sides of the piece's triangles, and corners where it is 0. F_i is smooth a
little beyond its creases, so a step may pass one; the curve then ends where `piece_ahead` changes, by bisection. A
point on a crease is of the piece on which its ray would start. At a tip F_i has no derivatives: a curve ends REACH
before it.

Sources: Derivations, R6 and R7.
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray
from creeping.geodesics.pieces import REACH, to_tips
from creeping.geometry.piecewise import Tiles, piece_ahead, tips_of
from creeping.geometry.surface import size
from creeping.shadow.curves import Moved, moved_onto_lines, tangents_at

ASTRAY = 1.5
"""Distance from the tiles of a piece, in their longest side, beyond which F = 0 is another sheet, as fits may have."""
ALIKE = 0.1
"""Distance from a curve, in its steps, up to which a seed lies on it: chords leave it by a third of that."""
EDGE_ON = 1e-7
"""|n.d| on a whole piece up to which it lies edge-on and has no line of its own."""


class PieceCurve(NamedTuple):
    """A curve on one piece.

    Attributes
    ----------
    nodes : (k, 3), L
        Along T; of an open curve the ends are among them.
    closed : bool
    gaps : tuple of float, L
        From either end to its tip, 0 at other creases.
    """

    nodes: FloatArray
    closed: bool
    gaps: tuple[float, float]


def curves_on(
    body: Any, pieces: tuple[Any, ...], number: int, direction: FloatArray, tiles: Tiles
) -> tuple[list[PieceCurve], float]:
    """All curves of the line of a unit direction on the piece of a number, and the length that is missing, L.

    Where a curve turns too sharply to be followed, or crosses itself, it ends: what is missing then is what the tiles
    have of n.d = 0 on the piece beyond the length of its curves.
    """
    walk = _Walk(body, pieces[number], number, direction, tiles)
    found: list[PieceCurve] = []
    left = walk.seeds(tiles)
    while len(left):
        curve = walk.whole(left[0])
        rest = left[1:]
        if curve is not None:
            found.append(curve)
            rest = rest[~_on_curve(rest, curve)]
        left = rest
    if not walk.broken:
        return found, 0.0
    known = sum(float(np.sum(np.linalg.norm(np.diff(curve.nodes, axis=0), axis=1))) for curve in found)
    ends = contour(tiles, number, direction)
    return found, max(float(np.sum(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))) - known, 0.0)


def contour(tiles: Tiles, number: int, direction: FloatArray) -> FloatArray:
    """Where n.d = 0, n.d taken as linear on each tile of a piece, crosses their sides: both ends on each (m, 2, 3)."""
    mine = tiles.pieces == number
    corners, s = tiles.corners[mine], tiles.normals[mine] @ direction
    after, ahead = np.roll(corners, -1, axis=1), np.roll(s, -1, axis=1)
    crossed = (s > 0) != (ahead > 0)
    share = s[crossed] / (s[crossed] - ahead[crossed])
    # two sides of a triangle are crossed, or none
    return np.asarray(corners[crossed] + share[:, None] * (after[crossed] - corners[crossed])).reshape(-1, 2, 3)


def edge_on(tiles: Tiles, number: int, direction: FloatArray) -> bool:
    """Whether n.d = 0 all over a piece."""
    normals = tiles.normals[tiles.pieces == number]
    return bool(np.max(np.abs(normals @ direction), initial=0.0) < EDGE_ON)


def _on_curve(points: FloatArray, curve: PieceCurve) -> BoolArray:
    nodes = np.concatenate([curve.nodes, curve.nodes[:1]]) if curve.closed else curve.nodes
    along = np.diff(nodes, axis=0)
    long = np.linalg.norm(along, axis=1)
    out = np.zeros(len(points), dtype=bool)
    for k, x in enumerate(points):
        away = x - nodes[:-1]
        share = np.clip(np.sum(away * along, axis=1) / np.maximum(long, 1e-300) ** 2, 0.0, 1.0)
        gap = np.linalg.norm(away - share[:, None] * along, axis=1)
        out[k] = bool(np.any(gap <= ALIKE * np.maximum(long, 1e-2 * np.max(long))))
    return out


class _Walk:
    """Steps along the line on one piece."""

    def __init__(self, body: Any, piece: Any, number: int, direction: FloatArray, tiles: Tiles) -> None:
        from scipy.spatial import cKDTree

        self.body, self.piece, self.number, self.direction = body, piece, number, direction
        self.size = size(body)
        self.tips = tips_of(body)[1]
        self.broken = False
        corners = tiles.corners[tiles.pieces == number]
        sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=-1)
        self._tree = cKDTree(corners.mean(axis=1) if len(corners) else np.full((1, 3), np.inf))
        self._reach = ASTRAY * float(np.max(sides, initial=0.0))

    def seeds(self, tiles: Tiles) -> FloatArray:
        """Points of the line on the piece, at least one on each curve that a triangle's side crosses."""
        mine = tiles.pieces == self.number
        corners, s = tiles.corners[mine], tiles.normals[mine] @ self.direction
        crossed = contour(tiles, self.number, self.direction).reshape(-1, 3)
        points = np.concatenate([crossed, corners[np.abs(s) < EDGE_ON]])
        edge = self._reach / ASTRAY
        found = self._corrected(points, 0.5 * edge, 12)
        x = found.points[self._solved(found) & (np.linalg.norm(found.points - points, axis=1) < edge)]
        kept: FloatArray = x[self.inside(x) & ~(to_tips(self.tips, x) <= REACH * self.size)]
        return kept

    def _solved(self, found: Moved) -> BoolArray:
        return found.left < 1e-11 * self.size

    def inside(self, x: FloatArray) -> BoolArray:
        """Whether points of the line are of this piece (n,), and not of a sheet of its F far from the body."""
        near = np.isfinite(self._tree.query(x, distance_upper_bound=self._reach)[0])
        return np.asarray(near & (piece_ahead(self.body, x, self.direction) == self.number))

    def whole(self, seed: FloatArray) -> PieceCurve | None:
        """The curve through a seed; None where the seed has no tangent or the curve no length."""
        T = tangents_at(self.piece, self.direction, seed[None])[0]
        if not np.all(np.isfinite(T)):
            return None
        ahead, closed, far = self._followed(seed, T, 1.0)
        if closed:
            return PieceCurve(ahead, True, (0.0, 0.0))
        back, _, near = self._followed(seed, T, -1.0)
        nodes = np.concatenate([back[:0:-1], ahead])
        nodes = nodes[np.concatenate([[True], np.linalg.norm(np.diff(nodes, axis=0), axis=1) > 1e-13 * self.size])]
        if len(nodes) < 2:
            return None
        # next to an end, a node closer to it than a share of the step before would make a panel of rounding size
        for inner, step in ((1, 1), (-2, -1)):
            if len(nodes) > 3:
                end = np.linalg.norm(nodes[inner] - nodes[inner - step])
                if end < 0.05 * np.linalg.norm(nodes[inner + step] - nodes[inner]):
                    nodes = np.delete(nodes, inner, axis=0)
        return PieceCurve(nodes, False, (near, far))

    def _corrected(self, guess: FloatArray, reach: float, steps: int = 6) -> Moved:
        return moved_onto_lines(self.piece, self.direction, guess, reach=reach, steps=steps)

    def _followed(self, start: FloatArray, T0: FloatArray, sign: float) -> tuple[FloatArray, bool, float]:
        """Nodes from the start along sign T, whether they come round, and the gap to the tip they end at."""
        # step in body sizes, and nodes
        longest, most = 0.04, 20_000
        nodes, T, h = [start], T0, longest * self.size
        while len(nodes) < most:
            x = nodes[-1]
            tip = float(to_tips(self.tips, x[None])[0])
            if tip <= REACH * self.size:
                return np.array(nodes), False, tip
            h = min(h, longest * self.size, max(0.5 * tip, 0.5 * REACH * self.size))
            found = self._corrected((x + sign * h * T)[None], 0.3 * h)
            y, V = found.points[0], found.tangents[0]
            off = np.linalg.norm(y - x - sign * h * T)
            # tangents a step apart turn by a quarter of a radian at most
            if not (off < 0.3 * h and T @ V > np.cos(0.25) and self._solved(found)[0]):
                h *= 0.5
                if h < 1e-6 * self.size:
                    self.broken = True
                    return np.array(nodes), False, 0.0
                continue
            chord = y - x
            home = float((start - x) @ chord) / float(chord @ chord)
            miss = np.linalg.norm(start - x - home * chord)
            if len(nodes) > 2 and 0 < home <= 1 and miss < ALIKE * h and T0 @ V > 0.8:
                return np.array(nodes), True, 0.0
            shares = np.array([0.25, 0.5, 0.75, 1.0])
            out = ~self.inside(self._corrected(x + shares[:, None] * chord, 0.3 * h).points)
            if out.any():
                k = int(np.argmax(out))
                end = self._bisected(x, chord, shares[k - 1] if k else 0.0, shares[k])
                return np.array([*nodes, end]), False, 0.0
            nodes.append(y)
            T, h = V, 1.5 * h
        self.broken = True
        return np.array(nodes), False, 0.0

    def _bisected(self, x: FloatArray, chord: FloatArray, low: float, high: float) -> FloatArray:
        """Last point of the piece between shares of a chord of the curve."""
        long = float(np.linalg.norm(chord))
        best, other = self._corrected(x + np.array([[low], [high]]) * chord, 0.3 * long).points
        for _ in range(60):
            gap = float(np.linalg.norm(other - best))
            if gap <= 1e-14 * self.size:
                break
            # the middle of two points of the curve is off it by the square of their distance
            y = self._corrected(0.5 * (best + other)[None], 0.3 * gap).points
            if self.inside(y)[0]:
                best = y[0]
            else:
                other = y[0]
        return np.asarray(best)
