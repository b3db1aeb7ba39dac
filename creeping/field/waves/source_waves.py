"""What the creeping wave of a point source has more than that of a plane wave.

A mode of angular momentum k ρ1 + m1 τ' takes of the source what the Hankel function of its distance has there. With R
the distance from the source to the attachment point and e = ρ1/(m1 R), each mode is multiplied by

    exp{i τ'² e/4 + i τ³ e³/24} (1 + τ e²/4),   τ' = τ + c/m1²

the first factor of order 1/m1, the others of second order and more; c is the decay of `creeping.field.creeping_modes`.
What is left out is of the size τ⁴ e⁵/64 and (τ e²/4)², and where curvature varies at the line τ³ e ρ1'/m1.

Sources: [AS64, sec. 9.3]; Derivations, R19.
"""

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from creeping.field.arguments import fock_parameter, mean_scale, scales, transverse_ratios
from creeping.field.boundary import Boundary
from creeping.field.creeping_modes import decay_terms, modes_of
from creeping.field.special.airy import Modes
from creeping.rays.quantities import RayPoints

VARIES, NEXT = 1 / 16, 2.0
"""Weight of τ³ e ρ1'/m1 in the error, and how much is added to |τ| of the first mode at ξ = 0."""


def nearness(rays: RayPoints, wavenumber: float) -> FloatArray:
    """e = ρ1/(m1 R) (...), without unit; 0 of a plane wave."""
    with np.errstate(divide="ignore", invalid="ignore"):
        e = rays.opening / (rays.curvature[0] * scales(rays, wavenumber)[0])
    return np.asarray(np.where(rays.opening > 0, e, 0.0))


def of_source(rays: RayPoints, modes: Modes, wavenumber: float, boundary: Boundary, order: int) -> ComplexArray | float:
    """What the exponents of modes have of a point source, (..., n); 0 of a plane wave.

    It is not limited: Im τ² > 0, so that it makes the series converge.
    """
    if not np.any(rays.opening > 0):
        return 0.0
    e, tau = nearness(rays, wavenumber)[..., None], modes.tau
    if order == 1:
        return np.asarray(tau**2 * e / 4)
    plain, across, varying = decay_terms(modes, boundary.sign)
    rate, bend = rays.radius_rate[0], rays.radius_bend[0]
    c = plain + across * transverse_ratios(rays)[0][..., None] + varying * (bend - 2 / 3 * rate**2)[..., None]
    shifted = tau + c / scales(rays, wavenumber)[0][..., None] ** 2
    return np.asarray(shifted**2 * e / 4 + tau**3 * e**3 / 24 - 1j * np.log1p(tau * e**2 / 4))


def left_out(rays: RayPoints, wavenumber: float, boundary: Boundary) -> FloatArray:
    """Share of a wave (...) that its source has beyond these factors: by the first mode, and more next to the line.

    By how much more there is from spheres, the weight of varying curvature from an ellipsoid.
    """
    if not np.any(rays.opening > 0):
        return np.zeros(rays.time.shape)
    e = nearness(rays, wavenumber)
    first = np.abs(modes_of(boundary, mean_scale(rays, wavenumber)).tau[..., 0])
    tau = first + NEXT * np.exp(-0.5 * fock_parameter(rays, wavenumber))
    varying = VARIES * first**3 * e * np.abs(rays.radius_rate[0]) / scales(rays, wavenumber)[0]
    return np.asarray(np.where(e > 0, tau**4 * e**5 / 64 + (tau * e**2 / 4) ** 2 + varying, 0.0))
