"""Fock's Airy functions, the roots of their boundary condition, and the constants of a creeping mode.

    v(t) = √π Ai(t),   w₁(t) = 2√π e^{iπ/6} Ai(t e^{2πi/3}),   w₂(t) = 2√π e^{-iπ/6} Ai(t e^{-2πi/3})
    w₁'(τ) = q w₁(τ),  q = 0 hard, q = ∞ soft, q = i m η impedance;   dτ/dq = 1/(τ - q²)

Roots of the soft and hard problem lie on the ray of angle π/3 at the zeros of Ai and Ai'. Those of an impedance are
continued from the hard ones, q growing from 0 along its ray, so that root p stays root p while q varies. All arguments
and values are without unit.

Also here: coupling functions, hard and soft: the wave along one geodesic from a source on the body to a receiver on it.

    V(ξ) = (1/2) e^{-iπ/4} √(ξ/π) ∫ R e^{iξt} dt = e^{iπ/4} √(πξ) Σ_p e^{iξτ_p}/τ_p,   R = w₁/w₁',   V(0) = 1
    U(ξ) = -iξ e^{-iπ/4} √(ξ/π) ∫ S e^{iξt} dt = 2 e^{-iπ/4} √π ξ^(3/2) Σ_p e^{iξτ_p},     S = w₁'/w₁ = 1/R,   U(0) = 1
    powers n of t under the integral, (-i d/dξ)^n,   and R² in the place of R

By R' = 1 - tR², R = t^(-1/2) Σ a_n t^(-3n/2), by S' = t - S², S = t^(1/2) Σ s_n t^(-3n/2), and term by term, by
Hankel's integral for 1/Γ,

    V_n = √π e^{-iπ/4} Σ_j a_j e^{iπμ/2} ξ^(μ-1/2)/Γ(μ),   μ = 1/2 + 3j/2 - n
    U_n = -2i √π e^{-iπ/4} Σ_j s_j e^{iπμ/2} ξ^(μ+1/2)/Γ(μ),   μ = -1/2 + 3j/2 - n

The a_j grow like Γ(j), 1/Γ(μ) falls faster: the series converges everywhere. It is used up to SERIES, modes beyond.

Sources: [F65], [L59]; [F65], [L59], [PW81]; Derivations, F1 and F25.
"""

from collections.abc import Callable
from functools import cache, lru_cache
from typing import Literal, NamedTuple

import numpy as np
from scipy.special import ai_zeros, airy, airye, rgamma

from creeping._typing import ArrayLike, ComplexArray, FloatArray

MODES = 10
"""Modes summed; with them the series holds to 4e-4 at xi = 0.7 and to 1e-7 at xi = 1.3."""
FIRST, RATIO = 0.05, 1.02
"""Least |q|, and ratio of neighbours, at which roots are kept; Newton goes on from the node below."""

TURN = np.exp(2j * np.pi / 3)
W1 = 2 * np.sqrt(np.pi) * np.exp(1j * np.pi / 6)

SERIES = 1.5
"""ξ up to which the series in powers of ξ^(3/2) is used, forty terms of it: good to 1e-13 there."""
DEEP = 4.0
"""ξ from which on five modes are summed, before it sixteen: to 1e-10."""
_BRANCHES: dict[tuple[complex, int], tuple[list[complex], list[ComplexArray]]] = {}


