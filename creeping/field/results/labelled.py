"""What results have in common: names and units of their axes, and values that numpy takes them for.

Units are those of the CF conventions where the body's unit is known, else powers of L, the body's unit of length.

`Tabled`: results with names on their axes. `ArrayResult`: arithmetic, ufuncs and numpy's functions give plain arrays;
so do indexing, the methods that arrays have, and arithmetic in place, after which the name stands for the array.
Nothing writes into a result.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from creeping._typing import Any, ComplexArray, FloatArray
from creeping.geometry.directions import azimuth_elevation_of
from creeping.storage.memory import required

if TYPE_CHECKING:
    import pandas
    import xarray

COMPONENTS = ("theta", "phi")
"""Components of an incident and a scattered wave of a conductor, along the unit vectors of the angles."""
POLARISATIONS = {"VV": ("theta", "theta"), "VH": ("theta", "phi"), "HV": ("phi", "theta"), "HH": ("phi", "phi")}
"""Scattered by incident component: V is along theta, vertical where z is up and the wave level, H along phi."""


def power(unit: str, exponent: int) -> str:
    """Power of a unit of length, as the CF conventions write it.

    Examples
    --------
    >>> power("m", 2), power("L", -1), power("L", -2), power("m", 1)
    ('m2', '1/L', '1/L^2', 'm')
    """
    if exponent == 1:
        return unit
    if exponent > 0:
        return f"{unit}{exponent}" if unit == "m" else f"{unit}^{exponent}"
    if unit == "m":
        return f"{unit}{exponent}"
    return f"1/{unit}" if exponent == -1 else f"1/{unit}^{-exponent}"


def dataset(variables: dict[str, Any], coordinates: dict[str, Any], **words: Any) -> xarray.Dataset:
    """``xarray.Dataset`` of variables and coordinates by name, with words on the whole as attributes.

    Raises
    ------
    CreepingError
        If xarray is missing, with the command that installs it.
    """
    library = required("xarray", use="labelled results need", extra="sweep")
    words = words | {"conventions": "time factor exp(-i omega t)"}
    found: xarray.Dataset = library.Dataset(variables, coordinates, words)
    return found


class Tabled:
    """Base of results with names on their axes."""

    # no state: results stay frozen dataclasses
    __slots__ = ()

    def to_xarray(self) -> xarray.Dataset:
        """``xarray.Dataset`` of values, parts, error and status."""
        raise NotImplementedError

    def to_dataframe(self) -> pandas.DataFrame:
        """Contents of `to_xarray` as a ``pandas.DataFrame``, one row per value; vectors (x, y, z) are left out."""
        return self.to_xarray().drop_dims("axis", errors="ignore").to_dataframe()


def directed(directions: FloatArray, wavenumber: float, unit: str) -> dict[str, Any]:
    """Coordinates of results by direction (m, 3)."""
    azimuth, elevation = azimuth_elevation_of(directions)
    return {
        "vector": (("direction", "axis"), directions, {"units": "1", "long_name": "unit direction to the observer"}),
        "azimuth": (("direction",), np.degrees(azimuth), {"units": "degree"}),
        "elevation": (("direction",), np.degrees(elevation), {"units": "degree"}),
        "axis": (("axis",), ["x", "y", "z"]),
        "wavenumber": ((), wavenumber, {"units": power(unit, -1), "long_name": "k"}),
    }


OF_VALUES = frozenset(
    "T all any argmax argmin argsort astype conj conjugate copy cumsum diagonal dot dtype flatten imag item max mean "
    "min ndim nonzero prod ravel real repeat reshape round shape size squeeze std sum swapaxes take tolist transpose "
    "var".split()
)
"""Attributes and methods of arrays that results have too; none of them writes."""


def _not_in_place(self: ArrayResult, other: Any) -> Any:
    """Leave it to the operator that makes a new array."""
    return NotImplemented


class ArrayResult(NDArrayOperatorsMixin):
    """Base of results that numpy can use in place of their ``values``."""

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
        if any(isinstance(one, ArrayResult) for one in options.get("out", ())):
            raise TypeError(f"out= of {ufunc.__name__} would leave the error of a result behind; give its .values")
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

    def __getattr__(self, name: str) -> Any:
        """Attribute or method of the values."""
        if name in OF_VALUES:
            return getattr(self.values, name)
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

    def __dir__(self) -> list[str]:
        """Names with those of the values."""
        return sorted({*super().__dir__(), *OF_VALUES})

    __iadd__ = __isub__ = __imul__ = __itruediv__ = __ipow__ = __imatmul__ = _not_in_place
    __ifloordiv__ = __imod__ = __iand__ = __ior__ = __ixor__ = __ilshift__ = __irshift__ = _not_in_place
