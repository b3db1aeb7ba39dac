"""What interpolated rays and fields share: incidences go from level to level, and what none gives is computed."""

from abc import ABC, abstractmethod

import numpy as np

from creeping._typing import FloatArray, IntArray
from creeping.geometry.surface import Surface
from creeping.rays.transport import Flow
from creeping.sweeping.lattice import Lattice
from creeping.sweeping.request import SweepRequest
from creeping.sweeping.sweeper import Arrays, Sweeper


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
