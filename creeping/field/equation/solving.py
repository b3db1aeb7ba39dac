"""Solve a body's integral equation for as many incidences as there are; what that costs is told before.

Tiles of the body (`creeping.field.equation.tiles`), the matrix of the equation on two surfaces
(`creeping.field.equation.matrix`), GMRES for all incidences together, and what the currents radiate
(`creeping.field.equation.solution`).

Also here: solutions of a body's equation, kept for the fields that are asked for next, and whether they cost little
enough.

Many incidences are solved together by `solve_together`; `solution_for` then finds each of them.

Sources: [SS86]; Derivations, F36.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from creeping._progress import telling
from creeping._typing import ArrayLike, FloatArray
from creeping.errors import InvalidInputError, SurfaceError
from creeping.field.arguments import checked, checked_plain
from creeping.field.boundary import CONDUCTOR, Boundary, BoundaryLike, scalar_boundaries
from creeping.field.equation.body_tiles import body_tiles
from creeping.field.equation.columns import TOGETHER, is_dense
from creeping.field.equation.currents import ConductorTileCurrents, TileCurrents
from creeping.field.equation.matrix import EACH, VECTOR
from creeping.field.equation.solution import Solution
from creeping.geodesics.equations import points_of_charts
from creeping.geometry.directions import unit_directions
from creeping.geometry.memo import memo
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.quadrature import node_count
from creeping.geometry.surface import Surface
from creeping.kernels.threads import thread_count
from creeping.storage.memory import budget, within_budget
from creeping.storage.parts import Keeping, not_kept

PRODUCTS = 25
"""Products with the matrix, about, that an incidence takes."""
PER_NODE, NEAR_VECTOR = 5e-4, 2.0
"""Seconds of a core that integrals over tiles near to a node take, and what those of a conductor take of that."""
PER_ENTRY = 4e-10
"""Seconds of an entry of the matrix in a product with one of several columns."""
SUM, SUM_VECTOR = 1e-5, 4e-5
"""Seconds of a node in a split sum for one column."""
SECONDS = 30.0
"""What the equation may take, unless the caller says."""

KEPT = 6
"""Solutions kept with a body."""
ASKED = 300.0
"""Seconds that the equation may take if it is asked for."""
POOR = 0.05
"""What currents may leave of the incident wave inside: those that leave more have not been resolved."""
SAME = 1e-14
"""Difference of unit directions that are one."""


def solve(
    body: Surface,
    directions: ArrayLike,
    *,
    wavenumber: float,
    boundary: BoundaryLike,
    seconds: float = SECONDS,
    progress: Callable[[str], None] | bool | None = None,
) -> Solution:
    """The field that a body scatters, by its integral equation: no shadow line and no rays are needed.

    Parameters
    ----------
    body : Surface
        Smooth, or of pieces with edges, joints and tips.
    directions : (3,) or (m, 3)
        Of incidence; need not be unit. All are solved together.
    wavenumber : float, 1/L
    boundary : "soft", "hard", "pec" or ImpedanceBoundary
    seconds : float
        What it may take, about, with all cores; more is refused before it starts.
    progress : callable or bool, optional
        Is told in words what is done, with the number of nodes, the time and the memory that it takes; True shows it.

    Returns
    -------
    Solution

    Raises
    ------
    InvalidInputError
        On bad arguments, for a weighted body, and if it would take more time or memory than it may.
    SurfaceError
        If the body has no mesh.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> solution = cr.solve(sc.Cylinder(1.0, 2.0), (1, 0, 0), wavenumber=3.0, boundary="hard")
    >>> far = solution.far_field([(1, 0, 0), (-1, 0, 0)])
    >>> far.method.tolist(), bool(far.error.max() < 0.01 * abs(far.total).max())
    (['equation', 'equation'], True)
    """
    return kept_solution(body, directions, wavenumber, boundary, seconds, progress, not_kept)


def kept_solution(
    body: Surface,
    directions: ArrayLike,
    wavenumber: float,
    boundary: BoundaryLike,
    seconds: float,
    progress: Callable[[str], None] | bool | None,
    keep: Keeping,
) -> Solution:
    """The same, its columns given to ``keep`` as they are solved."""
    checked_plain(body)
    kinds = scalar_boundaries(boundary)
    k = checked(wavenumber, 2, body)
    d = unit_directions(directions, "directions of incidence").reshape(-1, 3)
    kind = CONDUCTOR if len(kinds) == 2 else kinds[0]
    tiles = body_tiles(body, k, kind)
    takes, memory = cost(len(tiles.points), kind, len(d))
    told = f"{len(tiles.points)} nodes, about {takes:.2g} s and {memory / 1e9:.2g} GB"
    if takes > seconds:
        raise InvalidInputError(
            f"the integral equation at wavenumber {k:g} has {told}, more than the {seconds:g} s that it may take; "
            "give seconds=, or a lower wavenumber, or let rays serve (creeping.far_field)"
        )
    what = f"the integral equation between {len(tiles.points)} nodes for {len(d)} incidences"
    within_budget(memory, what, "lower the wavenumber or give fewer")
    with telling(progress) as tell:
        tell(f"{told}: integrals between the nodes")
        return Solution(body, d, k, boundary, kind, tiles, tell, keep)


def cost(nodes: int, boundary: Boundary, incidences: int) -> tuple[float, float]:
    """Seconds and bytes, about, that the equation between nodes takes, of one incidence or of several."""
    vector = boundary.kind == "conductor"
    columns = incidences * (2 if vector else 1)
    # of incidences their values and changes, and what GMRES keeps
    kept = 64.0 * nodes * incidences * (6 if vector else 1) + TOGETHER
    near = 2 * nodes * PER_NODE * (NEAR_VECTOR if vector else 1.0)
    if is_dense(nodes, boundary):
        entries = float(nodes) ** 2 * (4 if vector else 1)
        pairs = 2 * float(nodes) ** 2 * EACH * (VECTOR if vector else 1.0)
        products = PRODUCTS * entries * PER_ENTRY * columns
        # the matrix and its transpose
        return (pairs + near + products) / thread_count(), 16 * entries + kept
    each, memory = (SUM_VECTOR, 2e4 * 4) if vector else (SUM, 2e4)
    return near / thread_count() + PRODUCTS * columns * each * nodes, memory * nodes + kept


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
    if is_rough(body):
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
    """Nodes, seconds and bytes that the equation takes, about; why it is not solved, or nothing."""

    nodes: int
    seconds: float
    memory: float
    refused: str


def plan_of(
    body: Surface, wavenumber: float, boundary: BoundaryLike, seconds: float = SECONDS, *, incidences: int = 1
) -> Plan:
    """What the equation takes, and whether that of one incidence is too much time or memory, or cannot be."""
    kind = _kind(boundary)
    try:
        nodes = _nodes(body, wavenumber, kind)
    except SurfaceError as error:
        return Plan(0, np.inf, np.inf, str(error))
    takes, memory = cost(nodes, kind, 1)
    refused = f"{nodes} nodes take {memory / 1e9:.2g} GB" if memory > budget() else ""
    if takes > seconds:
        refused = f"{nodes} nodes take about {takes:.2g} s, more than {seconds:g}"
    if incidences > 1:
        takes, memory = cost(nodes, kind, incidences)
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


def is_rough(body: Surface) -> bool:
    """Whether a body says of itself that it is somewhere not smooth enough for rays: what it is there is not known."""
    rough = getattr(body, "non_smooth", None)
    if rough is None or is_piecewise(body):
        return False
    return memo(body, "rough somewhere", lambda: bool(np.any(rough(points_of_charts(body)))))


def _nodes(body: Surface, wavenumber: float, kind: Boundary) -> int:
    known: dict[tuple[float, bool, bool], int] = memo(body, "nodes of tiles", dict)
    key = wavenumber, kind.varies, kind.kind == "conductor"
    if key not in known:
        known[key] = len(body_tiles(body, wavenumber, kind).points)
    return known[key]


def _found(body: Surface, direction: FloatArray, wavenumber: float, boundary: BoundaryLike) -> Solved | None:
    known: list[Solution] = memo(body, "solutions", list)
    for solution in known:
        if solution.wavenumber == wavenumber and solution.boundary == boundary:
            same = np.flatnonzero(np.max(np.abs(solution.directions - direction), axis=1) < SAME)
            if len(same):
                return Solved(solution, int(same[0]))
    return None


def _keep(body: Surface, solution: Solution) -> None:
    known: list[Solution] = memo(body, "solutions", list)
    known.append(solution)
    del known[:-KEPT]
