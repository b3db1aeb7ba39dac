"""Coupling functions, hard and soft: the wave along one geodesic from a source on the body to a receiver on it.

    V(ξ) = (1/2) e^{-iπ/4} √(ξ/π) ∫ R e^{iξt} dt = e^{iπ/4} √(πξ) Σ_p e^{iξτ_p}/τ_p,   R = w₁/w₁',   V(0) = 1
    U(ξ) = -iξ e^{-iπ/4} √(ξ/π) ∫ S e^{iξt} dt = 2 e^{-iπ/4} √π ξ^(3/2) Σ_p e^{iξτ_p},     S = w₁'/w₁ = 1/R,   U(0) = 1
    powers n of t under the integral, (-i d/dξ)^n,   and R² in the place of R

By R' = 1 - tR², R = t^(-1/2) Σ a_n t^(-3n/2), by S' = t - S², S = t^(1/2) Σ s_n t^(-3n/2), and term by term, by
Hankel's integral for 1/Γ,

    V_n = √π e^{-iπ/4} Σ_j a_j e^{iπμ/2} ξ^(μ-1/2)/Γ(μ),   μ = 1/2 + 3j/2 - n
    U_n = -2i √π e^{-iπ/4} Σ_j s_j e^{iπμ/2} ξ^(μ+1/2)/Γ(μ),   μ = -1/2 + 3j/2 - n

The a_j grow like Γ(j), 1/Γ(μ) falls faster: the series converges everywhere. It is used up to SERIES, modes beyond.

Sources: [F65], [L59], [PW81]; Derivations, F25.
"""

from functools import cache

import numpy as np
from scipy.special import rgamma

from creeping._typing import ComplexArray, FloatArray
from creeping.field.special.airy import hard_modes, soft_modes

SERIES, TERMS = 1.5, 40
"""ξ up to which the series in powers of ξ^(3/2) serves, and its terms: good to 1e-13 there."""
MODES, DEEP, FEW = 16, 4.0, 5
"""Modes summed beyond, to 1e-10, and from DEEP on."""


@cache
def _ratio_terms() -> tuple[FloatArray, FloatArray]:
    """Coefficients of t^(-3j/2) in √t R and in t R²: (TERMS,), (TERMS,)."""
    a = np.zeros(TERMS)
    a[0] = 1.0
    for n in range(1, TERMS):
        a[n] = 0.5 * ((1.5 * n - 1.0) * a[n - 1] - a[1:n] @ a[n - 1 : 0 : -1])
    return a, np.convolve(a, a)[:TERMS]


@cache
def _series_terms(power: int, squared: bool) -> ComplexArray:
    """Coefficients of ξ^(3j/2) of V_n ξ^n, or of the integral of R² over √ξ: (TERMS,)."""
    plain, square = _ratio_terms()
    mu = (1.0 if squared else 0.5) + 1.5 * np.arange(TERMS) - power
    factor = np.sqrt(np.pi) * np.exp(-0.25j * np.pi)
    return np.asarray((square if squared else plain) * np.exp(0.5j * np.pi * mu) * rgamma(mu) * factor)


def coupling_function(xi: FloatArray, power: int = 0, *, squared: bool = False) -> ComplexArray:
    """V_n(ξ), ξ > 0, n the ``power`` of t under the integral; ``squared`` has R² there for R, n = 0: (...) -> (...).

    Examples
    --------
    >>> complex(coupling_function(np.array(1.0)).round(6))
    (0.699914+0.213383j)
    """
    xi = np.asarray(xi, dtype=float)
    out = np.empty(xi.shape, dtype=complex)
    small = xi <= SERIES
    near = xi[small]
    shift = np.sqrt(near) if squared else near ** (-float(power))
    out[small] = shift * np.polynomial.polynomial.polyval(near**1.5, _series_terms(power, squared))
    deep = xi > DEEP
    for some, count in ((~small & ~deep, MODES), (deep, FEW)):
        far, tau = xi[some, None], hard_modes(count).tau
        residues = (1j * far - 1 / tau) / tau**2 if squared else tau ** (power - 1)
        total = np.sum(residues * np.exp(1j * far * tau), axis=-1)
        out[some] = np.exp(0.25j * np.pi) * np.sqrt(np.pi * xi[some]) * total
    return out


@cache
def _soft_terms(power: int) -> ComplexArray:
    """Coefficients of ξ^(3j/2) of U_n ξ^n: (TERMS,)."""
    s = np.zeros(TERMS)
    s[0] = 1.0
    for n in range(1, TERMS):
        s[n] = 0.5 * ((1.5 * n - 2.0) * s[n - 1] - s[1:n] @ s[n - 1 : 0 : -1])
    mu = -0.5 + 1.5 * np.arange(TERMS) - power
    return np.asarray(s * np.exp(0.5j * np.pi * mu) * rgamma(mu) * (-2j * np.sqrt(np.pi) * np.exp(-0.25j * np.pi)))


def soft_coupling_function(xi: FloatArray, power: int = 0) -> ComplexArray:
    """U_n(ξ), ξ > 0, n the ``power`` of t under the integral: (...) -> (...).

    Examples
    --------
    >>> complex(soft_coupling_function(np.array(1.0)).round(6))
    (0.440321+0.303544j)
    """
    xi = np.asarray(xi, dtype=float)
    out = np.empty(xi.shape, dtype=complex)
    small, deep = xi <= SERIES, xi > DEEP
    out[small] = xi[small] ** (-float(power)) * np.polynomial.polynomial.polyval(xi[small] ** 1.5, _soft_terms(power))
    for some, count in ((~small & ~deep, MODES), (deep, FEW)):
        tau = soft_modes(count).tau
        total = np.sum(tau**power * np.exp(1j * xi[some, None] * tau), axis=-1)
        out[some] = 2 * np.exp(-0.25j * np.pi) * np.sqrt(np.pi) * xi[some] ** 1.5 * total
    return out
