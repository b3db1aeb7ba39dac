"""Rational steps of the one-way equation: poles and weights of its Pade approximants.

    exp{i delta (sqrt(1 + X) - 1)} = sum_j c_j/(1 + b_j X),   delta = k ds,   j = 1..p

is the [p-1/p] approximant about X = 0, p = 4. It has |f| <= 1 on the real axis and falls at both its ends, so that
evanescent waves are damped; [p/p] does not damp them. In partial fractions the poles need one right-hand side only.

The Taylor series is that of an exponential of a series, and the equations for the denominator are solved in rational
numbers, since in floating point they lose all digits. Ordered by their real parts, poles vary smoothly with delta: they
are tabulated once over log delta and interpolated by polynomials of degree DEGREE, to 1e-8 in f.

Sources: [C93], [BG96]; Derivations, F22.
"""

from fractions import Fraction
from functools import cache

import numpy as np

from creeping._typing import ComplexArray, FloatArray

ORDER = 4
PER_OCTAVE = 8
"""Tabulated steps in a factor 2 of delta."""
DEGREE = 7
_LONG = 1 << 40
"""Denominator of the tabulated delta: exact and short."""
Gauss = tuple[Fraction, Fraction]
"""Rational complex number."""


def rational_step(delta: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Poles b and weights c of steps delta = k ds (n,): (n, ORDER) each.

    Examples
    --------
    >>> b, c = rational_step(np.array([1.5]))
    >>> X = -0.4
    >>> exact = np.exp(1.5j * (np.sqrt(1 + X) - 1))
    >>> bool(abs(np.sum(c / (1 + b * X)) - exact) < 1e-5)
    True
    """
    at = PER_OCTAVE * np.log2(delta)
    first = np.floor(at).astype(int) - (DEGREE - 1) // 2
    nodes = first[:, None] + np.arange(DEGREE + 1)
    used = np.arange(nodes.min(), nodes.max() + 1)
    table = np.array([tabulated_step(int(node)) for node in used])
    # Lagrange's weights on unit nodes
    far = at[:, None] - nodes
    weights = np.ones_like(far)
    for i in range(DEGREE + 1):
        for j in range(DEGREE + 1):
            if i != j:
                weights[:, i] *= far[:, j] / (i - j)
    found = np.einsum("ni,nixp->xnp", weights, table[nodes - used[0]])
    return found[0], found[1]


@cache
def tabulated_step(node: int) -> ComplexArray:
    """Poles and weights (2, ORDER) of delta = 2^(node/PER_OCTAVE)."""
    delta = Fraction(round(2.0 ** (node / PER_OCTAVE) * _LONG), _LONG)
    numerator, denominator = _pade(_taylor(delta, 2 * ORDER))
    zeros = np.roots(denominator[::-1])
    poles = -1 / zeros
    order = np.argsort(-poles.real)
    zeros, poles = zeros[order], poles[order]
    others = 1 + poles[None, :] * zeros[:, None]
    np.fill_diagonal(others, 1)
    return np.stack([poles, np.polyval(numerator[::-1], zeros) / np.prod(others, axis=1)])


def _taylor(delta: Fraction, count: int) -> list[Gauss]:
    """Coefficients of exp{i delta (sqrt(1 + X) - 1)}: with g its exponent, j e_j = sum_i i g_i e_(j-i)."""
    root, exponent = Fraction(1), [Fraction(0)]
    for j in range(1, count):
        root *= (Fraction(3, 2) - j) / j
        exponent.append(delta * root)
    series: list[Gauss] = [(Fraction(1), Fraction(0))]
    for j in range(1, count):
        real = -sum((i * exponent[i] * series[j - i][1] for i in range(1, j + 1)), Fraction(0))
        imaginary = sum((i * exponent[i] * series[j - i][0] for i in range(1, j + 1)), Fraction(0))
        series.append((real / j, imaginary / j))
    return series


def _pade(series: list[Gauss]) -> tuple[ComplexArray, ComplexArray]:
    """Numerator (p) and denominator (p + 1) of [p-1/p], lowest powers first, of 2p Taylor coefficients."""
    p = len(series) // 2
    rows = [
        [*(series[m - i] for i in range(1, p + 1)), _times((Fraction(-1), Fraction(0)), series[m])]
        for m in range(p, 2 * p)
    ]
    for column in range(p):
        pivot = next(r for r in range(column, p) if any(rows[r][column]))
        rows[column], rows[pivot] = rows[pivot], rows[column]
        head = rows[column][column]
        size = head[0] ** 2 + head[1] ** 2
        rows[column] = [_times(value, (head[0] / size, -head[1] / size)) for value in rows[column]]
        for r in range(p):
            if r != column:
                rows[r] = [
                    _minus(value, _times(rows[r][column], other))
                    for value, other in zip(rows[r], rows[column], strict=True)
                ]
    denominator: list[Gauss] = [(Fraction(1), Fraction(0)), *(row[p] for row in rows)]
    numerator = []
    for m in range(p):
        total: Gauss = (Fraction(0), Fraction(0))
        for i in range(m + 1):
            total = _minus(total, _times((Fraction(-1), Fraction(0)), _times(denominator[i], series[m - i])))
        numerator.append(total)
    return np.array([complex(*map(float, v)) for v in numerator]), np.array(
        [complex(*map(float, v)) for v in denominator]
    )


def _times(a: Gauss, b: Gauss) -> Gauss:
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


def _minus(a: Gauss, b: Gauss) -> Gauss:
    return a[0] - b[0], a[1] - b[1]
