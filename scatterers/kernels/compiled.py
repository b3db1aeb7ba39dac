"""Block evaluators of the bodies, compiled to functions that kernels call by address.

A *level evaluator* fills, for a block of n points, F, grad F and the six Hessian entries
(xx, yy, zz, yz, xz, xy); a *locator* is given the points with grad F there, and fills chart number, chart
variables and the polar frame (rows e1x, e1y, e1z, e2x, e2y, e2z). Of a sphere map x = psi(s), a *forward*
function fills x and the nine entries of d psi/ds by rows (xx, xy, xz, yx, ...), an *inverse* function fills s,
of unit length.
Parameters arrive in an array, so one compiled function serves every body of its class and is cached on disk.
numba is imported at the first use, for a quick start: plain Python that several of them call is marked by `helper`.

Python calls them through `evaluated`, `mapped` and `inverted`: there is no second, numpy version of a body.

Also here: compiled block functions as kernels take them, with their numba type known beforehand.

numba finds the type of a function that is an argument anew at each call, by its signature: half of the time of a call
for few points.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Literal, TypeVar

import numpy as np
from numba import njit, types

# registers how numba passes such functions; else it does that itself after a first failure
from numba.experimental import function_type as _function_type  # noqa: F401
from numba.extending import typeof_impl

from creeping._typing import FloatArray
from creeping.kernels.cache import discard_stale, keep_private

F = TypeVar("F", bound=Callable[..., Any])
# products may be contracted to fused multiply-adds, nothing else: a NaN stays a NaN and no sum is reordered
OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}}
SYMMETRIC = np.array([[0, 5, 4], [5, 1, 3], [4, 3, 2]])
"""Where xx, yy, zz, yz, xz, xy stand in a matrix."""


Kind = Literal["level", "locator", "forward", "inverse"]


# the level of a body is compiled from the file of the body
keep_private(Path(__file__).parents[1], discard_stale(Path(__file__).parents[1], every=True))


_helpers: list[Callable[..., Any]] = []


def helper(function: F) -> F:
    """Let compiled functions call this plain Python; numba is told at the first compilation."""
    _helpers.append(function)
    return function


@dataclass(frozen=True, eq=False)
class Compiled:
    """A block function, compiled when first asked for, and the parameters to call it with.

    Attributes
    ----------
    source : callable
        Plain Python of the function, with the arguments
        ``(points (3, n), values (n,), gradients (3, n), hessians (6, n), parameters)`` for a level or a speed,
        ``(points (3, n), gradients (3, n), chart (n,), uv (2, n), frame (6, n), parameters)`` for a locator,
        ``(s (3, n), points (3, n), derivatives (9, n), parameters)`` for a forward sphere map,
        ``(points (3, n), s (3, n), parameters)`` for its inverse.
        Code made from an expression has a member ``again``, a function and its arguments, which with kind and
        parameters give this object again: it is pickled by its text.
    kind : {"level", "locator", "forward", "inverse"}
    parameters : (k,) float64
    """

    source: Callable[..., None]
    kind: Kind
    parameters: FloatArray

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        make, *arguments = getattr(self.source, "again", (Compiled, self.source))
        return make, (*arguments, self.kind, self.parameters)

    @property
    def function(self) -> Any:
        """The compiled function, a `scatterers.kernels.compiled.BlockFunction`."""
        return _compile(self.source, self.kind)

    @property
    def operations(self) -> float:
        """Floating-point operations of a point, about: as the source says, or those of a quadric."""
        return float(getattr(self.source, "operations", 50.0))


@cache
def _compile(source: Callable[..., None], kind: str) -> Any:
    from numba import cfunc, types
    from numba.extending import register_jitable

    while _helpers:
        register_jitable(**OPTIONS)(_helpers.pop())
    row, rows = types.float64[::1], types.float64[:, ::1]
    signature = {
        "level": types.void(rows, row, rows, rows, row),
        "locator": types.void(rows, rows, types.int64[::1], rows, rows, row),
        "forward": types.void(rows, rows, rows, row),
        "inverse": types.void(rows, rows, row),
    }[kind]
    # code made from an expression has no file that numba could cache beside
    in_file = not source.__code__.co_filename.startswith("<")
    return BlockFunction(cfunc(signature, cache=in_file, **OPTIONS)(source))


class BlockFunction(types.WrapperAddressProtocol):  # type: ignore[misc]
    """A compiled block function.

    Parameters
    ----------
    compiled : numba CFunc
    """

    def __init__(self, compiled: Any) -> None:
        # kept: the address is valid as long as this lives
        self._compiled, self._address = compiled, int(compiled.address)
        self.numba_type = types.FunctionType(compiled._sig)

    def signature(self) -> Any:
        """Signature, for numba."""
        return self._compiled._sig

    def __wrapper_address__(self) -> int:
        """Address, for numba."""
        return self._address


@njit(cache=True)
def call(function, *blocks):  # type: ignore[no-untyped-def]
    """Fill one block by a compiled function, which Python itself cannot call."""
    function(*blocks)


def _columns(points: FloatArray) -> tuple[FloatArray, tuple[int, ...]]:
    """Points (..., 3) as the columns (3, n) of a block, and the shape (...)."""
    points = np.asarray(points, dtype=float)
    return np.ascontiguousarray(points.reshape(-1, 3).T), points.shape[:-1]


def evaluated(compiled: Compiled, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """F (...), its gradient (..., 3) and Hessian entries (..., 6), xx, yy, zz, yz, xz, xy, of a compiled level."""
    columns, shape = _columns(points)
    n = columns.shape[1]
    values, gradients, hessians = np.empty(n), np.empty((3, n)), np.empty((6, n))
    call(compiled.function, columns, values, gradients, hessians, compiled.parameters)
    return values.reshape(shape), gradients.T.reshape(*shape, 3), hessians.T.reshape(*shape, 6)


def mapped(compiled: Compiled, s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Points (..., 3) and derivatives (..., 3, 3) of a compiled forward map."""
    columns, shape = _columns(s)
    points, derivatives = np.empty_like(columns), np.empty((9, columns.shape[1]))
    call(compiled.function, columns, points, derivatives, compiled.parameters)
    return points.T.reshape(*shape, 3), derivatives.T.reshape(*shape, 3, 3)


def inverted(compiled: Compiled, points: FloatArray) -> FloatArray:
    """What a compiled inverse map makes of points (..., 3)."""
    columns, shape = _columns(points)
    found = np.empty_like(columns)
    call(compiled.function, columns, found, compiled.parameters)
    return found.T.reshape(*shape, 3)


@typeof_impl.register(BlockFunction)  # type: ignore[untyped-decorator]
def _numba_type(function: BlockFunction, _: Any) -> Any:
    return function.numba_type
