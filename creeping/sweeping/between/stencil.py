"""Lagrange's interpolation on a lattice: six nodes along each axis, and four of them for its error.

    f(t) = sum_j w_j(t) f(x_j),   w_j(t) = prod_{i != j} (t - x_i)/(x_j - x_i),   x = -2 ... 3,  0 <= t < 1

In two dimensions weights are products. The error of the six is taken for the largest of these differences: to what the
first and the last five give, and COARSE times that to the inner four and that between the first and the last four.
The five know a smooth function's error to the order before; a kink between the nodes they may miss, the four do not.

What interpolated rays and fields share: incidences go from level to level, and what none gives is computed.

Sources: [AS64, sec. 25.2].
"""

from abc import ABC, abstractmethod

import numpy as np

from creeping._typing import FloatArray, IntArray
from creeping.geometry.surface import Surface
from creeping.rays.transport import Flow
from creeping.sweeping.lattice import Lattice
from creeping.sweeping.request import SweepRequest
from creeping.sweeping.sweeper import Arrays, Sweeper

NODES = np.arange(-2, 4)
COARSE = 1.0
"""With it the error of a kink is under-estimated by 5 at most nine times in ten, that of a wave never."""
LARGEST = np.array([0.0119, 0.1002, 1.0, 1.0, 0.1002, 0.0119])
"""Largest weights of the nodes."""
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


def lines(dimensions: int) -> tuple[IntArray, FloatArray]:
    """Places in the stencil of the nodes along each of its lines (m, 6), and the largest weights of the lines (m,).

    Those of the cell's own sides come with weight 1.
    """
    every = np.arange(len(NODES) ** dimensions).reshape((len(NODES),) * dimensions)
    if dimensions == 1:
        return every[None], np.ones(1)
    return np.concatenate([every, every.T]), np.tile(LARGEST, 2)


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


class Between(ABC):
    """Results of incidences, interpolated where that is good enough; called as a `Sweeper` is.

    Parameters
    ----------
    flow : PhaseMap or DirectFlow
    request : SweepRequest
        With an accuracy and a lattice.
    """

    def __init__(self, flow: Flow, request: SweepRequest) -> None:
        assert request.lattice is not None and request.accuracy is not None
        self.flow, self.request = flow, request
        self._lattice, self._accuracy = request.lattice, request.accuracy
        self._direct = Sweeper(flow, request)

    @property
    def body(self) -> Surface:
        """Body of the flow."""
        return self.flow.body

    def __call__(self, incidences: FloatArray) -> Arrays:
        """Arrays of results of unit directions (n, 3)."""
        incidences = np.asarray(incidences, dtype=float)
        out, left = self.request.empty(len(incidences)), np.arange(len(incidences))
        self._begin()
        for level in range(self._lattice.first, self._lattice.levels):
            if len(left):
                left = left[self._level(level, incidences, left, out) == 1]
        if len(left):
            for name, values in self._direct(incidences[left]).items():
                out[name][left] = values
        return out

    def left(self, level: int, incidences: FloatArray) -> FloatArray:
        """Share of each of the incidences (n, 3) that a level leaves to be computed, 1 of what it does not give."""
        return self._level(level, incidences, np.arange(len(incidences)), self.request.empty(len(incidences)))

    @abstractmethod
    def _begin(self) -> None:
        """Make room for nodes, where there are too many of earlier calls."""

    @abstractmethod
    def _level(self, level: int, incidences: FloatArray, rows: IntArray, out: Arrays) -> FloatArray:
        """Fill the results of those rows that the level gives; returns the shares that are computed, 1 of others."""


def by_cell(
    lattice: Lattice, level: int, directions: FloatArray
) -> tuple[IntArray, IntArray, list[IntArray], FloatArray]:
    """Cells that hold unit directions (n, 3), the cell of each (n,), those of each cell, and their places in it."""
    cell, places = lattice.located(directions, level)
    own, which = np.unique(cell, axis=0, return_inverse=True)
    which = which.reshape(-1)
    order = np.argsort(which, kind="stable")
    return own, which, np.split(order, np.cumsum(np.bincount(which))[:-1]), places
