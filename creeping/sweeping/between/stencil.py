"""Lagrange's interpolation on a lattice: six nodes along each axis, and four of them for its error.

    f(t) = sum_j w_j(t) f(x_j),   w_j(t) = prod_{i != j} (t - x_i)/(x_j - x_i),   x = -2 ... 3,  0 <= t < 1

In two dimensions weights are products. The error of the six is taken for the largest of these differences: to what the
first and the last five give, and COARSE times that to the inner four and that between the first and the last four.
The five know a smooth function's error to the order before; a kink between the nodes they may miss, the four do not.

Sources: [AS64, sec. 25.2].
"""

import numpy as np

from creeping._typing import FloatArray, IntArray
from creeping.sweeping.lattice import Lattice

NODES = np.arange(-2, 4)
COARSE = 1.0
"""With it the error of a kink is under-estimated by 5 at most nine times in ten, that of a wave never."""
BASE = 2
"""Place of the cell's own node, x = 0, among them."""


def offsets(dimensions: int) -> IntArray:
    """Numbers of the nodes of a stencil from its cell's own, the last axis fastest: (6^dimensions, dimensions)."""
    return np.stack(np.meshgrid(*[NODES] * dimensions, indexing="ij"), axis=-1).reshape(-1, dimensions)


def around(own: IntArray) -> IntArray:
    """Nodes of the stencils of cells (n, 1 + dimensions), face and own number: (n, 6^dimensions, the same)."""
    steps = offsets(own.shape[1] - 1)
    nodes = np.repeat(own[:, None], len(steps), axis=1)
    nodes[..., 1:] += steps
    return nodes


def corners(dimensions: int) -> IntArray:
    """Places of the cell's own corners in the stencil: (2^dimensions,)."""
    inside = np.all((offsets(dimensions) == 0) | (offsets(dimensions) == 1), axis=1)
    return np.flatnonzero(inside)


def weights(places: FloatArray) -> tuple[FloatArray, list[FloatArray]]:
    """Weights (n, 6^dimensions) of the stencil's nodes for places (n, dimensions) in the cell, and those of its errors.

    Examples
    --------
    >>> six, errors = weights(np.array([[0.25]]))
    >>> bool(np.isclose((six @ NODES.astype(float) ** 5)[0], 0.25**5))
    True
    >>> [bool(np.isclose((one @ NODES.astype(float) ** 3)[0], 0)) for one in errors]
    [True, True, True, True]
    """
    axes = [along_axis(place) for place in places.T]
    six, errors = _tensor([own for own, _ in axes]), []
    for axis, (_, differences) in enumerate(axes):
        before, after = [own for own, _ in axes[:axis]], [own for own, _ in axes[axis + 1 :]]
        errors += [_tensor([*before, one, *after]) for one in differences.swapaxes(0, 1)]
    return six, errors


def along_axis(place: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Weights (n, 6) of the nodes along one axis for places (n,), and those of its errors (n, 4, 6)."""
    own = _lagrange(place, slice(0, 6))
    differences = [own - _lagrange(place, slice(0, 5)), own - _lagrange(place, slice(1, 6))]
    differences += [COARSE * (own - _lagrange(place, slice(1, 5)))]
    differences += [COARSE * (_lagrange(place, slice(0, 4)) - _lagrange(place, slice(2, 6)))]
    return own, np.stack(differences, axis=1)


def totals(values: FloatArray) -> FloatArray:
    """Sums (n,) of rows (m, n), one after the other."""
    out: FloatArray = values[0]
    for row in values[1:]:
        out = out + row
    return out


def corner_weights(places: FloatArray) -> FloatArray:
    """Weights of the cell's corners, in the order of `corners`, for places (n, dimensions): (n, 2^dimensions)."""
    return _tensor([np.stack([1 - place, place], axis=1) for place in places.T])


def _tensor(factors: list[FloatArray]) -> FloatArray:
    """Products (n, m1 m2 ...) of weights (n, m1), (n, m2), ..."""
    out = factors[0]
    for factor in factors[1:]:
        out = (out[:, :, None] * factor[:, None, :]).reshape(len(out), out.shape[1] * factor.shape[1])
    return out


def _lagrange(place: FloatArray, some: slice) -> FloatArray:
    """Weights (n, 6) of some of the nodes, 0 of the others."""
    out, nodes = np.zeros((len(place), len(NODES))), NODES[some]
    for j, own in zip(range(len(NODES))[some], nodes, strict=True):
        out[:, j] = np.prod([(place - other) / (own - other) for other in nodes if other != own], axis=0)
    return out


def by_cell(
    lattice: Lattice, level: int, directions: FloatArray
) -> tuple[IntArray, IntArray, list[IntArray], FloatArray]:
    """Cells that hold unit directions (n, 3), the cell of each (n,), those of each cell, and their places in it."""
    cell, places = lattice.located(directions, level)
    own, which = np.unique(cell, axis=0, return_inverse=True)
    which = which.reshape(-1)
    order = np.argsort(which, kind="stable")
    return own, which, np.split(order, np.cumsum(np.bincount(which))[:-1]), places
