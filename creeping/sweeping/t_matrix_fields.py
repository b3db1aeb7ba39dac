"""Fields of many incidences by the T-matrix of the body: one for each wavenumber and boundary serves all of them.

A matrix is kept with the body, as far as a share of the memory holds it, so that the tasks of a sweep share it.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.field.boundary import BoundaryLike, parse_boundary
from creeping.field.equation.solving import POOR
from creeping.field.tmatrix.computing import t_matrix
from creeping.field.tmatrix.result import TMatrix
from creeping.geometry.memo import memo
from creeping.geometry.surface import Surface
from creeping.rays.transport import Flow
from creeping.shadow.status import OK
from creeping.storage.memory import budget
from creeping.sweeping.request import SweepRequest
from creeping.sweeping.solved_fields import FieldArrays

SHARE = 0.1
"""Part of the memory that the matrices of a body may take."""


class TMatrixSweeper:
    """Results of incidences, as `creeping.sweeping.sweeper.Sweeper` gives them, by T-matrices of the body.

    Parameters
    ----------
    flow : Flow
        Only its body is asked.
    request : SweepRequest
        Of a field.

    Attributes
    ----------
    store : Path, optional
        Where the matrices are kept.
    """

    def __init__(self, flow: Flow, request: SweepRequest) -> None:
        self.flow, self.request = flow, request
        self.passed: Callable[[float], None] = lambda _: None
        self.store: Path | None = None

    def __call__(self, incidences: FloatArray) -> dict[str, np.ndarray[Any, Any]]:
        """Arrays of results of unit directions (n, 3), the first axis the incidence.

        Raises
        ------
        InvalidInputError
            If a matrix takes too long or too much memory.
        """
        request, d = self.request, np.asarray(incidences, dtype=float)
        out = request.empty(len(d))
        out["incidence_status"][:] = OK
        bistatic, done = request.quantity == "bistatic", 0
        for k, wavenumber in enumerate(request.wavenumbers):
            for name, which, suffix in request.problems:
                T = kept_t_matrix(self.flow.body, wavenumber, parse_boundary(name), self.store)
                found = T.far_fields(d, np.array(request.observation)) if bistatic else [T.backscatter(d)]
                for row, far in enumerate(found):
                    rows: Any = slice(row, row + 1) if bistatic else slice(None)
                    for part, values in FieldArrays.of(far, 1 if bistatic else len(d)).arrays.items():
                        if part + suffix in out:
                            out[part + suffix][(rows, *which, k)] = values if bistatic else values[:, 0]
                # as of currents that are solved one by one
                if not T.extinction <= POOR:
                    every: Any = (slice(None), *which, k)
                    out["unresolved" + suffix][every] = True
                done += 1
                self.passed(done / (len(request.problems) * len(request.wavenumbers)))
        return out


def known_t_matrix(body: Surface, wavenumber: float, boundary: BoundaryLike) -> TMatrix | None:
    """The T-matrix of a body that `kept_t_matrix` has made, if it is still there."""
    known: dict[Any, TMatrix] = memo(body, "T-matrices", dict)
    return known.get((wavenumber, boundary))


def kept_t_matrix(body: Surface, wavenumber: float, boundary: BoundaryLike, store: Path | None = None) -> TMatrix:
    """The T-matrix of a body, made once while there is room for it."""
    known: dict[Any, TMatrix] = memo(body, "T-matrices", dict)
    key = wavenumber, boundary
    if key not in known:
        made = t_matrix(body, wavenumber=wavenumber, boundary=boundary, store=store)
        while known and sum(one.matrix.nbytes for one in (made, *known.values())) > SHARE * budget():
            known.pop(next(iter(known)))
        known[key] = made
    return known[key]
