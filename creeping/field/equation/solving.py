"""Solve a body's integral equation for as many incidences as there are; what that costs is told before.

Tiles of the body (`creeping.field.equation.tiles`), the matrix of the equation on two surfaces
(`creeping.field.equation.matrix`), GMRES for all incidences together, and what the currents radiate
(`creeping.field.equation.solution`).

Sources: [SS86]; Derivations, F36.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from collections.abc import Callable

from creeping._typing import ArrayLike
from creeping.errors import InvalidInputError
from creeping.field.arguments import checked, checked_plain
from creeping.field.boundary import CONDUCTOR, Boundary, BoundaryLike, scalar_boundaries
from creeping.field.equation.body_tiles import body_tiles
from creeping.field.equation.columns import TOGETHER, is_dense
from creeping.field.equation.matrix import EACH, VECTOR
from creeping.field.equation.solution import Solution
from creeping.geometry.directions import unit_directions
from creeping.geometry.surface import Surface
from creeping.kernels.threads import thread_count
from creeping.storage.memory import within_budget

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


def solve(
    body: Surface,
    directions: ArrayLike,
    *,
    wavenumber: float,
    boundary: BoundaryLike,
    seconds: float = SECONDS,
    progress: Callable[[str], None] | None = None,
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
    progress : callable, optional
        Is told in words what is done, with the number of nodes, the time and the memory that it takes.

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
    checked_plain(body)
    kinds = scalar_boundaries(boundary)
    k = checked(wavenumber, 2)
    d = unit_directions(directions, "directions of incidence").reshape(-1, 3)
    tell = progress or (lambda words: None)
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
    tell(f"{told}: integrals between the nodes")
    return Solution(body, d, k, boundary, kind, tiles, tell)


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
