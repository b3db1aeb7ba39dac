"""Python functions as block evaluators: kernels call them by address, as they call compiled ones.

numba passes an array to a C function field by field, (meminfo, parent, nitems, itemsize, data, shape..., strides...);
a callback reads the fields and works on views of the kernel's own memory. It takes the interpreter's lock for each
block of points. What a function raises cannot pass through a kernel: it is noted, the results are NaN, and
`raise_failure` raises it afterwards. An interrupt can come between any two steps of the interpreter, so also where a
callback has not yet begun to catch: `noted_interrupts` hands it to the callback that it meets.
"""

import ctypes
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType

import numpy as np

# numba tells the type of a callback only once this is imported, which it does itself after a first failure
from numba import types
from numba.experimental import function_type as _function_type  # noqa: F401

from creeping._typing import Any, FloatArray


class BlockCallback(types.WrapperAddressProtocol):  # type: ignore[misc]
    """A Python function that kernels take in the place of a compiled one.

    Parameters
    ----------
    function : callable
        Fills the arrays it is given, but for those that hold the points, and the last, its parameters.
    signature
        numba signature of the compiled function it stands for.
    inputs : sequence of int
        Numbers of the arguments that are not filled.
    """

    def __init__(self, function: Callable[..., None], signature: Any, inputs: Sequence[int]) -> None:
        self._function, self._signature, self._inputs = function, signature, frozenset(inputs)
        self._arrays = [(a.ndim, ctypes.c_int64 if a.dtype == types.int64 else ctypes.c_double) for a in signature.args]
        fields = sum(5 + 2 * ndim for ndim, _ in self._arrays)
        # kept: the address is valid as long as this object lives
        self._entry = ctypes.CFUNCTYPE(None, *[ctypes.c_int64] * fields)(self._call)
        self._failure: BaseException | None = None

    @property
    def function(self) -> "BlockCallback":
        """What is handed to a kernel."""
        return self

    @property
    def parameters(self) -> FloatArray:
        """None are needed: (1,)."""
        return np.zeros(1)

    def signature(self) -> Any:
        """Signature, for numba."""
        return self._signature

    def __wrapper_address__(self) -> int:
        """Address, for numba."""
        return int(ctypes.cast(self._entry, ctypes.c_void_p).value or 0)

    def _views(self, fields: Sequence[int]) -> Iterator[np.ndarray[Any, Any]]:
        at = 0
        for ndim, kind in self._arrays:
            shape = fields[at + 5 : at + 5 + ndim]
            count = int(np.prod(shape))
            data = (kind * count).from_address(fields[at + 4])
            yield np.ctypeslib.as_array(data).reshape(shape)
            at += 5 + 2 * ndim

    def _call(self, *fields: int) -> None:
        arrays = list(self._views(fields))
        try:
            # what is left of a call that has failed is not worth its time
            if self._failure is None:
                self._function(*arrays)
        except BaseException as error:  # an interrupt must not get lost either
            self._failure = error
        if self._failure is not None:
            for number, array in enumerate(arrays[:-1]):
                if number not in self._inputs:
                    array[...] = np.nan if array.dtype.kind == "f" else 0

    def raise_failure(self) -> None:
        """Raise what the function has raised since the last call of this or of `forget_failure`."""
        failure = self._failure
        self.forget_failure()
        if failure is not None:
            raise failure

    def forget_failure(self) -> None:
        """Begin anew, where another error ends the call."""
        self._failure = None


def _callback_of(frame: FrameType | None) -> BlockCallback | None:
    """The callback that runs in a frame, or in one of those that have called it."""
    while frame is not None:
        if frame.f_code is BlockCallback._call.__code__:
            found: BlockCallback = frame.f_locals["self"]
            return found
        frame = frame.f_back
    return None


@contextmanager
def noted_interrupts() -> Iterator[None]:
    """Inside, what the handler of SIGINT raises in a callback is noted there, where ctypes would swallow it."""
    handler = signal.getsignal(signal.SIGINT)
    if not callable(handler) or threading.current_thread() is not threading.main_thread():
        yield
        return

    def noting(number: int, frame: FrameType | None) -> None:
        met = _callback_of(frame)
        try:
            handler(number, frame)
        except BaseException as error:
            if met is None:
                raise
            # what is left of the call is passed over
            met._failure = error

    signal.signal(signal.SIGINT, noting)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)


def level_callback(function: Callable[..., None]) -> BlockCallback:
    """Callback for a level: ``function(points (3, n), F (n,), gradients (3, n), Hessians (6, n), _)``."""
    row, rows = types.float64[::1], types.float64[:, ::1]
    return BlockCallback(function, types.void(rows, row, rows, rows, row), (0,))


def locator_callback(function: Callable[..., None]) -> BlockCallback:
    """Callback for a locator: ``function(points (3, n), gradients (3, n), chart (n,), uv (2, n), frame (6, n), _)``."""
    row, rows = types.float64[::1], types.float64[:, ::1]
    return BlockCallback(function, types.void(rows, rows, types.int64[::1], rows, rows, row), (0, 1))
