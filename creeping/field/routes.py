"""Which way serves: the one place where a problem is answered by routes. There is no physics here.

A route says which points it may serve, whether it can afford so many, and gives values with the error that they state.
Routes are asked in their order, each for what the ones before have not served well enough; its values take the place
of others where they are OK and err less, or where nothing else will do
(`creeping.field.results.point_result.PointValues.replaced_where_better`).

Where the integral equation is solved by itself, and how finely, `creeping.field.equation.effort` says.

Also here: one incidence on one body at one wavenumber: a scalar field, or E and H of p polarisations.

A scalar problem has one component and one column; a conductor's has p columns, one for each polarisation of the
incident wave, of three components (J) or six (E and H).

Sources: Derivations, F16, F17 and F20.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from creeping._typing import Any, ArrayLike, BoolArray, ComplexArray, FloatArray, IntArray
from creeping.errors import InvalidInputError, SurfaceError
from creeping.field.arguments import METHODS, PLAIN, checked, checked_method, checked_plain
from creeping.field.body_currents import CUT, cached_currents, has_expansions, solution_of_pieces
from creeping.field.boundary import Boundary, BoundaryLike, boundary_name, scalar_boundaries
from creeping.field.currents.conductor import ConductorCurrents
from creeping.field.currents.nodes import RAYS, STEPS
from creeping.field.currents.radiation import grid_cells, may_self_reflect, transformed
from creeping.field.currents.whole_body import POINTS, SurfaceCurrents
from creeping.field.equation.effort import equation_boundary, expected_seconds_of, plan_of, too_much
from creeping.field.equation.solving import is_rough
from creeping.field.lit_ground import convex
from creeping.field.marching.fan_waves import marchable
from creeping.field.results.far_result import incident_mix, spherical_frame
from creeping.field.results.point_result import FieldStatus, PointValues
from creeping.field.validity_range import is_reached, validity
from creeping.field.waves.beams import seconds as beam_seconds
from creeping.field.waves.far_geometry import fan_strips
from creeping.field.waves.surface import scalar_boundary
from creeping.geometry.arguments import one_of
from creeping.geometry.checks import unit_of
from creeping.geometry.evaluators import speed_of
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.quadrature import node_count
from creeping.geometry.surface import Surface
from creeping.rays.fan import RayFan
from creeping.rays.reach import ray_length


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
        return equation_boundary(self.boundary)

    @property
    def vector(self) -> bool:
        """Whether fields at points are vectors."""
        return self.mix is not None

    @property
    def columns(self) -> int:
        """Polarisations p, or 1."""
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
        """See the function `has_expansions`."""
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
        """Facts that all its results state."""
        return {
            "wavenumber": self.wavenumber,
            "boundary": boundary_name(self.boundary),
            "order": self.order,
            "validity": validity(self.fan, wavenumber=self.wavenumber),
            "length_unit": unit_of(self.body),
        }


@dataclass(frozen=True)
class Trust:
    """What the choice goes by.

    Attributes
    ----------
    far : float
        Nodes times directions, one by one, up to which "auto" takes currents: some ten seconds of one core.
    near : float
        Nodes times points near the body, likewise: forty seconds.
    nodes : int
        Nodes up to which it does, for the memory's sake.
    making : float
        What making a node costs, in terms of a place at which it is summed: 9 microseconds.
    seconds : float
        Of one node at one place.
    vector : float
        What sums for both fields of a polarisation cost, in terms of a scalar's.
    lit : float
        Share of a body's nodes that are lit or in the penumbra.
    beams : float
        Seconds that beams may take where marched waves merge; beyond, creeping modes are used.
    level_nodes, level_directions : int
        Nodes of the currents that rays are compared with, some tenths of a second, and directions of the comparison.
    levels : (float, float)
        Least and largest level that is believed: beyond, what errs at k0 is not what errs at k.
    fine, fine_vector : float
        Error of rays up to which currents are not asked, of a scalar field and of a conductor's.
    """

    far: float = 3e9
    near: float = 2e10
    nodes: int = 1_500_000
    making: float = 2700.0
    seconds: float = 3.3e-9
    vector: float = 1.5
    lit: float = 0.6
    beams: float = 60.0
    level_nodes: int = 50_000
    level_directions: int = 200
    levels: tuple[float, float] = (0.2, 50.0)
    fine: float = 0.01
    fine_vector: float = 1e-4


TRUST = Trust()


Served = list[tuple[IntArray, list[PointValues]]]
"""Points (m,) of those asked for, and the field there (m, ...) of each polarisation."""


class Route(NamedTuple):
    """A way to the field at points (n,) off the body or on it.

    Attributes
    ----------
    asked : callable
        Points (n,) it may take, given the field that there is of each polarisation.
    serve : callable
        Gives the field at points, by their numbers, where it is valid; nothing if it costs too much.
    must : bool
        Whether its values stand whatever they state.
    """

    asked: Callable[[list[PointValues]], BoolArray]
    serve: Callable[[IntArray], Served]
    must: bool


def answered(columns: list[PointValues], routes: Sequence[Route]) -> list[PointValues]:
    """The field at points (n,) of each polarisation, by routes in their order."""
    for route in routes:
        at = np.flatnonzero(route.asked(columns))
        for rows, found in route.serve(at) if len(at) else ():
            pairs = zip(columns, found, strict=True)
            columns = [one.replaced_where_better(rows, its, must=route.must) for one, its in pairs]
    return columns


def poor(columns: list[PointValues]) -> BoolArray:
    """Points (n,) where rays are not OK or err too much."""
    fine = TRUST.fine if len(columns[0].wave.shape) == 1 else TRUST.fine_vector
    return np.asarray(np.any([(one.status != FieldStatus.OK) | (one.error > fine) for one in columns], axis=0))


def affordable(fan: RayFan, places: int, wavenumber: float, *, distant: bool = False) -> bool:
    """Whether currents cost little enough for ``places`` points, or directions if ``distant``."""
    nodes = expected_nodes(fan, wavenumber)
    if nodes > TRUST.nodes:
        return False
    if not distant:
        return nodes * TRUST.making < TRUST.far and nodes * places < TRUST.near
    by_transform = transformed(nodes, places, grid_cells(np.ptp(fan.body.bounds, axis=0), wavenumber))
    return nodes * (TRUST.making + (0 if by_transform else places)) < TRUST.far


def expected_nodes(fan: RayFan, wavenumber: float) -> int:
    """About how many nodes the currents of a fan's incidence have."""
    wavelength = 2 * np.pi / wavenumber
    line = sum(curve.length for curve in fan.line.curves) * fan.line.fractions["attached"]
    rays = RAYS * STEPS * line * ray_length(fan.line, wavenumber=wavenumber) / wavelength**2
    return int(TRUST.lit * node_count(fan.body, 2 * wavenumber) + rays)


