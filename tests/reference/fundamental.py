"""Scattering by smooth closed bodies with no series: the method of fundamental solutions.

Point sources stand inside, at y = x - depth n, and their strengths are fitted on the surface in least squares:

    u_s(x) = Σ_j q_j G(x, y_j),    G = e^{ikR}/R,    R = |x - y|
    alpha u_s + (beta/k) ∂u_s/∂n = -(alpha + i beta d.n) e^{ik d.x},    f(r) = Σ_j q_j e^{-ik r.y_j}

On a body with m mirrors the plane wave falls into 2^m parity classes s, each solved on the fundamental domain alone,

    u_s = 2^{-m} Σ_g chi_s(g) u_inc(g x),    G_s(x, y) = Σ_g chi_s(g) G(x, g y)

with one factorisation a class for all directions. The residual of the condition, on points of its own, bounds the
error: by uniqueness the exact scattered field is a sum of the found one and what radiates from the residual.

A point source e^{ikR}/(4πR) beside the body is solved without classes: for a few thousand sources inside.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import qr, solve_triangular

from tests.reference.clouds import Body, Cloud, Spread, images
from tests.reference.conditions import Boundary, ComplexArray, FloatArray, condition, positive

BLOCK = 4_000_000
"""Entries of a kernel matrix held at once, 64 MB."""


@dataclass(frozen=True)
class Solution:
    """Scattered fields of a body for several plane waves.

    Attributes
    ----------
    wavenumber : float, 1/L
    directions : (d, 3)
        Unit vectors, where the waves go.
    sources : (n, 3), L
    strengths : (n, d), L
    residual : (d,)
        Largest boundary residual on test points; of u when soft, (1/k) ∂u/∂n + i eta u otherwise, |u_inc| = 1.
    """

    wavenumber: float
    directions: FloatArray
    sources: FloatArray
    strengths: ComplexArray
    residual: FloatArray

    def field(self, points: ArrayLike) -> ComplexArray:
        """Scattered field on and outside the body: (n, 3) -> (n, d)."""
        x = np.asarray(points, dtype=float)
        step = max(1, BLOCK // len(self.sources))
        parts = [_kernel(x[i : i + step], self.sources, self.wavenumber) for i in range(0, len(x), step)]
        return np.concatenate([part @ self.strengths for part in parts])

    def normal_derivative(self, points: ArrayLike, normals: ArrayLike) -> ComplexArray:
        """n.grad of the total field, 1/L: (n, 3), (n, 3) -> (n, d)."""
        x, n = np.asarray(points, dtype=float), np.asarray(normals, dtype=float)
        step, k = max(1, BLOCK // len(self.sources)), self.wavenumber
        pieces = [slice(i, i + step) for i in range(0, len(x), step)]
        slopes = [_boundary_kernel(Cloud(x[i], n[i]), self.sources, k, 0.0, k) @ self.strengths for i in pieces]
        incident = 1j * k * (n @ self.directions.T) * np.exp(1j * k * (x @ self.directions.T))
        return np.asarray(np.concatenate(slopes) + incident)

    def total(self, points: ArrayLike) -> ComplexArray:
        """Incident and scattered field on and outside the body: (n, 3) -> (n, d)."""
        x = np.asarray(points, dtype=float)
        return np.asarray(np.exp(1j * self.wavenumber * (x @ self.directions.T)) + self.field(x))

    def far_field(self, r: ArrayLike) -> ComplexArray:
        """Far field f, L, u_s ~ f e^{ikR}/R, in unit directions r: (m, 3) -> (m, d)."""
        phases = np.exp(-1j * self.wavenumber * (np.asarray(r, dtype=float) @ self.sources.T))
        return np.asarray(phases @ self.strengths)


def _kernel(x: FloatArray, y: FloatArray, k: float) -> ComplexArray:
    """e^{ikR}/R, 1/L: (n, 3), (s, 3) -> (n, s)."""
    distance = np.sqrt(_squares(x, y))
    return np.asarray(np.exp(1j * k * distance) / distance)


def _squares(x: FloatArray, y: FloatArray) -> FloatArray:
    """R², L², by differences, since |x|² + |y|² - 2 x.y loses digits near the source."""
    return np.asarray(sum(np.subtract.outer(x[:, i], y[:, i]) ** 2 for i in range(3)))


def _boundary_kernel(cloud: Cloud, y: FloatArray, k: float, alpha: complex, beta: complex) -> ComplexArray:
    """alpha G + (beta/k) n.grad G, n.grad G = (ik - 1/R) G n.(x-y)/R: (n, s)."""
    distance = np.sqrt(_squares(cloud.points, y))
    g = np.exp(1j * k * distance) / distance
    if beta == 0:
        return np.asarray(alpha * g)
    along = np.sum(cloud.points * cloud.normals, axis=-1)[:, None] - cloud.normals @ y.T
    return np.asarray(g * (alpha + beta / k * (1j * k - 1 / distance) * along / distance))


def _incident(cloud: Cloud, k: float, directions: FloatArray, alpha: complex, beta: complex) -> ComplexArray:
    """alpha u + (beta/k) n.grad u of the plane waves: (n, d)."""
    wave = np.exp(1j * k * (cloud.points @ directions.T))
    return np.asarray(wave * (alpha + 1j * beta * (cloud.normals @ directions.T)))


def least_squares(matrix: ComplexArray, right: ComplexArray) -> ComplexArray:
    """Columns of least |matrix q - right|, by QR of both together: Q is never formed."""
    n = matrix.shape[1]
    (upper,) = qr(np.hstack([matrix, right]), mode="r", overwrite_a=True, check_finite=False)
    return np.asarray(solve_triangular(upper[:n, :n], upper[:n, n:], check_finite=False))


def by_parity(mirrors: tuple[int, ...], blocks: list[ComplexArray], waves: ComplexArray) -> ComplexArray:
    """Strengths (g, s, d) at all images of sources, class by class.

    ``blocks`` are what the image g of each source makes at the points (n, s), ``waves`` the condition of the incident
    waves as the image g of the points sees them (g, n, d).
    """
    odd = (images(mirrors)[:, list(mirrors)] < 0).astype(int)
    # chi_s(g) = Π over the mirrors of s that g turns
    characters = np.where(odd @ odd.T % 2, -1.0, 1.0)
    classes = []
    for signs in characters:
        matrix = np.zeros_like(blocks[0])
        for sign, block in zip(signs, blocks, strict=True):
            matrix += sign * block
        right = np.asarray(-np.tensordot(signs, waves, axes=1) / len(characters), dtype=complex)
        classes.append(least_squares(matrix, right))
    # q at the image g y: Σ_s chi_s(g) q_s
    return np.tensordot(characters.T, np.stack(classes), axes=1)


def solve(
    points: ArrayLike,
    normals: ArrayLike,
    wavenumber: float,
    directions: ArrayLike,
    boundary: Boundary,
    *,
    sources: Cloud,
    checks: Cloud,
    depth: float,
    mirrors: tuple[int, ...] = (),
) -> Solution:
    """Fit sources under a cloud to the boundary condition.

    Parameters
    ----------
    points, normals : (n, 3), L and 1
        Where the condition is imposed, about twice as many as sources; x_i > 0 for every mirror i.
    wavenumber : float, 1/L
    directions : (d, 3)
        Unit vectors, where the waves go.
    boundary : "soft", "hard" or complex
        Complex is the impedance number eta.
    sources, checks : Cloud
        Surface points the sources lie under, and points for the residual; x_i > 0 too.
    depth : float, L
        Below the least radius of curvature from inside.
    mirrors : tuple of int
        Axes i whose plane x_i = 0 is a mirror of the body.
    """
    positive(wavenumber=wavenumber, depth=depth)
    alpha, beta = condition(boundary)
    d = np.atleast_2d(np.asarray(directions, dtype=float))
    cloud = Cloud(np.asarray(points, dtype=float), np.asarray(normals, dtype=float))
    if len(cloud) < len(sources) + len(d):
        raise ValueError(
            f"{len(cloud)} points for {len(sources)} sources and {len(d)} waves: take twice as many points"
        )
    group = images(mirrors)
    y = sources.points - depth * sources.normals
    blocks = [_boundary_kernel(cloud, y * g, wavenumber, alpha, beta) for g in group]
    # u_inc(g x) is the wave of direction g d
    waves = np.stack([_incident(cloud, wavenumber, d * g, alpha, beta) for g in group])
    strengths = np.concatenate(by_parity(mirrors, blocks, waves))
    everywhere = np.concatenate([y * g for g in group])
    residual = np.zeros(len(d))
    step = max(1, BLOCK // len(everywhere))
    # the residual is taken on every image: the classes are seen together there
    for g in group:
        for i in range(0, len(checks), step):
            part = Cloud(checks.points[i : i + step] * g, checks.normals[i : i + step] * g)
            left = _boundary_kernel(part, everywhere, wavenumber, alpha, beta) @ strengths
            left += _incident(part, wavenumber, d, alpha, beta)
            residual = np.maximum(residual, np.max(np.abs(left), axis=0))
    return Solution(wavenumber, d, everywhere, strengths, residual)


def scatter(
    body: Spread,
    wavenumber: float,
    directions: ArrayLike,
    boundary: Boundary,
    *,
    depth: float,
    per_wavelength: float = 6.0,
    least: int = 2000,
) -> Solution:
    """Solve for a body, spreading sources, collocation points and test points over it.

    Parameters
    ----------
    body : Spread
    wavenumber : float, 1/L
    directions : (d, 3)
    boundary : "soft", "hard" or complex
    depth : float, L
    per_wavelength : float
        Sources a wavelength; collocation points are √2 times as dense.
    least : int
        Sources on the whole body, at least.
    """
    positive(wavenumber=wavenumber, per_wavelength=per_wavelength)
    spacing = min(2 * np.pi / wavenumber / per_wavelength, np.sqrt(body.area() / least))
    points = body.spread(spacing / np.sqrt(2))
    return solve(
        points.points,
        points.normals,
        wavenumber,
        directions,
        boundary,
        sources=body.spread(spacing),
        checks=body.spread(spacing * 1.37),
        depth=depth,
        mirrors=body.mirrors,
    )


@dataclass(frozen=True, eq=False)
class BesideSource:
    """Field of one point source.

    Attributes
    ----------
    wavenumber : float, 1/L
    position : (3,), L
    sources, strengths : (s, 3), L and (s,)
        Fundamental solutions.
    residual : float
        Largest of the condition at points between those it was fitted at, in the largest of the incident field there.
    """

    wavenumber: float
    position: FloatArray
    sources: FloatArray
    strengths: ComplexArray
    residual: float

    def total(self, points: ArrayLike) -> ComplexArray:
        """Total field on and outside the body: (n, 3) -> (n,)."""
        x = np.asarray(points, dtype=float)
        incident = _kernel(x, self.position[None], self.wavenumber)[:, 0] / (4 * np.pi)
        return np.asarray(incident + _kernel(x, self.sources, self.wavenumber) @ self.strengths)

    def slope(self, points: ArrayLike, normals: ArrayLike) -> ComplexArray:
        """∂u/∂n of the total field on the body, 1/L: (n, 3) x 2 -> (n,)."""
        k, cloud = self.wavenumber, Cloud(np.asarray(points, dtype=float), np.asarray(normals, dtype=float))
        incident = _boundary_kernel(cloud, self.position[None], k, 0.0, k)[:, 0] / (4 * np.pi)
        return np.asarray(incident + _boundary_kernel(cloud, self.sources, k, 0.0, k) @ self.strengths)


def beside_source(
    body: Body,
    wavenumber: float,
    position: ArrayLike,
    boundary: Boundary,
    *,
    depth: float,
    per_wavelength: float = 6.0,
    least: int = 1200,
) -> BesideSource:
    """Solve for a point source outside a body.

    Parameters
    ----------
    body : Body
    wavenumber : float, 1/L
    position : (3,), L
        Outside, no nearer than a few spacings of the fundamental solutions.
    boundary : "soft", "hard" or complex
    depth : float, L
        Of the fundamental solutions under the surface.
    per_wavelength : float
        Fundamental solutions a wavelength.
    least : int
        Fundamental solutions, at least.
    """
    positive(wavenumber=wavenumber, depth=depth, per_wavelength=per_wavelength)
    k, z = wavenumber, np.asarray(position, dtype=float)
    alpha, beta = condition(boundary)
    spacing = min(2 * np.pi / k / per_wavelength, np.sqrt(body.area() / least))
    fit, under, checks = (_whole(body, spacing * ratio) for ratio in (1 / np.sqrt(2), 1.0, 1.37))
    y = under.points - depth * under.normals
    right = -_boundary_kernel(fit, z[None], k, alpha, beta) / (4 * np.pi)
    strengths = least_squares(_boundary_kernel(fit, y, k, alpha, beta), right)[:, 0]
    incident = _boundary_kernel(checks, z[None], k, alpha, beta)[:, 0] / (4 * np.pi)
    left = incident + _boundary_kernel(checks, y, k, alpha, beta) @ strengths
    largest = float(np.max(np.abs(_kernel(checks.points, z[None], k)))) / (4 * np.pi)
    return BesideSource(k, z, y, strengths, float(np.max(np.abs(left))) / largest)


def _whole(body: Body, spacing: float) -> Cloud:
    """Points all over a body, images of those of a part of it."""
    part, group = body.spread(spacing), images(body.mirrors)
    points, normals = (np.concatenate([values * g for g in group]) for values in (part.points, part.normals))
    return Cloud(points, normals)