def w1(t: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
    """w1 and w1' at complex t, any shape; unscaled, for moderate |t|."""
    value, slope, _, _ = airy(np.asarray(t) * TURN)
    return W1 * value, W1 * TURN * slope


def scaled_ai(z: ComplexArray) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Ai and Ai' without their factor e^{-ζ}, and ζ = (2/3) z^(3/2), principal branch, any shape.

    Beyond |z| = 9, within 2.1 of the positive axis, where the other exponential is small, by their expansions
    [AS64, sec. 10.4]: a tenth of the library's time. Beyond 500 everywhere, for library routines give up.
    """
    z = np.asarray(z, dtype=complex)
    root = np.sqrt(z)
    zeta = 2 / 3 * z * root
    far = (np.abs(z) > 9) & ((np.abs(np.angle(z)) < 2.1) | (np.abs(z) > 500))
    if not np.any(far):
        value, slope, _, _ = airye(z)
        return value, slope, zeta
    value, slope = np.empty_like(z), np.empty_like(z)
    value[~far], slope[~far] = airye(z[~far])[:2]
    inverse, quarter = 1 / zeta[far], np.sqrt(root[far])
    u, v = _expansion()
    even, odd = np.full_like(inverse, u[-1]), np.full_like(inverse, v[-1])
    for a, b in zip(u[-2::-1], v[-2::-1], strict=True):
        even = even * inverse + a
        odd = odd * inverse + b
    value[far] = even / (2 * np.sqrt(np.pi) * quarter)
    slope[far] = odd * quarter / (-2 * np.sqrt(np.pi))
    return value, slope, zeta


@cache
def _expansion() -> tuple[FloatArray, FloatArray]:
    """Coefficients of powers of -1/ζ, signs included, in the expansions of Ai and Ai': the next is 2e-13 at |z| = 9."""
    u = [1.0]
    for k in range(1, 17):
        u.append(u[-1] * (6 * k - 5) * (6 * k - 3) * (6 * k - 1) / (216 * k * (2 * k - 1)))
    number = np.arange(17)
    sign = (-1.0) ** number
    return sign * np.array(u), -sign * np.array(u) * (6 * number + 1) / (6 * number - 1)


def scaled_v(t: ComplexArray) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """v and v' without the factor e^{-ζ}, and ζ."""
    value, slope, zeta = scaled_ai(t)
    return np.sqrt(np.pi) * value, np.sqrt(np.pi) * slope, zeta


def scaled_w1(t: ComplexArray) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """w1 and w1' without the factor e^{-ζ}, and ζ."""
    value, slope, zeta = scaled_ai(t * TURN)
    return W1 * value, W1 * TURN * slope, zeta


def scaled_w2(t: ComplexArray) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """w2/2i and w2'/2i without the factor e^{-ζ}, and ζ."""
    value, slope, zeta = scaled_ai(t / TURN)
    factor = np.conj(W1) / 2j
    return factor * value, factor / TURN * slope, zeta


class Modes(NamedTuple):
    """Roots and constants of the creeping modes of one boundary, or of a boundary that varies.

    Attributes
    ----------
    tau : (..., n) complex
        Roots of w1' = q w1.
    residue : (..., n)
        R = 1/(w1'(τ)² - τ w1(τ)²): 1/w1'² if soft, -1/((τ - q²) w1²) else.
    m0, q_m0 : (..., n)
        M0 = 1/(τ - q²) and q M0, 0 if soft.
    surface : (..., n)
        Residue of the surface function: of u, 1/((τ - q²) w1(τ)), or of du/dn if soft, 1/w1'(τ).
    """

    tau: ComplexArray
    residue: ComplexArray
    m0: ComplexArray
    q_m0: ComplexArray
    surface: ComplexArray


@cache
def soft_modes(n: int = MODES) -> Modes:
    """Modes of the soft boundary, q = ∞: (n,).

    Examples
    --------
    >>> abs(soft_modes(3).tau).round(6)                           # zeros of Ai
    array([2.338107, 4.087949, 5.52056 ])
    """
    zeros, _, _, _ = ai_zeros(n)
    return _constants(-zeros * np.exp(1j * np.pi / 3), soft=True)


@cache
def hard_modes(n: int = MODES) -> Modes:
    """Modes of the hard boundary, q = 0: (n,)."""
    return _constants(hard_roots(n), soft=False)


def hard_roots(n: int) -> ComplexArray:
    """Roots of w1' = 0: (n,)."""
    _, zeros, _, _ = ai_zeros(n)
    return np.asarray(-zeros * np.exp(1j * np.pi / 3))


def impedance_modes(q: ArrayLike, n: int = MODES) -> Modes:
    """Modes of impedance parameters on one ray from the origin, q = |q| e^{iα}: (...) -> (..., n).

    Parameters
    ----------
    q : (...) complex
        All of one argument (q = i m η at various m).

    Examples
    --------
    >>> impedance_modes(1j, 2).tau.round(6)
    array([0.997899+1.319562j, 1.853539+2.974507j])
    """
    q = np.asarray(q, dtype=complex)
    flat = q.ravel()
    table = np.empty((len(flat), len(Modes._fields), n), dtype=complex)
    octave = np.floor(np.log2(np.maximum(np.abs(flat), 2.0**-11))).astype(int)
    # tables of fixed octaves, so that a value depends on its own q alone
    for number in np.unique(octave):
        mine = octave == number
        series = _octave(_argument(flat), int(number), n) if number >= -10 else None
        if series is None:
            table[mine] = np.stack(_at(flat[mine], _argument(flat), n), axis=1)
        else:
            place = 2 * (np.log2(np.abs(flat[mine])) - number) - 1
            table[mine] = np.polynomial.chebyshev.chebval(place, series).T.reshape(-1, *table.shape[1:])
    return Modes(*np.moveaxis(table.reshape(*q.shape, *table.shape[1:]), -2, 0))


@lru_cache(512)
def _octave(phase: complex, number: int, n: int) -> ComplexArray | None:
    """Chebyshev series in log |q| from 2^number on, an octave; None where it is not smooth, beside a branch point."""
    unit = np.cos(np.pi * (np.arange(24) + 0.5) / 24)

    def exact(at: FloatArray) -> ComplexArray:
        return np.stack(_at(np.asarray(2.0 ** (number + (at + 1) / 2) * phase, dtype=complex), phase, n), axis=1)

    values = exact(unit)
    series = np.polynomial.chebyshev.chebfit(unit, values.reshape(24, -1), 23)
    probes = np.linspace(-0.97, 0.93, 9)
    found = np.polynomial.chebyshev.chebval(probes, series).T.reshape(len(probes), *values.shape[1:])
    # residues of a bound surface wave underflow to 0
    largest = np.maximum(np.max(np.abs(values), axis=0), 1e-300)
    return np.asarray(series) if np.max(np.abs(found - exact(probes)) / largest) < 1e-10 else None


def _argument(q: ComplexArray) -> complex:
    """Argument e^{iα} of all q (m,) of a boundary, without its rounding: one key for all of them."""
    if not q.size:
        return 1.0 + 0j
    phase = complex(np.round(np.exp(1j * np.angle(q[np.argmax(np.abs(q))])), 12))
    return phase / abs(phase)


def _at(q: ComplexArray, phase: complex, n: int) -> Modes:
    """Constants of q (m,) of one argument, exactly: (m, n)."""
    if not q.size:
        return _constants(np.zeros((0, n), dtype=complex), soft=False)
    amounts = np.abs(q)
    nodes, roots = _branch(phase, n, int(np.ceil(np.log(max(amounts.max() / FIRST, 1)) / np.log(RATIO))))
    nearest = np.searchsorted(np.abs(nodes), amounts, side="right") - 1
    start, at = roots[nearest], nodes[nearest][:, None]
    tau = _newton(start + (q[:, None] - at) / (start - at * at), q[:, None])
    return _constants(tau, soft=False)


def _branch(phase: complex, n: int, steps: int) -> tuple[ComplexArray, ComplexArray]:
    """Roots at q = 0 and FIRST x RATIO^j e^{iα}, j <= steps, kept for the next call: (m,), (m, n)."""
    nodes, roots = _BRANCHES.setdefault((phase, n), ([0j], [hard_roots(n)]))
    while len(nodes) < steps + 2:
        following = FIRST * RATIO ** (len(nodes) - 1) * phase
        _, found = _continue(nodes[-1], following, roots[-1])
        roots.append(found)
        nodes.append(following)
    return np.array(nodes), np.array(roots)


def _continue(start: complex, end: complex, roots: ComplexArray) -> tuple[complex, ComplexArray]:
    """Carry the roots from one q to another: midpoint steps of dτ/dq, each polished by Newton.

    Two roots meet where δ = τ - q² is 0. A step lets δ, with dδ/dq = 1/δ - 2q, change by a fifth at most; it is halved
    when roots run together.
    """
    if start == end:
        return end, roots
    ray = (end - start) / abs(end - start)
    while start != end:
        delta = roots - start * start
        reach = 0.2 * float(np.min(np.abs(delta) / np.maximum(np.abs(1 / delta - 2 * start), 1e-12)))
        step = min(reach, 0.5 * max(1.0, abs(start)), abs(end - start))
        while True:
            following = end if step == abs(end - start) else start + step * ray
            middle = start + 0.5 * step * ray
            half = roots + 0.5 * step * ray / delta
            found = _newton(roots + step * ray / (half - middle * middle), following)
            # where q lies on a branch point two roots are one, and taken as they are
            if step < 1e-9 or (np.all(np.isfinite(found)) and _apart(found, roots, step)):
                break
            step *= 0.5
        start, roots = following, found
    return end, roots


def _apart(found: ComplexArray, before: ComplexArray, step: float) -> bool:
    """Whether the roots are still distinct, and none has jumped to another's place."""
    gaps = np.abs(found[:, None] - found[None, :]) + np.diag(np.full(len(found), np.inf))
    moved = np.abs(found - before)
    near = np.min(np.abs(before[:, None] - before[None, :]) + np.diag(np.full(len(before), np.inf)), axis=1)
    return bool(np.min(gaps) > 1e-7 and np.all(moved < 0.5 * near + 3 * step * (1 + np.abs(found)) ** 0.5))


def _newton(tau: ComplexArray, q: complex | ComplexArray) -> ComplexArray:
    """Roots of w1' = q w1 near tau, by Newton on r - q or on 1/r - 1/q, r = w1'/w1, whichever is small there.

    dr/dτ = τ - r² by Airy's equation.
    """
    done = np.zeros(np.shape(tau), dtype=bool)
    for _ in range(12):
        value, slope, _ = scaled_ai(tau * TURN)
        slope = slope * TURN
        with np.errstate(divide="ignore", invalid="ignore"):
            r, inverse = slope / value, value / slope
            move = np.where(np.abs(r) < 1, (r - q) / (tau - r * r), (inverse - 1 / q) / (1 - tau * inverse * inverse))
        # each root stops by itself, whatever goes with it
        tau = np.where(done, tau, tau - move)
        # convergence is quadratic: the next move would be below rounding
        done |= np.abs(move) < 1e-9 * np.maximum(1.0, np.abs(tau))
        if np.all(done):
            break
    return tau


def _constants(tau: ComplexArray, *, soft: bool) -> Modes:
    value, slope, zeta = scaled_ai(tau * TURN)
    value, slope = W1 * value, W1 * TURN * slope
    if soft:
        value = np.zeros_like(value)
    # all but the residues are ratios, free of the factor e^{-ζ}; a bound surface wave, whose w1 is huge, is not excited
    # by a plane wave: its residues underflow to 0
    divisor = slope * slope - tau * value * value
    return Modes(
        tau=tau,
        residue=np.exp(2 * zeta) / divisor,
        m0=-value * value / divisor,
        q_m0=-value * slope / divisor,
        surface=np.exp(zeta) * (slope if soft else -value) / divisor,
    )


@cache
def _terms(power: int, kind: Literal["R", "R²", "S"]) -> ComplexArray:
    """Coefficients of ξ^(3j/2) of V_n ξ^n, of the integral of R² over √ξ, or of U_n ξ^n: (terms,)."""
    # of t^(-3j/2) in √t R or S/√t, by their equations
    a = np.zeros(40)
    a[0] = 1.0
    for n in range(1, len(a)):
        a[n] = 0.5 * ((1.5 * n - (2.0 if kind == "S" else 1.0)) * a[n - 1] - a[1:n] @ a[n - 1 : 0 : -1])
    if kind == "R²":
        a = np.convolve(a, a)[: len(a)]
    mu = {"R": 0.5, "R²": 1.0, "S": -0.5}[kind] + 1.5 * np.arange(len(a)) - power
    factor = (-2j if kind == "S" else 1) * np.sqrt(np.pi) * np.exp(-0.25j * np.pi)
    return np.asarray(a * np.exp(0.5j * np.pi * mu) * rgamma(mu) * factor)


def _by_series_and_modes(
    xi: FloatArray, power: int, kind: Literal["R", "R²", "S"], far: Callable[[FloatArray, int], ComplexArray]
) -> ComplexArray:
    """A coupling function: the series up to SERIES, ``far(xi (n, 1), modes)`` of so many modes (n,) beyond."""
    xi = np.asarray(xi, dtype=float)
    out = np.empty(xi.shape, dtype=complex)
    small, deep = xi <= SERIES, xi > DEEP
    near = xi[small]
    shift = np.sqrt(near) if kind == "R²" else near ** (-float(power))
    out[small] = shift * np.polynomial.polynomial.polyval(near**1.5, _terms(power, kind))
    for some, count in ((~small & ~deep, 16), (deep, 5)):
        out[some] = far(xi[some, None], count)
    return out


def coupling_function(xi: FloatArray, power: int = 0, *, squared: bool = False) -> ComplexArray:
    """V_n(ξ), ξ > 0, n the ``power`` of t under the integral; ``squared`` has R² there for R, n = 0: (...) -> (...).

    Examples
    --------
    >>> complex(coupling_function(np.array(1.0)).round(6))
    (0.699914+0.213383j)
    """

    def far(xi: FloatArray, count: int) -> ComplexArray:
        tau = hard_modes(count).tau
        residues = (1j * xi - 1 / tau) / tau**2 if squared else tau ** (power - 1)
        total = np.sum(residues * np.exp(1j * xi * tau), axis=-1)
        return np.asarray(np.exp(0.25j * np.pi) * np.sqrt(np.pi * xi[:, 0]) * total)

    return _by_series_and_modes(xi, power, "R²" if squared else "R", far)


def soft_coupling_function(xi: FloatArray, power: int = 0) -> ComplexArray:
    """U_n(ξ), ξ > 0, n the ``power`` of t under the integral: (...) -> (...).

    Examples
    --------
    >>> complex(soft_coupling_function(np.array(1.0)).round(6))
    (0.440321+0.303544j)
    """

    def far(xi: FloatArray, count: int) -> ComplexArray:
        tau = soft_modes(count).tau
        total = np.sum(tau**power * np.exp(1j * xi * tau), axis=-1)
        return np.asarray(2 * np.exp(-0.25j * np.pi) * np.sqrt(np.pi) * xi[:, 0] ** 1.5 * total)

    return _by_series_and_modes(xi, power, "S", far)
