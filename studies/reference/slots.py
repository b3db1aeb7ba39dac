"""The magnetic field on a conducting sphere of a slot in it: a tangential magnetic dipole on its surface.

Debye potentials E = ∇×(x u) + ∇×∇×(x v)/k, ξₙ = x hₙ(x), x = ka, outgoing, and n × E = -p δ on the surface, give the
tangential field at angle s from the dipole, per unit of p, a voltage times a length, times the impedance of free space

    across (p and H along b)    -(i/a²) [F'/sin s - D'']        F = Σ cₙ (ξₙ'/ξₙ) Pₙ(cos s)
    along (along the path)      -(i/a²) [F'' - D'/sin s]        D = Σ cₙ (ξₙ/ξₙ') Pₙ(cos s),   cₙ = (2n+1)/(4π n(n+1))

On the plane it is twice ik (1 + ∇∇/k²) e^{ikr}/(4πr). Terms grow like n^(3/2); faded out smoothly to all orders they sum to
Abel's limit.
"""

import numpy as np
from numpy.typing import ArrayLike

from studies.reference._boundary import ComplexArray, positive

TERMS = 6_000
"""Partial waves: with twice as many nothing changes by 1e-9 at 5 degrees and ka = 100."""


def sphere_slots(
    wavenumber: float, radius: float, angles: ArrayLike, *, terms: int = TERMS
) -> tuple[ComplexArray, ComplexArray]:
    """Fields across and along, 1/L², at angles (m,) from the dipole, radians, neither 0 nor pi: (m,), (m,)."""
    positive(wavenumber=wavenumber, radius=radius)
    x, s = wavenumber * radius, np.asarray(angles, dtype=float)
    c, sine = np.cos(s), np.sin(s)
    # hₙ₋₁/hₙ, upwards, where ξₙ'/ξₙ = hₙ₋₁/hₙ - n/x
    ratio = 1j
    before, value = np.ones_like(c), c.copy()
    # slopes of F and D, and their negative Laplacians
    slopes, values = np.zeros((2, *s.shape), dtype=complex), np.zeros((2, *s.shape), dtype=complex)
    for n in range(1, terms):
        ratio = 1 / ((2 * n - 1) / x - ratio)
        soft = ratio - n / x
        weight = (2 * n + 1) / (4 * np.pi) * _fade(n / terms)
        slope = -n * (before - c * value) / sine
        for row, factor in enumerate((soft, 1 / soft)):
            slopes[row] += weight * factor / (n * (n + 1)) * slope
            values[row] += weight * factor * value
        before, value = value, ((2 * n + 1) * c * value - n * before) / (n + 1)
    second = -values - c / sine * slopes
    factor = -1j / radius**2
    return factor * (slopes[0] / sine - second[1]), factor * (second[0] - slopes[1] / sine)


def plane_slots(wavenumber: float, distances: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
    """The same on a plane, at distances (m,), L."""
    s = np.asarray(distances, dtype=float)
    inverse = 1j / (wavenumber * s)
    wave = 1j * wavenumber * np.exp(1j * wavenumber * s) / (2 * np.pi * s)
    return wave * (1 + inverse + inverse**2), -2 * wave * inverse * (1 + inverse)


def _fade(share: float) -> float:
    """1 up to a third, 0 at 1, smooth to all orders."""
    u = min(max(1.5 * share - 0.5, 0.0), 1.0)
    if u in (0.0, 1.0):
        return 1.0 - u
    return float(1 / (1 + np.exp(1 / (1 - u) - 1 / u)))
