"""Fields of incidences from those of the nodes of a lattice: sheets are interpolated, their waves summed.

    f(d) = sum over sheets of a(d) exp(i k L(d)),   a and L by six nodes along each axis

An incidence has its field so at the first level at which

    (sum (|da| + k |dL| |a|)^2)^(1/2) <= A (sum |a|^2)^(1/2)   of all sheets, and with 10 A of the creeping ones,

d being the error of `stencil`, A the accuracy asked for. All sheets of the cell's own node go over into one of each
other node of the stencil, and its corners have no others: none begins or ends. What fails at all levels is computed.
Errors are the largest of the corners, and in squares with them the stated one of interpolation, SAFE times the sum of
|da| + k |dL| |a| and NOISE times (sum |a|^2)^(1/2).

Sources: Derivations, F23.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.rays.transport import Flow
from creeping.shadow.status import FOLLOWED, OK
from creeping.sweeping.between.levels import Between, by_cell
from creeping.sweeping.between.nodes import Nodes
from creeping.sweeping.between.stencil import corner_weights, corners, totals, weights
from creeping.sweeping.field_arrays import FieldArrays
from creeping.sweeping.request import LINE, SHARES, VALID, SweepRequest
from creeping.sweeping.sweeper import Arrays, Sweeper

MOST_NODES = 20_000
"""Nodes that are kept from one call to the next."""
SAFE, NOISE = 2.0, 1e-5
"""Stated error over that of `stencil`, and what the flow and the searches for rays leave, over the sheets' sizes; both
set on six bodies."""
OF_CREEPING = 10.0
"""Error allowed to the creeping part, of its own size, over that allowed to the whole field."""


class Problem(NamedTuple):
    """Results of one boundary and wavenumber.

    Attributes
    ----------
    which : tuple of int
        Its place in arrays of results, after the incidence.
    suffix : str
        Of their names.
    difference : (n, m) or (n, m, 2, 2), L
        Error of the interpolation.
    arrays : dict
        As of `FieldArrays`.
    """

    which: tuple[int, ...]
    suffix: str
    difference: FloatArray
    arrays: Arrays


class FieldsBetween(Between):
    """Fields of incidences; see `Between`."""

    def __init__(self, flow: Flow, request: SweepRequest) -> None:
        super().__init__(flow, request)
        self._plain = Sweeper(flow, replace(request, method="rays"))
        self._nodes = Nodes(self._plain, self._lattice)
        # columns of amplitudes: the components of one boundary and wavenumber after the other
        widths = [4 if name == "pec" else 1 for name, _, _ in request.problems for _ in request.wavenumbers]
        self._first = np.cumsum(widths) - np.array(widths)
        self._many = max(1, len(request.observation))
        self._wavenumbers = np.repeat(np.tile(request.wavenumbers, len(request.problems)), widths)

    def _begin(self) -> None:
        if len(self._nodes) > MOST_NODES:
            self._nodes = Nodes(self._plain, self._lattice)

    def _level(self, level: int, incidences: FloatArray, rows: IntArray, out: Arrays) -> FloatArray:
        nodes = self._nodes
        own, which, members, places = by_cell(self._lattice, level, incidences[rows])
        cells = nodes.cells(level, own)
        six, errors = weights(places)
        stencil = cells.stencil[which]
        lengths = nodes.results["line_length"][stencil].T
        length, *off = (totals(w.T * lengths) for w in (six, *errors))
        # of a line that is not there it is not known
        passed = np.max(np.abs(off), axis=0) <= self._accuracy * length
        shape = len(rows), self._many, 2, len(self._wavenumbers)
        fields, differences = np.zeros(shape, dtype=complex), np.zeros(shape)
        for chain, mine in zip(cells.chains, members, strict=True):
            if chain is None:
                passed[mine] = False
            else:
                fields[mine], differences[mine], good = self._summed(nodes, chain, six[mine], [w[mine] for w in errors])
                passed[mine] &= good
        inside = stencil[:, corners(self._lattice.dimensions)]
        problems = list(self._problems(nodes.results, inside, fields, differences))
        if self.request.method == "auto":
            for problem in problems:
                passed[FieldArrays(problem.arrays).unclear] = False
        self._write(nodes.results, inside, places, length, problems, rows, passed, out)
        return np.where(passed, 0.0, 1.0)

    def _write(
        self,
        results: Arrays,
        inside: IntArray,
        places: FloatArray,
        length: FloatArray,
        problems: list[Problem],
        rows: IntArray,
        passed: BoolArray,
        out: Arrays,
    ) -> None:
        """Results of the rows (n,) that have passed, from the corners of their cells (n, 2^dimensions) and the sums."""
        done, some = np.flatnonzero(passed), rows[passed]
        known = {name: results[name][inside[done]] for name in (*LINE, *VALID)}
        out["incidence_status"][some] = np.where(np.any(known["incidence_status"] == FOLLOWED, axis=1), FOLLOWED, OK)
        out["curves"][some], out["line_length"][some] = known["curves"][:, 0], length[done]
        out["line_error"][some] = known["line_error"].max(axis=1)
        out["singular_distance"][some] = known["singular_distance"].min(axis=1)
        near = corner_weights(places[done])
        for name in SHARES:
            out[name][some] = totals(near.T * known[name].T)
        for name, worst in zip(VALID, (np.min, np.max), strict=True):
            out[name][some] = worst(known[name], axis=1)
        out["interpolated"][some] = True
        for problem in problems:
            at: Any = (some, *problem.which)
            for name, values in (problem.arrays | {"interpolation_error": problem.difference}).items():
                if name + problem.suffix in out:
                    # one observer is no axis of "monostatic"
                    out[name + problem.suffix][at] = values[done] if self.request.observation else values[done, 0]

    def _summed(
        self, nodes: Nodes, chain: IntArray, six: FloatArray, errors: list[FloatArray]
    ) -> tuple[Any, FloatArray, BoolArray]:
        """Fields (n, m, 2, columns) of reflected and of creeping sheets, their differences, and who passes (n,)."""
        from creeping.sweeping.kernels.sheet_sums import ERROR, IMAGINARY, REAL, SIZE, SQUARE, SUMS, sheet_sums

        k, amplitudes = self._wavenumbers, np.zeros((0, 1)) if nodes.amplitudes is None else nodes.amplitudes
        sheets, label = amplitudes[chain], nodes.label[chain[:, 0]]
        parts = np.stack([sheets.real, sheets.imag], axis=2)
        out = np.zeros((len(six), 2 * self._many, SUMS, len(k)))
        sheet_sums(parts, nodes.path[chain], label, six, np.stack(errors), k, out)
        out = out.reshape(len(six), self._many, 2, SUMS, len(k))
        fields = out[..., REAL, :] + 1j * out[..., IMAGINARY, :]
        differences, squares, sizes = (out[..., which, :] for which in (ERROR, SQUARE, SIZE))
        differences = SAFE * differences + NOISE * np.sqrt(sizes)
        # of a conductor's components together
        squares, sizes = (np.add.reduceat(each, self._first, axis=-1) for each in (squares, sizes))
        whole = squares[:, :, 0] + squares[:, :, 1] <= self._accuracy**2 * (sizes[:, :, 0] + sizes[:, :, 1])
        creeping = squares[:, :, 1] <= (OF_CREEPING * self._accuracy) ** 2 * sizes[:, :, 1]
        return fields, differences, np.all(whole & creeping, axis=(1, 2))

    def _problems(self, results: Arrays, inside: IntArray, fields: Any, differences: FloatArray) -> Iterator[Problem]:
        """What was summed, by boundary and wavenumber, with the errors and flags of the corners."""
        request, n = self.request, len(fields)
        numbers = [(*which, k) for _, which, _ in request.problems for k in range(len(request.wavenumbers))]
        suffixes = np.repeat([suffix for _, _, suffix in request.problems], len(request.wavenumbers))
        columns = zip(self._first, [*self._first[1:], len(self._wavenumbers)], strict=True)
        for which, suffix, (first, last) in zip(numbers, suffixes.tolist(), columns, strict=True):
            shape = (n, self._many, 2, 2) if suffix else (n, self._many)
            reflected, creeping = (fields[:, :, part, first:last].reshape(shape) for part in (0, 1))
            difference = (differences[:, :, 0, first:last] + differences[:, :, 1, first:last]).reshape(shape)
            error, unresolved = (results[name + suffix][(inside, *which)] for name in ("error", "unresolved"))
            arrays = {"total": reflected + creeping, "creeping": creeping, "reflected": reflected}
            arrays["forward"] = np.zeros(shape, dtype=complex)
            arrays["error"] = np.hypot(error.max(axis=1).reshape(shape), difference)
            arrays["unresolved"] = unresolved.any(axis=1).reshape(n, self._many)
            arrays["by_currents"] = np.zeros((n, self._many), dtype=bool)
            yield Problem(which, suffix, difference, arrays)
