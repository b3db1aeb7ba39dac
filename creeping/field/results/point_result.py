"""What a field at points is: complex values with their error, and what is the matter where they are not to be trusted.

Results act as arrays of their values (`creeping.field.results.labelled`).

Also here: what serves at points: a field in two parts with its error, and the rule by which another takes its place.

Sources: Derivations, F20.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np

from creeping._presenting import Shown
from creeping._typing import Any, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.field.results.labelled import COMPONENTS, ArrayResult, Tabled, dataset, power
from creeping.field.validity_range import Validity
from creeping.geometry.patches import Rows

if TYPE_CHECKING:
    import xarray

_AWAY = "use method='currents', a quarter of a wavelength or more off the body"


Words = np.ndarray[Any, np.dtype[np.str_]]


class FieldStatus(IntEnum):
    """Status of the field at a point; where it is not OK, ``error`` is only a bound.

    Examples
    --------
    >>> import creeping as cr
    >>> cr.FieldStatus.LIT.name, cr.FieldStatus.LIT.remedy
    ('LIT', "use method='currents', a quarter of a wavelength or more off the body")
    """

    OK = 0
    LIT = 1
    """A lit point whose value holds creeping waves only: the incident and reflected waves are missing."""
    CAUSTIC = 2
    """Near a caustic, where rays merge and their sum diverges."""
    NO_RAY = 3
    """No creeping ray reaches this shadow point: the shadow line launches none, or the rays have decayed to nothing."""
    DETACHED = 4
    """A ray ended on a concave or rough surface before it reached this point, and its contribution may matter."""
    TRUNCATED = 5
    """The rays of the fan are too short to reach this point."""
    UNRESOLVED = 6
    """The error, or its bound, exceeds half the value and a tenth of the incident wave; or only a bound is known."""

    @property
    def remedy(self) -> str:
        """What to do at points of this status."""
        return _REMEDIES[self]


_REMEDIES = {
    FieldStatus.OK: "none needed",
    FieldStatus.LIT: _AWAY,
    FieldStatus.CAUSTIC: _AWAY,
    FieldStatus.NO_RAY: f"{_AWAY}; their error includes the missing waves",
    FieldStatus.DETACHED: f"{_AWAY}; their error includes the waves of rays that ended early",
    FieldStatus.TRUNCATED: "launch longer rays: length= of launch",
    FieldStatus.UNRESOLVED: "try another method=; at this wavenumber the error is about as large as the value",
}


def judged(
    status: IntArray, values: ComplexArray | FloatArray, error: FloatArray, error_by: np.ndarray[Any, Any], unit: float
) -> IntArray:
    """Status (...), UNRESOLVED for OK if the error is large; ``unit`` is the incident amplitude, k (1/L) for du/dn."""
    with np.errstate(invalid="ignore"):
        # half the value, or a tenth of the incident wave: as `FieldStatus.UNRESOLVED` says
        enough = (error <= np.maximum(0.5 * np.abs(values), 0.1 * unit)) & (error_by != "bound")
    return np.where((status == FieldStatus.OK) & ~enough, FieldStatus.UNRESOLVED, status).astype(np.int64)


class WithStatus:
    """Base of results whose values have a status of their own each."""

    # no state: results stay frozen dataclasses
    __slots__ = ()
    status: IntArray

    @property
    def ok(self) -> BoolArray:
        """Where the status is OK (...)."""
        return np.asarray(self.status == FieldStatus.OK)

    @property
    def status_counts(self) -> dict[str, int]:
        """Number of values by name of status; only statuses that occur."""
        return {s.name: int(np.sum(self.status == s)) for s in FieldStatus if np.any(self.status == s)}


@dataclass(frozen=True, eq=False, repr=False)
class PointData(Shown, WithStatus, Tabled):
    """Attributes shared by all fields at points (...); arrays have the shape of the points.

    Attributes
    ----------
    points : (..., 3), L
    error : (...)
        Error of the values, in the same unit. It covers 95 % of the points whose status is OK; elsewhere it is a
        bound, infinite where the value is infinite.
    error_by : (...) of str
        Source of the error estimate: "extinction", the residual field inside the body; "expansion", the size of the
        next terms of the expansions; both, joined by "+", in the layer near the body; "bound", the largest
        contribution that may be missing.
    status : (...) of int
        Codes of `FieldStatus`.
    method : (...) of str
        Method used at each point; two names joined by "+" where two methods are blended.
    wavenumber : float, 1/L
    boundary : str
    order : int
    validity : Validity
        Least k rho and largest kappa_t rho/m^2 on the fan's rays, see `creeping.validity`.
    length_unit : str
        "m" where the body knows it, else "L".
    """

    points: FloatArray
    error: FloatArray
    error_by: np.ndarray[Any, np.dtype[np.str_]]
    status: IntArray
    method: np.ndarray[Any, np.dtype[np.str_]]
    wavenumber: float
    boundary: str
    order: int
    validity: Validity | None = field(default=None, kw_only=True)
    length_unit: str = field(default="L", kw_only=True)

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return "of the incident wave"

    @property
    def magnitude(self) -> FloatArray:
        """Magnitude of the field, in the shape of ``status``."""
        raise NotImplementedError

    def __repr__(self) -> str:
        names, counts = np.unique(self.method, return_counts=True)
        served = ", ".join(f"{n} by {name}" for name, n in zip(names, counts, strict=True))
        states = ", ".join(f"{n} {name}" for name, n in self.status_counts.items())
        size, off = self.magnitude[self.ok], self.error[self.ok]
        error = f", error {np.median(off):.2g} in the median, {off.max():.2g} at most" if off.size else ""
        return (
            f"{type(self).__name__}({self._counted}, k = {self.wavenumber:g}, {self.boundary}, order {self.order})\n"
            f"  {served or 'none'}; {states or 'no status'}\n"
            f"  where OK up to {np.max(size, initial=0.0):.4g} {self.unit}{error}"
        )

    @property
    def _counted(self) -> str:
        """How many points there are, in words."""
        return f"{' x '.join(map(str, self.points.shape[:-1])) or 'one'} points"


@dataclass(frozen=True, eq=False, repr=False)
class PointField(ArrayResult, PointData):
    """Field at points (...), in arrays of their shape; it acts as the array of its values.

    Attributes
    ----------
    points, error, error_by, status, method, wavenumber, boundary, order, validity, length_unit
        As of every field at points.
    values : (...) complex
    """

    values: ComplexArray

    @property
    def total(self) -> ComplexArray:
        """The values (...)."""
        return self.values

    @property
    def magnitude(self) -> FloatArray:
        """Absolute values (...)."""
        return np.abs(self.values)

    def to_xarray(self) -> xarray.Dataset:
        """``xarray.Dataset`` of values, parts, error and status, one row per point."""
        own = {f.name for f in fields(self)} - {f.name for f in fields(PointField)}
        return point_dataset(self, {"total": self.values} | {name: getattr(self, name) for name in sorted(own)})


@dataclass(frozen=True, eq=False, repr=False)
class NearField(PointField):
    """Field u at points off the body or on it, in units of the incident wave.

    Attributes
    ----------
    points, values, error, error_by, status, method, wavenumber, boundary, order, validity, length_unit
        Shared by all fields at points, see `creeping.field.results.point_result.PointData`. Off the body ``method``
        is "currents", "equation" (currents from the integral equation), "layer" (next to the body: interpolated
        between the field on the body and that of the currents), "rays", or "none" (the admittance varies and no
        method applies). On the body it is "lit", "rays", "march", "lit+rays", "lit+march", "equation", or "boundary"
        (a soft body, u = 0).
    incident, scattered, creeping : (...) complex
        Parts that add up to the values. Currents and the lit side's expansion give ``incident`` and ``scattered``.
        Rays give ``creeping``, which in the shadow is the total field.

    Examples
    --------
    >>> import numpy as np
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> line = cr.shadow_line(ball, direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, length=4.0, n_rays=24)
    >>> u = cr.near_field(fan, [(0.3, 0.0, 1.5), (0, 0, -1.5)], wavenumber=30.0, boundary="soft")
    >>> u.method.tolist(), u.status_counts, np.abs(u).shape
    (['rays', 'currents'], {'OK': 2}, (2,))
    """

    incident: ComplexArray
    scattered: ComplexArray
    creeping: ComplexArray


@dataclass(frozen=True, eq=False, repr=False)
class SurfaceField(PointField):
    """Field u on the body, or du/dn (1/L) of the soft boundary.

    Attributes
    ----------
    points, values, error, error_by, status, method, wavenumber, boundary, order, validity, length_unit
        Shared by all fields at points, see `creeping.field.results.point_result.PointData`. ``method`` is "lit"
        (the lit side's expansion), "rays" (creeping modes), "march" (waves marched along rays, with beams near
        caustics), "lit+rays" or "lit+march" in the penumbra, or "equation".
    lit, creeping : (...) complex
        Parts that add up to the values: the lit side's expansion, and creeping rays. For "equation": the values on
        the lit side, and those on the shadow side.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> line = cr.shadow_line(ball, direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, length=4.0, n_rays=24)
    >>> u = cr.surface_field(fan, [(0, 0.6, 0.8), (0, 0, -1)], wavenumber=30.0, boundary="hard")
    >>> u.method.tolist(), u.status_counts, bool(abs(abs(u[1]) - 2) < 0.01)         # twice the wave on a mirror
    (['march', 'lit'], {'OK': 2}, True)
    """

    lit: ComplexArray
    creeping: ComplexArray

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return f"1/{self.length_unit}" if self.boundary == "soft" else super().unit


@dataclass(frozen=True, eq=False)
class PointValues(Rows):
    """Field at points (n,), and by what it came.

    Attributes
    ----------
    wave : (n,) complex
        The incident wave and what it excites by currents or on the lit side; 0 where creeping rays are alone.
    creeping : (n,) complex
        Of creeping rays.
    error : (n,)
    error_by, method : (n,) of str
    status : (n,) of int
        As of `creeping.field.results.point_result.PointField`, but for what `judged` says of a whole field.
    """

    wave: ComplexArray
    creeping: ComplexArray
    error: FloatArray
    error_by: Words
    status: IntArray
    method: Words

    @property
    def values(self) -> ComplexArray:
        """Sum of the parts (n,)."""
        return np.asarray(self.wave + self.creeping)

    @property
    def magnitude(self) -> FloatArray:
        """|values| (n,); of E and H the larger one's."""
        size = np.abs(self.values)
        if size.ndim == 1:
            return np.asarray(size)
        return np.asarray(np.linalg.norm(size.reshape(len(size), size.shape[1] // 3, 3), axis=2).max(axis=1))

    def parts(self, incident: ComplexArray) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """The incident wave (n, ...), what it excites, and creeping rays: they add up to the values.

        There is no incident wave apart where rays alone have the whole field, or nothing has.
        """
        alone = np.isin(self.method, ("rays", "boundary", "none")).reshape(-1, *(1,) * (incident.ndim - 1))
        incident = np.where(alone, 0.0, incident)
        return incident, self.wave - incident, self.creeping

    def put(self, at: IntArray, other: PointValues) -> PointValues:
        """Another field in place of this one at the points ``at``."""
        arrays = []
        for one in fields(self):
            mine, its = getattr(self, one.name), getattr(other, one.name)
            # of the longer words
            taken = mine.astype(np.result_type(mine, its))
            taken[at] = its
            arrays.append(taken)
        return PointValues(*arrays)

    def replaced_where_better(self, at: IntArray, other: PointValues, *, must: bool) -> PointValues:
        """Another one where it must be, or is OK and this one is not, errs more, or may have missed a wave.

        What rays have missed is not in their error: they must agree with currents within what both state.
        """
        mine = self[at]
        gap = np.abs(other.values - mine.values)
        apart = gap.reshape(len(at), int(np.prod(gap.shape[1:]))).max(axis=1, initial=0.0)
        with np.errstate(invalid="ignore"):
            worse = (other.error < mine.error) | (apart > other.error + mine.error)
        better = must | (other.status == FieldStatus.OK) & ((mine.status != FieldStatus.OK) | worse)
        return self.put(at[better], other[better])


def columns_of(values: np.ndarray[Any, Any]) -> list[np.ndarray[Any, Any]]:
    """Arrays of a scalar problem (n,), or of each polarisation of a conductor's (n, ..., p)."""
    return [values] if values.ndim == 1 else list(np.moveaxis(values, -1, 0))


def by_polarisation(values: Sequence[np.ndarray[Any, Any]], shape: tuple[int, ...], *, single: bool) -> Any:
    """Values (n, ...) of each polarisation at points of a shape: (*shape, ...), or (*shape, ..., p) unless single."""
    each = [one.reshape((*shape, *one.shape[1:])) for one in values]
    return each[0] if single else np.stack(each, axis=-1)


def stated(columns: list[PointValues], points: FloatArray, unit: float, *, single: bool = True) -> dict[str, Any]:
    """Error, its source, method, status and points (..., 3) of a result; ``unit`` as in `judged`."""
    lanes = {name: [getattr(one, name) for one in columns] for name in ("error", "error_by", "method")}
    lanes["status"] = [judged(one.status, one.magnitude, one.error, one.error_by, unit) for one in columns]
    shape = points.shape[:-1]
    found = {name: by_polarisation(values, shape, single=single) for name, values in lanes.items()}
    return found | {"points": points.copy()}


def scalar_near(field: PointValues, points: FloatArray, incident: ComplexArray, facts: dict[str, Any]) -> NearField:
    """Result from the field at points (..., 3), with its parts and status."""
    shape = points.shape[:-1]
    parts = [one.reshape(shape) for one in field.parts(incident)]
    names: dict[str, Any] = dict(zip(("incident", "scattered", "creeping"), parts, strict=True))
    return NearField(values=np.asarray(sum(parts)), **names, **stated([field], points, 1.0), **facts)


def scalar_on_body(field: PointValues, points: FloatArray, unit: float, facts: dict[str, Any]) -> SurfaceField:
    """Result from the field at points of the body (..., 3); ``unit`` as in `judged`."""
    values, lit, creeping = (one.reshape(points.shape[:-1]) for one in (field.values, field.wave, field.creeping))
    return SurfaceField(values=values, lit=lit, creeping=creeping, **stated([field], points, unit), **facts)


def measured_field(
    values: ComplexArray, error: FloatArray, method: str, error_by: str = "extinction", lit: BoolArray | None = None
) -> PointValues:
    """Field of currents (n, ...); where its error is not known, it is UNRESOLVED with the bound 1.

    On the body, values are the lit side's part where ``lit`` (n,), elsewhere that of rays.
    """
    known = np.isfinite(error)
    status = np.where(known, FieldStatus.OK, FieldStatus.UNRESOLVED).astype(np.int64)
    bright = np.ones(len(values), dtype=bool) if lit is None else lit
    bright = bright.reshape(-1, *(1,) * (values.ndim - 1))
    return PointValues(
        wave=np.where(bright, values, 0.0),
        creeping=np.where(bright, 0.0, values),
        error=np.where(known, error, 1.0),
        error_by=np.where(known, error_by, "bound"),
        status=status,
        method=np.full(len(values), method),
    )


def point_dataset(field: PointData, values: dict[str, ComplexArray | FloatArray]) -> xarray.Dataset:
    """Scalars and vectors (..., 3) at points, (..., 2) more of two polarisations, with error and status, by point."""
    both = field.status.ndim == field.points.ndim
    rows = ("point", "polarisation") if both else ("point",)
    variables: dict[str, Any] = {}
    coordinates: dict[str, Any] = {
        name: (("point",), field.points.reshape(-1, 3)[:, i], {"units": field.length_unit})
        for i, name in enumerate("xyz")
    }
    coordinates["wavenumber"] = ((), field.wavenumber, {"units": power(field.length_unit, -1), "long_name": "k"})
    for name, value in values.items():
        dims = rows
        if value.ndim > field.status.ndim:
            dims = ("point", "component", *rows[1:])
            coordinates["component"] = (("component",), ["x", "y", "z"])
        shape = (-1, *value.shape[field.points.ndim - 1 :])
        variables[name] = (dims, value.reshape(shape), {"units": field.unit})
    if both:
        coordinates["polarisation"] = (("polarisation",), list(COMPONENTS))
    shape = (-1, len(COMPONENTS)) if both else (-1,)
    variables["error"] = (rows, field.error.reshape(shape), {"units": field.unit})
    for name in ("error_by", "status", "method"):
        variables[name] = (rows, np.reshape(getattr(field, name), shape), {})
    return dataset(variables, coordinates, boundary=field.boundary, order=field.order)
