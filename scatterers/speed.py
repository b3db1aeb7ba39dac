"""Speed c(x) > 0 of the weighted flow, from an expression in x, y, z or from a user's object.

Expressions are differentiated symbolically (sympy) and compiled; they never pass through ``eval`` as written.

Also here: admittance of a coating that varies over a body, from expressions in x, y, z.

Expressions are parsed by a whitelist; they never pass through ``eval`` as written.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from creeping._typing import ComplexArray, FloatArray
from scatterers.kernels.compiled import SYMMETRIC, Compiled, evaluated


@dataclass(frozen=True)
class ExpressionSpeed:
    """Speed given by an expression such as ``"1 + x"``.

    Parameters
    ----------
    expression : str
        Numbers, x, y, z, pi, + - * / **, parentheses and sqrt, exp, log, sin, cos, tan, sinh, cosh, tanh.

    Raises
    ------
    ValueError
        If the expression contains anything else.

    Examples
    --------
    >>> import numpy as np
    >>> import scatterers as sc
    >>> speed = sc.ExpressionSpeed("1 + x/2")
    >>> float(speed.value(np.array([1.0, 0.0, 0.0]))), speed.gradient(np.array([1.0, 0.0, 0.0]))
    (1.5, array([0.5, 0. , 0. ]))
    """

    expression: str

    def __post_init__(self) -> None:
        _ = self._functions

    @cached_property
    def _functions(self) -> Any:
        from scatterers.expression import differentiate

        return differentiate(self.expression)

    def __reduce__(self) -> tuple[type["ExpressionSpeed"], tuple[str]]:
        # functions are made again from the text
        return type(self), (self.expression,)

    @property
    def fingerprint(self) -> str:
        """Text that identifies the speed."""
        return repr(self.expression)

    @property
    def compiled(self) -> Compiled:
        """Compiled evaluator of c, grad c and its Hessian."""
        return Compiled(self._functions.block, "level", np.zeros(1))

    def value(self, points: FloatArray) -> FloatArray:
        """Speed c (...), L/time, at points (..., 3), L."""
        return evaluated(self.compiled, points)[0]

    def gradient(self, points: FloatArray) -> FloatArray:
        """Gradient of c (..., 3), 1/time, at points (..., 3), L."""
        return evaluated(self.compiled, points)[1]

    def hessian(self, points: FloatArray) -> FloatArray:
        """Hessian of c (..., 3, 3), 1/(L time), at points (..., 3), L."""
        return evaluated(self.compiled, points)[2][..., SYMMETRIC]


def as_speed(speed: Any) -> Any:
    """Accept None, an expression, or an object with ``value`` and ``gradient``.

    Raises
    ------
    TypeError
        If it is none of these.
    """
    if speed is None or all(callable(getattr(speed, name, None)) for name in ("value", "gradient")):
        return speed
    if isinstance(speed, str):
        return ExpressionSpeed(speed)
    raise TypeError(f"speed {speed!r} is neither an expression nor an object with value(points) and gradient(points)")


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
        from scatterers.expression import differentiate

        return tuple(differentiate(text).value for text in (self.real, self.imaginary))

    def __reduce__(self) -> tuple[type["Coating"], tuple[str, str]]:
        # functions are made again from the texts
        return type(self), (self.real, self.imaginary)

    @property
    def fingerprint(self) -> str:
        """Text that identifies the admittance."""
        return self.real if self.imaginary == "0" else f"{self.real} + 1j*({self.imaginary})"

    def value(self, points: FloatArray) -> ComplexArray:
        """Admittance (...) at points (..., 3), L."""
        x, y, z = np.moveaxis(np.asarray(points, dtype=float), -1, 0)
        real, imaginary = (np.broadcast_to(function(x, y, z)[0], x.shape) for function in self._functions)
        return np.asarray(real + 1j * imaginary)
