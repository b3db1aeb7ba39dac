"""The currents of the whole body of a fan: nodes for its lit side and its rays, and each boundary's waves on them.

Sources: Derivations, F16 to F18.
"""

import numpy as np

from creeping._typing import Any, FloatArray
from creeping.errors import InvalidInputError, SurfaceError
from creeping.field.arguments import checked, checked_plain
from creeping.field.boundary import CONDUCTOR, Boundary, BoundaryLike, scalar_boundaries
from creeping.field.currents.bounce import faces_itself
from creeping.field.currents.conductor import ConductorCurrents, conductor_waves
from creeping.field.currents.nodes import LitNodes, lit_nodes, ray_nodes
from creeping.field.currents.waves import lit_waves, ray_waves
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.field.currents.whole_solution import (
    ASKED,
    MOST,
    pairs_of,
    solved_on_whole_body,
    too_many,
    why_not,
)
from creeping.geometry.arguments import one_of
from creeping.geometry.creased import is_creased
from creeping.geometry.surface import size
from creeping.rays.fan import RayFan
from creeping.shadow.line import ShadowLine

CUT = 1e-3
"""Share of the shadow line without rays from which lit ground is not that of a convex body."""
POOR = 0.02
"""What currents leave of the incident wave inside from which the equation of any body is solved."""


def surface_currents(
    fan: RayFan, *, wavenumber: float, boundary: BoundaryLike = "soft", solve: bool | None = None
) -> SurfaceCurrents:
    """Currents of the whole body of a fan, by expansions, or its integral equation solved from these.

    Parameters
    ----------
    fan : RayFan
        Its flow and its line are used; rays are as long and as dense as the wavenumber asks for.
    wavenumber : float, 1/L
    boundary : "soft", "hard", "pec" or ImpedanceBoundary
    solve : bool, optional
        Whether the equation is solved. By default it is where expansions are known to fail, on a body that may reflect
        onto itself, hides part of its shadow line or has an admittance that steps, or where they leave more than 2 % of
        the incident wave inside or cannot be judged, or where there are none, as on a conductor with joints, and it
        costs less than about 20 seconds (half a minute of a conductor). True is for as much as one minute, three of a
        conductor.

    Returns
    -------
    SurfaceCurrents

    Raises
    ------
    InvalidInputError
        On a bad wavenumber or boundary, for a weighted body or one with edges, for a conductor with joints where the
        equation is not solved, and if ``solve`` is asked of a body that is rough or needs too many nodes.
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
    checked_plain(fan.body, edgeless="" if solve else "the method of currents")
    k = checked(wavenumber, 2)
    most = ASKED if solve else MOST
    refused = why_not(fan.body, k) or (too_many(fan.body, k, most) if solve else "")
    possible = not refused if solve else solve is None and pairs_of(fan.body, k) > 0
    if solve and refused:
        raise InvalidInputError(
            f"the integral equation is not solved at wavenumber {k:g}: {refused}; without solve=True "
            'or method="equation" expansions or rays serve'
        )
    if len(kinds) == 2 and is_creased(fan.body):
        if not possible:
            remedy = f"{refused}; far_field has rays" if refused else 'give solve=True or method="equation"'
            raise InvalidInputError(
                "a conductor with joints has no current but that of its integral equation, not solved at wavenumber "
                f"{k:g}: {remedy}"
            )
        return solved_on_whole_body(_no_currents(fan, k, CONDUCTOR), most)
    lit = lit_nodes(fan.body, fan.line, k)
    try:
        currents, facing = _expanded(fan, lit, k, kinds), faces_itself(lit)
    except SurfaceError:
        # along the axis of a capsule rays start on a joint
        if not possible or too_many(fan.body, k, most):
            raise
        return solved_on_whole_body(_no_currents(fan, k, CONDUCTOR if len(kinds) == 2 else kinds[0]), most)
    poor = facing or currents.unserved > CUT or currents.stepped > 0
    wanted = possible and (solve or poor or not currents.extinction <= POOR)
    if wanted and not too_many(fan.body, k, most):
        return solved_on_whole_body(currents, most)
    if facing and currents.boundary.kind in ("soft", "hard", "conductor"):
        currents.values[currents.lit] += currents.thrown(lit.points, lit.normals)
    return currents


def _expanded(fan: RayFan, lit: LitNodes, k: float, kinds: tuple[Boundary, ...]) -> SurfaceCurrents:
    """Currents by the expansion at nodes of the lit side and on creeping rays."""
    # a conductor's rays are as long as its wave that decays less
    shadow = ray_nodes(fan, k, kinds[-1])
    if len(kinds) == 2:
        kind = CONDUCTOR
        shadow = shadow[shadow.rays.alive]
        values, first = (conductor_waves(lit, shadow, fan.line.direction, k, order) for order in (2, 1))
        change = values - first
    else:
        kind = kinds[0]
        bright, first = lit_waves(lit, fan.line.direction, size(fan.body), k, kind)
        dark, second = ray_waves(shadow, k, kind)
        values, change = np.concatenate([bright, dark]), np.concatenate([bright - first, second])
    return _currents(
        fan,
        k,
        kind,
        points=np.concatenate([lit.points, shadow.rays.points]),
        normals=np.concatenate([lit.normals, shadow.normals]),
        weights=np.concatenate([lit.weights, shadow.weights]),
        travel=np.concatenate([np.broadcast_to(fan.line.direction, lit.points.shape), shadow.rays.directions]),
        values=values,
        change=change,
        lit=np.arange(len(values)) < len(lit.points),
    )


def _no_currents(fan: RayFan, k: float, kind: Boundary) -> SurfaceCurrents:
    """Currents of which nothing is known: at no node."""
    nowhere = np.zeros((0, 3))
    nothing = np.zeros((0, 3, 2) if kind.kind == "conductor" else 0, dtype=complex)
    return _currents(
        fan,
        k,
        kind,
        points=nowhere,
        normals=nowhere,
        weights=np.zeros(0),
        travel=nowhere,
        values=nothing,
        change=nothing,
        lit=np.zeros(0, dtype=bool),
    )


def _currents(fan: RayFan, k: float, kind: Boundary, **at_nodes: Any) -> SurfaceCurrents:
    """Currents of the wave of a fan, with what is given of them at nodes."""
    make = ConductorCurrents if kind.kind == "conductor" else SurfaceCurrents
    return make(
        body=fan.body,
        direction=fan.line.direction,
        rim=_rim(fan.line, k),
        rim_length=fan.line.length,
        unserved=1.0 - float(fan.line.fractions["attached"]),
        wavenumber=k,
        boundary=kind,
        **at_nodes,
    )


def _rim(line: ShadowLine, wavenumber: float) -> FloatArray:
    """Points of a shadow line (l, 3), an eighth of a wavelength apart on all its curves."""
    apart = np.pi / (4 * wavenumber)
    parts = []
    for curve in line.curves:
        count = max(64, int(np.ceil(curve.length / apart)))
        parts.append(curve.at(curve.length * (np.arange(count) + 0.5) / count))
    return np.concatenate(parts)
