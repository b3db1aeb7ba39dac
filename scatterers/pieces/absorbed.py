"""Regions of a mesh that one quadric goes through are one: next to the tip of a cone triangles turn as at an edge.

Of a region on a quadric Q = 0 creases are none where it meets itself, and small regions next to it belong to it if all
their vertices lie on Q = 0 and their triangles face along grad Q, but at the tip.

Sources: Derivations, B13.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scatterers.pieces.patch import SLIGHT, TIP, Patch
from scatterers.pieces.regions import Regions

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
SMALL = 0.02
"""Triangles of a region that may be absorbed, relative to those of the quadric's."""


def absorbed(
    vertices: FloatArray,
    triangles: IntArray,
    regions: Regions,
    quadric: Callable[[IntArray], Patch | None],
    close: float,
) -> Regions:
    """Regions without creases that lie within one quadric.

    Parameters
    ----------
    vertices, triangles : (n, 3), L, and (m, 3)
    regions : Regions
    quadric : callable
        Plane or quadric through triangles with given numbers, None if there is none.
    close : float
        What a vertex on a quadric may be off it, L.
    """
    number, crease = regions.number.copy(), regions.crease.copy()
    sharp = np.flatnonzero(regions.crease & ~regions.level)
    sides = regions.turns.sides[sharp]
    corners = vertices[triangles]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    count = np.bincount(number)
    for k in np.argsort(-count).tolist():
        pair = number[sides]
        beside = np.unique(pair[(pair == k).any(axis=1)])
        small = [j for j in beside.tolist() if j != k and count[j] <= SMALL * count[k]]
        itself = bool(np.any(np.all(pair == k, axis=1)))
        patch = quadric(np.flatnonzero(number == k)) if itself or small else None
        if patch is None or patch.kind != "quadric":
            continue
        while small:
            mine = np.flatnonzero(np.isin(number, small))
            own = number[mine]
            fits = _lies_on(patch, corners[mine], flat[mine], close)
            good = [j for j in small if np.all(fits[own == j])]
            number[np.isin(number, good)] = k
            pair = number[sides]
            beside = np.unique(pair[(pair == k).any(axis=1)])
            small = [j for j in beside.tolist() if j != k and count[j] <= SMALL * count[k]] if good else []
        crease[sharp[np.all(number[sides] == k, axis=1)]] = False
    if np.array_equal(crease, regions.crease):
        return regions
    kept = np.unique(number, return_inverse=True)[1].ravel()
    return replace(regions, number=np.asarray(kept, dtype=np.int64), crease=crease)


def _lies_on(patch: Patch, corners: FloatArray, flat: FloatArray, tolerance: float) -> BoolArray:
    """Whether triangles (m, 3, 3) with normals (m, 3) lie on a quadric by their corners, and face along its slope."""
    value, gradient = patch.fine.value_and_gradient(corners.reshape(-1, 3))
    slope = np.linalg.norm(gradient, axis=1)
    bend = float(np.linalg.norm(patch.fine.hessian(corners[:1, 0])))
    # of second order, as next to a tip there is no slope
    off = 2 * np.abs(value) / (slope + np.sqrt(slope**2 + 2 * bend * np.abs(value)) + 1e-300)
    along = np.sum(patch.fine.gradient(corners.mean(axis=1)) * flat, axis=1) > 0
    # the slope is 1 in the median; a triangle at a tip may reach around it, and the tip is known less well
    at_tip = slope.reshape(-1, 3).min(axis=1) < SLIGHT
    near = off <= np.where(slope < TIP, TIP * float(patch.fine.spacing[0]), tolerance)
    return np.asarray(np.all(near.reshape(-1, 3), axis=1) & (along | at_tip))
