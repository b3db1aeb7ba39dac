"""Fields of the incidences of a cut from those of the nodes of a lattice: sheets are interpolated, their waves summed.

    f(d) = sum over sheets of a(d) exp(i k L(d)),   a and L by Lagrange's interpolation at six nodes
    f(t) = sum_j w_j(t) f(x_j),   w_j(t) = prod_{i != j} (t - x_i)/(x_j - x_i),   x = -2 ... 3,  0 <= t < 1

The error of the six is the largest of these differences: to what the first and the last five give, to the inner four,
and between the first and the last four. The five know a smooth function's error to the order before; a kink between the
nodes they may miss, the four do not.

An incidence has its field so at the first level at which

    (sum (|da| + k |dL| |a|)^2)^(1/2) <= A (sum |a|^2)^(1/2)   of all sheets, and with 10 A of the creeping ones,

d being that error, A the accuracy asked for. All sheets of the cell's own node go over into one of each other node of
the stencil, and its corners have no others: none begins or ends. What fails at all levels is computed. Errors are the
largest of the corners, and in squares with them the stated one of interpolation, SAFE times the sum of |da| + k |dL|
|a| and NOISE times (sum |a|^2)^(1/2).

Sheets of neighbouring nodes go over into each other that are nearest to each other, both ways.

Sources: [AS64, sec. 25.2]; Derivations, F23.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from creeping._typing import Any, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.field.waves.far_geometry import FarGeometry
from creeping.field.waves.far_rays import Parts, isolated, sheets_of
from creeping.rays.transport import Flow
from creeping.shadow.status import LineStatus
from creeping.sweeping.lattice import FINER, Lattice
from creeping.sweeping.request import LINE, SHARES, VALID, SweepRequest
from creeping.sweeping.sweeper import Arrays, FieldArrays, Passed, Sweeper

NODES = np.arange(-2, 4)
"""Nodes of a stencil, from that of its cell."""
BASE = 2
"""Place of the cell's own node, x = 0, among them."""
SAFE, NOISE = 2.0, 1e-5
"""Stated error over the differences, and what the flow and the searches for rays leave, over the sheets' sizes; both
set on six bodies."""
NEAR = 12.0
"""Largest distance of neighbouring sheets, in body sizes and steps of the lattice."""


