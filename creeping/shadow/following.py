"""A shadow line followed by itself: critical points of n.q, a mesh refined until the signs decide, panels to rounding.

The last resort, some tenths of a second a line; what comes out is a `LineNodes` like any other.

Sources: Derivations, R9.
"""

import numpy as np

from creeping._typing import FloatArray
from creeping.geometry.incident import headings
from creeping.geometry.surface import Surface
from creeping.shadow.critical_points import critical_points
from creeping.shadow.curves import LineNodes
from creeping.shadow.nodes import prepared
from creeping.shadow.panels import PanelCurve, newton_step
from creeping.shadow.refinement import shadow_curves

NODES = (512, 16_384)
"""Fewest and most nodes of a curve."""
A_PANEL = 24
"""Nodes on the shortest panel."""


def followed(body: Surface, wave: FloatArray) -> tuple[LineNodes, tuple[PanelCurve, ...], float]:
    """Nodes of the line of a wave, its curves in panels, and the least |n.q|/|q| at a critical point.

    Raises
    ------
    SingularIncidenceError
        If the line crosses itself, or so nearly that its curves cannot be told apart.
    """
    mesh = prepared(body).coarsest
    critical = critical_points(body, wave, mesh)
    critical.refuse()
    curves = tuple(sorted(shadow_curves(body, wave, mesh, critical), key=lambda curve: -curve.length))
    points, spacing = [], []
    for curve in curves:
        shortest = float(np.min(np.diff(curve.breaks)))
        count = int(np.clip(np.ceil(A_PANEL * curve.length / shortest), *NODES))
        points.append(curve.at(curve.length * np.arange(count) / count))
        spacing.append(curve.length / count)
    x = np.concatenate(points)
    _, tangents = newton_step(body, wave, x)
    p = headings(wave, x)
    bent = np.einsum("nij,ni,nj->n", body.hessian(x), p, p)
    nodes = LineNodes(
        points=x,
        tangents=tangents,
        curvature=bent / np.linalg.norm(body.gradient(x), axis=1),
        starts=np.cumsum([0, *map(len, points)]).astype(np.int64),
        spacing=np.array(spacing),
        # panels are exact to rounding
        error=1e-12,
    )
    return nodes, curves, critical.distance
