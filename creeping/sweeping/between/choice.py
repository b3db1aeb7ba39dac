"""What computes a sweep: each incidence by itself, or some between others."""

from creeping.rays.transport import Flow
from creeping.sweeping.between.fields import FieldsBetween
from creeping.sweeping.request import SweepRequest
from creeping.sweeping.sweeper import Sweeper


def sweeper_of(flow: Flow, request: SweepRequest) -> Sweeper | FieldsBetween:
    """What gives the results of unit directions (n, 3)."""
    return Sweeper(flow, request) if request.lattice is None else FieldsBetween(flow, request)
