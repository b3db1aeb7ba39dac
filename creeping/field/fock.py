"""Fock functions of the transition across the shadow boundary, for time factor e^{-iωt}.

    V = (v' - q v)/(w₁' - q w₁),   W = (w₂' - q w₂)/(w₁' - q w₁)
    √π p*(ξ) = ∫₀^∞ V e^{iξt} dt + (1/2i) ∫₀^{∞e^{2πi/3}} W e^{iξt} dt,   P(ξ) = e^{iπ/4} [p*(ξ) - 1/(2√π ξ)]
    √π g(ξ) = ∫ e^{iξt}/(w₁' - q w₁) dt,   soft: √π F(ξ) = ∫ e^{iξt}/w₁ dt,   from ∞e^{2πi/3} to ∞

q = 0 hard, q = ∞ soft, q = i m η impedance. The path to +∞ is turned to ∞e^{-iπ/6}, below every root. On the lit side
these integrals lose digits; there, in one, over the line of steepest descent through t = -ξ²/4 (-ξ² for g, F),

    P(ξ) = (e^{iπ/4}/2i√π) ∫ W e^{iξt} dt = -S e^{-iξ³/12}/√(-4/ξ),

S the reflection coefficient, which tends to that of a plane boundary. A ``power`` n stands for t^n under each integral,
which is (-i d/dξ)^n of the function and τ^n in its residue series. All arguments and values are without unit.

Also here: height gains: modes of a creeping wave, and their sum, at a height above the body.

    H(τ, Y) = w₁(τ - Y)/[Y^(-1/4) exp(i (2/3) Y^(3/2) - i τ √Y + iπ/4)],   Y = (m l/ρ)²

Sources: [F65], [P79], [PBM80], [KP74] for F_t; [F65], [AS64, sec. 10.4]; Derivations, F2 and F8.
"""

from collections.abc import Sequence
from functools import cache
from math import factorial

import numpy as np
from scipy.special import airy, wofz

from creeping._typing import Any, ArrayLike, ComplexArray, FloatArray
from creeping.field.airy import (
    MODES,
    TURN,
    W1,
    Modes,
    hard_modes,
    impedance_modes,
    scaled_ai,
    scaled_v,
    scaled_w1,
    scaled_w2,
    soft_modes,
)

LIT = -2.5
"""Below it the line of steepest descent is used."""
SERIES = 2.5
"""Above it ten modes are good to 1e-9."""
FARTHEST = -200.0
"""Beyond it the reflection coefficient is taken as constant, an error below 1e-6."""

FAR_HEIGHT = 40.0
"""Largest Y of the integral with height gain; beyond it the observer is far."""
HIGH = 400.0
"""Y from which height gains are expanded."""


@cache
def _path() -> tuple[ComplexArray, ...]:
    """Gauss nodes t on both legs of the path and their weights, w1 and w1' there, what stands above, and both ζ.

    All but t and the weights are scaled.
    """
    legs = []
    # reaches: the integrands fall below 1e-12 of their maximum for LIT <= ξ <= SERIES
    r, w = (24.0 * part for part in _panels(14))
    for turn in (np.exp(-1j * np.pi / 6), TURN):
        t = r * turn
        # numerator: v on the lower leg, w2/2i on the upper one
        upper, upper_slope, rise = scaled_v(t) if turn.imag < 0 else scaled_w2(t)
        lower, lower_slope, fall = scaled_w1(t)
        legs.append((t, w * turn, lower, lower_slope, fall, upper, upper_slope, rise))
    return tuple(np.concatenate(parts) for parts in zip(*legs, strict=True))


def _by_path(which: str, xi: FloatArray, q: ComplexArray | None, power: int) -> ComplexArray:
    """p*, its derivative in q, or the surface function by both legs: xi (n,), q (n,) or None for soft."""
    t, weight, *both = _path()
    out = np.empty(len(xi), dtype=complex)
    # on the upper leg the path runs towards 0 in g and F; d/dq of V is -1/(..)², of W/2i it is 1/(..)² (Wronskians)
    turned = np.where(t.imag > 0, 1.0, -1.0)
    # blocks bound the memory of points x nodes
    for first in range(0, len(xi), 4096):
        part = slice(first, first + 4096)
        terms = _integrand(which, 1j * xi[part, None] * t, q, part, both[:3], both[3:])
        out[part] = (terms if which == "pekeris" else turned * terms) @ (weight * t**power) / np.sqrt(np.pi)
    return out


def _integrand(
    which: str, phase: ComplexArray, q: ComplexArray | None, part: slice, lower: Sequence[Any], upper: Sequence[Any]
) -> ComplexArray:
    """What the integrals have at their nodes, for a part of q, with scaled w1 below, and above v or w2/2i."""
    below, above = (w[0] if q is None else w[1] - q[part, None] * w[0] for w in (lower, upper))
    fall = lower[2]
    if which == "pekeris":
        return np.asarray(above / below * np.exp(phase + fall - upper[2]))
    if which == "slope":
        return np.asarray(1 / below**2 * np.exp(phase + 2 * fall))
    return np.asarray(-(1 if which == "surface" else lower[0] / below) / below * np.exp(phase + fall))


