"""Small crossings of a mesh cut out: triangles that cross others go with their neighbours, and the holes are closed.

Lids go from the border of a hole to its middle (`scatterers.triangles.parts`), and may cross something themselves: then
they are cut out again with what is around them, so that the hole grows, for a few rounds. What was cut stays a small
share of the area; else the mesh is left as it is.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from scatterers.triangles.crossings import KEPT, crossings
from scatterers.triangles.parts import areas, capped, compact, parts_of
from scatterers.triangles.sheets import taken_apart
from scatterers.triangles.topology import edges_of, oriented

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Note = Callable[[str], None]
ROUNDS = 6
MOST_CUT = 0.1
"""Share of the area that may be cut out."""


def uncrossed(
    name: str, vertices: FloatArray, triangles: IntArray, largest: float, scale: float, note: Note
) -> tuple[FloatArray, IntArray]:
    """Vertices (n, 3) and triangles (m, 3) of the mesh without its crossings, as given where that cannot be done.

    ``largest`` is the size of the largest hole that is closed, m; lengths times ``scale`` are metres.
    """
    x, t, cut, share = vertices, triangles, 0, 0.0
    whole = float(areas(x, t).sum())
    for _ in range(ROUNDS):
        count, pairs = crossings(x, t)
        if not count:
            if cut:
                note(
                    f"{cut} triangles of {name} that crossed others, or next to them, {100 * share:.2g} % of its area, "
                    "cut out and their holes closed"
                )
            return x, t
        if count >= KEPT:
            break
        near = np.zeros(len(x), dtype=bool)
        near[t[pairs.ravel()]] = True
        gone = near[t].any(axis=1)
        cut += int(gone.sum())
        share += float(areas(x, t[gone]).sum()) / whole
        if share > MOST_CUT or gone.all():
            break
        closed = _closed(name, *compact(x, t[~gone]), largest, scale)
        if closed is None:
            break
        x, t = closed
    return vertices, triangles


def _closed(
    name: str, vertices: FloatArray, triangles: IntArray, largest: float, scale: float
) -> tuple[FloatArray, IntArray] | None:
    """The largest part with its holes closed, None if it is not closed then."""
    x, t = taken_apart(name, vertices, triangles, _silent)
    part = parts_of(x, t)
    size = areas(x, t)
    if float(size[part > 0].sum()) > MOST_CUT * float(size.sum()):
        return None
    x, t = compact(x, t[part == 0])
    x, t = capped(name, x, t, largest, scale, _silent)
    if np.any(edges_of(t).faces != 2):
        return None
    try:
        return x, oriented(name, x, t, _silent)
    except ValueError:
        return None


def _silent(_: str) -> None:
    """Note of what is told as a whole."""
