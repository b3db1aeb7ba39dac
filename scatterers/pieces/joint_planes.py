"""Which pieces make one smooth surface near a point, and the planes through their joints that part them."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scatterers.pieces.crease import Crease
from scatterers.spline.tensor import TensorSpline

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
    point: FloatArray,
    among: Mapping[tuple[int, int], int],
    joined: list[tuple[int, int]],
) -> dict[tuple[int, int], int]:
    """0 for pairs of pieces that joints near a point join, and for alike ones that a chain of joints does."""
    found = dict.fromkeys(joined, 0)
    if len(joined) < 2:
        return found
    groups: list[set[int]] = []
    for pair in joined:
        near = [group for group in groups if not group.isdisjoint(pair)]
        groups = [group for group in groups if group not in near] + [set(pair).union(*near)]
    normals: dict[int, FloatArray] = {}
    for i, j in among:
        if (i, j) in found or not any(i in group and j in group for group in groups):
            continue
        for number in (i, j):
            if number not in normals:
                gradient = splines[number].gradient(point[None])[0]
                normals[number] = gradient / np.linalg.norm(gradient)
        if float(normals[i] @ normals[j]) > ALIKE:
            found[i, j] = 0
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
        self, point: FloatArray, pairs: list[tuple[int, int]], reach: float
    ) -> dict[tuple[int, int], tuple[float, ...]]:
        """a (3) and b of the plane a.x = b nearest to a point, for each pair that has one."""
        found = {}
        for pair in pairs:
            if pair in self._of:
                tree, x, across = self._of[pair]
                distance, k = tree.query(point)
                if distance < reach:
                    found[pair] = (*across[k].tolist(), float(across[k] @ x[k]))
        return found
