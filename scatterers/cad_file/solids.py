"""Solids of a CAD file taken apart: bodies that touch share points, edges or whole faces, and each is closed by itself.

A face between two solids bounds both. Its triangles are taken twice, once with the other triangles of each solid, and
vertices are merged within a solid only; so parts are what they are in the file, and the outer surface of all is that of
their union. Faces of no solid stay together.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from scatterers.triangles.topology import cleaned

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Note = Callable[[str], None]


def cleaned_apart(
    name: str, points: FloatArray, triangles: IntArray, of: IntArray, bounds: IntArray, note: Note
) -> tuple[FloatArray, IntArray]:
    """Vertices and triangles of all solids, cleaned one by one.

    Parameters
    ----------
    points : (n, 3)
    triangles : (m, 3)
    of : (m,)
        Face of each triangle.
    bounds : (j, 2)
        Faces and the solids that they bound.
    """
    solids = np.unique(bounds[:, 1])
    groups = [np.isin(of, bounds[bounds[:, 1] == solid, 0]) for solid in solids]
    groups.append(~np.isin(of, bounds[:, 0]))
    groups = [mine for mine in groups if mine.any()]
    if len(groups) < 2:
        return cleaned(name, points, triangles, note, note)
    vertices, corners, count = [], [], 0
    notes: list[str] = []
    for mine in groups:
        used, own = np.unique(triangles[mine], return_inverse=True)
        x, t = cleaned(name, points[used], own.reshape(-1, 3).astype(np.int64), notes.append, notes.append)
        vertices.append(x)
        corners.append(t + count)
        count += len(x)
    if notes:
        note(notes[0] + (f"; {len(notes) - 1} more of that kind in other solids" if len(notes) > 1 else ""))
    return np.concatenate(vertices), np.concatenate(corners)
