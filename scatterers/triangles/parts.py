"""What of a mesh is the body: one of several parts, holes closed, crossing parts united.

Parts are connected through edges, and numbered from 1 by area, the largest first. Holes are closed by triangles from
their border to its middle. The outer surface of parts that cross is that of their union, by the library manifold3d.

Also here: sheets of a mesh that touch along an edge or in a vertex, taken apart so that each vertex has one umbrella.

About an edge from a to b a triangle stands at an angle θ, in the direction d across the edge. One that runs from a to b
has its outward normal along e x d, towards larger θ: the body is on the side of smaller θ; of one that runs from b to
a on the other. So the body fills the wedges from a triangle of the second kind up to the next, of the first, and these
two belong to one sheet, unless triangles hang together by other edges. Of an odd number the flattest pairs belong
together, and what is left over, as of a fin, has an open edge there.

Corners of triangles that are joined across edges make umbrellas; each has a vertex of its own.

Also here: small crossings of a mesh cut out: triangles that cross others go with their neighbours, and the holes are
closed.

Lids go from the border of a hole to its middle, and may cross something themselves: then
they are cut out again with what is around them, so that the hole grows, for a few rounds. What was cut stays a small
share of the area; else the mesh is left as it is.
"""

import importlib.util
from collections.abc import Callable

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from scatterers.triangles.topology import (
    KEPT,
    Edges,
    components,
    crossings,
    edges_of,
    flat_normals,
    oriented,
    umbrellas,
)

MOST_CUT = 0.1
"""Share of the area that may be cut out."""


Note = Callable[[str], None]


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
    for k in range(min(int(parts.max()) + 1, 8)):
        mine = triangles[parts == k]
        size = " x ".join(f"{v:.3g}" for v in np.ptp(vertices[mine].reshape(-1, 3), axis=0) * scale)
        texts.append(f"{k + 1}: {len(mine)} triangles, {size} m")
    rest = int(parts.max()) + 1 - len(texts)
    return "; ".join(texts) + (f"; {rest} more" if rest > 0 else "")


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
    return flat_normals(vertices[triangles])[1]


def taken_apart(name: str, vertices: FloatArray, triangles: IntArray, note: Note) -> tuple[FloatArray, IntArray]:
    """Vertices (n, 3) and triangles (m, 3) of the same surface, those doubled at which sheets touch.

    Examples
    --------
    >>> import numpy as np, trimesh
    >>> two = trimesh.util.concatenate([trimesh.creation.box(), trimesh.creation.box()])
    >>> two.vertices[8:] += [1, 1, 0]
    >>> two.merge_vertices()
    >>> len(two.vertices), [len(part) for part in taken_apart("boxes", two.vertices, two.faces, print)]
    1 edge and 2 vertices of boxes at which sheets touch taken apart
    (14, [16, 24])
    """
    edges = edges_of(triangles)
    shared = np.flatnonzero(edges.faces > 2)
    # with so many it is soup, and left as it is
    if len(shared) > 100_000:
        return vertices, triangles
    left, right, parted = _joined(vertices, triangles, edges, shared)
    count, label = umbrellas(edges, left, right)
    used = np.unique(triangles)
    if count <= len(used):
        return vertices, triangles
    _, first = np.unique(label, return_index=True)
    old = triangles.ravel()[first]
    order = np.argsort(old, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    places = int(np.sum(np.bincount(old) > 1))
    apart = f"{parted} edge{'s' * (parted != 1)} and " if parted else ""
    note(f"{apart}{places} {'vertices' if places > 1 else 'vertex'} of {name} at which sheets touch taken apart")
    return vertices[old[order]], rank[label].reshape(-1, 3).astype(np.int64)


def _joined(
    vertices: FloatArray, triangles: IntArray, edges: Edges, shared: IntArray
) -> tuple[IntArray, IntArray, int]:
    """Corners whose edges are joined (k,) and (k,), and how many edges of more than two triangles were parted."""
    order = np.argsort(edges.number, kind="stable")
    begin = np.concatenate([[0], np.cumsum(edges.faces)])
    two = begin[:-1][edges.faces == 2]
    left, right = [order[two]], [order[two + 1]]
    # parts as far as they hang together by other edges
    sheet = components(len(triangles), left[0] // 3, right[0] // 3)[1]
    for edge in shared:
        corners = order[begin[edge] : begin[edge + 1]]
        angle = _angles(vertices, triangles, edges.ends[edge], corners)
        pairs = corners[_pairs(angle, edges.forward[corners], sheet[corners // 3])]
        left.append(pairs[:, 0])
        right.append(pairs[:, 1])
    return np.concatenate(left), np.concatenate(right), len(shared)


def _angles(vertices: FloatArray, triangles: IntArray, ends: IntArray, corners: IntArray) -> FloatArray:
    """Angles of triangles about an edge, from the first of them, 0 to 2 pi."""
    a, b = vertices[ends]
    along = (b - a) / max(float(np.linalg.norm(b - a)), 1e-300)
    third = vertices[triangles.ravel()[corners - corners % 3 + (corners + 2) % 3]] - a
    across = third - (third @ along)[:, None] * along
    return np.asarray(np.arctan2(across @ np.cross(along, across[0]), across @ across[0]) % (2 * np.pi))


def _pairs(angle: FloatArray, forward: BoolArray, sheet: IntArray) -> IntArray:
    """Pairs (k, 2) of triangles about an edge that belong together; what is left over has an open edge there.

    First those of one sheet, then those between which the body is, one within the other, then the flattest.
    """
    left = set(range(len(angle)))
    found: list[tuple[int, int]] = []

    def take(pairs: list[tuple[int, int]]) -> None:
        for i, j in pairs:
            if i in left and j in left:
                found.append((i, j))
                left.difference_update((i, j))

    for number in np.unique(sheet):
        mine = np.flatnonzero(sheet == number)
        if len(mine) == 2 and forward[mine[0]] != forward[mine[1]]:
            take([(int(mine[0]), int(mine[1]))])
    rest = sorted(left, key=lambda k: float(angle[k]))
    if sum(bool(forward[k]) for k in rest) * 2 == len(rest):
        begun: list[int] = []
        for k in rest + rest:
            if k in left and not forward[k] and k not in begun:
                begun.append(k)
            elif k in left and forward[k] and begun:
                take([(begun.pop(), k)])
    flat = [(abs(abs(angle[i] - angle[j]) - np.pi), i, j) for i in left for j in left if forward[i] > forward[j]]
    take([(i, j) for _, i, j in sorted(flat)])
    return np.array(found, dtype=np.int64).reshape(-1, 2)


def uncrossed(
    name: str, vertices: FloatArray, triangles: IntArray, largest: float, scale: float, note: Note
) -> tuple[FloatArray, IntArray]:
    """Vertices (n, 3) and triangles (m, 3) of the mesh without its crossings, as given where that cannot be done.

    ``largest`` is the size of the largest hole that is closed, m; lengths times ``scale`` are metres.
    """
    x, t, cut, share = vertices, triangles, 0, 0.0
    whole = float(areas(x, t).sum())
    for _ in range(6):
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
    x, t = taken_apart(name, vertices, triangles, silent)
    part = parts_of(x, t)
    size = areas(x, t)
    if float(size[part > 0].sum()) > MOST_CUT * float(size.sum()):
        return None
    x, t = compact(x, t[part == 0])
    x, t = capped(name, x, t, largest, scale, silent)
    if np.any(edges_of(t).faces != 2):
        return None
    try:
        return x, oriented(name, x, t, silent)
    except ValueError:
        return None


def silent(_: str) -> None:
    """Note of what needs no telling."""
