"""Scattering by smooth perfect conductors with no series: electric dipoles inside, fitted on the surface.

Two dipoles p, across the normal, stand at each y = x - depth n; with R = |x - y| and s = (x - y)/R

    E = {[k² - (1/R² - ik/R)] p + [3 (1/R² - ik/R) - k²] s (s.p)} e^{ikR}/R,    f = k² [p - r (r.p)] e^{-ik r.y}
    H = (k² + ik/R) s x p e^{ikR}/R

and n x (E + E_inc) = 0 is met in least squares, as in `tests.reference.fundamental`: with m mirrors g there are 2^m
parity classes, whose dipoles at g y have the moments chi(g) g p. The residual, on points of its own, bounds the error.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tests.reference.clouds import Cloud, Spread, images
from tests.reference.conditions import ComplexArray, FloatArray, positive
from tests.reference.fundamental import BLOCK, by_parity

_LEVI_CIVITA = np.array(
    [[[0, 0, 0], [0, 0, 1], [0, -1, 0]], [[0, 0, -1], [0, 0, 0], [1, 0, 0]], [[0, 1, 0], [-1, 0, 0], [0, 0, 0]]]
)


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
    group = images(body.mirrors)
    # the wave g E(g x) has the direction g d and the amplitude g E0
    waves = np.stack([_wave(points, d * g, frames(d) * g, k) for g in group])
    strengths = by_parity(body.mirrors, [_matrix(points, y * g, p * g, k) for g in group], waves)
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
