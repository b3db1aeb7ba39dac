"""The shadow line of an incidence: the closed curves n.d = 0 on the body, and what part of them launches rays.

Sources: Derivations, R6.

    F(x) = 0,   grad F(x).d = 0,   T = grad F x Hd / |.|,   kappa_n(d) = d.Hd/|grad F|

Seen from outside, the lit side (n.d < 0) is on the left of T. The line is that of `creeping.shadow.many`, the same to
the last bit; next to a singular direction, where that cannot be certain, its topology is proven (`following`).
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from creeping._presenting import DrawnOnBody, brief
from creeping._typing import Any, ArrayLike, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.geometry.arguments import checked_body, whole_number
from creeping.geometry.directions import unit_direction
from creeping.geometry.surface import Surface, normal
from creeping.shadow.attachment import Arc, LaunchPoints
from creeping.shadow.following import followed
from creeping.shadow.nodes import Finished, LineNodes, finished, line_nodes, polished
from creeping.shadow.panels import PanelCurve, fit_panels
from creeping.shadow.status import CONCAVE, NEAR_SINGULAR, STATUSES
from creeping.storage.memory import within_budget

HALF = 6
"""Nodes on either side that a polynomial along a curve goes through."""


@dataclass(frozen=True, eq=False, repr=False)
class ShadowCurve(DrawnOnBody):
    """One closed curve of the shadow line, at points equally spaced by arclength.

    Attributes
    ----------
    body, direction : Surface, (3,)
    points : (n, 3), L
        The last is one spacing before the first.
    normals, tangents : (n, 3)
        n and T; seen from outside, the lit side is on the left of T.
    arclength : (n,), L
        From 0, growing along T.
    length : float, L
    error : float
        Estimated relative error of the length, and so of places along the curve.
    status : (n,) of str
        "attached", "occluded" (the incident ray is stopped before) or "concave" (kappa_n(d) <= 0).
    curvature : (n,), 1/L
        kappa_n(d).
    arcs : tuple of (start, end, status)
        Arclengths at which the status changes; the end passes the length where an arc wraps.
    nodes : (k, 3), L
        Equally spaced points that the curve was found by.
    """

    body: Surface
    direction: FloatArray
    points: FloatArray
    normals: FloatArray
    tangents: FloatArray
    arclength: FloatArray
    length: float
    error: float
    status: np.ndarray[Any, np.dtype[np.str_]]
    curvature: FloatArray
    arcs: tuple[tuple[float, float, str], ...]
    nodes: FloatArray

    @property
    def fractions(self) -> dict[str, float]:
        """Share of the length with each status, from the arcs."""
        shares = dict.fromkeys(STATUSES, 0.0)
        for start, end, status in self.arcs:
            shares[status] += (end - start) / self.length
        return shares

    @cached_property
    def panels(self) -> PanelCurve:
        """The curve in panels that are exact to rounding, fitted when first asked for."""
        spacing = np.full(len(self.nodes), self.length / len(self.nodes))
        return fit_panels(self.body, self.direction, self.nodes, spacing)

    def line_nodes(self) -> LineNodes:
        """The curve as the nodes of a line of its own."""
        x, tangents, curvature = polished(self.body, self.direction, self.nodes)
        spacing = np.array([self.length / len(x)])
        columns = np.ascontiguousarray(x.T), np.ascontiguousarray(tangents.T)
        return LineNodes(*columns, curvature, np.array([0, len(x)]), spacing, self.error)

    def state_at(self, arclength: FloatArray) -> IntArray:
        """Codes of the status at arclengths modulo the length: (m,)."""
        # rounding may leave a place between two arcs: then it is of neither side, and concave launches nothing
        codes = np.full(len(arclength), CONCAVE)
        for start, end, status in self.arcs:
            codes[np.mod(arclength - start, self.length) < end - start] = STATUSES.index(status)
        return codes

    def at(self, arclength: ArrayLike) -> FloatArray:
        """Points of the curve at any arclength modulo the length: (m,) -> (m, 3), L.

        On the line to rounding, along it as exact as the length.
        """
        s = np.asarray(arclength, dtype=float)
        if s.ndim > 1 or not np.all(np.isfinite(s)):
            raise InvalidInputError(
                f"arclength of shape {s.shape} is not one finite number or a row of them; give (m,)"
            )
        if "panels" in vars(self):
            return self.panels.at(s.ravel()).reshape(*s.shape, 3)
        points = interpolated(self.nodes, s.ravel() / self.length * len(self.nodes))
        return polished(self.body, self.direction, points)[0].reshape(*s.shape, 3)

    def __repr__(self) -> str:
        n_dot_d = np.abs(self.normals @ self.direction)
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
    nodes : LineNodes
        What the line was found by.

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> line = cr.shadow_line(sc.Sphere(radius=0.5), direction=(1, 1, 1))
    >>> round(line.length, 6), len(line.curves), round(line.fractions["attached"], 6)
    (3.141593, 1, 1.0)
    """

    body: Surface
    direction: FloatArray
    curves: tuple[ShadowCurve, ...]
    singular_distance: float
    nodes: LineNodes

    @property
    def length(self) -> float:
        """Length of all curves, L."""
        return self.nodes.length

    @property
    def fractions(self) -> dict[str, float]:
        """Share of the whole length with each status."""
        length = sum(curve.length for curve in self.curves) or 1.0
        return {
            status: sum(curve.fractions[status] * curve.length for curve in self.curves) / length for status in STATUSES
        }

    def arcs(self, launch_from: str = "attached") -> list[Arc]:
        """Arcs that launch rays: the attached ones, or with "all" each whole curve."""
        checked_launch_from(launch_from)
        if launch_from == "all":
            return [Arc(number, 0.0, curve.length, True) for number, curve in enumerate(self.curves)]
        return [
            Arc(number, start, end, len(curve.arcs) == 1)
            for number, curve in enumerate(self.curves)
            for start, end, status in curve.arcs
            if status == "attached"
        ]

    def launch_points(self, n_rays: int, launch_from: str = "attached") -> LaunchPoints:
        """So many launch points on the arcs, as `shadow_lines` gives them: n is 1."""
        checked_launch_from(launch_from)
        n_rays = whole_number(n_rays, "n_rays", 0)
        within_budget(400.0 * n_rays, f"{n_rays} rays", "ask for fewer")
        found = finished(self.body, self.direction, self.nodes, n_rays, every=launch_from == "all")
        return LaunchPoints.unpacked(self.direction[None], found.launched[None], found.places[None])

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


