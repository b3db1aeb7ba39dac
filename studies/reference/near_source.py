"""A smooth body beside a point source e^{ikR}/(4πR), by fundamental solutions under its surface.

    u = e^{ikR}/(4πR) + Σ q_j e^{ik|x - y_j|}/|x - y_j|,   alpha u + (beta/k) ∂u/∂n = 0 in the least-squares sense

A direct solution without symmetries: for a few thousand fundamental solutions.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from studies.reference._boundary import Boundary, ComplexArray, FloatArray, condition, positive
from studies.reference.clouds import Body, Cloud, images
from studies.reference.fundamental import _boundary_kernel, _kernel, least_squares


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
