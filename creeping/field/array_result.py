"""Results that are arrays of complex values with more to say: numpy takes them for their values.

Arithmetic, ufuncs and numpy's functions give plain arrays; so does indexing.
"""

from collections.abc import Iterator

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from creeping._typing import Any, ComplexArray, FloatArray


class ArrayResult(NDArrayOperatorsMixin):
    """Base of results whose ``values`` they stand for."""

    # no state: results stay frozen dataclasses
    __slots__ = ()
    values: ComplexArray

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray[Any, Any]:
        """Values; the same memory unless a copy or another type is asked for."""
        if copy is False and dtype is not None and np.dtype(dtype) != self.values.dtype:
            raise ValueError(f"values of type {self.values.dtype} are no {np.dtype(dtype)} without a copy")
        return np.array(self.values, dtype=dtype, copy=True) if copy else np.asarray(self.values, dtype=dtype)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        """Apply a ufunc to the values."""
        plain = [one.values if isinstance(one, ArrayResult) else one for one in inputs]
        return getattr(ufunc, method)(*plain, **options)

    def __getitem__(self, index: Any) -> Any:
        """Part of the values."""
        return self.values[index]

    def __len__(self) -> int:
        """Length of the first axis."""
        return len(self.values)

    def __iter__(self) -> Iterator[Any]:
        """Values along the first axis."""
        return iter(self.values)

    def __bool__(self) -> bool:
        """Truth of a single value, as of an array."""
        return bool(self.values)

    def __complex__(self) -> complex:
        """A single value."""
        return complex(self.values.item())

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the values."""
        return self.values.shape

    @property
    def ndim(self) -> int:
        """Number of axes."""
        return self.values.ndim

    @property
    def size(self) -> int:
        """Number of values."""
        return self.values.size

    @property
    def dtype(self) -> np.dtype[Any]:
        """Type of the values."""
        return self.values.dtype

    @property
    def real(self) -> FloatArray:
        """Real parts."""
        return self.values.real

    @property
    def imag(self) -> FloatArray:
        """Imaginary parts."""
        return self.values.imag

    def conj(self) -> ComplexArray:
        """Complex conjugates."""
        return self.values.conj()

    def copy(self) -> ComplexArray:
        """Values, copied."""
        return self.values.copy()

    def ravel(self) -> ComplexArray:
        """Values in one axis."""
        return self.values.ravel()

    def reshape(self, *shape: Any) -> ComplexArray:
        """Values in another shape."""
        return self.values.reshape(*shape)

    def tolist(self) -> Any:
        """Values as lists."""
        return self.values.tolist()