def checked_launch_from(launch_from: str) -> None:
    """Refuse what names no points of a line.

    Raises
    ------
    InvalidInputError
    """
    if not isinstance(launch_from, str) or launch_from not in ("attached", "all"):
        raise InvalidInputError(f"launch_from = {launch_from!r} is neither 'attached' nor 'all'")


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

    Examples
    --------
    >>> import creeping as cr
    >>> import scatterers as sc
    >>> line = cr.shadow_line(sc.Torus(), direction=(0, 0, 1))
    >>> [round(curve.length, 6) for curve in line.curves]          # outer and inner equator
    [9.424778, 3.141593]
    """
    checked_body(body)
    d = unit_direction(direction)
    n_points = whole_number(n_points, "n_points", 16)
    within_budget(150.0 * n_points, f"{n_points} points of the shadow line", "ask for fewer")
    nodes, code, distance = line_nodes(body, d)
    panels: tuple[PanelCurve, ...] = ()
    if nodes is None or code == NEAR_SINGULAR:
        exact, panels, distance = followed(body, d)
        if nodes is not None and len(nodes.spacing) == len(panels):
            # the meshes had the right number of curves: the line is theirs, as in a sweep
            exact, panels = nodes, ()
        nodes = exact
    found = finished(body, d, nodes, 0)
    curves = [_curve(body, d, nodes, found, k, n_points) for k in range(len(nodes.spacing))]
    for curve, exact_curve in zip(curves, panels, strict=False):
        # the nodes of a line that turns this fast are too far apart to go through
        vars(curve)["panels"] = exact_curve
    return ShadowLine(body, d, tuple(curves), distance, nodes)


def interpolated(nodes: FloatArray, places: FloatArray) -> FloatArray:
    """Points of a closed curve at numbers of nodes with fractions, by polynomials: (k, 3), (m,) -> (m, 3)."""
    first = np.floor(places).astype(np.int64)
    offsets = np.arange(1 - HALF, HALF + 1)
    u = (places - first)[:, None] - offsets
    before, after = np.ones_like(u), np.ones_like(u)
    before[:, 1:] = np.cumprod(u[:, :-1], axis=1)
    after[:, :-1] = np.cumprod(u[:, :0:-1], axis=1)[:, ::-1]
    scale = np.array([np.prod([j - i for i in offsets if i != j], dtype=float) for j in offsets])
    weights = before * after / scale
    return np.asarray(np.einsum("mj,mjc->mc", weights, nodes[(first[:, None] + offsets) % len(nodes)]))


def _spelled(fractions: dict[str, float]) -> str:
    return ", ".join(f"{share:.4g} {status}" for status, share in fractions.items() if share) or "nothing"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"


def _curve(
    body: Surface, direction: FloatArray, nodes: LineNodes, found: Finished, number: int, n_points: int
) -> ShadowCurve:
    first, last = nodes.starts[number : number + 2]
    own = np.ascontiguousarray(nodes.points[:, first:last].T)
    spacing = float(nodes.spacing[number])
    length = spacing * len(own)
    arclength = np.linspace(0.0, length, n_points, endpoint=False, dtype=np.float64)
    points, tangents, curvature = polished(body, direction, interpolated(own, arclength / spacing))
    mine = found.curve == number
    ends, codes = spacing * found.arcs[mine], found.state[mine]
    ends -= length * np.floor(ends[:, :1] / length)
    order = np.argsort(ends[:, 0])
    ends, codes = ends[order], codes[order]
    # the arc before the first start is the last one, which comes round
    place = np.searchsorted(ends[:, 0], arclength, side="right") - 1
    return ShadowCurve(
        body=body,
        direction=direction,
        points=points,
        normals=normal(body, points),
        tangents=tangents,
        arclength=arclength,
        length=length,
        error=nodes.error,
        status=np.array(STATUSES)[codes[place]],
        curvature=curvature,
        arcs=tuple((start, end, STATUSES[code]) for (start, end), code in zip(ends.tolist(), codes, strict=True)),
        nodes=own,
    )
