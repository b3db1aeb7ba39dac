"""Curvatures of a spline at points of its body: two fits of one body differ there by about the error of the coarser."""

import numpy as np
from numpy.typing import NDArray

from scatterers.spline.fitting import tangents
from scatterers.spline.tensor import SYMMETRIC, TensorSpline, evaluated

FloatArray = NDArray[np.float64]


def curvatures(
    spline: TensorSpline, points: FloatArray, along: FloatArray | None = None
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """kappa_n along tangents and across them (2 n,), K (n,) and |grad F| (n,) at points brought onto the spline.

    Along ``along`` (n, 3), or any tangents that depend on the normals alone.
    """
    for _ in range(2):
        value, gradient, _ = evaluated(spline.compiled, points)
        points = points - (value / np.sum(gradient**2, axis=1))[:, None] * gradient
    _, gradient, entries = evaluated(spline.compiled, points)
    slope = np.linalg.norm(gradient, axis=1)
    n = gradient / slope[:, None]
    along = tangents(n)[0] if along is None else along
    e = along - np.sum(along * n, axis=1, keepdims=True) * n
    e /= np.linalg.norm(e, axis=1, keepdims=True)
    t = np.stack([e, np.cross(n, e)])
    form = np.einsum("ani,nij,bnj->abn", t, entries[:, SYMMETRIC], t) / slope
    gauss = form[0, 0] * form[1, 1] - form[0, 1] ** 2
    return np.concatenate([form[0, 0], form[1, 1]]), gauss, slope
