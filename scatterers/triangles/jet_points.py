"""Points between the vertices of a mesh and distances from it, from the jets at its vertices.

Of the three jets w = h_i(u, v) the mean of (w_i - h_i(u_i, v_i))/W_i is nearly the distance from the body; its zero
nearest to a triangle's centroid is found by Newton steps. By degree 6 these points are off by O(e^7). The distance of a
point from the body is that from the jet of the nearest vertex.

Sources: Derivations, B5.
"""

import numpy as np
from numpy.typing import NDArray

from scatterers.triangles.jets import Jets

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
STEPS, FOOT_STEPS = 3, 8
SHARE = 20_000
"""Triangles treated at a time."""
# powers of u and v in the order of `Jets.coefficients`
POWERS = [(d - b, b) for d in range(1, 7) for b in range(d + 1)]


def centroids(vertices: FloatArray, triangles: IntArray, jets: Jets) -> tuple[FloatArray, FloatArray]:
    """Points (m, 3) and outward unit normals (m, 3) at the middles of the triangles whose corners all have jets."""
    triangles = triangles[np.all(jets.fitted[triangles], axis=1)]
    points, normals = np.empty((len(triangles), 3)), np.empty((len(triangles), 3))
    for start in range(0, len(triangles), SHARE):
        some = triangles[start : start + SHARE]
        at = vertices[some].mean(axis=1)
        for _ in range(STEPS):
            value, gradient = _distance(vertices, jets, some, at)
            at = at - (value / np.sum(gradient**2, axis=1))[:, None] * gradient
        gradient = _distance(vertices, jets, some, at)[1]
        points[start : start + SHARE] = at
        normals[start : start + SHARE] = gradient / np.linalg.norm(gradient, axis=1, keepdims=True)
    return points, normals


def signed_distance(vertices: FloatArray, jets: Jets, at: FloatArray) -> FloatArray:
    """Distance (n,) of points (n, 3) from the body, positive outside; NaN where the nearest vertex' jet does not tell.

    The foot (u, v, h) nearest to (u0, v0, w0) by Newton steps on (u - u0) + (h - w0) h_u = 0 and its twin in v.
    """
    from scipy.spatial import cKDTree

    nearest = cKDTree(vertices).query(at)[1]
    out = np.empty(len(at))
    for start in range(0, len(at), SHARE):
        some = slice(start, start + SHARE)
        out[some] = _foot(vertices, jets, nearest[some], at[some])
    return out


def _foot(vertices: FloatArray, jets: Jets, i: IntArray, at: FloatArray) -> FloatArray:
    u0, v0, w0 = np.einsum("nij,nj->in", jets.frames[i], at - vertices[i]) / jets.radii[i]
    u, v = np.zeros_like(u0), np.zeros_like(v0)
    for _ in range(FOOT_STEPS):
        h, hu, hv, huu, huv, hvv = _jet(jets, i, u, v)
        gap = h - w0
        a, b, c = 1 + hu * hu + gap * huu, hu * hv + gap * huv, 1 + hv * hv + gap * hvv
        p, q = u - u0 + gap * hu, v - v0 + gap * hv
        with np.errstate(all="ignore"):
            determinant = a * c - b * b
            du, dv = (c * p - b * q) / determinant, (a * q - b * p) / determinant
        # beyond a centre of curvature the foot is no minimum
        lost = ~((determinant > 0.05) & (a > 0))
        u, v = np.where(lost, np.nan, np.clip(u - du, -1, 1)), np.where(lost, np.nan, np.clip(v - dv, -1, 1))
    h, hu, hv, *_ = _jet(jets, i, u, v)
    away = np.stack([u0 - u, v0 - v, w0 - h])
    known = (np.hypot(du, dv) < 1e-9) & jets.fitted[i]
    sign = np.sign(away[2] - away[0] * hu - away[1] * hv)
    return np.where(known, sign * np.linalg.norm(away, axis=0) * jets.radii[i], np.nan)


def _jet(jets: Jets, i: IntArray, u: FloatArray, v: FloatArray) -> tuple[FloatArray, ...]:
    """h and its derivatives u, v, uu, uv, vv of the jets at vertices i, in units of the radii."""
    up, vp = _powers(u), _powers(v)
    h, hu, hv, huu, huv, hvv = (np.zeros_like(u) for _ in range(6))
    for (a, b), c in zip(POWERS, jets.coefficients[i].T, strict=True):
        h += c * up[a] * vp[b]
        if a:
            hu += c * a * up[a - 1] * vp[b]
        if b:
            hv += c * b * up[a] * vp[b - 1]
        if a > 1:
            huu += c * a * (a - 1) * up[a - 2] * vp[b]
        if a and b:
            huv += c * a * b * up[a - 1] * vp[b - 1]
        if b > 1:
            hvv += c * b * (b - 1) * up[a] * vp[b - 2]
    return h, hu, hv, huu, huv, hvv


def _distance(vertices: FloatArray, jets: Jets, triangles: IntArray, at: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean of the three jets' heights over the body, and its gradient."""
    value, gradient = np.zeros(len(at)), np.zeros((len(at), 3))
    for corner in range(3):
        i = triangles[:, corner]
        radius, frame = jets.radii[i], jets.frames[i]
        u, v, w = np.einsum("nij,nj->in", frame, at - vertices[i]) / radius
        h, hu, hv, *_ = _jet(jets, i, u, v)
        scale = 1 / np.sqrt(1 + hu * hu + hv * hv)
        value += radius * (w - h) * scale / 3
        # the change of the scale counts for little where the height is nearly zero
        gradient += np.einsum("ni,nij->nj", np.stack([-hu, -hv, np.ones_like(hu)], axis=1), frame) * scale[:, None] / 3
    return value, gradient


def _powers(u: FloatArray) -> list[FloatArray]:
    found = [np.ones_like(u)]
    for _ in range(6):
        found.append(found[-1] * u)
    return found
