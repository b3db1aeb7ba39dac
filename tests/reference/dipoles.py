"""Scattering by smooth perfect conductors with no series: electric dipoles inside, fitted on the surface.

Two dipoles p, across the normal, stand at each y = x - depth n; with R = |x - y| and s = (x - y)/R

    E = {[k² - (1/R² - ik/R)] p + [3 (1/R² - ik/R) - k²] s (s.p)} e^{ikR}/R,    f = k² [p - r (r.p)] e^{-ik r.y}
    H = (k² + ik/R) s x p e^{ikR}/R

and n x (E + E_inc) = 0 is met in least squares, as in `tests.reference.fundamental`: with m mirrors g there are 2^m
parity classes, whose dipoles at g y have the moments chi(g) g p. The residual, on points of its own, bounds the error.

Also here: the field at points of a hard body of a unit point source e^{ikr}/(4πr) on the body.

On a sphere of radius a, at angle s from the source, by partial waves

    u = -(1/4πka²) Σ (2n+1) hₙ/hₙ' Pₙ(cos s),   hₙ/hₙ' -> -ka/(n+1)
    Σ (2n+1)/(n+1) Pₙ = 1/S - log(1 + 1/S),   S = sin(s/2)

the limit summed in closed form, the rest with its terms faded out; hₙ/hₙ₋₁ is climbed by its recurrence.

On other bodies by the method of fundamental solutions (`tests.reference.fundamental`), with sources at some heights h
above their ports: the condition ∂u/∂n = 0 makes u(h) = u(0) + u₂ h² + u₃ h³ + ..., by reciprocity.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tests.reference.clouds import Body, Cloud, Spread, images
from tests.reference.fundamental import BLOCK, _boundary_kernel, _kernel, least_squares
from tests.reference.section_shapes import ComplexArray, FloatArray, positive

TERMS = 20_000
"""Partial waves: good to 1e-9 at ka = 100, where a tenth of them leaves 1e-7."""
_LEVI_CIVITA = np.array(
    [[[0, 0, 0], [0, 0, 1], [0, -1, 0]], [[0, 0, -1], [0, 0, 0], [1, 0, 0]], [[0, 1, 0], [-1, 0, 0], [0, 0, 0]]]
)
RINGS, FIT_RINGS = 0.5 * 1.35 ** np.arange(10), 0.25 * 1.2 ** np.arange(20)
"""Radii around a port, in the least height, of fundamental solutions and of points of the condition."""
AROUND, CENTRE = 12, (0.7, 1.0, 1.5, 2.2)
"""Fundamental solutions on a ring, and depths of those below the port itself, in the least height."""


@dataclass(frozen=True)
class ConductorSolution:
    """Scattered fields of a conductor for plane waves, E0 along theta and phi of each.

    Attributes
    ----------
    wavenumber : float, 1/L
    directions : (d, 3)
    sources : (n, 3), L
    moments : (n, 3, d, 2), L
    residual : (d, 2)
        Largest tangential E on test points, |E0| = 1.
    """

    wavenumber: float
    directions: FloatArray
    sources: FloatArray
    moments: ComplexArray
    residual: FloatArray

    def far_field(self, r: ArrayLike) -> ComplexArray:
        """Far field, L, theta and phi scattered by theta and phi incident (last axis): (m, 3) -> (m, d, 2, 2)."""
        r = np.asarray(r, dtype=float)
        k = self.wavenumber
        phases = k * k * np.exp(-1j * k * (r @ self.sources.T))
        sums = (phases @ self.moments.reshape(len(self.sources), -1)).reshape(len(r), *self.moments.shape[1:])
        return np.asarray(np.einsum("moc,mcdi->mdoi", frames(r), sums))

    def total(self, x: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Total E and H at points on and off the body, for theta and phi incident: (m, 3) -> (m, 3, d, 2) each."""
        x = np.asarray(x, dtype=float)
        k, shape = self.wavenumber, (-1, 3, len(self.directions), 2)
        wave = np.exp(1j * k * (x @ self.directions.T))[:, None, :, None]
        e0 = np.moveaxis(frames(self.directions), 2, 0)
        h0 = np.moveaxis(np.cross(self.directions[:, None], frames(self.directions)), 2, 0)
        q = self.moments.reshape(3 * len(self.sources), -1)
        step = max(1, BLOCK // (9 * len(self.sources)))
        parts = []
        for first in range(0, len(x), step):
            some = x[first : first + step]
            away = some[:, None] - self.sources
            distance = np.linalg.norm(away, axis=2)
            s = away / distance[:, :, None]
            g, near = np.exp(1j * k * distance) / distance, 1 / distance**2 - 1j * k / distance
            along = (g * (3 * near - k * k))[:, :, None] * s
            # (m, 3, n, 3): components of the field, then of the moments
            E = np.einsum("mnc,mne->mcne", along, s)
            E += np.einsum("mn,ce->mcne", g * (k * k - near), np.eye(3))
            turned = (g * (k * k + 1j * k / distance))[:, :, None] * s
            H = np.einsum("mnb,bec->mcne", turned, _LEVI_CIVITA)
            parts.append([(part.reshape(3 * len(some), -1) @ q).reshape(shape) for part in (E, H)])
        scattered = (np.concatenate(part) for part in zip(*parts, strict=True))
        return tuple(wave * one + its for one, its in zip((e0, h0), scattered, strict=True))


def frames(directions: ArrayLike) -> FloatArray:
    """theta and phi unit vectors at unit directions, phi = 0 at the poles: (m, 3) -> (m, 2, 3)."""
    r = np.asarray(directions, dtype=float)
    polar, azimuth = np.arccos(np.clip(r[:, 2], -1, 1)), np.arctan2(r[:, 1], r[:, 0])
    c, s = np.cos(azimuth), np.sin(azimuth)
    theta = np.stack([np.cos(polar) * c, np.cos(polar) * s, -np.sin(polar)], axis=-1)
    return np.stack([theta, np.stack([-s, c, 0 * c], axis=-1)], axis=1)


def _tangents(normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    spare = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    first = np.cross(spare, normals)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(normals, first)


def _tangential(cloud: Cloud, field: ComplexArray) -> ComplexArray:
    """Tangential components of E (n, 3, c): (2n, c)."""
    return np.concatenate([np.einsum("nc,nci->ni", t, field) for t in _tangents(cloud.normals)])


def _field(x: FloatArray, y: FloatArray, p: FloatArray, k: float) -> ComplexArray:
    """E of unit dipoles p (s, 3) at y (s, 3): (n, 3, s)."""
    away = x[:, None] - y
    distance = np.linalg.norm(away, axis=2)
    away = away / distance[:, :, None]
    g = np.exp(1j * k * distance) / distance
    near = 1 / distance**2 - 1j * k / distance
    along = g * (3 * near - k * k) * np.einsum("nsc,sc->ns", away, p)
    across = g * (k * k - near)
    return np.moveaxis(across[:, :, None] * p + along[:, :, None] * away, 2, 1)


def _matrix(cloud: Cloud, y: FloatArray, p: FloatArray, k: float) -> ComplexArray:
    """Tangential E of dipoles at the points of a cloud (2n, s), in blocks of points."""
    step = max(1, BLOCK // (3 * len(y)))
    pieces = (slice(i, i + step) for i in range(0, len(cloud), step))
    parts = [Cloud(cloud.points[i], cloud.normals[i]) for i in pieces]
    both = [_tangential(part, _field(part.points, y, p, k)).reshape(2, len(part), -1) for part in parts]
    return np.concatenate(both, axis=1).reshape(2 * len(cloud), -1)


def _wave(cloud: Cloud, directions: FloatArray, amplitudes: FloatArray, k: float) -> ComplexArray:
    """Tangential E of plane waves d (d, 3), E0 (d, 2, 3): (2n, 2d)."""
    phase = np.exp(1j * k * (cloud.points @ directions.T))
    field = np.einsum("nd,dic->ncdi", phase, amplitudes)
    return _tangential(cloud, field.reshape(len(cloud), 3, -1))


def scatter(
    body: Spread,
    wavenumber: float,
    directions: ArrayLike,
    *,
    depth: float,
    per_wavelength: float = 6.0,
    least: int = 1500,
) -> ConductorSolution:
    """Solve for a body; parameters as of `tests.reference.fundamental.scatter`."""
    positive(wavenumber=wavenumber, depth=depth)
    k, d = wavenumber, np.atleast_2d(np.asarray(directions, dtype=float))
    spacing = min(2 * np.pi / k / per_wavelength, np.sqrt(body.area() / least))
    under, points, checks = (body.spread(h) for h in (spacing, spacing / np.sqrt(1.5), spacing * 1.37))
    y = np.tile(under.points - depth * under.normals, (2, 1))
    p = np.concatenate(_tangents(under.normals))
    group, mirrors = images(body.mirrors), list(body.mirrors)
    odd = (group[:, mirrors] < 0).astype(int)
    characters = np.where(odd @ odd.T % 2, -1.0, 1.0)
    # the wave g E(g x) has the direction g d and the amplitude g E0
    waves = np.stack([_wave(points, d * g, frames(d) * g, k) for g in group])
    blocks = [_matrix(points, y * g, p * g, k) for g in group]
    classes = []
    for signs in characters:
        matrix = sum(sign * block for sign, block in zip(signs, blocks, strict=True))
        classes.append(least_squares(np.asarray(matrix), np.asarray(-np.tensordot(signs, waves, axes=1) / len(group))))
    strengths = [np.tensordot(signs, np.stack(classes), axes=1) for signs in characters.T]
    moments = [(p * g)[:, :, None] * q[:, None] for g, q in zip(group, strengths, strict=True)]
    sources, q = np.concatenate([y * g for g in group]), np.concatenate(strengths)
    everywhere = np.concatenate([p * g for g in group])
    residual = np.zeros(2 * len(d))
    for g in group:
        seen = Cloud(checks.points * g, checks.normals * g)
        left = _matrix(seen, sources, everywhere, k) @ q + _wave(seen, d, frames(d), k)
        residual = np.maximum(residual, np.max(np.abs(left), axis=0))
    shape = len(d), 2
    return ConductorSolution(k, d, sources, np.concatenate(moments).reshape(-1, 3, *shape), residual.reshape(shape))


def sphere_coupling(wavenumber: float, radius: float, angles: ArrayLike) -> ComplexArray:
    """Field u, 1/L, on a hard sphere at angles (m,) from the source, radians, not 0: (m,)."""
    positive(wavenumber=wavenumber, radius=radius)
    x, s = wavenumber * radius, np.asarray(angles, dtype=float)
    c, S = np.cos(s), np.sin(0.5 * s)
    here = -1j + 0j
    before, value = np.zeros_like(c), np.ones_like(c)
    total = np.zeros(s.shape, dtype=complex)
    for n in range(TERMS):
        fade = 0.5 * (1 + np.cos(np.pi * max(0.0, 3 * n / TERMS - 2)))
        ratio = 1 / (x / here - (n + 1))
        total += fade * (2 * n + 1) * (ratio + 1 / (n + 1)) * value
        before, value = value, ((2 * n + 1) * c * value - n * before) / (n + 1)
        here = (2 * n + 1) / x - 1 / here
    return np.asarray((1 / S - np.log(1 + 1 / S) - total) / (4 * np.pi * radius))


@dataclass(frozen=True)
class Coupled:
    """Fields u, 1/L, at n points from m sources on the body.

    Attributes
    ----------
    ports, points : (m, 3), (n, 3), L
    values : (n, m)
    spread : (n, m)
        What all heights and all but the largest differ by.
    residual : float
        Largest k⁻¹ ∂u/∂n on test points, 1/L.
    """

    ports: FloatArray
    points: FloatArray
    values: ComplexArray
    spread: FloatArray
    residual: float


def coupled(
    body: Body,
    wavenumber: float,
    sources: ArrayLike,
    points: ArrayLike,
    *,
    depth: float,
    heights: tuple[float, ...],
    per_wavelength: float = 8.0,
) -> Coupled:
    """Fields of point sources on a hard body with mirrors.

    Below each port fundamental solutions are as dense as the sources above it are low.

    Parameters
    ----------
    body : Body
    wavenumber : float, 1/L
    sources, points : (m, 3), (n, 3)
        Unit vectors whose images on the body are the ports and the points.
    depth, heights : float, L
        Of the fundamental solutions below the body and of the sources above it, ascending.
    per_wavelength : float
        Fundamental solutions a wavelength.
    """
    positive(wavenumber=wavenumber, depth=depth)
    k, X = wavenumber, np.asarray(sources, dtype=float)
    x, ports = body.map(np.asarray(points, dtype=float)), body.map(X)
    spacing = 2 * np.pi / k / per_wavelength
    fit, under, checks = (body.spread(spacing * ratio) for ratio in (1 / np.sqrt(2), 1.0, 1.37))
    # each port in the fundamental domain, where its mirror images are one
    local = np.abs(X) if len(body.mirrors) == 3 else X
    h = np.asarray(heights, dtype=float)
    below = [_around(body, one, h[0] * RINGS, AROUND) for one in local]
    y = [under.points - depth * under.normals]
    deep = np.repeat(np.minimum(np.maximum(0.7 * h[0], 0.6 * h[0] * RINGS), depth), AROUND)
    y += [cloud.points - deep[:, None] * cloud.normals for cloud in below]
    y += [cloud.points[:1] - h[0] * below_port * cloud.normals[:1] for cloud in below for below_port in CENTRE]
    dense = [_around(body, one, h[0] * FIT_RINGS, 2 * AROUND) for one in local]
    fit = Cloud(*(np.concatenate([getattr(c, name) for c in (fit, *dense)]) for name in ("points", "normals")))
    normals = body.gradient(ports)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    z = np.concatenate([ports + height * normals for height in h])
    strengths, everywhere, group = _fitted(body, k, fit, np.concatenate(y), z)
    worst = 0.0
    for g in group:
        part = Cloud(checks.points * g, checks.normals * g)
        left = _boundary_kernel(part, everywhere, k, 0.0, 1.0) @ strengths + _boundary_kernel(part, z, k, 0.0, 1.0)
        worst = max(worst, float(np.max(np.abs(left))) / (4 * np.pi))
    total = (_kernel(x, everywhere, k) @ strengths + _kernel(x, z, k)).reshape(len(x), len(h), -1) / (4 * np.pi)
    values, fewer = (np.tensordot(_to_zero(h[:n]), total[:, :n], axes=(0, 1)) for n in (len(h), len(h) - 1))
    return Coupled(ports, x, values, np.abs(values - fewer), worst)


def _around(body: Body, X: FloatArray, radii: FloatArray, count: int) -> Cloud:
    """Points on rings of the given radii, L, around the image of a unit vector."""
    one = np.cross(X, np.eye(3)[np.argmin(np.abs(X))])
    one /= np.linalg.norm(one)
    two = np.cross(X, one)
    # rings are as wide as asked for on the body, each by itself
    scale = np.linalg.norm(body.map(X + 1e-5 * one) - body.map(X)) / 1e-5
    found = []
    for number, radius in enumerate(radii):
        phi = 2 * np.pi * (np.arange(count) + 0.5 * (number % 2)) / count
        aside = X + radius / scale * (np.cos(phi)[:, None] * one + np.sin(phi)[:, None] * two)
        found.append(aside / np.linalg.norm(aside, axis=1, keepdims=True))
    points = body.map(np.concatenate(found))
    normals = body.gradient(points)
    return Cloud(points, normals / np.linalg.norm(normals, axis=-1, keepdims=True))


def _fitted(
    body: Body, k: float, fit: Cloud, y: FloatArray, z: FloatArray
) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Strengths (s, m) at all images (s, 3) of the places y, for sources at z (m, 3), and the group of reflections."""
    group = images(body.mirrors)
    odd = group[:, list(body.mirrors)] < 0
    characters = np.where(odd.astype(int) @ odd.T.astype(int) % 2, -1.0, 1.0)
    blocks = [_boundary_kernel(fit, y * g, k, 0.0, 1.0) for g in group]
    waves = np.stack([_boundary_kernel(Cloud(fit.points * g, fit.normals * g), z, k, 0.0, 1.0) for g in group])
    classes = []
    for signs in characters:
        matrix = np.asarray(sum(sign * block for sign, block in zip(signs, blocks, strict=True)), dtype=complex)
        right = np.asarray(-np.tensordot(signs, waves, axes=1) / len(group), dtype=complex)
        classes.append(least_squares(matrix, right))
    strengths = np.concatenate([np.tensordot(signs, np.stack(classes), axes=1) for signs in characters.T])
    return strengths, np.concatenate([y * g for g in group]), group


def _to_zero(heights: FloatArray) -> FloatArray:
    """Weights of values at heights (n,) for that at 0 of 1, h², h³, ..."""
    powers = np.stack([np.ones_like(heights), *(heights ** (2 + i) for i in range(len(heights) - 1))], axis=1)
    return np.asarray(np.linalg.inv(powers)[0])
