"""What all references share: the boundary conditions in one form, types of arrays, what is refused.

    alpha u + (beta/k) ∂u/∂n = 0

soft: alpha = 1, beta = 0; hard: alpha = 0, beta = 1; impedance eta: alpha = i eta, beta = 1.

The time factor is e^{-iωt}, n the outward normal, eta = rho c/Z, passive for Re eta ≥ 0.
"""

from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
ComplexArray: TypeAlias = NDArray[np.complex128]
Arrays: TypeAlias = dict[str, NDArray[np.floating | np.complexfloating]]
"""What a case returns, by names."""
Boundary: TypeAlias = Literal["soft", "hard"] | complex
"""Soft, hard, or the impedance number eta."""


def condition(boundary: Boundary) -> tuple[complex, complex]:
    """Coefficients (alpha, beta) of alpha u + (beta/k) ∂u/∂n = 0."""
    if isinstance(boundary, str):
        if boundary not in ("soft", "hard"):
            raise ValueError(f"boundary is 'soft', 'hard' or a complex eta; got {boundary!r}")
        return (1.0, 0.0) if boundary == "soft" else (0.0, 1.0)
    return 1j * complex(boundary), 1.0


def series_length(x: float) -> int:
    """Orders after which the series of a body of size x = ka has converged to rounding.

    J_n(x) falls beyond n = x like Ai(z), z = (2/x)^{1/3} (n - x): 12 x^{1/3} past x it is below 1e-16. Not many more,
    lest H_n(x), which grows as J_n falls, overflow at small x.
    """
    return int(x + 12 * x ** (1 / 3)) + 12


def positive(**values: float) -> None:
    """Refuse numbers that are not positive and finite."""
    for name, value in values.items():
        if not (np.isfinite(value) and value > 0):
            raise ValueError(f"{name} is {value!r}; a positive finite number is needed")
