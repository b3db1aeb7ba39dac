"""Admittance of a coating that varies over a body, from expressions in x, y, z.

Expressions are parsed by a whitelist; they never pass through ``eval`` as written.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Coating:
    """Relative admittance given by expressions in x, y, z.

    Parameters
    ----------
    real : str
        Its real part, such as ``"0.3 + 0.1*z"``: numbers, x, y, z, pi, + - * / **, parentheses and sqrt, exp, log,
        sin, cos, tan, sinh, cosh, tanh.
    imaginary : str
        Its imaginary part.

    Raises
    ------
    ValueError
        If an expression contains anything else.

    Examples
    --------
    >>> import numpy as np
    >>> import scatterers as sc
    >>> sc.Coating("0.3 + 0.1*z", "0.2").value(np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])).round(12)
    array([0.4+0.2j, 0.2+0.2j])
    """

    real: str
    imaginary: str = "0"

    def __post_init__(self) -> None:
        _ = self._functions

    @cached_property
    def _functions(self) -> Any:
        from scatterers.expression.parsing import differentiate

        return tuple(differentiate(text).value for text in (self.real, self.imaginary))

    def __reduce__(self) -> tuple[type["Coating"], tuple[str, str]]:
        # functions are made again from the texts
        return type(self), (self.real, self.imaginary)

    @property
    def fingerprint(self) -> str:
        """Text that changes with the admittance."""
        return self.real if self.imaginary == "0" else f"{self.real} + 1j*({self.imaginary})"

    def value(self, points: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Eta (...) at points (..., 3), L."""
        x, y, z = np.moveaxis(np.asarray(points, dtype=float), -1, 0)
        real, imaginary = (np.broadcast_to(function(x, y, z)[0], x.shape) for function in self._functions)
        return np.asarray(real + 1j * imaginary)
