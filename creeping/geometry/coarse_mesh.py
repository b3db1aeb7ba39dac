"""Coarse meshes of quadrilaterals and triangles of a body, from which the squares that cover it are made.

Of a smooth body they are the quadrilaterals around the grid edges that it crosses; of a body of pieces its triangles,
joined by two where they make a good quadrilateral: convex, its corners no sharper than SQUARE, and no two sides in a
row along one crease, between which there is no corner.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from creeping._typing import Any, BoolArray, FloatArray, IntArray
from creeping.errors import SurfaceError
from creeping.geometry.piecewise import is_piecewise, pieces_of, tips_of
from creeping.geometry.quadrature import nearest_points
from creeping.geometry.surface import Surface, size
from creeping.geometry.tile_rules import SAME
from creeping.geometry.triangulation import quadrilaterals

SIDES_OF_PIECES = (1.0, 0.7, 0.5, 0.3)
"""Longest sides of the triangles of a body of pieces, in its sizes."""
CELLS = (3, 4, 5, 6, 8, 12, 24)
"""Cells of those of a smooth body; what is not of the kind of the last has missed parts."""
SQUARE = 0.8
"""Largest |cos| of a corner of the quadrilateral that two triangles make."""
EVENED = 5
"""Times that vertices inside pieces move to the middle of their neighbours."""
MOST = 4000
"""Triangles of a body of pieces that squares are made of: of more there are too many nodes at any wavenumber."""


class CoarseMesh(NamedTuple):
    """Corners of squares at (0, 0), (1, 0), (1, 1), (0, 1); of a triangle the first is the last again.

    ``places`` are points of the squares (m, n, n, 3) at Lobatto's, of a body that knows them.
    """

    vertices: FloatArray
    corners: IntArray
    pieces: IntArray
    places: FloatArray | None = None

    @property
    def kind(self) -> int:
        """Euler's number of a closed mesh of quadrilaterals."""
        return len(self.vertices) - len(self.corners)


def coarse_meshes(body: Any) -> Iterator[CoarseMesh | SurfaceError]:
    """Coarse meshes of a body, the coarsest first, or why one is none."""
    smooth = not is_piecewise(body)
    finest: CoarseMesh | None = None
    if smooth:
        try:
            finest = _of_cells(body, CELLS[-1])
        except SurfaceError as error:
            yield error
            return
    for step in CELLS[:-1] if smooth else SIDES_OF_PIECES:
        try:
            mesh = _of_cells(body, int(step)) if smooth else _of_pieces(body, step * size(body))
        except (SurfaceError, ValueError) as error:
            yield error if isinstance(error, SurfaceError) else SurfaceError(str(error))
            continue
        # a thin body may pass between the points of a coarse grid
        if finest is None or mesh.kind == finest.kind:
            yield mesh
    if finest is not None:
        yield finest


def _of_cells(body: Surface, cells: int) -> CoarseMesh:
    """Quadrilaterals of a smooth body on so many cells."""
    vertices, tiles = quadrilaterals(body, cells=cells, fewest=min(cells, 24), mirrored=True)
    return CoarseMesh(vertices, tiles, np.zeros(len(tiles), dtype=np.int64))


def _of_pieces(body: Any, longest: float) -> CoarseMesh:
    """Squares and triangles of a body of pieces, with sides no longer than that, L."""
    corners, _, pieces = body.tiles(longest)
    if len(corners) > MOST:
        raise SurfaceError(f"{len(corners)} triangles are more than the {MOST} that squares are made of")
    grid = np.round(corners.reshape(-1, 3) / (SAME * size(body))).astype(np.int64)
    _, first, numbers = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    vertices, triangles = corners.reshape(-1, 3)[first], numbers.reshape(-1, 3)
    vertices = _evened(body, vertices, triangles, np.asarray(pieces))
    return CoarseMesh(vertices, *_paired(vertices, triangles, np.asarray(pieces), tip_vertices(body, vertices)))