def boundary_modes(q: ComplexArray | float | None, n: int = MODES) -> Modes:
    """Modes of soft (None), hard (0) or impedance parameters q (...): (n,) or (..., n)."""
    if q is None:
        return soft_modes(n)
    if np.ndim(q) == 0 and q == 0:
        return hard_modes(n)
    return impedance_modes(q, n)


def pekeris_star(xi: ArrayLike, q: ComplexArray | float | None, power: int = 0) -> ComplexArray:
    """Pekeris function p*(ξ), entire in ξ: (...) -> (...).

    Parameters
    ----------
    xi : (...)
    q : None for soft, 0 for hard, else complex, broadcast with xi, of one argument
    power : int
        (-i d/dξ)^power of it.

    Examples
    --------
    >>> pekeris_star([0.0, 1.0], None).round(6)                   # soft
    array([0.306629-0.177032j, 0.224205-0.060714j])
    """
    return _evaluate("pekeris", np.asarray(xi, dtype=float), q, power)


def pekeris(xi: ArrayLike, q: ComplexArray | float | None) -> ComplexArray:
    """P(ξ) = e^{iπ/4} [p*(ξ) - 1/(2√π ξ)], infinite at ξ = 0: (...) -> (...)."""
    xi = np.asarray(xi, dtype=float)
    return np.asarray(np.exp(0.25j * np.pi) * (pekeris_star(xi, q) - pole(xi)))


