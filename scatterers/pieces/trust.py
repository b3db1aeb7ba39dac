"""What of a body of fitted pieces is not trusted: pieces, and points about which a piece does not follow the body.

A piece is trusted if its F is nearly a distance at its points and meets them; a point, if the piece that stands for the
body there meets it, and a fit has about the normal of the triangles or faces that it was made from.

Sources: Derivations, B13.
"""

import numpy as np
from numpy.typing import NDArray

from scatterers.pieces.patch import Patch
from scatterers.pieces.selection import PieceSpace

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
MISSED = 1e-4
"""Distance in body sizes between a point and the level there, beyond which the level is not trusted about it."""
TURNED, FAR_FROM_USUAL = 0.05, 6.0
"""Angle between a fit's normal and that of triangles or faces, radians, and over the median, that is not trusted."""
ROUGH = 0.05
"""Misfit, in spacings of the points, beyond which nothing of a piece is trusted."""
FAR_OFF = 0.5
"""Largest distance of its points from F = 0, in their spacings, that a piece may have."""
SLOPES = (0.5, 1.6)
"""|grad F| at the points: beyond, nothing of a piece is trusted either."""


def astray(space: PieceSpace, patches: list[Patch], points: FloatArray, owner: IntArray, size: float) -> FloatArray:
    """Points (k, 3) that the level of the body misses by more than `MISSED` of its size."""
    number = space.numbers(points)
    wrong = np.flatnonzero(number != owner)
    missed = np.zeros(len(wrong))
    for k in np.unique(number[wrong]):
        mine = number[wrong] == k
        value, gradient = patches[k].fine.value_and_gradient(points[wrong[mine]])
        missed[mine] = np.abs(value) / np.linalg.norm(gradient, axis=1)
    return np.asarray(points[wrong[missed > MISSED * size]])


def doubtful(patch: Patch, x: FloatArray, normals: FloatArray) -> FloatArray:
    """Vertices (k, 3), L, of those of a piece at which its fit does not have about their normals."""
    if patch.kind != "spline":
        return np.zeros((0, 3))
    gradient = patch.fine.gradient(x)
    turn = np.linalg.norm(gradient / np.linalg.norm(gradient, axis=1, keepdims=True) - normals, axis=1)
    # coarse triangles err, too
    return np.asarray(x[~(turn <= max(TURNED, FAR_FROM_USUAL * float(np.median(turn))))])


def rough(patch: Patch, points: FloatArray, size: float) -> bool:
    """Whether F of a patch is no distance at points of its piece, or misses them, or it is a speck of the body."""
    if float(np.max(np.ptp(points, axis=0))) < MISSED * size:
        return True
    if patch.kind != "spline":
        return False
    value, gradient = patch.fine.value_and_gradient(points)
    slope = np.linalg.norm(gradient, axis=1)
    if patch.misfit > ROUGH * patch.spacing or slope.min() < SLOPES[0] or slope.max() > SLOPES[1]:
        return True
    return bool(np.max(np.abs(value) / slope) > FAR_OFF * patch.spacing)
