"""Compiled block functions as kernels take them, with their numba type known beforehand.

numba finds the type of a function that is an argument anew at each call, by its signature: half of the time of a call
for few points.
"""

from typing import Any

from numba import types

# registers how numba passes such functions; else it does that itself after a first failure
from numba.experimental import function_type as _function_type  # noqa: F401
from numba.extending import typeof_impl


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


@typeof_impl.register(BlockFunction)  # type: ignore[untyped-decorator]
def _numba_type(function: BlockFunction, _: Any) -> Any:
    return function.numba_type
