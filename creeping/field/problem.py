"""One incidence on one body at one wavenumber: a scalar field, or E and H of p polarisations.

A scalar problem has one component and one column; a conductor's has p columns, one for each polarisation of the
incident wave, of three components (J) or six (E and H).
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from creeping._typing import Any, ArrayLike, ComplexArray, FloatArray
from creeping.field.arguments import METHODS, PLAIN, checked, checked_method, checked_plain
from creeping.field.boundary import CONDUCTOR, Boundary, BoundaryLike, boundary_name, scalar_boundaries
from creeping.field.currents.conductor import ConductorCurrents
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.field.results.far_result import incident_mix, spherical_frame
from creeping.field.validity_range import validity
from creeping.field.waves.surface import scalar_boundary
from creeping.geometry.arguments import one_of
from creeping.geometry.checks import unit_of
from creeping.geometry.piecewise import has_edges, is_piecewise
from creeping.geometry.surface import Surface
from creeping.rays.fan import RayFan


@dataclass(frozen=True, eq=False)
class Problem:
    """What is asked of a fan, but for the observers.

    Attributes
    ----------
    fan : RayFan
    wavenumber : float, 1/L
    boundary : "soft", "hard", "pec" or ImpedanceBoundary
    order : 2 or 1
    method : str
    mix : (2, p) complex, or None
        Of fields at points of a conductor: the polarisations' components along theta and phi.
    """

    fan: RayFan
    wavenumber: float
    boundary: BoundaryLike
    order: int = 2
    method: str = "auto"
    mix: ComplexArray | None = None

    @classmethod
    def scalar(
        cls,
        fan: RayFan,
        wavenumber: float,
        boundary: BoundaryLike,
        order: int,
        method: str,
        methods: tuple[str, ...] = METHODS,
    ) -> Problem:
        """A scalar problem of a caller's arguments.

        Raises
        ------
        InvalidInputError
            If one of them is not usable, or the body is weighted.
        """
        one_of(fan, "fan", RayFan, "creeping.launch")
        scalar_boundary(boundary)
        k = checked(wavenumber, order, fan.body)
        checked_method(method, order, methods)
        checked_plain(fan.body)
        return cls(fan, k, boundary, order, method)

    @classmethod
    def conductor(cls, fan: RayFan, wavenumber: float, polarisation: str | ArrayLike | None, method: str) -> Problem:
        """That of a conductor; errors as of a scalar one, and of the polarisation."""
        one_of(fan, "fan", RayFan, "creeping.launch")
        checked_plain(fan.body)
        checked_method(method, 2, PLAIN)
        k = checked(wavenumber, 2, fan.body)
        return cls(fan, k, "pec", 2, method, incident_mix(polarisation, fan.line.direction))

    @property
    def body(self) -> Surface:
        """Body of the fan."""
        return self.fan.body

    @property
    def direction(self) -> FloatArray:
        """Direction of incidence (3,)."""
        return self.fan.line.direction

    @cached_property
    def kind(self) -> Boundary:
        """The boundary of its equation: of a conductor one."""
        kinds = scalar_boundaries(self.boundary)
        return CONDUCTOR if len(kinds) == 2 else kinds[0]

    @property
    def vector(self) -> bool:
        """Whether fields at points are vectors."""
        return self.mix is not None

    @property
    def columns(self) -> int:
        """P, or 1."""
        return 1 if self.mix is None else self.mix.shape[1]

    @cached_property
    def electric(self) -> ComplexArray:
        """E0 of each polarisation (3, p)."""
        assert self.mix is not None
        return np.asarray(spherical_frame(self.direction).T @ self.mix, dtype=complex)

    @property
    def unit(self) -> float:
        """The incident wave's amplitude on the body: k, 1/L, for du/dn."""
        return self.wavenumber if self.kind.kind == "soft" else 1.0

    @property
    def has_expansions(self) -> bool:
        """As the function of this name."""
        return has_expansions(self.body, self.boundary)

    @property
    def needs_currents(self) -> bool:
        """Whether nothing but currents of the whole body will do."""
        return self.method in ("currents", "equation") or not self.has_expansions

    def incident_at(self, points: FloatArray) -> ComplexArray:
        """The incident wave at points (n, 3), L: (n,), of a conductor E and H (n, 6, p)."""
        wave = np.asarray(np.exp(1j * self.wavenumber * (points @ self.direction)))
        if not self.vector:
            return wave
        both = np.concatenate([self.electric, np.cross(self.direction, self.electric, axisb=0).T])
        return np.asarray(np.multiply.outer(wave, both))

    def polarised(self, currents: SurfaceCurrents) -> SurfaceCurrents:
        """Currents of its incident waves."""
        if self.mix is None:
            return currents
        assert isinstance(currents, ConductorCurrents)
        return currents.polarised(self.mix)

    def facts(self) -> dict[str, Any]:
        """What its results say of it."""
        return {
            "wavenumber": self.wavenumber,
            "boundary": boundary_name(self.boundary),
            "order": self.order,
            "validity": validity(self.fan, wavenumber=self.wavenumber),
            "length_unit": unit_of(self.body),
        }


def has_expansions(body: Surface, boundary: BoundaryLike) -> bool:
    """Whether there are expansions of currents on all of a body: not round edges, nor across joints of a conductor."""
    return not has_edges(body) and not (boundary == "pec" and is_piecewise(body))
