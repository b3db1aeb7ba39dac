"""What the coupling of ports is: a matrix of complex values with their error, and the geodesics that gave them."""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, overload

import numpy as np

from creeping._presenting import Drawn, brief
from creeping._typing import Any, ComplexArray, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.field.results.labelled import ArrayResult, Tabled, dataset, power
from creeping.field.results.point_result import WithStatus
from creeping.geometry.surface import Surface
from creeping.rays.port_rays import PortRays

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True, eq=False)
class CouplingPaths:
    """The m geodesics from one port to another, shortest first.

    Attributes
    ----------
    arclength : (m,), L
    departure, arrival : (m, 3)
        Unit tangents at both ends, along the path.
    spreading : (m,), L
        Reduced length J2: separation of neighbouring geodesics per unit angle at the source. It is negative after an
        odd number of caustics.
    fock_parameter : (m,)
        xi = (k/2)^(1/3) int kappa_n^(2/3) ds.
    caustics : (m,)
        Number of zeros of J2 along the path.
    wave : (m,) complex, 1/L, or 1/L^2 on a conductor
        Contribution of each geodesic; infinite if the receiver is on its caustic.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> paths = cr.coupling(sc.Sphere(), [(0, 0, 1), (1, 0, 0)], wavenumber=30.0).paths(0, 1)
    >>> len(paths), (paths.departure[0].round(6) + 0.0).tolist(), paths.spreading.round(3).tolist()
    (2, [1.0, 0.0, 0.0], [1.0, -1.0])
    """

    arclength: FloatArray
    departure: FloatArray
    arrival: FloatArray
    spreading: FloatArray
    fock_parameter: FloatArray
    caustics: IntArray
    wave: ComplexArray

    def __len__(self) -> int:
        """Number of geodesics."""
        return len(self.arclength)


