"""Points inside a body, by their depth under its surface.

A point is as deep as the nearest of many nodes of the body is far, less what the nodes are apart.

Sources: Derivations, B11.
"""

from collections.abc import Callable

import numpy as np

from creeping._typing import BoolArray, FloatArray
from creeping.geometry.kept import kept
from creeping.geometry.parts import inside
from creeping.geometry.quadrature import body_nodes
from creeping.geometry.surface import Surface, size

TRIED = 20_000
"""Points of the box that are tried."""
FEWER = 4000
"""The same where each costs a sum over nodes."""


def inner_points(body: Surface, depth: float, count: int) -> FloatArray:
    """Points inside, at least ``depth``, L, under the surface, evenly spread: (count, 3), L.

    Fewer, or none, where the body is hardly or nowhere that thick; the same ones at every call.

    Examples
    --------
    >>> import scatterers as sc
    >>> points = inner_points(sc.Sphere(), 0.3, 50)
    >>> points.shape, bool(np.linalg.norm(points, axis=1).max() < 0.7)
    ((50, 3), True)
    """
    x, distance = kept(body, "depths", lambda: _depths(body))
    return np.asarray(x[distance > depth][:count])


def box_points(body: Surface, within: Callable[[FloatArray], BoolArray] | None = None) -> FloatArray:
    """Points inside, evenly spread over the body's box (n, 3), L; the same ones at every call.

    ``within`` tells which are, if it is not the body that does.
    """
    from scipy.stats import qmc

    low, high = np.asarray(body.bounds, dtype=float)
    x = low + (high - low) * qmc.Halton(3, scramble=False).random(TRIED if within is None else FEWER)
    return np.asarray(x[inside(body, x) if within is None else within(x)])


def _depths(body: Surface) -> tuple[FloatArray, FloatArray]:
    """Points inside (n, 3) and bounds of their depth (n,), L."""
    x = box_points(body)
    return x, body_nodes(body, 4 / size(body)).distance(x)
