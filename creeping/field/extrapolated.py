"""The error of a far field by rays where currents cost too much: measured at a lower wavenumber, carried up.

At the highest wavenumber k0 whose currents cost little, rays are compared with currents, which measure their own error
epsilon, in directions spread over the sphere. With e the error that rays state (`creeping.field.far_rays`),

    level = the 95th percentile of |f_rays - f_currents|/e at k0
    error = [(level e)^2 + (epsilon (k0/k)^p f_rms)^2]^(1/2),   p = 1, and 0 where part of the line launches no ray

e falls as fast as the order that it is of; of a conductor, whose second order is a rule away from the sphere, a level
above 1 tells of a term of first order, and grows like k. The second term is what rays and currents both lack.

Sources: Derivations, F17.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from creeping.errors import SurfaceError
from creeping.field.body_currents import expected_nodes, surface_currents
from creeping.field.boundary import BoundaryLike
from creeping.field.far_geometry import far_geometry
from creeping.field.far_rays import field_of
from creeping.field.far_result import FarField
from creeping.geometry.directions import fibonacci_directions
from creeping.geometry.kept import kept
from creeping.geometry.surface import size
from creeping.rays.fan import RayFan

NODES = 50_000
"""Nodes of the currents that rays are compared with: some tenths of a second."""
DIRECTIONS = 200
"""Directions of the comparison."""
LEVELS = (0.2, 50.0)
"""Least and largest level that is believed: beyond, what errs at k0 is not what errs at k."""


class Level(NamedTuple):
    """What the comparison found.

    Attributes
    ----------
    wavenumber : float, 1/L
        k0.
    factor : float
        Level of the error that rays state.
    shared : float, L
        Epsilon f_rms.
    unserved : float
        Share of the shadow line that launches no ray.
    """

    wavenumber: float
    factor: float
    shared: float
    unserved: float

    def applied(self, far: FarField) -> FarField:
        """A far field by rays with its error as the level has it."""
        factor = self.factor
        if far.total.ndim > 1 and factor > 1:
            factor *= far.wavenumber / self.wavenumber
        both = self.shared * (1.0 if self.unserved > 0 else self.wavenumber / far.wavenumber)
        return replace(
            far,
            error=np.hypot(factor * far.error, both),
            error_by="extrapolated",
            measured_at=self.wavenumber,
        )


def measured_level(fan: RayFan, wavenumber: float, boundary: BoundaryLike) -> Level | None:
    """The level at the highest affordable wavenumber below one, 1/L; None where there are no currents to compare with.

    It is kept with the fan.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> line = cr.shadow_line(ball, direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, length=3.0, n_rays=32)
    >>> level = measured_level(fan, 1e4, "soft")
    >>> 20 < level.wavenumber < 60, 0.2 <= level.factor < 2, level.shared < 1e-2
    (True, True, True)
    """
    # whatever the wavenumber, so that many have the comparison in common
    highest = 100 / size(fan.body)
    for _ in range(3):
        highest *= np.sqrt(NODES / max(expected_nodes(fan, highest), 1))
    k0 = min(wavenumber, float(highest))
    return kept(fan, f"level {boundary} {k0!r}", lambda: _measured(fan, k0, boundary))


def _measured(fan: RayFan, k0: float, boundary: BoundaryLike) -> Level | None:
    try:
        # what expansions lack there they lack at k as well
        currents = surface_currents(fan, wavenumber=k0, boundary=boundary, solve=False)
    except SurfaceError:
        return None
    r = fibonacci_directions(DIRECTIONS)
    geometry = far_geometry(fan, r)
    rays = field_of(geometry, k0, boundary, 2)
    off = np.abs(rays.total - currents.far(r))
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = (off / rays.error).reshape(-1)
    ratio = np.minimum(ratio[~np.isnan(ratio)], 1e9)
    shared = currents.extinction * currents.mean_amplitude
    if not len(ratio) or not np.isfinite(shared):
        return None
    factor = float(np.clip(np.quantile(ratio, 0.95), *LEVELS))
    return Level(k0, factor, float(shared), currents.unserved)
