"""Sheets of a mesh that touch along an edge or in a vertex, taken apart so that each vertex has one umbrella.

About an edge from a to b a triangle stands at an angle θ, in the direction d across the edge. One that runs from a to b
has its outward normal along e x d, towards larger θ: the body is on the side of smaller θ; of one that runs from b to
a on the other. So the body fills the wedges from a triangle of the second kind up to the next, of the first, and these
two belong to one sheet, unless triangles hang together by other edges. Of an odd number the flattest pairs belong
together, and what is left over, as of a fin, has an open edge there.

Corners of triangles that are joined across edges make umbrellas; each has a vertex of its own.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from scatterers.triangles.topology import Edges, components, edges_of

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Note = Callable[[str], None]
MOST_SHARED = 100_000
"""Edges of more than two triangles beyond which a mesh is soup, and left as it is."""


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
    if len(shared) > MOST_SHARED:
        return vertices, triangles
    left, right, parted = _joined(vertices, triangles, edges, shared)
    # a corner is followed by its edge: the ends of that of both triangles are the same places
    after = _next(left), _next(right)
    same = edges.forward[left] == edges.forward[right]
    starts = np.concatenate([left, after[0]])
    ends = np.concatenate([np.where(same, right, after[1]), np.where(same, after[1], right)])
    umbrellas, label = components(triangles.size, starts, ends)
    used = np.unique(triangles)
    if umbrellas <= len(used):
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


def _pairs(angle: FloatArray, forward: NDArray[np.bool_], sheet: IntArray) -> IntArray:
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


def _next(corner: IntArray) -> IntArray:
    return corner - corner % 3 + (corner + 1) % 3
