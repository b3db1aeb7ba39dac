"""What the polarisations of a conductor's creeping rays do to each other.

    c = i κ_t1 κ_t2/(k J')                                 of the other's wave comes with each, exact on the sphere
    ξ √((VARIES B)² + (LEANS (r - 1))²)/m²                 may pass on the way: an error, 0 on the sphere

with B = |ρρ''| + ρ'² and r = ρ κ_t, means of both ends.

Sources: Derivations, F14.
"""

import numpy as np

from creeping._typing import BoolArray, ComplexArray, FloatArray
from creeping.field.boundary import ELECTRIC_HARD, ELECTRIC_SOFT, Boundary
from creeping.field.ray_scales import fock_parameter, scales, transverse_ratios
from creeping.rays.quantities import RayPoints

CROSSED = {ELECTRIC_SOFT: (1, ELECTRIC_HARD), ELECTRIC_HARD: (-1, ELECTRIC_SOFT)}
"""Polarisations of a conductor and the other of each, with the sign of their coupling."""
STRONG = 0.5
"""Size of the coupling of polarisations from which its expansion fails."""
VARIES, LEANS, LEAST_XI = 0.3, 0.5, 0.7
"""What ρρ'' and r - 1 turn of a conductor's polarisations, and the least ξ that it grows with: of three ellipsoids."""


def gradient_coupling(rays: RayPoints, wavenumber: float) -> ComplexArray:
    """i κ_t1 κ_t2/(k J'): how much of one polarisation's wave goes with the other's (n,), without unit.

    An amplitude n0.E that varies across the rays has a transverse field of higher order in 1/k; the soft wave is so
    weak that this outweighs it. Found on the sphere, exactly; κ_t at both ends, for reciprocity, on other bodies.
    """
    first, last = rays.transverse
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(1j * np.maximum(first * last, 0.0) / (wavenumber * rays.spreading_rate))


def held_coupling(coupling: ComplexArray) -> ComplexArray:
    """The coupling c held below 1 in size, c/(1 + |c|⁴)^(1/4).

    As the next order of a wave it cannot be larger than what it comes from.
    """
    # the size first: its fourth power may not be a number
    large = np.abs(coupling) > 1
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        out = np.where(large, coupling / np.abs(coupling) / (1 + np.abs(coupling) ** -4.0) ** 0.25, coupling)
        out = np.where(large, out, coupling / (1 + np.abs(coupling) ** 4) ** 0.25)
    return np.asarray(np.nan_to_num(out, nan=1.0))


def strong_coupling(rays: RayPoints, wavenumber: float, boundary: Boundary) -> BoolArray:
    """Whether the wave of the other polarisation is too large a part of a ray's for an expansion (n,)."""
    if boundary not in CROSSED:
        return np.zeros(rays.alive.shape, dtype=bool)
    return np.asarray(~(np.abs(gradient_coupling(rays, wavenumber)) < STRONG))


def turning(rays: RayPoints, wavenumber: float) -> FloatArray:
    """About how much of a conductor's creeping wave may pass into the other polarisation on its way (n,), at most 1.

    Nothing of it is known beyond the sphere, where nothing does. It is taken as ξ/m² times what is not as on a sphere.
    """
    ends = zip(transverse_ratios(rays), scales(rays, wavenumber), rays.radius_rate, rays.radius_bend, strict=True)
    unlike = [
        np.hypot(VARIES * (np.abs(bend) + rate**2), LEANS * np.minimum(np.abs(r - 1), 1)) / m**2
        for r, m, rate, bend in ends
    ]
    xi = np.maximum(fock_parameter(rays, wavenumber), LEAST_XI)
    return np.asarray(np.minimum(np.mean(unlike, axis=0) * xi, 1.0))
