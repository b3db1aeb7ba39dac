"""Rays of many incidences carried by a flow in one call.

Rays of an incidence start in blocks of their own, the last one filled up: a tracer that adapts its step to a block
then gives the same, bit for bit, in whatever company an incidence is computed.
"""

import numpy as np

from creeping._typing import FloatArray
from creeping.geodesics.integrator import pack
from creeping.rays.fan import Flow
from creeping.shadow.many import ShadowLines
from creeping.shadow.status import NO_RAY


def carried(flow: Flow, lines: ShadowLines, times: FloatArray, *, lanes: int) -> FloatArray:
    """States (n, rays, m, lanes) of all rays at the times (m,); what stands for no ray is not to be read."""
    from creeping.kernels.block import BLOCK

    there = lines.curve_index != NO_RAY
    n, rays = there.shape
    padded = -(-rays // BLOCK) * BLOCK
    some = np.flatnonzero(there[:, 0])
    points = lines.launch_points
    if padded > rays or not there.all():
        points = np.empty((len(some), padded, 3))
        points[:, :rays] = lines.launch_points[some]
        # places without a ray go along as copies of the first
        filled = np.zeros((len(some), padded), dtype=bool)
        filled[:, :rays] = there[some]
        points[~filled] = np.broadcast_to(points[:, :1], points.shape)[~filled]
    directions = np.broadcast_to(lines.directions[some, None], points.shape)
    states = flow.transport(pack(points, directions, lanes=lanes), times)
    states = states.reshape(len(some), padded, len(times), lanes)[:, :rays]
    if len(some) == n:
        return states
    whole = np.full((n, rays, len(times), lanes), np.nan)
    whole[some] = states
    return whole
