"""Antennas on a conductor, slots and monopoles in it and on it: the fields that they give each other.

A slot is a tangential magnetic dipole on the surface, a monopole an electric dipole along the normal. On a sphere of
radius a they are Debye potentials, E = ∇×(x u) + ∇×∇×(x v)/k, ξₙ = x hₙ(x), x = ka, outgoing. At angle s from a slot,
n × E = -p δ on the surface, the tangential H is, per unit of p, a voltage times a length, times the impedance of free
space, with cₙ = (2n+1)/(4π n(n+1)),

    across (p and H along b)    -(i/a²) [F'/sin s - D'']        F = Σ cₙ (ξₙ'/ξₙ) Pₙ(cos s)
    along (along the path)      -(i/a²) [F'' - D'/sin s]        D = Σ cₙ (ξₙ/ξₙ') Pₙ(cos s)

A monopole has the potential v alone. Per unit of the moment, a current times a length, H about it and, times the
admittance of free space, E along the normal are

    H_φ = (1/(x a²)) Σ (2n+1)/4π (ξₙ/ξₙ') dPₙ(cos s)/ds,   φ = n × (direction of the path)
    E_n = -i/(x² a²) Σ (2n+1)/4π n(n+1) (ξₙ/ξₙ') Pₙ(cos s)

By reciprocity E_n of a slot, a magnetic moment p, is minus the H along p of the monopole. On the plane fields of a slot
on a slot and of a monopole on a monopole are twice ik (1 + ∇∇/k²) e^{ikr}/(4πr), those between both twice
∇ e^{ikr}/(4πr) × n, -2ik (1 + i/kr) e^{ikr}/(4πr). Terms grow like n^(3/2); faded out smoothly to all orders they sum
to Abel's limit.

On other bodies by electric dipoles inside (`tests.reference.dipoles`), with the moments at some heights h above their
ports, and their images: the field is H(0) + H₁ h + H₂ h² + ....
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tests.reference.clouds import Body, Cloud, images
from tests.reference.conditions import ComplexArray, FloatArray, positive
from tests.reference.dipoles import _field, _matrix, _tangential, _tangents
from tests.reference.fundamental import by_parity
from tests.reference.hard_ports import AROUND, CENTRE, FIT_RINGS, RINGS, around

TERMS = 6_000
"""Partial waves: with twice as many nothing changes by 1e-9 at 5 degrees and ka = 100."""


Field = Callable[[FloatArray, FloatArray, FloatArray, float], ComplexArray]


def sphere_slots(
    wavenumber: float, radius: float, angles: ArrayLike, *, terms: int = TERMS
) -> tuple[ComplexArray, ComplexArray]:
    """Fields across and along, 1/L², at angles (m,) from the dipole, radians, neither 0 nor pi: (m,), (m,)."""
    positive(wavenumber=wavenumber, radius=radius)
    x, s = wavenumber * radius, np.asarray(angles, dtype=float)
    c, sine = np.cos(s), np.sin(s)
    # slopes of F and D, and their negative Laplacians
    slopes, values = np.zeros((2, *s.shape), dtype=complex), np.zeros((2, *s.shape), dtype=complex)
    for n, weight, soft, before, value in partial_waves(x, c, terms):
        slope = -n * (before - c * value) / sine
        for row, factor in enumerate((soft, 1 / soft)):
            slopes[row] += weight * factor / (n * (n + 1)) * slope
            values[row] += weight * factor * value
    second = -values - c / sine * slopes
    factor = -1j / radius**2
    return factor * (slopes[0] / sine - second[1]), factor * (second[0] - slopes[1] / sine)


def partial_waves(x: float, c: FloatArray, terms: int) -> Iterator[tuple[int, float, complex, FloatArray, FloatArray]]:
    """Of so many terms n, (2n+1)/4π faded, ξₙ'/ξₙ at x, and Pₙ₋₁ and Pₙ at c = cos s (m,)."""
    # hₙ₋₁/hₙ, upwards, where ξₙ'/ξₙ = hₙ₋₁/hₙ - n/x
    ratio = 1j
    before, value = np.ones_like(c), c.copy()
    for n in range(1, terms):
        ratio = 1 / ((2 * n - 1) / x - ratio)
        yield n, (2 * n + 1) / (4 * np.pi) * fade(n / terms), ratio - n / x, before, value
        before, value = value, ((2 * n + 1) * c * value - n * before) / (n + 1)


