"""Results with names on their axes: fields as an ``xarray.Dataset`` or a ``pandas.DataFrame``.

Units are those of the CF conventions where the body's unit is known, else powers of L, the body's unit of length.

Results that are arrays of complex values with more to say: numpy takes them for their values.

Arithmetic, ufuncs and numpy's functions give plain arrays; so do indexing, the methods that arrays have, and arithmetic
in place, after which the name stands for the array. Nothing writes into a result.
"""

from typing import TYPE_CHECKING

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.geometry.directions import azimuth_elevation_of
from creeping.storage.memory import required

if TYPE_CHECKING:
    import xarray

    from creeping._typing import ComplexArray
    from creeping.field.echo import Echo
    from creeping.field.far_result import FarField
    from creeping.field.point_result import PointData, PointField
    from creeping.field.sources import SourcePattern
from collections.abc import Callable, Iterator

from numpy.lib.mixins import NDArrayOperatorsMixin

from creeping._typing import ComplexArray

COMPONENTS = ("theta", "phi")
"""Components of an incident and a scattered wave of a conductor, along the unit vectors of the angles."""


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


def _directed(directions: FloatArray, wavenumber: float, unit: str) -> dict[str, Any]:
    """Coordinates of results by direction (m, 3)."""
    azimuth, elevation = azimuth_elevation_of(directions)
    return {
        "vector": (("direction", "axis"), directions, {"units": "1", "long_name": "unit direction to the observer"}),
        "azimuth": (("direction",), np.degrees(azimuth), {"units": "degree"}),
        "elevation": (("direction",), np.degrees(elevation), {"units": "degree"}),
        "axis": (("axis",), ["x", "y", "z"]),
        "wavenumber": ((), wavenumber, {"units": power(unit, -1), "long_name": "k"}),
    }


def far_dataset(far: "FarField") -> "xarray.Dataset":
    """A far field, its parts, error and cross section, by direction: see `FarField.to_xarray`."""
    library = required("xarray", use="labelled results need", extra="sweep")
    unit = far.unit
    dims = ("direction", "scattered", "incident")[: far.total.ndim]
    coordinates = _directed(far.directions, far.wavenumber, unit)
    if far.total.ndim == 3:
        coordinates |= {name: ((name,), list(COMPONENTS)) for name in dims[1:]}
    variables: dict[str, Any] = {"total": (dims, far.total, {"units": unit, "long_name": "far-field amplitude f"})}
    for name, values in far.parts.items():
        variables[name] = (dims, values, {"units": unit, "long_name": f"{name} part of f"})
    variables["error"] = (dims, far.error, {"units": unit, "long_name": f"error of |f|, by {far.error_source}"})
    area = {"units": power(unit, 2), "long_name": "cross section 4 pi |f|^2"}
    variables["cross_section"] = (dims, far.cross_section, area)
    variables["unresolved"] = (
        ("direction",),
        far.unresolved,
        {"long_name": "an expansion fails, or the error is large"},
    )
    variables["method"] = (("direction",), far.method, {"long_name": "what served"})
    words = {"boundary": far.boundary, "order": far.order, "conventions": "time factor exp(-i omega t)"}
    found: xarray.Dataset = library.Dataset(variables, coordinates, words)
    return found


def point_dataset(field: "PointField", parts: tuple[str, ...]) -> "xarray.Dataset":
    """A field at points with its parts, error and status, one row a point: see `PointField.to_xarray`."""
    variables: dict[str, Any] = {"total": (("point",), field.values.reshape(-1), {"units": field.unit})}
    for name in parts:
        variables[name] = (("point",), np.reshape(getattr(field, name), -1), {"units": field.unit})
    return _of_points(field, variables, ("point",), {})


def vector_dataset(field: "PointData", vectors: "dict[str, ComplexArray | FloatArray]") -> "xarray.Dataset":
    """Vectors (..., 3) or (..., 3, 2) and scalars at points with error and status: see `ConductorField.to_xarray`."""
    both = field.status.ndim == field.points.ndim
    rows = ("point", "polarisation") if both else ("point",)
    variables: dict[str, Any] = {}
    for name, values in vectors.items():
        vector = values.ndim > field.status.ndim
        dims = ("point", *(("component",) if vector else ()), *rows[1:])
        shape = (-1, *values.shape[field.points.ndim - 1 :])
        variables[name] = (dims, values.reshape(shape), {"units": field.unit})
    named: dict[str, Any] = {"component": (("component",), ["x", "y", "z"])}
    if both:
        named["polarisation"] = (("polarisation",), list(COMPONENTS))
    return _of_points(field, variables, rows, named)


