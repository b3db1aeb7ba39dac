"""Which pieces make one smooth surface near a point, and the planes through their joints that part them."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scatterers.pieces.crease import Crease
from scatterers.spline.tensor import TensorSpline, evaluated

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
ALIKE = 0.5
"""Cosine between the normals of pieces that a chain of joints makes one surface: across a sharp nose they oppose."""

STRAIGHT, KINK = 1e-3, 0.8
"""Turn of a joint over three of its segments, radians, from which on it has a plane, and beyond which it is a kink;"""
STEEP = 0.5
"""cosine between that plane and the one at right angles to the body, below which it nearly touches the body."""


def of_one_surface(
    splines: Sequence[TensorSpline],
    points: FloatArray,
    signs: Mapping[int, Mapping[tuple[int, int], int]],
    joined: Mapping[int, Collection[tuple[int, int]]],
) -> dict[int, dict[tuple[int, int], int]]:
    """0 for pairs of pieces that joints near a point join, and for alike ones that a chain of joints does.

    Points (n, 3), L; pairs of pieces by the numbers of the points that they are near to, and those that are joined.
    """
    found = {where: dict.fromkeys(pairs, 0) for where, pairs in joined.items()}
    chained = []
    for where, pairs in joined.items():
        if len(pairs) < 2:
            continue
        groups: list[set[int]] = []
        for pair in pairs:
            near = [group for group in groups if not group.isdisjoint(pair)]
            groups = [group for group in groups if group not in near] + [set(pair).union(*near)]
        for i, j in signs[where]:
            if (i, j) not in found[where] and any(i in group and j in group for group in groups):
                chained.append((where, i, j))
    if not chained:
        return found
    at, first, second = np.array(chained).T
    alike = np.sum(_normals(splines, points[at], first) * _normals(splines, points[at], second), axis=1) > ALIKE
    for where, i, j in np.array(chained)[alike].tolist():
        found[where][i, j] = 0
    return found


def _normals(splines: Sequence[TensorSpline], points: FloatArray, piece: IntArray) -> FloatArray:
    """Unit normals (n, 3) of the pieces (n,) at points (n, 3)."""
    found = np.empty_like(points)
    for number in np.unique(piece):
        mine = piece == number
        gradient = evaluated(splines[number].compiled, points[mine])[1]
        found[mine] = gradient / np.linalg.norm(gradient, axis=1, keepdims=True)
    return found


def _unit(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300))


def _osculating(curve: Crease, across: FloatArray) -> FloatArray:
    """Normals (k, 3) of planes through the segments of a joint and its bend there, which it leaves last.

    Where it is straight, has a kink, or its plane nearly touches the body, it is the plane ``across``.
    """
    along = np.diff(curve.points, axis=0)
    if len(along) < 3:
        return across
    if curve.closed:
        before, after = np.roll(along, 1, axis=0), np.roll(along, -1, axis=0)
    else:
        inner = np.clip(np.arange(len(along)), 1, len(along) - 2)
        before, after = along[inner - 1], along[inner + 1]
    bend = _unit(after) - _unit(before)
    normal = np.cross(_unit(along), bend)
    turn = np.linalg.norm(normal, axis=1)
    normal = _unit(normal) * np.copysign(1.0, np.sum(normal * across, axis=1))[:, None]
    sound = (turn > STRAIGHT) & (turn < KINK) & (np.sum(normal * across, axis=1) > STEEP)
    return np.where(sound[:, None], normal, across)


class JointPlanes:
    """Planes through joints and seams, by which the two pieces of one smooth surface are told apart.

    Of a seam the plane is at right angles to the body, of a joint that in which it bends.
    a.x > b is the side of the piece with the larger number: which way a crease runs says nothing of that, points of
    both pieces next to it do.
    """

    def __init__(
        self, splines: Sequence[TensorSpline], creases: Sequence[Crease], points: FloatArray, owner: IntArray
    ) -> None:
        from scipy.spatial import cKDTree

        trees: dict[int, Any] = {}
        self._of: dict[tuple[int, int], tuple[Any, FloatArray, FloatArray]] = {}
        for pair in {crease.pieces for crease in creases if crease.kind in ("joint", "seam")}:
            curves = [c for c in creases if c.pieces == pair and c.kind in ("joint", "seam")]
            for number in pair:
                if number not in trees and np.any(owner == number):
                    trees[number] = cKDTree(points[owner == number])
            if not all(number in trees for number in pair):
                continue
            first, second = sorted(pair)
            places, planes = [], []
            for curve in curves:
                x, along = 0.5 * (curve.points[1:] + curve.points[:-1]), np.diff(curve.points, axis=0)
                n = sum(_unit(splines[number].gradient(x)) for number in pair)
                across = _unit(np.cross(n, along))
                if curve.kind == "joint":
                    across = _osculating(curve, across)
                ways = [trees[number].data[trees[number].query(x)[1]] for number in (first, second)]
                places.append(x)
                planes.append(np.copysign(1.0, np.sum(across * (ways[1] - ways[0]))) * across)
            x = np.concatenate(places)
            self._of[first, second] = cKDTree(x), x, np.concatenate(planes)

    def near(
        self, points: FloatArray, pairs: Mapping[int, Collection[tuple[int, int]]], reach: float
    ) -> dict[int, dict[tuple[int, int], tuple[float, ...]]]:
        """a (3) and b of the plane a.x = b nearest to points (n, 3), for each pair near a point that has one.

        Pairs by the numbers of the points that they are near to, and so the planes.
        """
        found: dict[int, dict[tuple[int, int], tuple[float, ...]]] = {where: {} for where in pairs}
        rows: dict[tuple[int, int], list[int]] = {}
        for where, some in pairs.items():
            for pair in some:
                if pair in self._of:
                    rows.setdefault(pair, []).append(where)
        for pair, at in rows.items():
            tree, x, across = self._of[pair]
            distance, nearest = tree.query(points[at])
            planes = np.column_stack([across, np.sum(across * x, axis=1)])[nearest]
            for where, plane, off in zip(at, planes.tolist(), distance.tolist(), strict=True):
                if off < reach:
                    found[where][pair] = tuple(plane)
        return found
