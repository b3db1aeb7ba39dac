"""Fields of many incidences on a body without rays: its integral equation, solved for all of them together."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.errors import InvalidInputError
from creeping.field.boundary import parse_boundary
from creeping.field.equation.kept import ASKED, too_much
from creeping.field.equation.solving import solve
from creeping.geodesics.integrator import ErrorEstimate
from creeping.geometry.arguments import rays_refused
from creeping.shadow.status import OK
from creeping.sweeping.field_arrays import FieldArrays
from creeping.sweeping.request import SweepRequest


@dataclass(frozen=True, eq=False)
class NoFlow:
    """In place of a flow for a body without rays: it knows the body, and carries nothing."""

    body: Any

    @property
    def horizon(self) -> float:
        """As of flows."""
        return 1.0

    @property
    def error(self) -> ErrorEstimate | None:
        """As of flows."""
        return None

    def transport(self, states: FloatArray, times: FloatArray) -> FloatArray:
        """There is nothing to carry.

        Raises
        ------
        InvalidInputError
        """
        raise InvalidInputError(rays_refused(self.body))


class SolvedSweeper:
    """Results of incidences, as `creeping.sweeping.sweeper.Sweeper` gives them, for a body without rays.

    Parameters
    ----------
    flow : NoFlow
    request : SweepRequest

    Raises
    ------
    InvalidInputError
        If rays are asked for.
    """

    def __init__(self, flow: NoFlow, request: SweepRequest) -> None:
        if request.quantity == "rays" or request.method == "rays" or request.accuracy is not None:
            raise InvalidInputError(rays_refused(flow.body))
        self.flow, self.request = flow, request
        self.passed: Callable[[float], None] = lambda _: None

    def __call__(self, incidences: FloatArray) -> dict[str, np.ndarray[Any, Any]]:
        """Arrays of results of unit directions (n, 3), the first axis the incidence.

        Raises
        ------
        InvalidInputError
            If the equation of one incidence takes too long or too much memory.
        """
        request, body = self.request, self.flow.body
        d = np.asarray(incidences, dtype=float)
        out = request.empty(len(d))
        out["incidence_status"][:] = OK
        bistatic, done = request.quantity == "bistatic", 0
        for k, wavenumber in enumerate(request.wavenumbers):
            for name, which, suffix in request.problems:
                boundary = parse_boundary(name)
                if why := too_much(body, wavenumber, boundary, ASKED):
                    raise InvalidInputError(
                        f"the integral equation is not solved at wavenumber {wavenumber:g}: {why}; give a lower "
                        "frequency, or a coarser mesh"
                    )
                solution = solve(body, d, wavenumber=wavenumber, boundary=boundary, seconds=np.inf)
                for row in range(len(d)):
                    observers = np.array(request.observation) if bistatic else -d[row : row + 1]
                    field = FieldArrays.of(solution.far_field(observers, row), 1)
                    for part, values in field.arrays.items():
                        if part + suffix in out:
                            out[part + suffix][(row, *which, k)] = values[0] if bistatic else values[0, 0]
                    done += 1
                    self.passed(done / (len(d) * len(request.problems) * len(request.wavenumbers)))
        return out
