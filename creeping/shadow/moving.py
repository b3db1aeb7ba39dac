"""Points next to shadow lines, moved onto them: many points, each with its own wave.

Sources: Derivations, R7.
"""

from typing import NamedTuple

import numpy as np

from creeping._typing import FloatArray
from creeping.geometry.evaluators import evaluators
from creeping.geometry.incident import rows_of
from creeping.geometry.surface import Surface
from creeping.kernels.threads import in_threads

EACH = 2e-7
"""Seconds of a point, about."""


class Moved(NamedTuple):
    """Points on lines (n, 3), L, the lines' unit tangents (n, 3), and the sizes (n,) of the steps that would follow, L.

    Of points from which there is no step nothing is finite.
    """

    points: FloatArray
    tangents: FloatArray
    left: FloatArray


def moved_onto_lines(body: Surface, waves: FloatArray, points: FloatArray, *, reach: float, steps: int) -> Moved:
    """Points of {F = 0, grad F.q = 0} by Newton steps of least norm, the same in whatever company.

    Parameters
    ----------
    body : Surface
    waves : (n, 3) or (n, 4)
        d of plane waves, or (d, w).
    points : (n, 3), L
        Next to the lines of their waves.
    reach : float, L
        Longest step.
    steps : int
        At most so many; a point stays where its next one would be rounding.
    """
    from creeping.shadow.kernels.moving import move, work_space

    waves = rows_of(waves)
    found = np.array(points, dtype=float, order="C")
    tangents, left = np.empty_like(found), np.empty(len(found))
    with evaluators(body) as parts:

        def run(part: slice) -> None:
            move(*parts[:2], waves[part], found[part], reach, steps, work_space(), tangents[part], left[part])

        in_threads(run, len(found), seconds=EACH)
    return Moved(found, tangents, left)
