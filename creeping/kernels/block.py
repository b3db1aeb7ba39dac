"""What kernels share: blocks of rays, aligned memory, the compiler's options.

Rays go in blocks of BLOCK, stored component by component, so that the loops over a block vectorise.
"""

from pathlib import Path

import numpy as np
from numba import njit

from creeping._typing import Any
from creeping.kernels.cache import discard_stale, keep_private
from creeping.kernels.first_use import watch
from creeping.kernels.threads import BLOCK as BLOCK

_digest = discard_stale(Path(__file__).parents[1])
keep_private(Path(__file__).parents[1], _digest)

_common: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True}
# of kernels that Python calls
entry_options = _common | {"fastmath": {"contract", "reassoc", "nsz", "arcp"}}
# Of kernels that kernels call. Inlined whole: of a callee that stays a call, a process that compiles it alone and one
# that loads it from the cache within its caller have differently optimised copies, and sums that may be reordered
# differ in their last digits. Not for those that Python calls: they would be inlined into what numba wraps them in,
# and compiled three times.
options = entry_options | {"forceinline": True}
# For kernels too large to be inlined whole: they keep to the letter of floating-point arithmetic, so that results are
# the same however the compiler has cut the calls. Said even so: what a callee leaves open numba takes from its caller.
strict_options = _common | {"fastmath": False}
# of what is inlined into several kernels that are to agree to the last digit
strict_inlined = strict_options | {"forceinline": True}


# numba would compile it for each pair of constants
@njit("float64[:, ::1](int64, int64)", **options)
def aligned(rows, columns):
    """Uninitialised array whose rows of whole vectors do not straddle cache lines."""
    flat = np.empty(rows * columns + 8)
    skip = (64 - flat.ctypes.data % 64) % 64 // 8
    return flat[skip : skip + rows * columns].reshape(rows, columns)


@njit(**options)
def copy(source, target):
    """Copy source (n,) to target, which is as long; not by slices, whose message on shapes takes seconds to compile."""
    for i in range(source.shape[0]):
        target[i] = source[i]


watch(Path(aligned.stats.cache_path), _digest)
