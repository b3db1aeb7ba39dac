"""How far a wave is from the limit that its expansions are about: two numbers of a fan and a wavenumber.

    k rho              large where the wave is short against the radius of curvature along the rays, rho = 1/kappa_n
    kappa_t rho/m^2    small where the body is not much more curved across the rays than along them, m^3 = k rho/2

The first alone says nothing of a slender body seen along its axis. Both are taken over the rays that the wave launches,
as long as xi < 1: what comes after has died away.

Sources: [LK59]; Derivations, F4.
"""

from typing import NamedTuple

import numpy as np

from creeping.field.arguments import checked
from creeping.field.creeping_modes import fock_scale
from creeping.geometry.curvature import normal_curvature
from creeping.geometry.surface import normal
from creeping.rays.fan import RayFan, RayStatus

EARLY = 1.0
"""xi up to which a ray matters."""


class Validity(NamedTuple):
    """Least k rho and largest |kappa_t| rho/m^2, without unit; NaN of a fan without rays.

    Examples
    --------
    >>> Validity(24.0, 0.8)
    Validity(least_k_rho=24.0, largest_transverse=0.8)
    """

    least_k_rho: float
    largest_transverse: float


def validity(fan: RayFan, *, wavenumber: float) -> Validity:
    """Least k rho and largest kappa_t rho/m^2 on the rays of a fan.

    Parameters
    ----------
    fan : RayFan
    wavenumber : float, 1/L

    Raises
    ------
    InvalidInputError
        On a bad wavenumber.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere(radius=2.0)
    >>> fan = cr.launch(cr.DirectFlow(ball), cr.shadow_line(ball, direction=(0, 0, 1)), length=3.0, n_rays=16)
    >>> found = cr.validity(fan, wavenumber=27.0)               # k a and 1/m^2
    >>> round(found.least_k_rho, 6), round(found.largest_transverse, 6)
    (54.0, 0.111111)
    """
    k = checked(wavenumber, 2)
    early = np.cbrt(k / 2) * fan.attenuation < EARLY
    launched = np.isin(fan.status, (RayStatus.OK, RayStatus.DETACHED, RayStatus.NON_SMOOTH))
    there = early & (fan.curvature > 0) & (fan.travel_time < fan.detachment[:, None]) & launched[:, None]
    if not np.any(there):
        return Validity(np.nan, np.nan)
    points, along = fan.points[there], fan.curvature[there]
    across = np.cross(normal(fan.body, points), fan.directions[there])
    transverse = np.abs(normal_curvature(fan.body, points, across)) / along / fock_scale(k, along) ** 2
    return Validity(float(k / along.max()), float(transverse.max()))
