"""Currents of a fan, kept for the fields that are asked for next, and whether they cost little enough.

A field at m places is a sum over n nodes for each: its cost goes like n m, and n like k^2; a map of many directions is
a transform, which costs less.

Sources: Derivations, F16.
"""

from weakref import WeakKeyDictionary

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.field.boundary import BoundaryLike
from creeping.field.currents.assembly import CUT, surface_currents
from creeping.field.currents.bounce import may_face_itself
from creeping.field.currents.nodes import RAYS, STEPS
from creeping.field.currents.radiation import grid_cells, transformed
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.field.currents.whole_solution import pairs_of
from creeping.geometry.creased import is_creased
from creeping.geometry.quadrature import node_count
from creeping.rays.fan import RayFan
from creeping.rays.reach import ray_length

AFFORDABLE = 3e9
"""Nodes times directions, one by one, up to which "auto" takes currents: some ten seconds of one core."""
POINTS = 2e10
"""Nodes times points near the body, likewise: forty seconds."""
MOST_NODES = 1_500_000
"""Nodes up to which it does, for the memory's sake."""
MAKING = 2700.0
"""What making a node costs, in terms of a place at which it is summed: 9 microseconds."""
SECONDS = 3.3e-9
"""Of one node at one place."""
SOLVING, SOLVING_VECTORS = 3e-4, 9e-4
"""Of one node of those between which the body's equation is solved; of a conductor, both polarisations."""
LIT = 0.6
"""Share of a body's nodes that are lit or in the penumbra."""
KEPT = 2
"""Currents kept with a fan, of so many wavenumbers and boundaries."""
_CURRENTS: "WeakKeyDictionary[RayFan, dict[Any, SurfaceCurrents]]" = WeakKeyDictionary()


def affordable(fan: RayFan, places: int, wavenumber: float, *, distant: bool = False) -> bool:
    """Whether currents cost little enough for so many points, or directions if ``distant``."""
    nodes = expected_nodes(fan, wavenumber)
    if nodes > MOST_NODES:
        return False
    cells = grid_cells(np.ptp(fan.body.bounds, axis=0), wavenumber)
    by_transform = distant and transformed(nodes, places, cells)
    if not distant:
        return nodes * MAKING < AFFORDABLE and nodes * places < POINTS
    return nodes * (MAKING + (0 if by_transform else places)) < AFFORDABLE


def expected_seconds(fan: RayFan, wavenumbers: FloatArray, directions: int, boundary: BoundaryLike = "soft") -> float:
    """About what currents of one incidence at wavenumbers (k,), 1/L, and their far field cost, where they are taken."""
    known = [float(k) for k in wavenumbers if affordable(fan, directions, float(k), distant=True)]
    plain = SECONDS * sum(expected_nodes(fan, k) * (MAKING + directions) for k in known)
    solving = SOLVING_VECTORS if boundary == "pec" else SOLVING
    return plain + solving * float(sum(np.sqrt(expected_pairs(fan, k, boundary)) for k in known))


def expected_pairs(fan: RayFan, wavenumber: float, boundary: BoundaryLike = "soft") -> int:
    """Between how many pairs of nodes the body's equation is solved for a fan, 0 if it is not, as far as is known."""
    solved = 1.0 - fan.line.fractions["attached"] > CUT or (boundary == "pec" and is_creased(fan.body))
    return pairs_of(fan.body, wavenumber) if solved or may_face_itself(fan.body) else 0


def expected_nodes(fan: RayFan, wavenumber: float) -> int:
    """About how many nodes the currents of a fan's incidence have."""
    wavelength = 2 * np.pi / wavenumber
    line = sum(curve.length for curve in fan.line.curves) * fan.line.fractions["attached"]
    rays = RAYS * STEPS * line * ray_length(fan.line, wavenumber=wavenumber) / wavelength**2
    return int(LIT * node_count(fan.body, 2 * wavenumber) + rays)


def kept_currents(
    fan: RayFan, wavenumber: float, boundary: BoundaryLike, *, solve: bool | None = None
) -> SurfaceCurrents:
    """Currents of the whole body, made once for each of the last wavenumbers and boundaries.

    Raises
    ------
    InvalidInputError, SurfaceError
        As `surface_currents`.
    """
    kept = _CURRENTS.setdefault(fan, {})
    key = (wavenumber, boundary, solve)
    if key not in kept:
        while len(kept) >= KEPT:
            kept.pop(next(iter(kept)))
        kept[key] = surface_currents(fan, wavenumber=wavenumber, boundary=boundary, solve=solve)
    return kept[key]
