"""What fields and currents of a conductor at points are: complex vectors with their error and status.

Both incident polarisations, theta and phi, have the last axis of vectors, errors and statuses; one of them has none.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from creeping._typing import Any, ComplexArray, FloatArray
from creeping.field.results.labelled import ArrayResult
from creeping.field.results.point_result import PointData, PointValues, by_polarisation, point_dataset, stated

if TYPE_CHECKING:
    import xarray

PARTS = ("incident", "scattered", "creeping")
"""Parts of a field near a conductor."""
E, H = slice(0, 3), slice(3, 6)
"""Where both fields stand among six components."""


class Fields(NamedTuple):
    """E, and H times the impedance of free space, at points (..., 3), in units of the incident E.

    Examples
    --------
    >>> import numpy as np
    >>> Fields(np.ones((5, 3)), np.zeros((5, 3))).E.shape
    (5, 3)
    """

    E: ComplexArray
    H: ComplexArray


@dataclass(frozen=True, eq=False, repr=False)
class ConductorField(PointData):
    """E and H at points off a perfect conductor or on it, in units of the incident E.

    Attributes
    ----------
    points, error, error_by, status, method, wavenumber, boundary, order, validity, length_unit
        Shared by all fields at points, see `creeping.field.results.point_result.PointData`. The error holds for E
        and for H. Off the body ``method`` is "currents", "equation" (currents from the integral equation), "layer"
        (next to the body: interpolated between the field on the body and that of the currents) or "rays"; on the
        body as in `ConductorCurrent`.
    incident, scattered, creeping : Fields
        Parts that add up to the field. Currents and the lit side's expansion give ``incident`` and ``scattered``. Rays
        give ``creeping``, which in the shadow is the total field.
    incident_electric : (3,) or (3, 2) complex
        E0 of the incident wave; (3, 2) for both polarisations, if none was chosen.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> line = cr.shadow_line(ball, direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, length=4.0, n_rays=24)
    >>> field = cr.conductor_field(fan, [(0, 2.0, -0.5)], wavenumber=12.0, polarisation=(1, 0, 0))
    >>> field.E.shape, field.status_counts, bool(abs(field.E - field.incident.E - field.scattered.E).max() < 1e-12)
    ((1, 3), {'OK': 1}, True)
    """

    incident: Fields
    scattered: Fields
    creeping: Fields
    incident_electric: ComplexArray

    @property
    def E(self) -> ComplexArray:  # noqa: N802
        """Total electric field (..., 3) or (..., 3, 2)."""
        return np.asarray(self.incident.E + self.scattered.E + self.creeping.E)

    @property
    def H(self) -> ComplexArray:  # noqa: N802
        """Total magnetic field H, times the impedance of free space: (..., 3) or (..., 3, 2)."""
        return np.asarray(self.incident.H + self.scattered.H + self.creeping.H)

    @property
    def magnitude(self) -> FloatArray:
        """The larger of |E| and |H|, in the shape of ``status``."""
        axis = self.points.ndim - 1
        return np.asarray(np.maximum(np.linalg.norm(self.E, axis=axis), np.linalg.norm(self.H, axis=axis)))

    @property
    def power_flow(self) -> FloatArray:
        """Re E x H*: time-averaged power flow in units of the incident power flow, (..., 3) or (..., 3, 2)."""
        axis = self.points.ndim - 1
        return np.asarray(np.cross(self.E, self.H.conj(), axis=axis).real)

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return "of the incident E"

    def to_xarray(self) -> xarray.Dataset:
        """``xarray.Dataset`` of E, H, their parts, error and status, by point, component and polarisation."""
        parts = {f"{letter}_{name}": getattr(getattr(self, name), letter) for name in PARTS for letter in "EH"}
        return point_dataset(self, {"E": self.E, "H": self.H, **parts})


@dataclass(frozen=True, eq=False, repr=False)
class ConductorCurrent(ArrayResult, PointData):
    """Current J = n x H on a perfect conductor, in units of the incident H; usable as the array of J.

    Attributes
    ----------
    points, error, error_by, status, method, wavenumber, boundary, order, validity, length_unit
        Shared by all fields at points, see `creeping.field.results.point_result.PointData`. ``method`` is "lit"
        (the lit side's expansion), "march" (waves marched along rays, with beams near caustics), "rays" (creeping
        modes), or, in the penumbra, "lit+march" or "lit+rays".
    values : (..., 3) or (..., 3, 2) complex
    charge : (...) or (..., 2) complex
        n.E = div J/(ik): surface charge density over the permittivity of free space, in units of the incident E.
    charge_error : (...) or (..., 2)
        Error of the charge: sqrt(2) times that of J for expansions; estimated separately for the integral equation.
    lit, creeping : shaped as ``values``
        Parts that add up to the values: the lit side's expansion, and creeping rays.
    incident_electric : (3,) or (3, 2) complex
        E0 of the incident wave; (3, 2) for both polarisations, if none was chosen.

    Examples
    --------
    >>> import numpy as np
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> line = cr.shadow_line(ball, direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, length=4.0, n_rays=24)
    >>> J = cr.conductor_current(fan, [(0, 0, -1), (0, 0.6, 0.8)], wavenumber=30.0, polarisation=(1, 0, 0))
    >>> J.shape, np.abs(J[0]).round(1).tolist(), J.method.tolist()                   # 2 n x H where the wave falls in
    ((2, 3), [2.0, 0.0, 0.0], ['lit', 'march'])
    """

    values: ComplexArray
    charge: ComplexArray
    charge_error: FloatArray
    lit: ComplexArray
    creeping: ComplexArray
    incident_electric: ComplexArray

    @property
    def total(self) -> ComplexArray:
        """The values."""
        return self.values

    @property
    def magnitude(self) -> FloatArray:
        """|J|, in the shape of ``status``."""
        return np.asarray(np.linalg.norm(self.values, axis=self.points.ndim - 1))

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return "of the incident H"

    def to_xarray(self) -> xarray.Dataset:
        """``xarray.Dataset`` of J, its parts, charge, error and status, by point and component."""
        parts = {"J": self.values, "charge": self.charge, "lit": self.lit, "creeping": self.creeping}
        return point_dataset(self, parts | {"charge_error": self.charge_error})


def vector_near(
    columns: list[PointValues], points: FloatArray, incident: ComplexArray, facts: dict[str, Any], *, single: bool
) -> ConductorField:
    """Result from E and H of each polarisation at points (..., 3), with parts and status.

    ``incident`` (n, 6, p) is the incident wave there.
    """
    shape = points.shape[:-1]
    each = [one.parts(incident[..., i]) for i, one in enumerate(columns)]
    parts: dict[str, Any] = {
        name: Fields(*(by_polarisation([v[:, half] for v in lanes], shape, single=single) for half in (E, H)))
        for name, lanes in zip(PARTS, zip(*each, strict=True), strict=True)
    }
    return ConductorField(**parts, **stated(columns, points, 1.0, single=single), **facts)


def vector_on_body(
    columns: list[PointValues],
    charge: tuple[ComplexArray, FloatArray],
    points: FloatArray,
    facts: dict[str, Any],
    *,
    single: bool,
) -> ConductorCurrent:
    """Result from J of each polarisation and n.E with its error (n, p) at points of the body (..., 3)."""
    names = {"values": "values", "lit": "wave", "creeping": "creeping"}
    lanes = {name: [getattr(one, of) for one in columns] for name, of in names.items()}
    lanes |= {"charge": list(charge[0].T), "charge_error": list(charge[1].T)}
    named = {name: by_polarisation(values, points.shape[:-1], single=single) for name, values in lanes.items()}
    return ConductorCurrent(**named, **stated(columns, points, 1.0, single=single), **facts)
