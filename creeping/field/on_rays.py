"""The magnitude of each ray's own field from what the fan carries already; for pictures that follow a hand.

First order of `creeping.field.surface`, with ξ = (k/2)^(1/3) A and A the fan's attenuation integral:

    |u| = (ρ1/ρ2)^(1/6) |J|^(-1/2) |g(ξ)|          hard, impedance
    |du/dn|/k = the same with |F(ξ)|/m2             soft

Sources: Derivations, F3.
"""

import numpy as np

from creeping._typing import BoolArray, FloatArray
from creeping.field.arguments import checked, checked_plain
from creeping.field.boundary import BoundaryLike
from creeping.field.creeping_modes import fock_scale
from creeping.field.special.fock import surface_function
from creeping.field.surface import scalar_boundary
from creeping.geometry.incident import plane_direction
from creeping.rays.fan import RayFan


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
    kind = scalar_boundary(boundary)
    k = checked(wavenumber, 1)
    checked_plain(fan.body)
    plane_direction(fan.line.source, "this magnitude")
    out = np.zeros(fan.spreading.shape)
    here = creeps(fan)
    first = np.broadcast_to(fan.curvature[:, :1], here.shape)[here]
    last = fan.curvature[here]
    m = fock_scale(k, np.sqrt(first * last))
    wave = np.abs(surface_function(np.cbrt(k / 2) * fan.attenuation[here], kind.q(m)))
    with np.errstate(divide="ignore"):
        wave = wave * np.cbrt(np.sqrt(last / first)) / np.sqrt(np.abs(fan.spreading[here]))
    out[here] = wave / fock_scale(k, last) if kind.kind == "soft" else wave
    return out


def creeps(fan: RayFan) -> BoolArray:
    """Whether each ray is a creeping ray at its steps: launched by the wave and not detached before (rays, steps)."""
    launched = fan.launched
    return np.asarray(launched[:, None] & (fan.travel_time < fan.detachment[:, None]) & (fan.curvature > 0))