def expected_seconds(fan: RayFan, wavenumbers: FloatArray, directions: int, boundary: BoundaryLike = "soft") -> float:
    """About what currents of one incidence at wavenumbers (k,), 1/L, and their far field cost, where they are taken."""
    known = [float(k) for k in wavenumbers if affordable(fan, directions, float(k), distant=True)]
    plain = TRUST.seconds * sum(expected_nodes(fan, k) * (TRUST.making + directions) for k in known)
    unserved = 1.0 - float(fan.line.fractions["attached"]) > CUT
    if not (unserved or may_self_reflect(fan.body)) and has_expansions(fan.body, boundary):
        return plain
    return plain + sum(expected_seconds_of(fan.body, k, boundary) for k in known)


def marches(fan: RayFan, boundary: Boundary, order: int, count: int, wavenumber: float) -> bool:
    """Whether the waves of a fan can be marched, and cost little enough at ``count`` points."""
    return marchable(fan, boundary, order) and beam_seconds(fan, fan_strips(fan), wavenumber, count) < TRUST.beams


def affords(problem: Problem, places: int) -> bool:
    """Whether currents cost little enough for the field at ``places`` points."""
    each = TRUST.vector * problem.columns if problem.vector else 1.0
    return affordable(problem.fan, int(np.ceil(each * places)), problem.wavenumber)


def currents_of(problem: Problem) -> SurfaceCurrents:
    """Currents of the whole body; errors as `creeping.surface_currents`."""
    solve = True if problem.method == "equation" else None
    return problem.polarised(cached_currents(problem.fan, problem.wavenumber, problem.boundary, solve=solve))


def currents_near(problem: Problem, places: int) -> SurfaceCurrents | None:
    """Currents for the field at ``places`` points; None if they cost too much or there is no mesh for them.

    Raises
    ------
    InvalidInputError, SurfaceError
        As `creeping.surface_currents`, the latter where nothing but currents will do.
    """
    must = problem.needs_currents or problem.kind.varies
    return _meshed(problem, must=must) if must or affords(problem, places) else None


