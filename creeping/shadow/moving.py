"""Points next to shadow lines moved onto them, each onto the line of its own wave."""

from typing import NamedTuple

import numpy as np

from creeping._typing import FloatArray
from creeping.geometry.evaluators import evaluators
from creeping.geometry.incident import rows_of
from creeping.geometry.surface import Surface
from creeping.kernels.threads import in_threads


class Moved(NamedTuple):
    """Points on lines (n, 3), L, with the lines' unit tangents (n, 3) and kappa_n(q) (n,), 1/L.

    ``left`` (n,) are the sizes of the steps that would follow, L. Of points without a step nothing is finite.
    """

    points: FloatArray
    tangents: FloatArray
    curvature: FloatArray
    left: FloatArray


def moved_onto_lines(body: Surface, waves: FloatArray, points: FloatArray, *, reach: float, steps: int) -> Moved:
    """Points of {F = 0, grad F.q = 0} by Newton steps of least norm, the same to the last bit alone or with others.

    Parameters
    ----------
    body : Surface
    waves : (n, 3) or (n, 4), or (1, ...) of one for all
        d of plane waves, or (d, w).
    points : (n, 3), L
        Next to the lines of their waves.
    reach : float, L
        Longest step.
    steps : int
        At most so many; a point stays where its next one would be rounding.
    """
    from creeping.shadow.kernels.newton import move, work_space

    # of arrays of another kind kernels would be compiled once more
    waves = np.array(np.broadcast_to(rows_of(waves), (len(points), 4)), order="C")
    n, found = len(points), np.array(points, dtype=float, order="C")
    tangents, curvature, left = np.empty_like(found), np.empty(n), np.empty(n)
    with evaluators(body) as parts:

        def run(part: slice) -> None:
            out = tangents[part], curvature[part], left[part]
            move(*parts[:2], waves[part], found[part], reach, steps, work_space(), *out)

        in_threads(run, n)
    return Moved(found, tangents, curvature, left)
