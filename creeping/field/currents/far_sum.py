"""The far field that currents of the whole body give, with the error that they state."""

from collections.abc import Callable

import numpy as np

from creeping._progress import say
from creeping._typing import Any, FloatArray
from creeping.field.arguments import UNRESOLVED
from creeping.field.boundary import BoundaryLike, boundary_name
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.field.results.far_result import FarField
from creeping.geometry.checks import unit_of
from creeping.storage.parts import Keeping, not_kept


def far_by_currents(
    currents: SurfaceCurrents,
    r: FloatArray,
    boundary: BoundaryLike,
    *,
    left_out: float = 0.0,
    keep: Keeping = not_kept,
) -> FarField:
    """Far field in unit directions (m, 3); its error is that of the currents and ``left_out``, L.

    ``keep`` has each sum over nodes, which takes as long for all directions as for a few.
    """

    def summed(name: str, make: Callable[[], Any]) -> Any:
        say(f"sums over currents, {name}")
        return keep(f"currents-{name}", lambda: {"f": make()})["f"]

    lit = summed("lit", lambda: currents.far_of(currents.lit, r))
    dark = summed("dark", lambda: currents.far_of(~currents.lit, r))
    error = np.hypot(summed("error", lambda: currents.error(r)), left_out)
    largest = np.max(np.abs(np.concatenate([lit + dark, currents.far(currents.direction[None])])))
    off = ~(error < UNRESOLVED * largest)
    return FarField(
        directions=r.copy(),
        total=lit + dark,
        parts={"lit": lit, "dark": dark},
        method=np.full(len(r), "equation" if currents.solved else "currents", dtype="<U16"),
        unresolved=off.any(axis=tuple(range(1, off.ndim))),
        error=error,
        error_by="extinction",
        wavenumber=currents.wavenumber,
        boundary=boundary_name(boundary),
        order=2,
        unit=unit_of(currents.body),
    )
