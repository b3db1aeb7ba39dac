"""Topology of a triangle mesh: equal vertices merged, edges counted, triangles turned to face outwards.

Every edge of a closed surface has two triangles, and an oriented one runs along it once in each direction. Whether
a mesh can be oriented is read off its double cover: triangle t twice, as it is and turned; neighbours that agree join
like with like, others like with turned; it can be unless some t is joined with its own turned copy.

Also here: pairs of triangles of a mesh that cross each other.

A segment pq crosses the triangle abc where the volumes [a b c p] and [a b c q] differ in sign and [p q a b],
[p q b c], [p q c a] do not; triangles cross if an edge of one crosses the other. Pairs that share a vertex are tried
with the edges opposite to it, pairs that share an edge only for being folded onto each other. Candidates come from a
sweep along one axis. Touching is no crossing, and overlapping parts of one plane are seen only by the edges around.

Sources: Derivations, B10.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray

KEPT = 1000
"""Pairs that are returned at most."""


Note = Callable[[str], None]


class Edges(NamedTuple):
    """Edges of a mesh.

    Attributes
    ----------
    ends : (e, 2)
        Vertices, the lower number first.
    faces : (e,)
        Triangles at the edge.
    number : (3 m,)
        Edge that follows each corner.
    forward : (3 m,)
        Whether the triangle runs from the lower number to the higher.
    """

    ends: IntArray
    faces: IntArray
    number: IntArray
    forward: BoolArray

    @property
    def sides(self) -> IntArray:
        """Corners (e, 2) of a closed mesh that the edges follow, in the triangles on both sides."""
        return np.argsort(self.number, kind="stable").reshape(-1, 2)


def flat_normals(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Unit normals (m, 3) and areas (m,) of triangles (m, 3, 3); 0 where they have none."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice = np.linalg.norm(normal, axis=1)
    return normal / np.maximum(twice, 1e-300)[:, None], 0.5 * twice


def edges_of(triangles: IntArray) -> Edges:
    """Number the edges."""
    first, last = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    low, high = np.minimum(first, last), np.maximum(first, last)
    size = int(triangles.max()) + 1
    code, number, count = np.unique(low * size + high, return_inverse=True, return_counts=True)
    return Edges(np.stack([code // size, code % size], axis=1), count, number.ravel(), first < last)


def cleaned(
    name: str, vertices: FloatArray, triangles: IntArray, note_equal: Note, note: Note
) -> tuple[FloatArray, IntArray]:
    """Merge vertices, drop degenerate and double triangles and unused vertices.

    ``note_equal`` is told of exactly equal vertices, which a format without vertex numbers has anyway.

    Raises
    ------
    ValueError
        If no triangle is left.
    """
    used = np.unique(triangles)
    # -0.0 and 0.0 are the same place
    _, first, inverse = np.unique(vertices[used] + 0.0, axis=0, return_index=True, return_inverse=True)
    merged = len(used) - len(first)
    place = np.full(len(vertices), -1)
    # in the order of their first appearance, so that a clean mesh stays as it is
    rank = np.argsort(np.argsort(first))
    place[used] = rank[inverse.ravel()]
    points, corners = vertices[used][np.sort(first)], place[triangles]
    if merged:
        note_equal(f"{merged} of {len(used)} vertices of {name} were doubles of others; merged")
    if len(triangles) != len(corners := _proper(name, corners, note)) and not len(corners):
        raise ValueError(f"all {len(triangles)} triangles of {name} are degenerate; export it again")
    return _close_gaps(name, points, corners, note)


def _proper(name: str, triangles: IntArray, note: Note) -> IntArray:
    """Triangles with three corners, each set of corners once."""
    a, b, c = triangles.T
    kept: IntArray = triangles[(a != b) & (b != c) & (c != a)]
    if dropped := len(triangles) - len(kept):
        note(f"{dropped} of {len(triangles)} triangles of {name} were degenerate (two equal corners); dropped")
    if not len(kept):
        return kept
    _, first, count = np.unique(np.sort(kept, axis=1), axis=0, return_index=True, return_counts=True)
    if not (doubled := len(kept) - len(first)):
        return np.asarray(kept)
    note(f"{doubled} of {len(kept)} triangles of {name} were doubles of others; dropped")
    order = np.argsort(first)
    single = kept[first[order]]
    # two triangles back to back are a flap on a closed surface: without either, each of its edges has two triangles
    edges = edges_of(single)
    flap = (count[order] > 1) & np.all(edges.faces[edges.number].reshape(-1, 3) % 2 == 1, axis=1)
    if not flap.any() or flap.all():
        return np.asarray(single)
    note(f"{int(flap.sum())} flaps of two triangles back to back stood on {name}; dropped")
    return np.asarray(single[~flap])


def _close_gaps(name: str, vertices: FloatArray, triangles: IntArray, note: Note) -> tuple[FloatArray, IntArray]:
    """Merge vertices of open edges that differ by rounding, more of it while edges stay open; drop what is not used."""
    # in diagonals of the body: single precision, and a few digits
    for close in (1e-6, 1e-5, 1e-4):
        edges = edges_of(triangles)
        border = np.unique(edges.ends[edges.faces == 1])
        if not len(border):
            break
        vertices, triangles = _merged(name, vertices, triangles, border, close, edges, note)
    used, corners = np.unique(triangles, return_inverse=True)
    return vertices[used], corners.reshape(-1, 3).astype(np.int64)


def _merged(
    name: str, vertices: FloatArray, triangles: IntArray, border: IntArray, close: float, edges: Edges, note: Note
) -> tuple[FloatArray, IntArray]:
    """Merge vertices of a border that are so close, in diagonals of the body."""
    from scipy.spatial import cKDTree

    reach = close * float(np.linalg.norm(np.ptp(vertices, axis=0)))
    # never over a sizeable part of an edge, however fine the mesh
    length = np.linalg.norm(vertices[edges.ends[:, 0]] - vertices[edges.ends[:, 1]], axis=1)
    reach = min(reach, 0.01 * float(length.mean()))
    pairs = border[cKDTree(vertices[border]).query_pairs(reach, output_type="ndarray")]
    if not len(pairs):
        return vertices, triangles
    n = len(vertices)
    _, label = components(n, pairs[:, 0], pairs[:, 1])
    _, first = np.unique(label, return_index=True)
    note(f"{n - len(first)} of {n} vertices of {name} were within {reach:.2g} of its units of others; merged")
    triangles = _proper(name, first[label][triangles], note)
    if not len(triangles):
        raise ValueError(f"all triangles of {name} are degenerate; export it again")
    return vertices, triangles


def oriented(name: str, vertices: FloatArray, triangles: IntArray, note: Note) -> IntArray:
    """Triangles that face outwards, or ValueError unless the mesh is closed, one body and of two sides.

    ``vertices`` are relative to the body's middle; where something is, is told relative to it.
    """
    edges = edges_of(triangles)
    _check_edges(name, vertices, edges)
    # the corners of both triangles at each edge, next to each other
    order = edges.sides
    _check_pieces(name, vertices, triangles, order, edges)
    agree = edges.forward[order[:, 0]] != edges.forward[order[:, 1]]
    if not agree.all():
        # triangles to turn so that all agree with their neighbours
        count = len(triangles)
        left, right = (order // 3).T
        starts = np.concatenate([left, left + count])
        ends = np.concatenate([np.where(agree, right, right + count), np.where(agree, right + count, right)])
        _, label = components(2 * count, starts, ends)
        if np.any(label[:count] == label[count:]):
            raise ValueError(f"{name} has one side only, like a Moebius strip or Klein bottle; give a body")
        turned = np.asarray(label[:count] > label[count:])
        triangles = np.where(turned[:, None], triangles[:, ::-1], triangles)
        wrong = min(int(turned.sum()), len(triangles) - int(turned.sum()))
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    volume = float(np.sum(a * np.cross(b, c))) / 6
    if not abs(volume) > 1e-9 * float(np.linalg.norm(np.ptp(vertices, axis=0))) ** 3:
        raise ValueError(f"{name} encloses no volume; give a body, not a sheet")
    if not agree.all():
        note(f"{wrong} of {len(triangles)} triangles of {name} faced the other way than their neighbours; turned")
    elif volume < 0:
        note(f"all {len(triangles)} triangles of {name} faced inwards; turned")
    return triangles if volume > 0 else np.ascontiguousarray(triangles[:, ::-1])


def _check_edges(name: str, vertices: FloatArray, edges: Edges) -> None:
    for wrong, what, remedy in (
        (
            edges.faces == 1,
            "are open",
            "close them, or give cap= with the size of the largest hole, m; what a large cap= leaves open has pinched "
            "borders, to be repaired where the mesh was made",
        ),
        (edges.faces > 2, "have more than two triangles", "sheets meet there: remove inner or double walls"),
    ):
        if bad := int(wrong.sum()):
            middles = vertices[edges.ends[wrong]].mean(axis=1)
            place = np.round(middles[0], 6).tolist()
            raise ValueError(
                f"{bad} of {len(wrong)} edges of {name} {what}, the first near {place} from the middle of its box, "
                f"in its own unit, the others within {np.ptp(middles, axis=0).max():.3g}; {remedy}"
            )


def _check_pieces(name: str, vertices: FloatArray, triangles: IntArray, order: IntArray, edges: Edges) -> None:
    """ValueError unless the surface is one piece and no vertex joins two sheets."""
    left, right = order[:, 0], order[:, 1]
    pieces, label = components(len(triangles), left // 3, right // 3)
    if pieces > 1:
        counts = np.sort(np.bincount(label))[::-1]
        boxes = [vertices[triangles[label == k]].reshape(-1, 3) for k in range(min(pieces, 50))]
        largest = max(boxes, key=lambda p: float(np.ptp(p, axis=0).max()))
        low, high = largest.min(0), largest.max(0)
        inner = sum(bool(np.all(p.min(0) > low) and np.all(p.max(0) < high)) for p in boxes)
        hint = f" ({inner} of them within the box of the largest: cavities or inner parts?)" if inner else ""
        raise ValueError(
            f"{name} holds {pieces} separate surfaces{hint}, of {', '.join(map(str, counts[:5]))} "
            f"{'... ' if pieces > 5 else ''}triangles; take one, e.g. part='largest', or all with union=True"
        )
    count, label = umbrellas(edges, left, right)
    if count > len(vertices):
        _, corner = np.unique(label, return_index=True)
        shared = np.bincount(triangles.ravel()[corner], minlength=len(vertices)) > 1
        place = np.round(vertices[shared][0], 6).tolist()
        raise ValueError(
            f"{int(shared.sum())} vertices of {name} join sheets that touch in a point, the first near {place} from "
            "the middle of its box, in its own unit; take them apart"
        )


def umbrellas(edges: Edges, left: IntArray, right: IntArray) -> tuple[int, IntArray]:
    """How many groups there are of corners of one vertex joined through edges, and that of each corner (3 m,).

    ``left`` and ``right`` (k,) are corners whose edges are joined: the ends of both are the same places.
    """
    after = next_corner(left), next_corner(right)
    same = edges.forward[left] == edges.forward[right]
    ends = np.concatenate([np.where(same, right, after[1]), np.where(same, after[1], right)])
    return components(len(edges.number), np.concatenate([left, after[0]]), ends)


def next_corner(corner: IntArray) -> IntArray:
    """Corner (k,) of the flat triangles that follows in the same triangle."""
    return corner - corner % 3 + (corner + 1) % 3


def cut(vertices: FloatArray, triangles: IntArray, edge: IntArray, at: FloatArray) -> tuple[FloatArray, IntArray]:
    """Vertices and triangles of a mesh (n, 3) and (m, 3) with more vertices (c, 3) on its edges with numbers (c,).

    Triangles with such edges fall into two, three or four.

    Examples
    --------
    >>> import numpy as np
    >>> points = np.array([[0.5, 0.5, 0], [0.5, 0, 0.5]])
    >>> cut(np.eye(3), np.array([[0, 1, 2]]), np.array([0, 1]), points)[1].tolist()
    [[0, 3, 4], [3, 1, 4], [1, 2, 4]]
    """
    edges = edges_of(triangles)
    new = np.full(len(edges.ends), -1)
    new[edge] = len(vertices) + np.arange(len(edge))
    # on the edges that follow the corners
    between = new[edges.number].reshape(-1, 3)
    count = (between >= 0).sum(axis=1)
    parts = [triangles[count == 0]]
    for number in (1, 2, 3):
        t, m = triangles[count == number].copy(), between[count == number].copy()
        for _ in range(2):
            # turned until the first edge is cut, of two cuts the last as well
            wrong = (m[:, 0] < 0) | ((m[:, 2] < 0) & (number == 2))
            t[wrong], m[wrong] = np.roll(t[wrong], -1, axis=1), np.roll(m[wrong], -1, axis=1)
        (a, b, c), (ab, bc, ca) = t.T, m.T
        split = {
            1: [(a, ab, c), (ab, b, c)],
            2: [(a, ab, ca), (ab, b, ca), (b, c, ca)],
            3: [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)],
        }[number]
        parts += [np.stack(part, axis=1) for part in split]
    return np.concatenate([vertices, at]), np.concatenate(parts)


def components(count: int, starts: IntArray, ends: IntArray) -> tuple[int, IntArray]:
    """Number of connected parts of a graph, and that of each of its ``count`` nodes (count,)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(starts), np.int8), (starts, ends)), shape=(count, count))
    found, label = connected_components(graph, directed=False)
    return int(found), label.astype(np.int64)


