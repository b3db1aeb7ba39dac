"""The currents of the whole body of a fan: nodes for its lit side and its rays, and each boundary's waves on them.

Sources: Derivations, F16 to F18.
"""

import numpy as np

from creeping._typing import FloatArray
from creeping.field.arguments import checked, checked_plain
from creeping.field.boundary import CONDUCTOR, BoundaryLike, scalar_boundaries
from creeping.field.currents.bounce import faces_itself
from creeping.field.currents.conductor import ConductorCurrents, conductor_waves
from creeping.field.currents.lit_solution import solvable, solved_on_lit_ground
from creeping.field.currents.nodes import lit_nodes, ray_nodes
from creeping.field.currents.waves import lit_waves, ray_waves
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.geometry.arguments import one_of
from creeping.geometry.surface import size
from creeping.rays.fan import RayFan
from creeping.shadow.line import ShadowLine

CUT = 1e-3
"""Share of the shadow line without rays from which lit ground is not that of a convex body."""


def surface_currents(fan: RayFan, *, wavenumber: float, boundary: BoundaryLike = "soft") -> SurfaceCurrents:
    """Currents of the whole body of a fan.

    Parameters
    ----------
    fan : RayFan
        Its flow and its line are used; rays are as long and as dense as the wavenumber asks for.
    wavenumber : float, 1/L
    boundary : "soft", "hard", "pec" or ImpedanceBoundary

    Returns
    -------
    SurfaceCurrents

    Raises
    ------
    InvalidInputError
        On a bad wavenumber or boundary, and for a weighted body.
    SurfaceError
        If the wavenumber is too high for any mesh of the body.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> ball = sc.Sphere()
    >>> line = cr.shadow_line(ball, direction=(0, 0, 1))
    >>> fan = cr.launch(cr.DirectFlow(ball, rtol=1e-8), line, length=3.0, n_rays=16)
    >>> currents = cr.surface_currents(fan, wavenumber=12.0, boundary="hard")
    >>> currents.extinction < 0.02, bool(currents.error([(0, 1, 0)])[0] < 0.05)
    (True, True)
    """
    one_of(fan, "fan", RayFan, "creeping.launch")
    kinds = scalar_boundaries(boundary)
    checked_plain(
        fan.body, smooth="the current of a conductor" if len(kinds) == 2 else "", edgeless="the method of currents"
    )
    k = checked(wavenumber, 2)
    # a conductor's rays are as long as its wave that decays less
    lit, shadow = lit_nodes(fan.body, fan.line, k), ray_nodes(fan, k, kinds[-1])
    make: type[SurfaceCurrents]
    if len(kinds) == 2:
        make, kind = ConductorCurrents, CONDUCTOR
        shadow = shadow[shadow.rays.alive]
        values, first = (conductor_waves(lit, shadow, fan.line.direction, k, order) for order in (2, 1))
        change = values - first
    else:
        make, kind = SurfaceCurrents, kinds[0]
        bright, first = lit_waves(lit, fan.line.direction, size(fan.body), k, kind)
        dark, second = ray_waves(shadow, k, kind)
        values, change = np.concatenate([bright, dark]), np.concatenate([bright - first, second])
    currents = make(
        body=fan.body,
        direction=fan.line.direction,
        points=np.concatenate([lit.points, shadow.rays.points]),
        normals=np.concatenate([lit.normals, shadow.normals]),
        weights=np.concatenate([lit.weights, shadow.weights]),
        travel=np.concatenate([np.broadcast_to(fan.line.direction, lit.points.shape), shadow.rays.directions]),
        values=values,
        change=change,
        lit=np.arange(len(values)) < len(lit.points),
        rim=_rim(fan.line, k),
        rim_length=fan.line.length,
        unserved=1.0 - float(fan.line.fractions["attached"]),
        wavenumber=k,
        boundary=kind,
    )
    facing = faces_itself(lit)
    if (facing or currents.unserved > CUT) and solvable(currents):
        return solved_on_lit_ground(currents)
    if facing and kind.kind in ("soft", "hard", "conductor"):
        values[currents.lit] += currents.thrown(lit.points, lit.normals)
    return currents


def _rim(line: ShadowLine, wavenumber: float) -> FloatArray:
    """Points of a shadow line (l, 3), an eighth of a wavelength apart on all its curves."""
    apart = np.pi / (4 * wavenumber)
    parts = []
    for curve in line.curves:
        count = max(64, int(np.ceil(curve.length / apart)))
        parts.append(curve.at(curve.length * (np.arange(count) + 0.5) / count))
    return np.concatenate(parts)
