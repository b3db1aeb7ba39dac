"""The largest of several expressions, and the one that a comparison chooses, as sympy functions.

max(a, b) is Largest(a, b), min(a, b) is -Largest(-a, -b), and where(a < b, c, d) is Chosen(Which(a, b), d, c): Which is
the number of the largest, the first of equal ones, and Chosen(k, v_0, v_1, ...) is v_k. A derivative is that of what is
chosen. sympy's own Max and Min have derivatives with steps, and its Piecewise rewrites conditions that have other
pieces in them.
"""

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scatterers.kernels.compiled import helper


class Choosing(NamedTuple):
    """The sympy functions of this module."""

    Largest: Any
    Chosen: Any
    Which: Any


@cache
def choosing() -> Choosing:
    """Classes of the functions; sympy is imported at the first call."""
    import sympy

    class Which(sympy.Function):  # type: ignore[misc]
        """Number of the largest argument."""

        @classmethod
        def eval(cls, *keys: Any) -> Any:
            if all(key.is_number for key in keys):
                return sympy.Integer(largest([float(key) for key in keys]))
            return None

        def _pythoncode(self, printer: Any) -> str:
            return f"largest(({', '.join(f'float({printer.doprint(key)})' for key in self.args)}))"

    class Chosen(sympy.Function):  # type: ignore[misc]
        """The argument of this number."""

        @classmethod
        def eval(cls, which: Any, *values: Any) -> Any:
            if which.is_Integer:
                return values[int(which)]
            return values[0] if len(set(values)) == 1 else None

        @property
        def which(self) -> Any:
            return self.args[0]

        @property
        def values(self) -> tuple[Any, ...]:
            return tuple(self.args[1:])

        def _eval_derivative(self, symbol: Any) -> Any:
            return type(self)(self.which, *(value.diff(symbol) for value in self.values))

        def _pythoncode(self, printer: Any) -> str:
            which, *values = (f"({printer.doprint(part)})" for part in self.args)
            before = "".join(f"{value} if {which} == {k} else " for k, value in enumerate(values[:-1]))
            return f"({before}{values[-1]})"

    class Largest(sympy.Function):  # type: ignore[misc]
        """The largest argument."""

        @classmethod
        def eval(cls, *values: Any) -> Any:
            # as a tree, max in max would grow by a power of its depth
            flat = dict.fromkeys(part for one in values for part in (one.args if isinstance(one, cls) else (one,)))
            if all(value.is_number for value in flat):
                return sympy.Max(*flat)
            if len(flat) == 1:
                return next(iter(flat))
            return cls(*flat) if len(flat) < len(values) or any(isinstance(one, cls) for one in values) else None

        @property
        def which(self) -> Any:
            return Which(*self.args)

        @property
        def values(self) -> tuple[Any, ...]:
            return tuple(self.args)

        def _eval_derivative(self, symbol: Any) -> Any:
            return Chosen(self.which, *(value.diff(symbol) for value in self.values))

        def _pythoncode(self, printer: Any) -> str:
            return f"max({', '.join(printer.doprint(value) for value in self.args)})"

    return Choosing(Largest, Chosen, Which)


@helper
def largest(keys: Any) -> int:
    """Number of the largest, the first of equal ones."""
    found, most = 0, keys[0]
    for k in range(1, len(keys)):
        if keys[k] > most:
            found, most = k, keys[k]
    return found


def _stacked(*parts: Any) -> NDArray[np.float64]:
    return np.stack(np.broadcast_arrays(*(np.asarray(part, dtype=float) for part in parts)))


def _chosen(*parts: Any) -> NDArray[np.float64]:
    which, values = np.split(_stacked(*parts), [1])
    return np.asarray(np.take_along_axis(values, which.astype(np.int64), axis=0)[0])


NUMERIC: dict[str, Callable[..., Any]] = {
    "Which": lambda *parts: np.argmax(_stacked(*parts), axis=0),
    "Largest": lambda *parts: np.max(_stacked(*parts), axis=0),
    "Chosen": _chosen,
}
"""The functions of arrays that broadcast, by name."""
