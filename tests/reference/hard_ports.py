"""The field at points of a hard body of a unit point source e^{ikr}/(4πr) on the body.

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

from tests.reference.clouds import Body, Cloud, images
from tests.reference.conditions import ComplexArray, FloatArray, positive
from tests.reference.fundamental import _boundary_kernel, _kernel, by_parity

TERMS = 20_000
"""Partial waves: good to 1e-9 at ka = 100, where a tenth of them leaves 1e-7."""
RINGS, FIT_RINGS = 0.5 * 1.35 ** np.arange(10), 0.25 * 1.2 ** np.arange(20)
"""Radii around a port, in the least height, of fundamental solutions and of points of the condition."""
AROUND, CENTRE = 12, (0.7, 1.0, 1.5, 2.2)
"""Fundamental solutions on a ring, and depths of those below the port itself, in the least height."""


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
    below = [around(body, one, h[0] * RINGS, AROUND) for one in local]
    y = [under.points - depth * under.normals]
    deep = np.repeat(np.minimum(np.maximum(0.7 * h[0], 0.6 * h[0] * RINGS), depth), AROUND)
    y += [cloud.points - deep[:, None] * cloud.normals for cloud in below]
    y += [cloud.points[:1] - h[0] * below_port * cloud.normals[:1] for cloud in below for below_port in CENTRE]
    dense = [around(body, one, h[0] * FIT_RINGS, 2 * AROUND) for one in local]
    fit = Cloud(*(np.concatenate([getattr(c, name) for c in (fit, *dense)]) for name in ("points", "normals")))
    normals = body.gradient(ports)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    z = np.concatenate([ports + height * normals for height in h])
    group, sources_inside = images(body.mirrors), np.concatenate(y)
    blocks = [_boundary_kernel(fit, sources_inside * g, k, 0.0, 1.0) for g in group]
    waves = np.stack([_boundary_kernel(Cloud(fit.points * g, fit.normals * g), z, k, 0.0, 1.0) for g in group])
    strengths = np.concatenate(by_parity(body.mirrors, blocks, waves))
    everywhere = np.concatenate([sources_inside * g for g in group])
    worst = 0.0
    for g in group:
        part = Cloud(checks.points * g, checks.normals * g)
        left = _boundary_kernel(part, everywhere, k, 0.0, 1.0) @ strengths + _boundary_kernel(part, z, k, 0.0, 1.0)
        worst = max(worst, float(np.max(np.abs(left))) / (4 * np.pi))
    total = (_kernel(x, everywhere, k) @ strengths + _kernel(x, z, k)).reshape(len(x), len(h), -1) / (4 * np.pi)
    values, fewer = (np.tensordot(_to_zero(h[:n]), total[:, :n], axes=(0, 1)) for n in (len(h), len(h) - 1))
    return Coupled(ports, x, values, np.abs(values - fewer), worst)


def around(body: Body, X: FloatArray, radii: FloatArray, count: int) -> Cloud:
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


def _to_zero(heights: FloatArray) -> FloatArray:
    """Weights of values at heights (n,) for that at 0 of 1, h², h³, ..."""
    powers = np.stack([np.ones_like(heights), *(heights ** (2 + i) for i in range(len(heights) - 1))], axis=1)
    return np.asarray(np.linalg.inv(powers)[0])
