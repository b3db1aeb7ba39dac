"""One curve of a shadow line: its points, what of it launches rays, and any place of it.

Sources: Derivations, R6.
"""

# help() shows names of types instead of what they stand for
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from creeping._presenting import DrawnOnBody
from creeping._typing import Any, ArrayLike, FloatArray, IntArray
from creeping.errors import InvalidInputError
from creeping.geometry.checks import unit_of
from creeping.geometry.incident import REMEDY, headings, spherical
from creeping.geometry.surface import Surface
from creeping.shadow.curves import LineNodes, interpolated, polished
from creeping.shadow.panels import PanelCurve
from creeping.shadow.status import STATUSES, PointState


@dataclass(frozen=True, eq=False, repr=False)
class ShadowCurve(DrawnOnBody):
    """One curve of the shadow line, at points equally spaced by arclength; open only on a body with creases.

    Attributes
    ----------
    body : Surface
    wave : (3,) or (4,)
        d of a plane wave, or the row (d, w) of `creeping.geometry.incident`.
    points : (n, 3), L
        On a closed curve the last point is one spacing before the first; on an open curve both are the ends.
    normals, tangents : (n, 3)
        n and T; seen from outside, the lit side is on the left of T.
    arclength : (n,), L
        From 0, growing along T.
    length : float, L
    error : float
        Estimated relative error of the length and of positions along the curve.
    status : (n,) of str
        "attached", "occluded" (the body blocks the incident ray before this point) or "concave" (kappa_n <= 0 along the
        wave).
    curvature : (n,), 1/L
        kappa_n along the wave.
    arcs : tuple of (start, end, status)
        Arclengths at which the status changes; the end exceeds the length if the arc wraps around.
    nodes : (k, 3), L
        Equally spaced points from which the curve is interpolated.
    closed : bool
    piece : int
        Number of the piece on which the curve lies; -1 on a smooth body.
    panels : PanelCurve or None
        The curve exact to rounding: on a piece, and where it turns so fast that its nodes are too far apart.
    """

    body: Surface
    wave: FloatArray
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
    closed: bool = True
    piece: int = -1
    panels: PanelCurve | None = None

    @property
    def direction(self) -> FloatArray:
        """Unit vector (3,) of a plane wave."""
        if spherical(self.wave):
            raise InvalidInputError(f"this curve has no one direction: it is of {REMEDY}")
        return np.asarray(self.wave[:3])

    @property
    def grazing(self) -> FloatArray:
        """n.p at the points (n,), p the unit vector along which the wave travels: 0 to rounding."""
        return np.asarray(np.sum(self.normals * headings(self.wave, self.points), axis=1))

    @property
    def fractions(self) -> dict[str, float]:
        """Share of the length with each status, from the arcs."""
        shares = dict.fromkeys(STATUSES, 0.0)
        for start, end, status in self.arcs:
            shares[status] += (end - start) / self.length
        return shares

    def state_at(self, arclength: FloatArray) -> IntArray:
        """Codes of the status at arclengths modulo the length, of an open curve no further than its ends: (m,)."""
        # rounding may leave a place between two arcs: then it is of neither side, and concave launches nothing
        codes = np.full(len(arclength), PointState.CONCAVE)
        s = arclength if self.closed else np.clip(arclength, 0.0, np.nextafter(self.length, 0.0))
        for start, end, status in self.arcs:
            codes[np.mod(s - start, self.length) < end - start] = STATUSES.index(status)
        return codes

    def at(self, arclength: ArrayLike) -> FloatArray:
        """Points of the curve at any arclength modulo the length: (m,) -> (m, 3), L.

        Of an open curve no further than its ends. On the line to rounding, along it as exact as the length.
        """
        s = np.asarray(arclength, dtype=float)
        if s.ndim > 1 or not np.all(np.isfinite(s)):
            raise InvalidInputError(
                f"arclength of shape {s.shape} is not one finite number or a row of them; give (m,)"
            )
        if self.panels is not None:
            return self.panels.at(s.ravel()).reshape(*s.shape, 3)
        points = interpolated(self.nodes, 0, len(self.nodes), s.ravel() / self.length * len(self.nodes))
        return polished(self.body, self.wave, points)[0].reshape(*s.shape, 3)

    def __repr__(self) -> str:
        unit = unit_of(self.body)
        return (
            f"ShadowCurve({len(self.points)} points, length {self.length:.10g} {unit})\n"
            f"  {spelled(self.fractions)}; {counted(len(self.arcs), 'arc')}\n"
            f"  |n.d| at most {np.max(np.abs(self.grazing)):.1e}; "
            f"kappa_n(d) from {np.min(self.curvature):.3g} to {np.max(self.curvature):.3g} 1/{unit}"
        )


def nodes_of(curves: Sequence[ShadowCurve]) -> LineNodes:
    """Curves as the nodes of a line of their own."""
    found = [(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))]
    for curve in curves:
        x = curve.nodes
        there = (x, curve.tangents, curve.curvature) if curve.piece >= 0 else polished(curve.body, curve.wave, x)
        found.append(there)
    points, tangents, curvature = (np.concatenate(of) for of in zip(*found, strict=True))
    starts = np.cumsum([len(of[0]) for of in found], dtype=np.int64)
    spacing = np.array([curve.length / len(curve.nodes) for curve in curves], dtype=float)
    return LineNodes(points, tangents, curvature, starts, spacing, max((curve.error for curve in curves), default=0.0))


def spelled(fractions: dict[str, float]) -> str:
    """Shares in words."""
    return ", ".join(f"{share:.4g} {status}" for status, share in fractions.items() if share) or "nothing"


def counted(number: int, noun: str) -> str:
    """Text such as "3 rays"."""
    return f"{number} {noun}{'s' * (number != 1)}"
