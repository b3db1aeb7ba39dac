"""What of a mesh is the body: one of several parts, holes closed, crossing parts united.

Parts are connected through edges, and numbered from 1 by area, the largest first. Holes are closed by triangles from
their border to its middle. The outer surface of parts that cross is that of their union, by the library manifold3d.
"""

import importlib.util
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from scatterers.triangles.topology import components, edges_of, oriented

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Note = Callable[[str], None]
LISTED = 8
"""Parts that an error lists."""


def parts_of(vertices: FloatArray, triangles: IntArray) -> IntArray:
    """Part of each triangle (m,), from 0, the largest area first.

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [9, 0, 0], [12, 0, 0], [9, 3, 0]])
    >>> parts_of(corners, np.array([[0, 1, 2], [3, 4, 5]]))
    array([1, 0])
    """
    number = edges_of(triangles).number
    m = len(triangles)
    # triangles and edges are the nodes of a graph
    label = components(m + int(number.max()) + 1, np.arange(3 * m) // 3, m + number)[1][:m]
    _, label = np.unique(label, return_inverse=True)
    order = np.argsort(-np.bincount(label.ravel(), areas(vertices, triangles)), kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return np.asarray(rank[label.ravel()], dtype=np.int64)


def every_part(name: str, vertices: FloatArray, triangles: IntArray, note: Note) -> tuple[FloatArray, IntArray]:
    """All parts, each turned outwards, without those that are inside others.

    Raises
    ------
    ValueError
        If one of them is not closed.
    """
    label = parts_of(vertices, triangles)
    count = int(label.max()) + 1
    if count == 1:
        return vertices, oriented(name, vertices, triangles, note)
    outside: list[int] = []
    corners = np.empty_like(triangles)
    for k in range(count):
        mine = triangles[label == k]
        used, own = np.unique(mine, return_inverse=True)
        turned = oriented(f"part {k + 1} of {name}", vertices[used], own.reshape(-1, 3).astype(np.int64), note)
        corners[label == k] = used[turned]
        # the largest area first: what holds a part comes before it
        if not any(_holds(vertices[corners[label == j]], vertices[used[0]]) for j in outside):
            outside.append(k)
    note(
        f"{name} has {count} parts"
        + (f", {count - len(outside)} of them inside others; left out" * (len(outside) < count))
    )
    return compact(vertices, corners[np.isin(label, outside)])


def _holds(corners: FloatArray, point: FloatArray) -> bool:
    """Whether a closed surface of triangles (m, 3, 3) holds a point, by the solid angle that it fills."""
    if np.any(point < corners.min(axis=(0, 1))) or np.any(point > corners.max(axis=(0, 1))):
        return False
    a, b, c = np.moveaxis(corners - point, 1, 0)
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    below = la * lb * lc + np.sum(a * b, axis=1) * lc + np.sum(b * c, axis=1) * la + np.sum(c * a, axis=1) * lb
    return bool(abs(np.sum(np.arctan2(np.sum(a * np.cross(b, c), axis=1), below))) > np.pi)


def listed(vertices: FloatArray, triangles: IntArray, parts: IntArray, scale: float) -> str:
    """The parts in words, sizes in m."""
    texts = []
    for k in range(min(int(parts.max()) + 1, LISTED)):
        mine = triangles[parts == k]
        size = " x ".join(f"{v:.3g}" for v in np.ptp(vertices[mine].reshape(-1, 3), axis=0) * scale)
        texts.append(f"{k + 1}: {len(mine)} triangles, {size} m")
    rest = int(parts.max()) + 1 - len(texts)
    return "; ".join(texts) + (f"; {rest} more" if rest > 0 else "")


def chosen_part(
    name: str, vertices: FloatArray, triangles: IntArray, part: str | int, scale: float, note: Note
) -> tuple[FloatArray, IntArray]:
    """Vertices and triangles of one part, by its number from 1, or the largest.

    Raises
    ------
    ValueError
        If there is no such part.
    """
    parts = parts_of(vertices, triangles)
    count = int(parts.max()) + 1
    number = 1 if part == "largest" else part
    if isinstance(number, bool) or not isinstance(number, int) or not 1 <= number <= count:
        raise ValueError(
            f'part = {part!r} is none of {name}; give "largest", or a number: '
            f"{listed(vertices, triangles, parts, scale)}"
        )
    if count > 1:
        left = triangles[parts != number - 1]
        share = float(areas(vertices, left).sum()) / float(areas(vertices, triangles).sum())
        note(f"part {number} of {count} of {name} taken; {100 * share:.2g} % of its area left out")
    return compact(vertices, triangles[parts == number - 1])


def compact(vertices: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray]:
    """The same triangles and the vertices that they use."""
    used, corners = np.unique(triangles, return_inverse=True)
    return vertices[used], corners.reshape(-1, 3).astype(np.int64)


def capped(
    name: str, vertices: FloatArray, triangles: IntArray, largest: float, scale: float, note: Note
) -> tuple[FloatArray, IntArray]:
    """Holes that are at most ``largest`` across, m, closed: each by triangles to the middle of its border."""
    corners, points = [triangles], [vertices]
    count = len(vertices)
    for loop in _borders(triangles):
        border = vertices[loop]
        across = float(np.linalg.norm(np.ptp(border, axis=0))) * scale
        if across > largest:
            continue
        middle = border.mean(axis=0)
        # a border runs along the triangles of the mesh, those of the lid run the other way
        ahead = np.roll(loop, -1)
        corners.append(np.column_stack([ahead, loop, np.full(len(loop), count)]))
        points.append(middle[None])
        count += 1
        where = ", ".join(f"{v * scale:.4g}" for v in middle)
        note(f"a hole of {name} with {len(loop)} edges, {across:.3g} m across, closed about ({where}) m")
    return np.concatenate(points), np.concatenate(corners)


def _borders(triangles: IntArray) -> list[IntArray]:
    """Closed borders of a mesh as vertices, in the order in which a triangle at the first runs along it.

    Each vertex of a border has two open edges if it has one umbrella; others are on no border that can be closed.
    """
    first, last = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    edges = edges_of(triangles)
    open_ = edges.faces[edges.number] == 1
    beside: dict[int, list[int]] = {}
    for a, b in zip(first[open_].tolist(), last[open_].tolist(), strict=True):
        beside.setdefault(a, []).append(b)
        beside.setdefault(b, []).append(a)
    left = {vertex for vertex, ends in beside.items() if len(ends) == 2}
    loops = []
    for begin, onward in zip(first[open_].tolist(), last[open_].tolist(), strict=True):
        loop, here = [begin], onward
        while here in left and here != begin:
            loop.append(here)
            left.discard(here)
            a, b = beside[here]
            here = b if a == loop[-2] else a
        # triangles may be turned against each other along it: they are oriented later
        if here == begin and begin in left and len(loop) >= 3:
            loops.append(np.array(loop, dtype=np.int64))
        left.discard(begin)
    return loops


def united(
    name: str,
    vertices: FloatArray,
    triangles: IntArray,
    oriented: Callable[[FloatArray, IntArray], IntArray],
    note: Note,
) -> tuple[FloatArray, IntArray]:
    """Outer surface of closed parts that cross or touch, which ``oriented`` turns outwards one by one.

    Raises
    ------
    ModuleNotFoundError
        If manifold3d is not installed.
    ValueError
        If a part is not closed, or crosses itself so that the library cannot take it.
    """
    if importlib.util.find_spec("manifold3d") is None:
        raise ModuleNotFoundError("uniting parts needs manifold3d: pip install 'creeping[mesh]'", name="manifold3d")
    import manifold3d

    parts = parts_of(vertices, triangles)
    solids = []
    for k in range(int(parts.max()) + 1):
        points, corners = compact(vertices, triangles[parts == k])
        corners = oriented(points, corners)
        mesh = manifold3d.Mesh64(points, corners.astype(np.uint64))
        solid = manifold3d.Manifold(mesh)
        if solid.status() != manifold3d.Error.NoError or solid.is_empty():
            raise ValueError(f"part {k + 1} of {name} is no solid ({solid.status().name}); repair it")
        solids.append(solid)
    whole = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add).to_mesh64()
    found = np.asarray(whole.vert_properties, dtype=float)[:, :3], np.asarray(whole.tri_verts).astype(np.int64)
    note(f"{len(solids)} parts of {name} united: {len(triangles)} triangles became {len(found[1])}")
    return found


def areas(vertices: FloatArray, triangles: IntArray) -> FloatArray:
    """Areas (m,) of triangles."""
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))