def plane_slots(wavenumber: float, distances: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
    """The same on a plane, at distances (m,), L."""
    s = np.asarray(distances, dtype=float)
    inverse = 1j / (wavenumber * s)
    wave = 1j * wavenumber * np.exp(1j * wavenumber * s) / (2 * np.pi * s)
    return wave * (1 + inverse + inverse**2), -2 * wave * inverse * (1 + inverse)


def fade(share: float) -> float:
    """1 up to a third, 0 at 1, smooth to all orders."""
    u = min(max(1.5 * share - 0.5, 0.0), 1.0)
    if u in (0.0, 1.0):
        return 1.0 - u
    return float(0.5 - 0.5 * np.tanh(0.5 / (1 - u) - 0.5 / u))


@dataclass(frozen=True)
class CoupledSlots:
    """Fields H, times the impedance of free space, of slots along two tangents at each of s ports, 1/L².

    Attributes
    ----------
    ports, points : (s, 3), (n, 3), L
    tangents : (s, 2, 3)
        Along the slots.
    values : (n, s, 2, 3)
    spread : (n, s)
        What all heights and all but the largest differ by, the largest of both slots.
    """

    ports: FloatArray
    points: FloatArray
    tangents: FloatArray
    values: ComplexArray
    spread: FloatArray


def coupled_slots(
    body: Body,
    wavenumber: float,
    sources: ArrayLike,
    points: ArrayLike,
    *,
    depth: float,
    heights: tuple[float, ...],
    per_wavelength: float = 7.0,
) -> CoupledSlots:
    """Fields of slots in a conductor; parameters as of `tests.reference.hard_ports.coupled`."""
    fields = electric, field_of_moments, magnetic_of_electric
    given = depth, heights, per_wavelength
    ports, x, tangents, (values, fewer) = between(body, wavenumber, sources, points, slots_along, fields, *given)
    spread = np.max(np.linalg.norm(values - fewer, axis=3), axis=2)
    return CoupledSlots(ports, x, tangents, values, spread)


def between(
    body: Body,
    wavenumber: float,
    sources: ArrayLike,
    points: ArrayLike,
    moments_of: Callable[[Body, FloatArray], FloatArray],
    fields: tuple[Field, Field, Field],
    depth: float,
    heights: tuple[float, ...],
    per_wavelength: float,
) -> tuple[FloatArray, FloatArray, FloatArray, tuple[ComplexArray, ComplexArray]]:
    """Ports (s, 3), points (n, 3), the ports' moments (s, a, 3), and their fields on the body, as of `on_body`.

    Parameters as of `coupled_slots`, and those of `from_above`.
    """
    positive(wavenumber=wavenumber, depth=depth)
    x, ports = (body.map(np.asarray(given, dtype=float)) for given in (points, sources))
    moments = moments_of(body, ports)
    field = from_above(
        body,
        wavenumber,
        np.asarray(sources, dtype=float),
        x,
        moments,
        fields,
        depth=depth,
        heights=heights,
        per_wavelength=per_wavelength,
    )
    return ports, x, moments, on_body(field, heights)


def slots_along(body: Body, points: FloatArray) -> FloatArray:
    """Two unit tangents (n, 2, 3) at points of a body."""
    return np.stack(_tangents(outward(body, points)), axis=1)


def monopoles_at(body: Body, points: FloatArray) -> FloatArray:
    """Unit normals (n, 1, 3) at points of a body."""
    return outward(body, points)[:, None]


def outward(body: Body, points: FloatArray) -> FloatArray:
    """Unit normals (n, 3) at points of a body."""
    normals = body.gradient(points)
    return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))


def from_above(
    body: Body,
    k: float,
    X: FloatArray,
    x: FloatArray,
    moments: FloatArray,
    fields: tuple[Field, Field, Field],
    *,
    depth: float,
    heights: tuple[float, ...],
    per_wavelength: float,
) -> ComplexArray:
    """Fields (n, 3, heights, s, a) at points x (n, 3) of moments (s, a, 3) at heights above ports, on a conductor.

    ``fields`` are E of a moment and what is asked for of a moment and of an electric dipole inside.
    """
    seen_of, field_of, dipole_field = fields
    ports, h, each = body.map(X), np.asarray(heights, dtype=float), moments.shape[1]
    normals = outward(body, ports)
    # each with its image in the tangent plane, which leaves little for the dipoles inside
    pair = [
        np.concatenate([np.repeat(ports + side * height * normals, each, axis=0) for height in h]) for side in (1, -1)
    ]
    moments = np.tile(moments.reshape(-1, 3), (len(h), 1))
    # each port in the fundamental domain, where its mirror images are one
    local = np.abs(X) if len(body.mirrors) == 3 else X
    spacing = 2 * np.pi / k / per_wavelength
    fit, under = (body.spread(spacing * ratio) for ratio in (1 / np.sqrt(1.7), 1.0))
    fit = _joined([fit, *(around(body, one, h[0] * FIT_RINGS, 2 * AROUND) for one in local)])
    near = [around(body, one, h[0] * RINGS, AROUND) for one in local]
    own = body.map(local)
    below = [Cloud(own, outward(body, own))] * len(CENTRE)
    deep = np.repeat(np.minimum(np.maximum(0.7 * h[0], 0.6 * h[0] * RINGS), depth), AROUND)
    depths = [np.full(len(under), depth), *[deep] * len(near), *(np.full(len(own), h[0] * c) for c in CENTRE)]
    inside = _joined([under, *near, *below])
    y = np.tile(inside.points - np.concatenate(depths)[:, None] * inside.normals, (2, 1))
    p = np.concatenate(_tangents(inside.normals))
    group = images(body.mirrors)
    seen = [sum(g[:, None] * seen_of(fit.points * g, z, moments, k) for z in pair) for g in group]
    waves = np.stack([_tangential(fit, np.asarray(field)) for field in seen])
    strengths = by_parity(body.mirrors, [_matrix(fit, y * g, p * g, k) for g in group], waves)
    field = np.asarray(sum(field_of(x, z, moments, k) for z in pair))
    for g, q in zip(group, strengths, strict=True):
        field += dipole_field(x, y * g, p * g, k) @ q
    return np.asarray(field.reshape(len(x), 3, len(h), -1, each))


