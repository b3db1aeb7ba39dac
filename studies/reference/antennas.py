"""What slots in a conductor and monopoles on it give each other: H along a slot of a monopole, E_n there of a slot.

On a sphere of radius a a monopole, an electric moment along n, has the Debye potential of `studies.reference.monopoles`
alone, and at angle s from it, per unit of the moment,

    H_φ = (1/(x a²)) Σ (2n+1)/4π (ξₙ/ξₙ') dPₙ(cos s)/ds,   ξₙ = x hₙ(x), x = ka, outgoing,

φ = n × (direction of the path). On the plane it is twice ∇ e^{ikr}/(4πr) × n, -2ik (1 + i/kr) e^{ikr}/(4πr). By
reciprocity E_n of a slot, a magnetic moment p, is minus the H along p of the monopole. On other bodies either of them
by electric dipoles inside, as slots (`studies.reference.slots`).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from studies.reference._boundary import ComplexArray, FloatArray, positive
from studies.reference.clouds import Body
from studies.reference.dipoles import _field
from studies.reference.slots import (
    TERMS,
    between,
    electric,
    field_of_moments,
    magnetic_of_electric,
    monopoles_at,
    outward,
    partial_waves,
    slots_along,
)


def sphere_antennas(wavenumber: float, radius: float, angles: ArrayLike, *, terms: int = TERMS) -> ComplexArray:
    """H_φ at angles (m,) from a monopole, radians, neither 0 nor pi: (m,), 1/L²."""
    positive(wavenumber=wavenumber, radius=radius)
    x, s = wavenumber * radius, np.asarray(angles, dtype=float)
    c = np.cos(s)
    total = np.zeros(c.shape, dtype=complex)
    for n, weight, soft, before, value in partial_waves(x, c, terms):
        total -= weight / soft * n * (before - c * value) / np.sin(s)
    return np.asarray(total / (x * radius**2))


def plane_antennas(wavenumber: float, distances: ArrayLike) -> ComplexArray:
    """The same on a plane, at distances (m,), L."""
    s = np.asarray(distances, dtype=float)
    wave = 1j * wavenumber * np.exp(1j * wavenumber * s) / (2 * np.pi * s)
    return np.asarray(-wave * (1 + 1j / (wavenumber * s)))


@dataclass(frozen=True)
class Received:
    """Fields at n points of antennas at s ports, 1/L².

    Attributes
    ----------
    ports, points : (s, 3), (n, 3), L
    tangents : (n, 2, 3) or (s, 2, 3)
        Along the slots, which are at the points or the ports.
    values : (n, s, 2)
        H along both of a monopole, or E_n of both.
    spread : (n, s)
        What all heights and all but the largest differ by, the largest of both.
    """

    ports: FloatArray
    points: FloatArray
    tangents: FloatArray
    values: ComplexArray
    spread: FloatArray


def slots_of_monopoles(
    body: Body,
    wavenumber: float,
    sources: ArrayLike,
    points: ArrayLike,
    *,
    depth: float,
    heights: tuple[float, ...],
    per_wavelength: float = 7.0,
) -> Received:
    """H at slots of monopoles at the sources; parameters as of `studies.reference.ports.coupled`."""
    fields = field_of_moments, _magnetic, magnetic_of_electric
    given = depth, heights, per_wavelength
    ports, x, _, both = between(body, wavenumber, sources, points, monopoles_at, fields, *given)
    tangents = slots_along(body, x)
    values, fewer = (np.einsum("nsac,nrc->nsr", one, tangents) for one in both)
    return Received(ports, x, tangents, values, np.max(np.abs(values - fewer), axis=2))


def monopoles_of_slots(
    body: Body,
    wavenumber: float,
    sources: ArrayLike,
    points: ArrayLike,
    *,
    depth: float,
    heights: tuple[float, ...],
    per_wavelength: float = 7.0,
) -> Received:
    """E_n at monopoles of slots at the sources; parameters as of `studies.reference.ports.coupled`."""
    fields = electric, electric, _field
    given = depth, heights, per_wavelength
    ports, x, tangents, both = between(body, wavenumber, sources, points, slots_along, fields, *given)
    values, fewer = (np.einsum("nsac,nc->nsa", one, outward(body, x)) for one in both)
    return Received(ports, x, tangents, values, np.max(np.abs(values - fewer), axis=2))


def _magnetic(x: FloatArray, z: FloatArray, p: FloatArray, k: float) -> ComplexArray:
    """H of electric moments p at z (s, 3), ∇ e^{ikr}/(4πr) × p: (n, 3, s)."""
    return -electric(x, z, p, k)
