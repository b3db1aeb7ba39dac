"""The fold caustic of the reflected field, where lit ground has K = 0: how large the field is about it.

On one side of it, where a direction's normal n_w = (r - d)/|r - d| is taken twice near a parabolic point, two specular
points merge; on the other there is none, and the field of isolated points is 0. About it physical optics gives, with
c = n_w.r, g and kappa_2 of `creeping.geometry.parabolic` and u pointing to the side of the two,

    |f| = (kc/2 pi) [pi/(kc |kappa_2|)]^(1/2) 2 pi a |Ai(-X)|,   a = (kcg)^(-1/3),   X = 2kc a (n_w - n).u

On the dark side that is what isolated points miss; on the other they err by some 0.15 X^(-7/4) in place of Ai.

Sources: [LK59] for the caustic; Derivations, F19.
"""

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import airy

from creeping._typing import FloatArray
from creeping.geometry.kept import kept
from creeping.geometry.parabolic import ParabolicPoints, parabolic_points
from creeping.geometry.surface import Surface, size
from creeping.geometry.triangulation import Triangulation
from creeping.shadow.occlusion import occluded

NEIGHBOURS = 12
"""Parabolic points whose normals are nearest, and are asked."""
LARGEST = 0.5357
"""Largest value of Ai."""


def fold_error(
    body: Surface, mesh: Triangulation, direction: FloatArray, observers: FloatArray, wavenumber: float
) -> FloatArray:
    """Error of isolated specular points for the caustic's sake (m,), L, in unit directions r (m, 3) for d (m, 3).

    Examples
    --------
    >>> import scatterers as sc
    >>> from creeping.geometry.triangulation import triangulate
    >>> body, d = sc.Sphere(), np.array([[0.0, 0.0, 1.0]])
    >>> mesh = triangulate(body.level, body.gradient, body.bounds)
    >>> fold_error(body, mesh, d, -d, 30.0).tolist()                                 # a sphere has none
    [0.0]
    """
    found = parabolic_points(body, mesh)
    out = np.zeros(len(observers))
    difference = observers - direction
    length = np.linalg.norm(difference, axis=1)
    rows = np.flatnonzero(length > 1e-9)
    if not len(found.points) or not len(rows):
        return out
    wanted, c = difference[rows] / length[rows, None], 0.5 * length[rows]
    tree = kept(body, "normals of parabolic points", lambda: cKDTree(found.normals))
    near = tree.query(wanted, k=min(NEIGHBOURS, len(found.points)))[1].reshape(len(rows), -1)
    amplitude = _amplitude(found, near, wanted, c[:, None], wavenumber, size(body))
    # the wave must come to the ground, and leave it
    worth = np.nonzero(amplitude > 1e-6 * size(body))
    x = found.points[near[worth]]
    hidden = occluded(body, x, direction[rows[worth[0]]]) | occluded(body, x, -observers[rows[worth[0]]])
    amplitude[worth[0][hidden], worth[1][hidden]] = 0.0
    out[rows] = np.max(amplitude, axis=1)
    return out


def _amplitude(
    found: ParabolicPoints, near: FloatArray, wanted: FloatArray, c: FloatArray, k: float, extent: float
) -> FloatArray:
    """|f| of the error (m, neighbours), L."""
    # where the curvature does not change the fold is as wide as the body
    a = np.minimum(np.cbrt(1 / (k * c * np.maximum(found.bend[near], 1e-300))), extent)
    X = 2 * k * c * a * np.einsum("mnc,mnc->mn", wanted[:, None] - found.normals[near], found.axes[near])
    with np.errstate(divide="ignore"):
        bright = np.minimum(LARGEST, 0.15 * np.maximum(X, 0.0) ** -1.75)
    wave = np.where(X < 0, airy(np.maximum(-X, 0.0))[0], bright)
    flattest = 1 / extent
    spread = np.sqrt(np.pi / (k * c * np.maximum(np.abs(found.across[near]), flattest)))
    facing = np.sum(found.normals[near] * wanted[:, None], axis=2) > 0.5
    return np.where(facing, k * c * spread * a * wave, 0.0)
