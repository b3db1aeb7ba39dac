"""Solutions of a body's equation, kept for the fields that are asked for next, and whether they cost little enough.

Many incidences are solved together by `solve_together`; `solution_for` then finds each of them.
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import FloatArray
from creeping.errors import InvalidInputError, SurfaceError
from creeping.field.boundary import CONDUCTOR, Boundary, BoundaryLike, scalar_boundaries
from creeping.field.equation.body_tiles import body_tiles
from creeping.field.equation.currents import ConductorTileCurrents, TileCurrents
from creeping.field.equation.solution import Solution
from creeping.field.equation.solving import SECONDS, cost, solve
from creeping.geodesics.equations import points_of_charts
from creeping.geometry.creased import is_creased
from creeping.geometry.kept import kept
from creeping.geometry.quadrature import node_count
from creeping.geometry.surface import Surface
from creeping.storage.memory import budget

KEPT = 6
"""Solutions kept with a body."""
ASKED = 300.0
"""Seconds that the equation may take if it is asked for."""
POOR = 0.05
"""What currents may leave of the incident wave inside: those that leave more have not been resolved."""
SAME = 1e-14
"""Difference of unit directions that are one."""


class Solved(NamedTuple):
    """A solution, and the number of the incidence in it."""

    solution: Solution
    incidence: int

    @property
    def currents(self) -> TileCurrents | ConductorTileCurrents:
        """Currents of the incidence."""
        return self.solution.currents(self.incidence)


def solution_for(body: Surface, direction: FloatArray, wavenumber: float, boundary: BoundaryLike) -> Solved | None:
    """The solution of an incidence, if the equation of the body costs less than SECONDS and resolves it, else None."""
    if _is_rough(body):
        return None
    found = _found(body, direction, wavenumber, boundary)
    if found is None and not too_much(body, wavenumber, boundary, SECONDS):
        solve_together(body, direction[None], wavenumber, boundary)
        found = _found(body, direction, wavenumber, boundary)
    if found is None or not found.currents.extinction <= POOR:
        return None
    return found


def asked_solution(body: Surface, direction: FloatArray, wavenumber: float, boundary: BoundaryLike) -> Solved:
    """The same, if it costs less than ASKED.

    Raises
    ------
    InvalidInputError, SurfaceError
        If it costs more, or the body has no mesh.
    """
    found = _found(body, direction, wavenumber, boundary)
    if found is None:
        why = too_much(body, wavenumber, boundary, ASKED)
        if why:
            raise InvalidInputError(
                f"the integral equation is not solved at wavenumber {wavenumber:g}: {why}; rays and optics serve "
                "without method='equation'"
            )
        found = Solved(solve(body, direction, wavenumber=wavenumber, boundary=boundary, seconds=np.inf), 0)
        _keep(body, found.solution)
    return found


def solve_together(body: Surface, directions: FloatArray, wavenumber: float, boundary: BoundaryLike) -> None:
    """Solve the equation for unit directions (m, 3) at once and keep it, if it costs less than SECONDS for one."""
    if not too_much(body, wavenumber, boundary, SECONDS):
        try:
            _keep(body, solve(body, directions, wavenumber=wavenumber, boundary=boundary, seconds=np.inf))
        except (InvalidInputError, SurfaceError):
            return


class Plan(NamedTuple):
    """Nodes, seconds and bytes that the equation of one incidence takes, about; why it is not solved, or nothing."""

    nodes: int
    seconds: float
    memory: float
    refused: str


def plan_of(body: Surface, wavenumber: float, boundary: BoundaryLike, seconds: float = SECONDS) -> Plan:
    """What the equation of one incidence takes, and whether that is too much time or memory, or cannot be."""
    kind = _kind(boundary)
    try:
        nodes = _nodes(body, wavenumber, kind)
    except SurfaceError as error:
        return Plan(0, np.inf, np.inf, str(error))
    takes, memory = cost(nodes, kind, 1)
    refused = f"{nodes} nodes take {memory / 1e9:.2g} GB" if memory > budget() else ""
    if takes > seconds:
        refused = f"{nodes} nodes take about {takes:.2g} s, more than {seconds:g}"
    return Plan(nodes, takes, memory, refused)


def too_much(body: Surface, wavenumber: float, boundary: BoundaryLike, seconds: float) -> str:
    """Why the equation of one incidence takes too much time or memory, or cannot be; nothing if it does not."""
    return plan_of(body, wavenumber, boundary, seconds).refused


def is_large(body: Surface, wavenumber: float, boundary: BoundaryLike) -> bool:
    """Whether the equation of one incidence costs more than SECONDS; of large bodies told without making tiles."""
    # quadrature of the currents has no more than twice the nodes
    least = node_count(body, wavenumber) // 2
    return cost(least, _kind(boundary), 1)[0] > SECONDS or bool(too_much(body, wavenumber, boundary, SECONDS))


def expected_seconds_of(body: Surface, wavenumber: float, boundary: BoundaryLike) -> float:
    """About what the equation of one incidence costs, 0 where it is not solved by itself."""
    plan = plan_of(body, wavenumber, boundary)
    return 0.0 if plan.refused else plan.seconds


def _kind(boundary: BoundaryLike) -> Boundary:
    """The boundary of the equation: of a conductor one, not two scalar ones."""
    kinds = scalar_boundaries(boundary)
    return CONDUCTOR if len(kinds) == 2 else kinds[0]


def _is_rough(body: Surface) -> bool:
    """Whether a body says of itself that it is somewhere not smooth enough for rays: what it is there is not known."""
    rough = getattr(body, "non_smooth", None)
    if rough is None or is_creased(body):
        return False
    return kept(body, "rough somewhere", lambda: bool(np.any(rough(points_of_charts(body)))))


def _nodes(body: Surface, wavenumber: float, kind: Boundary) -> int:
    known: dict[tuple[float, bool, bool], int] = kept(body, "nodes of tiles", dict)
    key = wavenumber, kind.varies, kind.kind == "conductor"
    if key not in known:
        known[key] = len(body_tiles(body, wavenumber, kind).points)
    return known[key]


def _found(body: Surface, direction: FloatArray, wavenumber: float, boundary: BoundaryLike) -> Solved | None:
    known: list[Solution] = kept(body, "solutions", list)
    for solution in known:
        if solution.wavenumber == wavenumber and solution.boundary == boundary:
            same = np.flatnonzero(np.max(np.abs(solution.directions - direction), axis=1) < SAME)
            if len(same):
                return Solved(solution, int(same[0]))
    return None


def _keep(body: Surface, solution: Solution) -> None:
    known: list[Solution] = kept(body, "solutions", list)
    known.append(solution)
    del known[:-KEPT]
