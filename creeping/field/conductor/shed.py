"""E and H of the creeping rays whose tangents pass through points off a conductor.

    H = h u b - e (i kappa_t1/(kT)) u p,   E = -h u n        electric hard
    E = e v b,                             H = e v n         electric soft

p, n and b = n x p are those where the ray leaves, h = H0.b and e = E0.b those where it has landed, u and v the waves of
`creeping.field.near_wave`, T = J + l J' the width of the ray's tube. A ray carries b onto b and n onto n; what h varies
by across rays gives H along them, (i/k) dh/db, as in the current on the body. E and H along rays that come from what u
and v vary by along n, of the order m/(k l) at the distance l, are left out; the error counts them.

Sources: [LK59], [PBM80]; Derivations, F8, F14 and F26.
"""

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.boundary import CONDUCTOR, ELECTRIC_HARD, ELECTRIC_SOFT
from creeping.field.currents.conductor import amplitudes
from creeping.field.far_geometry import fan_strips
from creeping.field.near_wave import height_above, shed_waves
from creeping.field.ray_scales import scales
from creeping.field.ray_sums import RaySum, own_error, ray_sum
from creeping.geometry.surface import normal
from creeping.rays.fan import RayFan
from creeping.rays.shedding import ShedRays, free_ways, shed_near

ALONG, COUPLED = 1.5, 0.5
"""Error by what E and H have along the ray beside the term in kappa_t1, over m/(k l), and of that term."""


def shed_sums(fan: RayFan, points: FloatArray, k: float, electric: ComplexArray) -> list[RaySum]:
    """Sums over rays of E and H (n, 6) at points off the body (n, 3), L, for each incident E0 (3, p)."""
    shed = shed_near(fan_strips(fan), fan.body, points)
    shed = shed[free_ways(fan.body, shed.rays, shed.reach)]
    pair = [_vectors(fan, shed, k, electric, order) for order in (2, 1)]
    coupled = np.linalg.norm(np.sum(pair[0][:, 3:] * shed.rays.directions[:, :, None], axis=1, keepdims=True), axis=1)
    m = scales(shed.rays, k)[1]
    strength = np.max([np.linalg.norm(wave[:, :3], axis=1).max(axis=1, initial=0.0) for wave in pair], axis=0)
    height, found = height_above(shed.rays, shed.reach, k), []
    for i in range(electric.shape[1]):
        waves, other = (wave[:, :, i] for wave in pair)
        own = own_error(shed.rays, (waves, other), k, CONDUCTOR, 2, height=height)
        along = np.minimum(ALONG * m / (k * np.maximum(shed.reach, 1e-300)), 1.0)
        own = np.linalg.norm([own, along * np.linalg.norm(waves, axis=1), COUPLED * coupled[:, i]], axis=0)
        found.append(ray_sum(fan, shed, len(points), waves, own, k, ELECTRIC_HARD, strength))
    return found


def _vectors(fan: RayFan, shed: ShedRays, k: float, electric: ComplexArray, order: int) -> ComplexArray:
    """E and H (m, 6, p) of each ray."""
    rays = shed.rays
    p, n = rays.directions, normal(fan.body, rays.points)
    b = np.cross(n, p)
    axes = np.broadcast_to(fan.line.direction, rays.first_normal.shape)
    h, e = amplitudes(rays.first_normal, axes, fan.line.direction, electric)
    with np.errstate(invalid="ignore"):
        u, v = (shed_waves(rays, shed.reach, k, kind, order) for kind in (ELECTRIC_HARD, ELECTRIC_SOFT))
        hu, ev = h * u[:, None], e * v[:, None]
        E = -n[:, :, None] * hu[:, None] + b[:, :, None] * ev[:, None]
        H = b[:, :, None] * hu[:, None] + n[:, :, None] * ev[:, None]
        # 1/T is held where rays merge, as 1/J is on the body
        tube, m = rays.spreading + shed.reach * rays.spreading_rate, scales(rays, k)[1]
        aside = -1j / k * rays.transverse[0] * u * tube / (tube**2 + 1 / m**4)
        H = H + p[:, :, None] * (e * aside[:, None])[:, None]
    return np.concatenate([E, H], axis=1)
