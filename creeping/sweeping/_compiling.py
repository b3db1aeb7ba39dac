"""What the kernels of sweeps share: options of the compiler, aligned memory, the engine's block of rays.

They call into those of the engine, so what is cached of them is dropped when either changes.
"""

from pathlib import Path

from creeping.phaseflow import _integrator
from creeping.phaseflow._freshness import discard_stale
from creeping.phaseflow._integrator import BLOCK, aligned

discard_stale(Path(__file__).parent, Path(_integrator.__file__).parent)

# Too large to be inlined whole as those of the engine are, so they keep to the letter of floating-point arithmetic:
# results are then the same however the compiler has cut the calls.
options = {"cache": True, "nogil": True, "error_model": "numpy"}

__all__ = ["BLOCK", "aligned", "options"]
