"""Height gains: modes of a creeping wave, and their sum, at a height above the body.

    H(τ, Y) = w₁(τ - Y)/[Y^(-1/4) exp(i (2/3) Y^(3/2) - i τ √Y + iπ/4)],   Y = (m l/ρ)²

Sources: [F65], [AS64, sec. 10.4]; Derivations, F8.
"""

from functools import cache

import numpy as np
from scipy.special import airy

from creeping._typing import ArrayLike, ComplexArray, FloatArray
from creeping.field.special.airy import TURN, W1, scaled_ai, scaled_w1, scaled_w2

FAR_HEIGHT = 40.0
"""Largest Y of the integral with height gain; beyond it the observer is far."""
HIGH = 400.0
"""Y from which height gains are expanded."""


def height_gain(tau: ComplexArray, Y: ArrayLike) -> ComplexArray:
    """Height gain H = w₁(τ - Y)/[Y^(-1/4) exp(i (2/3) Y^(3/2) - i τ √Y + iπ/4)]: (..., n), (..., 1) -> (..., n).

    Tends to 1 far from the body and to 0 on it, like Y^(1/4).
    """
    Y = np.asarray(Y, dtype=float)
    if np.any(Y > HIGH):
        tau, Y = np.broadcast_arrays(tau, Y)
        out, high = np.empty(Y.shape, dtype=complex), (Y > HIGH) & (np.abs(tau) < 0.1 * Y)
        out[high] = _high_gain(tau[high], Y[high])
        # a root as large as the height has no expansion in their ratio
        out[~high] = _plain_gain(tau[~high], Y[~high])
        return out
    return _plain_gain(tau, Y)


def _plain_gain(tau: ComplexArray, Y: FloatArray) -> ComplexArray:
    """Height gain as it stands: its exponents cancel to rounding times Y^(3/2)."""
    value, _, zeta = scaled_ai((tau - Y) * TURN)
    root = np.sqrt(Y)
    # both exponents grow like Y^(3/2): subtract before the exponential
    exponent = -zeta - 2j / 3 * Y * root + 1j * tau * root - 0.25j * np.pi
    return np.asarray(W1 * value * np.sqrt(root) * np.exp(exponent))


def _high_gain(tau: ComplexArray, Y: FloatArray) -> ComplexArray:
    """Height gain where both exponents are large: the expansion of w1, their difference as a power series (n,)."""
    x, e = Y - tau, tau / Y
    # (1 - e)^(3/2) - 1 + (3/2) e
    total, term = np.zeros_like(e), np.ones_like(e)
    for j in range(1, 16):
        term = term * -e * (2.5 - j) / j
        total = total + (term if j > 1 else 0)
    step = -1.5j / (x * np.sqrt(x))
    series = 1 + step * (5 / 72 + step * (385 / 10368 + step * (85085 / 2239488)))
    return np.asarray(series * (Y / x) ** 0.25 * np.exp(2j / 3 * Y * np.sqrt(Y) * total))


def near_pekeris(xi: FloatArray, Y: FloatArray, q: ComplexArray | float | None) -> ComplexArray:
    """Sum of modes with height gain, as an integral that holds down to ξ = 0 (n,), (n,) -> (n,); Y up to FAR_HEIGHT.

    -(1/√π) Y^(1/4) e^{-i(2/3)Y^(3/2)} ∫ e^{i(ξ + √Y)t} [v(t - Y) - V(t) w₁(t - Y)] dt,   from ∞e^{2πi/3} over 0 to ∞
    """
    q_column = None if q is None else np.broadcast_to(np.asarray(q, dtype=complex), xi.shape)[:, None]
    column = Y[:, None]
    zeta = xi[:, None] + np.sqrt(column)

    def coefficient(
        above: ComplexArray, above_slope: ComplexArray, below: ComplexArray, below_slope: ComplexArray
    ) -> ComplexArray:
        if q_column is None:
            return above / below
        return np.asarray((above_slope - q_column * above) / (below_slope - q_column * below))

    # on the axis neither grows beyond what a double holds, and the library's real routine is ten times as fast
    r, w = _panels(32)
    reach = column + 12.0
    t = reach * r
    ai, ai_slope, bi, bi_slope = airy(t)
    V = coefficient(ai, ai_slope, bi + 1j * ai, bi_slope + 1j * ai_slope)
    ai, _, bi, _ = airy(t - column)
    bracket = np.sqrt(np.pi) * (ai - V * (bi + 1j * ai))
    total = np.sum(bracket * np.exp(1j * zeta * t) * (w * reach), axis=1)
    # on the upper leg the bracket is W w1(t - Y) - w2(t - Y), over 2i, and the path runs towards 0
    r, w = _panels(16)
    t = (24.0 * TURN * r)[None]
    (above, above_slope, rise), (below, below_slope, fall) = scaled_w2(t), scaled_w1(t)
    W = coefficient(above, above_slope, below, below_slope)
    plain, _, plain_fall = scaled_w2(t - column)
    high, _, high_fall = scaled_w1(t - column)
    echo = W * high * np.exp(1j * zeta * t + fall - rise - high_fall)
    direct = plain * np.exp(1j * zeta * t - plain_fall)
    total += np.sum((direct - echo) * (24.0 * w), axis=1) * TURN
    return np.asarray(-np.sqrt(np.sqrt(Y)) * np.exp(-2j / 3 * Y**1.5) / np.sqrt(np.pi) * total)


@cache
def _panels(count: int) -> tuple[FloatArray, FloatArray]:
    """Nodes and weights of so many equal panels of 16 Gauss points on the unit interval."""
    nodes, weights = np.polynomial.legendre.leggauss(16)
    edges = np.linspace(0.0, 1.0, count + 1)
    return (edges[:-1, None] + np.diff(edges)[:, None] * (nodes + 1) / 2).ravel(), np.tile(weights / 2 / count, count)