def crossings(vertices: FloatArray, triangles: IntArray) -> tuple[int, IntArray]:
    """Number of pairs of triangles that cross, and the first of them, (k, 2).

    Parameters
    ----------
    vertices : (n, 3), near the origin
    triangles : (m, 3)

    Examples
    --------
    >>> import numpy as np
    >>> corners = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [0.5, 0.5, -1], [0.5, 0.5, 1], [3, 3, 0]])
    >>> crossings(corners, np.array([[0, 1, 2], [3, 4, 5]]))[0]
    1
    """
    from scatterers.kernels.facet_rays import sweep

    corners = vertices[triangles]
    low, high = corners.min(axis=1), corners.max(axis=1)
    # along the axis on which the triangles are shortest, compared with the whole
    axis = int(np.argmin(np.mean(high - low, axis=0) / np.maximum(np.ptp(vertices, axis=0), 1e-300)))
    order = np.argsort(low[:, axis], kind="stable")
    turn = [axis, (axis + 1) % 3, (axis + 2) % 3]
    pairs = np.empty((KEPT, 2), np.int64)
    low, high, points = (np.ascontiguousarray(v[..., turn]) for v in (low[order], high[order], vertices))
    count = int(sweep(points, np.ascontiguousarray(triangles[order]), low, high, pairs))
    return count, order[pairs[: min(count, KEPT)]]
