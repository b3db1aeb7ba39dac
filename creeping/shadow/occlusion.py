"""Whether the body stands before a point: F along the backward ray x - t d, t > 0.

F starts there with F = 0, F' = 0, F'' = d.Hd at a point of the shadow line, so behind a convex point it first rises;
the ray enters the body where F is negative at a sample, or at a minimum between samples.

Sources: [K84]; Derivations, R10.
"""

import numpy as np

from creeping._typing import BoolArray, FloatArray
from creeping.geometry.evaluators import evaluators
from creeping.geometry.surface import Surface
from creeping.kernels.threads import in_slices


def occluded(body: Surface, points: FloatArray, direction: FloatArray, reach: FloatArray | float = np.inf) -> BoolArray:
    """Whether the backward ray x - t d, 0 < t < reach, enters the body: points (n, 3), d (3,) or (n, 3) -> (n,).

    It leaves a point along the normal's side, or touches there from a convex side.
    """
    from creeping.shadow.kernels.arcs import blocked_rays

    hidden = np.zeros(len(points), dtype=bool)
    if not len(points):
        return hidden
    # copies: of arrays that cannot be written kernels would be compiled once more
    directions = np.array(np.broadcast_to(direction, points.shape), dtype=float, order="C")
    limit = np.array(np.broadcast_to(reach, len(points)), dtype=float)
    box = np.ascontiguousarray(body.bounds, dtype=float)
    columns = np.ascontiguousarray(points.T, dtype=float)
    with evaluators(body) as parts:

        def run(part: slice) -> None:
            some = np.ascontiguousarray(columns[:, part])
            blocked_rays(*parts[:2], box, directions[part], some, limit[part], hidden[part])

        in_slices(run, len(points), seconds=1e-5)
    return hidden
