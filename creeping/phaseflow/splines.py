"""Tensor-product B-splines on charts x circle, in one uniform basis.

Along an axis with nodes 0..n-1 the spline is sum_j c_j N_p(t - j) with the uniform B-spline N_p of degree p: not-a-knot
ends where the axis is a chart variable (n + p - 1 coefficients), period n where it is periodic (n, continued by p).
A not-a-knot spline has fewer knots than the uniform basis, so it is contained in it and nothing is lost.

Sources: [B78]; Derivations, B7.
"""

from functools import cache

import numpy as np

from creeping._typing import FloatArray


@cache
def interpolation_operator(n: int, degree: int, periodic: bool) -> FloatArray:
    """Matrix from n node values to the uniform coefficients, (n + p - 1, n) or (n + p, n) if periodic.

    Periodic coefficients are continued by p, so that an evaluation never wraps.
    """
    from scipy.interpolate import make_interp_spline

    if periodic:
        nodes = np.arange(n + 1.0)
        values = np.vstack([np.eye(n), np.eye(n)[:1]])
        spline = make_interp_spline(nodes, values, k=degree, bc_type="periodic")
        samples = np.arange(n) + 0.5 * (degree % 2 == 0)
        collocation = np.zeros((n, n))
    else:
        spline = make_interp_spline(np.arange(float(n)), np.eye(n), k=degree)
        # the nodes, and midpoints of the first and last cells: equally spaced samples would drift through the
        # midpoints of inner cells, where splines of odd degree cannot tell an oscillation from zero
        ends = np.arange((degree - 1) // 2) + 0.5
        samples = np.sort(np.concatenate([np.arange(float(n)), ends, n - 1 - ends]))
        collocation = np.zeros((n + degree - 1, n + degree - 1))
    cell = np.minimum(np.floor(samples).astype(int), n - 1 if periodic else n - 2)
    weights = uniform_weights(samples - cell, degree)
    for j in range(degree + 1):
        column = (cell + j) % collocation.shape[1] if periodic else cell + j
        np.add.at(collocation, (np.arange(len(samples)), column), weights[:, j])
    coefficients = np.linalg.solve(collocation, spline(samples))
    if periodic:
        coefficients = coefficients[np.arange(n + degree) % n]
    return np.ascontiguousarray(coefficients)


def uniform_weights(t: FloatArray, degree: int) -> FloatArray:
    """Weights of the p + 1 B-splines that do not vanish at fraction t of a cell: (...) -> (..., p + 1).

    Cox-de Boor on uniform knots: w_j <- ((t + d - j) w_(j-1) + (j + 1 - t) w_j)/d for d = 1..p.

    Examples
    --------
    >>> (6 * uniform_weights(np.array(0.0), 3)).round(12)
    array([1., 4., 1., 0.])
    """
    t = np.asarray(t, dtype=float)
    w = np.zeros((*t.shape, degree + 1))
    w[..., 0] = 1.0
    for d in range(1, degree + 1):
        for j in range(d, 0, -1):
            w[..., j] = ((t + d - j) * w[..., j - 1] + (j + 1 - t) * w[..., j]) / d
        w[..., 0] = (1 - t) * w[..., 0] / d
    return w


@cache
def thinning_operator(n: int, stride: int, degree: int, periodic: bool) -> FloatArray:
    """Matrix from n values to those of the spline through every stride-th of them, at all n: (n, n/stride or so).

    Without periodicity n - 1 is a multiple of the stride, else n.
    """
    kept = len(range(0, n, stride))
    operator = interpolation_operator(kept, degree, periodic)
    place = np.arange(n) / stride
    cell = np.minimum(np.floor(place).astype(int), kept - 1 if periodic else kept - 2)
    w = uniform_weights(place - cell, degree)
    return np.asarray(sum(w[:, j, None] * operator[cell + j] for j in range(degree + 1)))


def prefilter(values: FloatArray, degree: int, periodic: tuple[bool, bool]) -> FloatArray:
    """Node values (charts, nu, nv, na, lanes) to coefficients; the last grid axis is periodic.

    With nu = 1 they do not depend on u.
    """
    for axis, wraps in ((1, periodic[0]), (2, periodic[1]), (3, True)):
        if axis == 1 and values.shape[1] == 1:
            continue
        operator = interpolation_operator(values.shape[axis], degree, wraps)
        values = np.moveaxis(np.tensordot(operator, values, axes=(1, axis)), 0, axis)
    return np.ascontiguousarray(values)
