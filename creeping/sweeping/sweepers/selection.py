"""What computes the results of incidences: the compiled route where the body allows it, else the plain one."""

from typing import Protocol

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.geodesics.equations import natural_horizon
from creeping.geodesics.integrator import compiled_parts
from creeping.geometry.speed import speed_of
from creeping.geometry.surface import Surface
from creeping.rays.transport import Flow
from creeping.sweeping.request import SweepRequest
from creeping.sweeping.sweepers.compiled import CompiledSweeper
from creeping.sweeping.sweepers.plain import PlainSweeper


class Sweeper(Protocol):
    """Computes the results of incidences."""

    request: SweepRequest

    @property
    def body(self) -> Surface:
        """Body of the flow."""
        ...

    def __call__(self, incidences: FloatArray) -> dict[str, np.ndarray[Any, Any]]:
        """Arrays of results of unit directions (n, 3), the first axis the incidence; see `SweepRequest.variables`.

        The same call gives the same bits. Lines and rays of an incidence do not depend on the others in the call, its
        fields by 1e-7 of themselves.
        """
        ...


def sweeper_of(flow: Flow, request: SweepRequest) -> Sweeper:
    """Make what computes a request with a flow."""
    return CompiledSweeper(flow, request) if _is_compiled(flow.body, request) else PlainSweeper(flow, request)


def outputs_of(body: Surface, request: SweepRequest) -> int:
    """Equal steps of the rays at which a request needs them: what a flow for it is to be tuned for."""
    if request.quantity == "rays":
        return request.n_steps
    if _is_compiled(body, request):
        return int(np.ceil(request.length / natural_horizon(body) - 1e-9))
    # as many as a fan has at least
    return 64


def _is_compiled(body: Surface, request: SweepRequest) -> bool:
    # a weighted body has no field: the plain route says so
    plain = request.quantity == "bistatic" or (request.quantity == "monostatic" and speed_of(body) is not None)
    return not plain and compiled_parts(body) is not None
