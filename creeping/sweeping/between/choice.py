"""What computes a sweep: each incidence by itself, or some between others."""

from creeping.geometry.creased import is_creased
from creeping.rays.transport import Flow
from creeping.sweeping.between.fields import FieldsBetween
from creeping.sweeping.between.rays import RaysBetween
from creeping.sweeping.request import SweepRequest
from creeping.sweeping.solved_fields import NoFlow, SolvedSweeper
from creeping.sweeping.sweeper import Sweeper


def sweeper_of(flow: Flow, request: SweepRequest) -> Sweeper | FieldsBetween | RaysBetween | SolvedSweeper:
    """What gives the results of unit directions (n, 3); bodies with creases have no rays that all go on."""
    if isinstance(flow, NoFlow):
        return SolvedSweeper(flow, request)
    if request.lattice is None or is_creased(flow.body):
        return Sweeper(flow, request)
    return RaysBetween(flow, request) if request.quantity == "rays" else FieldsBetween(flow, request)
