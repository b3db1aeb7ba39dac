"""A body of one fit: a spline for each smooth piece, what creeping asks of creases, the arrays that it is stored as.

A smooth body is one piece without creases.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, cast

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from scatterers.body import Crease, Piece
from scatterers.charts.samples import towards
from scatterers.fits.cloud import FitReport
from scatterers.fits.patch import curved, divided
from scatterers.fits.selection import PieceSpace
from scatterers.fits.tensor import TensorSpline
from scatterers.kernels.compiled import evaluated

KINDS = ("edge", "joint", "tip", "seam")


@dataclass(frozen=True, eq=False)
class SplinePieces:
    """The pieces of a body of one fit; a smooth body is one piece without creases.

    Attributes
    ----------
    space : PieceSpace
    astray : (j, 3), L
        Points about which the level is not trusted,
    within : float
        to this distance, L.
    creases : tuple of Crease
    corners, normals : (m, 3, 3), L and 1
        Triangles of the mesh, outward normals of their pieces; none of a smooth body.
    number : (m,)
        Piece of each triangle.
    reach : (p,), L
        Distance from its edges within which a piece is not trusted, inf for one that is not trusted at all.
    """

    space: PieceSpace
    astray: FloatArray
    within: float
    creases: tuple[Crease, ...]
    corners: FloatArray
    normals: FloatArray
    number: IntArray
    reach: FloatArray

    @classmethod
    def whole(cls, spline: TensorSpline, astray: FloatArray, within: float) -> "SplinePieces":
        """A smooth body."""
        none = np.zeros((0, 3, 3))
        space = PieceSpace([spline], np.zeros(0))
        return cls(space, astray, within, (), none, none, np.zeros(0, np.int64), np.zeros(1))

    def with_splines(self, splines: Sequence[TensorSpline]) -> "SplinePieces":
        """The same body by other splines, such as coarser fits."""
        return replace(self, space=PieceSpace(splines, self.space.table))

    @cached_property
    def surfaces(self) -> tuple[Piece, ...]:
        """The pieces."""
        box = np.stack([self.corners.min(axis=(0, 1)), self.corners.max(axis=(0, 1))])
        return tuple(Piece(spline.compiled, box) for spline in self.space.splines)

    def tiles(self, edge: float) -> tuple[FloatArray, FloatArray, IntArray]:
        """The body as triangles with sides of at most ``edge``, L: corners, normals (m, 3, 3) and pieces (m,)."""
        origin, place = divided(self.corners, edge)
        points, _ = curved(self.corners[origin, None], self.normals[origin, None], place)
        normals = np.empty_like(points)
        number = self.number[origin]
        for piece in np.unique(number):
            mine = number == piece
            x = towards(self.space.splines[piece].compiled, points[mine], 3, 0.1 * edge)
            gradient = evaluated(self.space.splines[piece].compiled, x)[1]
            points[mine], normals[mine] = x, gradient / np.linalg.norm(gradient, axis=-1, keepdims=True)
        return points, normals, number

    def non_smooth(self, points: FloatArray) -> BoolArray:
        """Whether points (..., 3), L, lie where F is not trusted: (...)."""
        given = np.asarray(points, dtype=float)
        x = given.reshape(-1, 3)
        found = np.isinf(self.reach)[self.space.numbers(x)]
        tree, reach = self._edges
        if len(reach) and x.size:
            finite = np.all(np.isfinite(x), axis=-1)
            distance, nearest = tree.query(x[finite], distance_upper_bound=float(reach.max()))
            near = np.isfinite(distance)
            near[near] = distance[near] < reach[nearest[near]]
            found[finite] |= near
        return np.asarray(found.reshape(given.shape[:-1]))

    @cached_property
    def _edges(self) -> tuple[Any, FloatArray]:
        """Tree of points on edges of fitted pieces, and how far from each the pieces are not trusted."""
        from scipy.spatial import cKDTree

        points, reach = [self.astray], [np.full(len(self.astray), self.within)]
        for crease in self.creases:
            sides = self.reach[list(crease.pieces)]
            own = float(np.max(np.where(np.isfinite(sides), sides, 0.0)))
            if crease.kind in ("edge", "tip") and own > 0:
                dense = _dense(crease.points, 0.5 * own)
                points.append(dense)
                reach.append(np.full(len(dense), own))
        return cKDTree(np.concatenate(points)), np.concatenate(reach)

    def arrays(self) -> dict[str, FloatArray]:
        """All that `restored` needs, but for the splines."""
        lengths = [len(crease.points) for crease in self.creases]
        sides = [(KINDS.index(c.kind), *c.pieces, c.angle, n) for c, n in zip(self.creases, lengths, strict=True)]
        return {
            "table": self.space.table,
            "astray": self.astray,
            "within": np.array([self.within]),
            "corners": self.corners,
            "normals": self.normals,
            "number": self.number.astype(float),
            "reach": self.reach,
            "creases": np.array(sides, dtype=float).reshape(-1, 5),
            "crease-points": np.concatenate([np.zeros((0, 3)), *(crease.points for crease in self.creases)]),
        }

    @classmethod
    def restored(cls, arrays: Mapping[str, FloatArray], splines: Sequence[TensorSpline]) -> "SplinePieces":
        """The pieces whose `arrays` and splines these are.

        Raises
        ------
        ValueError, KeyError
            If arrays are missing or do not fit each other.
        """

        def get(key: str) -> FloatArray:
            return np.ascontiguousarray(arrays[key], dtype=float)

        reach, number = get("reach"), cast(IntArray, get("number").astype(np.int64))
        corners, normals, points, begin = get("corners"), get("normals"), get("crease-points"), 0
        creases = []
        for kind, first, second, angle, count in get("creases").tolist():
            curve = points[begin : begin + int(count)]
            begin += int(count)
            creases.append(Crease(KINDS[int(kind)], (int(first), int(second)), curve, angle))
        space = PieceSpace(tuple(splines), get("table"))
        if len(space.table) or len(splines) != 1:
            space.check()
        if len(reach) != len(splines) or corners.shape != (len(number), 3, 3) or normals.shape != corners.shape:
            raise ValueError("the triangles of the pieces are damaged")
        if not np.all((number >= 0) & (number < len(reach))) or not np.all(np.isfinite(corners)):
            raise ValueError("the triangles of the pieces are damaged")
        if begin != len(points) or not all(0 <= side < len(reach) for crease in creases for side in crease.pieces):
            raise ValueError("the creases of the pieces are damaged")
        astray, within = get("astray").reshape(-1, 3), float(get("within")[0])
        return cls(space, astray, within, tuple(creases), corners, normals, number, reach)


def packed(splines: Sequence[TensorSpline], name: str) -> dict[str, FloatArray]:
    """Splines as arrays, under names that begin with ``name``."""
    parts = [(spline.coefficients, np.stack([spline.origin, spline.spacing])) for spline in splines]
    found = {f"{name}-coefficients-{k}": coefficients for k, (coefficients, _) in enumerate(parts)}
    return found | {f"{name}-grid-{k}": grid for k, (_, grid) in enumerate(parts)}


def unpacked(arrays: Mapping[str, FloatArray], name: str) -> tuple[TensorSpline, ...]:
    """The splines again.

    Raises
    ------
    ValueError, KeyError
        If an array is missing, or is not of the form that kernels trust.
    """
    splines = []
    for k in range(len(arrays["reach"])):
        grid, coefficients = arrays[f"{name}-grid-{k}"], arrays[f"{name}-coefficients-{k}"]
        # of degree 5
        sound = grid.shape == (2, 3) and coefficients.ndim == 3 and min(coefficients.shape) >= 6
        sound = sound and grid.dtype == coefficients.dtype == float and bool(np.all(np.isfinite(grid)))
        if not sound or np.any(grid[1] <= 0) or not np.all(np.isfinite(coefficients)):
            raise ValueError(f"spline {k} of the {name} fit is damaged")
        splines.append(TensorSpline(np.ascontiguousarray(coefficients), *grid))
    return tuple(splines)


def _dense(points: FloatArray, apart: float) -> FloatArray:
    """Points (n, 3) of a polygon with others between them, so far apart at most."""
    length = np.linalg.norm(np.diff(points, axis=0), axis=1)
    parts = [
        a + (b - a) * (np.arange(n) / n)[:, None]
        for a, b, n in zip(points[:-1], points[1:], np.ceil(length / apart).astype(int).clip(1, 1000), strict=True)
    ]
    return np.concatenate([*parts, points[-1:]])


class Fit(NamedTuple):
    """What points or a mesh come to.

    Attributes
    ----------
    parts, coarse : SplinePieces
        The body, and its second fit.
    report : FitReport
    """

    parts: SplinePieces
    coarse: SplinePieces
    report: FitReport