def solved_by_itself(problem: Problem) -> SurfaceCurrents | None:
    """Currents that stand for the field everywhere: those asked for, or of the equation where it is solved by itself.

    So fields far, near and on the body go one way. Nothing is made where the equation would cost too much.
    """
    if problem.needs_currents:
        return currents_of(problem)
    if problem.order == 1 or too_much(problem.body, problem.wavenumber, problem.boundary):
        return None
    found = _judging(problem)
    return found if found and found.solved else None


def currents_behind(problem: Problem) -> SurfaceCurrents | None:
    """As `solved_by_itself`, or affordable currents for what comes to the body from elsewhere on it.

    None for a body whose expansions stand alone.
    """
    found = solved_by_itself(problem)
    return found if found or stands_alone(problem) else _judging(problem)


def left_behind(problem: Problem, currents: SurfaceCurrents | None) -> FloatArray:
    """Residual field of currents inside, per incident wave (p,): 0 if expansions stand alone, NaN if not known."""
    if currents is not None:
        return np.asarray(np.max(currents.left_of_each, axis=0))
    return np.full(problem.columns, 0.0 if stands_alone(problem) else np.nan)


def _judging(problem: Problem) -> SurfaceCurrents | None:
    """Currents for as many points as they are judged at."""
    if not affordable(problem.fan, POINTS, problem.wavenumber):
        return None
    try:
        return currents_of(problem)
    except (InvalidInputError, SurfaceError):
        return None


def stands_alone(problem: Problem) -> bool:
    """Whether nothing comes to places of the body from elsewhere on it, and expansions are no worse than stated."""
    # an admittance that steps is smeared by expansions, of which their currents tell
    return not is_piecewise(problem.body) and convex(problem.fan) and not problem.kind.varies


def by_equation_alone(
    body: Surface,
    wavenumbers: FloatArray,
    boundaries: Sequence[BoundaryLike],
    incidences: int,
    *,
    method: str,
    order: int = 2,
) -> bool:
    """Whether the equation gives the far fields of ``incidences`` incidences, without any rays.

    At wavenumbers (k,), 1/L, at each of which the equation is solved by itself, of a body without expansions or one
    whose expansions reach to none of them.
    """
    if order != 2 or method not in ("auto", "currents", "equation") or speed_of(body) is not None:
        return False
    expanded = any(has_expansions(body, boundary) for boundary in boundaries) and method != "equation"
    if expanded and (method == "currents" or is_rough(body) or any(is_reached(body, float(k)) for k in wavenumbers)):
        return False
    plans = [plan_of(body, float(k), b, incidences=incidences) for k in wavenumbers for b in boundaries]
    # what is asked for is fine tiles for each, which all together may not have
    return not any(plan.refused or (method == "equation" and plan.effort.coarse) for plan in plans)


def far_currents(problem: Problem, directions: int) -> SurfaceCurrents | None:
    """Currents for a far field in ``directions`` directions; None where rays are used.

    Edges diffract, and currents go across joints: of a body of pieces the equation alone knows how, expansions next.

    Raises
    ------
    InvalidInputError, SurfaceError
        As `creeping.surface_currents`, where currents are asked for or nothing else is valid.
    """
    fan, k, boundary, method = problem.fan, problem.wavenumber, problem.boundary, problem.method
    piecewise = is_piecewise(problem.body)
    serve = problem.has_expansions and (problem.order == 2 or not piecewise)
    auto = method == "auto" and problem.order == 2 and directions > 0
    # currents of a body whose currents have no expansions are those of its equation
    solve = auto or (method == "currents" and directions > 0 and not problem.has_expansions)
    solved = solution_of_pieces(fan, k, boundary) if solve and piecewise else None
    if solved:
        return solved.currents
    # there are no modes of an admittance that varies
    without = method == "auto" and problem.kind.varies and not piecewise
    must = method == "equation" or (serve and (method == "currents" or without))
    # a conductor's sums are of six columns, those of one scalar problem of one to four
    count = len(scalar_boundaries(boundary)) * directions
    if not must and not (serve and auto and affordable(fan, count, k, distant=True)):
        return None
    return _meshed(problem, must=must)


def _meshed(problem: Problem, *, must: bool) -> SurfaceCurrents | None:
    """Currents; None if there is no mesh for them, unless they ``must`` be."""
    try:
        return currents_of(problem)
    except SurfaceError:
        if must:
            raise
        return None
