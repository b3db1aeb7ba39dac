"""Polynomials on the unit square by their values at Lobatto's points, and surfaces that such polynomials make.

    u_j = (1 - cos(pi j/q))/2,   f(u, v) = sum_ij l_i(u) l_j(v) f_ij,   l_i(u) = [b_i/(u - u_i)]/sum_j b_j/(u - u_j)

b_j = prod_{i != j} 1/(u_j - u_i). The sides of the square hold points, so that two surfaces that share those of a side
meet there without a gap.

Source: [BT04].
"""

from functools import lru_cache

import numpy as np

from creeping._typing import FloatArray


@lru_cache
def lobatto(degree: int) -> FloatArray:
    """Lobatto's points of a degree on 0 <= u <= 1 (degree + 1,).

    Examples
    --------
    >>> lobatto(2).round(12)
    array([0. , 0.5, 1. ])
    """
    return np.asarray(0.5 * (1 - np.cos(np.pi * np.arange(degree + 1) / degree)))


def barycentric(nodes: FloatArray) -> FloatArray:
    """Weights b_j of nodes (n,)."""
    apart = nodes[:, None] - nodes
    np.fill_diagonal(apart, 1.0)
    return np.asarray(1 / np.prod(apart, axis=1))


def interpolation(nodes: FloatArray, at: FloatArray) -> FloatArray:
    """l_j at places (m,): (m, n).

    Examples
    --------
    >>> rows = interpolation(lobatto(4), np.array([0.1, 1.0]))
    >>> bool(np.allclose(rows @ lobatto(4) ** 4, [1e-4, 1.0]))
    True
    """
    away = np.asarray(at, dtype=float)[:, None] - nodes
    hit = away == 0
    terms = barycentric(nodes) / np.where(hit, 1.0, away)
    on = hit.any(axis=1)
    terms[on] = hit[on]
    return np.asarray(terms / terms.sum(axis=1, keepdims=True))


def differentiation(nodes: FloatArray) -> FloatArray:
    """l_j' at the nodes (n, n)."""
    b, apart = barycentric(nodes), nodes[:, None] - nodes
    np.fill_diagonal(apart, 1.0)
    out = b / b[:, None] / apart
    np.fill_diagonal(out, 0.0)
    np.fill_diagonal(out, -out.sum(axis=1))
    return np.asarray(out)


def on_squares(places: FloatArray, u: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points x, x_u and x_v (m, a, b, 3) of surfaces (m, q + 1, q + 1, 3) at u (m, a) and v (m, b).

    Examples
    --------
    >>> flat = np.stack([*np.meshgrid(lobatto(2), lobatto(2), indexing="ij"), np.zeros((3, 3))], axis=-1)
    >>> x, along, across = on_squares(flat[None], np.array([[0.3]]), np.array([[0.7]]))
    >>> x.ravel().round(12), along.ravel().round(12)
    (array([0.3, 0.7, 0. ]), array([1., 0., 0.]))
    """
    nodes = lobatto(places.shape[1] - 1)
    m = len(places)
    slope = differentiation(nodes)
    at_u, at_v = (interpolation(nodes, t.ravel()).reshape(m, -1, len(nodes)) for t in (u, v))
    rows = [np.einsum("mai,mijx->majx", part, places) for part in (at_u, at_u @ slope)]
    x, x_u = (np.einsum("mbj,majx->mabx", at_v, part) for part in rows)
    return x, x_u, np.einsum("mbj,majx->mabx", at_v @ slope, rows[0])