def _evened(body: Any, vertices: FloatArray, triangles: IntArray, pieces: IntArray) -> FloatArray:
    """Vertices (n, 3) of which those inside pieces have moved to the middle of their neighbours: no slivers there."""
    from scipy.sparse import coo_array

    n = len(vertices)
    owner = np.full(n, -1)
    owner[triangles] = pieces[:, None]
    shared = np.zeros(n, dtype=bool)
    np.logical_or.at(shared, triangles, owner[triangles] != pieces[:, None])
    free = np.flatnonzero(~shared & (owner >= 0) & ~tip_vertices(body, vertices))
    ends = triangles[:, [0, 1, 2, 1, 2, 0]].reshape(-1, 2, 3).swapaxes(1, 2).reshape(-1, 2)
    beside = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(n, n)).tocsr()
    beside.data[:] = 1.0
    count = np.asarray(beside.sum(axis=1)).ravel()[free, None]
    every = pieces_of(body)
    for _ in range(EVENED if len(free) else 0):
        moved = (beside @ vertices)[free] / count
        for number in np.unique(owner[free]):
            mine = owner[free] == number
            moved[mine] = nearest_points(every[number], moved[mine])[0]
        # a place that the piece does not have stays as it was
        there = np.all(np.isfinite(moved), axis=1)
        vertices = vertices.copy()
        vertices[free[there]] = moved[there]
    return vertices


def tip_vertices(body: Any, vertices: FloatArray) -> BoolArray:
    """Which vertices (n, 3) are tips (n,)."""
    tips = tips_of(body)[1] if is_piecewise(body) else np.zeros((0, 3))
    apart = np.linalg.norm(vertices[:, None] - tips, axis=2)
    return np.asarray(np.min(apart, axis=1, initial=np.inf) < 1e-6 * size(body))


def _paired(vertices: FloatArray, triangles: IntArray, pieces: IntArray, tip: BoolArray) -> tuple[IntArray, IntArray]:
    """Corners of squares that two triangles of a piece make with each other, best first, and of those left alone."""
    m = len(triangles)
    # of each side the triangle, and its corners from the one opposite to it
    turned = np.concatenate([np.roll(triangles, -shift, axis=1) for shift in range(3)])
    owner = np.tile(np.arange(m), 3)
    sides = np.sort(turned[:, 1:], axis=1)
    order = np.lexsort(sides.T)
    same = np.flatnonzero(np.all(sides[order][1:] == sides[order][:-1], axis=1))
    one, two = order[same], order[same + 1]
    fit = (pieces[owner[one]] == pieces[owner[two]]) & (turned[one, 1] == turned[two, 2])
    one, two = one[fit], two[fit]
    square = np.stack([turned[one, 0], turned[one, 1], turned[two, 0], turned[one, 2]], axis=1)
    x = vertices[square]
    ahead, behind = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = np.sum(ahead * behind, axis=2) / np.linalg.norm(ahead, axis=2) / np.linalg.norm(behind, axis=2)
    # convex where all corners turn the same way
    around = np.cross(ahead, behind)
    convex = np.all(np.sum(around * around.sum(axis=1, keepdims=True), axis=2) > 0, axis=1)
    # two sides in a row along one crease have no corner between them
    beyond = np.full(3 * m, -1)
    fit = np.flatnonzero(pieces[owner[order[same]]] != pieces[owner[order[same + 1]]])
    beyond[order[same][fit]], beyond[order[same + 1][fit]] = (
        pieces[owner[order[same + 1]]][fit],
        pieces[owner[order[same]]][fit],
    )
    around = np.stack([beyond[(row + shift * m) % (3 * m)] for row, shift in ((one, 2), (two, 1), (two, 2), (one, 1))])
    ear = np.any((around >= 0) & (around == np.roll(around, 1, axis=0)), axis=0)
    worst = np.where(convex & ~ear & ~np.any(tip[square], axis=1), np.max(np.abs(cosine), axis=1), np.inf)
    taken, squares, owners = np.zeros(m, dtype=bool), [], []
    for row in np.argsort(worst, kind="stable"):
        a, b = owner[one[row]], owner[two[row]]
        if worst[row] > SQUARE:
            break
        if not (taken[a] or taken[b]):
            taken[a] = taken[b] = True
            squares.append(square[row])
            owners.append(pieces[a])
    left = np.flatnonzero(~taken)
    alone = triangles[left]
    # the tip first, or the sharpest corner, which is where the square is drawn together
    x = vertices[alone]
    opposite = np.linalg.norm(np.roll(x, -1, axis=1) - np.roll(x, 1, axis=1), axis=2)
    start = np.where(tip[alone].any(axis=1), np.argmax(tip[alone], axis=1), np.argmin(opposite, axis=1))
    alone = np.take_along_axis(alone, (start[:, None] + np.arange(3)) % 3, axis=1)
    corners = np.concatenate([np.array(squares, dtype=np.int64).reshape(-1, 4), alone[:, [0, 1, 2, 0]]])
    return corners, np.concatenate([np.array(owners, dtype=np.int64), pieces[left]])
