"""The waves of a whole fan at points of the body, by marching: rays that pass through, and beams where those merge.

Both go together as `creeping.field.beam_blend` says.

Sources: [P82]; Derivations, F22 and F24.
"""

import numpy as np

from creeping._typing import BoolArray, ComplexArray, FloatArray
from creeping.field.beam_blend import STRONG, beams_beside_rays, blended_sum, variation
from creeping.field.boundary import Boundary
from creeping.field.far_geometry import fan_strips
from creeping.field.marching.fan_waves import FanWaves, fan_waves, marchable, spread_out
from creeping.field.ray_sums import RaySum
from creeping.rays.fan import RayFan
from creeping.rays.shedding import ShedRays

LONGEST = 60.0
"""Seconds that beams may take."""


def marches(fan: RayFan, boundary: Boundary, order: int, count: int, wavenumber: float) -> bool:
    """Whether the waves of a fan can be marched, and cost little enough at ``count`` points."""
    from creeping.field.beams import seconds

    return marchable(fan, boundary, order) and seconds(fan, fan_strips(fan), wavenumber, count) < LONGEST


def marched_sum(
    fan: RayFan,
    shed: ShedRays,
    points: FloatArray,
    share: FloatArray | None,
    young: BoolArray,
    wavenumber: float,
    boundary: Boundary,
) -> RaySum:
    """Sum of the marched waves at points (n, 3), L.

    ``share`` (n,) is that of the rays next to the line, of which ``young`` (m,) says which of the rays found they are.
    """
    k, count = wavenumber, len(points)
    waves = fan_waves(fan, wavenumber=k, boundary=boundary)
    y, slope, off = _on_rays(waves, shed)
    rays, observer = shed.rays, shed.observer
    own = spread_out(y, rays, k)
    with np.errstate(divide="ignore", invalid="ignore"):
        part = np.where(np.abs(y) > 0, off / np.abs(y), 0.0)
    share = np.ones(count) if share is None else share
    # an infinite wave is that of a caustic: beams serve there
    own = np.where(np.isfinite(own), own, 0.0) * np.where(young, share[observer], 1.0)
    size = np.minimum(np.abs(own), STRONG * np.abs(y))
    beams = beams_beside_rays(fan, waves, shed, points, own, share)
    return blended_sum(fan, shed, own, np.abs(own), size, part, variation(fan, shed, y, slope, k), beams, k, boundary)


def _on_rays(waves: FanWaves, shed: ShedRays) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """Y, dy/dsigma and the error of y of the rays found (m,)."""
    y, slope = np.zeros((2, len(shed.sigma)), dtype=complex)
    error = np.zeros(len(shed.sigma))
    for number in range(len(waves.strips)):
        mine = np.flatnonzero(shed.strip == number)
        at = number, shed.sigma[mine], shed.rays.time[mine]
        y[mine], slope[mine], error[mine] = waves.at(*at), waves.across(*at), waves.error(*at)
    return y, slope, error
