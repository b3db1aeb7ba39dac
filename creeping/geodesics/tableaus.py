"""Explicit Runge-Kutta methods: stages, solution, error estimates and dense output.

    k_s = f(y + h sum_j a_sj k_j),   y1 = y + h sum_j b_j k_j,   k_12 = f(y1) of the order-8 pair
    e = h sum_j e_j k_j              of order 3 and of order 5
    y(theta) = y + h sum_j w_j(theta) k_j,  j <= 15: of order 7, with three more stages

Sources: [HNW93, sec. II.5, II.6, II.10]; coefficients as scipy keeps them.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from creeping._typing import FloatArray


class Method(NamedTuple):
    """A method as the tracer's kernel knows it: its stage s is row ``first + s`` of `STAGE_WEIGHTS`; how many."""

    first: int
    stages: int


DORMAND_PRINCE_8 = Method(0, 12)
"""The order-8 pair, the only one that estimates errors and has dense output."""
RUNGE_KUTTA_4 = Method(16, 4)
"""The classical method of order 4, the integrator of the burn-in."""
STAGES = 16
"""Stages of the order-8 pair with y1 and those of the dense output."""


@cache
def _stage_weights() -> list[list[float]]:
    from scipy.integrate import DOP853

    out = np.zeros((23, STAGES))
    out[:12, :12], out[12, :12], out[13:16] = DOP853.A, DOP853.B, DOP853.A_EXTRA
    out[17, 0], out[18, 1], out[19, 2], out[20, :4] = 0.5, 0.5, 1.0, np.array([1, 2, 2, 1]) / 6
    out[21, :13], out[22, :13] = DOP853.E3, DOP853.E5
    return out.tolist()


STAGE_WEIGHTS = _stage_weights
"""Weights of all sums over stages that a step takes, (23, STAGES), when asked for: scipy takes its time to come.

Stages 0 to 11 of the order-8 pair, its solution, row 12, the three stages of its dense output; stages 0 to 3 of the
classical method, its solution; the error estimates of order 3 and 5, rows 21 and 22.
"""


@cache
def dense_weights() -> FloatArray:
    """w_j(theta)/theta as polynomials, highest power first: (7, STAGES).

    The interpolant is sum_i F_i phi_i, phi = theta, theta (1 - theta), theta^2 (1 - theta), ..., alternately, with
    F_0 = y1 - y, F_1 = h k_0 - F_0, F_2 = 2 F_0 - h (k_0 + k_12) and four rows of weights more.
    """
    from scipy.integrate import DOP853

    difference, begins, ends = np.array(STAGE_WEIGHTS()[12]), np.eye(STAGES)[0], np.eye(STAGES)[12]
    parts = np.vstack([difference, begins - difference, 2 * difference - begins - ends, DOP853.D])
    basis, out = np.poly1d([1.0]), np.zeros((7, STAGES))
    for i, part in enumerate(parts):
        out[7 - len(basis.coeffs) :] += basis.coeffs[:, None] * part
        basis = basis * (np.poly1d([-1.0, 1.0]) if i % 2 == 0 else np.poly1d([1.0, 0.0]))
    return out