def _of_points(
    field: "PointData", variables: dict[str, Any], rows: tuple[str, ...], named: dict[str, Any]
) -> "xarray.Dataset":
    """Variables with error, status and coordinates of points."""
    library = required("xarray", use="labelled results need", extra="sweep")
    flat = field.points.reshape(-1, 3)
    coordinates: dict[str, Any] = {
        name: (("point",), flat[:, i], {"units": field.length_unit}) for i, name in enumerate(("x", "y", "z"))
    }
    coordinates["wavenumber"] = ((), field.wavenumber, {"units": power(field.length_unit, -1), "long_name": "k"})
    shape = (-1,) if len(rows) == 1 else (-1, len(COMPONENTS))
    variables = dict(variables)
    variables["error"] = (rows, field.error.reshape(shape), {"units": field.unit})
    for name in ("error_by", "status", "method"):
        variables[name] = (rows, np.reshape(getattr(field, name), shape), {})
    words = {"boundary": field.boundary, "order": field.order, "conventions": "time factor exp(-i omega t)"}
    found: xarray.Dataset = library.Dataset(variables, coordinates | named, words)
    return found


def pattern_dataset(pattern: "SourcePattern") -> "xarray.Dataset":
    """Far fields of sources with their error and status, by direction and source: see `SourcePattern.to_xarray`."""
    library = required("xarray", use="labelled results need", extra="sweep")
    unit, dims = pattern.length_unit, ("direction", "source")
    coordinates = _directed(pattern.directions, pattern.wavenumber, unit)
    coordinates |= {
        f"source_{name}": (("source",), pattern.sources[:, i], {"units": unit}) for i, name in enumerate("xyz")
    }
    told = {"units": "1", "long_name": "far field over that of the source with no body"}
    variables: dict[str, Any] = {
        "pattern": (dims, pattern.values, told),
        "error": (dims, pattern.error, {"units": "1"}),
    }
    for name in ("error_by", "status", "method"):
        variables[name] = (dims, getattr(pattern, name), {})
    words = {"boundary": pattern.boundary, "conventions": "time factor exp(-i omega t)"}
    found: xarray.Dataset = library.Dataset(variables, coordinates, words)
    return found


def echo_dataset(echo: "Echo") -> "xarray.Dataset":
    """An echo with its parts, levels, error and flags: see `Echo.to_xarray`."""
    library = required("xarray", use="labelled results need", extra="sweep")
    dims = ("channel", "angle", "frequency")
    coordinates: dict[str, Any] = {
        "channel": (("channel",), list(echo.channels)),
        "angle": (("angle",), echo.angles, {"units": "degree", "long_name": echo.angle_name or "angle"}),
        "azimuth": (("angle",), echo.azimuth, {"units": "degree"}),
        "elevation": (("angle",), echo.elevation, {"units": "degree"}),
        "frequency": (("frequency",), echo.hertz, {"units": "Hz"}),
        "wavenumber": (("frequency",), echo.wavenumbers, {"units": power("m", -1), "long_name": "k"}),
    }
    name, unit = echo.level_name
    amplitude = {"units": "m", "long_name": "far-field amplitude f"}
    variables: dict[str, Any] = {
        "total": (dims, echo.total, amplitude),
        "level": (dims, echo.levels(), {"units": unit, "long_name": name}),
        "error": (dims, echo.error, {"units": "m", "long_name": "error of |f|"}),
        "unresolved": (dims, echo.unresolved, {"long_name": "an expansion fails, or the error is large"}),
        "by_currents": (dims, echo.by_currents, {"long_name": f"else by {echo.otherwise}"}),
    }
    variables |= {part: (dims, values, {"units": "m"}) for part, values in echo.parts.items()}
    found: xarray.Dataset = library.Dataset(variables, coordinates, {"conventions": "time factor exp(-i omega t)"})
    return found


def _of_values(name: str) -> Callable[..., Any]:
    """Method of that name of the values."""

    def method(self: "ArrayResult", *args: Any, **options: Any) -> Any:
        return getattr(self.values, name)(*args, **options)

    method.__name__, method.__doc__ = name, f"As `numpy.ndarray.{name}` of the values."
    return method


def _not_in_place(self: "ArrayResult", other: Any) -> Any:
    """Leave it to the operator that makes a new array."""
    return NotImplemented


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

    @property
    def T(self) -> ComplexArray:  # noqa: N802
        """Values, transposed."""
        return self.values.T

    all, any, argmax, argmin, argsort, astype = map(_of_values, ("all", "any", "argmax", "argmin", "argsort", "astype"))
    conj, conjugate, copy, cumsum, diagonal = map(_of_values, ("conj", "conjugate", "copy", "cumsum", "diagonal"))
    dot, flatten, item, max, mean, min = map(_of_values, ("dot", "flatten", "item", "max", "mean", "min"))
    nonzero, prod, ravel, repeat, reshape = map(_of_values, ("nonzero", "prod", "ravel", "repeat", "reshape"))
    round, squeeze, std, sum, swapaxes = map(_of_values, ("round", "squeeze", "std", "sum", "swapaxes"))
    take, tolist, transpose, var = map(_of_values, ("take", "tolist", "transpose", "var"))

    __iadd__ = __isub__ = __imul__ = __itruediv__ = __ipow__ = __imatmul__ = _not_in_place
    __ifloordiv__ = __imod__ = __iand__ = __ior__ = __ixor__ = __ilshift__ = __irshift__ = _not_in_place
