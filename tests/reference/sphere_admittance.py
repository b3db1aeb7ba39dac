"""A sphere whose admittance varies with the angle theta from z, by spherical harmonics that it couples.

    u = sum_nm [a_nm j_n(kr) + b_nm h_n(kr)] Y_nm,   a_nm = 4 pi i^n conj Y_nm(d),   u_r + ik (a + b cos theta) u = 0
    cos theta Y_nm = A_{n+1,m} Y_{n+1,m} + A_nm Y_{n-1,m},   A_nm = [(n^2 - m^2)/(4 n^2 - 1)]^(1/2)

For each m the b_nm are those of a system of three diagonals where the admittance is a + b cos theta; of one that is
constant on zones of cos theta the coupling of orders n and n' is 2 pi int eta Y_nm Y_n'm dcos theta, by Gauss's rule on
each zone.

Sources: [Nus69] for the sphere; recurrence of the harmonics [AS64, sec. 8.5].
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_banded
from scipy.special import sph_harm_y, spherical_jn, spherical_yn

from tests.reference.conditions import ComplexArray, IntArray

STEPPED = 20
"""Orders more where the admittance steps."""


@dataclass(frozen=True)
class Zones:
    """Admittances of zones between values of cos theta, from -1 up to 1: one more than there are values between."""

    admittances: tuple[complex, ...]
    between: tuple[float, ...]

    def coupling(self, n: IntArray, m: int) -> ComplexArray:
        """2 pi int eta Y_nm Y_n'm dcos theta, of all orders n (j,): (j, j)."""
        out = np.zeros((len(n), len(n)), dtype=complex)
        u, w = np.polynomial.legendre.leggauss(int(n[-1]) + 4)
        for eta, low, high in zip(self.admittances, (-1.0, *self.between), (*self.between, 1.0), strict=True):
            theta = np.arccos(0.5 * (low + high) + 0.5 * (high - low) * u)
            Y = sph_harm_y(n[:, None], m, theta, 0.0).real
            out += np.pi * (high - low) * eta * (Y * w) @ Y.T
        return out


Admittance = tuple[complex, complex] | Zones


def coefficients(k: float, radius: float, direction: ArrayLike, eta: Admittance) -> list[ComplexArray]:
    """a_nm j_n(ka) + b_nm h_n(ka) on the sphere and b_nm, (2, orders - |m|) for m = 0, 1, -1, 2, -2, ..."""
    x = k * radius
    # next to a step of the admittance u is no polynomial
    top = int(np.ceil(x + 6 * np.cbrt(x) + 12)) + (STEPPED if isinstance(eta, Zones) else 0)
    d = np.asarray(direction, dtype=float)
    theta, phi = np.arccos(np.clip(d[2], -1, 1)), np.arctan2(d[1], d[0])
    found = []
    for m in _orders(top):
        n = np.arange(abs(m), top + 1)
        a = 4 * np.pi * 1j**n * np.conj(sph_harm_y(n, m, theta, phi))
        j, slope = spherical_jn(n, x), spherical_jn(n, x, True)
        h, rate = j + 1j * spherical_yn(n, x), slope + 1j * spherical_yn(n, x, True)
        # in terms of c = b h, whose factors are bounded
        incident = a * j
        if isinstance(eta, Zones):
            coupled = 1j * eta.coupling(n, m)
            c = np.linalg.solve(coupled + np.diag(rate / h), -(a * slope + coupled @ incident))
            found.append(np.stack([incident + c, c / h]))
            continue
        step = np.sqrt((n[1:] ** 2 - m**2) / (4.0 * n[1:] ** 2 - 1))
        diagonal, beside = 1j * eta[0] + rate / h, 1j * eta[1] * step
        bands = np.zeros((3, len(n)), dtype=complex)
        bands[0, 1:], bands[1], bands[2, :-1] = beside, diagonal, beside
        right = -(a * slope + 1j * eta[0] * incident)
        right[1:] -= beside * incident[:-1]
        right[:-1] -= beside * incident[1:]
        c = solve_banded((1, 1), bands, right)
        found.append(np.stack([incident + c, c / h]))
    return found


def _orders(top: int) -> list[int]:
    return [0, *(sign * m for m in range(1, top + 1) for sign in (1, -1))]


def _sum(direction: ArrayLike, weights: list[ComplexArray], points: ArrayLike) -> ComplexArray:
    x = np.asarray(points, dtype=float)
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    theta, phi = np.arccos(np.clip(x[:, 2], -1, 1)), np.arctan2(x[:, 1], x[:, 0])
    out = np.zeros(len(x), dtype=complex)
    for m, weight in zip(_orders(len(weights) // 2), weights, strict=True):
        n = np.arange(abs(m), abs(m) + len(weight))
        out += sph_harm_y(n[:, None], m, theta, phi).T @ weight
    return out


def surface_field(k: float, radius: float, direction: ArrayLike, eta: Admittance, points: ArrayLike) -> ComplexArray:
    """Total field u on the sphere at points (p, 3): (p,), eta = (a, b)."""
    return _sum(direction, [c[0] for c in coefficients(k, radius, direction, eta)], points)


def far_field(k: float, radius: float, direction: ArrayLike, eta: Admittance, r: ArrayLike) -> ComplexArray:
    """Far field f, L, in unit directions r (p, 3): (p,) complex."""
    parts = coefficients(k, radius, direction, eta)
    weights = []
    for m, c in zip(_orders(len(parts) // 2), parts, strict=True):
        n = np.arange(abs(m), abs(m) + c.shape[1])
        weights.append((-1j) ** (n + 1) / k * c[1])
    return _sum(direction, weights, r)
