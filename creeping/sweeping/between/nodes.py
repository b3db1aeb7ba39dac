"""Nodes of a lattice: their results and their sheets, and the sheets of neighbours that go over into each other."""

from typing import NamedTuple

import numpy as np

from creeping._typing import Any, ComplexArray, FloatArray, IntArray
from creeping.field.far_geometry import FarGeometry
from creeping.field.far_rays import Parts
from creeping.field.sheets import isolated, sheets_of
from creeping.sweeping.between.matching import chains, links
from creeping.sweeping.between.stencil import BASE, NODES, around, corners, offsets
from creeping.sweeping.lattice import FINER, Lattice
from creeping.sweeping.sweeper import Arrays, Sweeper


class Cells(NamedTuple):
    """Cells of one level with the nodes of their stencils.

    Attributes
    ----------
    stencil : (cells, 6^dimensions) of int
        Nodes of each cell.
    chains : list of (n, 6^dimensions) or None
        Of each cell its sheets at all nodes; None where a node has no field that is the sum of its sheets, or sheets
        begin or end.
    """

    stencil: IntArray
    chains: list[IntArray | None]


class Nodes:
    """Nodes of a lattice, each computed once, whatever levels it belongs to.

    Parameters
    ----------
    sweeper : Sweeper
        Of fields by rays.
    lattice : Lattice

    Attributes
    ----------
    results : dict
        Arrays of results.
    label : (sheets,)
        Twice the number of the observer, and 1 more for creeping rays.
    path : (sheets,), L
    amplitudes : (sheets, problems), L
        As of `creeping.field.sheets.Sheets`.
    """

    def __init__(self, sweeper: Sweeper, lattice: Lattice) -> None:
        self._sweeper, self._lattice = sweeper, lattice
        self._known: dict[tuple[int, ...], int] = {}
        self.results: Arrays = sweeper.request.empty(0)
        # whether the field of a node is that of its sheets, the first of these, and how many there are
        self._whole = np.zeros(0, dtype=bool)
        self._begin, self._count = np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
        self.label, self._key = np.zeros(0, dtype=np.int64), np.zeros((0, 4))
        self.path: FloatArray = np.zeros(0)
        self.amplitudes: ComplexArray | None = None

    def __len__(self) -> int:
        return len(self._known)

    def cells(self, level: int, own: IntArray) -> Cells:
        """Cells of a level, (n, 1 + dimensions) the face and the number of their own node."""
        lattice = self._lattice
        steps = offsets(lattice.dimensions)
        numbers = lattice.wrapped(around(own).reshape(-1, own.shape[1]), level)
        numbers, place = np.unique(numbers, axis=0, return_inverse=True)
        nodes = self._at(level, numbers)
        stencil = nodes[place.reshape(len(own), -1)]
        both = [
            links(self._begin, self._count, self.label, self._key, nodes[pairs], lattice.spacing(level))
            for pairs in _neighbours(lattice, level, numbers)
        ]
        after, before = [one for one, _ in both], [other for _, other in both]
        base = np.flatnonzero(np.all(steps == 0, axis=1))[0]
        counts = self._count[stencil[:, corners(lattice.dimensions)]]
        curves = self.results["curves"][stencil]
        served = np.all(self._whole[stencil], axis=1) & np.all(counts == counts[:, :1], axis=1)
        served &= np.all(curves == curves[:, :1], axis=1)
        found: list[IntArray | None] = [None] * len(own)
        for cell in np.flatnonzero(served):
            first = self._begin[stencil[cell, base]]
            chain = chains(np.arange(first, first + counts[cell, 0]), after, before, BASE, len(NODES))
            if np.all(chain >= 0):
                found[cell] = chain
        return Cells(stencil, found)

    def _at(self, level: int, numbers: IntArray) -> IntArray:
        """Nodes of a level by their numbers (n, 1 + dimensions): (n,)."""
        finest = numbers.copy()
        finest[:, 1:] *= FINER ** (self._lattice.levels - 1 - level)
        keys = list(map(tuple, finest.tolist()))
        new = [row for row, key in enumerate(keys) if key not in self._known]
        if new:
            first = len(self._known)
            self._known |= {keys[row]: first + place for place, row in enumerate(new)}
            self._compute(self._lattice.directions(numbers[new], level))
        return np.array([self._known[key] for key in keys], dtype=np.int64)

    def _compute(self, directions: FloatArray) -> None:
        """Add nodes of unit directions."""
        whole, count = np.zeros(len(directions), dtype=bool), np.zeros(len(directions), dtype=np.int64)
        pieces: list[tuple[np.ndarray[Any, Any], ...]] = []

        def told(rows: IntArray, geometry: FarGeometry, parts: list[Parts]) -> None:
            sheets, many = sheets_of(geometry, parts), len(geometry.directions) // len(rows)
            of, observer = np.divmod(sheets.observer, many)
            count[rows] = np.bincount(of, minlength=len(rows))
            whole[rows] = np.all(isolated(geometry, parts).reshape(-1, many), axis=1)
            whole[rows[of[~np.all(np.isfinite(sheets.amplitudes), axis=1)]]] = False
            pieces.append((2 * observer + sheets.creeping, sheets.key, sheets.path, sheets.amplitudes))

        results = self._sweeper(directions, told)
        self.results = {name: np.concatenate([values, results[name]]) for name, values in self.results.items()}
        self._whole = np.concatenate([self._whole, whole])
        self._begin = np.concatenate([self._begin, len(self.label) + np.cumsum(count) - count])
        self._count = np.concatenate([self._count, count])
        if pieces:
            label, key, path, amplitudes = zip(*pieces, strict=True)
            self.label, self._key = np.concatenate([self.label, *label]), np.concatenate([self._key, *key])
            self.path = np.concatenate([self.path, *path])
            self.amplitudes = np.concatenate([*([] if self.amplitudes is None else [self.amplitudes]), *amplitudes])


def _neighbours(lattice: Lattice, level: int, nodes: IntArray) -> list[IntArray]:
    """Pairs (n, 2) of nodes and their next ones along each axis."""
    places = {tuple(node): number for number, node in enumerate(nodes.tolist())}
    found = []
    for axis in range(1, nodes.shape[1]):
        moved = nodes.copy()
        moved[:, axis] += 1
        after = [places.get(tuple(node), -1) for node in lattice.wrapped(moved, level).tolist()]
        pairs = np.stack([np.arange(len(nodes)), np.array(after, dtype=np.int64)], axis=1)
        found.append(pairs[pairs[:, 1] >= 0])
    return found