def weights(places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Weights (n, 6) of the nodes of a stencil for places (n,) in its cell, and those of its errors (4, n, 6).

    Examples
    --------
    >>> six, errors = weights(np.array([0.25]))
    >>> bool(np.isclose((six @ NODES.astype(float) ** 5)[0], 0.25**5))
    True
    >>> [bool(np.isclose((one @ NODES.astype(float) ** 3)[0], 0)) for one in errors]
    [True, True, True, True]
    """
    six = _lagrange(places, slice(0, 6))
    fewer = [_lagrange(places, some) for some in (slice(0, 5), slice(1, 6), slice(1, 5), slice(0, 4), slice(2, 6))]
    return six, np.stack([*(six - one for one in fewer[:3]), fewer[3] - fewer[4]])


def _lagrange(place: FloatArray, some: slice) -> FloatArray:
    """Weights (n, 6) of some of the nodes, 0 of the others."""
    out, nodes = np.zeros((len(place), len(NODES))), NODES[some]
    for j, own in zip(range(len(NODES))[some], nodes, strict=True):
        out[:, j] = np.prod([(place - other) / (own - other) for other in nodes if other != own], axis=0)
    return out


def sheet_sums(
    amplitudes: ComplexArray,
    paths: FloatArray,
    label: IntArray,
    six: FloatArray,
    errors: FloatArray,
    wavenumbers: FloatArray,
    kinds: int,
) -> tuple[ComplexArray, FloatArray, FloatArray, FloatArray]:
    """Sums over the sheets of each kind for n incidences, (n, kinds, columns): f, sum e, sum e^2 and sum |a|^2.

    e = max over the errors' weights v of |sum_j v_j a_j| + k |a| |sum_j v_j L_j|. An incidence has the same in whatever
    company: nodes and sheets are added one after the other.

    Parameters
    ----------
    amplitudes : (sheets, 6, columns)
        a_j.
    paths : (sheets, 6)
        L_j.
    label : (sheets,) of int
        Kind of each sheet.
    six, errors : (n, 6), (several, n, 6)
    wavenumbers : (columns,)
    """
    shape = len(six), kinds, len(wavenumbers)
    # (1 + several, n, sheets, columns), nodes added one after the other
    every = np.concatenate([six[None], errors])[..., None, None]
    wave: ComplexArray = every[:, :, 0] * amplitudes[:, 0]
    length: FloatArray = every[:, :, 0] * paths[:, :1]
    for j in range(1, len(NODES)):
        wave += every[:, :, j] * amplitudes[:, j]
        length += every[:, :, j] * paths[:, j, None]
    size = np.abs(wave)
    off = np.max(size[1:] + size[0] * np.abs(length[1:]) * wavenumbers, axis=0, initial=0.0)
    wave = wave[0] * np.exp(1j * wavenumbers * length[0])
    fields, parts = np.zeros(shape, dtype=complex), np.zeros((3, *shape))
    for sheet, kind in enumerate(label):
        fields[:, kind] += wave[:, sheet]
        parts[:, :, kind] += [off[:, sheet], off[:, sheet] ** 2, size[0, :, sheet] ** 2]
    return fields, parts[0], parts[1], parts[2]


def links(
    begin: IntArray, count: IntArray, label: IntArray, key: FloatArray, pairs: IntArray, step: float
) -> tuple[IntArray, IntArray]:
    """Sheet that continues each one at the next node, and the inverse: (sheets,) each, -1 where there is none.

    Parameters
    ----------
    begin, count : (nodes,)
        First sheet of each node, and how many there are.
    label : (sheets,)
        Only sheets of one label are alike.
    key : (sheets, 4)
    pairs : (pairs, 2)
        Nodes and their next ones.
    step : float
        Angle between neighbouring nodes.
    """
    after, before = np.full(len(label), -1), np.full(len(label), -1)
    first, second = pairs.T
    # every sheet of the first node with every one of the second
    sizes = count[first] * count[second]
    pair = np.repeat(np.arange(len(pairs)), sizes)
    number = np.arange(len(pair)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    across = np.maximum(count[second][pair], 1)
    one, two = begin[first][pair] + number // across, begin[second][pair] + number % across
    alike = label[one] == label[two]
    one, two = one[alike], two[alike]
    apart = np.linalg.norm(key[one] - key[two], axis=1)
    near = apart < NEAR * step
    one, two, apart = one[near], two[near], apart[near]
    nearest = _is_least(one, apart) & _is_least(two, apart)
    after[one[nearest]], before[two[nearest]] = two[nearest], one[nearest]
    return after, before


def _is_least(group: IntArray, value: FloatArray) -> BoolArray:
    """Whether a value is the least of its group (n,)."""
    order = np.lexsort((value, group))
    least = np.zeros(len(group), dtype=bool)
    first = np.ones(len(group), dtype=bool)
    first[1:] = group[order][1:] != group[order][:-1]
    least[order[first]] = True
    return least


def chains(start: IntArray, after: IntArray, before: IntArray) -> IntArray:
    """Sheets (n, 6) that continue ``start`` (n,) at the nodes of the stencil, -1 where none does; see `links`."""
    out = np.empty((len(start), len(NODES)), dtype=np.int64)
    out[:, BASE] = start
    for place in range(BASE + 1, len(NODES)):
        out[:, place] = np.where(out[:, place - 1] >= 0, after[out[:, place - 1]], -1)
    for place in range(BASE - 1, -1, -1):
        out[:, place] = np.where(out[:, place + 1] >= 0, before[out[:, place + 1]], -1)
    return out


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
        As of `creeping.field.waves.far_rays.Sheets`.
    """

    def __init__(self, sweeper: Sweeper, lattice: Lattice) -> None:
        self._sweeper, self._lattice = sweeper, lattice
        self._known: dict[int, int] = {}
        self.results: Arrays = sweeper.request.empty(0)
        # whether the field of a node is that of its sheets, the first of these, and how many there are
        self._whole = np.zeros(0, dtype=bool)
        self._begin, self._count = np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
        self.label, self._key = np.zeros(0, dtype=np.int64), np.zeros((0, 4))
        self.path: FloatArray = np.zeros(0)
        self.amplitudes: ComplexArray | None = None

    def cells(self, level: int, own: IntArray) -> tuple[IntArray, list[IntArray | None]]:
        """Nodes (n, 6) and sheets of the stencils of cells of a level, by the numbers of their own nodes (n,).

        Sheets (m, 6) at all nodes are None where a node has no field that is the sum of its sheets, or sheets begin or
        end.
        """
        lattice = self._lattice
        numbers, place = np.unique(lattice.wrapped(own[:, None] + NODES, level), return_inverse=True)
        nodes = self._at(level, numbers)
        stencil = nodes[place.reshape(len(own), -1)]
        at = np.searchsorted(numbers, lattice.wrapped(numbers + 1, level)) % len(numbers)
        there = numbers[at] == lattice.wrapped(numbers + 1, level)
        pairs = np.stack([nodes, nodes[at]], axis=1)[there]
        after, before = links(self._begin, self._count, self.label, self._key, pairs, lattice.spacing(level))
        counts = self._count[stencil[:, BASE : BASE + 2]]
        curves = self.results["curves"][stencil]
        served = np.all(self._whole[stencil], axis=1) & (counts[:, 0] == counts[:, 1])
        served &= np.all(curves == curves[:, :1], axis=1)
        found: list[IntArray | None] = [None] * len(own)
        for cell in np.flatnonzero(served):
            first = self._begin[stencil[cell, BASE]]
            chain = chains(np.arange(first, first + counts[cell, 0]), after, before)
            if np.all(chain >= 0):
                found[cell] = chain
        return stencil, found

    def _at(self, level: int, numbers: IntArray) -> IntArray:
        """Nodes of a level by their numbers (n,): (n,)."""
        keys = (numbers * FINER ** (self._lattice.levels - 1 - level)).tolist()
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


class FieldsBetween:
    """Fields of incidences, interpolated where that is good enough; called as a `Sweeper` is.

    Incidences go from level to level, and what none gives is computed.

    Parameters
    ----------
    flow : PhaseMap or DirectFlow
    request : SweepRequest
        With an accuracy and a lattice.
    """

    def __init__(self, flow: Flow, request: SweepRequest) -> None:
        assert request.lattice is not None and request.accuracy is not None
        self.flow, self.request = flow, request
        self.passed: Passed = lambda _: None
        self.store: Path | None = None
        self._lattice, self._accuracy = request.lattice, request.accuracy
        self._direct = Sweeper(flow, request)
        self._plain = Sweeper(flow, replace(request, method="rays"))
        self._nodes = Nodes(self._plain, self._lattice)
        # columns of amplitudes: the components of one boundary and wavenumber after the other
        widths = [4 if name == "pec" else 1 for name, _, _ in request.problems for _ in request.wavenumbers]
        self._first = np.cumsum(widths) - np.array(widths)
        self._many = max(1, len(request.observation))
        self._wavenumbers = np.repeat(np.tile(request.wavenumbers, len(request.problems)), widths)

    def __call__(self, incidences: FloatArray) -> Arrays:
        """Arrays of results of unit directions (n, 3)."""
        incidences = np.asarray(incidences, dtype=float)
        out, left = self.request.empty(len(incidences)), np.arange(len(incidences))
        for level in range(self._lattice.levels):
            if len(left):
                left = left[~self._level(level, incidences[left], left, out)]
        if len(left):
            for name, values in self._direct(incidences[left]).items():
                out[name][left] = values
        return out

    def _level(self, level: int, incidences: FloatArray, rows: IntArray, out: Arrays) -> BoolArray:
        """Fill the rows (n,) of incidences (n, 3) that a level interpolates: which of them those are (n,)."""
        nodes = self._nodes
        number, places = self._lattice.located(incidences, level)
        own, which = np.unique(number, return_inverse=True)
        members = np.split(np.argsort(which, kind="stable"), np.cumsum(np.bincount(which))[:-1])
        stencils, chains = nodes.cells(level, own)
        six, errors = weights(places)
        stencil = stencils[which]
        lengths = nodes.results["line_length"][stencil].T
        # nodes are added one after the other: an incidence has the same in whatever company
        length, *off = (np.asarray(sum(w.T * lengths)) for w in (six, *errors))
        # of a line that is not there it is not known
        passed = np.max(np.abs(off), axis=0) <= self._accuracy * length
        shape = len(rows), self._many, 2, len(self._wavenumbers)
        fields, differences = np.zeros(shape, dtype=complex), np.zeros(shape)
        for chain, mine in zip(chains, members, strict=True):
            if chain is None:
                passed[mine] = False
            else:
                fields[mine], differences[mine], good = self._summed(nodes, chain, six[mine], errors[:, mine])
                passed[mine] &= good
        inside = stencil[:, BASE : BASE + 2]
        problems = list(self._problems(nodes.results, inside, fields, differences))
        if self.request.method == "auto":
            for _, _, arrays in problems:
                passed[FieldArrays(arrays).unclear] = False
        # of those that have passed, from the corners of their cells and the sums
        done, some = np.flatnonzero(passed), rows[passed]
        known = {name: nodes.results[name][inside[done]] for name in (*LINE, *VALID)}
        out["incidence_status"][some] = np.where(
            np.any(known["incidence_status"] == LineStatus.FOLLOWED, axis=1), LineStatus.FOLLOWED, LineStatus.OK
        )
        out["curves"][some], out["line_length"][some] = known["curves"][:, 0], length[done]
        out["line_error"][some] = known["line_error"].max(axis=1)
        out["singular_distance"][some] = known["singular_distance"].min(axis=1)
        for name in SHARES:
            first, second = known[name].T
            out[name][some] = (1 - places[done]) * first + places[done] * second
        for name, worst in zip(VALID, (np.min, np.max), strict=True):
            out[name][some] = worst(known[name], axis=1)
        out["interpolated"][some] = True
        for numbers, suffix, arrays in problems:
            at: Any = (some, *numbers)
            for name, values in arrays.items():
                if name + suffix in out:
                    # one observer is no axis of "monostatic"
                    out[name + suffix][at] = values[done] if self.request.observation else values[done, 0]
        return np.asarray(passed)

    def _summed(
        self, nodes: Nodes, chain: IntArray, six: FloatArray, errors: FloatArray
    ) -> tuple[Any, FloatArray, BoolArray]:
        """Fields (n, m, 2, columns) of reflected and of creeping sheets, their differences, and who passes (n,)."""
        none: ComplexArray = np.zeros((0, 1), dtype=complex)
        amplitudes = none if nodes.amplitudes is None else nodes.amplitudes
        label, kinds = nodes.label[chain[:, 0]], 2 * self._many
        sums = sheet_sums(amplitudes[chain], nodes.path[chain], label, six, errors, self._wavenumbers, kinds)
        fields, differences, squares, sizes = (one.reshape(len(six), self._many, 2, -1) for one in sums)
        differences = SAFE * differences + NOISE * np.sqrt(sizes)
        # of a conductor's components together
        squares, sizes = (np.add.reduceat(each, self._first, axis=-1) for each in (squares, sizes))
        whole = squares[:, :, 0] + squares[:, :, 1] <= self._accuracy**2 * (sizes[:, :, 0] + sizes[:, :, 1])
        # the creeping part may err by ten times as much of its own size
        creeping = squares[:, :, 1] <= (10.0 * self._accuracy) ** 2 * sizes[:, :, 1]
        return fields, np.asarray(differences), np.all(whole & creeping, axis=(1, 2))

    def _problems(
        self, results: Arrays, inside: IntArray, fields: Any, differences: FloatArray
    ) -> Iterator[tuple[tuple[int, ...], str, Arrays]]:
        """What was summed, by boundary and wavenumber, with the errors and flags of the corners.

        Each with its place in arrays of results, after the incidence, and the suffix of their names.
        """
        request, n = self.request, len(fields)
        numbers = [(*which, k) for _, which, _ in request.problems for k in range(len(request.wavenumbers))]
        suffixes = np.repeat([suffix for _, _, suffix in request.problems], len(request.wavenumbers))
        columns = zip(self._first, [*self._first[1:], len(self._wavenumbers)], strict=True)
        for which, suffix, (first, last) in zip(numbers, suffixes.tolist(), columns, strict=True):
            shape = (n, self._many, 2, 2) if suffix else (n, self._many)
            reflected, creeping = (fields[:, :, part, first:last].reshape(shape) for part in (0, 1))
            difference = (differences[:, :, 0, first:last] + differences[:, :, 1, first:last]).reshape(shape)
            error, unresolved = (results[name + suffix][(inside, *which)] for name in ("error", "unresolved"))
            yield (
                which,
                suffix,
                {
                    "total": reflected + creeping,
                    "creeping": creeping,
                    "reflected": reflected,
                    "forward": np.zeros(shape, dtype=complex),
                    "error": np.hypot(error.max(axis=1).reshape(shape), difference),
                    "interpolation_error": difference,
                    "unresolved": unresolved.any(axis=1).reshape(n, self._many),
                    "by_currents": np.zeros((n, self._many), dtype=bool),
                },
            )
