"""A circular cylinder of radius a in a plane wave across its axis: the series.

With x = ka, phi from the forward direction, alpha u + (beta/k) ∂u/∂n = 0, ε₀ = 1 and εₙ = 2,

    u_s = Σ εₙ iⁿ cₙ Hₙ(kr) cos(n phi),    cₙ = -(alpha Jₙ + beta Jₙ')/Dₙ,    Dₙ = alpha Hₙ + beta Hₙ',    all at x
    u_s ~ F e^{ikr}/√r,    F = √(2/πk) e^{-iπ/4} Σ εₙ cₙ cos(n phi)

and on the surface, by the Wronskian,

    u = beta (2i/πx) Σ εₙ iⁿ cos(n phi)/Dₙ,    ∂u/∂n = -alpha k (2i/πx) Σ εₙ iⁿ cos(n phi)/Dₙ

A wave that comes at an angle gamma to the axis z, sin gamma = s, is that across it with k s in place of k, times
e^{ikz cos gamma}. On a perfect conductor H_z is hard and E_z soft, and along l, against phi, on the surface

    H_l = (i/(k s²)) [cos(gamma) ∂H_z/∂l - ∂E_z/∂n],    J = n x H:  J_l = H_z,  J_z = -H_l
"""

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import hankel1, jv

from studies.reference._boundary import Boundary, ComplexArray, condition, positive, series_length


def _coefficients(x: float, boundary: Boundary) -> tuple[ComplexArray, ComplexArray]:
    """Coefficients cₙ and denominators Dₙ, each (N,)."""
    alpha, beta = condition(boundary)
    n = np.arange(series_length(x))
    j, h = jv(n, x), hankel1(n, x)
    dj, dh = jv(n - 1, x) - n / x * j, hankel1(n - 1, x) - n / x * h
    denominators = alpha * h + beta * dh
    return -(alpha * j + beta * dj) / denominators, denominators


def _angular_sum(coefficients: ComplexArray, phi: ArrayLike) -> ComplexArray:
    """Σ εₙ coefficientₙ cos(n phi): (N,), (m,) -> (m,)."""
    n = np.arange(len(coefficients))
    weights = np.where(n == 0, 1.0, 2.0) * coefficients
    return np.asarray(np.cos(np.multiply.outer(np.asarray(phi, dtype=float), n)) @ weights)


def scattered_field(wavenumber: float, radius: float, r: ArrayLike, phi: ArrayLike, boundary: Boundary) -> ComplexArray:
    """Scattered field on and outside the cylinder.

    Parameters
    ----------
    wavenumber, radius : float
        k, 1/L, and a, L; measured to ka = 500.
    r, phi : (n,)
        Distance from the axis, L, at least a; angle from the forward direction, rad.
    boundary : "soft", "hard" or complex
        Complex is the impedance number eta.

    Returns
    -------
    (n,) complex
    """
    positive(wavenumber=wavenumber, radius=radius)
    r, phi = np.broadcast_arrays(np.asarray(r, dtype=float), np.asarray(phi, dtype=float))
    if np.any(r < radius * (1 - 1e-12)):
        raise ValueError(f"{np.sum(r < radius)} of {r.size} points are inside the cylinder; move them out")
    coefficients, _ = _coefficients(wavenumber * radius, boundary)
    kr = wavenumber * r
    before, here = hankel1(0, kr), hankel1(1, kr)
    total = coefficients[0] * before
    # the recurrence upwards is stable for Hₙ, the growing solution
    for n in range(1, len(coefficients)):
        total = total + 2 * 1j ** (n % 4) * coefficients[n] * here * np.cos(n * phi)
        before, here = here, 2 * n / kr * here - before
    return np.asarray(total)


def far_field(wavenumber: float, radius: float, phi: ArrayLike, boundary: Boundary) -> ComplexArray:
    """Far field F, √L, u_s ~ F e^{ikr}/√r, at angles from the forward direction: (m,) -> (m,)."""
    positive(wavenumber=wavenumber, radius=radius)
    coefficients, _ = _coefficients(wavenumber * radius, boundary)
    factor = np.sqrt(2 / (np.pi * wavenumber)) * np.exp(-0.25j * np.pi)
    return np.asarray(factor * _angular_sum(coefficients, phi))


def surface_field(wavenumber: float, radius: float, phi: ArrayLike, boundary: Boundary) -> ComplexArray:
    """Total field u on the cylinder at angles from the forward direction: (m,) -> (m,); zero when soft."""
    return condition(boundary)[1] * _surface_sum(wavenumber, radius, phi, boundary)


def surface_derivative(wavenumber: float, radius: float, phi: ArrayLike, boundary: Boundary) -> ComplexArray:
    """Outward normal derivative ∂u/∂n of the total field, 1/L: (m,) -> (m,); zero when hard."""
    return -condition(boundary)[0] * wavenumber * _surface_sum(wavenumber, radius, phi, boundary)


def _surface_sum(wavenumber: float, radius: float, phi: ArrayLike, boundary: Boundary) -> ComplexArray:
    """(2i/πx) Σ εₙ iⁿ cos(n phi)/Dₙ: (m,) -> (m,)."""
    positive(wavenumber=wavenumber, radius=radius)
    x = wavenumber * radius
    _, denominators = _coefficients(x, boundary)
    turns = 1j ** (np.arange(len(denominators)) % 4)
    return np.asarray(2j / (np.pi * x) * _angular_sum(turns / denominators, phi))


def pec_currents(
    wavenumber: float, radius: float, phi: ArrayLike, gamma: float, electric: complex, magnetic: complex
) -> tuple[ComplexArray, ComplexArray]:
    """J_l and J_z on a perfect conductor at z = 0 for a wave whose E_z and H_z are given: (m,) -> (m,), (m,)."""
    s, phi = np.sin(gamma), np.asarray(phi, dtype=float)
    k = wavenumber * s
    x = k * radius
    _, denominators = _coefficients(x, "hard")
    n = np.arange(len(denominators))
    weights = 2j / (np.pi * x) * np.where(n == 0, 1.0, 2.0) * 1j ** (n % 4) / denominators
    along = magnetic * surface_field(k, radius, phi, "hard")
    # d/dl is -(1/a) d/dphi
    rate = magnetic / radius * np.sin(np.multiply.outer(phi, n)) @ (n * weights)
    slope = electric * surface_derivative(k, radius, phi, "soft")
    return along, -1j / (wavenumber * s * s) * (np.cos(gamma) * rate - slope)
