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

from creeping._progress import say, telling
from creeping._typing import ArrayLike, FloatArray
from creeping.errors import InvalidInputError, SurfaceError
from creeping.field.arguments import checked, checked_plain
from creeping.field.boundary import BoundaryLike
from creeping.field.equation.body_tiles import body_tiles
from creeping.field.equation.currents import ConductorTileCurrents, TileCurrents
from creeping.field.equation.effort import ASKED, SECONDS, Effort, equation_boundary, plan_of
from creeping.field.equation.matrix import Matrix
from creeping.field.equation.solution import Solution
from creeping.geodesics.equations import points_of_charts
from creeping.geometry.directions import unit_directions
from creeping.geometry.piecewise import is_piecewise
from creeping.geometry.surface import Surface, memo
from creeping.storage.parts import Keeping, not_kept

KEPT = 6
"""Solutions kept with a body."""
POOR = 0.05
"""What currents may leave of the incident wave inside: those that leave more have not been resolved."""
USELESS = 1.0
"""What currents without an incident wave leave inside: those that leave as much are none. Less is a field with a
measured error, which rays and optics, which know of no second reflection, have not."""
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
    """Solve the integral equation of scattering by a body; no shadow line and no rays are needed.

    Parameters
    ----------
    body : Surface
        Smooth, or of pieces with edges, joints and tips.
    directions : (3,) or (m, 3)
        Directions of incidence; need not be unit. All are solved together.
    wavenumber : float, 1/L
    boundary : "soft", "hard", "pec" or ImpedanceBoundary
    seconds : float
        Approximate limit of the run time on all cores. If fine tiles would exceed it, coarse tiles and fewer GMRES
        iterations are used, with a larger error. If these exceed it too, an error is raised before the start.
    progress : callable or bool, optional
        Called with a line of text before each step, with the number of nodes, the time and the memory; True shows them.

    Returns
    -------
    Solution

    Raises
    ------
    InvalidInputError
        On bad arguments, for a weighted body, or if the solution would exceed the limits of time or memory.
    SurfaceError
        If the body cannot be meshed.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> solution = cr.solve(sc.Cylinder(1.0, 2.0), (1, 0, 0), wavenumber=3.0, boundary="hard")
    >>> far = solution.far_field([(1, 0, 0), (-1, 0, 0)])
    >>> far.method.tolist(), bool(far.error.max() < 0.01 * abs(far.total).max())
    (['equation', 'equation'], True)
    """
    checked_plain(body)
    k = checked(wavenumber, 2, body)
    d = unit_directions(directions, "directions of incidence").reshape(-1, 3)
    plan = plan_of(body, k, boundary, seconds, incidences=len(d), together=True)
    told = f"{plan.nodes} nodes, about {plan.seconds:.2g} s and {plan.memory / 1e9:.2g} GB"
    if not plan.nodes:
        raise SurfaceError(plan.refused)
    if plan.refused:
        raise InvalidInputError(
            f"the integral equation at wavenumber {k:g} for {len(d)} incidences is not solved: {plan.refused}; "
            "give seconds=, fewer incidences, a lower wavenumber, more memory (CREEPING_MEMORY), or use rays "
            "(creeping.far_field)"
        )
    with telling(progress) as tell:
        tell(f"{told}: integrals between the nodes")
        return _solved(body, d, k, boundary, plan.effort, tell)


def _solved(
    body: Surface,
    directions: FloatArray,
    wavenumber: float,
    boundary: BoundaryLike,
    effort: Effort,
    tell: Callable[[str], None] = say,
    keep: Keeping = not_kept,
) -> Solution:
    kind = equation_boundary(boundary)
    # incidences one by one come with the same matrix; solutions that are kept do not keep the blocks of others
    made: dict[tuple[float, BoundaryLike, bool], Matrix] = memo(body, "matrix of the equation", dict)
    key = wavenumber, boundary, effort.coarse
    if key not in made:
        while made:
            made.popitem()[1].products.clear()
        made[key] = Matrix(body_tiles(body, wavenumber, kind, coarse=effort.coarse), wavenumber, kind)
    return Solution(body, directions, wavenumber, boundary, kind, made[key], tell, effort, keep)


class Solved(NamedTuple):
    """A solution, and the number of the incidence in it."""

    solution: Solution
    incidence: int

    @property
    def currents(self) -> TileCurrents | ConductorTileCurrents:
        """Currents of the incidence."""
        return self.solution.currents(self.incidence)


