"""Scales of a creeping ray at a wavenumber: Fock's ξ and m, and the ratio of curvatures.

    ξ = (k/2)^(1/3) ∫ κₙ^(2/3) ds,   m = (kρ/2)^(1/3),   r = ρ κ_t

Sources: Derivations, F4.
"""

import numpy as np

from creeping._typing import FloatArray
from creeping.field.creeping_modes import fock_scale
from creeping.rays.quantities import RayPoints


def fock_parameter(rays: RayPoints, wavenumber: float) -> FloatArray:
    """Fock parameter ξ (...), without unit; k in 1/L."""
    return np.asarray(np.cbrt(wavenumber / 2) * rays.integrals[..., 1])


def scales(rays: RayPoints, wavenumber: float) -> tuple[FloatArray, FloatArray]:
    """m at the attachment and the shedding point (...), without unit; k in 1/L."""
    first, last = rays.curvature
    return fock_scale(wavenumber, first), fock_scale(wavenumber, last)


def mean_scale(rays: RayPoints, wavenumber: float) -> FloatArray:
    """Mean of m along the ray, weighted by κₙ^(2/3) (...); m at attachment where the ray has no length."""
    some = rays.integrals[..., 1] > 0
    mean = np.divide(rays.integrals[..., 0], rays.integrals[..., 1], out=np.zeros(some.shape), where=some)
    return np.asarray(np.where(some, np.cbrt(wavenumber / 2) * mean, scales(rays, wavenumber)[0]))


def transverse_ratios(rays: RayPoints) -> tuple[FloatArray, FloatArray]:
    """r = ρ κ_t at the attachment and the shedding point (...), without unit."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = [t / c for t, c in zip(rays.transverse, rays.curvature, strict=True)]
    return np.nan_to_num(ratios[0]), np.nan_to_num(ratios[1])
