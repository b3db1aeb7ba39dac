"""Points of the rays of a fan, with what the wave needs to know of them.

Sources: Derivations, R4 and R19.
"""

import numpy as np

from creeping._typing import FloatArray
from creeping.geometry.incident import headings, openings
from creeping.rays.fan import RayFan
from creeping.rays.quantities import LANES, START_LANES, RayPoints
from creeping.rays.tracer import RayTracer
from creeping.shadow.attachment import line_tangents

FINE_TURN = 0.08
"""Largest angle by which a ray turns in one step: polynomials of degree 9 then err by about 3e-11."""
MANY, APART = 512, 4
"""Points of a ray that are enough, unless they were more than so many steps apart: strips between them err by 3e-5 of J
then, between rays that lie much farther apart."""


def ray_points(fan: RayFan, times: FloatArray | None = None) -> tuple[FloatArray, RayPoints]:
    """Points of every ray of a fan, at equal steps that resolve the body if not at given times.

    Returns
    -------
    times : (m,), L
    points : RayPoints
        (rays, m)

    Raises
    ------
    InvalidInputError
        If the body is weighted.
    """
    tracer = RayTracer(fan.body, fan.length, turn=FINE_TURN)
    count = min(tracer.steps, max(MANY, -(-tracer.steps // APART)))
    equal: FloatArray = fan.length / count * np.arange(count + 1, dtype=np.float64)
    times = equal if times is None else times
    rays, steps = len(fan.points), len(times)
    starts, wave = fan.points[:, 0], fan.line.wave
    d = headings(wave, starts)
    tangents = line_tangents(fan.body, starts, d) if rays else np.zeros((0, 3))
    owner = np.repeat(np.arange(rays), steps)
    found = tracer.at(d, starts, tangents, np.tile(times, rays), owner, openings=openings(wave, starts)).rays
    launched = fan.launched
    alive = found.alive.reshape(rays, steps) & launched[:, None]
    return times, RayPoints(
        found.lanes.reshape(rays, steps, LANES),
        found.starts.reshape(rays, steps, START_LANES),
        np.broadcast_to(times, alive.shape),
        alive,
        found.scale,
    )