def solution_for(body: Surface, direction: FloatArray, wavenumber: float, boundary: BoundaryLike) -> Solved | None:
    """The solution of an incidence, if the equation of the body costs less than SECONDS, else None.

    Its error says how well it is resolved.
    """
    if is_rough(body):
        return None
    found = _found(body, direction, wavenumber, boundary)
    if found is None:
        solve_together(body, direction[None], wavenumber, boundary)
        found = _found(body, direction, wavenumber, boundary)
    if found is None or not found.currents.extinction < USELESS:
        return None
    return found


def asked_solution(body: Surface, direction: FloatArray, wavenumber: float, boundary: BoundaryLike) -> Solved:
    """As `solution_for`, up to the cost ASKED.

    Raises
    ------
    InvalidInputError, SurfaceError
        If it costs more, or the body has no mesh.
    """
    found = _found(body, direction, wavenumber, boundary)
    if found is None or found.solution.effort.coarse:
        plan = plan_of(body, wavenumber, boundary, ASKED)
        if found and found.solution.effort == plan.effort:
            return found
        if plan.refused:
            raise InvalidInputError(
                f"the integral equation is not solved at wavenumber {wavenumber:g}: {plan.refused}; without "
                "method='equation' rays and optics are used"
            )
        found = Solved(_solved(body, direction[None], wavenumber, boundary, plan.effort), 0)
        _keep(body, found.solution)
    return found


def solve_together(
    body: Surface, directions: FloatArray, wavenumber: float, boundary: BoundaryLike, *, fine: bool = False
) -> None:
    """Solve the equation for unit directions (m, 3) at once and keep it, if it costs less than SECONDS for one.

    On fine tiles alone, if these are asked for; else not of a rough body, whose solution nothing takes by itself.
    """
    if is_rough(body) and not fine:
        return
    plan = plan_of(body, wavenumber, boundary, incidences=len(directions))
    if not (plan.refused or (fine and plan.effort.coarse)):
        try:
            _keep(body, _solved(body, directions, wavenumber, boundary, plan.effort))
        except (InvalidInputError, SurfaceError):
            return


def solved_alone(
    body: Surface,
    directions: FloatArray,
    wavenumber: float,
    boundary: BoundaryLike,
    *,
    fine: bool = False,
    tell: Callable[[str], None] = say,
    keep: Keeping = not_kept,
) -> Solution:
    """The solution for unit directions (m, 3) of a body without another method, within ASKED for one of them.

    As it is within SECONDS where it can be, unless fine tiles are asked for; ``keep`` has columns as they are solved.

    Raises
    ------
    InvalidInputError, SurfaceError
        If it takes more time or memory, or the body has no tiles.
    """
    count = len(directions)
    plan = plan_of(body, wavenumber, boundary, incidences=count)
    if plan.refused or (fine and plan.effort.coarse):
        plan = plan_of(body, wavenumber, boundary, ASKED, incidences=count)
    if plan.refused:
        raise (InvalidInputError if plan.nodes else SurfaceError)(
            f"the integral equation is not solved at wavenumber {wavenumber:g}: {plan.refused}; give a lower "
            "frequency, a coarser mesh, or more memory (CREEPING_MEMORY)"
        )
    tell(f"{plan.nodes} nodes, about {plan.seconds:.2g} s and {plan.memory / 1e9:.2g} GB: integrals between the nodes")
    return _solved(body, directions, wavenumber, boundary, plan.effort, tell, keep)


def is_rough(body: Surface) -> bool:
    """Whether a body says of itself that it is somewhere not smooth enough for rays: what it is there is not known."""
    rough = getattr(body, "non_smooth", None)
    if rough is None or is_piecewise(body):
        return False
    return memo(body, "rough somewhere", lambda: bool(np.any(rough(points_of_charts(body)))))


def _found(body: Surface, direction: FloatArray, wavenumber: float, boundary: BoundaryLike) -> Solved | None:
    known: list[Solution] = memo(body, "solutions", list)
    for solution in reversed(known):
        if solution.wavenumber == wavenumber and solution.boundary == boundary:
            same = np.flatnonzero(np.max(np.abs(solution.directions - direction), axis=1) < SAME)
            if len(same):
                return Solved(solution, int(same[0]))
    return None


def _keep(body: Surface, solution: Solution) -> None:
    known: list[Solution] = memo(body, "solutions", list)
    known.append(solution)
    del known[:-KEPT]