@dataclass(frozen=True, eq=False, repr=False)
class Coupling(ArrayResult, WithStatus, Drawn, Tabled):
    """Matrix of fields between ports on a body; entry (i, j) is the field at port j of a unit source at port i.

    For `coupling` the source is e^{ikr}/(4 pi r) and the field is u. For `slot_coupling` the source is a magnetic
    dipole along slot i and the field is H along slot j. For `monopole_coupling` the source is an electric dipole along
    the normal and the field is E along the normal. For `antenna_coupling` the field is H at slots and E at monopoles.
    The result is usable as the array of its values.

    Attributes
    ----------
    body : Surface
    ports, normals : (n, 3), L and 1
    values : (n, n) complex, 1/L, or 1/L^2 on a conductor
        Infinite on the diagonal, where source and receiver coincide. Symmetric, except that entries between a slot and
        a monopole change sign when source and receiver are exchanged.
    error : (n, n)
        Error of the values. It covers 95 % of the entries whose status is OK; elsewhere it is a bound.
    status : (n, n) of int
        Codes of `FieldStatus`.
    method : (n, n) of str
        "rays", or "beams" near caustics; "none" on the diagonal.
    wavenumber : float, 1/L
    boundary : str
    order : int
    length : float, L
        Length up to which geodesics were traced.
    length_unit : str
        "m" if the body states it, else "L".
    kinds : (n,) of str
        "point", "slot" or "monopole".
    axes : (n, 3) or None
        Unit tangents along slots and normals at monopoles; None for `coupling` and `monopole_coupling`.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> found = cr.coupling(sc.Sphere(), [(0, 0, 1), (1, 0, 0), (0, 0.6, -0.8)], wavenumber=30.0)
    >>> found.shape, bool(found[0, 1] == found[1, 0]), found.status_counts
    ((3, 3), True, {'OK': 6, 'CAUSTIC': 3})
    >>> paths = found.paths(0, 1)                               # a quarter of a great circle, and the way round
    >>> paths.arclength.round(3).tolist(), paths.caustics.tolist()
    ([1.571, 4.712], [0, 1])
    """

    body: Surface
    ports: FloatArray
    normals: FloatArray
    values: ComplexArray
    error: FloatArray
    status: IntArray
    method: np.ndarray[Any, np.dtype[np.str_]]
    wavenumber: float
    boundary: str
    order: int
    length: float
    length_unit: str
    kinds: np.ndarray[Any, np.dtype[np.str_]]
    axes: FloatArray | None
    _rays: PortRays
    _waves: ComplexArray

    @overload
    def __getitem__(self, index: tuple[int, int]) -> np.complex128: ...
    @overload
    def __getitem__(self, index: int | slice | tuple[int, slice] | tuple[slice, int | slice]) -> ComplexArray: ...
    @overload
    def __getitem__(self, index: Any) -> Any: ...
    def __getitem__(self, index: Any) -> Any:
        """One value of a pair (source, receiver), or part of the values."""
        return self.values[index]

    @property
    def db(self) -> FloatArray:
        """20 log10 |values| (n, n), dB relative to 1 `unit`; inf on the diagonal."""
        with np.errstate(divide="ignore"):
            return np.asarray(20 * np.log10(np.abs(self.values)))

    @property
    def unit(self) -> str:
        """Unit of the values: "1/L" for points, "1/L^2" for slots and monopoles, with the body's unit of length."""
        return self._kind[0]

    def paths(self, source: int, receiver: int) -> CouplingPaths:
        """Geodesics from one port to another, and the contribution of each.

        Parameters
        ----------
        source, receiver : int
            Numbers of the ports.

        Returns
        -------
        CouplingPaths
            Lengths in L and unit directions; empty if source and receiver are the same port.

        Raises
        ------
        InvalidInputError
            If a number is not that of a port.
        """
        count = len(self.ports)
        for number in (source, receiver):
            if isinstance(number, bool) or not isinstance(number, int | np.integer) or not 0 <= number < count:
                raise InvalidInputError(f"port {number!r} is not one of the ports 0 to {count - 1}")
        rays, one, other = self._rays, min(source, receiver), max(source, receiver)
        begin, end = np.searchsorted(rays.first * count + rays.second, [one * count + other, one * count + other + 1])
        mine = slice(int(begin), int(end))
        departure, arrival = rays.directions[mine, 0], rays.directions[mine, 1]
        if source > receiver:
            departure, arrival = -arrival, -departure
        # what a monopole gives a slot is the opposite of what that gives it
        sign = -1 if source > receiver and self.kinds[one] != self.kinds[other] else 1
        return CouplingPaths(
            arclength=rays.arclength[mine],
            departure=departure,
            arrival=arrival,
            spreading=rays.spreading[mine],
            fock_parameter=np.cbrt(self.wavenumber / 2) * rays.integrals[mine, 0],
            caustics=rays.caustics[mine],
            wave=sign * self._waves[mine],
        )

    @property
    def _kind(self) -> tuple[str, str]:
        """Unit of the values, and what they are."""
        meanings = {
            "point": "u of a unit source e^{ikr}/(4 pi r)",
            "slot": "H of a unit magnetic dipole, times the impedance of free space",
            "monopole": "E of a unit electric dipole, times the admittance of free space",
            "monopoleslot": "H along slots, times the impedance of free space, E along n at monopoles, of unit dipoles",
        }
        kinds = "".join(sorted(set(self.kinds.tolist())))
        return power(self.length_unit, -1 if kinds == "point" else -2), meanings[kinds]

    def to_xarray(self) -> xarray.Dataset:
        """``xarray.Dataset`` of values, error, status and method, by source and receiver."""
        dims = ("source", "receiver")
        inverse = {"units": power(self.length_unit, -1)}
        units, meaning = self._kind
        coordinates: dict[str, Any] = {name: ((name,), np.arange(len(self.ports))) for name in dims}
        coordinates["axis"] = (("axis",), ["x", "y", "z"])
        coordinates["wavenumber"] = ((), self.wavenumber, {**inverse, "long_name": "k"})
        variables: dict[str, Any] = {
            "total": (dims, self.values, {"units": units, "long_name": meaning}),
            "error": (dims, self.error, {"units": units}),
            "status": (dims, self.status, {"long_name": "code of FieldStatus"}),
            "method": (dims, self.method, {"long_name": "the method used"}),
            "port": (("source", "axis"), self.ports, {"units": self.length_unit}),
        }
        if self.axes is not None:
            variables["slot"] = (("source", "axis"), self.axes, {"long_name": "unit tangent along the slot"})
        if len(set(self.kinds.tolist())) > 1:
            variables["moment"] = (*variables.pop("slot")[:2], {"long_name": "unit vector along the moment"})
            coordinates |= {f"{name}_kind": ((name,), self.kinds) for name in dims}
        return dataset(variables, coordinates, boundary=self.boundary, order=self.order)

    def __repr__(self) -> str:
        names, counts = np.unique(self.method[~np.eye(len(self.ports), dtype=bool)], return_counts=True)
        served = ", ".join(f"{n} by {name}" for name, n in zip(names, counts, strict=True))
        states = ", ".join(f"{n} {name}" for name, n in self.status_counts.items())
        good = self.ok & np.isfinite(self.values)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = self.error[good] / np.abs(self.values[good])
        error = f", error {np.median(share):.2g} of it in the median" if share.size else ""
        return (
            f"Coupling({len(self.ports)} ports, k = {self.wavenumber:g}, {self.boundary}, order {self.order}, "
            f"on {brief(self.body)})\n"
            f"  {served or 'none'}; {states or 'no status'}\n"
            f"  {len(self._rays)} geodesics up to {self.length:.4g} {self.length_unit}; where OK up to "
            f"{np.max(np.abs(self.values[good]), initial=0.0):.4g} {self._kind[0]}{error}"
        )
