"""Closed triangulation of F = 0 by dual contouring of its sign on a box grid (surface nets).

Every cell of the grid with corners of both signs gives one vertex, every grid edge whose ends differ in sign one
quadrilateral between the four cells around it; vertices are then brought onto F = 0. The mesh is closed and
oriented by construction and follows the topology of F at the grid's resolution, whatever the genus.

Sources: [G98], [JLSW02]; Derivations, B8.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from creeping._typing import BoolArray, FloatArray, IntArray
from creeping.errors import SurfaceError
from creeping.geometry.surface import Surface, step_onto

MAX_POINTS = 12_000_000
"""Grid points of the finest triangulation."""
OTHERS = (0.94, 0.88, 0.81)
"""Shares of the cells that are tried where more would be too many: a grid may meet a saddle just so that its triangles
are not closed, and another does not."""
ACROSS = 24
"""Cells across each side of a box, at least."""
LARGEST = 1e40
"""Extent of a body, and inverse of the least one, beyond which powers of lengths leave the range of numbers."""


@dataclass(frozen=True, repr=False)
class Triangulation:
    """Closed oriented triangle mesh with vertices on the body.

    Attributes
    ----------
    vertices : (n, 3), L
    triangles : (m, 3)
        Vertex numbers, counter-clockwise seen from outside.
    """

    vertices: FloatArray
    triangles: IntArray

    @property
    def edge_length(self) -> float:
        """Root mean square of the edge lengths, L."""
        corners = self.vertices[self.triangles]
        return float(np.sqrt(np.mean(np.sum((corners - np.roll(corners, 1, axis=1)) ** 2, axis=-1))))

    @property
    def area(self) -> float:
        """Sum of the triangles' areas, L^2."""
        a, b, c = np.moveaxis(self.vertices[self.triangles], 1, 0)
        return float(0.5 * np.sum(np.linalg.norm(np.cross(b - a, c - a), axis=1)))

    @property
    def components(self) -> int:
        """Number of connected bodies."""
        return connected(len(self.vertices), self.triangles[:, [0, 1, 1, 2]].reshape(-1, 2))[0]

    @property
    def euler_characteristic(self) -> int:
        """V - E + F: 2 for genus 0, 0 for a torus."""
        return len(self.vertices) - len(self.triangles) // 2

    def __repr__(self) -> str:
        return f"Triangulation({len(self.vertices)} vertices, edge {self.edge_length:.3g} L)"


