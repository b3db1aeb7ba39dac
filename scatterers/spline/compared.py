"""What a spline makes of points of its body: two fits of one body differ there by about the error of the worse."""

import numpy as np
from numpy.typing import NDArray

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


def principal_curvatures(spline: TensorSpline, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Principal curvatures (n, 2) and K (n,) at points brought onto the spline."""
    kappa, gauss, _ = curvatures(spline, points)
    mean = kappa.reshape(2, -1).mean(axis=0)
    half = np.sqrt(np.maximum(mean**2 - gauss, 0.0))
    return np.stack([mean - half, mean + half], axis=1), gauss


def normal_curvatures(spline: TensorSpline, points: FloatArray, along: FloatArray) -> FloatArray:
    """kappa_n (n,) at points brought onto the spline, along directions (n, 3) that lie nearly on it."""
    return curvatures(spline, points, along)[0][: len(points)]


def left_at(spline: TensorSpline, points: FloatArray, normals: FloatArray | None = None) -> tuple[float, float]:
    """Rms of F/|grad F| at points (n, 3), L, and rms angle between grad F and unit normals (n, 3) there, radians."""
    value, gradient, _ = evaluated(spline.compiled, points)
    slope = np.linalg.norm(gradient, axis=1)
    turn = 0.0 if normals is None else np.linalg.norm(gradient / slope[:, None] - normals, axis=1)
    return float(np.sqrt(np.mean((value / slope) ** 2))), float(np.sqrt(np.mean(turn**2)))


def tangents(normals: FloatArray) -> FloatArray:
    """Two orthonormal tangents at unit normals: (n, 3) -> (2, n, 3)."""
    e = np.cross(normals, np.eye(3)[np.argmin(np.abs(normals), axis=1)])
    e /= np.linalg.norm(e, axis=1, keepdims=True)
    return np.stack([e, np.cross(normals, e)])