def on_body(field: ComplexArray, heights: tuple[float, ...]) -> tuple[ComplexArray, ComplexArray]:
    """Values (n, s, a, 3) at height 0 of fields (n, 3, heights, s, a), from all heights and all but the largest."""
    h = np.asarray(heights, dtype=float)
    values, fewer = (
        np.einsum("h,nchsa->nsac", np.linalg.inv(h[:m, None] ** np.arange(m, dtype=float))[0], field[:, :, :m])
        for m in (len(h), len(h) - 1)
    )
    return values, fewer


def _joined(clouds: list[Cloud]) -> Cloud:
    return Cloud(*(np.concatenate([getattr(cloud, name) for cloud in clouds]) for name in ("points", "normals")))


def _away(x: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distances and directions of points from sources: (n, s), (n, s, 3)."""
    away = x[:, None] - z
    distance = np.linalg.norm(away, axis=2)
    return distance, away / distance[:, :, None]


def electric(x: FloatArray, z: FloatArray, p: FloatArray, k: float) -> ComplexArray:
    """E of magnetic moments p at z (s, 3), -∇ e^{ikr}/(4πr) × p: (n, 3, s)."""
    r, s = _away(x, z)
    g = np.exp(1j * k * r) / (4 * np.pi * r)
    return np.moveaxis(-(g * (1j * k - 1 / r))[:, :, None] * np.cross(s, p), 2, 1)


def field_of_moments(x: FloatArray, z: FloatArray, p: FloatArray, k: float) -> ComplexArray:
    """H of magnetic, E of electric moments, ik (1 + ∇∇/k²) e^{ikr}/(4πr): (n, 3, s)."""
    r, s = _away(x, z)
    g, near = 1j * k * np.exp(1j * k * r) / (4 * np.pi * r), 1 / (k * r) ** 2 - 1j / (k * r)
    along = g * (3 * near - 1) * np.sum(s * p, axis=2)
    return np.moveaxis((g * (1 - near))[:, :, None] * p + along[:, :, None] * s, 2, 1)


def magnetic_of_electric(x: FloatArray, y: FloatArray, p: FloatArray, k: float) -> ComplexArray:
    """H of the dipoles of `tests.reference.dipoles`: (n, 3, s)."""
    r, s = _away(x, y)
    g = np.exp(1j * k * r) / r * (k * k + 1j * k / r)
    return np.moveaxis(g[:, :, None] * np.cross(s, p), 2, 1)


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
    """H at slots of monopoles at the sources; parameters as of `tests.reference.hard_ports.coupled`."""
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
    """E_n at monopoles of slots at the sources; parameters as of `tests.reference.hard_ports.coupled`."""
    fields = electric, electric, _field
    given = depth, heights, per_wavelength
    ports, x, tangents, both = between(body, wavenumber, sources, points, slots_along, fields, *given)
    values, fewer = (np.einsum("nsac,nc->nsa", one, outward(body, x)) for one in both)
    return Received(ports, x, tangents, values, np.max(np.abs(values - fewer), axis=2))


def _magnetic(x: FloatArray, z: FloatArray, p: FloatArray, k: float) -> ComplexArray:
    """H of electric moments p at z (s, 3), ∇ e^{ikr}/(4πr) × p: (n, 3, s)."""
    return -electric(x, z, p, k)


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
    """Fields of monopoles on a conductor; parameters as of `tests.reference.hard_ports.coupled`."""
    fields = field_of_moments, field_of_moments, _field
    given = depth, heights, per_wavelength
    ports, x, _, both = between(body, wavenumber, sources, points, monopoles_at, fields, *given)
    values, fewer = (np.einsum("nsac,nc->ns", one, outward(body, x)) for one in both)
    return CoupledMonopoles(ports, x, values, np.abs(values - fewer))
