"""The shadow line of an incidence: the closed curves n.d = 0 on the body, and what part of them launches rays.

Sources: Derivations, R6.

    F(x) = 0,   grad F(x).d = 0,   T = grad F x Hd / |.|,   kappa_n(d) = d.Hd/|grad F|

Seen from outside, the lit side (n.d < 0) is on the left of T. The steps are one module each: critical points of n.d,
where the line would cross itself (`singular`), its topology (`contour`), its points (`panels`), its state
(`visibility`).
"""

from dataclasses import dataclass, field

import numpy as np

from creeping._presenting import DrawnOnBody, brief
from creeping._typing import Any, ArrayLike, FloatArray
from creeping.errors import InvalidInputError
from creeping.geometry.directions import unit_direction
from creeping.geometry.surface import Surface, normal
from creeping.geometry.triangulation import triangulate
from creeping.shadow.critical_points import critical_points
from creeping.shadow.occlusion import incident_curvature, split_arcs
from creeping.shadow.panels import PanelCurve, newton_step
from creeping.shadow.refinement import shadow_curves
from creeping.shadow.status import STATUSES


@dataclass(frozen=True, eq=False, repr=False)
class ShadowCurve(DrawnOnBody):
    """One closed curve of the shadow line, at points equally spaced by arclength.

    Attributes
    ----------
    points : (n, 3), L
        The last is one spacing before the first.
    normals, tangents : (n, 3)
        n and T; seen from outside, the lit side is on the left of T.
    arclength : (n,), L
        From 0, growing along T.
    length : float, L
    status : (n,) of str
        "attached", "occluded" (the incident ray is stopped before) or "concave" (kappa_n(d) <= 0).
    curvature : (n,), 1/L
        kappa_n(d).
    arcs : tuple of (start, end, status)
        Arclengths at which the status changes; the end passes the length where an arc wraps.
    panels : PanelCurve
        The curve at any arclength.
    """

    points: FloatArray
    normals: FloatArray
    tangents: FloatArray
    arclength: FloatArray
    length: float
    status: np.ndarray[Any, np.dtype[np.str_]]
    curvature: FloatArray
    arcs: tuple[tuple[float, float, str], ...]
    panels: PanelCurve = field(repr=False)

    @property
    def fractions(self) -> dict[str, float]:
        """Share of the length with each status, from the arcs."""
        shares = dict.fromkeys(STATUSES, 0.0)
        for start, end, status in self.arcs:
            shares[status] += (end - start) / self.length
        return shares

    def at(self, arclength: ArrayLike) -> FloatArray:
        """Points of the curve, exact at any arclength modulo the length: (m,) -> (m, 3), L."""
        s = np.asarray(arclength, dtype=float)
        if s.ndim > 1 or not np.all(np.isfinite(s)):
            raise InvalidInputError(
                f"arclength of shape {s.shape} is not one finite number or a row of them; give (m,)"
            )
        return self.panels.at(s.ravel()).reshape(*s.shape, 3)

    def __repr__(self) -> str:
        n_dot_d = np.abs(self.normals @ self.panels.direction)
        return (
            f"ShadowCurve({len(self.points)} points, length {self.length:.10g} L)\n"
            f"  {_spelled(self.fractions)}; {_count(len(self.arcs), 'arc')}\n"
            f"  |n.d| at most {np.max(n_dot_d):.1e}; "
            f"kappa_n(d) from {np.min(self.curvature):.3g} to {np.max(self.curvature):.3g} 1/L"
        )


@dataclass(frozen=True, eq=False, repr=False)
class ShadowLine(DrawnOnBody):
    """Shadow line of one incidence.

    Attributes
    ----------
    body : Surface
    direction : (3,)
        Unit vector, where the wave travels.
    curves : tuple of ShadowCurve
        Longest first.
    singular_distance : float
        Least |n.d| at critical points of n.d on the body apart from n = +-d, inf if there are none; also, to first
        order, the angle from d to the next direction whose shadow line crosses itself.
    """

    body: Surface
    direction: FloatArray
    curves: tuple[ShadowCurve, ...]
    singular_distance: float

    @property
    def length(self) -> float:
        """Length of all curves, L."""
        return float(sum(curve.length for curve in self.curves))

    @property
    def fractions(self) -> dict[str, float]:
        """Share of the whole length with each status."""
        length = self.length or 1.0
        return {
            status: sum(curve.fractions[status] * curve.length for curve in self.curves) / length for status in STATUSES
        }

    def __repr__(self) -> str:
        worst = max((float(np.max(np.abs(curve.normals @ self.direction))) for curve in self.curves), default=0.0)
        direction = ", ".join(f"{d:.4g}" for d in self.direction)
        points = sum(len(curve.points) for curve in self.curves)
        return (
            f"ShadowLine({_count(len(self.curves), 'curve')}, {points} points, length {self.length:.10g} L, "
            f"direction ({direction}))\n"
            f"  {_spelled(self.fractions)}; on {brief(self.body)}\n"
            f"  |n.d| at most {worst:.1e}; singular distance {self.singular_distance:.3g}"
        )


def shadow_line(body: Surface, direction: ArrayLike, *, n_points: int = 512) -> ShadowLine:
    """Find the shadow line of an incidence and classify it.

    Parameters
    ----------
    body : Surface
        Only ``level``, ``gradient``, ``hessian`` and ``bounds`` are used.
    direction : (3,)
        Where the wave travels; need not be unit.
    n_points : int
        Points on each curve, at least 16; lengths and arcs do not depend on it.

    Returns
    -------
    ShadowLine

    Raises
    ------
    InvalidInputError
        If the direction or n_points is not usable.
    SurfaceError
        If F = 0 has no closed triangulation in its bounds.
    SingularIncidenceError
        If the line crosses itself, or so nearly that its curves cannot be told apart.
    """
    d = unit_direction(direction)
    if isinstance(n_points, bool) or not isinstance(n_points, (int, np.integer)) or n_points < 16:
        raise InvalidInputError(f"n_points = {n_points!r} is not a whole number >= 16")
    mesh = triangulate(body.level, body.gradient, body.bounds)
    critical = critical_points(body, d, mesh)
    critical.refuse()
    curves = [_sampled(panels, int(n_points)) for panels in shadow_curves(body, d, mesh, critical)]
    curves.sort(key=lambda curve: -curve.length)
    return ShadowLine(body, d, tuple(curves), critical.distance)


def _spelled(fractions: dict[str, float]) -> str:
    return ", ".join(f"{share:.4g} {status}" for status, share in fractions.items() if share) or "nothing"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"


def _sampled(panels: PanelCurve, n_points: int) -> ShadowCurve:
    body, direction, length = panels.body, panels.direction, panels.length
    arclength = np.linspace(0.0, length, n_points, endpoint=False, dtype=np.float64)
    points = panels.at(arclength)
    _, tangents = newton_step(body, direction, points)
    arcs = split_arcs(panels)
    return ShadowCurve(
        points=points,
        normals=normal(body, points),
        tangents=tangents,
        arclength=arclength,
        length=length,
        status=np.array(STATUSES)[arcs.of(arclength)],
        curvature=incident_curvature(body, points, direction),
        arcs=arcs.listed(),
        panels=panels,
    )
