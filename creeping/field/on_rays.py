"""Each ray's own field from what the fan carries already; for pictures that follow a hand.

First order of `creeping.field.surface`, with ξ = (k/2)^(1/3) A and A the fan's attenuation integral:

    u e^{-ik(d.x0 + s)} = (ρ1/ρ2)^(1/6) |J|^(-1/2) e^{-iπN/2} g(ξ)          hard, impedance
    du/dn/k: the same with F(ξ)/m2                                          soft

Sources: Derivations, F3.
"""

import numpy as np

from creeping._typing import BoolArray, ComplexArray, FloatArray
from creeping.field.arguments import checked, checked_plain
from creeping.field.boundary import BoundaryLike
from creeping.field.creeping_modes import fock_scale
from creeping.field.special.fock import surface_function
from creeping.field.surface import scalar_boundary
from creeping.geometry.incident import plane_direction
from creeping.rays.fan import RayFan

QUARTERS = np.array([1.0, -1j, -1.0, 1j])
"""e^{-iπN/2}."""


def ray_magnitude(fan: RayFan, *, wavenumber: float, boundary: BoundaryLike = "soft") -> FloatArray:
    """|u|, or |du/dn|/k of the soft boundary, of each ray at its steps: (rays, steps).

    Parameters
    ----------
    fan : RayFan
    wavenumber : float, 1/L
    boundary : "soft", "hard" or ImpedanceBoundary

    Returns
    -------
    (rays, steps)
        Infinite at caustics, 0 where the creeping ray has ended.

    Raises
    ------
    InvalidInputError
        On a bad wavenumber or boundary, and for a weighted body.
    """
    return np.abs(ray_envelope(fan, wavenumber=wavenumber, boundary=boundary))


def ray_envelope(fan: RayFan, *, wavenumber: float, boundary: BoundaryLike = "soft") -> ComplexArray:
    """u, or du/dn/k, of each ray at its steps without the factor e^{ik eikonal}, fast to vary: (rays, steps).

    Arguments, errors and what is infinite or 0 as of `ray_magnitude`.
    """
    kind = scalar_boundary(boundary)
    k = checked(wavenumber, 1)
    checked_plain(fan.body)
    plane_direction(fan.line.source, "this magnitude")
    out = np.zeros(fan.spreading.shape, dtype=complex)
    here = creeps(fan)
    first = np.broadcast_to(fan.curvature[:, :1], here.shape)[here]
    last = fan.curvature[here]
    m = fock_scale(k, np.sqrt(first * last))
    wave = surface_function(np.cbrt(k / 2) * fan.attenuation[here], kind.q(m))
    with np.errstate(divide="ignore"):
        strength = np.cbrt(np.sqrt(last / first)) / np.sqrt(np.abs(fan.spreading[here]))
    if kind.kind == "soft":
        strength = strength / fock_scale(k, last)
    finite = np.isfinite(strength)
    turned = wave * QUARTERS[fan.caustic_index[here] % 4]
    # inf times a complex number would be NaN
    out[here] = np.where(finite, turned * np.where(finite, strength, 0.0), np.inf)
    return out


def creeps(fan: RayFan) -> BoolArray:
    """Whether each ray is a creeping ray at its steps: launched by the wave and not detached before (rays, steps)."""
    launched = fan.launched
    return np.asarray(launched[:, None] & (fan.travel_time < fan.detachment[:, None]) & (fan.curvature > 0))
