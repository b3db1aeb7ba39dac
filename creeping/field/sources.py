"""The far field of point sources on a body or near it, in any directions, by reciprocity.

    u(R r) -> e^{ikR}/(4 pi R) F(r),   F(r) = u(x_s; d = -r)

A source of e^{ikR}/(4 pi R) at x_s sends to r what x_s receives of the plane wave from there: the total field, lit,
reflected and creeping, with its error, as `creeping.field.near` and, on the body, `creeping.field.on_body` have it.
With no body F = e^{-ik r.x_s}. Each direction is an incidence of its own, shared by all sources. Where the integral
equation takes no longer for all of them together than rays would, it is used.

Sources: [CK13, sec. 3.3]; Derivations, F27.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from creeping._presenting import Drawn
from creeping._typing import Any, ArrayLike, ComplexArray, FloatArray, IntArray
from creeping.errors import InvalidInputError, SingularIncidenceError
from creeping.field.arguments import checked, checked_plain, observers_of
from creeping.field.boundary import BoundaryLike, boundary_name
from creeping.field.equation.effort import SECONDS, plan_of
from creeping.field.equation.solving import solution_for, solve_together
from creeping.field.lit_ground import UNKNOWN
from creeping.field.near import near_field
from creeping.field.results.labelled import ArrayResult, Tabled, dataset, directed
from creeping.field.results.point_result import FieldStatus, NearField, WithStatus
from creeping.field.waves.surface import scalar_boundary
from creeping.geodesics.states import as_points
from creeping.geometry.checks import unit_of
from creeping.geometry.surface import Surface
from creeping.rays.fan import launch
from creeping.rays.transport import Flow
from creeping.shadow.line import shadow_line

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True, eq=False, repr=False)
class SourcePattern(ArrayResult, WithStatus, Drawn, Tabled):
    """Far fields F of s point sources in m directions; usable as the array of its values.

    Attributes
    ----------
    directions : (m, 3)
    sources : (s, 3), L
    values : (m, s) complex
        F: far field times 4 pi R e^{-ikR}, without unit. Without a body |F| = 1.
    error : (m, s)
        Error of the values. It covers 95 % of the values whose status is OK.
    error_by : (m, s) of str
    status : (m, s) of int
        Codes of `FieldStatus`. Where the plane wave from a direction has no usable shadow line, the status is
        UNRESOLVED, the value is 0 and the error is a bound.
    method : (m, s) of str
        Method used, named as in `near_field`.
    wavenumber : float, 1/L
    boundary : str
    length_unit : str

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> flow = cr.DirectFlow(sc.Sphere(), rtol=1e-8)
    >>> F = cr.source_pattern(flow, [(0, 0, 1), (0, 0, 4)], [(0, 0, 1), (0, 0.6, -0.8)], wavenumber=25.0)
    >>> F.shape, abs(F[0]).round(1).tolist(), bool(F.decibels[1, 0] < -8)
    ((2, 2), [2.0, 1.1], True)
    """

    directions: FloatArray
    sources: FloatArray
    values: ComplexArray
    error: FloatArray
    error_by: np.ndarray[Any, np.dtype[np.str_]]
    status: IntArray
    method: np.ndarray[Any, np.dtype[np.str_]]
    wavenumber: float
    boundary: str
    length_unit: str = field(default="L", kw_only=True)

    @property
    def decibels(self) -> FloatArray:
        """20 log10 |F| (m, s), dB relative to the source without the body; -inf where F is 0."""
        with np.errstate(divide="ignore"):
            return np.asarray(20 * np.log10(np.abs(self.values)))

    def to_xarray(self) -> xarray.Dataset:
        """``xarray.Dataset`` of values, error and status, by direction and source."""
        unit, dims = self.length_unit, ("direction", "source")
        coordinates = directed(self.directions, self.wavenumber, unit)
        coordinates |= {
            f"source_{name}": (("source",), self.sources[:, i], {"units": unit}) for i, name in enumerate("xyz")
        }
        told = {"units": "1", "long_name": "far field over that of the source with no body"}
        variables: dict[str, Any] = {"pattern": (dims, self.values, told), "error": (dims, self.error, {"units": "1"})}
        variables |= {name: (dims, getattr(self, name)) for name in ("error_by", "status", "method")}
        return dataset(variables, coordinates, boundary=self.boundary)

    def __repr__(self) -> str:
        states = ", ".join(f"{n} {name}" for name, n in self.status_counts.items())
        off = self.error[self.ok]
        error = f", error {np.median(off):.2g} in the median, {off.max():.2g} at most" if off.size else ""
        return (
            f"SourcePattern({len(self.directions)} directions x {len(self.sources)} sources, "
            f"k = {self.wavenumber:g}, {self.boundary})\n"
            f"  {states or 'no status'}\n"
            f"  where OK {np.max(np.abs(self.values[self.ok]), initial=0.0):.4g} at most{error}"
        )


def source_pattern(
    flow: Flow,
    sources: ArrayLike,
    directions: ArrayLike,
    *,
    wavenumber: float,
    boundary: BoundaryLike = "hard",
    n_rays: int = 48,
) -> SourcePattern:
    """Far fields of point sources on a body or near it; by reciprocity also the reception of plane waves there.

    Parameters
    ----------
    flow : PhaseMap or DirectFlow
        Of a body without edges.
    sources : (s, 3), L
        Positions outside the body or on it; a single point may be (3,).
    directions : (m, 3)
        Directions towards the observers, from which received plane waves come.
    wavenumber : float, 1/L
    boundary : "soft", "hard" or ImpedanceBoundary
        A source on a soft body radiates nothing.
    n_rays : int
        Number of rays for each direction, where rays are used.

    Returns
    -------
    SourcePattern
        With the ears as sources, the values are head-related transfer functions. By rays each direction takes about
        0.2 s at ka = 30 and 0.6 s at ka = 100; the integral equation, used where it takes no longer, 0.1 s.

    Raises
    ------
    InvalidInputError
        On bad points, directions, wavenumber or boundary, for points inside the body, a weighted body, and one with
        edges.

    Examples
    --------
    >>> import numpy as np
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> flow = cr.DirectFlow(sc.Sphere(), rtol=1e-8)
    >>> around = [(np.sin(t), 0.0, np.cos(t)) for t in np.radians([0.0, 100.0, 150.0])]
    >>> F = cr.source_pattern(flow, (0, 0, 1), around, wavenumber=20.0)
    >>> np.abs(F[:, 0]).round(1).tolist(), F.status_counts
    ([2.0, 1.1, 0.3], {'OK': 3})
    """
    checked_plain(flow.body, smooth="the far field of sources near a body")
    scalar_boundary(boundary)
    k = checked(wavenumber, 2, flow.body)
    x = as_points(sources).reshape(-1, 3)
    r = observers_of(directions)
    if not len(x):
        raise InvalidInputError("no sources; give points (s, 3) on the body or outside")
    shape = len(r), len(x)
    values, error = np.zeros(shape, dtype=complex), np.full(shape, UNKNOWN)
    status = np.full(shape, int(FieldStatus.UNRESOLVED))
    error_by, method = np.full(shape, "bound", dtype="<U24"), np.full(shape, "none", dtype="<U16")
    together = _solved_together(flow.body, r, k, boundary)
    for row, towards in enumerate(r):
        solved = solution_for(flow.body, -towards, k, boundary) if together else None
        if solved:
            received: NearField | None = solved.solution.near_field(x, solved.incidence)
        else:
            received = _received(flow, x, towards, k, boundary, n_rays)
        if received is not None:
            values[row], error[row], status[row] = received.values, received.error, received.status
            error_by[row], method[row] = received.error_by, received.method
    return SourcePattern(
        directions=r.copy(),
        sources=x.copy(),
        values=values,
        error=error,
        error_by=error_by,
        status=status,
        method=method,
        wavenumber=k,
        boundary=boundary_name(boundary),
        length_unit=unit_of(flow.body),
    )


def _solved_together(body: Surface, towards: FloatArray, k: float, boundary: BoundaryLike) -> bool:
    """Solve the equation for plane waves from directions (m, 3) and keep it, if that takes no longer than rays."""
    plan = plan_of(body, k, boundary, incidences=len(towards))
    # rays take 0.2 s for an incidence at least, at ka = 30
    pays = not plan.refused and not plan.effort.coarse and plan.seconds <= SECONDS + 0.2 * len(towards)
    if pays:
        solve_together(body, -towards, k, boundary)
    return pays


def _received(
    flow: Flow, points: FloatArray, towards: FloatArray, k: float, boundary: BoundaryLike, n_rays: int
) -> NearField | None:
    """Total field at points (s, 3) of the plane wave from ``towards`` (3,); None if it has no shadow line."""
    try:
        line = shadow_line(flow.body, direction=-towards)
    except SingularIncidenceError:
        return None
    fan = launch(flow, line, wavenumber=k, n_rays=n_rays, measured=False)
    return near_field(fan, points, wavenumber=k, boundary=boundary)
