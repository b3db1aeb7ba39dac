"""Currents of a fan, kept for the fields that are asked for next, and whether they cost little enough.

A field at m places is a sum over n nodes for each: its cost goes like n m, and n like k^2.

Sources: Derivations, F16.
"""

from weakref import WeakKeyDictionary

import numpy as np

from creeping.errors import SurfaceError
from creeping.field.boundary import BoundaryLike
from creeping.field.currents.assembly import surface_currents
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.geometry.quadrature import body_nodes
from creeping.geometry.surface import size
from creeping.rays.fan import RayFan

AFFORDABLE = 3e9
"""Nodes times directions or points, seen one by one, up to which "auto" takes currents: ten seconds or so."""
MOST_NODES = 1.5e6
"""Nodes up to which it does, for the memory's sake."""
KEPT = 2
"""Currents kept with a fan, of so many wavenumbers and boundaries."""
_CURRENTS: "WeakKeyDictionary[RayFan, dict[tuple[float, BoundaryLike], SurfaceCurrents]]" = WeakKeyDictionary()


def likely_nodes(fan: RayFan, wavenumber: float) -> float:
    """About as many nodes as currents have, by the area of the body; infinite where there are none."""
    if not len(fan.points):
        return np.inf
    try:
        area = float(np.sum(body_nodes(fan.body, 4 / size(fan.body)).weights))
    except SurfaceError:
        return np.inf
    # some six nodes a wavelength on the lit half, and the least that a mesh has
    return max(3e4, 0.5 * area * (6 * wavenumber / (2 * np.pi)) ** 2)


def affordable(fan: RayFan, points: int, wavenumber: float) -> bool:
    """Whether currents cost little enough at so many points."""
    nodes = likely_nodes(fan, wavenumber)
    return nodes < MOST_NODES and nodes * points < AFFORDABLE


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
