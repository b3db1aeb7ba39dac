"""Whether interpolation between incidences on the sphere pays, and from which level on.

Some of the cells that hold the incidences of a study are tried, at its finest level and, if any serves, at the coarser
ones. In terms of what computing an incidence costs, with c incidences in a cell of a level, one that goes from level l
on costs

    sum over levels from l to the first that serves of MARGIN NODE/c, and then EACH, or 1 if none serves

The least mean over those tried decides: levels before l
are left out, and all of them if it is no less than PAYS. It follows from the whole set of incidences and from what is
asked of them, never from a clock, so that every task of a study, wherever it runs, has the same nodes.

Also here: what computes a sweep: each incidence by itself, or some between others.

Sources: Derivations, F23.
"""

from dataclasses import replace

import numpy as np

from creeping._typing import FloatArray
from creeping.geometry.piecewise import is_piecewise
from creeping.rays.transport import Flow
from creeping.sweeping.between.fields import FieldsBetween
from creeping.sweeping.lattice import Lattice
from creeping.sweeping.request import SweepRequest, with_lattice
from creeping.sweeping.solved_fields import NoFlow, SolvedSweeper
from creeping.sweeping.sweeper import Sweeper
from creeping.sweeping.t_matrix_fields import TMatrixSweeper

FEWEST, MOST, SHARE = 2, 12, 2000
"""Cells that are tried: at least, at most, and incidences for each."""
MARGIN = 1.2
"""Nodes of a cell: those at the ends of a task serve the next one, too."""
NODE, EACH = 1.6, 0.15
"""What a node with the judging of its cell and an interpolated incidence cost."""
PAYS = 0.95


def with_paying_lattice(flow: Flow, request: SweepRequest, incidences: FloatArray) -> SweepRequest:
    """The request with the lattice that pays for unit directions (n, 3), if one does."""
    request = with_lattice(request, incidences)
    lattice = request.lattice
    if lattice is None or lattice.dimensions == 1:
        return request
    sweeper = sweeper_of(flow, request)
    if isinstance(sweeper, Sweeper | SolvedSweeper | TMatrixSweeper):
        return request
    some = representatives(lattice, incidences)
    left = np.ones((len(some), lattice.levels))
    for level in range(lattice.levels - 1, -1, -1):
        left[:, level] = sweeper.left(level, some)
        if np.all(left[:, level] == 1):
            break
    first = first_level(lattice, left)
    return replace(request, lattice=None if first is None else replace(lattice, first=first))


def representatives(lattice: Lattice, directions: FloatArray) -> FloatArray:
    """Some of unit directions (n, 3), each for as many as any other; their order does not matter."""
    count = int(np.clip(len(directions) // SHARE, FEWEST, MOST))
    cells, _ = lattice.located(directions, lattice.levels - 1)
    order = np.lexsort((*directions.T, *cells.T[::-1]))
    return directions[order[(2 * np.arange(count) + 1) * len(directions) // (2 * count)]]


def first_level(lattice: Lattice, left: FloatArray) -> int | None:
    """Level from which on incidences cost least, by what levels leave of some of them (n, levels); none if none pays.

    Examples
    --------
    >>> lattice = Lattice((), 0.0, 3, 160.0)                         # 160, 40 and 10 in a cell
    >>> first_level(lattice, np.array([[1.0, 0.0, 0.0]])), first_level(lattice, np.ones((1, 3)))
    (1, None)
    """
    costs = []
    for first in range(lattice.levels):
        served = left[:, first:] < 1
        given = served.any(axis=1)
        last = np.where(given, np.argmax(served, axis=1), served.shape[1] - 1)
        nodes = np.cumsum([MARGIN * NODE / lattice.crowded(level) for level in range(first, lattice.levels)])
        costs.append(float(np.mean(nodes[last] + np.where(given, EACH, 1.0))))
    return int(np.argmin(costs)) if min(costs) < PAYS else None


def sweeper_of(flow: Flow, request: SweepRequest) -> Sweeper | FieldsBetween | SolvedSweeper | TMatrixSweeper:
    """What gives the results of unit directions (n, 3); bodies with creases have no rays that all go on."""
    if request.method == "t-matrix":
        return TMatrixSweeper(flow, request)
    if isinstance(flow, NoFlow):
        return SolvedSweeper(flow, request)
    if request.lattice is None or is_piecewise(flow.body):
        return Sweeper(flow, request)
    return FieldsBetween(flow, request)
