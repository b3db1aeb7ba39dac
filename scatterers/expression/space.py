"""F given by an expression, as sphere maps and kernels need it.

The kernels of the sphere map are written for a spline; here they run on the expression: the same code, with the
expression in the place of the spline's value and gradient, and a grid of one cell, the box, in its parameters.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from types import FunctionType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scatterers.expression.parsing import Differentiated, differentiate
from scatterers.kernels.compiled import OPTIONS, Compiled, Kind

FloatArray = NDArray[np.float64]
# nodes along an axis plus four, of one cell
ONE_CELL = 6.0


@dataclass(frozen=True, eq=False)
class ExpressionSpace:
    """F of an expression in a box; satisfies `scatterers.sphere_map.radial.SpaceLevel`.

    Attributes
    ----------
    expression : str
    box : (2, 3), L
    """

    expression: str
    box: FloatArray

    @property
    def functions(self) -> Differentiated:
        """The expression and its derivatives."""
        return differentiate(self.expression)

    def flat(self, of_map: FloatArray) -> FloatArray:
        """Parameters of the compiled functions: a grid of one cell and those of a map."""
        return np.concatenate([np.full(3, ONE_CELL), self.box[0], 1 / (self.box[1] - self.box[0]), of_map])

    @property
    def sources(self) -> dict[str, Callable[..., None]]:
        """Plain Python of the compiled functions."""
        return _sources(self.expression)


@lru_cache(maxsize=64)
def _sources(expression: str) -> dict[str, Callable[..., None]]:
    """The level and the sphere map's function on the expression, the same objects at every call."""
    from numba import njit

    from scatterers.kernels import radial as kernels

    space: dict[str, Any] = dict(vars(kernels))
    space["value_and_gradient"] = njit(**OPTIONS)(differentiate(expression).first)
    for name in ("_at", "_radius"):
        space[name] = njit(**OPTIONS)(FunctionType(space[name].py_func.__code__, space, name))
    # a file that does not exist: numba must not cache one expression's code for another
    code = kernels.forward.__code__.replace(co_filename="<expression>")
    forward = FunctionType(code, space, "forward")
    forward.again = compiled_forward, expression  # type: ignore[attr-defined]
    return {"level": differentiate(expression).block, "forward": forward}


def compiled_forward(expression: str, kind: Kind, parameters: FloatArray) -> Compiled:
    """The compiled sphere map's function on an expression."""
    return Compiled(_sources(expression)["forward"], kind, parameters)