def pole(xi: FloatArray, power: int = 0) -> ComplexArray:
    """(-i d/dξ)^power of 1/(2√π ξ), infinite at 0 (...)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(1j**power * factorial(power) / (2 * np.sqrt(np.pi) * xi ** (power + 1)))


def pekeris_slope(xi: ArrayLike, q: ComplexArray | float, power: int = 0) -> ComplexArray:
    """(-i d/dξ)^power of dp*/dq, not for soft: (...) -> (...)."""
    return _evaluate("slope", np.asarray(xi, dtype=float), q, power)


def surface_function(xi: ArrayLike, q: ComplexArray | float | None, power: int = 0) -> ComplexArray:
    """(-i d/dξ)^power of Fock's surface function g(ξ) of u, or F(ξ) of du/dn if soft: (...) -> (...).

    Examples
    --------
    >>> round(float(surface_function(0.0, 0.0).real), 6)          # hard, on the shadow line
    1.399376
    """
    return _evaluate("surface", np.asarray(xi, dtype=float), q, power)


def surface_slope(xi: ArrayLike, q: ComplexArray | float, power: int = 0) -> ComplexArray:
    """(-i d/dξ)^power of dg/dq, not for soft: (...) -> (...)."""
    return _evaluate("surface slope", np.asarray(xi, dtype=float), q, power)


def _evaluate(which: str, xi: FloatArray, q: ComplexArray | float | None, power: int) -> ComplexArray:
    if q is None or np.ndim(q) == 0:
        return _tabulated(which, xi.ravel(), None if q is None else complex(q), power).reshape(xi.shape)
    full_xi, full_q = np.broadcast_arrays(xi, np.asarray(q, dtype=complex))
    shape, full_xi, full_q = full_xi.shape, full_xi.ravel(), full_q.ravel()
    # the far field keeps to one way, whatever the number of rays that go together
    if len(full_q) < 300 or not which.startswith("surface") or not _of_one_argument(full_q):
        return _direct(which, full_xi, full_q, power).reshape(shape)
    return _between_tables(which, full_xi, full_q, power).reshape(shape)


def _of_one_argument(q: ComplexArray) -> bool:
    """Whether numbers (n,) are multiples of one by positive factors, to rounding."""
    largest = q[np.argmax(np.abs(q))]
    return bool(np.all(np.abs((q * np.conj(largest)).imag) <= 1e-9 * np.abs(q) * np.abs(largest)))


def _between_tables(which: str, xi: FloatArray, q: ComplexArray, power: int) -> ComplexArray:
    """From tables at fixed |q|, by polynomials of degree 7 in log |q|: xi (n,), q (n,) of one argument."""
    deep = xi > SERIES
    if np.any(deep):
        out = np.empty(len(xi), dtype=complex)
        out[deep] = _by_series(which, xi[deep], q[deep], power)
        if not np.all(deep):
            out[~deep] = _between_tables(which, xi[~deep], q[~deep], power)
        return out
    # the argument without its rounding, for all q of a boundary to meet the same tables
    phase = complex(np.round(np.exp(1j * np.angle(q[np.argmax(np.abs(q))])), 12))
    ratio = 1.12
    place = np.log(np.abs(q)) / np.log(ratio)
    first = np.floor(place).astype(int) - 3
    out = np.zeros(len(xi), dtype=complex)
    for number in range(first.min(), first.max() + 8):
        inside = (first <= number) & (number < first + 8)
        if np.any(inside):
            others = first[inside, None] + np.arange(8)
            gaps, apart = place[inside, None] - others, number - others
            weight = np.prod(np.where(apart == 0, 1.0, gaps / np.where(apart == 0, 1, apart)), axis=1)
            out[inside] += weight * _tabulated(which, xi[inside], ratio**number * phase, power)
    return out


def _direct(which: str, xi: FloatArray, q: ComplexArray | None, power: int) -> ComplexArray:
    """Without a table: xi (n,), q (n,) or None."""
    out = np.empty(len(xi), dtype=complex)
    lit, deep = xi < LIT, xi > SERIES
    for mask, function in ((lit, _by_descent), (~(lit | deep), _by_path), (deep, _by_series)):
        if np.any(mask):
            out[mask] = function(which, xi[mask], None if q is None else q[mask], power)
    return out


def _by_descent(which: str, xi: FloatArray, q: ComplexArray | None, power: int) -> ComplexArray:
    """The lit side: trapezoidal rule, which converges exponentially, over the line of steepest descent."""
    out = np.empty(len(xi), dtype=complex)
    on_surface = which.startswith("surface")
    for first in range(0, len(xi), 4096):
        part = slice(first, first + 4096)
        x = xi[part, None]
        # the integrand is a Gaussian of variance |ξ|/2, or 2|ξ|, times a slow factor
        step = (0.24 if on_surface else 0.12) * np.sqrt(-x)
        t = -(x**2) * (1.0 if on_surface else 0.25) + step * np.arange(-55, 56) * np.exp(0.75j * np.pi)
        lower = scaled_w1(t)
        # w2 is of p* alone
        terms = _integrand(which, 1j * x * t, q, part, lower, scaled_w2(t) if which == "pekeris" else lower)
        out[part] = np.sum(terms * t**power, axis=1) * step[:, 0] * np.exp(0.75j * np.pi) / np.sqrt(np.pi)
    return out + pole(xi, power) if which == "pekeris" else out


def _by_series(which: str, xi: FloatArray, q: ComplexArray | None, power: int) -> ComplexArray:
    """Residue series of the shadow; d/dq by a central difference."""
    if which.endswith("slope"):
        assert q is not None
        step = 1e-4 * np.where(q == 0, 1j, q / np.where(q == 0, 1, np.abs(q)))
        whole = "pekeris" if which == "slope" else "surface"
        pair = [_by_series(whole, xi, q + sign * step, power) for sign in (1, -1)]
        return np.asarray((pair[0] - pair[1]) / (2 * step))
    modes = boundary_modes(0.0 if q is not None and np.all(q == 0) else q)
    amplitude = modes.surface if which == "surface" else modes.residue
    terms = amplitude * modes.tau**power * np.exp(1j * xi[:, None] * modes.tau)
    total = 2j * np.sqrt(np.pi) * np.sum(terms, axis=-1)
    return np.asarray(total if which == "surface" else total + pole(xi, power))


@cache
def _tables(which: str, q: complex | None, power: int) -> tuple[Any, Any]:
    """Splines of one boundary: of the function between LIT and SERIES, and of its slow factor on the lit side."""
    # not before it is needed: it takes half a second to load
    from scipy.interpolate import make_interp_spline

    xi = np.linspace(LIT, SERIES, 301)
    inverse = np.linspace(1 / LIT, 1 / FARTHEST, 201)
    values = [None if q is None else np.full(len(x), q) for x in (xi, inverse)]
    slow = _by_descent(which, 1 / inverse, values[1], power)
    if which == "pekeris":
        slow -= pole(1 / inverse, power)
    return (
        make_interp_spline(xi, _by_path(which, xi, values[0], power), k=7),
        make_interp_spline(inverse, slow * _unwind(which, q, 1 / inverse, power), k=7),
    )


def _unwind(which: str, q: complex | None, xi: FloatArray, power: int) -> ComplexArray:
    """Inverse of the fast and the growing factor on the lit side."""
    if which.startswith("surface"):
        # F grows like ξ, g does not
        return np.asarray(np.exp(1j * xi**3 / 3) / xi ** (2 * power + (q is None)))
    return np.asarray(np.exp(1j * xi**3 / 12) / (np.sqrt(-xi) * xi ** (2 * power)))


def _tabulated(which: str, xi: FloatArray, q: complex | None, power: int) -> ComplexArray:
    """One boundary: splines, and the series beyond them."""
    out = np.empty(len(xi), dtype=complex)
    lit, deep = xi < LIT, xi > SERIES
    middle = ~(lit | deep)
    between, slow = _tables(which, q, power)
    out[middle] = between(xi[middle])
    if np.any(lit):
        out[lit] = slow(1 / np.maximum(xi[lit], FARTHEST)) / _unwind(which, q, xi[lit], power)
        if which == "pekeris":
            out[lit] += pole(xi[lit], power)
    if np.any(deep):
        out[deep] = _by_series(which, xi[deep], None if q is None else np.full(int(deep.sum()), q), power)
    return out


def transition_rate(root: ArrayLike) -> ComplexArray:
    """F_t(X)/√X by √X, finite where X = 0: (...) -> (...)."""
    return np.asarray(-1j * np.sqrt(np.pi) * np.exp(0.25j * np.pi) * wofz(np.exp(0.25j * np.pi) * np.asarray(root)))


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
