"""The larger or smaller of several expressions, as a sympy function that keeps them apart.

Chosen(a_1, ..., a_n, v_1, ..., v_n) is the v_k of the largest a_k, the first of equal ones: max(a, b) is
Chosen(a, b, a, b), min(a, b) is Chosen(-a, -b, a, b), and a derivative has those of the v. sympy's own Max and Min have
derivatives with steps, and its Piecewise rewrites conditions that have other pieces in them.
"""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray


@cache
def chosen() -> Any:
    """Class of the function; sympy is imported at the first call."""
    import sympy

    class Chosen(sympy.Function):  # type: ignore[misc]
        """See the head of the module."""

        @property
        def keys(self) -> tuple[Any, ...]:
            """a_1, ..., a_n."""
            return tuple(self.args[: len(self.args) // 2])

        @property
        def values(self) -> tuple[Any, ...]:
            """v_1, ..., v_n."""
            return tuple(self.args[len(self.args) // 2 :])

        def _eval_derivative(self, symbol: Any) -> Any:
            return type(self)(*self.keys, *(value.diff(symbol) for value in self.values))

        def _pythoncode(self, printer: Any) -> str:
            keys = [f"({printer.doprint(key)})" for key in self.keys]
            values = [f"({printer.doprint(value)})" for value in self.values]
            text = values[-1]
            for k in range(len(keys) - 2, -1, -1):
                largest = " and ".join(f"{keys[k]} >= {other}" for other in keys[k + 1 :])
                text = f"({values[k]} if {largest} else {text})"
            return text

    return Chosen


def numeric_chosen(*arguments: Any) -> NDArray[np.float64]:
    """Chosen of arrays that broadcast."""
    half = len(arguments) // 2
    parts = np.broadcast_arrays(*(np.asarray(part, dtype=float) for part in arguments))
    which = np.argmax(np.stack(parts[:half]), axis=0)
    return np.asarray(np.take_along_axis(np.stack(parts[half:]), which[None], axis=0)[0])
