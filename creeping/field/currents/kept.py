"""Currents of a fan, kept for the fields that are asked for next, and whether they cost little enough.

A field at m places is a sum over n nodes for each: its cost goes like n m, and n like k^2; a map of many directions is
a transform, which costs less.

Sources: Derivations, F16.
"""

from weakref import WeakKeyDictionary

import numpy as np

from creeping.errors import SurfaceError
from creeping.field.boundary import BoundaryLike
from creeping.field.currents.assembly import surface_currents
from creeping.field.currents.radiation import grid_cells, transformed
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.geometry.quadrature import body_nodes
from creeping.geometry.surface import size
from creeping.rays.fan import RayFan

AFFORDABLE = 3e9
"""Nodes times directions or points, one by one, up to which "auto" takes currents: some ten seconds of one core."""
MOST_NODES = 1.5e6
"""Nodes up to which it does, for the memory's sake."""
KEPT = 2
"""Currents kept with a fan, of so many wavenumbers and boundaries."""
_CURRENTS: "WeakKeyDictionary[RayFan, dict[tuple[float, BoundaryLike], SurfaceCurrents]]" = WeakKeyDictionary()


def affordable(fan: RayFan, places: int, wavenumber: float, *, distant: bool = False) -> bool:
    """Whether currents cost little enough for so many points, or directions if ``distant``, by the body's area."""
    if not len(fan.points):
        return False
    try:
        area = float(np.sum(body_nodes(fan.body, 4 / size(fan.body)).weights))
    except SurfaceError:
        return False
    # some six nodes a wavelength on the lit half, and the least that a mesh has
    nodes = max(3e4, 0.5 * area * (6 * wavenumber / (2 * np.pi)) ** 2)
    if nodes > MOST_NODES:
        return False
    cells = grid_cells(np.ptp(fan.body.bounds, axis=0), wavenumber)
    return nodes * places < AFFORDABLE or (distant and transformed(int(nodes), places, cells))


def kept_currents(fan: RayFan, wavenumber: float, boundary: BoundaryLike) -> SurfaceCurrents:
    """Currents of the whole body, made once for each of the last wavenumbers and boundaries.

    Raises
    ------
    InvalidInputError, SurfaceError
        As `surface_currents`.
    """
    kept = _CURRENTS.setdefault(fan, {})
    key = (wavenumber, boundary)
    if key not in kept:
        while len(kept) >= KEPT:
            kept.pop(next(iter(kept)))
        kept[key] = surface_currents(fan, wavenumber=wavenumber, boundary=boundary)
    return kept[key]
