"""Array types used in signatures; shapes are stated in the docstrings."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
ComplexArray = NDArray[np.complex128]

__all__ = ["Any", "ArrayLike", "BoolArray", "ComplexArray", "FloatArray", "IntArray"]