def connected(count: int, pairs: IntArray) -> tuple[int, IntArray]:
    """Number of connected parts that pairs (k, 2) make of ``count`` things, and the part of each (count,)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    found, part = connected_components(coo_array((np.ones(len(pairs)), pairs.T), shape=(count, count)), directed=False)
    return int(found), np.asarray(part)


def triangulate(body: Surface, *, cells: int = 48) -> Triangulation:
    """Triangulate F = 0 inside its box.

    Parameters
    ----------
    body : Surface
        Its box is widened by two cells.
    cells : int
        Cells along the side of a cube of the box's volume; raised by half where that does not resolve the topology.

    Returns
    -------
    Triangulation

    Raises
    ------
    SurfaceError
        If F has no zero in the box, reaches its faces, or no grid of at most MAX_POINTS resolves its topology.

    Examples
    --------
    >>> import scatterers as sc
    >>> ring = sc.Torus()
    >>> mesh = triangulate(ring, cells=24)
    >>> mesh.euler_characteristic, mesh.components
    (0, 1)
    """
    vertices, tiles = quadrilaterals(body, cells=cells)
    return Triangulation(vertices, np.concatenate([tiles[:, [0, 1, 2]], tiles[:, [0, 2, 3]]]))


def checked_extent(bounds: FloatArray) -> FloatArray:
    """Box (2, 3) of a body, if it is one and of a size whose squares are numbers.

    Raises
    ------
    SurfaceError
        If it is none.
    """
    try:
        box = np.asarray(bounds, dtype=float)
    except (TypeError, ValueError) as error:
        raise SurfaceError(f"the bounds of the body are no numbers: {error}") from error
    if box.shape != (2, 3) or not np.all(np.isfinite(box)) or not np.all(box[1] > box[0]):
        raise SurfaceError(f"bounds {box.tolist()} are not two corners of a box; give [[xmin, ...], [xmax, ...]]")
    extent = float(np.max(box[1] - box[0]))
    if not 1 / LARGEST < extent < LARGEST:
        raise SurfaceError(
            f"the body's box is {extent:.3g} L wide; take a unit of length in which it is from {1 / LARGEST:g} "
            f"to {LARGEST:g}"
        )
    return box


def quadrilaterals(
    body: Surface, *, cells: int = 48, fewest: int = ACROSS, mirrored: bool = False
) -> tuple[FloatArray, IntArray]:
    """Vertices (n, 3), L, and quadrilaterals (m, 4), counter-clockwise, that `triangulate` halves; see there.

    There are ``fewest`` cells or more across each side of the box. If ``mirrored``, those of a body whose mirrors are
    the middle planes of the box are so, too.
    """
    box = checked_extent(body.bounds)
    for count in _counts(box, cells, fewest):
        axes = _grid_axes(box, count, fewest, mirrored=mirrored)
        values = _grid_values(body, axes)
        vertices, number = _cell_vertices(values, values < 0, axes)
        tiles = _around_edges(values < 0, number)
        open_at = _unclosed(tiles)
        if not len(open_at):
            break
    else:
        places = vertices[open_at]
        first, apart = ", ".join(f"{x:.4g}" for x in places[0]), np.ptp(places, axis=0).max()
        raise SurfaceError(
            f"{values.size} grid points do not resolve the surface at {len(open_at)} places, the first near "
            f"({first}), all within {apart:.3g} of each other: it is too thin there, or crosses itself; a mesh "
            "is to be refined or smoothed there"
        )
    reach = max(float(axis[1] - axis[0]) for axis in axes)
    # Newton along the gradient, each step at most `reach`; a vertex that fails raises
    points = vertices.copy()
    distance = np.full(len(points), np.inf)
    for _ in range(20):
        step, distance = step_onto(body.level(points), body.gradient(points), reach)
        points = points + step
        if not np.all(np.isfinite(points)):
            break
        if np.max(np.abs(distance)) < 1e-14 * max(1.0, float(np.abs(points).max())):
            break
    bad = ~(np.abs(distance) < 1e-9 * max(1.0, float(np.nanmax(np.abs(points)))))
    if bad.any():
        worst = vertices[bad][0]
        raise SurfaceError(
            f"{int(bad.sum())} of {len(points)} vertices found no point with F = 0 and grad F != 0 "
            f"(first near {np.round(worst, 4).tolist()}); the surface is not smooth there"
        )
    return points, tiles


def _counts(box: FloatArray, cells: int, fewest: int) -> Iterator[int]:
    """Cells to try: more by half while there may be, then a few less."""
    while True:
        yield cells
        finer = cells + cells // 2
        if np.prod([len(axis) for axis in _grid_axes(box, finer, fewest)]) > MAX_POINTS:
            break
        cells = finer
    for share in OTHERS:
        yield int(share * cells)


def _grid_axes(box: FloatArray, cells: int, fewest: int, *, mirrored: bool = False) -> list[FloatArray]:
    """Grid coordinates per axis, a cell or two beyond the box: cubic cells, but at least ``fewest`` across each side.

    Cells much flatter than long would miss the topology of a ring, hence cubes.
    """
    side = box[1] - box[0]
    count = np.clip(np.round(side / (np.prod(side) ** (1 / 3) / cells)), fewest, 1000).astype(int)
    spacing = side / count
    if mirrored:
        # the middle planes are halfway between grid points
        numbers = [2 * (int(n) // 2 + 2) for n in count]
        middle = 0.5 * (box[0] + box[1])
        return [middle[k] + spacing[k] * (np.arange(n) - 0.5 * (n - 1)) for k, n in enumerate(numbers)]
    # an irrational shift keeps grid points off the symmetry planes, where F is often exactly 0
    low = box[0] - (2 + 0.1 * np.sqrt([2.0, 3.0, 5.0])) * spacing
    return [low[k] + spacing[k] * np.arange(count[k] + 6) for k in range(3)]


def _grid_values(body: Surface, axes: list[FloatArray]) -> FloatArray:
    """F on the grid, checked: finite, negative somewhere, positive on the faces."""
    values = np.asarray(body.level(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)), dtype=float)
    if not np.all(np.isfinite(values)):
        count = int(np.sum(~np.isfinite(values)))
        raise SurfaceError(f"F is not finite at {count} of {values.size} grid points of its box; check the expression")
    inside = values < 0
    if not inside.any():
        raise SurfaceError(f"F has no negative value in its box ({values.size} points): no body; check bounds and sign")
    faces = int(sum(inside.take([0, -1], axis=k).sum() for k in range(3)))
    if faces:
        raise SurfaceError(f"F < 0 at {faces} points on the faces of its box: open, inverted or larger than its bounds")
    return values


def _cell_vertices(values: FloatArray, inside: BoolArray, axes: list[FloatArray]) -> tuple[FloatArray, IntArray]:
    """One vertex in each cell of mixed sign: the mean of the sign changes on its edges."""
    n = [len(axis) - 1 for axis in axes]
    cells, offsets = [], []
    for axis in range(3):
        start, stop = [slice(None)] * 3, [slice(None)] * 3
        start[axis], stop[axis] = slice(None, -1), slice(1, None)
        crossed = inside[tuple(start)] != inside[tuple(stop)]
        first, last = values[tuple(start)][crossed], values[tuple(stop)][crossed]
        edge, offset = np.argwhere(crossed), np.zeros((len(first), 3))
        offset[:, axis] = first / (first - last)
        b, c = (axis + 1) % 3, (axis + 2) % 3
        # the four cells around each edge
        for corner_b, corner_c in ((0, 0), (0, 1), (1, 0), (1, 1)):
            cell, own = edge.copy(), offset.copy()
            cell[:, b] -= corner_b
            cell[:, c] -= corner_c
            own[:, b], own[:, c] = corner_b, corner_c
            cells.append(cell)
            offsets.append(own)
    # F > 0 on the faces of the box: no crossed edge lies there, and all four cells are within
    flat, offset = np.ravel_multi_index(np.concatenate(cells).T, n), np.concatenate(offsets)
    count = np.bincount(flat, minlength=int(np.prod(n)))
    mixed = np.flatnonzero(count)
    number = np.full(n, -1, dtype=np.int64)
    number.ravel()[mixed] = np.arange(len(mixed))
    total = np.stack([np.bincount(flat, own, len(count))[mixed] for own in offset.T], axis=1)
    origin = np.array([axis[0] for axis in axes])
    spacing = np.array([axis[1] - axis[0] for axis in axes])
    cell = np.stack(np.unravel_index(mixed, n), axis=1)
    return origin + (cell + total / count[mixed][:, None]) * spacing, number


def _around_edges(inside: BoolArray, number: IntArray) -> IntArray:
    """Quadrilateral around each grid edge whose ends differ in sign, seen counter-clockwise from outside (m, 4)."""
    tiles = []
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        start = [slice(1, -1)] * 3
        stop = [slice(1, -1)] * 3
        start[axis], stop[axis] = slice(None, -1), slice(1, None)
        at_start, at_stop = inside[tuple(start)], inside[tuple(stop)]
        for outward in (True, False):
            edge = np.argwhere(at_start & ~at_stop) if outward else np.argwhere(~at_start & at_stop)
            edge[:, b] += 1
            edge[:, c] += 1
            corners = []
            for shift_b, shift_c in ((0, 0), (-1, 0), (-1, -1), (0, -1)):
                cell = edge.copy()
                cell[:, b] += shift_b
                cell[:, c] += shift_c
                corners.append(number[tuple(cell.T)])
            quad = np.stack(corners, axis=1)
            tiles.append(quad if outward else quad[:, ::-1])
    return np.concatenate(tiles)


def _unclosed(tiles: IntArray) -> IntArray:
    """First vertices of edges that are not once there and once reversed; none of a closed surface."""
    edges = np.stack([tiles, np.roll(tiles, -1, axis=1)], axis=-1).reshape(-1, 2)
    code = edges.min(axis=1) * (tiles.max() + 1) + edges.max(axis=1)
    sign = np.where(edges[:, 0] < edges[:, 1], 1, -1)
    keys, place, counts = np.unique(code, return_inverse=True, return_counts=True)
    wrong = (counts != 2) | (np.bincount(place, weights=sign, minlength=len(keys)) != 0)
    return np.unique(keys[wrong] // (tiles.max() + 1))
