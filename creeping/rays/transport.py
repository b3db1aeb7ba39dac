"""Rays of many incidences carried by a flow in one call.

Rays of an incidence start in blocks of their own, the last one filled up: a tracer that adapts its step to a block
then gives the same, bit for bit, in whatever company an incidence is computed.
"""

from typing import Protocol

import numpy as np

from creeping._typing import FloatArray
from creeping.errors import InvalidInputError
from creeping.geodesics.integrator import ErrorEstimate
from creeping.geodesics.states import pack
from creeping.geometry.arguments import checked_body, shown
from creeping.geometry.creased import is_creased
from creeping.geometry.incident import headings
from creeping.geometry.surface import Surface
from creeping.kernels.threads import CHUNK
from creeping.shadow.attachment import LaunchPoints


class Flow(Protocol):
    """What carries the rays: a `PhaseMap` or a `DirectFlow`."""

    @property
    def body(self) -> Surface:
        """Body whose flow it is."""
        ...

    @property
    def horizon(self) -> float:
        """Time of one leap."""
        ...

    @property
    def error(self) -> ErrorEstimate | None:
        """Measured error of one leap, None if direct."""
        ...

    def transport(self, states: FloatArray, times: FloatArray) -> FloatArray:
        """Advance states (n, 12) to ascending times (m,): (n, m, 12)."""
        ...


def checked_flow(flow: Flow) -> None:
    """Refuse what carries no rays.

    Raises
    ------
    InvalidInputError
    """
    fits = all(hasattr(flow, name) for name in ("body", "horizon", "error")) and not isinstance(flow, type)
    if not (fits and callable(getattr(flow, "transport", None))):
        raise InvalidInputError(
            f"flow = {shown(flow)} is no flow; make one by creeping.build_phase_map, DirectFlow or choose_flow"
        )
    checked_body(flow.body, charts=not is_creased(flow.body))


def carried(flow: Flow, launch: LaunchPoints, times: FloatArray, *, components: int) -> FloatArray:
    """States (n, rays, m, components) of all rays at the times (m,); what stands for no ray is not to be read."""
    there = launch.there
    n, rays = there.shape
    padded = -(-rays // CHUNK) * CHUNK
    some = np.flatnonzero(there.any(axis=1))
    if not len(some):
        return np.full((n, rays, len(times), components), np.nan)
    points = launch.points
    if padded > rays or not there.all():
        points = np.empty((len(some), padded, 3))
        points[:, :rays] = launch.points[some]
        # places without a ray go along as copies of the first
        filled = np.zeros((len(some), padded), dtype=bool)
        filled[:, :rays] = there[some]
        points[~filled] = np.broadcast_to(points[:, :1], points.shape)[~filled]
    directions = headings(launch.waves[some, None], points)
    states = flow.transport(pack(points, directions, lanes=components), times)
    states = states.reshape(len(some), padded, len(times), components)[:, :rays]
    if len(some) == n:
        return states
    whole = np.full((n, rays, len(times), components), np.nan)
    whole[some] = states
    return whole
