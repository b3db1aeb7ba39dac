"""Currents of the whole body of a fan: by expansions, or by the body's integral equation where these do not serve.

Expansions: nodes of the lit side and of creeping rays (`creeping.field.currents.nodes`), each boundary's waves on them.
The equation: `creeping.field.equation.solving`. Currents are kept with the fan.

Sources: Derivations, F16 to F18 and F36.
"""

from dataclasses import replace

import numpy as np

from creeping.errors import InvalidInputError, SurfaceError
from creeping.field.arguments import checked, checked_plain
from creeping.field.boundary import CONDUCTOR, Boundary, BoundaryLike, scalar_boundaries
from creeping.field.currents.conductor import ConductorCurrents, conductor_waves
from creeping.field.currents.nodes import LitNodes, lit_nodes, lit_waves, ray_nodes, ray_waves
from creeping.field.currents.radiation import self_reflects
from creeping.field.currents.whole_body import SurfaceCurrents
from creeping.field.equation import solving
from creeping.field.equation.solving import Solved, asked_solution, solution_for
from creeping.geometry.arguments import one_of
from creeping.geometry.piecewise import has_edges, is_piecewise
from creeping.geometry.surface import Surface, memo_of, size
from creeping.rays.fan import RayFan

CUT = 1e-3
"""Share of the shadow line without rays from which the lit side is not that of a convex body."""


def surface_currents(
    fan: RayFan, *, wavenumber: float, boundary: BoundaryLike = "soft", solve: bool | None = None
) -> SurfaceCurrents:
    """Currents on the whole body for the incidence of a fan, by expansions or from the integral equation.

    Parameters
    ----------
    fan : RayFan
        Only the flow and the shadow line are used. New rays are launched, as long and dense as the wavenumber requires.
    wavenumber : float, 1/L
    boundary : "soft", "hard", "pec" or ImpedanceBoundary
    solve : bool, optional
        Whether to solve the integral equation, as `creeping.solve` does. By default it is solved if that takes less
        than about 30 seconds and expansions fail or are doubtful: the body has edges, joints or tips, may reflect onto
        itself, or hides part of its shadow line; the admittance has steps; or the residual field inside the body
        exceeds 1 % of the incident wave or cannot be measured. True allows up to 300 seconds.

    Returns
    -------
    SurfaceCurrents

    Raises
    ------
    InvalidInputError
        On a bad wavenumber or boundary, for a weighted body, for a body without expansions whose equation is not
        solved, or if ``solve`` is True and the body needs too many nodes.
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
    checked_plain(fan.body)
    k = checked(wavenumber, 2, fan.body)
    problem = fan.body, fan.line.direction, k, boundary
    if solve:
        return _of_line(fan, asked_solution(*problem))
    # expansions know little of joints and tips, and nothing of edges
    found = solution_of_pieces(fan, k, boundary) if solve is None else None
    if found:
        return _of_line(fan, found)
    if not has_expansions(fan.body, boundary):
        raise InvalidInputError(
            "currents of a body with edges, or of a conductor with joints, need the integral equation, which is not "
            f'solved at wavenumber {k:g}: give solve=True or method="equation", or use far_field with method="rays"'
        )
    lit = lit_nodes(fan.body, fan.line, k)
    try:
        currents, facing = _expanded(fan, lit, k, kinds), self_reflects(lit)
    except SurfaceError:
        # along the axis of a capsule rays start on a joint
        found = solution_for(*problem) if solve is None else None
        if not found:
            raise
        return _of_line(fan, found)
    # next to the body currents err by ten times what they leave inside
    poor = facing or currents.unserved > CUT or currents.stepped > 0 or not currents.extinction <= 0.01
    found = solution_for(*problem) if solve is None and poor else None
    # both are measured the same way; what expansions leave is not known where the body is too thin for points inside
    if found and not found.currents.extinction > currents.extinction:
        return _of_line(fan, found)
    if facing and currents.bounces:
        currents.values[currents.lit] += currents.reflected_onto(lit.points, lit.normals)
    return currents


def solution_of_pieces(fan: RayFan, wavenumber: float, boundary: BoundaryLike) -> Solved | None:
    """The equation's solution for a body of pieces, unless it is poor and expansions are there to compare it with."""
    found = solution_for(fan.body, fan.line.direction, wavenumber, boundary) if is_piecewise(fan.body) else None
    if found and found.currents.extinction > solving.POOR and has_expansions(fan.body, boundary):
        return None
    return found


def _of_line(fan: RayFan, solved: Solved) -> SurfaceCurrents:
    """Solved currents that tell which share of the fan's line launches no ray."""
    currents: SurfaceCurrents = replace(solved.currents, unserved=_unserved(fan))
    return currents


def _unserved(fan: RayFan) -> float:
    return 1.0 - float(fan.line.fractions["attached"])


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
    # an eighth of a wavelength apart on all curves of the line
    counts = [max(64, int(np.ceil(4 * curve.length * k / np.pi))) for curve in fan.line.curves]
    pairs = zip(fan.line.curves, counts, strict=True)
    rim = [curve.at(curve.length * (np.arange(count) + 0.5) / count) for curve, count in pairs]
    make = ConductorCurrents if kind.kind == "conductor" else SurfaceCurrents
    return make(
        body=fan.body,
        direction=fan.line.direction,
        points=np.concatenate([lit.points, shadow.rays.points]),
        normals=np.concatenate([lit.normals, shadow.normals]),
        weights=np.concatenate([lit.weights, shadow.weights]),
        travel=np.concatenate([np.broadcast_to(fan.line.direction, lit.points.shape), shadow.rays.directions]),
        values=values,
        change=change,
        lit=np.arange(len(values)) < len(lit.points),
        rim=np.concatenate(rim),
        rim_length=fan.line.length,
        unserved=_unserved(fan),
        wavenumber=k,
        boundary=kind,
    )


def cached_currents(
    fan: RayFan, wavenumber: float, boundary: BoundaryLike, *, solve: bool | None = None
) -> SurfaceCurrents:
    """Currents of the whole body, cached for the last wavenumbers and boundaries.

    Raises
    ------
    InvalidInputError, SurfaceError
        As `surface_currents`.
    """

    def make() -> SurfaceCurrents:
        return surface_currents(fan, wavenumber=wavenumber, boundary=boundary, solve=solve)

    return memo_of(fan, "currents", (wavenumber, boundary, solve), make, 2)


def has_expansions(body: Surface, boundary: BoundaryLike) -> bool:
    """Whether there are expansions of currents on all of a body: not round edges, nor across joints of a conductor."""
    return not has_edges(body) and not (boundary == "pec" and is_piecewise(body))
