"""The electric field on a conductor of a monopole on it: an electric dipole along the normal.

On a sphere of radius a the field is that of a Debye potential, E = ∇×∇×(x v)/k with v = Σ vₙ ξₙ(kr) Pₙ(cos s)/r, and
at angle s it is, per unit of the moment, a current times a length, times the admittance of free space,

    E_n = -i/(x² a²) Σ (2n+1)/4π n(n+1) (ξₙ/ξₙ') Pₙ(cos s),   ξₙ = x hₙ(x), x = ka, outgoing.

On the plane it is twice ik (1 + ∇∇/k²) e^{ikr}/(4πr). Terms grow like n^(3/2); faded out smoothly to all orders they
sum to Abel's limit. On other bodies by electric dipoles inside, as slots (`studies.reference.slots`).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from studies.reference._boundary import ComplexArray, FloatArray, positive
from studies.reference.clouds import Body
from studies.reference.dipoles import _field
from studies.reference.slots import TERMS, between, field_of_moments, monopoles_at, outward, partial_waves


def sphere_monopoles(wavenumber: float, radius: float, angles: ArrayLike, *, terms: int = TERMS) -> ComplexArray:
    """E_n at angles (m,) from the monopole, radians, not 0: (m,), 1/L²."""
    positive(wavenumber=wavenumber, radius=radius)
    x, c = wavenumber * radius, np.cos(np.asarray(angles, dtype=float))
    total = np.zeros(c.shape, dtype=complex)
    for n, weight, soft, _, value in partial_waves(x, c, terms):
        total += n * (n + 1) * weight / soft * value
    return np.asarray(-1j / (x * radius) ** 2 * total)


def plane_monopoles(wavenumber: float, distances: ArrayLike) -> ComplexArray:
    """The same on a plane, at distances (m,), L."""
    s = np.asarray(distances, dtype=float)
    inverse = 1j / (wavenumber * s)
    wave = 1j * wavenumber * np.exp(1j * wavenumber * s) / (2 * np.pi * s)
    return np.asarray(wave * (1 + inverse + inverse**2))


@dataclass(frozen=True)
class CoupledMonopoles:
    """Fields E_n, times the admittance of free space, of monopoles at each of s ports, 1/L².

    Attributes
    ----------
    ports, points : (s, 3), (n, 3), L
    values : (n, s)
    spread : (n, s)
        What all heights and all but the largest differ by.
    """

    ports: FloatArray
    points: FloatArray
    values: ComplexArray
    spread: FloatArray


def coupled_monopoles(
    body: Body,
    wavenumber: float,
    sources: ArrayLike,
    points: ArrayLike,
    *,
    depth: float,
    heights: tuple[float, ...],
    per_wavelength: float = 7.0,
) -> CoupledMonopoles:
    """Fields of monopoles on a conductor; parameters as of `studies.reference.ports.coupled`."""
    fields = field_of_moments, field_of_moments, _field
    given = depth, heights, per_wavelength
    ports, x, _, both = between(body, wavenumber, sources, points, monopoles_at, fields, *given)
    values, fewer = (np.einsum("nsac,nc->ns", one, outward(body, x)) for one in both)
    return CoupledMonopoles(ports, x, values, np.abs(values - fewer))
