"""Explicit Runge-Kutta methods: stages, solution, error estimates and dense output.

    k_s = f(y + h sum_j a_sj k_j),   y1 = y + h sum_j b_j k_j,   k_12 = f(y1) of the order-8 pair
    e = h sum_j e_j k_j              of order 3 and of order 5
    y(theta) = y + h sum_j w_j(theta) k_j,  j <= 15: of order 7, with three more stages

Sources: [HNW93, sec. II.5, II.6, II.10]; coefficients as scipy keeps them.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from creeping._typing import Any, FloatArray


class Tableau(NamedTuple):
    """Explicit Runge-Kutta method: stage matrix a, weights b, error weights e3 and e5 (zero: no estimate)."""

    a: FloatArray
    b: FloatArray
    e3: FloatArray
    e5: FloatArray


class Method(NamedTuple):
    """A method as the tracer's kernel knows it: its stage s is row ``first + s`` of `STAGE_WEIGHTS`; how many."""

    first: int
    stages: int


DORMAND_PRINCE_8 = Method(0, 12)
"""The order-8 pair, the only one that estimates errors and has dense output."""
RUNGE_KUTTA_4 = Method(16, 4)
"""The classical method of order 4, the integrator of the burn-in."""
SOLUTION, THIRD, FIFTH = 12, 21, 22
"""Rows of the order-8 pair: its solution and the two error estimates."""
STAGES = 16
"""Stages of the order-8 pair with y1 and those of the dense output."""


def _pair() -> Any:
    from scipy.integrate import DOP853

    return DOP853


@cache
def dormand_prince_8() -> Tableau:
    """The order-8 pair with its error estimates of order 3 and 5."""
    return Tableau(*(np.ascontiguousarray(v, dtype=float) for v in (_pair().A, _pair().B, _pair().E3, _pair().E5)))


@cache
def runge_kutta_4() -> Tableau:
    """The classical method of order 4."""
    a = np.array([[0.0, 0, 0, 0], [0.5, 0, 0, 0], [0, 0.5, 0, 0], [0, 0, 1, 0]])
    return Tableau(a, np.array([1, 2, 2, 1]) / 6, np.zeros(5), np.zeros(5))


@cache
def _stage_weights() -> list[list[float]]:
    pair, classical = dormand_prince_8(), runge_kutta_4()
    out = np.zeros((23, STAGES))
    out[:12, :12], out[SOLUTION, :12], out[13:16] = pair.a, pair.b, _pair().A_EXTRA
    out[16:20, :4], out[20, :4] = classical.a, classical.b
    out[THIRD, :13], out[FIFTH, :13] = pair.e3, pair.e5
    return out.tolist()


STAGE_WEIGHTS = _stage_weights
"""Weights of all sums over stages that a step takes, (23, STAGES), when asked for: scipy takes its time to come.

Stages 0 to 11 of the order-8 pair, its solution, the three stages of its dense output; stages 0 to 3 of the classical
method, its solution; the error estimates.
"""


@cache
def dense_weights() -> FloatArray:
    """w_j(theta)/theta as polynomials, highest power first: (7, STAGES).

    The interpolant is sum_i F_i phi_i, phi = theta, theta (1 - theta), theta^2 (1 - theta), ..., alternately, with
    F_0 = y1 - y, F_1 = h k_0 - F_0, F_2 = 2 F_0 - h (k_0 + k_12) and four rows of weights more.
    """
    difference, begins, ends = np.array(STAGE_WEIGHTS()[SOLUTION]), np.eye(STAGES)[0], np.eye(STAGES)[12]
    parts = np.vstack([difference, begins - difference, 2 * difference - begins - ends, _pair().D])
    basis, out = np.poly1d([1.0]), np.zeros((7, STAGES))
    for i, part in enumerate(parts):
        out[7 - len(basis.coeffs) :] += basis.coeffs[:, None] * part
        basis = basis * (np.poly1d([-1.0, 1.0]) if i % 2 == 0 else np.poly1d([1.0, 0.0]))
    return out
